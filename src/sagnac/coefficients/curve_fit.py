"""Q, N, B, K, R from a stability curve, each with an interval and a status."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final, cast

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular
from scipy.optimize import minimize_scalar, nnls
from scipy.stats import norm

from sagnac.arrays import FloatArray
from sagnac.coefficients.estimates import (
    PRESENCE,
    UNSEEN,
    Estimate,
    Fit,
    FitName,
    OptionalName,
    Status,
    crossing,
    per_gyro_estimate,
    require_confidence,
    typical_square,
)
from sagnac.coefficients.laws import (
    COEFFICIENT_NAMES,
    CoefficientName,
    allan_variance_basis,
    markov_allan_variance,
    overlapped_allan_covariance,
    sinusoid_allan_variance,
)
from sagnac.errors import RecordingError
from sagnac.recording.difference import per_gyro
from sagnac.stability.curve import StabilityCurve
from sagnac.stability.degrees_of_freedom import ieee_relative_error


def paper_fit(
    curve: StabilityCurve, *, gyros_differenced: int = 1, confidence: float = 0.95
) -> Fit:
    """Fit Q, N, B, K, R to the Allan variance by the paper's least squares on Eq. 3.

    Points whose IEEE error ``1/sqrt(2 (N/n - 1))`` is above 10 % are left out. The paper
    does not say on what scale its squares are taken; here each residual is relative to the
    fitted variance, for on the plain scale the shortest tau would decide alone. Squared
    coefficients are kept from falling below zero. All points weigh alike, whatever is known
    of their errors; the intervals know it and carry the covariance of the points through.

    Parameters
    ----------
    curve
        Allan deviation, plain or overlapping, SI.
    gyros_differenced
        1, or 2 where the curve is of a difference of two gyros.
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
    points = _curve_points(curve, ("oadev", "adev"))
    within = [
        ieee_relative_error(points.angles - 1, int(factor)) <= 0.1 for factor in points.factors
    ]
    return _curve_fit(
        "paper", points.keep(np.array(within, dtype=np.bool_)), gyros_differenced, confidence
    )


def weighted_fit(
    curve: StabilityCurve,
    *,
    gyros_differenced: int = 1,
    confidence: float = 0.95,
    markov: bool = False,
    sinusoid: float | None = None,
) -> Fit:
    """Fit Q, N, B, K, R to the overlapped Allan variance by generalized least squares.

    The weights are the full covariance between the points, from the fitted terms
    themselves (`sagnac.noise.overlapped_allan_covariance`), repeated until they agree.
    Squared coefficients are kept from falling below zero.

    Intervals come from the same fit without that limit, for what one term loses at its
    limit another gains; where the value lies outside they are widened to hold it. They
    follow the variance of the estimate as it changes with the coefficient, so that they
    turn lopsided where few degrees of freedom stand behind it. ``estimated``: the estimate
    lies more than three standard deviations above zero, as they are without the term.
    ``upper bound``: the one-sided limit at `confidence`. ``not observable``: at that limit
    the term alone would lie above the fitted curve at half of its points or more.

    Where the curve departs from Eq. 3 by more than chance, a common relative departure of
    the points is estimated and enters the weights and intervals.

    Parameters
    ----------
    curve
        Overlapping Allan deviation, SI.
    gyros_differenced
        1, or 2 where the curve is of a difference of two gyros.
    confidence
        Of every interval and bound.
    markov
        Fit a first-order Markov rate besides. Its time is the most likely one of the
        curve; what is unknown of it is in the errors of all.
    sinusoid
        Frequency in Hz of a sinusoidal rate to fit besides: of Eq. 3's kind, but its
        beating with the noise is not in the covariance. Of a difference of two the
        amplitude is the root mean square of the gyros'.

    Returns
    -------
    Fit
        With all five names, and the optional terms asked for.

    Raises
    ------
    RecordingError
        If the curve has fewer than two points.
    ValueError
        If the curve is of another estimator, or `sinusoid` is not above zero.
    """
    points = _curve_points(curve, ("oadev",))
    if sinusoid is not None and not sinusoid > 0.0:
        raise ValueError(f"sinusoid is {sinusoid}; give its frequency in Hz, above zero")
    return _curve_fit(
        "weighted", points, gyros_differenced, confidence, markov=markov, sinusoid=sinusoid
    )


