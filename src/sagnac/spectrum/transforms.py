"""Fourier and cosine transforms of a series of any length, in bounded memory."""

import math
from typing import Final

import numpy as np
import scipy.fft

from sagnac.arrays import ComplexArray, FloatArray
from sagnac.spectrum.factored import Factors, Samples, Store, factored, factors
from sagnac.spectrum.scratch import Scratch

# One thread in one transform: several recordings are worked on by several processes.
THREADS: Final = 1
# From this length on a transform is factored.
_FACTORED: Final = 2**17
# Columns of the table of waves that products over samples are made with: 512 by a few hundred
# frequencies stay in the last cache, and a block has as many rows.
TONE_WIDTH: Final = 512


def transform_length(samples: int) -> int:
    """Length of the transform of a record: even, at least `samples`, and quick to transform.

    Examples
    --------
    >>> transform_length(1009)
    1024
    """
    return 2 * int(scipy.fft.next_fast_len((samples + 1) // 2, real=True))


def power_spectrum(increments: FloatArray, length: int, scale: float, taper: int = 0) -> FloatArray:
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

    Returns
    -------
    (length // 2 + 1,) in the unit of `increments` squared, a series.
    """

    def piece(block: slice) -> FloatArray:
        if not taper:
            return increments[block]
        tapered = sine_taper(increments.size, taper, block) * increments[block]
        return np.asarray(tapered)

    if length < _FACTORED:
        sums = scipy.fft.rfft(piece(slice(0, increments.size)), length, workers=THREADS)
        return _squares(sums, scale)
    samples = Samples(size=increments.size, piece=piece, touched=(increments,))
    by = factors(length)
    return factored(samples, by, length // 2 + 1, _powers(by, scale))


def sine_taper(samples: int, order: int, block: slice) -> FloatArray:
    """sin(pi order (n + 1) / (samples + 1)) for the n of a block; not normalized.

    Parameters
    ----------
    samples
        In the whole taper.
    order
        From 1.
    block
        The n wanted.

    Returns
    -------
    (samples in the block,).
    """
    # A row's place and that in the row add up: by the sine of a sum, few sines are taken.
    step = order * np.pi / (samples + 1)
    row = step * np.arange(block.start + 1, block.stop + 1, TONE_WIDTH)[:, np.newaxis]
    along = step * np.arange(TONE_WIDTH)
    sine = np.sin(row) * np.cos(along)
    sine += np.cos(row) * np.sin(along)
    return np.asarray(sine.reshape(-1)[: block.stop - block.start])


def _squares(sums: ComplexArray, scale: float) -> FloatArray:
    power = np.square(sums.real)
    power += np.square(sums.imag)
    power *= scale
    return np.asarray(power)


def _powers(by: Factors, scale: float) -> Store:
    """Sink that stores the squares of a real series, zero to half a cycle."""

    def store(powers: Scratch, some: slice, block: ComplexArray) -> None:
        for index, row in enumerate(_squares(block, scale)):
            # Frequencies above half a cycle mirror those below.
            if 2 * index < by.count:
                powers.write(0, by.size * index + some.start, row[np.newaxis])
            else:
                last = by.length - by.size * index - some.stop + 1
                powers.write(0, last, row[np.newaxis, ::-1])

    return store


def cosine_length(samples: int) -> int:
    """The most samples, `samples` or a few less, that `cosine_transform` factors well.

    Examples
    --------
    >>> cosine_length(1009)
    1009
    """
    if samples < _FACTORED:
        return samples
    while not factors(samples).is_balanced:
        samples -= 1
    return samples


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
    (samples,) in the unit of `values`, a series.

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
    rearranged = Samples(
        size=samples, piece=lambda block: even_then_odd(values, block), touched=(values,)
    )
    transform = factored(rearranged, by, samples, _cosines(by))
    transform[0] *= math.sqrt(0.5)
    return transform


def even_then_odd(values: FloatArray, block: slice) -> FloatArray:
    """A block of the even values forwards followed by the odd ones backwards.

    Examples
    --------
    >>> import numpy as np
    >>> even_then_odd(np.arange(7.0), slice(0, 7))
    array([0., 2., 4., 6., 5., 3., 1.])
    """
    samples = values.size
    evens = (samples + 1) // 2
    forwards = values[2 * block.start : 2 * min(block.stop, evens) : 2]
    first, last = samples - block.stop, samples - max(block.start, evens)
    backwards = values[2 * first + 1 : 2 * last + 1 : 2][::-1]
    return np.concatenate([forwards, backwards])


def _cosines(by: Factors) -> Store:
    """Sink that turns Fourier sums by a quarter of their place and stores them as cosine sums."""
    samples = by.length
    quarter = -0.5j * np.pi / samples
    leads = np.exp(quarter * by.size * np.arange(by.count))[:, np.newaxis]
    leads = leads * math.sqrt(2.0 / samples)

    def store(transform: Scratch, some: slice, block: ComplexArray) -> None:
        block *= leads
        block *= np.exp(quarter * np.arange(some.start, some.stop))
        for index, row in enumerate(block):
            first = by.size * index + some.start
            transform.write(0, first, row.real[np.newaxis])
            # The other half of a real series: what is not real here belongs at samples - k.
            behind = -row.imag[:0:-1] if first == 0 else -row.imag[::-1]
            transform.write(0, samples - first - row.size + 1, behind[np.newaxis])

    return store
