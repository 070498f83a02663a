"""The rate ramp: a straight line in slow noise of which a record shows little.

A slope lies nearly all in the lowest ordinate of the cosine transform, and what noise makes there
shows in the few ordinates above it alone. So the noise is not put at its most likely law: every
law that those ordinates allow keeps its weight (integrated likelihood; Berger, Liseo and Wolpert,
Statist. Sci. 14, 1, 1999), which gives the slope the wide tails of Student's law.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.special import ndtr, stdtr

from sagnac.core.arrays import FloatArray
from sagnac.core.errors import RecordingError
from sagnac.noise.cosine_spectrum import (
    LEAST_BINS,
    SINGLE,
    CosineSpectrum,
    cosine_bins,
    cosine_spectrum,
    slope_transform,
)
from sagnac.noise.estimates import SquaredEstimate
from sagnac.noise.laws import STOCHASTIC_NAMES, CoefficientName, cosine_power_basis
from sagnac.noise.likelihood import PRESENCE
from sagnac.spectrum.periodogram import bin_sums
from sagnac.spectrum.transforms import cosine_transform

# Terms by the steepness of their fall, and the power of frequency by which each falls.
_FALLS: Final[dict[CoefficientName, int]] = {
    "angle_random_walk": 0,
    "bias_instability": 1,
    "rate_random_walk": 2,
}
# Indices at which a slow term may cross the others: none, then evenly in logarithm.
_CROSSINGS: Final = np.concatenate([[0.0], np.geomspace(0.05, 16.0 * SINGLE, 31)])
# Sums of increments that are enough for the lowest ordinates.
_SUMS: Final = 64 * SINGLE
# Share of the weight below which a law is left out.
_LIGHT: Final = 1e-9
# Scales from the centre beyond which nothing is looked for, and a part of one to look for.
_FARTHEST: Final = 1e3
_PRECISION: Final = 1e-6


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

    def quantile(self, probability: float) -> float:
        """Slope below which the probability lies."""
        return self._crossing(lambda slope: self.below(slope) - probability, -1.0)

    def largest(self, confidence: float) -> float:
        """Size below which the slope lies, whatever its sign."""
        return self._crossing(lambda size: self.below(size) - self.below(-size) - confidence, 0.0)

    def _crossing(self, excess: Callable[[float], float], begin: float) -> float:
        """Zero of an increasing function between `begin` times the farthest slope and that."""
        farthest = float(np.abs(self.centre).max() + _FARTHEST * self.scale.max())
        precision = _PRECISION * float(self.scale.min())
        return float(brentq(excess, begin * farthest, farthest, xtol=precision))


def rate_ramp(
    increments: FloatArray,
    *,
    sample_rate: float,
    masked: tuple[tuple[float, float], ...] = (),
    settling: float | None = None,
    confidence: float = 0.95,
) -> SquaredEstimate:
    """Square of the rate ramp of increments of any length, (rad/s^2)^2.

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
    SquaredEstimate
        Not observable if too few of the lowest ordinates are left.
    """
    step = max(1, increments.size // _SUMS)
    edges = step * np.arange(increments.size // step + 1)
    sums = bin_sums(increments, edges)
    try:
        cosine = cosine_spectrum(sums, kind="increment", sample_rate=sample_rate / step)
        bins = cosine_bins(cosine.transform.size, cosine.interval, masked, None)
    except RecordingError:
        return SquaredEstimate.unseen()
    beside = None
    if settling is not None:
        times = cosine.interval * np.arange(cosine.transform.size)
        beside = cosine_transform(np.exp(-times / settling))
    return ramp_square(cosine, bins.starts[bins.count == 1.0], confidence, beside)


def ramp_square(
    cosine: CosineSpectrum,
    index: NDArray[np.int64],
    confidence: float,
    beside: FloatArray | None = None,
) -> SquaredEstimate:
    """Square of the rate ramp, (rad/s^2)^2.

    It is called estimated if a slope of the other sign, or none, is as improbable as beyond three
    standard deviations.

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
    if index.size < LEAST_BINS or index[0] > 1:
        return SquaredEstimate.unseen()
    found = _slopes(cosine, index, None if beside is None else beside[index])
    tail = 0.5 - 0.5 * confidence
    if found.below(0.0) < min(float(ndtr(-math.sqrt(PRESENCE))), tail):
        value, low, high = (
            found.quantile(probability) ** 2 * cosine.interval**-4
            for probability in (0.5, tail, 1.0 - tail)
        )
        return SquaredEstimate(value=value, low=low, high=high, status="estimated")
    return SquaredEstimate.bound(found.largest(confidence) ** 2 * cosine.interval**-4)


def _slopes(cosine: CosineSpectrum, index: NDArray[np.int64], beside: FloatArray | None) -> _Slopes:
    """The slope, turned so that it is more probably positive, under every law of the noise.

    For noise of the variances ``s v`` the likelihood of a slope is Gaussian, and its integral over
    the slope and, with the weight 1/s, over s is known (Zellner, An Introduction to Bayesian
    Inference in Econometrics, 1971, ch. 3). What is beside the slope is integrated over as well.
    """
    shape = slope_transform(index.astype(np.float64), cosine.transform.size)
    values = cosine.transform[index]
    laws, prior = _laws(cosine, index)
    freedom = index.size - 1
    logarithm = -0.5 * np.log(laws).sum(axis=1)
    information = (shape**2 / laws).sum(axis=1)
    moment = (shape * values / laws).sum(axis=1)
    rest = (values**2 / laws).sum(axis=1)
    if beside is not None:
        freedom -= 1
        own, shared, seen = ((beside * one / laws).sum(axis=1) for one in (beside, shape, values))
        information = information - shared**2 / own
        moment = moment - shared * seen / own
        rest = rest - seen**2 / own
        logarithm -= 0.5 * np.log(own)
    further = moment / information
    rest = rest - further**2 * information
    rest = np.maximum(rest, np.finfo(np.float64).tiny)
    logarithm -= 0.5 * (np.log(information) + freedom * np.log(rest))
    weight = prior * np.exp(logarithm - logarithm.max())
    weight /= weight.sum()
    kept = weight > _LIGHT
    slope = cosine.slope + further
    return _Slopes(
        weight=weight[kept] / weight[kept].sum(),
        centre=math.copysign(1.0, float(weight @ slope)) * slope[kept],
        scale=np.sqrt(rest / (freedom * information))[kept],
        freedom=freedom,
    )


def _laws(cosine: CosineSpectrum, index: NDArray[np.int64]) -> tuple[FloatArray, FloatArray]:
    """Expected squares up to a factor, (laws, ordinates), and prior weights, (laws,).

    The index at which a slow term crosses the least slow one is evenly likely below the first, and
    evenly in its logarithm above.
    """
    samples, interval = cosine.transform.size, cosine.interval
    terms = [name for name in _FALLS if name in cosine.terms] or ["quantization"]
    places = np.concatenate([[1.0], index.astype(np.float64)])
    basis = cosine_power_basis(places, samples, interval)
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