def _cholesky(covariance: FloatArray) -> FloatArray:
    """Lower factor of a covariance that may be positive only to rounding.

    Neighbouring points of an overlapped curve are nearly copies of each other where one noise
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


@dataclass(frozen=True, slots=True, kw_only=True)
class _CurvePoints:
    """What a fit needs of a curve: arrays (points,), and the record they are of.

    `shortfall` is the root of how many times fewer terms a point has than the record
    would allow; `edf` is None where the points overlap and their covariance is known.
    """

    factors: NDArray[np.int64]
    variance: FloatArray
    shortfall: FloatArray
    edf: FloatArray | None
    angles: int
    interval: float

    @property
    def tau(self) -> FloatArray:
        return np.asarray(self.factors * self.interval)

    def keep(self, chosen: NDArray[np.bool_]) -> "_CurvePoints":
        return replace(
            self,
            factors=self.factors[chosen],
            variance=self.variance[chosen],
            shortfall=self.shortfall[chosen],
            edf=None if self.edf is None else self.edf[chosen],
        )


def _curve_points(curve: StabilityCurve, estimators: Sequence[str]) -> _CurvePoints:
    if curve.estimator not in estimators:
        raise ValueError(
            f"the curve is {curve.estimator}; this fit of Eq. 3 takes {' or '.join(estimators)}"
        )
    angles = curve.samples if curve.kind == "angle" else curve.samples + 1
    factors = np.round(curve.tau * curve.sample_rate).astype(np.int64)
    overlapped = curve.estimator == "oadev"
    terms = angles - 2 * factors
    return _CurvePoints(
        factors=factors,
        variance=curve.deviation**2,
        shortfall=np.sqrt(terms / curve.terms) if overlapped else np.ones(factors.size),
        edf=None if overlapped else curve.edf,
        angles=angles,
        interval=1.0 / curve.sample_rate,
    ).keep((curve.deviation > 0.0) & (curve.terms > 0))


# In which order terms are given up where a curve has too few points for all.
_FIRST_TERMS: Final[tuple[CoefficientName, ...]] = (
    "angle_random_walk",
    "quantization",
    "bias_instability",
    "rate_random_walk",
    "rate_ramp",
)


@dataclass(frozen=True, slots=True, kw_only=True)
class _CurveModel:
    """Eq. 3 with some of its terms, on the points of a curve.

    `nuisance` (points,) is a direction, of either sign, that the errors allow for: how the
    curve changes with the logarithm of a Markov rate's time.
    """

    points: _CurvePoints
    names: tuple[CoefficientName | OptionalName, ...]
    basis: FloatArray
    departure: float = 0.0
    correlation_time: float = 0.0
    nuisance: FloatArray | None = None

    def covariance(self, squares: FloatArray) -> FloatArray:
        """Covariance of the points if `squares` were true, (points, points)."""
        points = self.points
        sizes = dict(zip(self.names, np.sqrt(squares), strict=True))
        covariance = overlapped_allan_covariance(
            points.factors.tolist(),
            {name: sizes.get(name, 0.0) for name in COEFFICIENT_NAMES},
            angles=points.angles,
            interval=points.interval,
            markov=(sizes.get("markov_driving_noise", 0.0), self.correlation_time),
        )
        mean = self.basis @ squares
        scale = points.shortfall
        if points.edf is not None:
            # Plain clusters share less: the correlation is kept, the spread is theirs.
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
            solution = _scaled_nnls(self.basis / scale[:, np.newaxis], self.points.variance / scale)
            if np.allclose(solution, squares, rtol=1e-6, atol=0.0):
                break
            squares = solution
            scale = self.basis @ squares
        return squares

    def generalized(self, start: FloatArray, held: int | None = None) -> FloatArray:
        """Non-negative squares by least squares in the metric of their own covariance.

        From `start`, of which the term `held` keeps its value.
        """
        squares = start.copy()
        free = np.arange(squares.size) != held
        rest = self.points.variance - self.basis[:, ~free] @ squares[~free]
        if not squares.any():
            scale = self.points.variance
            squares[free] = _scaled_nnls(self.basis[:, free] / scale[:, np.newaxis], rest / scale)
        if not squares.any():
            # Without noise there is no covariance to weigh with, and nothing to weigh.
            return squares
        for _ in range(20):
            root = _cholesky(self.covariance(squares))
            solution = _scaled_nnls(
                solve_triangular(root, self.basis[:, free], lower=True),
                solve_triangular(root, rest, lower=True),
            )
            agreed = np.allclose(solution, squares[free], rtol=1e-4, atol=0.0)
            squares[free] = solution
            if agreed or not squares.any():
                break
        return squares

    def unlimited(self, method: FitName, squares: FloatArray, column: int) -> tuple[float, float]:
        """One square free of the limit at zero, and its error, were `squares` the truth."""
        covariance = self.covariance(squares)
        # The paper's residuals are relative, whatever their errors.
        metric = np.diag((self.basis @ squares) ** 2) if method == "paper" else covariance
        root = _cholesky(metric)
        basis = self.basis
        if self.nuisance is not None:
            basis = np.column_stack([basis, self.nuisance])
        whitened = solve_triangular(root, basis, lower=True)
        scale = 1.0 / np.maximum(np.linalg.norm(whitened, axis=0), 1e-300)
        inverse = np.linalg.pinv(whitened * scale, rcond=1e-10)[column] * scale[column]
        row = solve_triangular(root, inverse, lower=True, trans="T")
        return float(row @ self.points.variance), math.sqrt(float(row @ covariance @ row))

    def with_markov(self, time: float) -> "_CurveModel":
        """The same model with a Markov rate of that correlation time for one more term."""
        return replace(
            self,
            names=(*self.names, "markov_driving_noise"),
            basis=np.column_stack([self.basis, markov_allan_variance(self.points.tau, 1.0, time)]),
            correlation_time=time,
        )

    def residual(self, squares: FloatArray) -> tuple[float, float]:
        """Chi-square of the points, and the log determinant of their covariance."""
        root = _cholesky(self.covariance(squares))
        residual = solve_triangular(root, self.points.variance - self.basis @ squares, lower=True)
        return float(np.dot(residual, residual)), 2.0 * float(np.log(np.diag(root)).sum())

    def misfit(self, squares: FloatArray) -> float:
        """Chi-square of the points over its expectation, less one."""
        freedom = max(1, self.points.factors.size - len(self.names))
        return self.residual(squares)[0] / freedom - 1.0


def _scaled_nnls(matrix: FloatArray, vector: FloatArray) -> FloatArray:
    if matrix.shape[1] == 0:
        # scipy 1.17 frees memory twice, and the process with it, on a matrix without columns.
        return np.empty(0)
    scale = 1.0 / np.linalg.norm(matrix, axis=0)
    return np.asarray(nnls(matrix * scale, vector)[0] * scale)


def _curve_fit(
    method: FitName,
    points: _CurvePoints,
    gyros_differenced: int,
    confidence: float,
    *,
    markov: bool = False,
    sinusoid: float | None = None,
) -> Fit:
    require_confidence(confidence)
    per_gyro(1.0, gyros_differenced)
    size = points.factors.size
    if size < 2:
        raise RecordingError(
            f"{size} points of the curve can be fitted and Eq. 3 needs 2 or more; record longer"
        )
    notes = []
    names: tuple[CoefficientName | OptionalName, ...] = tuple(
        name for name in COEFFICIENT_NAMES if name in _FIRST_TERMS[: max(1, min(5, size - 1))]
    )
    if len(names) < len(COEFFICIENT_NAMES):
        notes.append(f"{size} points of the curve are enough for {', '.join(names)} only")
    basis = allan_variance_basis(points.tau)[
        :, [column for column, name in enumerate(COEFFICIENT_NAMES) if name in names]
    ]
    if sinusoid is not None:
        names = (*names, "sinusoid_amplitude")
        basis = np.column_stack([basis, sinusoid_allan_variance(points.tau, 1.0, sinusoid)])
    model = _CurveModel(points=points, names=names, basis=basis)
    optional: dict[OptionalName, Estimate] = {}
    if markov:
        model = _with_curve_markov(model)
    squares = model.relative()
    reference = model.generalized(squares)
    freedom = max(1, size - len(model.names))
    if model.misfit(reference) * freedom > 6.0 * math.sqrt(2.0 * freedom) + 12.0:
        model, reference = _with_curve_departure(model, squares)
        notes.append(
            f"the curve departs from the fitted terms by {100.0 * model.departure:.2g} % of the "
            f"variance at a point; the {method} intervals allow for it"
        )
    if method == "weighted":
        squares = reference
    unseen = per_gyro_estimate(UNSEEN, gyros_differenced, confidence)
    estimates = dict.fromkeys(COEFFICIENT_NAMES, unseen)
    for column, name in enumerate(model.names):
        estimate = per_gyro_estimate(
            _curve_interval(
                model,
                method,
                column=column,
                value=float(squares[column]),
                reference=reference,
                confidence=confidence,
            ),
            gyros_differenced,
            confidence,
        )
        if name in estimates:
            estimates[name] = estimate
        else:
            optional[cast(OptionalName, name)] = estimate
    if markov:
        seen = optional["markov_driving_noise"].status == "estimated"
        optional["markov_correlation_time"] = (
            _curve_markov_time(model, reference, confidence) if seen else unseen
        )
    return Fit(method=method, coefficients=estimates, notes=tuple(notes), optional=optional)


def _with_curve_markov(model: _CurveModel) -> _CurveModel:
    """`model` with a Markov rate of the most likely correlation time besides."""
    tau = model.points.tau

    def deviance(logarithm: float) -> float:
        trial = model.with_markov(math.exp(logarithm))
        return sum(trial.residual(trial.generalized(trial.relative())))

    grid = np.log(np.geomspace(tau[0], tau[-1], 17))
    at = int(np.argmin([deviance(float(logarithm)) for logarithm in grid]))
    refined = minimize_scalar(
        deviance,
        bounds=(grid[max(at - 1, 0)], grid[min(at + 1, grid.size - 1)]),
        method="bounded",
        options={"xatol": 0.01},
    )
    time = math.exp(float(refined.x))
    model = model.with_markov(time)
    square = model.generalized(model.relative())[-1]
    change = markov_allan_variance(tau, 1.0, 1.01 * time) - markov_allan_variance(
        tau, 1.0, time / 1.01
    )
    return replace(model, nuisance=square * change / (2.0 * math.log(1.01)))


def _curve_markov_time(model: _CurveModel, reference: FloatArray, confidence: float) -> Estimate:
    _, error = model.unlimited("weighted", reference, reference.size)
    spread = math.exp(error * float(norm.ppf(0.5 + 0.5 * confidence)))
    return Estimate(
        value=model.correlation_time,
        low=model.correlation_time / spread,
        high=model.correlation_time * spread,
        confidence=confidence,
        status="estimated",
    )


def _with_curve_departure(
    model: _CurveModel, reference: FloatArray
) -> tuple[_CurveModel, FloatArray]:
    low, high = math.log(1e-4), math.log(10.0)
    for _ in range(14):
        model = replace(model, departure=math.exp(0.5 * (low + high)))
        reference = model.generalized(reference)
        if model.misfit(reference) > 0.0:
            low = math.log(model.departure)
        else:
            high = math.log(model.departure)
    return model, reference


def _curve_interval(
    model: _CurveModel,
    method: FitName,
    *,
    column: int,
    value: float,
    reference: FloatArray,
    confidence: float,
) -> tuple[float, float, float, Status]:
    """Square of one coefficient: value, low, high and status.

    The limits are where the estimate, with the weights and the error that hold if the
    limit is the truth, lies the wanted number of standard deviations from it.
    """
    two_sided = float(norm.ppf(0.5 + 0.5 * confidence))
    one_sided = float(norm.ppf(max(confidence, 0.5)))
    unlimited, error = model.unlimited(method, reference, column)

    def deviations(square: float) -> float:
        start = reference.copy()
        start[column] = square
        squares = model.generalized(start, held=column)
        if not squares.any():
            return math.inf
        estimate, spread = model.unlimited(method, squares, column)
        return (estimate - square) / spread

    if unlimited > 0.0 and value > 0.0:
        absent = deviations(0.0)
        if absent > max(math.sqrt(PRESENCE), two_sided):
            high = crossing(
                lambda square: -deviations(square) - two_sided, unlimited, two_sided * error
            )
            low = crossing(
                lambda square: deviations(square) - two_sided, unlimited, -two_sided * error, 0.0
            )
            if math.isfinite(high):
                return value, min(low, value), max(high, value), "estimated"
    inside = max(unlimited, 0.0)
    high = crossing(
        lambda square: min(-deviations(square), (square - inside) / error) - one_sided,
        inside,
        one_sided * error,
    )
    if not high < typical_square(model.basis[:, column], model.basis @ reference):
        return UNSEEN
    return high, 0.0, high, "upper bound"
