"""Q, N, B, K, R from a stability curve by Eq. 3, each with an interval and a status."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from typing import Final

import numpy as np
from scipy.linalg.lapack import dtrtrs

from sagnac.core.arrays import BooleanArray, FloatArray
from sagnac.core.errors import Note, RecordingError, require_confidence, rounded
from sagnac.noise import laws
from sagnac.noise.estimates import Estimate, Fit, FitName, rooted, unobserved
from sagnac.noise.laws import COEFFICIENT_NAMES, CoefficientName
from sagnac.noise.likelihood import PRESENCE, crossing, interval_ends, non_negative, typical_square
from sagnac.noise.readings import SHORT, Squares
from sagnac.stability.curve import StabilityCurve

# The terms a curve is fitted with, the first of them if it has too few points for all.
_FIRST_TERMS: Final = ("angle_random_walk", "quantization", *laws.SLOW_NAMES)
# Most rounds in which weights follow a solution.
_ROUNDS: Final = 20


@dataclass(frozen=True, slots=True, kw_only=True)
class CurveModel:
    """Eq. 3 with some of its terms, on the points of a curve.

    Attributes
    ----------
    names, basis
        Of the terms; (points, terms) their Allan variances with the coefficients at one.
    variance
        (points,) Allan variances, (rad/s)^2.
    pairs
        (terms^2, points^2) covariances of the points by pairs of terms with the coefficients at
        one, for errors alone: they take long.
    edf
        (points,) degrees of freedom; None if the points overlap and their covariance is known.
    reading
        Squares of the paper that a fit makes least; None for those in the metric of the points'
        covariance.
    departure
        Common relative departure of the points from the terms, which the errors allow for.
    """

    names: tuple[CoefficientName, ...]
    basis: FloatArray
    variance: FloatArray
    pairs: Callable[[], FloatArray]
    edf: FloatArray | None
    reading: Squares | None = None
    departure: float = 0.0

    @property
    def freedom(self) -> int:
        """Points less terms, one at least."""
        return max(1, self.variance.size - len(self.names))

    def covariance(self, squares: FloatArray) -> FloatArray:
        """Covariance of the points if `squares` were true, (points, points)."""
        products = np.outer(squares, squares).ravel() @ self.pairs()
        covariance, mean = products.reshape(self.variance.size, -1), self.basis @ squares
        if self.edf is not None:
            # Points that do not overlap have the same correlation and a spread of their own.
            known = np.maximum(np.diag(covariance), 1e-12 * mean**2)
            scale = mean * np.sqrt(2.0 / self.edf / known)
            covariance *= scale * scale[:, np.newaxis]
        # A few hundred-thousandths of each variance are its own, which leaves the matrix invertible
        # whatever rounding and the far lags of 1/f do.
        own = 3e-5 * np.diag(covariance) + (self.departure**2 + 1e-10) * mean**2
        np.fill_diagonal(covariance, covariance.diagonal() + own)
        return covariance

    def published(self) -> FloatArray:
        """Non-negative squares by the paper's least squares, plain ones on Eq. 3 as it stands."""
        if self.reading == "relative":
            return self.relative()
        return non_negative(self.basis, self.variance)

    def relative(self) -> FloatArray:
        """Non-negative squares by least squares relative to the fitted variance."""
        squares, scale = np.zeros(self.basis.shape[1]), self.variance
        for _ in range(_ROUNDS):
            before = squares
            squares = non_negative(self.basis / scale[:, np.newaxis], self.variance / scale)
            if _agree(squares, before, 1e-6):
                return before
            scale = self.basis @ squares
        return squares

    def generalized(self, start: FloatArray, held: int | None = None) -> FloatArray:
        """Non-negative squares by least squares in the metric of their own covariance.

        Parameters
        ----------
        start
            (terms,) squares to begin with.
        held
            Column of the term that keeps its value.
        """
        squares = start.copy()
        free = np.arange(squares.size) != held
        rest = self.variance - self.basis[:, ~free] @ squares[~free]
        columns = np.column_stack([self.basis[:, free], rest])
        if not squares.any():
            scaled = columns / self.variance[:, np.newaxis]
            squares[free] = non_negative(scaled[:, :-1], scaled[:, -1])
        for _ in range(_ROUNDS):
            if not squares.any():
                # Without noise there is no covariance to weigh with, and nothing to weigh.
                break
            whitened = _divided(positive_root(self.covariance(squares)), columns)
            before, squares[free] = squares[free], non_negative(whitened[:, :-1], whitened[:, -1])
            if _agree(squares[free], before, 1e-4):
                break
        return squares

    def unlimited(self, squares: FloatArray, column: int) -> tuple[float, float]:
        """One square free of the limit at zero, and its error, were `squares` the truth."""
        covariance = self.covariance(squares)
        # The paper's residuals are weighed like this whatever their errors.
        root = np.eye(self.variance.size)
        if self.reading is None:
            root = positive_root(covariance)
        elif self.reading == "relative":
            root = np.diag(self.basis @ squares)
        whitened = _divided(root, self.basis)
        scale = 1.0 / np.maximum(np.linalg.norm(whitened, axis=0), 1e-300)
        inverse = np.linalg.pinv(whitened * scale, rcond=1e-10)[column] * scale[column]
        row = _divided(root, inverse, transposed=True)
        return float(row @ self.variance), math.sqrt(float(row @ covariance @ row))

    def chi_square(self, squares: FloatArray) -> float:
        """Chi-square of the points."""
        missed = self.variance - self.basis @ squares
        residual = _divided(positive_root(self.covariance(squares)), missed)
        return float(residual @ residual)

    def estimate(
        self, weighed: FloatArray, column: int, value: float, confidence: float
    ) -> Estimate:
        """One coefficient, whose square came out as a value; `weighed` rule its error.

        The limits are where the estimate, with the weights and the error that hold if the
        limit is the truth, lies the wanted number of standard deviations from it.
        """
        name = self.names[column]
        two_sided, one_sided = interval_ends(confidence)
        unlimited, error = self.unlimited(weighed, column)

        # Both limits are looked for from one place.
        @cache
        def deviations(square: float) -> float:
            start = weighed.copy()
            start[column] = square
            squares = self.generalized(start, held=column)
            if not squares.any():
                return math.inf
            estimate, spread = self.unlimited(squares, column)
            return (estimate - square) / spread

        if unlimited > 0.0 and value > 0.0 and deviations(0.0) > max(PRESENCE**0.5, two_sided):
            reach = two_sided * error
            high = crossing(lambda square: -deviations(square) - two_sided, unlimited, reach)
            low = crossing(lambda square: deviations(square) - two_sided, unlimited, -reach, 0.0)
            if math.isfinite(high):
                return rooted(name, confidence, value, min(low, value), max(high, value))
        inside = max(unlimited, 0.0)

        def beyond(square: float) -> float:
            return min(-deviations(square), (square - inside) / error) - one_sided

        high = crossing(beyond, inside, one_sided * error)
        nothing = unobserved(name, confidence)
        if not high < typical_square(self.basis[:, column], self.basis @ weighed):
            return nothing
        return nothing.bounded(math.sqrt(high))


