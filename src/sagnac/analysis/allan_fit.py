"""Step 4 of the paper: N by least squares on the Allan variance, whatever is known of its error."""

import math
from typing import Final

import numpy as np

from sagnac.coefficients.curve_model import CurveModel, curve_points
from sagnac.coefficients.estimates import Estimate
from sagnac.coefficients.laws import COEFFICIENT_NAMES, allan_variance_basis
from sagnac.recording.difference import per_gyro
from sagnac.stability.curve import StabilityCurve
from sagnac.stability.degrees_of_freedom import ieee_relative_error

_POINT_ERROR: Final = 0.1  # the cut that the paper states
_COLUMN: Final = COEFFICIENT_NAMES.index("angle_random_walk")


def step_4(curve: StabilityCurve, fitted: Estimate, gyros_differenced: int) -> Estimate:
    """What the paper's fit answers: a value wherever five terms can be fitted.

    `fitted` is the same fit with our interval. Where that calls N a bound or not observable, the
    value of the squares is the answer all the same, since the method itself has no such doubt;
    its interval then runs from 0 to what the curve's lowest point allows.

    Parameters
    ----------
    curve
        Allan deviation at the interval asked for.
    fitted
        N by `sagnac.coefficients.curve_fit.paper_fit`.
    gyros_differenced
        1, or 2 if the curve is of a difference.
    """
    points = curve_points(curve, ("oadev", "adev"))
    kept = [
        ieee_relative_error(points.angles - 1, int(factor)) <= _POINT_ERROR
        for factor in points.factors
    ]
    points = points.keep(np.array(kept, dtype=np.bool_))
    if fitted.status == "estimated" or points.factors.size <= len(COEFFICIENT_NAMES):
        return fitted
    basis = allan_variance_basis(points.tau)
    model = CurveModel(points=points, names=COEFFICIENT_NAMES, basis=basis)
    square = float(model.relative()[_COLUMN])
    if not square > 0.0:
        return fitted
    lowest = float(np.min(points.variance * points.tau))
    value = per_gyro(square, gyros_differenced)
    high = max(value, per_gyro(lowest, gyros_differenced))
    if math.isfinite(fitted.high):
        high = max(high, fitted.high)
    return Estimate(
        value=value,
        low=0.0,
        high=high,
        confidence=fitted.confidence,
        status="estimated",
        name="angle_random_walk",
    )
