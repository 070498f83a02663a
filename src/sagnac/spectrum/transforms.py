"""Fourier and cosine transforms of any length, in bounded memory.

Long ones go in two rounds of short ones; a scratch file holds what crosses rows and columns.

With the length N1 N2, every N1-th of the samples goes into a transform of length N2, and the N1
results at one of their frequencies k, brought into phase, into one of length N1, which gives the
frequencies k + N2 j of the whole (Bailey 1990, doi:10.1007/BF00162341). The short transforms stay
in cache, and of a long array little is in memory at a time.
"""

import math
from collections.abc import Callable
from functools import partial
from typing import Any, Final

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from sagnac.core import arrays
from sagnac.core.arrays import ComplexArray, FloatArray, block_length, blocks, empty

# ---- factored ----------------------------------------------------------------------

# Transforms in the first round, about; each is that much shorter than the whole.
_COLUMNS: Final = 256
# Frequencies of each of them that are combined at once: 2 MiB.
_COMBINED: Final = 512
# Of these, waves that an exponential each is taken of.
_SHORT: Final = 16

Part = Callable[[slice], FloatArray]
Store = Callable[[FloatArray, int, ComplexArray], None]


def columns_of(length: int) -> int:
    """N1: the divisor of a length that is nearest the usual number of columns, by ratio.

    Examples
    --------
    >>> columns_of(1_000_000)
    250
    """
    divisors = np.arange(1, 5 * _COLUMNS)
    divisors = divisors[length % divisors == 0]
    return int(divisors[np.argmin(np.abs(np.log(divisors / _COLUMNS)))])


def is_balanced(length: int) -> bool:
    """Whether a length has about as many columns as are quick to work with."""
    return _COLUMNS // 2 <= columns_of(length) <= 2 * _COLUMNS


def factored(
    part: Part, samples: int, length: int, size: int, store: Store, *, dtype: type = np.complex128
) -> FloatArray:
    """An array of `size` made of the Fourier sums at k / length, block by block.

    Parameters
    ----------
    part
        Gives a block of the real values that are transformed.
    samples
        Number of these values, no more than the length; zeros follow up to it.
    length
        N1 N2.
    size
        Of the result.
    store
        Called with rows of N2 numbers to write to, the first of some frequencies k of the columns,
        and the sums at k + N2 j, a row for each j. The other frequencies of real values mirror
        these.
    dtype
        In which it is done; ``numpy.complex64`` takes half the memory.
    """
    count = columns_of(length)
    width = length // count
    spectra = _rows(count, width // 2 + 1, dtype)
    columns, filled = spectra.view(spectra.real.dtype), -(-samples // count)
    # Every N1-th of the values into a row of its own, zeros after the last.
    for block in blocks(samples, 4 * block_length(count)):
        here = part(block)
        if here.size % count:
            here = np.append(here, np.zeros(-here.size % count))
        first = block.start // count
        columns[:, first : first + here.size // count] = here.reshape(-1, count).T
    for some in blocks(count, max(1, arrays.BLOCK // (2 * width))):
        spectra[some] = scipy.fft.rfft(columns[some, :filled], width)
    result = _rows(-(-size // width), width, np.float64)
    number = np.arange(count)[:, np.newaxis] * (-2j * np.pi / length)
    # Products of two short tables: a product is a tenth of an exponential.
    far = np.exp(number * np.arange(0, min(_COMBINED, spectra.shape[1]), _SHORT))
    turns = far[:, :, np.newaxis] * np.exp(number * np.arange(_SHORT))[:, np.newaxis]
    turns = turns.reshape(count, -1).astype(dtype)
    for some in blocks(spectra.shape[1], _COMBINED):
        sums = spectra[:, some] * np.exp(number * some.start).astype(dtype)
        sums *= turns[:, : some.stop - some.start]
        store(result, some.start, scipy.fft.fft(sums, axis=0, overwrite_x=True))
    return result.reshape(-1)[:size]


def _rows(rows: int, width: int, dtype: type) -> NDArray[Any]:
    """(rows, width) numbers to be filled, in memory or mapped."""
    size = rows * width
    room = empty(-(-size * np.dtype(dtype).itemsize // 8))
    return room.view(dtype)[:size].reshape(rows, width)


def _write_mirrored(result: FloatArray, first: int, block: NDArray[Any]) -> None:
    """Store what belongs at length - k - N2 j, k from `first` on, the last rows j of all.

    The first column is that of other rows, which hold it already.
    """
    kept = block[::-1, : 0 if first == 0 else None : -1]
    last = result.shape[1] - first + 1
    result[: kept.shape[0], last - block.shape[1] : last - block.shape[1] + kept.shape[1]] = kept


# ---- transforms --------------------------------------------------------------------

# One thread in one transform: several recordings are worked on by several processes.
THREADS: Final = 1
# From this length on a transform is factored.
_FACTORED: Final = 2**17
# Columns of the table of waves that products over samples are made with: 512 by a few hundred
# frequencies stay in the last cache, and a block has as many rows.
TONE_WIDTH: Final = 512
# Product of the primes up to 31.
_SMALL_PRIMES: Final = 200_560_490_130


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
    samples = increments.size

    def part(block: slice) -> FloatArray:
        here = increments[block]
        return here * sine_taper(samples, taper, block.start, block.stop) if taper else here

    if length < _FACTORED:
        return _squares(scipy.fft.rfft(part(slice(0, samples)), length, workers=THREADS), scale)
    half = columns_of(length) // 2

    def store(powers: FloatArray, first: int, block: ComplexArray) -> None:
        squares = _squares(block, scale)
        powers[: half + 1, first : first + block.shape[1]] = squares[: half + 1]
        _write_mirrored(powers, first, squares[block.shape[0] - half :])

    dtype = np.complex64 if single else np.complex128
    return factored(part, samples, length, length // 2 + 1, store, dtype=dtype)


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
    # A length without larger prime factors divides a power of the product of the small ones.
    quick = (one for one in near if pow(_SMALL_PRIMES, 32, one) == 0 and is_balanced(one))
    return next(quick, next(one for one in near if is_balanced(one)))


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
    count = columns_of(samples)
    quarter = -0.5j * np.pi / samples
    leads = np.exp(quarter * (samples // count) * np.arange(count))[:, np.newaxis]
    leads = leads * math.sqrt(2.0 / samples)

    def store(cosines: FloatArray, first: int, block: ComplexArray) -> None:
        block *= leads
        block *= np.exp(quarter * np.arange(first, first + block.shape[1]))
        cosines[:, first : first + block.shape[1]] = block.real
        # The other half, of real values: what is not real here belongs at samples - k.
        _write_mirrored(cosines, first, -block.imag)

    transform = factored(partial(even_then_odd, values), samples, samples, samples, store)
    transform[0] *= math.sqrt(0.5)
    return transform


def even_then_odd(values: FloatArray, block: slice) -> FloatArray:
    """A block of the even values forwards followed by the odd ones backwards.

    Examples
    --------
    >>> even_then_odd(np.arange(7.0), slice(2, 6))
    array([4., 6., 5., 3.])
    """
    half, twice = (values.size + 1) // 2, 2 * values.size
    even = values[2 * block.start : 2 * min(block.stop, half) : 2]
    odd = values[twice - 2 * block.stop + 1 : twice - 2 * max(block.start, half) : 2]
    return np.concatenate([even, odd[::-1]])