def positive_root(covariance: FloatArray) -> FloatArray:
    """Lower factor of a covariance that may be positive only to rounding.

    Neighbouring points of an overlapped curve are nearly copies of each other if one noise
    rules, so that the smallest eigenvalue of their correlation can come out below zero. A share
    of it, the least that makes it positive, is added to the diagonal.
    """
    tried, nugget = covariance, 0.0
    while True:
        try:
            return np.asarray(np.linalg.cholesky(tried))
        except np.linalg.LinAlgError:
            if not nugget < 1e-3:
                raise
            nugget = max(10.0 * nugget, 1e-13)
            tried = covariance + nugget * np.diag(np.diag(covariance))


def _divided(root: FloatArray, right: FloatArray, *, transposed: bool = False) -> FloatArray:
    """``inv(root) @ right`` of a lower factor, or of its transpose.

    `scipy.linalg.solve_triangular` would check its arguments for longer than it solves.
    """
    return np.asarray(dtrtrs(root, right, lower=True, trans=transposed)[0])


def _agree(one: FloatArray, other: FloatArray, share: float) -> bool:
    """Whether they differ by no more than a share of the other; faster than `numpy.allclose`."""
    return bool((np.abs(one - other) <= share * np.abs(other)).all())


# ---- the fits --------------------------------------------------------------------------


