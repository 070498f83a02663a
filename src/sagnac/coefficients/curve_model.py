"""Eq. 3 on the points of a stability curve, with the covariance of the points."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular
from scipy.optimize import nnls

from sagnac.arrays import FloatArray
from sagnac.coefficients.laws import (
    COEFFICIENT_NAMES,
    CoefficientName,
    overlapped_allan_covariance,
)
from sagnac.stability.curve import StabilityCurve

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
