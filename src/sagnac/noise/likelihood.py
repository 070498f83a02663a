"""The maximum of the likelihood of a spectrum, intervals by its profile, and where these end."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq, nnls
from scipy.special import chdtrc, gammaincinv, log_ndtr, ndtri

from sagnac.core.arrays import FloatArray
from sagnac.core.errors import Note, rounded
from sagnac.noise.cosine_spectrum import LEAST_BINS, Ordinates
from sagnac.noise.estimates import SquaredEstimate

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


# A bin this many times the terms, that chance (one in ten million) does not put there, is
# something else. Less is taken for a departure of the terms.
_STANDS_OUT: Final = 1.5
# Relative departures between which that of the bins is looked for.
_LEAST_DEPARTURE: Final = 1e-4
_MOST_DEPARTURE: Final = 10.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Optimum:
    """Squared coefficients at a maximum, -2 log likelihood, Fisher information, mean."""

    squares: FloatArray
    deviance: float
    fisher: FloatArray
    mean: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True)
class _Place:
    """Squares of the free terms, the mean of the ordinates there, and -2 log likelihood."""

    squares: FloatArray
    mean: FloatArray
    deviance: float


def maximize(
    spectrum: Ordinates,
    *,
    start: FloatArray | None = None,
    held: int | None = None,
) -> Optimum:
    """Most likely squared coefficients, one of them held if asked.

    Parameters
    ----------
    spectrum
        What is fitted, and to what.
    start
        (terms,) squares to begin with.
    held
        Column of the one that keeps its value, which `start` gives.
    """
    basis = spectrum.basis
    squares = np.zeros(basis.shape[1]) if start is None else start.copy()
    free = np.arange(squares.size) != held
    offset, columns = basis[:, ~free] @ squares[~free], basis[:, free]
    place = _start(spectrum, columns, offset, squares[free])
    while place.squares.size and math.isfinite(place.deviance):
        before = place.deviance
        move = _newton_move(spectrum, columns, place)
        place = _lowered(spectrum, columns, offset, place, move)
        if before - place.deviance < CONVERGED:
            break
    finite = math.isfinite(place.deviance)
    squares[free] = place.squares
    weight = spectrum.weight / place.mean**2 if finite else np.zeros(place.mean.size)
    return Optimum(
        squares=squares,
        deviance=place.deviance,
        fisher=0.5 * basis.T @ (weight[:, np.newaxis] * basis),
        mean=place.mean,
    )


def _start(
    spectrum: Ordinates,
    columns: FloatArray,
    offset: FloatArray,
    squares: FloatArray,
) -> _Place:
    """Where the search begins: `squares` if every mean is positive there, else by least squares."""
    mean = offset + columns @ squares
    if not mean.min() > 0.0:
        squares = _non_negative_start(spectrum, columns)
        mean = offset + columns @ squares
    return _Place(squares=squares, mean=mean, deviance=_deviance(spectrum, mean))


def _newton_move(spectrum: Ordinates, columns: FloatArray, place: _Place) -> FloatArray:
    """Step to the maximum of the parabola that touches the likelihood.

    By Newton's curvature if it is one, which squares of one degree of freedom leave in
    doubt far from the maximum; else by its expectation (scoring).
    """
    expected = spectrum.weight / place.mean**2
    gradient = columns.T @ (expected * (place.mean - spectrum.power))
    observed = expected * (2.0 * spectrum.power / place.mean - 1.0)
    curvature = columns.T @ (observed[:, np.newaxis] * columns)
    scale = _positive_scale(curvature)
    if scale is not None:
        scaled = curvature * scale * scale[:, np.newaxis]
        return np.asarray(-scale * np.linalg.solve(scaled, scale * gradient))
    curvature = columns.T @ (expected[:, np.newaxis] * columns)
    return solve_normal(curvature, curvature @ place.squares - gradient) - place.squares


def _lowered(
    spectrum: Ordinates, columns: FloatArray, offset: FloatArray, place: _Place, move: FloatArray
) -> _Place:
    """The first of the step and its halves that lowers the deviance, or `place` itself."""
    for halvings in range(40):
        squares = place.squares + 0.5**halvings * move
        mean = offset + columns @ squares
        deviance = _deviance(spectrum, mean)
        if deviance < place.deviance:
            return _Place(squares=squares, mean=mean, deviance=deviance)
    return place


def _deviance(spectrum: Ordinates, mean: FloatArray) -> float:
    """-2 log likelihood of the squares, infinite if their mean is not positive."""
    if not mean.min() > 0.0:
        return math.inf
    return float(spectrum.weight @ (np.log(mean) + spectrum.power / mean))


def _positive_scale(matrix: FloatArray) -> FloatArray | None:
    """(terms,) that make the diagonal one, or None if the matrix is not positive definite."""
    diagonal = matrix.diagonal()
    if not diagonal.min() > 0.0:
        return None
    scale = 1.0 / np.sqrt(diagonal)
    try:
        # With room for rounding: nearly collinear terms are not a direction to trust.
        np.linalg.cholesky(matrix * scale * scale[:, np.newaxis] - 1e-9 * np.eye(scale.size))
    except np.linalg.LinAlgError:
        return None
    return scale


def solve_normal(matrix: FloatArray, vector: FloatArray) -> FloatArray:
    """Solve normal equations; directions that the data cannot see stay at zero."""
    scale = 1.0 / np.sqrt(np.diag(matrix))
    scaled = matrix * scale * scale[:, np.newaxis]
    return np.asarray(np.linalg.lstsq(scaled, scale * vector, rcond=1e-12)[0] * scale)


def _non_negative_start(spectrum: Ordinates, columns: FloatArray) -> FloatArray:
    if not columns.shape[1]:
        return np.zeros(0)
    # Single squares have a chi-square of one degree of freedom: smooth before weighting.
    kernel = np.ones(min(9, spectrum.power.size))
    count = spectrum.count
    smooth = np.convolve(spectrum.power * count, kernel, "same") / np.convolve(
        count, kernel, "same"
    )
    root = np.sqrt(spectrum.weight) / smooth
    scale = 1.0 / np.maximum(np.linalg.norm(columns * root[:, np.newaxis], axis=0), 1e-300)
    solution, _ = nnls(columns * root[:, np.newaxis] * scale, spectrum.power * root)
    return np.asarray(solution * scale)


@dataclass(frozen=True, slots=True, kw_only=True)
class Weighed:
    """A spectrum with weights that allow for what its terms do not describe.

    Attributes
    ----------
    spectrum
        With those weights.
    departure
        Common relative departure of the bins, plus one if some are left out; 0 if the terms
        suffice.
    notes
        What was found.
    """

    spectrum: Ordinates
    departure: float = 0.0
    notes: tuple[Note, ...] = ()


def with_departure(spectrum: Ordinates) -> Weighed:
    """`spectrum` with weights that allow for what the terms do not describe.

    Bins that stand far above the terms (a line left, a resonance) weigh nothing; for the
    rest a common relative departure is estimated if it is significant.
    """
    if np.count_nonzero(spectrum.count >= 8.0) < 3 * LEAST_BINS:
        return Weighed(spectrum=spectrum)
    start = maximize(spectrum).squares
    trial, departure = _departure(spectrum, start)
    standing = np.zeros(spectrum.power.size, dtype=np.bool_)
    while departure > 0.0:
        more = ~standing & _stand_out(spectrum, maximize(trial))
        if not more.any() or np.count_nonzero(standing | more) > 0.5 * standing.size:
            break
        standing |= more
        trial, departure = _departure(
            replace(spectrum, weight=np.where(standing, 0.0, spectrum.weight)), start
        )
    notes = []
    if standing.any():
        notes.append(_standing_note(spectrum, standing))
    if departure > 0.0:
        notes.append(_departure_note(trial, departure))
    return Weighed(spectrum=trial, departure=departure + float(standing.any()), notes=tuple(notes))


def _stand_out(spectrum: Ordinates, best: Optimum) -> NDArray[np.bool_]:
    """Bins too far above the terms for chance."""
    ratio = spectrum.power / best.mean
    chance = chdtrc(spectrum.count, spectrum.count * ratio)
    return np.asarray((ratio > _STANDS_OUT) & (chance < 1e-7))


def _standing_note(spectrum: Ordinates, standing: NDArray[np.bool_]) -> Note:
    frequency = spectrum.frequency[standing]
    return Note(
        level="warning",
        text=f"{frequency.size} of {standing.size} bins of the spectrum, from {frequency[0]:.4g} "
        f"to {frequency[-1]:.4g} Hz, stand far above the fitted terms (a line or a resonance is "
        "left) and are left out of the likelihood fit",
    )


def _departure_note(spectrum: Ordinates, departure: float) -> Note:
    ratio = spectrum.power / maximize(spectrum).mean
    worst = int(np.argmax(spectrum.weight * (ratio - 1.0) ** 2))
    return Note(
        level="warning",
        text=f"the spectrum departs from the fitted terms by {rounded(100.0 * departure)} % of the "
        f"power in a bin, most at {spectrum.frequency[worst]:.4g} Hz (x {ratio[worst]:.3g}); the "
        "likelihood intervals allow for it",
    )


def _departure(spectrum: Ordinates, start: FloatArray) -> tuple[Ordinates, float]:
    """Weights with the relative departure of the bins that explains their scatter, or 0.

    The squares are searched for from `start` on.
    """
    used = (spectrum.count >= 8.0) & (spectrum.weight > 0.0)
    freedom = max(1, np.count_nonzero(used) - spectrum.basis.shape[1])

    def weighted(departure: float) -> tuple[Ordinates, float]:
        """With these weights, and chi-square over its degrees of freedom."""
        nonlocal start
        weight = np.where(
            spectrum.weight > 0.0, 1.0 / (1.0 / spectrum.count + 0.5 * departure**2), 0.0
        )
        trial = replace(spectrum, weight=weight)
        best = maximize(trial, start=start)
        start = best.squares
        ratio = spectrum.power / best.mean - 1.0
        return trial, 0.5 * float(weight[used] @ ratio[used] ** 2) / freedom

    # Asked twice at the ends, and the way there may lead to another maximum.
    @cache
    def excess(log_departure: float) -> float:
        # In proportion to 1 / departure^2 far out: almost a line, on which brentq is at home.
        return math.log(max(weighted(math.exp(log_departure))[1], 1e-9))

    trial, chi_squared = weighted(0.0)
    chance = 5.0 * math.sqrt(np.sum(2.0 + 12.0 / spectrum.count[used]))
    if (chi_squared - 1.0) * freedom < chance:
        return trial, 0.0
    least, most = math.log(_LEAST_DEPARTURE), math.log(_MOST_DEPARTURE)
    departure = _MOST_DEPARTURE
    if excess(most) < 0.0:
        departure = _LEAST_DEPARTURE
        if excess(least) > 0.0:
            departure = math.exp(brentq(excess, least, most, xtol=1e-3))
    return weighted(departure)[0], departure


def profile_interval(
    spectrum: Ordinates, best: Optimum, column: int, confidence: float
) -> SquaredEstimate:
    """Square of one coefficient by profile likelihood.

    Parameters
    ----------
    spectrum
        What is fitted.
    best
        Its maximum.
    column
        Of the coefficient.
    confidence
        Of the interval or bound.
    """
    scale = 1.0 / np.sqrt(np.diag(best.fisher))
    covariance = scaled_covariance(best.fisher)
    error = math.sqrt(max(covariance[column, column], 1.0)) * scale[column]
    value = float(best.squares[column])
    # How the other squares move when this one does.
    direction = covariance[:, column] * scale / (covariance[column, column] * scale[column])

    def deviance(square: float) -> float:
        start = best.squares + direction * (square - value)
        start[column] = square
        return maximize(spectrum, start=start, held=column).deviance

    profile = Profile(
        deviance=deviance, lowest=best.deviance, value=value, error=error, confidence=confidence
    )
    absent = deviance(0.0)
    found = profile.estimated(absent)
    if found is not None:
        return found
    high = profile.bound(best.deviance if value > 0.0 else absent)
    if not high < typical_square(spectrum.basis[:, column], best.mean):
        return SquaredEstimate.unseen()
    return SquaredEstimate.bound(max(high, _missed(spectrum, column, error, confidence)))


def _missed(spectrum: Ordinates, column: int, error: float, confidence: float) -> float:
    """Largest square that is not called estimated with a probability of one less `confidence`.

    What is there and larger would have been estimated, so that bounds hold of those that are given
    as bounds. The spectrum that is expected with the square is fitted without it (Cowan et al.,
    Eur. Phys. J. C 71, 1554, 2011).
    """
    without = maximize(spectrum, held=column)
    wanted = detected(confidence)

    def short(square: float) -> float:
        mean = without.mean + square * spectrum.basis[:, column]
        expected = replace(spectrum, power=mean)
        fitted = maximize(expected, start=without.squares, held=column).deviance
        return math.sqrt(max(fitted - _deviance(expected, mean), 0.0)) - wanted

    found = crossing(short, 0.0, wanted * error)
    return found if math.isfinite(found) else 0.0


def scaled_covariance(fisher: FloatArray) -> FloatArray:
    """Inverse of the information of parameters each in units of its own error alone."""
    scale = 1.0 / np.sqrt(np.diag(fisher))
    return np.asarray(np.linalg.pinv(fisher * scale * scale[:, np.newaxis], rcond=1e-12))


def errors_of(fisher: FloatArray) -> FloatArray:
    """Standard deviations from the Fisher information of parameters."""
    scale = 1.0 / np.sqrt(np.diag(fisher))
    return np.asarray(np.sqrt(np.diag(scaled_covariance(fisher))) * scale)
