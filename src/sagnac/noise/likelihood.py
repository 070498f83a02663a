"""The maximum of a likelihood in squared coefficients, and intervals by its profile."""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, cached_property
from typing import Final

import numpy as np
from scipy.linalg.lapack import dposv, dpotrf
from scipy.optimize import brentq, nnls
from scipy.special import log_ndtr, ndtri

from sagnac.core.arrays import BooleanArray, FloatArray
from sagnac.core.errors import Note
from sagnac.noise.estimates import Estimate, rooted, unobserved
from sagnac.noise.laws import CoefficientName

# A term is called present if leaving it out costs three standard deviations: a false
# alarm of 0.13 % for each term that is not there.
PRESENCE: Final = 9.0
# Standard deviations from which on a term is taken to have been picked for its size.
_PICKED: Final = 2.5


# ---- where an interval ends --------------------------------------------------------------


def crossing(
    rise: Callable[[float], float], inside: float, step: float, limit: float = math.inf
) -> float:
    """Where `rise`, negative at `inside`, crosses zero towards `step`, not beyond `limit`.

    Steps that grow put the zero between two places; it is found to 1e-9 of their distance, so that
    it does not hang on a rounding error at one of them.

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

    # The root finder asks the ends again; an infinite rise would leave it no secant.
    @cache
    def finite(place: float) -> float:
        return min(max(rise(place), -1e3), 1e3)

    if finite(inside) >= 0.0:
        return inside
    low = inside
    for _ in range(26):
        high = inside + step if abs(step) < abs(limit - inside) else limit
        if finite(high) >= 0.0:
            return float(brentq(finite, low, high, xtol=1e-9 * abs(high - low)))
        if high == limit:
            return limit
        low, step = high, 1.8 * step
    return math.copysign(math.inf, step)


def typical_square(term: FloatArray, total: FloatArray) -> float:
    """Square at which a term would make all that was seen at half of the places."""
    return float(np.median(total / term))


def non_negative(matrix: FloatArray, vector: FloatArray) -> FloatArray:
    """Solution of ``matrix @ squares = vector`` by least squares, none of it below zero."""
    if matrix.shape[1] == 0:
        # scipy 1.17 frees memory twice, and the process with it, on a matrix without columns.
        return np.empty(0)
    scale = 1.0 / np.maximum(np.linalg.norm(matrix, axis=0), 1e-300)
    return np.asarray(nnls(matrix * scale, vector)[0] * scale)


def interval_ends(confidence: float) -> tuple[float, float]:
    """Standard deviations to the ends of an interval, and to a bound of the same confidence."""
    return float(ndtri(0.5 + 0.5 * confidence)), float(ndtri(max(confidence, 0.5)))


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

    # No tail of any confidence reaches farther than 60.
    farthest = min(presence, 60.0)
    if not presence > 0.0 or excess(farthest) >= 0.0:
        return math.inf
    return float(brentq(excess, 0.0, farthest))


def detected(confidence: float) -> float:
    """Standard deviations from zero of a term that is estimated with this probability."""
    threshold = -float(ndtri(0.5 * (1.0 - confidence) * math.exp(float(log_ndtr(-_PICKED)))))
    return max(threshold, math.sqrt(PRESENCE)) + float(ndtri(max(confidence, 0.5)))


# ---- likelihoods -------------------------------------------------------------------------

Curvature = Callable[[], FloatArray]


@dataclass(frozen=True, slots=True, kw_only=True)
class Place:
    """Squared coefficients, -2 log likelihood there, and the law that they make.

    The law is the mean of each ordinate, or the inverse of each spectral matrix.
    """

    squares: FloatArray
    deviance: float
    law: FloatArray


class Likelihood(ABC):
    """Data, and a law of them that is linear in squared coefficients, which may be negative."""

    @abstractmethod
    def at(self, squares: FloatArray) -> Place:
        """The place of some squares; its deviance is infinite if no data follow such a law."""

    @abstractmethod
    def fisher(self, place: Place) -> FloatArray:
        """(terms, terms) Fisher information."""

    @abstractmethod
    def move(self, place: Place, free: BooleanArray) -> FloatArray:
        """Step of the free squares towards the maximum."""

    @abstractmethod
    def start(self, squares: FloatArray, free: BooleanArray) -> FloatArray:
        """Squares to start from if the free ones of some make no law."""

    def missed(self, column: int, error: float, confidence: float) -> float:
        """Largest square that is not called estimated with a probability of one less `confidence`.

        What is there and larger would have been estimated, so that bounds hold of those that are
        given as bounds.
        """
        return detected(confidence) * error

    def typical(self, column: int, best: Place) -> float:
        """Square at which a term alone would make half of the data, which no bound reaches."""
        return math.inf

    def maximum(self, start: FloatArray, held: int | None = None) -> Place:
        """The most likely squares.

        Parameters
        ----------
        start
            (terms,) squares to begin with.
        held
            Column of one that keeps its value there.
        """
        free = np.arange(start.size) != held
        place = self.at(start)
        if not math.isfinite(place.deviance):
            place = self.at(self.start(start, free))
        while free.any() and math.isfinite(place.deviance):
            before, place = place.deviance, self._lowered(place, free)
            # Far below what chance does; where scoring creeps, a step of ten times this stops a
            # bound 3 % short of the maximum's.
            if before - place.deviance < 1e-4:
                break
        return place

    def _lowered(self, place: Place, free: BooleanArray) -> Place:
        """The first of the step and its halves that lowers the deviance, or `place` itself."""
        move = self.move(place, free)
        for halvings in range(40):
            squares = place.squares.copy()
            squares[free] += 0.5**halvings * move
            trial = self.at(squares)
            if trial.deviance < place.deviance:
                return trial
        return place

    def estimate(
        self, best: Place, column: int, name: CoefficientName, confidence: float
    ) -> Estimate:
        """One coefficient by profile likelihood.

        It is estimated if leaving it out costs three standard deviations, else bounded. With few
        degrees of freedom the law of a square is skew, and reaches farther up than down.

        Parameters
        ----------
        best
            The maximum.
        column, name
            Of the coefficient.
        confidence
            Of the interval or bound.
        """
        scale, covariance = scaled_covariance(self.fisher(best))
        error = math.sqrt(max(covariance[column, column], 1.0)) * float(scale[column])
        value = float(best.squares[column])
        # How the other squares move when this one does.
        direction = covariance[:, column] * scale / (covariance[column, column] * scale[column])

        def deviance(square: float) -> float:
            start = best.squares + direction * (square - value)
            start[column] = square
            return self.maximum(start, column).deviance

        def limit(reference: float, far: float, end: float = math.inf) -> float:
            """Where the deviance has risen by `far` standard deviations, squared."""

            def short(square: float) -> float:
                return math.sqrt(max(deviance(square) - reference, 0.0)) - abs(far)

            return crossing(short, max(value, 0.0), error * far, end)

        two_sided, one_sided = interval_ends(confidence)
        absent = deviance(0.0)
        presence = math.sqrt(max(absent - best.deviance, 0.0)) if value > 0.0 else 0.0
        down = low_end(presence, confidence) if presence > math.sqrt(PRESENCE) else math.inf
        if math.isfinite(down):
            high = limit(best.deviance, two_sided)
            if math.isfinite(high):
                return rooted(name, confidence, value, limit(best.deviance, -down, 0.0), high)
        high = limit(best.deviance if value > 0.0 else absent, one_sided)
        nothing = unobserved(name, confidence)
        if high < self.typical(column, best):
            return nothing.bounded(math.sqrt(max(high, self.missed(column, error, confidence))))
        return nothing


@dataclass(frozen=True, kw_only=True)
class Ordinates(Likelihood):
    """Squares of a transform, averaged over bins.

    `power` (bins,) is the mean of `count` squares whose mean is ``basis @ squares``;
    `weight` is the number of degrees of freedom granted to a bin. `departure` is the common
    relative departure of the bins from the terms that the weights allow for, plus one if some are
    left out; 0 if the terms suffice.
    """

    basis: FloatArray
    power: FloatArray
    count: FloatArray
    weight: FloatArray
    frequency: FloatArray
    departure: float = 0.0
    notes: tuple[Note, ...] = ()

    @property
    def terms(self) -> int:
        """Columns of the basis."""
        return int(self.basis.shape[1])

    @cached_property
    def best(self) -> Place:
        """The maximum, kept."""
        return self.maximum(np.zeros(self.terms))

    def at(self, squares: FloatArray) -> Place:
        """The place of some squares, if every mean is positive."""
        mean = self.basis @ squares
        deviance = math.inf
        if mean.min() > 0.0:
            deviance = float(self.weight @ (np.log(mean) + self.power / mean))
        return Place(squares=squares, deviance=deviance, law=mean)

    def fisher(self, place: Place) -> FloatArray:
        """(terms, terms) Fisher information, half a degree of freedom for each square."""
        weight = self.weight / place.law**2
        return np.asarray(0.5 * self.basis.T @ (weight[:, np.newaxis] * self.basis))

    def move(self, place: Place, free: BooleanArray) -> FloatArray:
        """Step of the free squares (`parabola_move`)."""
        columns, mean = self.basis[:, free], place.law
        expected = self.weight / mean**2
        gradient = columns.T @ (expected * (mean - self.power))

        def curvature(weight: FloatArray) -> FloatArray:
            return np.asarray(columns.T @ (weight[:, np.newaxis] * columns))

        observed = curvature(expected * (2.0 * self.power / mean - 1.0))
        return parabola_move(observed, lambda: curvature(expected), gradient, place.squares[free])

    def start(self, squares: FloatArray, free: BooleanArray) -> FloatArray:
        """By least squares, none below zero."""
        result, columns = squares.copy(), self.basis[:, free]
        # Single squares have a chi-square of one degree of freedom: smooth before weighting.
        kernel = np.ones(min(9, self.power.size))
        smooth = np.convolve(self.power * self.count, kernel, "same")
        smooth /= np.convolve(self.count, kernel, "same")
        root = np.sqrt(self.weight) / smooth
        result[free] = non_negative(columns * root[:, np.newaxis], self.power * root)
        return result

    def missed(self, column: int, error: float, confidence: float) -> float:
        """The spectrum that is expected with the square is fitted without it.

        Cowan et al., Eur. Phys. J. C 71, 1554, 2011.
        """
        without = self.maximum(np.zeros(self.terms), column)
        wanted, start = detected(confidence), without.squares

        def short(square: float) -> float:
            nonlocal start
            mean = without.law + square * self.basis[:, column]
            fitted = replace(self, power=mean).maximum(start, column)
            # The next square is mostly close to this one.
            start = fitted.squares
            truth = float(self.weight @ (np.log(mean) + 1.0))
            return math.sqrt(max(fitted.deviance - truth, 0.0)) - wanted

        crossed = crossing(short, 0.0, wanted * error)
        return crossed if math.isfinite(crossed) else 0.0

    def typical(self, column: int, best: Place) -> float:
        """Square at which a term alone would make the mean of half of the bins."""
        return typical_square(self.basis[:, column], best.law)


def parabola_move(
    observed: FloatArray, expected: Curvature, gradient: FloatArray, squares: FloatArray
) -> FloatArray:
    """Step to the maximum of the parabola that touches the likelihood.

    By its own curvature (Newton) where that is positive, which squares of one degree of freedom
    leave in doubt far from the maximum; else by the expected one (scoring).

    Parameters
    ----------
    observed
        (terms, terms) half the second derivatives of -2 log likelihood.
    expected
        Gives their expectation, the Fisher information. Asked for only if it is needed.
    gradient
        (terms,) half the first derivatives.
    squares
        (terms,) where they are taken.

    Returns
    -------
    (terms,) to be added to the squares.
    """
    diagonal = observed.diagonal()
    if diagonal.min() > 0.0:
        scale = 1.0 / np.sqrt(diagonal)
        scaled = observed * scale * scale[:, np.newaxis]
        # With room for rounding: nearly collinear terms are not a direction to trust.
        _, indefinite = dpotrf(scaled - 1e-9 * np.eye(scale.size))
        if not indefinite:
            return np.asarray(-scale * dposv(scaled, scale * gradient)[1])
    return scoring_move(expected(), gradient, squares)


def scoring_move(fisher: FloatArray, gradient: FloatArray, squares: FloatArray) -> FloatArray:
    """Step by the expected curvature; directions that the data cannot see go to zero."""
    scale = 1.0 / np.sqrt(np.diag(fisher))
    scaled = fisher * scale * scale[:, np.newaxis]
    target = np.linalg.lstsq(scaled, scale * (fisher @ squares - gradient), rcond=1e-12)[0] * scale
    return np.asarray(target - squares)


def scaled_covariance(fisher: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Error of each parameter alone, and the covariance of all in units of these."""
    scale = 1.0 / np.sqrt(np.diag(fisher))
    return scale, np.asarray(np.linalg.pinv(fisher * scale * scale[:, np.newaxis], rcond=1e-12))
