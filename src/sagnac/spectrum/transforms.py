"""Fourier and cosine transforms of any length, in bounded memory.

Long ones go in two rounds of short ones; a scratch file holds what crosses rows and columns.

With the length N1 N2, every N1-th of the samples goes into a transform of length N2, and the N1
results at one of their frequencies k, brought into phase, into one of length N1, which gives the
frequencies k + N2 j of the whole (Bailey 1990, doi:10.1007/BF00162341). The short transforms stay
in cache, and of a long array little is in memory at a time.
"""

import math
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from io import BufferedRandom
from typing import Any, Final

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from sagnac.core import arrays
from sagnac.core.arrays import ComplexArray, FloatArray, block_length, blocks, empty, mapped

# ---- scratch -----------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class Scratch:
    """Numbers in rows, in memory or in a file, written and read in blocks.

    A file is not mapped: writes to pages all over a mapping cost several times what plain ones
    do, and each may map two megabytes around it.

    Attributes
    ----------
    width
        Numbers in a row.
    values
        (rows, width) in memory; empty where they lie in the file.
    file
        None where they lie in memory.
    """

    width: int
    values: NDArray[Any]
    file: BufferedRandom | None

    def write(self, row: int, column: int, block: NDArray[Any]) -> None:
        """Store `block`, (rows, columns), from a row and a column on."""
        if self.file is None:
            self.values[row : row + block.shape[0], column : column + block.shape[1]] = block
            return
        block = np.ascontiguousarray(block, self.values.dtype)
        for index, line in enumerate(block, start=row):
            self.file.seek((index * self.width + column) * block.itemsize)
            self.file.write(line.view(np.uint8))

    def read(self, rows: slice, columns: slice) -> NDArray[Any]:
        """Stored values, (rows, columns); not to be written to."""
        if self.file is None:
            return self.values[rows, columns]
        block = np.empty((rows.stop - rows.start, columns.stop - columns.start), self.values.dtype)
        for index, line in enumerate(block, start=rows.start):
            self.file.seek((index * self.width + columns.start) * block.itemsize)
            self.file.readinto(line.view(np.uint8))
        return block

    def as_real(self) -> "Scratch":
        """The same room for twice as many real numbers a row, from that of complex ones."""
        values = self.values.view(self.values.real.dtype)
        return Scratch(width=2 * self.width, values=values, file=self.file)

    def as_array(self, size: int) -> FloatArray:
        """The first `size` of the numbers, which are real ones, row after row."""
        if self.file is None:
            return np.asarray(self.values.reshape(-1)[:size])
        self.file.flush()
        return mapped(self.file, size)


@contextmanager
def scratch(rows: int, width: int, dtype: type) -> Iterator[Scratch]:
    """Room for (rows, width) numbers, in a file if that is more than `arrays.IN_MEMORY` floats."""
    itemsize = np.dtype(dtype).itemsize
    if rows * width * itemsize <= 8 * arrays.IN_MEMORY:
        yield Scratch(width=width, values=np.empty((rows, width), dtype), file=None)
    else:
        with tempfile.TemporaryFile(prefix="sagnac-") as file:
            yield Scratch(width=width, values=np.empty(0, dtype), file=file)


# ---- factored ----------------------------------------------------------------------

# Transforms in the first round, about; each is that much shorter than the whole.
_COLUMNS: Final = 256
# Frequencies of each of them that are combined at once: 2 MiB.
_COMBINED: Final = 512
# Of these, waves that an exponential each is taken of.
_SHORT: Final = 16


@dataclass(frozen=True, slots=True, kw_only=True)
class Factors:
    """The two factors of a length.

    Attributes
    ----------
    count
        Transforms in the first round, N1 (columns).
    size
        Length of each, N2.
    """

    count: int
    size: int

    @property
    def length(self) -> int:
        """Length of the whole transform."""
        return self.count * self.size

    @property
    def frequencies(self) -> int:
        """Frequencies of one column, zero to half a cycle; the others mirror them."""
        return self.size // 2 + 1

    @property
    def is_balanced(self) -> bool:
        """Whether there are about as many columns as are quick to work with."""
        return _COLUMNS // 2 <= self.count <= 2 * _COLUMNS


