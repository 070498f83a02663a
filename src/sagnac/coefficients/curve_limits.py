"""Limits that the Allan curve sets on Q, N, B, K and R, and slow noise in it that no term has.

Every noise adds to the Allan variance, so that no term can make more than the curve shows at any
cluster time. A fit of a spectrum that its terms do not describe may ask for more.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from scipy.special import gammaincinv

from sagnac.arrays import BooleanArray, FloatArray
from sagnac.coefficients.estimates import Estimate, require_confidence
from sagnac.coefficients.laws import (
    COEFFICIENT_NAMES,
    SLOW_NAMES,
    CoefficientName,
    allan_variance_basis,
)
from sagnac.recording.readout import JointReadout
from sagnac.stability.curve import StabilityCurve
from sagnac.stability.noise_type import equivalent_degrees_of_freedom

# Power of frequency of the rate noise of what is limited; a ramp, which does not fluctuate, has no
# fewer degrees of freedom than the steepest noise.
_NOISE_TYPES: Final[Mapping[CoefficientName, int]] = {
    "quantization": 2,
    "bias_instability": -1,
    "rate_random_walk": -2,
    "rate_ramp": -2,
}
# Chance at which chance alone is called slow noise, and times the terms that it has to be.
_CHANCE: Final = 0.01
_ABOVE: Final = 1.2
# Fewest degrees of freedom of a point that shows a rise.
_LEAST: Final = 2.0


@dataclass(frozen=True, slots=True, kw_only=True)
class CurveBound:
    """Largest N that a curve allows, rad/sqrt(s), and the cluster time of it, s."""

    value: float
    tau: float


def highest_walk(
    curve: StabilityCurve, readout: JointReadout, *, chance: float, used: BooleanArray
) -> CurveBound | None:
    """Largest N that a curve allows.

    Every other term only adds to N^2 / tau, so N lies below the curve at every point. If nothing
    dithers the readout within a cluster, its steps hide up to two steps of each second difference:
    the deviation is raised by the root of their mean square. If something does, a mean of few may
    still come out as zero: the deviation is raised by half a step in square.

    Parameters
    ----------
    curve
        Allan deviation.
    readout
        Of what the curve is of.
    chance
        That N lies above, shared by the points (Bonferroni).
    used
        (points,) those that no low-pass of the sensor lowers.

    Returns
    -------
    CurveBound or None
        None if no point is used.
    """
    if not used.any():
        return None
    step = readout.step / (np.sqrt(2.0) * curve.tau)
    raised = np.where(
        curve.tau < readout.time,
        curve.deviation + 2.0 * step,
        np.hypot(curve.deviation, 0.5 * step),
    )
    # The point asks what N could be if it ruled there, so the degrees of freedom are those of
    # white rate, whatever noise was identified.
    factor = _limit_of_variance(_freedom(curve, 0), chance / curve.tau.size)
    highest = np.where(used, raised * np.sqrt(factor * curve.tau), np.inf)
    index = int(np.nanargmin(highest))
    return CurveBound(value=float(highest[index]), tau=float(curve.tau[index]))


def _limit_of_variance(freedom: FloatArray, chance: float) -> FloatArray:
    """(points,) factor on a variance that it exceeds with a chance, by its chi-square law."""
    # Importing scipy.stats for it would take a second.
    return np.asarray(freedom / (2.0 * gammaincinv(0.5 * freedom, chance)))


@dataclass(frozen=True, slots=True, kw_only=True)
class SlowNoise:
    """Slow noise of a curve that no estimated term has.

    Attributes
    ----------
    tau
        Cluster time at which it stands out most, s.
    ratio
        Deviation there over that of the terms.
    """

    tau: float
    ratio: float


def highest_terms(
    curve: StabilityCurve,
    *,
    confidence: float,
    shortest: float = 0.0,
) -> dict[CoefficientName, float]:
    """Largest Q, B, K and R that a curve allows, SI.

    Parameters
    ----------
    curve
        Plain or overlapping Allan deviation.
    confidence
        That each lies below, shared by the points (Bonferroni).
    shortest
        Cluster times below it, s, are lowered by a low-pass or a readout.

    Returns
    -------
    dict
        Empty if no cluster time is left.
    """
    require_confidence(confidence)
    used = curve.tau >= shortest
    if not used.any():
        return {}
    basis = allan_variance_basis(curve.tau)
    share = (1.0 - confidence) / np.count_nonzero(used)
    found: dict[CoefficientName, float] = {}
    for name, noise_type in _NOISE_TYPES.items():
        high = curve.deviation**2 * _limit_of_variance(_freedom(curve, noise_type), share)
        square = float((high / basis[:, COEFFICIENT_NAMES.index(name)])[used].min())
        found[name] = math.sqrt(square)
    return found


def _freedom(curve: StabilityCurve, noise_type: int) -> FloatArray:
    angles = curve.samples + (curve.kind != "angle")
    return np.array(
        [
            equivalent_degrees_of_freedom(
                curve.estimator, noise_type, round(tau * curve.sample_rate), angles
            )
            for tau in curve.tau
        ]
    )


def within_curve(
    estimates: Mapping[CoefficientName, Estimate], highest: Mapping[CoefficientName, float]
) -> dict[CoefficientName, Estimate]:
    """Estimates that ask for no more than a curve allows.

    An interval ends at what the curve allows; one that lies above that altogether is no estimate,
    and what the curve allows is the bound.

    Parameters
    ----------
    estimates
        By coefficient.
    highest
        Of `highest_terms`.
    """
    return {
        name: _limited(estimate, highest[name]) if name in highest else estimate
        for name, estimate in estimates.items()
    }


def _limited(estimate: Estimate, highest: float) -> Estimate:
    # NaN of what is not observable is not above anything.
    if not estimate.high > highest:
        return estimate
    if estimate.status == "upper bound" or estimate.low >= highest:
        return replace(estimate, value=highest, low=0.0, high=highest, status="upper bound")
    return replace(estimate, value=min(estimate.value, highest), high=highest)


def slow_noise(
    curve: StabilityCurve, estimates: Mapping[CoefficientName, Estimate]
) -> SlowNoise | None:
    """A rise of a curve behind its lowest point that the estimated terms do not make.

    Parameters
    ----------
    curve
        Plain or overlapping Allan deviation.
    estimates
        By coefficient.

    Returns
    -------
    SlowNoise or None
        None if chance explains what there is.
    """
    squares = np.array([_most(estimates, name) for name in COEFFICIENT_NAMES])
    terms = allan_variance_basis(curve.tau) @ squares
    freedom = _freedom(curve, min(_NOISE_TYPES.values()))
    behind = _behind_lowest(curve) & (freedom >= _LEAST)
    if not behind.any() or not squares.any():
        return None
    share = 1.0 - _CHANCE / np.count_nonzero(behind)
    low = curve.deviation**2 * _limit_of_variance(freedom, share)
    excess = np.where(behind, low / terms, 0.0)
    most = int(np.argmax(excess))
    if excess[most] < _ABOVE**2:
        return None
    ratio = math.sqrt(float(curve.deviation[most] ** 2 / terms[most]))
    return SlowNoise(tau=float(curve.tau[most]), ratio=ratio)


def _most(estimates: Mapping[CoefficientName, Estimate], name: CoefficientName) -> float:
    """Largest square of a term; zero of a slow one that is not estimated."""
    found = estimates.get(name)
    if found is None or found.status == "not observable":
        return 0.0
    return 0.0 if found.status == "upper bound" and name in SLOW_NAMES else found.high**2


def _behind_lowest(curve: StabilityCurve) -> BooleanArray:
    return np.asarray(curve.tau > curve.tau[int(np.argmin(curve.deviation))])
