"""Long Fourier transforms in two rounds of short ones, in bounded memory.

With the length N1 N2, every N1-th of the samples goes into a transform of length N2, and the N1
results at one of their frequencies k, brought into phase, into one of length N1, which gives the
frequencies k + N2 j of the whole (Bailey 1990, doi:10.1007/BF00162341). The short transforms stay
in cache, and of a long series little is in memory at a time.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np
import scipy.fft

from sagnac import series
from sagnac.arrays import ComplexArray, FloatArray
from sagnac.spectrum.scratch import Scratch, scratch

# Transforms in the first round, about; each is that much shorter than the whole.
_COLUMNS: Final = 256
# Frequencies of each of them that are combined at once: 4 MiB.
_COMBINED: Final = 1024


@dataclass(frozen=True, slots=True, kw_only=True)
class Factors:
    """The two factors of a length.

    Attributes
    ----------
    count
        Transforms in the first round, N1 (columns).
    size
        Length of each, N2.

    Raises
    ------
    ValueError
        If one of them is not positive.
    """

    count: int
    size: int

    def __post_init__(self) -> None:
        if self.count < 1 or self.size < 1:
            raise ValueError(f"count and size are {self.count} and {self.size}; both count from 1")

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


@dataclass(frozen=True, slots=True, kw_only=True)
class Samples:
    """The real samples that are transformed.

    Attributes
    ----------
    size
        How many; zeros follow up to the length of the transform.
    piece
        Gives a block of them.
    touched
        Series that they are made of, whose memory is given back on the way.
    """

    size: int
    piece: Callable[[slice], FloatArray]
    touched: tuple[FloatArray, ...]


Store = Callable[[Scratch, slice, ComplexArray], None]


def factored(samples: Samples, by: Factors, width: int, store: Store) -> FloatArray:
    """A series of `width` made of the Fourier sums at k / length, block by block.

    Parameters
    ----------
    samples
        Real samples, no more than the length.
    by
        Factors of the length.
    width
        Samples in the series.
    store
        Called with the row to write to, a slice of frequencies k of the columns, and the sums at
        k + N2 j, a row for each j. The other frequencies of a real series mirror these.
    """
    filled = -(-samples.size // by.count)
    with scratch(by.count, by.frequencies, np.complex128) as spectra:
        with scratch(by.count, filled, np.float64) as columns:
            split(samples, by, columns)
            transform_columns(columns, by, spectra)
        with scratch(1, width, np.float64) as result:
            combine_columns(spectra, by, lambda some, block: store(result, some, block))
            return result.first_row()


def split(samples: Samples, by: Factors, columns: Scratch) -> None:
    """Every N1-th sample into a row of its own, zeros after the last."""

    def deal(rows: slice) -> None:
        block = slice(rows.start * by.count, min(rows.stop * by.count, samples.size))
        values = samples.piece(block)
        if values.size % by.count:
            values = np.append(values, np.zeros(-values.size % by.count))
        columns.write(0, rows.start, values.reshape(-1, by.count).T)

    rows_at_once = max(1, 4 * series.SPAN // by.count)
    series.map(deal, columns.width, *samples.touched, length=rows_at_once)


def transform_columns(columns: Scratch, by: Factors, spectra: Scratch) -> None:
    """The first round: a transform of length N2 of every row."""

    def transform(some: slice) -> None:
        rows = columns.read(some, slice(0, columns.width))
        spectra.write(some.start, 0, scipy.fft.rfft(rows, by.size))

    series.map(transform, by.count, length=max(1, series.SPAN // (2 * by.size)))


def combine_columns(
    spectra: Scratch, by: Factors, store: Callable[[slice, ComplexArray], None]
) -> None:
    """The second round: a transform of length N1 across the rows, at every frequency."""
    number = np.arange(by.count)[:, np.newaxis] * (-2j * np.pi / by.length)
    turns = np.exp(number * np.arange(min(_COMBINED, by.frequencies)))

    def combine(some: slice) -> None:
        block = spectra.read(slice(0, by.count), some) * np.exp(number * some.start)
        block *= turns[:, : some.stop - some.start]
        store(some, scipy.fft.fft(block, axis=0, overwrite_x=True))

    series.map(combine, by.frequencies, length=_COMBINED)
