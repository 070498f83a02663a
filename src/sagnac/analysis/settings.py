"""What the caller chooses."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from sagnac.stability.estimators import Estimator

Method = Literal["fos", "fos-paper", "fris", "none"]
Progress = Callable[[str, float], None]


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """What the caller chose.

    Attributes
    ----------
    gyros
        Names: one gyro, a pair to difference, or a triad: the first less the last gives the
        curve and the answer, and with the second each gyro's own N is told apart.
    method
        How the periodic parts are removed.
    interval
        Seconds between the angles that the curve is made of (Step 4 of the paper: 1 s);
        None for every sample.
    confidence
        Of every interval.
    estimators
        Which of the Allan family to make of the same angles, with the power spectral density,
        beside the overlapping Allan deviation that the coefficients rest on.
    """

    gyros: tuple[str, ...]
    method: Method = "fos"
    interval: float | None = 1.0
    confidence: float = 0.95
    estimators: tuple[Estimator, ...] = ()
