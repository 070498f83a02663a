"""Q, N, B, K, R from a stability curve by Eq. 3, each with an interval and a status."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular
from scipy.optimize import nnls
from scipy.special import ndtri

from sagnac.core.arrays import BooleanArray, FloatArray
from sagnac.core.errors import Note, RecordingError, require_confidence, rounded
from sagnac.noise.estimates import Fit, FitName, SquaredEstimate, unobserved
from sagnac.noise.laws import (
    COEFFICIENT_NAMES,
    CoefficientName,
    allan_variance_basis,
    overlapped_allan_covariance,
)
from sagnac.noise.likelihood import PRESENCE, crossing, typical_square
from sagnac.noise.readings import SHORT, Squares
from sagnac.stability.curve import StabilityCurve
from sagnac.stability.noise_type import ieee_relative_error

# The terms a curve is fitted with, the first of them if it has too few points for all.
_FIRST_TERMS: Final[tuple[CoefficientName, ...]] = (
    "angle_random_walk",
    "quantization",
    "bias_instability",
    "rate_random_walk",
    "rate_ramp",
)
_TERMS_OF_SHORT: Final = _FIRST_TERMS[:2]
POINT_ERROR: Final = 0.1
"""Relative error of a point above which the paper neither shows nor fits it."""

Metric = Literal["covariance", "relative", "plain"]
"""In which the squares of a fit are least: of the points' covariance, of their size, or none."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CurvePoints:
    """Points of a curve as a fit needs them.

    Attributes
    ----------
    factors
        (points,) cluster times in sample intervals.
    variance
        (points,) Allan variances, (rad/s)^2.
    shortfall
        (points,) root of how many times fewer terms a point has than the record would allow.
    edf
        (points,) degrees of freedom; None if the points overlap and their covariance is known.
    angles, interval
        Length of the record and its sample interval, s.
    """

    factors: NDArray[np.int64]
    variance: FloatArray
    shortfall: FloatArray
    edf: FloatArray | None
    angles: int
    interval: float

    @property
    def tau(self) -> FloatArray:
        """(points,) s."""
        return np.asarray(self.factors * self.interval)

    def keep(self, chosen: NDArray[np.bool_]) -> "CurvePoints":
        """Some of the points."""
        return replace(
            self,
            factors=self.factors[chosen],
            variance=self.variance[chosen],
            shortfall=self.shortfall[chosen],
            edf=None if self.edf is None else self.edf[chosen],
        )


def curve_points(curve: StabilityCurve, estimators: Sequence[str]) -> CurvePoints:
    """Points of a curve that have a variance.

    Raises
    ------
    ValueError
        If the curve is of none of these estimators.
    """
    if curve.estimator not in estimators:
        raise ValueError(
            f"the curve is {curve.estimator}; this fit of Eq. 3 takes {' or '.join(estimators)}"
        )
    angles = curve.samples if curve.kind == "angle" else curve.samples + 1
    factors = np.round(curve.tau * curve.sample_rate).astype(np.int64)
    overlapped = curve.estimator == "oadev"
    terms = angles - 2 * factors
    return CurvePoints(
        factors=factors,
        variance=curve.deviation**2,
        shortfall=np.sqrt(terms / curve.terms) if overlapped else np.ones(factors.size),
        edf=None if overlapped else curve.edf,
        angles=angles,
        interval=1.0 / curve.sample_rate,
    ).keep((curve.deviation > 0.0) & (curve.terms > 0))


