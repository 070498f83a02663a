"""What a fit says of Q, N, B, K and R: value, interval, status and units."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Final, Literal

import numpy as np

from sagnac.arrays import FloatArray
from sagnac.coefficients.laws import CoefficientName
from sagnac.recording.difference import per_gyro
from sagnac.units import COEFFICIENT_UNITS

Status = Literal["estimated", "upper bound", "not observable"]
FitName = Literal["paper", "weighted", "likelihood"]
OptionalName = Literal["markov_driving_noise", "markov_correlation_time", "sinusoid_amplitude"]
# A term is called present where leaving it out costs three standard deviations: a false
# alarm of 0.13 % for each term that is not there.
PRESENCE: Final = 9.0
# Of -2 log likelihood, and of standard deviations at a limit: far below what chance does.
CONVERGED: Final = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True)
class Estimate:
    """One coefficient in SI.

    ``estimated``: `value` within [`low`, `high`] at `confidence`. ``upper bound``:
    `value` and `high` are the bound, `low` is 0. ``not observable``: all three are NaN.
    """

    value: float
    low: float
    high: float
    confidence: float
    status: Status


@dataclass(frozen=True, slots=True, kw_only=True)
class Fit:
    """All coefficients by one method.

    Attributes
    ----------
    method
        ``paper``: least squares on Eq. 3. ``weighted``: non-negative generalized least
        squares on the curve. ``likelihood``: Whittle on the spectrum.
    coefficients
        By name; per gyro (the factor for a difference is already taken out).
    notes
        What was noticed.
    optional
        Terms beside the five that were asked for: q_c in rad/s/sqrt(s) and T_c in s of a
        Markov rate, the peak rate of a sinusoid in rad/s.
    departure
        Of a likelihood fit: relative departure of the spectrum from the terms that chance does
        not explain, 1 or more where bins had to be left out; 0 where the terms suffice.
    """

    method: FitName
    coefficients: Mapping[CoefficientName, Estimate]
    notes: tuple[str, ...] = ()
    departure: float = 0.0
    optional: Mapping[OptionalName, Estimate] = field(default_factory=dict)


def require_confidence(confidence: float) -> None:
    """Refuse a confidence that is no probability.

    Raises
    ------
    ValueError
        If it is not between 0 and 1.
    """
    if not 0.0 < confidence < 1.0:
        raise ValueError(f"confidence is {confidence}; give a number between 0 and 1")


def crossing(
    rise: Callable[[float], float], inside: float, step: float, limit: float = math.inf
) -> float:
    """Where `rise`, negative at `inside`, crosses zero towards `step`, not beyond `limit`.

    Infinite where it does not within a million steps; `inside` itself where `rise` is not
    negative there, as when weights that differ between two trial values put it beyond.
    """
    low, low_value = inside, rise(inside)
    if low_value >= 0.0:
        return inside
    for _ in range(26):
        high = inside + step
        if abs(high - inside) >= abs(limit - inside):
            high = limit
        high_value = min(rise(high), 1e3)
        if high_value >= 0.0 or high == limit:
            break
        low, low_value = high, high_value
        step *= 1.8
    else:
        return math.copysign(math.inf, step)
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


def per_gyro_estimate(
    squares: tuple[float, float, float, Status], gyros_differenced: int, confidence: float
) -> Estimate:
    """Estimate of one gyro from value, low, high (squares, of what was measured) and status."""
    value, low, high, status = squares
    return Estimate(
        value=per_gyro(value, gyros_differenced),
        low=per_gyro(low, gyros_differenced),
        high=per_gyro(high, gyros_differenced),
        confidence=confidence,
        status=status,
    )


UNSEEN: Final[tuple[float, float, float, Status]] = (
    math.nan,
    math.nan,
    math.nan,
    "not observable",
)


def in_units(name: CoefficientName, value: float) -> dict[str, float]:
    """One coefficient in every unit that it is written in.

    Parameters
    ----------
    name
        Of the coefficient.
    value
        SI.

    Returns
    -------
    dict
        By unit, the field's first. Angle random walk as a noise density is per root hertz
        of a two-sided spectrum, as the IEEE standards define it: 1 deg/sqrt(h) is
        60 deg/h/sqrt(Hz), and rad/sqrt(s) and rad/s/sqrt(Hz) are the same number.
    """
    return {unit: value / size for unit, size in COEFFICIENT_UNITS[name].items()}
