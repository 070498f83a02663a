"""Slow noise as the levels of a spectrum show it: B, K and Markov rates that earn their place."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from operator import attrgetter
from typing import Final

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.special import ndtri

from sagnac.core.arrays import FloatArray
from sagnac.noise.band_models import ORDERS, divisor_laws
from sagnac.noise.bounds import slow_noise
from sagnac.noise.estimates import Coefficients, Interval
from sagnac.noise.laws import level_laws, markov_density
from sagnac.noise.likelihood import PRESENCE, non_negative
from sagnac.noise.model_average import ModelChoice
from sagnac.noise.slow_laws import FLICKER, RATE_WALK
from sagnac.noise.whole_band import describes
from sagnac.spectrum.levels import Levels
from sagnac.stability.curve import StabilityCurve

# Twice the logarithm of the likelihood that slow noise, or each Markov rate in it, has to add: five
# standard deviations.
_EARNED: Final = 25.0
# Sets of terms, by their places among Q, N, B and K.
_TERMS: Final = ((0, 1), (0, 1, FLICKER), (0, 1, RATE_WALK), (0, 1, FLICKER, RATE_WALK))
_NEAR: Final = 0.95  # of the least N that an answer allows
_STEP: Final = 1.01  # by which a time is changed for a slope
_NO_FALLS: Final = (0.0,) * len(ORDERS)

Terms = tuple[int, ...]
Times = tuple[float, ...]


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
        Most likely B, rad/s, and K, rad/s/sqrt(s), beside each other and the Markov rates; 0 if the
        rest is as likely without.
    rates
        None, one or two Markov rates, the shorter first; none if B and K are as likely.
    """

    bias_instability: float
    rate_random_walk: float
    rates: tuple[MarkovEstimate, ...]


def slow_model(
    levels: Levels,
    *,
    highest: float,
    least: float = 0.0,
    falls: tuple[float, ...] = _NO_FALLS,
    confidence: float = 0.95,
) -> SlowModel | None:
    """The most likely Q, N, B and K, with one or two Markov rates that the levels bear out.

    The level of a bin follows a gamma law, the likelihood of which is highest where least squares
    with weights of the law itself end; no term is negative.

    Parameters
    ----------
    levels
        Of a rate spectrum.
    highest
        Frequency up to which they count, Hz: above, a sensor's low-pass or its readout rules.
    least
        N is no less, rad/sqrt(s): a Markov rate beside less white noise is a part of that N.
    falls
        c of the divisors of a low-pass, as of a `BandModel`: its fall is no slow noise.
    confidence
        Of the intervals.

    Returns
    -------
    SlowModel or None
        None if white noise is as likely.
    """
    used = levels.frequency <= highest
    level, shape, interval = levels.level[used], levels.shape[used], levels.spectrum.interval
    if level.size < 8:
        return None

    passed = 1.0 + divisor_laws(levels.frequency[used]) @ np.array(falls)

    # All sets of terms look at the same times.
    @cache
    def markov(time: float) -> FloatArray:
        law = levels.law(lambda frequency: markov_density(frequency, interval, time)[:, np.newaxis])
        return np.asarray(law[used, 0] / passed)

    laws, frequency = level_laws(levels)[used], levels.frequency[used]
    # Q comes after the low-pass.
    laws[:, 1:] /= passed[:, np.newaxis]
    seen = _Seen(level=level, shape=shape, laws=laws, frequency=frequency, markov=markov)
    plain = [seen.fitted(terms) for terms in _TERMS]
    chosen = min(plain, key=attrgetter("weighed"))
    if seen.with_rate(_TERMS[-1], plain[-1].deviance - _EARNED):
        each = [seen.with_rate(terms) for terms in _TERMS]
        best = min((one for one in each if one is not None), key=attrgetter("weighed"))
        two = seen.with_second(best)
        if two is not None and best.weighed - two.weighed >= _EARNED:
            best = two
        # Levels of noise with Markov rates are described by them, except one in a thousand.
        freedom = level.size - len(best.terms) - 2 * len(best.times)
        # White noise comes second in every set of terms.
        is_beside = best.squares[1] >= least**2
        if is_beside and describes(shape, level / best.mean, freedom, 0.001):
            chosen = best
    if plain[0].deviance - chosen.deviance < _EARNED:
        return None
    square = dict(zip(chosen.terms, chosen.squares, strict=False))
    flicker, walk = (math.sqrt(square.get(term, 0.0)) for term in (FLICKER, RATE_WALK))
    rates = seen.estimates(chosen, confidence)
    return SlowModel(bias_instability=flicker, rate_random_walk=walk, rates=rates)