def factors(length: int) -> Factors:
    """`length` by its divisor that is nearest the usual number of columns, by ratio.

    Examples
    --------
    >>> factors(1_000_000)
    Factors(count=250, size=4000)
    """
    divisors = np.arange(1, 5 * _COLUMNS)
    divisors = divisors[length % divisors == 0]
    count = int(divisors[np.argmin(np.abs(np.log(divisors / _COLUMNS)))])
    return Factors(count=count, size=length // count)


Store = Callable[[Scratch, int, ComplexArray], None]


def factored(
    values: FloatArray,
    by: Factors,
    size: int,
    store: Store,
    *,
    taper: int = 0,
    dtype: type = np.complex128,
) -> FloatArray:
    """An array of `size` made of the Fourier sums at k / length, block by block.

    Parameters
    ----------
    values
        Real, no more than the length; zeros follow up to it.
    by
        Factors of the length.
    size
        Of the result.
    store
        Called with rows of N2 numbers to write to, the first of some frequencies k of the columns,
        and the sums at k + N2 j, a row for each j. The other frequencies of real values mirror
        these.
    taper
        Order of the sine taper that the values are multiplied by, 0 for none.
    dtype
        In which it is done; ``numpy.complex64`` takes half the memory.
    """
    with scratch(by.count, by.frequencies, dtype) as spectra:
        split(values, by, spectra.as_real(), taper)
        columns = -(-values.size // by.count)
        # A caller that keeps no values lets them go before the second round.
        del values
        transform_columns(spectra, by, columns)
        with scratch(-(-size // by.size), by.size, np.float64) as result:
            combine_columns(spectra, by, lambda first, block: store(result, first, block))
            return result.as_array(size)


def split(values: FloatArray, by: Factors, columns: Scratch, taper: int = 0) -> None:
    """Every N1-th of the values, tapered, into a row of its own, zeros after the last."""
    for block in blocks(values.size, 4 * block_length(by.count)):
        here = values[block]
        if taper:
            here = sine_taper(values.size, taper, block.start, block.stop) * here
        if here.size % by.count:
            here = np.append(here, np.zeros(-here.size % by.count))
        columns.write(0, block.start // by.count, here.reshape(-1, by.count).T)


def transform_columns(spectra: Scratch, by: Factors, filled: int) -> None:
    """The first round, in place: a transform of length N2 of the `filled` numbers of every row."""
    for some in blocks(by.count, max(1, arrays.BLOCK // (2 * by.size))):
        rows = spectra.as_real().read(some, slice(0, filled))
        spectra.write(some.start, 0, scipy.fft.rfft(rows, by.size))


def combine_columns(
    spectra: Scratch, by: Factors, store: Callable[[int, ComplexArray], None]
) -> None:
    """The second round: a transform of length N1 across the rows, at every frequency."""
    number = np.arange(by.count)[:, np.newaxis] * (-2j * np.pi / by.length)
    # Products of two short tables: a product is a tenth of an exponential.
    far = np.exp(number * np.arange(0, min(_COMBINED, by.frequencies), _SHORT))
    turns = (far[:, :, np.newaxis] * np.exp(number * np.arange(_SHORT))[:, np.newaxis]).reshape(
        by.count, -1
    )
    dtype = spectra.values.dtype
    turns = turns.astype(dtype)
    for some in blocks(by.frequencies, _COMBINED):
        block = spectra.read(slice(0, by.count), some) * np.exp(number * some.start).astype(dtype)
        block *= turns[:, : some.stop - some.start]
        store(some.start, scipy.fft.fft(block, axis=0, overwrite_x=True))


# ---- transforms --------------------------------------------------------------------

# One thread in one transform: several recordings are worked on by several processes.
THREADS: Final = 1
# From this length on a transform is factored.
_FACTORED: Final = 2**17
# Columns of the table of waves that products over samples are made with: 512 by a few hundred
# frequencies stay in the last cache, and a block has as many rows.
TONE_WIDTH: Final = 512
_SMALL_PRIMES: Final = (2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31)


def transform_length(samples: int) -> int:
    """Length of the transform of a record: even, at least `samples`, and quick to transform.

    Examples
    --------
    >>> transform_length(1009)
    1024
    """
    return 2 * int(scipy.fft.next_fast_len((samples + 1) // 2, real=True))


def power_spectrum(
    increments: FloatArray, length: int, scale: float, taper: int = 0, *, single: bool = False
) -> FloatArray:
    """`scale` times the squares of Fourier sums at k / length cycles a sample.

    Parameters
    ----------
    increments
        (samples,) in memory or mapped; no more than some blocks of them are held at a time.
    length
        Of the transform, even, at least as long as the increments; zeros follow them.
    scale
        By which the squares are multiplied.
    taper
        Order of the sine taper that the increments are multiplied by, 0 for none.
    single
        Whether a long one is done in single precision, in half the memory. That adds white noise
        of some 1e-14 of the mean power.

    Returns
    -------
    (length // 2 + 1,) in the unit of `increments` squared.
    """
    if length < _FACTORED:
        if taper:
            increments = sine_taper(increments.size, taper, 0, increments.size) * increments
        return _squares(scipy.fft.rfft(increments, length, workers=THREADS), scale)
    by = factors(length)
    dtype = np.complex64 if single else np.complex128
    return factored(increments, by, length // 2 + 1, _powers(by, scale), taper=taper, dtype=dtype)


def sine_taper(samples: int, order: int, start: int, stop: int) -> FloatArray:
    """sin(pi order (n + 1) / (samples + 1)) for n = start ... stop - 1; not normalized.

    Parameters
    ----------
    samples
        In the whole taper.
    order
        From 1.
    start, stop
        Which n are wanted.

    Returns
    -------
    (stop - start,).
    """
    # A row's place and that in the row add up: by the sine of a sum, few sines are taken.
    step = order * np.pi / (samples + 1)
    row = step * np.arange(start + 1, stop + 1, TONE_WIDTH)[:, np.newaxis]
    along = step * np.arange(TONE_WIDTH)
    sine = np.sin(row) * np.cos(along)
    sine += np.cos(row) * np.sin(along)
    return np.asarray(sine.reshape(-1)[: stop - start])


def _squares(sums: ComplexArray, scale: float) -> FloatArray:
    power = np.square(sums.real, dtype=np.float64)
    power += np.square(sums.imag, dtype=np.float64)
    power *= scale
    return np.asarray(power)


def write_mirrored(result: Scratch, by: Factors, first: int, block: NDArray[Any]) -> None:
    """Store what belongs at length - k - N2 j, k from `first` on, the last rows j of all.

    The first column is that of other rows, which hold it already.
    """
    kept = block[::-1, : 0 if first == 0 else None : -1]
    result.write(0, by.size - first - block.shape[1] + 1, kept)


def _powers(by: Factors, scale: float) -> Store:
    """Sink that stores the squares of the sums of real values, zero to half a cycle."""

    half = by.count // 2

    def store(powers: Scratch, first: int, block: ComplexArray) -> None:
        squares = _squares(block, scale)
        powers.write(0, first, squares[: half + 1])
        write_mirrored(powers, by, first, squares[by.count - half :])

    return store


def cosine_length(samples: int) -> int:
    """The most samples, `samples` or a few less, that `cosine_transform` factors well.

    A length with a large prime factor is not transformed as such but convolved: six times as long.

    Examples
    --------
    >>> cosine_length(1009)
    1009
    """
    if samples < _FACTORED:
        return samples
    near = range(samples, samples - 2 * _COLUMNS, -1)
    quick = (one for one in near if _is_smooth(one) and factors(one).is_balanced)
    return next(quick, next(one for one in near if factors(one).is_balanced))


def _is_smooth(number: int) -> bool:
    """Whether a number has no prime factor above 31."""
    for prime in _SMALL_PRIMES:
        while number % prime == 0:
            number //= prime
    return number == 1


def cosine_transform(values: FloatArray) -> FloatArray:
    """Cosine transform (DCT-II, orthonormal).

    It is a Fourier transform of as many real values, the even ones forwards and then the odd ones
    backwards (Makhoul 1980, doi:10.1109/TASSP.1980.1163351); a long one is factored.

    Parameters
    ----------
    values
        (samples,) in memory or mapped, as many as `cosine_length` gives; no more than some blocks
        of them are held at a time.

    Returns
    -------
    (samples,) in the unit of `values`.

    Examples
    --------
    >>> import numpy as np
    >>> cosine_transform(np.ones(4)).round(12) + 0.0
    array([2., 0., 0., 0.])
    """
    samples = values.size
    if samples < _FACTORED:
        return np.asarray(scipy.fft.dct(values, type=2, norm="ortho", workers=THREADS))
    by = factors(samples)
    transform = factored(even_then_odd(values), by, samples, _cosines(by))
    transform[0] *= math.sqrt(0.5)
    return transform


def even_then_odd(values: FloatArray) -> FloatArray:
    """The even values forwards followed by the odd ones backwards.

    Examples
    --------
    >>> import numpy as np
    >>> even_then_odd(np.arange(7.0))
    array([0., 2., 4., 6., 5., 3., 1.])
    """
    result = empty(values.size)
    for block in blocks(values.size, multiple=2):
        result[block.start // 2 : (block.stop + 1) // 2] = values[block][::2]
        result[values.size - block.stop // 2 : values.size - block.start // 2] = values[block][
            1::2
        ][::-1]
    return result


def _cosines(by: Factors) -> Store:
    """Sink that turns Fourier sums by a quarter of their place and stores them as cosine sums."""
    samples = by.length
    quarter = -0.5j * np.pi / samples
    leads = np.exp(quarter * by.size * np.arange(by.count))[:, np.newaxis]
    leads = leads * math.sqrt(2.0 / samples)

    def store(transform: Scratch, first: int, block: ComplexArray) -> None:
        block *= leads
        block *= np.exp(quarter * np.arange(first, first + block.shape[1]))
        transform.write(0, first, block.real)
        # The other half, of real values: what is not real here belongs at samples - k.
        write_mirrored(transform, by, first, -block.imag)

    return store