def paper_fit(
    curve: StabilityCurve, *, squares: Squares = "relative", confidence: float = 0.95
) -> Fit:
    """Fit Q, N, B, K, R to the Allan variance by the paper's least squares on Eq. 3.

    Points whose IEEE error ``1/sqrt(2 (N/n - 1))`` is above 10 % are left out. The paper
    does not say on what scale its squares are taken (`sagnac.noise.readings`). Relative
    ones tell of all five terms; on the plain scale the shortest tau decide nearly alone, which is
    best for N. Squared coefficients are kept from falling below zero. All points weigh alike,
    whatever is known of their errors; the intervals know it and carry the covariance of the points
    through.

    Parameters
    ----------
    curve
        Allan deviation, plain or overlapping, SI.
    squares
        As `Reading` has them.
    confidence
        Of every interval and bound.

    Returns
    -------
    Fit
        With all five names; what the statuses mean stands in `weighted_fit`.

    Raises
    ------
    RecordingError
        If fewer than two points are left.
    ValueError
        If the curve is of another estimator.
    """
    return _curve_fit("paper", *_model(curve, squares), confidence)


def paper_squares(curve: StabilityCurve, *, squares: Squares) -> float:
    """N by the squares of `paper_fit` alone, whatever their interval, rad/sqrt(s).

    Raises
    ------
    RecordingError
        If fewer than two points are left.
    ValueError
        If the curve is of another estimator.
    """
    model, _ = _model(curve, squares)
    return math.sqrt(float(model.published()[model.names.index("angle_random_walk")]))


def weighted_fit(curve: StabilityCurve, *, confidence: float = 0.95) -> Fit:
    """Fit Q, N, B, K, R to the overlapped Allan variance by generalized least squares.

    The weights are the full covariance between the points, from the fitted terms
    themselves (`sagnac.noise.laws.overlapped_allan_covariances`), repeated until they agree.
    Squared coefficients are kept from falling below zero.

    Intervals come from the same fit without that limit, for what one term loses at its
    limit another gains; if the value lies outside they are widened to hold it. They
    follow the variance of the estimate as it changes with the coefficient, so that they
    turn lopsided if few degrees of freedom stand behind it. ``estimated``: the estimate
    lies more than three standard deviations above zero, as they are without the term.
    ``upper bound``: the one-sided limit at `confidence`. ``not observable``: at that limit
    the term alone would lie above the fitted curve at half of its points or more.

    If the curve departs from Eq. 3 by more than chance, a common relative departure of
    the points is estimated and enters the weights and intervals.

    Parameters
    ----------
    curve
        Overlapping Allan deviation, SI.
    confidence
        Of every interval and bound.

    Returns
    -------
    Fit
        With all five names.

    Raises
    ------
    RecordingError
        If the curve has fewer than two points.
    ValueError
        If the curve is of another estimator.
    """
    return _curve_fit("weighted", *_model(curve, None), confidence)


def is_in_paper(curve: StabilityCurve) -> BooleanArray:
    """(points,) whether the paper shows and fits a point: its IEEE error is 10 % or less.

    The relative error of an Allan deviation of IEEE Std 952, 1/sqrt(2 (N/n - 1)) of N increments in
    clusters of n, counts independent differences and knows neither overlap nor noise type.
    """
    increments = curve.samples - (curve.kind == "angle")
    clusters = np.rint(curve.tau * curve.sample_rate)
    return np.asarray(1.0 / np.sqrt(2.0 * (increments / clusters - 1.0)) <= 0.1)


