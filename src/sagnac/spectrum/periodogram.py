"""Periodogram of a series, its density and its bins, and the same under sine tapers.

Under sine tapers the power that leaks from a strong line stays beside it.
The squared transform of a record without a taper lets a line of 10^4 times the floor leak into
every bin. Sine tapers (Riedel and Sidorenko, IEEE Trans. Signal Process. 43, 188, 1995) have a
closed form at every length. Seven of them resolve 8 cycles a record, as seven Slepian tapers of
NW 4 do, and leak less far away, which is what the lowest bins of a dithered gyro need. Measured,
relative to the peak of the response:

====================  ========  ========  ========  ========  =========
cycles a record off   6         20        100       400       1000
====================  ========  ========  ========  ========  =========
7 sine tapers         6.5e-3    2.9e-5    4.5e-8    1.9e-10   6.7e-12
7 Slepian, NW 4       3.6e-3    2.5e-4    1.0e-5    6.7e-7    1.3e-7
5 Slepian, NW 4       5.9e-5    3.3e-6    1.3e-7    8.6e-9    1.6e-9
====================  ========  ========  ========  ========  =========
"""

import math
from functools import lru_cache
from itertools import pairwise
from typing import Final

import numpy as np
from scipy.fft import rfft

from sagnac.core.arrays import BLOCK, FloatArray, IntegerArray, elementwise, release
from sagnac.spectrum import _kernels, transforms
from sagnac.spectrum.transforms import power_spectrum, transform_length


def periodogram(increments: FloatArray, padding: int = 1, *, single: bool = False) -> FloatArray:
    """Power of the increments at k / (padding * transform_length(size)) cycles a sample.

    Parameters
    ----------
    increments
        (samples,) in memory or mapped; no more than some blocks of them are held at a time.
    padding
        Frequencies for each one of the unpadded transform.
    single
        Whether single precision will do: see `transforms.power_spectrum`.

    Returns
    -------
    (padding * transform_length(size) // 2 + 1,) in the unit of `increments` squared.
    """
    length = padding * transform_length(increments.size)
    return power_spectrum(increments, length, 1.0 / increments.size, single=single)


def density(power: FloatArray, sample_rate: float) -> FloatArray:
    """One-sided rate density, (rad/s)^2/Hz, of a periodogram of angle increments (rad^2)."""
    return 2.0 * sample_rate * power


def density_at(frequency: FloatArray, floor: FloatArray, sample_rate: float) -> FloatArray:
    """(frequencies,) `density` of a noise floor, (bins,), in the bins nearest to these, Hz."""
    bins = np.rint(frequency / sample_rate * (2.0 * (floor.size - 1))).astype(np.int64)
    return density(floor[bins], sample_rate)


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
    mean = bin_sums(power, edges) / np.diff(edges)
    return (edges[:-1] + edges[1:] - 1) / 2.0 / (2.0 * (bins - 1)), mean


def bin_sums(values: FloatArray, edges: IntegerArray) -> FloatArray:
    """Sums of values from each edge to the next.

    Parameters
    ----------
    values
        (samples,) in any unit.
    edges
        (bins + 1,) places among them, ascending.

    Returns
    -------
    (bins,) in the unit of the values.

    Examples
    --------
    >>> import numpy as np
    >>> bin_sums(np.arange(10.0), np.array([0, 2, 10]))
    array([ 1., 44.])
    """
    sums = np.empty(edges.size - 1, dtype=values.dtype)
    # Whole bins, about a block of values at a time.
    starts = np.unique(np.searchsorted(edges[:-1], np.arange(edges[0], edges[-1], BLOCK)))
    for first, last in pairwise([*starts, sums.size]):
        bins = slice(first, last)
        sums[bins] = np.add.reduceat(values[edges[first] : edges[last]], edges[bins] - edges[first])
        release()
    return sums


# ---- tapers ------------------------------------------------------------------------

# Tapers of the answer's spectrum, and half the band in cycles a record that they smooth
# over: the k-th sine taper has its two peaks at k/2 cycles a record.
TAPERS: Final = 7
HALF_WIDTH: Final = 4
# Ordinates in a cell: its width is that of the window, so that neighbours are nearly independent.
CELL: Final = 2 * HALF_WIDTH


def multitaper(increments: FloatArray, tapers: int = 5) -> FloatArray:
    """Power of the increments at the frequencies of `periodogram`, averaged over sine tapers.

    The leakage of a periodogram falls as f^-2, no faster than a rate random walk does; that of
    the tapers falls as f^-4. Each ordinate has twice `tapers` degrees of freedom, and resolves
    (tapers + 1) / (2 size) cycles a sample either side.

    Parameters
    ----------
    increments
        (samples,), without their mean.
    tapers
        How many, from 1.

    Returns
    -------
    (transform_length(samples) // 2 + 1,) in the unit of `increments` squared.
    """
    length = transform_length(increments.size)
    # The squares of a sine taper sum to half of size + 1.
    scale = 2.0 / ((increments.size + 1) * tapers)
    power = power_spectrum(increments, length, scale, 1)
    for order in range(2, tapers + 1):
        elementwise(np.add, power, power_spectrum(increments, length, scale, order), out=power)
    return power


