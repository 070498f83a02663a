"""Where an interval ends: thresholds of presence, and the root finding of profiles."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.optimize import brentq
from scipy.special import gammaincinv, log_ndtr, ndtri

from sagnac.arrays import FloatArray
from sagnac.coefficients.estimates import SquaredEstimate

# A term is called present if leaving it out costs three standard deviations: a false
# alarm of 0.13 % for each term that is not there.
PRESENCE: Final = 9.0
# Standard deviations from which on a term is taken to have been picked for its size.
_PICKED: Final = 2.5
# Standard deviations beyond which no tail of any confidence reaches.
_FARTHEST: Final = 60.0
# Of -2 log likelihood, and of standard deviations at a limit: far below what chance does.
CONVERGED: Final = 1e-3


def crossing(
    rise: Callable[[float], float], inside: float, step: float, limit: float = math.inf
) -> float:
    """Where `rise`, negative at `inside`, crosses zero towards `step`, not beyond `limit`.

    A root finder of its own: `rise` is itself the outcome of an iteration that stops at
    `CONVERGED`, so there is nothing to find below that, each call costs a whole fit, and
    `scipy.optimize.brentq`, which knows a tolerance of the place only, takes twice as many and
    ends elsewhere within it.

    Parameters
    ----------
    rise
        Falls short of the wanted threshold inside (negative), exceeds it outside.
    inside
        Place to start from.
    step
        First step, of either sign.
    limit
        Place beyond which nothing is looked for.

    Returns
    -------
    float
        Infinite, with the sign of `step`, if there is no crossing within a million steps; `limit`
        if there is none before it; `inside` itself if `rise` is not negative there, as when
        weights that differ between two trial values put it beyond.
    """
    low, low_value = inside, rise(inside)
    if low_value >= 0.0:
        return inside
    for _ in range(26):
        high = inside + step
        if abs(high - inside) >= abs(limit - inside):
            high = limit
        high_value = min(rise(high), 1e3)
        if high_value >= 0.0:
            return _between(rise, low, low_value, high, high_value)
        if high == limit:
            return limit
        low, low_value = high, high_value
        step *= 1.8
    return math.copysign(math.inf, step)


def _between(
    rise: Callable[[float], float], low: float, low_value: float, high: float, high_value: float
) -> float:
    """Crossing between two places, by false position that moves by 2 % at least."""
    for _ in range(60):
        if abs(high_value) < CONVERGED:
            return high
        share = low_value / (low_value - high_value)
        middle = low + min(max(share, 0.02), 0.98) * (high - low)
        value = rise(middle)
        if value < 0.0:
            low, low_value = middle, value
        else:
            high, high_value = middle, value
    return 0.5 * (low + high)


def typical_square(term: FloatArray, total: FloatArray) -> float:
    """Square at which a term would make all that was seen at half of the places."""
    return float(np.median(total / term))


def likelihood_drop(confidence: float) -> float:
    """Drop of twice the log likelihood at the end of an interval."""
    return float(2.0 * gammaincinv(0.5, max(confidence, 1e-6)))


def low_end(presence: float, confidence: float) -> float:
    """Standard deviations from an estimate down to the low end of its interval.

    A term is called estimated because it came out large, so that of those that are the weak ones
    are too large more often than by chance. The low end is the truth at which a term that comes
    out at `_PICKED` standard deviations above zero or more comes out as large as this one with the
    chance of one tail (conditional inference after selection). Far above that it is the end of the
    plain interval.

    Parameters
    ----------
    presence
        Standard deviations from zero to the estimate.
    confidence
        Of the interval.

    Returns
    -------
    float
        Infinite if zero is not excluded: what was seen is then no more than bounded.
    """
    tail = math.log(0.5 * (1.0 - confidence))

    def excess(down: float) -> float:
        return float(log_ndtr(-down) - log_ndtr(presence - _PICKED - down)) - tail

    farthest = min(presence, _FARTHEST)
    if not presence > 0.0 or excess(farthest) >= 0.0:
        return math.inf
    return float(brentq(excess, 0.0, farthest))


def detected(confidence: float) -> float:
    """Standard deviations from zero of a term that is estimated with this probability."""
    threshold = -float(ndtri(0.5 * (1.0 - confidence) * math.exp(float(log_ndtr(-_PICKED)))))
    return max(threshold, math.sqrt(PRESENCE)) + float(ndtri(max(confidence, 0.5)))


@dataclass(frozen=True, slots=True, kw_only=True)
class Profile:
    """The profile likelihood of one squared coefficient.

    Attributes
    ----------
    deviance
        -2 log likelihood of the best fit with the square held.
    lowest
        That of the best fit of all.
    value, error
        The square there, and about its standard error.
    confidence
        Of the interval or bound.
    """

    deviance: Callable[[float], float]
    lowest: float
    value: float
    error: float
    confidence: float

    def estimated(self, absent: float) -> SquaredEstimate | None:
        """The square and its interval, if leaving it out costs three standard deviations.

        With few degrees of freedom the law of a square is skew, and reaches farther up than down.

        Parameters
        ----------
        absent
            -2 log likelihood without the term.
        """
        presence = math.sqrt(max(absent - self.lowest, 0.0)) if self.value > 0.0 else 0.0
        if presence <= math.sqrt(PRESENCE):
            return None
        down = low_end(presence, self.confidence)
        if not math.isfinite(down):
            return None
        high = self._limit(self.lowest, self.value, likelihood_drop(self.confidence), 1.0, math.inf)
        if not math.isfinite(high):
            return None
        low = self._limit(self.lowest, self.value, down**2, -1.0, 0.0)
        return SquaredEstimate(value=self.value, low=low, high=high, status="estimated")

    def bound(self, reference: float) -> float:
        """One-sided limit, from the deviance at the square, or at zero if that is negative, on."""
        drop = likelihood_drop(2.0 * self.confidence - 1.0)
        return self._limit(reference, max(self.value, 0.0), drop, 1.0, math.inf)

    def _limit(
        self, reference: float, origin: float, drop: float, sign: float, end: float
    ) -> float:
        """Where the deviance has risen from `reference` by `drop`, from `origin` on."""
        return crossing(
            lambda square: math.sqrt(max(self.deviance(square) - reference, 0.0)) - math.sqrt(drop),
            origin,
            sign * self.error * math.sqrt(drop),
            end,
        )
