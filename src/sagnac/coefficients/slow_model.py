"""Slow noise as the levels of a spectrum show it: B, K and a Markov rate that earns its place."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.optimize import minimize_scalar, nnls
from scipy.special import ndtri

from sagnac.arrays import FloatArray
from sagnac.coefficients.estimates import Estimate, Interval, require_confidence
from sagnac.coefficients.laws import CoefficientName, markov_density, rate_density_basis
from sagnac.coefficients.model_average import ModelChoice
from sagnac.coefficients.whole_band import describes
from sagnac.spectrum.levels import Levels

# Twice the logarithm of the likelihood that slow noise, or a Markov rate in it, has to add: five
# standard deviations.
_EARNED: Final = 25.0
# Chance at which levels of noise with a Markov rate are not described by it.
_CHANCE: Final = 0.001
_TIMES_PER_DECADE: Final = 8
_ITERATIONS: Final = 200
_CONVERGED: Final = 1e-10
_LEAST_BINS: Final = 8
_STEP: Final = 1.01  # by which a time is changed for a slope
# A term below this part of the law at every level is none.
_NEGLIGIBLE: Final = 1e-6


@dataclass(frozen=True, slots=True, kw_only=True)
class MarkovEstimate:
    """A Markov rate: its standard deviation, rad/s, and its correlation time, s."""

    deviation: Interval
    correlation_time: Interval


@dataclass(frozen=True, slots=True, kw_only=True)
class SlowModel:
    """Noise that is slower than white, which the levels do not tell apart any further.

    Attributes
    ----------
    bias_instability, rate_random_walk
        Most likely B, rad/s, and K, rad/s/sqrt(s), beside each other and the Markov rate; 0 for
        none.
    markov
        None if B and K are as likely.
    """

    bias_instability: float
    rate_random_walk: float
    markov: MarkovEstimate | None


def slow_model(levels: Levels, *, highest: float, confidence: float = 0.95) -> SlowModel | None:
    """The most likely Q, N, B and K, with a Markov rate if the levels need and bear out one.

    The level of a bin follows a gamma law, the likelihood of which is highest where least squares
    with weights of the law itself end; no term is negative.

    Parameters
    ----------
    levels
        Of a rate spectrum.
    highest
        Frequency up to which they count, Hz: above, a sensor's low-pass or its readout rules.
    confidence
        Of the intervals.

    Returns
    -------
    SlowModel or None
        None if white noise is as likely.
    """
    require_confidence(confidence)
    used = levels.frequency <= highest
    level, shape, interval = levels.level[used], levels.shape[used], levels.spectrum.interval
    if level.size < _LEAST_BINS:
        return None
    # Q, N, B and K.
    plain = levels.law(lambda frequency: rate_density_basis(frequency, interval))[used]
    _, white = _likeliest(plain[:, :2], level, shape)
    squares, without = _likeliest(plain, level, shape)
    found = None

    def laws(time: float) -> FloatArray:
        def law(frequency: FloatArray) -> FloatArray:
            return markov_density(frequency, interval, time)[:, np.newaxis]

        return np.concatenate([plain, levels.law(law)[used]], axis=1)

    time = _likeliest_time(levels.frequency[used], lambda t: _likeliest(laws(t), level, shape)[1])
    if time is not None:
        law = laws(time)
        each, with_rate = _likeliest(law, level, shape)
        mean = law @ each
        freedom = level.size - each.size - 1
        if without - with_rate >= _EARNED and describes(shape, level / mean, freedom, _CHANCE):
            shorter, longer = (laws(time * factor)[:, -1] for factor in (1.0 / _STEP, _STEP))
            slope = each[-1] * (longer - shorter) / (2.0 * math.log(_STEP))
            terms = np.column_stack([(law * each)[:, each > 0.0], slope]) / mean[:, np.newaxis]
            found = _estimate(time, float(each[-1]), terms, shape, confidence)
            squares, without = each[:-1], with_rate
    if white - without < _EARNED:
        return None
    return SlowModel(
        bias_instability=math.sqrt(squares[2]),
        rate_random_walk=math.sqrt(squares[3]),
        markov=found,
    )


def untold(
    levels: Levels | None,
    choice: ModelChoice | None,
    estimates: Mapping[CoefficientName, Estimate],
) -> SlowModel | None:
    """`slow_model` beside an answer that has N, but of B and K bounds at most.

    Parameters
    ----------
    levels
        Of what the answer is of.
    choice
        Band that it rests on.
    estimates
        By coefficient.

    Returns
    -------
    SlowModel or None
        None if the answer has no N, or has B or K, or white noise is as likely.
    """
    walk = estimates.get("angle_random_walk")
    if levels is None or choice is None or walk is None or walk.status != "estimated":
        return None
    slow = (estimates.get("bias_instability"), estimates.get("rate_random_walk"))
    if any(one is not None and one.status == "estimated" for one in slow):
        return None
    return slow_model(levels, highest=choice.band_hz[1], confidence=walk.confidence)


def _likeliest_time(frequency: FloatArray, deviance: Callable[[float], float]) -> float | None:
    """Correlation time, s; None if it is not within what the frequencies show."""
    longest, shortest = 0.5 / (math.pi * frequency[[0, -1]])
    count = max(3, math.ceil(_TIMES_PER_DECADE * math.log10(longest / shortest)))
    grid = np.geomspace(shortest, longest, count)
    at = int(np.argmin([deviance(float(time)) for time in grid]))
    if at in (0, grid.size - 1):
        return None
    best = minimize_scalar(
        lambda logarithm: deviance(math.exp(logarithm)),
        bounds=np.log(grid[[at - 1, at + 1]]),
        method="bounded",
        options={"xatol": 1e-3},
    )
    return math.exp(best.x)


def _likeliest(laws: FloatArray, level: FloatArray, shape: FloatArray) -> tuple[FloatArray, float]:
    """Squares (terms,), none negative, and minus twice the logarithm of the likelihood."""
    scale = laws.max(axis=0)
    relative = laws / scale
    mean, before = level, math.inf
    for _ in range(_ITERATIONS):
        weight = np.sqrt(shape) / mean
        squares, _ = nnls(relative * weight[:, np.newaxis], level * weight)
        mean = np.maximum(relative @ squares, 1e-12 * level)
        deviance = float(2.0 * shape @ (level / mean + np.log(mean)))
        if abs(before - deviance) < _CONVERGED * abs(deviance):
            break
        before = deviance
    squares = np.where((relative * squares).max(axis=0) > _NEGLIGIBLE * mean.min(), squares, 0.0)
    return squares / scale, deviance


def _estimate(
    time: float, square: float, terms: FloatArray, shape: FloatArray, confidence: float
) -> MarkovEstimate:
    """Intervals by the information of the levels on the logarithms of the terms that are there.

    `terms` (bins, terms) are those over their sum, the Markov rate last but one, and what the sum
    changes by with the logarithm of the time; `square` is the squared driving noise.
    """
    covariance = np.linalg.pinv(terms.T @ (shape[:, np.newaxis] * terms))
    deviations = float(ndtri(0.5 + 0.5 * confidence))
    # The square of the deviation is q^2 T/2.
    along = np.zeros(terms.shape[1])
    along[-2:] = 0.5

    def interval(value: float, variance: float) -> Interval:
        factor = math.exp(deviations * math.sqrt(variance))
        return Interval(value=value, low=value / factor, high=value * factor)

    return MarkovEstimate(
        deviation=interval(math.sqrt(0.5 * square * time), float(along @ covariance @ along)),
        correlation_time=interval(time, float(covariance[-1, -1])),
    )
