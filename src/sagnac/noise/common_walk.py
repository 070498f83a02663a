"""The angle random walk that gyros on one turning table share, by their cross spectra.

Two gyros with a common part (drive, temperature, table) read low when differenced: it cancels.
The real part of their cross spectrum over the band of N is the common part, with the sign that
the difference sees.

What gyros show beyond the motion of their table holds their own noise, what they share, and the
error of the encoder that said how the table moves. The error of a readout is white noise of the
angle: its cross spectrum rises as f^2. What gyros warm up by falls as f^-2. An angle random walk
that gyros share is level between. So the three are fitted to the cross spectra.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike
from scipy.fft import prev_fast_len, rfft
from scipy.special import stdtrit

from sagnac.core.arrays import BooleanArray, FloatArray
from sagnac.noise.laws import STOCHASTIC_NAMES, rate_density_basis
from sagnac.noise.likelihood import PRESENCE
from sagnac.spectrum.periodogram import CELL, TAPERS, band_degrees_of_freedom, sine_taper
from sagnac.spectrum.power_laws import running_median

# A cell this many times the median of its neighbourhood, and those cells, is a line.
_STANDING: Final = 3.0
_AROUND: Final = 41


@dataclass(frozen=True, slots=True, kw_only=True)
class SharedCells:
    """Spectral matrices of gyros, real part, in cells that hold no line.

    Attributes
    ----------
    matrices
        (gyros, gyros, cells) one-sided rate density, (rad/s)^2/Hz.
    frequency
        (cells,) in the middle of each, Hz, ascending.
    """

    matrices: FloatArray
    frequency: FloatArray


def band_cells(
    increments: ArrayLike,
    *,
    sample_rate: float,
    band_hz: tuple[float, float],
    masked: Sequence[tuple[float, float]] = (),
) -> SharedCells:
    """Real spectral matrices of several gyros over a band, cell by cell, under sine tapers.

    Parameters
    ----------
    increments
        (gyros, samples), rad, of one span.
    sample_rate
        Samples per second.
    band_hz
        Lowest and highest frequency, Hz: that in which N rules.
    masked
        Bands (low, high), Hz, to leave out. Lines that gyros on one bench share are no noise;
        what stands out is left out besides.

    Raises
    ------
    ValueError
        If no ordinate lies in the band or an argument makes no sense.
    """
    values = np.asarray(increments, dtype=np.float64)
    if values.ndim != 2 or values.shape[0] < 2 or not np.isfinite(values).all():
        raise ValueError(f"increments has shape {values.shape}; give two finite gyros or more")
    length = int(prev_fast_len(values.shape[1], real=True))
    time = np.arange(length) - 0.5 * (length - 1)
    values = values[:, :length] - values[:, :length].mean(axis=1, keepdims=True)
    values -= np.outer(values @ time / (time @ time), time)
    first, last = np.searchsorted(
        np.arange(1, length // 2 + 1) * sample_rate / length, band_hz, side="left"
    )
    cells = (last - first) // CELL
    if cells <= 0:
        raise ValueError(f"too few frequencies between {band_hz[0]:g} and {band_hz[1]:g} Hz")
    used = slice(1 + int(first), 1 + int(first + cells * CELL))
    products = np.zeros((values.shape[0], values.shape[0], int(cells)))
    for order in range(1, TAPERS + 1):
        transform = rfft(values * sine_taper(order, length), axis=1)[:, used]
        pairs = (transform[:, np.newaxis] * transform.conj()).real
        products += pairs.reshape(*products.shape, CELL).sum(axis=3)
    products *= 2.0 * sample_rate / (TAPERS * CELL)
    place = 1 + first + CELL * (np.arange(cells) + 0.5)
    plain = _plain(products) & ~_within(place * sample_rate / length, masked, sample_rate / length)
    if not plain.any():
        raise ValueError(f"only lines between {band_hz[0]:g} and {band_hz[1]:g} Hz")
    return SharedCells(
        matrices=products[:, :, plain], frequency=place[plain] * sample_rate / length
    )


def _plain(products: FloatArray) -> BooleanArray:
    """Cells in which no gyro stands out of its neighbourhood, and none beside one that does."""
    plain = np.ones(products.shape[2], dtype=np.bool_)
    for gyro in range(products.shape[0]):
        density = products[gyro, gyro]
        standing = density > _STANDING * running_median(density, _AROUND)
        plain &= ~np.convolve(standing, np.ones(3), mode="same").astype(bool)[: plain.size]
    return plain


def _within(
    frequency: FloatArray, masked: Sequence[tuple[float, float]], unit: float
) -> BooleanArray:
    """Cells that touch a masked band or its neighbourhood."""
    reach = CELL * unit
    touched = np.zeros(frequency.size, dtype=np.bool_)
    for low, high in masked:
        touched |= (frequency > low - reach) & (frequency < high + reach)
    return touched


# Bins to a decade, and fewest cells in one: a covariance made of fewer bends its own weights.
_BINS: Final = 6
_LEAST_CELLS: Final = 6
# Terms that the cross spectra may have, and fewest bins to tell them from each other.
_TERMS: Final = tuple(
    STOCHASTIC_NAMES.index(name)
    for name in ("quantization", "angle_random_walk", "rate_random_walk")
)
_LEAST_BINS: Final = 5
# Rounds in which a spectrum is smoothed by its terms, and how far off the seen one it may get.
_ROUNDS: Final = 4
_OFF: Final = 3.0


@dataclass(frozen=True, slots=True, kw_only=True)
class CommonWalk:
    """Square of the angle random walk that gyros share.

    Attributes
    ----------
    square, low, high
        rad^2/s with its interval; below zero if the gyros lean on each other.
    confidence
        Of the interval.
    error
        Standard error of the square.
    """

    square: float
    low: float
    high: float
    confidence: float
    error: float

    @property
    def is_present(self) -> bool:
        """Whether it is farther from zero than three standard deviations, as any term has to be.

        Chance alone brings the end of an interval beyond zero, and N would then have to allow for
        all that the interval holds.
        """
        return self.square**2 > PRESENCE * self.error**2


def differenced_factor(shared: float, walk: float) -> float:
    """Factor that differencing puts on N per gyro: ``sqrt(n^2 / (n^2 + c))``.

    Parameters
    ----------
    shared
        c, square of the angle random walk that both share, rad^2/s.
    walk
        n, per gyro as the difference shows it, rad/sqrt(s).
    """
    own = walk**2
    # What gyros share with opposite sign raises n^2 by no more than all of it.
    return math.sqrt(own / max(own + shared, 1e-3 * own))


def common_walk(
    increments: ArrayLike,
    *,
    sample_rate: float,
    band_hz: tuple[float, float],
    masked: Sequence[tuple[float, float]] = (),
    confidence: float = 0.95,
) -> CommonWalk:
    """Angle random walk that two or more gyros share, from their cross spectra.

    White noise, its sum and its second difference (N, K and Q) are fitted to the cross spectra of
    all pairs by least squares in the metric of the Wishart law,
    ``cov(S_ij, S_kl) = (S_ik S_jl + S_il S_jk) / degrees of freedom``.

    Parameters
    ----------
    increments
        (gyros, samples), rad, of angles that were averaged over the interval between them, table
        motion out.
    sample_rate
        Samples per second.
    band_hz, masked
        As in `band_cells`.
    confidence
        Of the interval, which grows by what the three terms do not explain.

    Returns
    -------
    CommonWalk

    Raises
    ------
    ValueError
        If the band is too narrow to tell the three from each other.
    """
    cells = band_cells(increments, sample_rate=sample_rate, band_hz=band_hz, masked=masked)
    bins = _bins(cells)
    if len(bins) < _LEAST_BINS:
        raise ValueError(f"{len(bins)} bins do not tell what gyros share; give {_LEAST_BINS}")
    frequency = np.array([cells.frequency[span].mean() for span in bins])
    basis = rate_density_basis(frequency, 1.0 / sample_rate)[:, _TERMS]
    # Averages over the interval make of a walk's increments c_0 = 2/3 and c_1 = 1/6; white noise of
    # the angle stays white.
    averaged = (2.0 + np.cos(2.0 * np.pi * frequency / sample_rate)) / 3.0
    basis[:, 1:] *= averaged[:, np.newaxis]
    scale = np.sqrt(np.mean(basis**2, axis=0))
    own = _TERMS.index(STOCHASTIC_NAMES.index("angle_random_walk"))
    freedom = np.array([band_degrees_of_freedom(CELL * (one.stop - one.start)) for one in bins])
    spectra = np.stack([cells.matrices[:, :, one].mean(axis=2) for one in bins])
    solution, covariance, chi_square = _fitted(spectra, basis / scale, freedom)
    left = freedom.size * math.comb(spectra.shape[1], 2) - solution.size
    square = float(solution[own] / scale[own])
    error = math.sqrt(max(1.0, chi_square / left) * float(covariance[own, own])) / scale[own]
    reach = float(stdtrit(left, 0.5 + 0.5 * confidence)) * error
    return CommonWalk(
        square=square,
        low=square - reach,
        high=square + reach,
        confidence=confidence,
        error=error,
    )


def _fitted(
    spectra: FloatArray, basis: FloatArray, freedom: FloatArray
) -> tuple[FloatArray, FloatArray, float]:
    """Terms of the cross spectra of all pairs, their covariance, and the chi-square they leave.

    The metric is of smooth spectra: in that of the observed ones what chance makes low would weigh
    more.
    """
    first, second = np.triu_indices(spectra.shape[1], 1)
    smooth = _smooth(spectra, basis, freedom)
    fisher, score = np.zeros((basis.shape[1],) * 2), np.zeros(basis.shape[1])
    total = 0.0
    for row, seen, known, count in zip(basis, spectra, smooth, freedom, strict=True):
        cross = seen[first, second]
        covariance = (
            known[np.ix_(first, first)] * known[np.ix_(second, second)]
            + known[np.ix_(first, second)] * known[np.ix_(second, first)]
        ) / count
        metric = np.linalg.inv(covariance)
        of_all = metric.sum(axis=0)
        fisher += np.outer(row, row) * of_all.sum()
        score += row * (of_all @ cross)
        total += float(cross @ metric @ cross)
    inverse = np.asarray(np.linalg.inv(fisher), dtype=np.float64)
    solution = inverse @ score
    return solution, inverse, total - float(score @ solution)


def _smooth(spectra: FloatArray, basis: FloatArray, freedom: FloatArray) -> FloatArray:
    """(bins, gyros, gyros) spectra as the terms make them, near the observed ones."""
    gyros = spectra.shape[1]
    own = np.stack([spectra[:, gyro, gyro] for gyro in range(gyros)], axis=1)
    model = own
    for _ in range(_ROUNDS):
        weight = np.sqrt(freedom)[:, np.newaxis] / model
        fitted = [
            basis @ np.linalg.lstsq(basis * part[:, np.newaxis], part * seen, rcond=None)[0]
            for part, seen in zip(weight.T, own.T, strict=True)
        ]
        model = np.clip(np.stack(fitted, axis=1), own / _OFF, own * _OFF)
    size = np.sqrt(model)
    seen = np.sqrt(own)
    coherency = spectra / (seen[:, :, np.newaxis] * seen[:, np.newaxis, :])
    # Coherency changes slowly, and that of a bin itself would weigh it: its neighbours say it.
    padded = np.concatenate([coherency[1:2], coherency, coherency[-2:-1]])
    coherency = 0.5 * (padded[:-2] + padded[2:])
    coherency[:, np.arange(gyros), np.arange(gyros)] = 1.0
    return np.asarray(coherency * size[:, :, np.newaxis] * size[:, np.newaxis, :])


def _bins(cells: SharedCells) -> list[slice]:
    """Runs of cells, a sixth of a decade and six cells long or more."""
    bins: list[slice] = []
    start = 0
    for stop in range(1, cells.frequency.size + 1):
        wide = cells.frequency[stop - 1] >= cells.frequency[start] * 10.0 ** (1.0 / _BINS)
        if wide and stop - start >= _LEAST_CELLS:
            bins.append(slice(start, stop))
            start = stop
    return bins
