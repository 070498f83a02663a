"""Spectra of gyro increments: periodograms, their noise floor, sums over table angle and time.

Powers here are per sample: white increments of variance s^2 have an expected
periodogram of s^2 at every frequency. `density` turns them into (rad/s)^2/Hz.
"""

import math
import tempfile
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from io import BufferedRandom
from threading import Lock
from typing import Any, Final

import finufft
import numpy as np
import scipy.fft
from numpy.typing import NDArray
from scipy.optimize import nnls

from sagnac import series
from sagnac.recording import FloatArray

# One thread in one transform: two that work on spans of their own do not wait for each other.
THREADS: Final = 1

# From this length on a transform is factored, in two rounds of short ones: they stay in cache,
# two threads share them, and of a long series little is in memory at a time.
_FACTORED: Final = 2**17
# Transforms in the first round, about; each is that much shorter than the whole.
_COLUMNS: Final = 256
# Frequencies of each of them that are combined at once: 4 MiB.
_COMBINED: Final = 1024

_FLOOR_HALF_WIDTH: Final = 256  # bins; the median of 513 ordinates is good to 6 %
_FLOOR_MOST_HALF_WIDTH: Final = 4096
_NUFFT_TOLERANCE: Final = 1e-9
# Columns of the table of waves that products over samples are made with: 512 by a few hundred
# frequencies stay in the last cache, and a span has as many rows.
_TONE_WIDTH: Final = 512
# Frequencies worked on at once: their tables take 12 MiB.
_TONES_AT_ONCE: Final = 512
# A frequency times a lag is exact where the first has 23 bits after the point and the second,
# counted in halves of a sample, 29.
_FREQUENCY_STEP: Final = 2.0**-23
_TAPERS: Final = 5
# An ordinate this many floors high in a narrow bin is a line, not noise: exp(-9) of them by chance.
_LINE_RATIO: Final = 9.0
_LAW_ROUNDS: Final = 16


