"""Q, N, B, K, R from a stability curve or a spectrum, each with an interval and a status."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from sagnac.noise import CoefficientName

Status = Literal["estimated", "upper bound", "not observable"]
FitName = Literal["paper", "weighted", "likelihood"]


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
    """

    method: FitName
    coefficients: Mapping[CoefficientName, Estimate]
    notes: tuple[str, ...] = ()
