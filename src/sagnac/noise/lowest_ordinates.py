"""What the lowest ordinates of a spectrum allow: the rate ramp, and N behind readings of an angle.

Few ordinates show the noise there, so that it is not put at its most likely law: every law that
they allow keeps its weight, and factors of what is in them besides are integrated out (integrated
likelihood; Berger, Liseo and Wolpert, Statist. Sci. 14, 1, 1999).
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from scipy.fft import dst
from scipy.optimize import brentq
from scipy.special import ndtr, stdtr

from sagnac.core.arrays import FloatArray, IntegerArray
from sagnac.core.errors import RecordingError
from sagnac.noise import cosine_spectrum
from sagnac.noise.cosine_spectrum import SINGLE, CosineSpectrum
from sagnac.noise.estimates import Estimate, rooted, unobserved
from sagnac.noise.laws import STOCHASTIC_NAMES, cosine_power_basis
from sagnac.noise.likelihood import PRESENCE
from sagnac.spectrum.periodogram import bin_sums
from sagnac.spectrum.transforms import cosine_transform


class _Integrated(NamedTuple):
    """Gaussian ordinates under every law of their variances, factors of columns integrated out.

    Attributes
    ----------
    logarithm
        (laws,) of the likelihood, without the squares that the columns leave.
    rest
        (laws,) these squares in units of their variances.
    factor, information
        (laws,) of the first column, and what the ordinates say of it.
    """

    logarithm: FloatArray
    rest: FloatArray
    factor: FloatArray
    information: FloatArray


def _integrated(values: FloatArray, laws: FloatArray, columns: FloatArray) -> _Integrated:
    """Values (ordinates,) under laws (laws, ordinates) with columns (columns, ordinates)."""
    weighted = columns / laws[:, np.newaxis]
    normal, right = weighted @ columns.T, weighted @ values
    factors = np.linalg.solve(normal, right[..., np.newaxis])[..., 0]
    determinant = np.linalg.slogdet(normal)[1]
    logarithm = -0.5 * (np.log(laws).sum(axis=1) + determinant)
    rest = (values**2 / laws).sum(axis=1) - (right * factors).sum(axis=1)
    information = np.exp(determinant - np.linalg.slogdet(normal[:, 1:, 1:])[1])
    return _Integrated(logarithm, rest, np.asarray(factors[:, 0]), information)


# ---- the rate ramp -----------------------------------------------------------------------

# Terms by the steepness of their fall, and the power of frequency by which each falls.
_FALLS: Final = {name: falls for falls, name in enumerate(STOCHASTIC_NAMES[1:])}
# Indices at which a slow term may cross the others: none, then evenly in logarithm.
_CROSSINGS: Final = np.concatenate([[0.0], np.geomspace(0.05, 16.0 * SINGLE, 31)])


@dataclass(frozen=True, slots=True, kw_only=True)
class _Slopes:
    """The slope under every law of the noise: Student's, with a centre and a scale of its own.

    Attributes
    ----------
    weight
        (laws,) of each law, one in sum.
    centre, scale
        (laws,) of the slope, rad per sample.
    freedom
        Degrees of freedom.
    """

    weight: FloatArray
    centre: FloatArray
    scale: FloatArray
    freedom: int

    def below(self, slope: float) -> float:
        """Probability of less than a slope."""
        return float(self.weight @ stdtr(self.freedom, (slope - self.centre) / self.scale))

    def quantile(self, chance: float) -> float:
        """Slope below which it lies with a probability."""
        return self.where(lambda slope: self.below(slope) - chance)

    def where(self, excess: Callable[[float], float], begin: float = -1.0) -> float:
        """Zero of an increasing function between `begin` times the farthest slope and that."""
        farthest = float(np.abs(self.centre).max() + 1e3 * self.scale.max())
        precision = 1e-6 * float(self.scale.min())
        return float(brentq(excess, begin * farthest, farthest, xtol=precision))


def rate_ramp(
    increments: FloatArray,
    *,
    sample_rate: float,
    masked: tuple[tuple[float, float], ...] = (),
    settling: float | None = None,
    confidence: float = 0.95,
) -> Estimate:
    """The rate ramp of increments of any length, rad/s^2.

    Parameters
    ----------
    increments
        (samples,), rad.
    sample_rate
        Hz.
    masked
        Frequency bands (low, high) in Hz to leave out.
    settling
        Time constant of a warm-up that was taken off, s, which takes from a slope or leaves one.
    confidence
        Of the interval or bound.

    Returns
    -------
    Estimate
        Not observable if too few of the lowest ordinates are left.
    """
    # So many sums are enough for the lowest ordinates.
    step = max(1, increments.size // (64 * SINGLE))
    sums = bin_sums(increments, step * np.arange(increments.size // step + 1))
    try:
        rate = sample_rate / step
        cosine = cosine_spectrum.cosine_spectrum(sums, kind="increment", sample_rate=rate)
        bins = cosine_spectrum.cosine_bins(cosine.transform.size, cosine.interval, masked, None)
    except RecordingError:
        return unobserved("rate_ramp", confidence)
    beside = None
    if settling is not None:
        times = cosine.interval * np.arange(cosine.transform.size)
        beside = cosine_transform(np.exp(-times / settling))
    return ramp_estimate(cosine, bins.starts[bins.count == 1.0], confidence, beside)


def ramp_estimate(
    cosine: CosineSpectrum, index: IntegerArray, confidence: float, beside: FloatArray | None = None
) -> Estimate:
    """The rate ramp: a straight line in slow noise of which a record shows little.

    A slope lies nearly all in the lowest ordinate of the cosine transform, and what noise makes
    there shows in the few ordinates above it alone: its law is not known, which gives the slope the
    wide tails of Student's. It is called estimated if a slope of the other sign, or none, is as
    improbable as beyond three standard deviations.

    Parameters
    ----------
    cosine
        Of increments that their slope was taken off.
    index
        Of the ordinates that may be used; the lowest 63 are.
    confidence
        Of the interval or bound.
    beside
        (samples,) transform of what may be in the increments besides, with any amplitude.
    """
    index = index[index < SINGLE]
    nothing = unobserved("rate_ramp", confidence)
    if index.size < cosine_spectrum.LEAST_BINS or index[0] > 1:
        return nothing
    columns = [cosine_spectrum.slope_transform(index.astype(np.float64), cosine.transform.size)]
    if beside is not None:
        columns.append(beside[index])
    slopes = _slopes(cosine, index, np.stack(columns))
    tail, unit = 0.5 - 0.5 * confidence, cosine.interval**-2
    if slopes.below(0.0) < min(float(ndtr(-math.sqrt(PRESENCE))), tail):
        squares = ((slopes.quantile(chance) * unit) ** 2 for chance in (0.5, tail, 1.0 - tail))
        return rooted("rate_ramp", confidence, *squares)

    def excess(size: float) -> float:
        # Whatever its sign.
        return slopes.below(size) - slopes.below(-size) - confidence

    return nothing.bounded(slopes.where(excess, begin=0.0) * unit)


def _slopes(cosine: CosineSpectrum, index: IntegerArray, columns: FloatArray) -> _Slopes:
    """The slope, turned so that it is more probably positive, under every law of the noise.

    For noise of the variances ``s v`` the likelihood of a slope is Gaussian, and its integral over
    the slope and, with the weight 1/s, over s is known (Zellner, An Introduction to Bayesian
    Inference in Econometrics, 1971, ch. 3). What is beside the slope is integrated over as well.
    """
    laws, prior = _laws(cosine, index)
    integrated = _integrated(cosine.transform[index], laws, columns)
    freedom = index.size - len(columns)
    rest = np.maximum(integrated.rest, np.finfo(np.float64).tiny)
    logarithm = integrated.logarithm - 0.5 * freedom * np.log(rest)
    weight = prior * np.exp(logarithm - logarithm.max())
    weight /= weight.sum()
    heavy = weight > 1e-9
    slope = cosine.slope + integrated.factor
    centre = math.copysign(1.0, float(weight @ slope)) * slope[heavy]
    scale = np.sqrt(rest / (freedom * integrated.information))[heavy]
    weight = weight[heavy] / weight[heavy].sum()
    return _Slopes(weight=weight, centre=centre, scale=scale, freedom=freedom)


def _laws(cosine: CosineSpectrum, index: IntegerArray) -> tuple[FloatArray, FloatArray]:
    """Expected squares up to a factor, (laws, ordinates), and prior weights, (laws,).

    The index at which a slow term crosses the least slow one is evenly likely below the first, and
    evenly in its logarithm above.
    """
    terms = [name for name in _FALLS if name in cosine.terms] or ["quantization"]
    places = np.concatenate([[1.0], index.astype(np.float64)])
    basis = cosine_power_basis(places, cosine.transform.size, cosine.interval)
    columns = basis[:, [STOCHASTIC_NAMES.index(name) for name in terms]]
    columns = columns / columns[0]
    laws, prior = columns[1:, :1].T, np.ones(1)
    share = np.gradient(_CROSSINGS) / (1.0 + _CROSSINGS)
    for column, name in enumerate(terms[1:], start=1):
        strength = _CROSSINGS ** (_FALLS[name] - _FALLS[terms[0]])
        added = strength[:, np.newaxis] * columns[1:, column]
        laws = (laws[:, np.newaxis] + added).reshape(-1, index.size)
        prior = np.outer(prior, share).ravel()
    return laws, prior


# ---- N behind the readings of an angle ---------------------------------------------------

# Ordinates looked at.
_LOWEST: Final = 64

LEAST_AVERAGES: Final = 8 * _LOWEST
"""Fewest averages of an angle whose lowest ordinates are looked at."""


def highest_walk(
    averages: FloatArray,
    motions: FloatArray,
    *,
    interval: float,
    masked: Sequence[tuple[float, float]] = (),
    confidence: float = 0.95,
) -> float:
    """Largest N that the lowest frequencies of an angle allow beside white noise of its readings.

    Noise of the readings of an angle rises as f^2 in the spectrum of its rate: it hides N least at
    the lowest frequencies. There it is no small matter what a window does: in the cosine transform
    of the increments the readings at both ends stand at every frequency. The sine transform (DST-I)
    has neither end. In it the increments of means of white noise and of a walk are exactly
    uncorrelated at every length, since the covariance of both is tridiagonal and the same along its
    diagonals:

        m_k = N^2 T (2 + cos w_k) / 3 + q 4 sin^2 (w_k / 2),   w_k = pi k / averages.

    What else moves the angle slowly (a constant rate, the table's own motion by an error of the
    share or by a delay) is given to it as columns whose factors are integrated out. N^2 keeps its
    weight as evenly as q in its logarithm. Any other noise only raises the bound.

    Parameters
    ----------
    averages
        (averages,) of an angle over stretches of equal length, one after another, rad.
    motions
        (columns, averages), angles of any unit that it may hold besides, each with a factor of its
        own; a straight line is allowed for without being asked.
    interval
        Length of a stretch, s.
    masked
        (low, high) bands of lines, Hz, to leave out.
    confidence
        That N lies below.

    Returns
    -------
    float
        rad/sqrt(s); infinite if too few ordinates are left.
    """
    size = averages.size
    index = np.arange(1, size)[:_LOWEST]
    frequency, cell = index / (2.0 * size * interval), 1.0 / (size * interval)
    for low, high in masked:
        apart = (frequency < low - cell) | (frequency > high + cell)
        index, frequency = index[apart], frequency[apart]
    values = _sine_transform(averages)[index - 1]
    if values.size < 16 or not np.any(values):
        return math.inf
    # Columns that are nearly one another stay apart from rounding.
    columns = np.linalg.qr(_columns(motions)[:, index - 1].T)[0].T
    rest = values - columns.T @ (columns @ values)
    angle = 0.5 * np.pi * index / size
    of_walk, of_reading = (2.0 + np.cos(2.0 * angle)) / 3.0, 4.0 * np.sin(angle) ** 2
    # N^2 T beside the mean ordinate, and q beside the readings' law: both even in the logarithm.
    walks = np.geomspace(1e-4, 1e1, 200) * float(np.mean(rest**2))
    readings = np.geomspace(1e-6, 1e2, 80) * float(np.median(rest**2 / of_reading))
    logarithm = np.empty((walks.size, readings.size))
    for row, walk in enumerate(walks):
        fit = _integrated(rest, walk * of_walk + readings[:, np.newaxis] * of_reading, columns)
        logarithm[row] = fit.logarithm - 0.5 * fit.rest
    density = np.exp(logarithm - logarithm.max()).sum(axis=1) * np.sqrt(walks)
    below = (np.cumsum(density) - 0.5 * density) / density.sum()
    return math.sqrt(float(np.interp(confidence, below, walks)) / interval)


def _sine_transform(averages: FloatArray) -> FloatArray:
    """(..., averages - 1) orthonormal sine transform (DST-I) of the increments."""
    return np.asarray(dst(np.diff(averages), type=1, norm="ortho"))


def _columns(motions: FloatArray) -> FloatArray:
    """(columns, averages - 1) transforms of a straight line and of motions beside it."""
    size = motions.shape[1]
    beside = motions - np.linspace(motions[:, 0], motions[:, -1], size, axis=1)
    # What is left of a straight line is rounding.
    moving = beside[np.abs(beside).max(axis=1) > 1e-9 * np.abs(motions).max(axis=1)]
    return _sine_transform(np.vstack([np.arange(float(size)), moving]))