def _model(curve: StabilityCurve, squares: Squares | None) -> tuple[CurveModel, tuple[Note, ...]]:
    """Points that have a variance, and as many terms as there are points for.

    With `squares` of the paper's method, of a plain curve or an overlapping one, those points whose
    IEEE error is 10 % or less.
    """
    estimators = ("oadev",) if squares is None else ("oadev", "adev")
    if curve.estimator not in estimators:
        takes = f"this fit of Eq. 3 takes {' or '.join(estimators)}"
        raise ValueError(f"the curve is {curve.estimator}; {takes}")
    angles = curve.samples + (curve.kind != "angle")
    every = np.round(curve.tau * curve.sample_rate).astype(np.int64)
    interval = 1.0 / curve.sample_rate
    fitted = (curve.deviation > 0.0) & (curve.terms > 0)
    wanted = _FIRST_TERMS
    if squares is not None:
        fitted &= is_in_paper(curve)
    if squares == "two terms":
        fitted &= every * interval <= SHORT * (1.0 + 1e-9)
        wanted = _FIRST_TERMS[:2]
    factors = every[fitted]
    if factors.size < 2:
        problem = f"{factors.size} points of the curve can be fitted and Eq. 3 needs 2 or more"
        raise RecordingError(problem, remedy="record longer")
    names = tuple(name for name in COEFFICIENT_NAMES if name in wanted[: factors.size - 1])
    notes: tuple[Note, ...] = ()
    if len(names) < len(wanted):
        few = f"{factors.size} points of the curve are enough for {', '.join(names)} only"
        notes = (Note(text=few),)
    columns = np.array([COEFFICIENT_NAMES.index(name) for name in names])
    overlapped = curve.estimator == "oadev"

    @cache
    def pairs() -> FloatArray:
        # Of every point: the fits of a curve share them.
        clusters = tuple(every.tolist())
        of_all = laws.overlapped_allan_covariances(clusters, angles=angles, interval=interval)
        places = np.flatnonzero(fitted)
        covariances = of_all[np.ix_(columns, columns, places, places)]
        if overlapped:
            # Points that overlap less, of a record with gaps, have the same correlation.
            shortfall = np.sqrt((angles - 2 * factors) / curve.terms[fitted])
            covariances *= shortfall * shortfall[:, np.newaxis]
        return np.asarray(covariances.reshape(len(names) ** 2, -1))

    return CurveModel(
        names=names,
        basis=laws.allan_variance_basis(np.asarray(factors * interval))[:, columns],
        variance=curve.deviation[fitted] ** 2,
        pairs=pairs,
        edf=None if overlapped else curve.edf[fitted],
        reading=squares,
    ), notes


def _curve_fit(
    method: FitName, model: CurveModel, notes: tuple[Note, ...], confidence: float
) -> Fit:
    """Fit of Eq. 3 to points of a curve."""
    require_confidence(confidence)
    relative = model.relative()
    weighed = model.generalized(relative)
    # A departure of the points, if chance does not explain their misfit.
    by_chance = model.freedom + 6.0 * math.sqrt(2.0 * model.freedom) + 12.0
    if model.chi_square(weighed) > by_chance:
        model, weighed = _with_departure(model, relative)
        # No warning: the intervals allow for it, and any low-pass of a sensor makes one.
        apart = f"by {rounded(100.0 * model.departure)} % of the variance at a point"
        allowed = f"the {method} intervals allow for it"
        notes += (Note(text=f"the curve departs from the fitted terms {apart}; {allowed}"),)
    squares = weighed if model.reading is None else model.published()
    every = {name: unobserved(name, confidence) for name in COEFFICIENT_NAMES}
    for column, name in enumerate(model.names):
        every[name] = model.estimate(weighed, column, float(squares[column]), confidence)
    return Fit(method=method, coefficients=every, notes=notes)


def _with_departure(model: CurveModel, squares: FloatArray) -> tuple[CurveModel, FloatArray]:
    """`model` with the departure that explains its misfit, by bisection, and its squares."""
    low, high = math.log(1e-4), math.log(10.0)
    for _ in range(14):
        middle = 0.5 * (low + high)
        model = replace(model, departure=math.exp(middle))
        squares = model.generalized(squares)
        low, high = (low, middle) if model.chi_square(squares) <= model.freedom else (middle, high)
    return model, squares
