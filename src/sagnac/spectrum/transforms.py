"""Fourier and cosine transforms of a series of any length, in bounded memory."""

import math
import tempfile
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from io import BufferedRandom
from threading import Lock
from typing import Any, Final

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from sagnac import series
from sagnac.arrays import FloatArray

# One thread in one transform: two that work on spans of their own do not wait for each other.
THREADS: Final = 1
# From this length on a transform is factored, in two rounds of short ones: they stay in cache,
# two threads share them, and of a long series little is in memory at a time.
_FACTORED: Final = 2**17
# Transforms in the first round, about; each is that much shorter than the whole.
_COLUMNS: Final = 256
# Frequencies of each of them that are combined at once: 4 MiB.
_COMBINED: Final = 1024
# Columns of the table of waves that products over samples are made with: 512 by a few hundred
# frequencies stay in the last cache, and a span has as many rows.
TONE_WIDTH: Final = 512


def transform_length(samples: int) -> int:
    """Length of the transform of a record: even, at least `samples`, and quick to transform."""
    return 2 * int(scipy.fft.next_fast_len((samples + 1) // 2, real=True))


def power_spectrum(increments: FloatArray, length: int, scale: float, taper: int = 0) -> FloatArray:
    """`scale` times the squares of Fourier sums at k / length, of a sine taper if `taper`."""
    samples = increments.size

    def piece(span: slice) -> FloatArray:
        if not taper:
            return increments[span]
        # A row's place and that in the row add up: by the sine of a sum, few sines are taken.
        step = taper * np.pi / (samples + 1)
        row = step * np.arange(span.start + 1, span.stop + 1, TONE_WIDTH)[:, np.newaxis]
        along = step * np.arange(TONE_WIDTH)
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

            run_columns(split, filled, max(1, 4 * series.SPAN // count), *release_of)
            run_columns(transformed, count, max(1, series.SPAN // (2 * size)))
        results = stack.enter_context(_table(1, width, np.float64))
        number = np.arange(count)[:, np.newaxis] * (-2j * np.pi / length)
        turns = np.exp(number * np.arange(min(_COMBINED, half)))

        def combined(some: slice) -> None:
            block = spectra.read(slice(0, count), some) * np.exp(number * some.start)
            block *= turns[:, : some.stop - some.start]
            store(results, some, scipy.fft.fft(block, axis=0, overwrite_x=True))

        run_columns(combined, half, _COMBINED)
        return results.first_row()


def _columns(length: int) -> int:
    """The divisor of `length` that is nearest `_COLUMNS`, by ratio."""
    divisors = np.arange(1, 5 * _COLUMNS)
    divisors = divisors[length % divisors == 0]
    return int(divisors[np.argmin(np.abs(np.log(divisors / _COLUMNS)))])


def run_columns(
    work: Callable[[slice], None], size: int, length: int, *release_of: FloatArray
) -> None:
    """Do `work` on every span of columns."""
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