@dataclass(frozen=True, slots=True, kw_only=True)
class CurveModel:
    """Eq. 3 with some of its terms, on the points of a curve.

    Attributes
    ----------
    points
        Of the curve.
    names, basis
        Of the terms; (points, terms) their Allan variances with the coefficients at one.
    departure
        Common relative departure of the points from the terms, which the errors allow for.
    """

    points: CurvePoints
    names: tuple[CoefficientName, ...]
    basis: FloatArray
    departure: float = 0.0

    def covariance(self, squares: FloatArray) -> FloatArray:
        """Covariance of the points if `squares` were true, (points, points)."""
        points = self.points
        sizes = dict(zip(self.names, np.sqrt(squares), strict=True))
        covariance = overlapped_allan_covariance(
            points.factors.tolist(),
            {name: sizes.get(name, 0.0) for name in COEFFICIENT_NAMES},
            angles=points.angles,
            interval=points.interval,
        )
        # Points that overlap less, or not at all, have the same correlation and a spread of
        # their own.
        mean = self.basis @ squares
        scale = points.shortfall
        if points.edf is not None:
            known = np.maximum(np.diag(covariance), 1e-12 * mean**2)
            scale = mean * np.sqrt(2.0 / points.edf / known)
        covariance = covariance * scale * scale[:, np.newaxis]
        # A few hundred-thousandths of each variance are its own, which leaves the matrix invertible
        # whatever rounding and the far lags of 1/f do.
        own = 3e-5 * np.diag(covariance) + (self.departure**2 + 1e-10) * mean**2
        return np.asarray(covariance + np.diag(own))

    def relative(self) -> FloatArray:
        """Non-negative squares by least squares relative to the fitted variance."""
        squares = np.zeros(self.basis.shape[1])
        scale = self.points.variance
        for _ in range(20):
            solution = non_negative_squares(
                self.basis / scale[:, np.newaxis], self.points.variance / scale
            )
            if np.allclose(solution, squares, rtol=1e-6, atol=0.0):
                break
            squares = solution
            scale = self.basis @ squares
        return squares

    def plain(self) -> FloatArray:
        """Non-negative squares by plain least squares on the variance, Eq. 3 as it stands."""
        return non_negative_squares(self.basis, self.points.variance)

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
        rest = self.points.variance - self.basis[:, ~free] @ squares[~free]
        if not squares.any():
            scale = self.points.variance
            squares[free] = non_negative_squares(
                self.basis[:, free] / scale[:, np.newaxis], rest / scale
            )
        if not squares.any():
            # Without noise there is no covariance to weigh with, and nothing to weigh.
            return squares
        columns = np.column_stack([self.basis[:, free], rest])
        for _ in range(20):
            root = positive_root(self.covariance(squares))
            whitened = solve_triangular(root, columns, lower=True, check_finite=False)
            solution = non_negative_squares(whitened[:, :-1], whitened[:, -1])
            agreed = np.allclose(solution, squares[free], rtol=1e-4, atol=0.0)
            squares[free] = solution
            if agreed or not squares.any():
                break
        return squares

    def unlimited(self, metric: Metric, squares: FloatArray, column: int) -> tuple[float, float]:
        """One square free of the limit at zero, and its error, were `squares` the truth."""
        covariance = self.covariance(squares)
        if metric == "covariance":
            root = positive_root(covariance)
        else:
            # The residuals are weighed like this whatever their errors.
            size = self.points.factors.size
            root = np.diag(self.basis @ squares) if metric == "relative" else np.eye(size)
        whitened = solve_triangular(root, self.basis, lower=True)
        scale = 1.0 / np.maximum(np.linalg.norm(whitened, axis=0), 1e-300)
        inverse = np.linalg.pinv(whitened * scale, rcond=1e-10)[column] * scale[column]
        row = solve_triangular(root, inverse, lower=True, trans="T")
        return float(row @ self.points.variance), math.sqrt(float(row @ covariance @ row))

    def residual(self, squares: FloatArray) -> tuple[float, float]:
        """Chi-square of the points, and the log determinant of their covariance."""
        root = positive_root(self.covariance(squares))
        residual = solve_triangular(root, self.points.variance - self.basis @ squares, lower=True)
        return float(np.dot(residual, residual)), 2.0 * float(np.log(np.diag(root)).sum())

    def misfit(self, squares: FloatArray) -> float:
        """Chi-square of the points over its expectation, less one."""
        freedom = max(1, self.points.factors.size - len(self.names))
        return self.residual(squares)[0] / freedom - 1.0


def non_negative_squares(matrix: FloatArray, vector: FloatArray) -> FloatArray:
    """Solution of ``matrix @ squares = vector`` by least squares, none of it below zero."""
    if matrix.shape[1] == 0:
        # scipy 1.17 frees memory twice, and the process with it, on a matrix without columns.
        return np.empty(0)
    scale = 1.0 / np.linalg.norm(matrix, axis=0)
    return np.asarray(nnls(matrix * scale, vector)[0] * scale)