def untold(
    levels: Levels | None,
    choice: ModelChoice | None,
    estimates: Coefficients,
    curve: StabilityCurve | None = None,
) -> SlowModel | None:
    """`slow_model` beside an answer that has N, but of B and K bounds at most, which hold.

    Parameters
    ----------
    levels
        Of what the answer is of.
    choice
        Band that it rests on.
    estimates
        By coefficient.
    curve
        Allan deviation. If it rises above the estimates while the levels show no slow noise, K is
        that of the rise.

    Returns
    -------
    SlowModel or None
        None if the answer has no N, or has B or K, or white noise is as likely.
    """
    walk = estimates.get("angle_random_walk")
    if levels is None or choice is None or walk is None or walk.status != "estimated":
        return None
    slow = estimates.get("bias_instability"), estimates.get("rate_random_walk")
    if any(one is not None and one.status == "estimated" for one in slow):
        return None
    # The levels are robust, and those of heavy tails a little lower.
    highest, least = choice.band_hz[1], _NEAR * walk.low
    falls = choice.law.falls if choice.law else _NO_FALLS
    model = slow_model(
        levels, highest=highest, least=least, falls=falls, confidence=walk.confidence
    )
    if model is None and curve is not None and (rise := slow_noise(curve, estimates)):
        tau, ratio = rise
        excess = float(curve.deviation[curve.tau == tau][0]) ** 2 * (1.0 - 1.0 / ratio**2)
        # Allan variance of a walk: K^2 tau / 3.
        further = math.sqrt(3.0 * excess / tau)
        model = SlowModel(bias_instability=0.0, rate_random_walk=further, rates=())
    if model is None:
        return None
    # The curve may allow no more than an upper bound.
    flicker, further = (
        value if bound is None or bound.status != "upper bound" else min(value, bound.high)
        for value, bound in zip((model.bias_instability, model.rate_random_walk), slow, strict=True)
    )
    return replace(model, bias_instability=flicker, rate_random_walk=further)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Fit:
    """Squares of some terms, and of a Markov rate of each time behind them, with their law."""

    terms: Terms
    times: Times
    squares: FloatArray
    mean: FloatArray
    deviance: float

    @property
    def weighed(self) -> float:
        """Minus twice the logarithm of the likelihood, and what each term has to earn."""
        # B or K beside others earns three standard deviations.
        return self.deviance + PRESENCE * len(self.terms)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Seen:
    """Levels, shapes, laws of Q, N, B and K (bins, 4), frequencies, and that of a Markov rate."""

    level: FloatArray
    shape: FloatArray
    laws: FloatArray
    frequency: FloatArray
    markov: Callable[[float], FloatArray]

    def fitted(self, terms: Terms, times: Times = ()) -> _Fit:
        """The most likely squares of some terms and of Markov rates of some times."""
        laws = self.law(terms, times)
        squares, mean, deviance = np.zeros(laws.shape[1]), self.level, math.inf
        for _ in range(200):
            before, weight = deviance, np.sqrt(self.shape) / mean
            squares = non_negative(laws * weight[:, np.newaxis], self.level * weight)
            mean = np.maximum(laws @ squares, 1e-12 * self.level)
            deviance = float(2.0 * self.shape @ (self.level / mean + np.log(mean)))
            if abs(before - deviance) < 1e-10 * abs(deviance):
                break
        return _Fit(terms=terms, times=times, squares=squares, mean=mean, deviance=deviance)

    def law(self, terms: Terms, times: Times) -> FloatArray:
        """(bins, terms and times) laws of some terms and of Markov rates at one."""
        return np.column_stack([self.laws[:, terms], *map(self.markov, times)])

    def with_rate(self, terms: Terms, highest: float = math.inf, beside: Times = ()) -> _Fit | None:
        """The same with a Markov rate of the most likely time, beside others of given times.

        None if that is not within what the frequencies show, a rate is nothing, or the deviance is
        not `highest` or less.
        """

        def deviance(logarithm: float) -> float:
            return self.fitted(terms, (*beside, math.exp(logarithm))).deviance

        first, last = np.log(0.5 / (math.pi * self.frequency[[-1, 0]]))
        grid = np.linspace(first, last, max(3, math.ceil(3.5 * (last - first))))
        at = int(np.argmin([deviance(float(one)) for one in grid]))
        if at in {0, grid.size - 1}:
            return None
        bounds, precision = grid[[at - 1, at + 1]], {"xatol": 1e-3}
        best = minimize_scalar(deviance, bounds=bounds, method="bounded", options=precision)
        fit = self.fitted(terms, (*beside, math.exp(best.x)))
        stands = fit.squares[len(terms) :].min() > 0.0
        return fit if stands and fit.deviance <= highest else None

    def with_second(self, one: _Fit) -> _Fit | None:
        """The most likely fit of two Markov rates that lies beside the best of one.

        The second is sought beside the first, then each anew beside the other until the likelihood
        stays; the shorter is first. The terms beside are those of the best of one, or white noise
        alone. None if there is none.
        """
        fits: list[_Fit] = []
        for terms in {one.terms, _TERMS[0]}:
            fit = anew = self.with_rate(terms, beside=one.times)
            for _ in range(20):
                if anew is None:
                    break
                fit = anew
                anew = self.with_rate(terms, fit.deviance - 0.1, fit.times[-1:])
            if fit is not None:
                fits.append(self.fitted(terms, tuple(sorted(fit.times))))
        return min(fits, key=attrgetter("weighed"), default=None)

    def estimates(self, fit: _Fit, confidence: float) -> tuple[MarkovEstimate, ...]:
        """Intervals by the information of the levels on the logarithms of the terms there are."""
        count, rates = len(fit.times), fit.squares[len(fit.terms) :]
        steps = (self.markov(time * _STEP) - self.markov(time / _STEP) for time in fit.times)
        pairs = zip(rates, steps, strict=True)
        slopes = [square * step / (2.0 * math.log(_STEP)) for square, step in pairs]
        there = (self.law(fit.terms, fit.times) * fit.squares)[:, fit.squares > 0.0]
        terms = np.column_stack([there, *slopes]) / fit.mean[:, np.newaxis]
        covariance = np.linalg.pinv(terms.T @ (self.shape[:, np.newaxis] * terms))
        deviations = float(ndtri(0.5 + 0.5 * confidence))

        def interval(value: float, along: FloatArray) -> Interval:
            factor = math.exp(deviations * math.sqrt(along @ covariance @ along))
            return Interval(value=value, low=value / factor, high=value * factor)

        # The square of the deviation is q^2 T/2.
        along = np.eye(terms.shape[1])[terms.shape[1] - 2 * count :]
        estimates, pairs = [], zip(along[:count], along[count:], strict=True)
        for square, time, (one, other) in zip(rates.tolist(), fit.times, pairs, strict=True):
            deviation = interval(math.sqrt(0.5 * square * time), 0.5 * (one + other))
            lasts = interval(time, other)
            estimates.append(MarkovEstimate(deviation=deviation, correlation_time=lasts))
        return tuple(estimates)