def tapered_power(increments: FloatArray) -> FloatArray:
    """Power of a short stretch of increments, averaged over the tapers of the answer.

    One transform serves all tapers (`_kernels.tapered_power`; Riedel and Sidorenko, eq. 4).

    Parameters
    ----------
    increments
        (samples,), without their mean, in memory; quick if samples + 1 has small factors.

    Returns
    -------
    ((samples + 1) // 2 + 1,) in the unit of `increments` squared, at k / (samples + 1) cycles a
    sample.
    """
    periods = increments.size + 1
    turns = np.exp(1j * math.pi / periods * np.arange(1, TAPERS + 1))
    power = np.empty(periods // 2 + 1)
    _kernels.tapered_power(rfft(increments, 2 * periods), turns, power)
    # Half the difference of two waves, and tapers of unit energy.
    power *= 0.25 * 2.0 / (periods * TAPERS)
    return power


def sine_taper(order: int, samples: int) -> FloatArray:
    """The sine taper of an order, with unit energy.

    Parameters
    ----------
    order
        1 for the smoothest.
    samples
        Length.

    Returns
    -------
    FloatArray
        (samples,), ``sqrt(2/(n+1)) sin(pi order (t+1)/(n+1))``.
    """
    taper = transforms.sine_taper(samples, order, 0, samples)
    return np.asarray(math.sqrt(2.0 / (samples + 1)) * taper)


def _taper_power(samples: int, fine: int) -> FloatArray:
    """Squared transforms of the tapers of some length in steps of 1 / `fine` cycles, summed."""
    tapers = (sine_taper(order, samples) for order in range(1, TAPERS + 1))
    return np.asarray(sum(np.abs(rfft(taper, fine * samples)) ** 2 for taper in tapers))


@lru_cache(maxsize=1)
def response() -> tuple[FloatArray, FloatArray]:
    """Mean squared response of the tapers in steps of a quarter cycle a record.

    Returns
    -------
    offset, response
        (offsets,) from -12 to 12 cycles a record, and the response there, a density over offsets
        in cycles a record.
    """
    power = _taper_power(4096, 4)[: 4 * 12 + 1]
    power /= (2.0 * power.sum() - power[0]) / 4.0
    both = np.concatenate([power[:0:-1], power])
    both.setflags(write=False)
    return np.arange(1 - power.size, power.size) / 4.0, both


@lru_cache(maxsize=1)
def _correlation() -> FloatArray:
    """Correlation of ordinates at offsets of whole cycles a record, relative to their mean squared.

    ``c(d) = sum_kl |sum_t v_k v_l e^(-2 pi i d t/n)|^2 / K^2``, Percival and Walden (1993), 7.7.
    """
    tapers = np.stack([sine_taper(order, 4096) for order in range(1, TAPERS + 1)])
    total = np.zeros(2 * CELL + 1)
    for taper in tapers:
        total += (np.abs(rfft(tapers * taper, axis=1)[:, : total.size]) ** 2).sum(axis=0)
    return total / TAPERS**2


def band_degrees_of_freedom(ordinates: int) -> float:
    """Degrees of freedom of the mean of neighbouring ordinates of white noise.

    Parameters
    ----------
    ordinates
        How many, one cycle a record apart.

    Returns
    -------
    float
        ``2 n^2 / sum_ij c(i - j)``; 2 TAPERS for one.
    """
    correlation = _correlation()
    lag = np.arange(1, min(ordinates, correlation.size))
    total = ordinates * correlation[0] + 2.0 * float((ordinates - lag) @ correlation[lag])
    return 2.0 * ordinates**2 / float(total)


@lru_cache(maxsize=1)
def _sidelobes() -> FloatArray:
    """Largest mean squared response beyond each whole offset, relative to that at the middle."""
    fine = 2
    power = _taper_power(65536, fine)
    power /= power[: fine * HALF_WIDTH].mean()
    return np.asarray(np.maximum.accumulate(power[::-1])[::-1][::fine])


def leaked_density(density: FloatArray) -> FloatArray:
    """Leakage into each ordinate from more than two window widths away.

    The spectrum convolved with the measured response of the tapers beyond that offset. The
    response falls as the fourth power (and the tapers' alternation faster), so that what lies
    farther than a few thousand ordinates is bounded by the last value.

    Parameters
    ----------
    density
        (ordinates,) at 0, 1, 2, … cycles a record.

    Returns
    -------
    FloatArray
        (ordinates,), in the unit of `density`.
    """
    size, lobes, place = density.size, _sidelobes(), np.arange(density.size)
    tail = lobes[np.minimum(place, lobes.size - 1)]
    tail *= np.minimum(lobes.size / np.maximum(place, 1), 1.0) ** 4
    tail[: 2 * CELL] = 0.0
    # The response is a density over offsets: its middle is about 1/(2 HALF_WIDTH) a cycle.
    tail /= 2 * HALF_WIDTH
    length = 1 << (2 * size - 1).bit_length()
    kernel = np.zeros(length)
    kernel[:size] = tail
    kernel[length - size + 1 :] += tail[:0:-1]
    product = rfft(kernel) * rfft(density, length)
    return np.asarray(np.maximum(np.fft.irfft(product, length)[:size], 0.0))