def positive_root(covariance: FloatArray) -> FloatArray:
    """Lower factor of a covariance that may be positive only to rounding.

    Neighbouring points of an overlapped curve are nearly copies of each other if one noise
    rules, so that the smallest eigenvalue of their correlation can come out below zero. A share
    of it, the least that makes it positive, is added to the diagonal.
    """
    scale = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(scale, scale)
    nugget = 0.0
    while True:
        try:
            root = np.linalg.cholesky(correlation + nugget * np.eye(scale.size))
        except np.linalg.LinAlgError:
            if not nugget < 1e-3:
                raise
            nugget = max(10.0 * nugget, 1e-13)
            continue
        return np.asarray(root * scale[:, np.newaxis])


# ---- the fits --------------------------------------------------------------------------


def paper_fit(
    curve: StabilityCurve,
    *,
    squares: Squares = "relative",
    confidence: float = 0.95,
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
    points, terms, metric = _as_read(curve, squares)
    return _curve_fit("paper", points, confidence, terms=terms, metric=metric)


def paper_squares(curve: StabilityCurve, *, squares: Squares) -> float:
    """N by the squares of `paper_fit` alone, whatever their interval, rad/sqrt(s).

    Raises
    ------
    RecordingError
        If fewer than two points are left.
    ValueError
        If the curve is of another estimator.
    """
    points, terms, metric = _as_read(curve, squares)
    model, _ = _first_model(points, terms)
    solution = model.plain() if metric == "plain" else model.relative()
    return math.sqrt(float(solution[model.names.index("angle_random_walk")]))


def _as_read(
    curve: StabilityCurve, squares: Squares
) -> tuple[CurvePoints, tuple[CoefficientName, ...], Metric]:
    """Points, terms and metric of a reading of Step 4."""
    points = curve_points(curve, ("oadev", "adev"))
    kept = within_cut(points)
    if squares == "two terms":
        kept &= points.tau <= SHORT * (1.0 + 1e-9)
        return points.keep(kept), _TERMS_OF_SHORT, "plain"
    return points.keep(kept), _FIRST_TERMS, "relative" if squares == "relative" else "plain"


def within_cut(points: CurvePoints) -> BooleanArray:
    """(points,) whether the paper shows and fits a point: its IEEE error is 10 % or less."""
    within = [
        ieee_relative_error(points.angles - 1, int(factor)) <= POINT_ERROR
        for factor in points.factors
    ]
    return np.array(within, dtype=np.bool_)


def weighted_fit(curve: StabilityCurve, *, confidence: float = 0.95) -> Fit:
    """Fit Q, N, B, K, R to the overlapped Allan variance by generalized least squares.

    The weights are the full covariance between the points, from the fitted terms
    themselves (`sagnac.noise.laws.overlapped_allan_covariance`), repeated until they agree.
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
    return _curve_fit("weighted", curve_points(curve, ("oadev",)), confidence, metric="covariance")


def _curve_fit(
    method: FitName,
    points: CurvePoints,
    confidence: float,
    *,
    metric: Metric,
    terms: tuple[CoefficientName, ...] = _FIRST_TERMS,
) -> Fit:
    """Fit of Eq. 3 to points of a curve, with squares in a metric."""
    require_confidence(confidence)
    model, notes = _first_model(points, terms)
    weighed = _weighed(model, metric)
    squares = weighed.own
    if weighed.model.departure > 0.0:
        notes += (_departure_note(method, weighed.model.departure),)
    estimates = {
        name: _curve_interval(
            weighed,
            metric,
            column=column,
            value=float(squares[column]),
            confidence=confidence,
        ).root(name, confidence)
        for column, name in enumerate(weighed.model.names)
    }
    return Fit(
        method=method,
        coefficients={
            name: estimates.get(name) or unobserved(name, confidence) for name in COEFFICIENT_NAMES
        },
        notes=notes,
    )


def _first_model(
    points: CurvePoints, terms: tuple[CoefficientName, ...]
) -> tuple[CurveModel, tuple[Note, ...]]:
    """As many of the terms as there are points for."""
    size = points.factors.size
    if size < 2:
        raise RecordingError(
            f"{size} points of the curve can be fitted and Eq. 3 needs 2 or more",
            remedy="record longer",
        )
    chosen = terms[: max(1, size - 1)]
    names = tuple(name for name in COEFFICIENT_NAMES if name in chosen)
    notes: tuple[Note, ...] = ()
    if len(names) < len(terms):
        few = f"{size} points of the curve are enough for {', '.join(names)} only"
        notes = (Note(text=few),)
    basis = allan_variance_basis(points.tau)[
        :, [column for column, name in enumerate(COEFFICIENT_NAMES) if name in names]
    ]
    return CurveModel(points=points, names=names, basis=basis), notes


@dataclass(frozen=True, slots=True, kw_only=True)
class _Weighed:
    """A model that allows for its departure from the curve, and its squared coefficients.

    `own` (terms,) are those of the fit, `squares` those in the metric of the covariance, of which
    its errors are.
    """

    model: CurveModel
    own: FloatArray
    squares: FloatArray


def _weighed(model: CurveModel, metric: Metric) -> _Weighed:
    """Both solutions, with a departure of the points if chance does not explain their misfit."""
    relative = model.relative()
    squares = model.generalized(relative)
    freedom = max(1, model.points.factors.size - len(model.names))
    if model.misfit(squares) * freedom > 6.0 * math.sqrt(2.0 * freedom) + 12.0:
        model, squares = _with_curve_departure(model, relative)
    own = {"covariance": squares, "relative": relative, "plain": model.plain()}[metric]
    return _Weighed(model=model, own=own, squares=squares)


def _with_curve_departure(model: CurveModel, squares: FloatArray) -> tuple[CurveModel, FloatArray]:
    """`model` with the departure that explains its misfit, by bisection, and its squares."""
    low, high = math.log(1e-4), math.log(10.0)
    for _ in range(14):
        model = replace(model, departure=math.exp(0.5 * (low + high)))
        squares = model.generalized(squares)
        if model.misfit(squares) > 0.0:
            low = math.log(model.departure)
        else:
            high = math.log(model.departure)
    return model, squares


def _departure_note(method: FitName, departure: float) -> Note:
    # No warning: the intervals allow for it, and any low-pass of a sensor makes one.
    return Note(
        text=f"the curve departs from the fitted terms by {rounded(100.0 * departure)} % of the "
        f"variance at a point; the {method} intervals allow for it",
    )


def _curve_interval(
    weighed: _Weighed, metric: Metric, *, column: int, value: float, confidence: float
) -> SquaredEstimate:
    """Square of one coefficient.

    The limits are where the estimate, with the weights and the error that hold if the
    limit is the truth, lies the wanted number of standard deviations from it.
    """
    model, reference = weighed.model, weighed.squares
    two_sided = float(ndtri(0.5 + 0.5 * confidence))
    one_sided = float(ndtri(max(confidence, 0.5)))
    unlimited, error = model.unlimited(metric, reference, column)

    # Both limits are looked for from one place.
    @cache
    def deviations(square: float) -> float:
        start = reference.copy()
        start[column] = square
        squares = model.generalized(start, held=column)
        if not squares.any():
            return math.inf
        estimate, spread = model.unlimited(metric, squares, column)
        return (estimate - square) / spread

    if unlimited > 0.0 and value > 0.0 and deviations(0.0) > max(math.sqrt(PRESENCE), two_sided):
        high = crossing(
            lambda square: -deviations(square) - two_sided, unlimited, two_sided * error
        )
        low = crossing(
            lambda square: deviations(square) - two_sided, unlimited, -two_sided * error, 0.0
        )
        if math.isfinite(high):
            return SquaredEstimate(
                value=value, low=min(low, value), high=max(high, value), status="estimated"
            )
    inside = max(unlimited, 0.0)
    high = crossing(
        lambda square: min(-deviations(square), (square - inside) / error) - one_sided,
        inside,
        one_sided * error,
    )
    if not high < typical_square(model.basis[:, column], model.basis @ reference):
        return SquaredEstimate.unseen()
    return SquaredEstimate.bound(high)