def transform_length(samples: int) -> int:
    """Length of the transform of a record: even, at least `samples`, and quick to transform."""
    return 2 * int(scipy.fft.next_fast_len((samples + 1) // 2, real=True))


def periodogram(increments: FloatArray, padding: int = 1) -> FloatArray:
    """Power of the increments at k / (padding * transform_length(size)) cycles a sample.

    Parameters
    ----------
    increments
        (samples,) in memory or mapped; no more than some spans of them are held at a time.
    padding
        Frequencies for each one of the unpadded transform.

    Returns
    -------
    (padding * transform_length(size) // 2 + 1,) in the unit of `increments` squared, a series.
    """
    return _power(increments, padding * transform_length(increments.size), 1.0 / increments.size)


def multitaper(increments: FloatArray, tapers: int = _TAPERS) -> FloatArray:
    """Power of the increments at the frequencies of `periodogram`, averaged over sine tapers.

    Riedel and Sidorenko (1995). Where a periodogram's leakage falls as f^-2, no faster than a
    rate random walk does, that of the tapers falls as f^-4. Each ordinate has twice `tapers`
    degrees of freedom, and resolves (tapers + 1) / (2 size) cycles a sample either side.

    Parameters
    ----------
    increments
        (samples,), without their mean.
    tapers
        How many.

    Returns
    -------
    (transform_length(size) // 2 + 1,) in the unit of `increments` squared.
    """
    length = transform_length(increments.size)
    # The squares of a sine taper sum to half of size + 1.
    scale = 2.0 / ((increments.size + 1) * tapers)
    power = _power(increments, length, scale, 1)
    for order in range(2, tapers + 1):
        more = _power(increments, length, scale, order)
        for span in series.spans(power.size, series.SPAN):
            power[span] += more[span]
            series.release(power, more)
    return power


def _power(increments: FloatArray, length: int, scale: float, taper: int = 0) -> FloatArray:
    """`scale` times the squares of Fourier sums at k / length, of a sine taper if `taper`."""
    samples = increments.size

    def piece(span: slice) -> FloatArray:
        if not taper:
            return increments[span]
        # A row's place and that in the row add up: by the sine of a sum, few sines are taken.
        step = taper * np.pi / (samples + 1)
        row = step * np.arange(span.start + 1, span.stop + 1, _TONE_WIDTH)[:, np.newaxis]
        along = step * np.arange(_TONE_WIDTH)
        sine = np.sin(row) * np.cos(along)
        sine += np.cos(row) * np.sin(along)
        return np.asarray(sine.reshape(-1)[: span.stop - span.start] * increments[span])

    if length < _FACTORED:
        sums = scipy.fft.rfft(piece(slice(0, samples)), length, workers=THREADS)
        power = np.square(sums.real)
        power += np.square(sums.imag)
        power *= scale
        return np.asarray(power)
    count = _columns(length)
    size = length // count

    def store(powers: _Table, some: slice, block: NDArray[np.complex128]) -> None:
        power = np.square(block.real)
        power += np.square(block.imag)
        power *= scale
        for index, row in enumerate(power):
            # Frequencies above half a cycle are those of the real series below, mirrored.
            if 2 * index < count:
                powers.write(0, size * index + some.start, row[np.newaxis])
            else:
                last = length - size * index - some.stop + 1
                powers.write(0, last, row[np.newaxis, ::-1])

    return _factored(piece, samples, length, length // 2 + 1, store, increments)


def cosine_length(samples: int) -> int:
    """The most samples, `samples` or a few less, of which `cosine_transform` is factored."""
    if samples < _FACTORED:
        return samples
    while not _COLUMNS // 2 <= _columns(samples) <= 2 * _COLUMNS:
        samples -= 1
    return samples


def cosine_transform(values: FloatArray) -> FloatArray:
    """Cosine transform (DCT-II, orthonormal).

    A Fourier transform of as many real values, the even ones forwards and then the odd ones
    backwards (Makhoul 1980, doi:10.1109/TASSP.1980.1163351), factored where it is long.

    Parameters
    ----------
    values
        (samples,) in memory or mapped, as many as `cosine_length` gives; no more than some spans
        of them are held at a time.

    Returns
    -------
    (samples,) in the unit of `values`, a series.
    """
    samples = values.size
    if samples < _FACTORED:
        return np.asarray(scipy.fft.dct(values, type=2, norm="ortho", workers=THREADS))
    count = _columns(samples)
    size = samples // count
    evens = (samples + 1) // 2

    def piece(span: slice) -> FloatArray:
        forwards = values[2 * span.start : 2 * min(span.stop, evens) : 2]
        first, last = samples - span.stop, samples - max(span.start, evens)
        backwards = values[2 * first + 1 : 2 * last + 1 : 2][::-1]
        return np.concatenate([forwards, backwards])

    quarter = -0.5j * np.pi / samples
    leads = np.exp(quarter * size * np.arange(count))[:, np.newaxis] * math.sqrt(2.0 / samples)

    def store(transform: _Table, some: slice, block: NDArray[np.complex128]) -> None:
        block *= leads
        block *= np.exp(quarter * np.arange(some.start, some.stop))
        for index, row in enumerate(block):
            first = size * index + some.start
            transform.write(0, first, row.real[np.newaxis])
            # The other half of a real series: what is not real here belongs at samples - k.
            behind = -row.imag[:0:-1] if first == 0 else -row.imag[::-1]
            transform.write(0, samples - first - row.size + 1, behind[np.newaxis])

    transform = _factored(piece, samples, samples, samples, store, values)
    transform[0] *= math.sqrt(0.5)
    return transform


def _factored(
    piece: Callable[[slice], FloatArray],
    samples: int,
    length: int,
    width: int,
    store: Callable[["_Table", slice, NDArray[np.complex128]], None],
    *release_of: FloatArray,
) -> FloatArray:
    """A series of `width` that `store` makes of the Fourier sums at k / length, block by block.

    With the length N1 N2, every N1-th of the `samples`, spans of which `piece` gives, goes into a
    transform of length N2, and the N1 results at one of their frequencies k, brought into
    phase, into one of length N1, which gives the frequencies k + N2 j of the whole (Bailey 1990,
    doi:10.1007/BF00162341). A block has a row for each j, and some k of up to N2 / 2; the other
    frequencies of a real series are those of the blocks mirrored.
    """
    count = _columns(length)
    size = length // count
    filled = -(-samples // count)
    half = size // 2 + 1
    with ExitStack() as stack:
        spectra = stack.enter_context(_table(count, half, np.complex128))
        with _table(count, filled, np.float64) as columns:

            def split(rows: slice) -> None:
                values = piece(slice(rows.start * count, min(rows.stop * count, samples)))
                if values.size % count:
                    values = np.append(values, np.zeros(-values.size % count))
                columns.write(0, rows.start, values.reshape(-1, count).T)

            def transformed(some: slice) -> None:
                spectra.write(
                    some.start, 0, scipy.fft.rfft(columns.read(some, slice(0, filled)), size)
                )

            _run(split, filled, max(1, 4 * series.SPAN // count), *release_of)
            _run(transformed, count, max(1, series.SPAN // (2 * size)))
        results = stack.enter_context(_table(1, width, np.float64))
        number = np.arange(count)[:, np.newaxis] * (-2j * np.pi / length)
        turns = np.exp(number * np.arange(min(_COMBINED, half)))

        def combined(some: slice) -> None:
            block = spectra.read(slice(0, count), some) * np.exp(number * some.start)
            block *= turns[:, : some.stop - some.start]
            store(results, some, scipy.fft.fft(block, axis=0, overwrite_x=True))

        _run(combined, half, _COMBINED)
        return results.first_row()


def _columns(length: int) -> int:
    """The divisor of `length` that is nearest `_COLUMNS`, by ratio."""
    divisors = np.arange(1, 5 * _COLUMNS)
    divisors = divisors[length % divisors == 0]
    return int(divisors[np.argmin(np.abs(np.log(divisors / _COLUMNS)))])


def _run(work: Callable[[slice], None], size: int, length: int, *release_of: FloatArray) -> None:
    for _ in series.each(work, size, length, release_of=release_of):
        pass


@dataclass(frozen=True, slots=True, kw_only=True)
class _Table:
    """Scratch numbers in rows, in memory or in a file, written and read in blocks by threads.

    A file is not mapped: writes to pages all over a mapping cost several times what plain ones
    do, and each may map two megabytes around it.
    """

    width: int
    values: NDArray[Any]
    file: BufferedRandom | None
    lock: Lock

    def write(self, row: int, column: int, block: NDArray[Any]) -> None:
        """Store `block`, (rows, columns), from a row and a column on."""
        if self.file is None:
            self.values[row : row + block.shape[0], column : column + block.shape[1]] = block
            return
        block = np.ascontiguousarray(block)
        with self.lock:
            for index, line in enumerate(block, start=row):
                self.file.seek((index * self.width + column) * block.itemsize)
                self.file.write(line.view(np.uint8))

    def read(self, rows: slice, columns: slice) -> NDArray[Any]:
        """What is stored there, (rows, columns); not to be written to."""
        if self.file is None:
            return self.values[rows, columns]
        block = np.empty((rows.stop - rows.start, columns.stop - columns.start), self.values.dtype)
        with self.lock:
            for index, line in enumerate(block, start=rows.start):
                self.file.seek((index * self.width + columns.start) * block.itemsize)
                self.file.readinto(line.view(np.uint8))
        return block

    def first_row(self) -> FloatArray:
        """The first row, as a series."""
        if self.file is None:
            return np.asarray(self.values[0])
        self.file.flush()
        return series.mapped(self.file, self.width)


@contextmanager
def _table(rows: int, width: int, dtype: type) -> Iterator[_Table]:
    itemsize = np.dtype(dtype).itemsize
    if rows * width * itemsize <= 8 * series.IN_MEMORY:
        yield _Table(width=width, values=np.empty((rows, width), dtype), file=None, lock=Lock())
    else:
        with tempfile.TemporaryFile(prefix="sagnac-") as file:
            yield _Table(width=width, values=np.empty(0, dtype), file=file, lock=Lock())


def angle_sums(
    phase: FloatArray,
    strengths: FloatArray,
    orders: int,
    *,
    tolerance: float = _NUFFT_TOLERANCE,
) -> NDArray[np.complex128]:
    """Sums of ``strengths * exp(-1j * k * phase)`` for k = 0 ... `orders`, by one NUFFT.

    Parameters
    ----------
    phase
        (samples,) rad; any real number, folded into one turn here.
    strengths
        (samples,) or (several, samples) real. Two take no longer than one.
    tolerance
        Error of the sums, relative to the sum of all strengths' magnitudes.

    Returns
    -------
    (orders + 1,) or (several, orders + 1) in the unit of the strengths.
    """
    # Of real strengths the sums at -k are the conjugates of those at k: two sets go into one
    # transform, as real and as imaginary part, and come apart again.
    several = np.atleast_2d(strengths)
    paired = several[0::2].astype(np.complex128)
    paired.imag[: several.shape[0] // 2] = several[1::2]
    modes = finufft.nufft1d1(
        np.remainder(phase, 2.0 * np.pi),
        paired,
        2 * orders + 1,
        eps=tolerance,
        isign=-1,
        nthreads=THREADS,
    )
    modes = modes.reshape(paired.shape[0], 2 * orders + 1)
    ahead, behind = modes[:, orders:], modes[:, orders::-1].conj()
    sums = np.empty((several.shape[0], orders + 1), dtype=np.complex128)
    sums[0::2] = 0.5 * (ahead + behind)
    sums[1::2] = -0.5j * (ahead - behind)[: several.shape[0] // 2]
    return sums.reshape(*strengths.shape[:-1], orders + 1)


def angle_series(
    phase: FloatArray, sums: NDArray[np.complex128], *, tolerance: float = _NUFFT_TOLERANCE
) -> FloatArray:
    """Real part of the sum of ``sums[k] * exp(1j * k * phase)`` over k, by one NUFFT.

    Parameters
    ----------
    phase
        (samples,) rad; any real number, folded into one turn here.
    sums
        (orders + 1,) for k = 0 ... orders, in any unit.
    tolerance
        Error of the series, relative to the sum of the sums' magnitudes.

    Returns
    -------
    (samples,) in the unit of the sums.
    """
    modes = np.zeros(2 * sums.size - 1, dtype=np.complex128)
    modes[sums.size - 1 :] = sums
    values = finufft.nufft1d2(
        np.remainder(phase, 2.0 * np.pi), modes, eps=tolerance, isign=1, nthreads=THREADS
    )
    return np.ascontiguousarray(values.real)


def tone_sums(
    values: FloatArray, frequencies: FloatArray, center: float, *, lag_unit: float
) -> NDArray[np.complex128]:
    """Sums of ``values * lag**r * exp(2j * pi * f * (n - center))`` for r = 0, 1, exactly.

    Here n is the sample number and ``lag = (n - center) * lag_unit``. The frequencies are any.
    Every span is a product of the samples, in rows, with a table of the waves along a row, and
    the rows are then brought into phase. Limit the BLAS to one thread around it: spans are shared
    out among threads here.

    Parameters
    ----------
    values
        (samples,) in memory or mapped.
    frequencies
        (frequencies,) cycles per sample.
    center
        Sample number of the phase origin, whole or half.
    lag_unit
        Unit of the lag, per sample: ``1 / samples`` keeps it near one.

    Returns
    -------
    (2, frequencies).
    """
    width = min(_TONE_WIDTH, max(values.size, 1))
    rows = -(-min(series.SPAN, values.size) // width)
    sums = np.empty((2, frequencies.size), dtype=np.complex128)
    for some in series.spans(frequencies.size, _TONES_AT_ONCE):
        wanted = frequencies[some]
        waves = _waves(wanted, width)
        # Real and imaginary parts side by side: a complex table is a real one of twice the width.
        table = np.hstack([waves, np.arange(width)[:, np.newaxis] * waves]).view(np.float64)
        of_rows = _waves(wanted * width, rows)

        def span_sums(
            span: slice,
            wanted: FloatArray = wanted,
            table: FloatArray = table,
            of_rows: NDArray[np.complex128] = of_rows,
        ) -> NDArray[np.complex128]:
            piece = values[span]
            if piece.size % width:
                piece = np.append(piece, np.zeros(-piece.size % width))
            along = (piece.reshape(-1, width) @ table).view(np.complex128)
            plain, ramped = along[:, : wanted.size], along[:, wanted.size :]
            ramped += plain * (width * np.arange(along.shape[0]))[:, np.newaxis]
            total = np.einsum("ij,ij->j", plain, of_rows[: along.shape[0]])
            tilted = np.einsum("ij,ij->j", ramped, of_rows[: along.shape[0]])
            tilted += (span.start - center) * total
            origin = np.exp(2j * np.pi * _turns(wanted, span.start - center))
            return np.stack([total * origin, lag_unit * tilted * origin])

        sums[:, some] = sum(
            series.each(span_sums, values.size, series.SPAN, release_of=(values,)),
            start=np.zeros((2, wanted.size), dtype=np.complex128),
        )
    return sums


def tones(
    start: int,
    count: int,
    center: float,
    frequencies: FloatArray,
    *,
    cosine: FloatArray,
    sine: FloatArray,
) -> FloatArray:
    """Sum of ``cosine * cos(c) + sine * sin(c)``, c = 2 pi f (n - center), over frequencies f.

    Limit the BLAS to one thread where several threads call this.

    Parameters
    ----------
    start, count
        Sample numbers n = start ... start + count - 1.
    center
        Sample number of the phase origin, whole or half.
    frequencies, cosine, sine
        (frequencies,) cycles per sample, and amplitudes in any unit.

    Returns
    -------
    (count,) in the unit of the amplitudes.
    """
    width = min(_TONE_WIDTH, max(count, 1))
    total = np.zeros((-(-count // width), width))
    for some in series.spans(frequencies.size, _TONES_AT_ONCE):
        here = frequencies[some]
        origin = np.exp(2j * np.pi * _turns(here, start - center))
        # The real part of a product of complex numbers: the first one's conjugate stands beside
        # the second, both as pairs of real ones.
        rows = _waves(here * width, total.shape[0])
        rows *= (cosine[some] - 1j * sine[some]) * origin
        np.conjugate(rows, out=rows)
        total += rows.view(np.float64) @ _waves(here, width).view(np.float64).T
    return total.reshape(-1)[:count]


def _turns(frequencies: FloatArray, lag: float) -> FloatArray:
    """``frequencies * lag`` in cycles, without whole ones and without the rounding of many."""
    coarse = np.rint(frequencies / _FREQUENCY_STEP) * _FREQUENCY_STEP
    cycles = coarse * lag
    return np.asarray((cycles - np.rint(cycles)) + (frequencies - coarse) * lag)


def _waves(frequencies: FloatArray, count: int) -> NDArray[np.complex128]:
    """(count, frequencies) values of ``exp(2j * pi * f * k)`` for k = 0 ... count - 1."""
    # Products of two short tables: a product is a tenth of an exponential.
    fine = 32
    coarse = -(-count // fine)
    near = np.exp(2j * np.pi * np.array([_turns(frequencies, k) for k in range(fine)]))
    far = np.exp(2j * np.pi * np.array([_turns(frequencies, fine * k) for k in range(coarse)]))
    return (far[:, np.newaxis] * near).reshape(coarse * fine, -1)[:count]


def noise_floor(power: FloatArray) -> FloatArray:
    """Expected power without lines, at every bin of a periodogram.

    Two steps. A sum of non-negative power laws in frequency (f^-2, f^-1, 1 and
    4 sin^2(pi f): rate random walk, flicker, angle random walk, quantization) is fitted
    to binned ordinates, lines excluded; it carries the slope at low frequency where
    bins are few. The running median of power over that fit then follows whatever else
    the noise does.

    Parameters
    ----------
    power
        (bins,) ordinates at k / size cycles per sample, k = 0 .... Bin 0 is not used.

    Returns
    -------
    (bins,) floor; bin 0 takes the value of bin 1.
    """
    bins = power.size
    if bins < 32:
        return np.full(bins, max(float(np.median(power[1:])) / np.log(2.0), np.finfo(float).tiny))
    law = _power_laws(power[1:])
    # The law at points half a percent apart, and straight lines between them: a part in 1e5.
    points = np.unique(
        np.concatenate([np.arange(1.0, min(bins, 401)), np.geomspace(1.0, bins - 1, 3000)])
    )
    levels = law(points)
    windows = _floor_windows(bins)
    ratios = np.empty(len(windows))

    def whitened(some: slice) -> None:
        first = windows[some.start].start
        stop = windows[some.stop - 1].stop
        white = power[first:stop] / np.interp(np.arange(float(first), stop), points, levels)
        for index in range(some.start, some.stop):
            window = windows[index]
            ratios[index] = _median(white[window.start - first : window.stop - first])

    # Sixty-four of the widest windows cover a span.
    _run(whitened, len(windows), 64, power)
    ratios /= np.log(2.0)
    knots = np.array([0.5 * (window.start + window.stop) for window in windows])
    floor = series.empty(bins)

    def filled(span: slice) -> None:
        number = np.arange(float(span.start), span.stop)
        np.multiply(
            np.interp(number, points, levels), np.interp(number, knots, ratios), out=floor[span]
        )

    _run(filled, bins, series.SPAN, floor)
    floor[0] = floor[1]
    return floor


def _floor_windows(bins: int) -> list[slice]:
    """Bins of which medians are taken; each begins at the middle of the one before."""
    windows: list[slice] = []
    start = 1
    while start < bins:
        half = int(min(max(0.1 * start, _FLOOR_HALF_WIDTH), _FLOOR_MOST_HALF_WIDTH))
        stop = min(start + 2 * half, bins)
        if stop - start < half and windows:
            break
        windows.append(slice(start, stop))
        start += half
    return windows


def _median(values: FloatArray) -> float:
    """The median, by partition of only those values that can be it (Floyd and Rivest 1975)."""
    size = values.size
    if size < 1024:
        return float(np.median(values))
    sample = np.sort(values[::8])
    # Four standard errors of the sample's median; where it lies beyond, nothing is gained.
    margin = int(2.0 * np.sqrt(sample.size))
    low, high = sample[sample.size // 2 - margin], sample[sample.size // 2 + margin]
    middle = values[(values >= low) & (values <= high)]
    below = int(np.count_nonzero(values < low))
    ranks = ((size - 1) // 2 - below, size // 2 - below)
    if ranks[0] < 0 or ranks[1] >= middle.size:
        return float(np.median(values))
    middle.partition(ranks)
    return 0.5 * float(middle[ranks[0]] + middle[ranks[1]])


def floor_scatter(bins: int) -> float:
    """Relative standard error of `noise_floor` at the middle of a periodogram of `bins`.

    That of the median of as many exponential variates as its window holds.
    """
    half = np.clip(0.05 * bins, _FLOOR_HALF_WIDTH, _FLOOR_MOST_HALF_WIDTH)
    return float(1.0 / (np.log(2.0) * np.sqrt(2.0 * half)))


def _power_laws(power: FloatArray) -> Callable[[FloatArray], FloatArray]:
    """Non-negative sum of power laws fitted to `power` by iterated Gamma weights.

    Parameters
    ----------
    power
        (bins,) ordinates at bins 1, 2, ....

    Returns
    -------
    The law, as a function of bin number.
    """
    edges = np.unique(
        np.concatenate([np.arange(9), np.geomspace(9, power.size, 160).astype(np.int64)])
    )
    starts, stops = edges[:-1], edges[1:]
    counts = stops - starts
    # Median over mean of n exponential variates, to within 1 %: 1 at n = 1, ln 2 for many.
    shrink = np.log(2.0) + (1.0 - np.log(2.0)) / counts
    level = np.empty(counts.size)

    def medians(some: slice) -> None:
        for index in range(some.start, some.stop):
            level[index] = _median(power[starts[index] : stops[index]])
            # The widest bins of a long series are each some spans.
            series.release(power)

    _run(medians, counts.size, 4)
    level /= shrink
    center = 0.5 * (starts + stops + 1.0)
    scale = max(float(np.median(level)), np.finfo(float).tiny)
    level = level / scale

    def basis(number: FloatArray) -> FloatArray:
        f = number / (2.0 * power.size)
        return np.column_stack([f**-2.0, 1.0 / f, np.ones_like(f), 4.0 * np.sin(np.pi * f) ** 2])

    design = basis(center)
    size = np.linalg.norm(design, axis=0)
    design = design / size
    model = np.maximum(level, 1e-12)
    target, keep = level, np.ones(level.size, dtype=bool)
    for round_ in range(_LAW_ROUNDS):
        # Maximum likelihood for Gamma ordinates is least squares with weights n / model^2.
        weight = np.where(keep, np.sqrt(counts) / model, 0.0)
        solution, _ = nnls(design * weight[:, None], target * weight)
        least = max(1e-12 * float(np.max(level)), np.finfo(float).tiny)
        model = np.maximum(design @ solution, least)
        highest = model * (1.0 + _LINE_RATIO / np.sqrt(counts))
        if round_ < _LAW_ROUNDS // 2:
            # What stands above the law may be a line or a law not seen yet: it pulls, but no
            # harder than a line may. Left out at once, a law could never come in.
            target = np.minimum(level, highest)
        else:
            target, keep = level, level < highest
    fitted = solution / size
    return lambda number: np.asarray(np.maximum(basis(number) @ fitted, 1e-12) * scale)


def density(power: FloatArray, sample_rate: float) -> FloatArray:
    """One-sided rate density, (rad/s)^2/Hz, of a periodogram of angle increments (rad^2)."""
    return 2.0 * sample_rate * power


def smoothed(power: FloatArray, points: int = 2000) -> tuple[FloatArray, FloatArray]:
    """Periodogram averaged into log-spaced bins, for a figure.

    Narrow peaks survive: each bin keeps its mean, and bins are as narrow as the
    periodogram's own at low frequency.

    Returns
    -------
    frequency, power
        (points or fewer,) cycles per sample, and mean power.
    """
    bins = power.size
    edges = np.unique(np.geomspace(1, bins, points + 1).astype(np.int64))
    mean = bin_sums(lambda span: power[span], edges, power) / np.diff(edges)
    center = (edges[:-1] + edges[1:] - 1) / 2.0
    return center / (2.0 * (bins - 1)), mean


def bin_sums(
    values_of: Callable[[slice], FloatArray], edges: NDArray[np.int64], *release_of: FloatArray
) -> FloatArray:
    """Sums of a series from each edge to the next.

    Parameters
    ----------
    values_of
        Gives a span of the series.
    edges
        (bins + 1,) places in it, ascending.
    release_of
        Mapped series that it is made of.

    Returns
    -------
    (bins,) in the unit of the series.
    """
    total = np.zeros(edges.size - 1)

    def sums(span: slice) -> tuple[slice, FloatArray]:
        start, stop = int(edges[0]) + span.start, int(edges[0]) + span.stop
        first = int(np.searchsorted(edges, start, "right")) - 1
        last = int(np.searchsorted(edges, stop, "left"))
        here = np.maximum(edges[first:last], start) - start
        return slice(first, last), np.add.reduceat(values_of(slice(start, stop)), here)

    for some, partial in series.each(
        sums, int(edges[-1] - edges[0]), series.SPAN, release_of=release_of
    ):
        total[some] += partial
    return total
