"""Periodic components in table angle and in time: found, refined, fitted, removed."""

from dataclasses import dataclass
from typing import Literal

Scale = Literal["angle", "time"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Line:
    """One periodic component of a gyro angle or of a difference of two.

    Attributes
    ----------
    scale
        ``angle``: periodic in table angle; ``time``: periodic in time.
    frequency
        Cycles per turn (the order) on the angle scale, Hz on the time scale.
    frequency_error
        Standard deviation of `frequency`; 0 where the order was given, not fitted.
    amplitude, amplitude_error
        Peak amplitude of the angle and its standard deviation, rad.
    phase, phase_error
        rad, of ``amplitude * cos(2 pi f t + phase)`` at the first sample.
    significance
        Drop of -2 log likelihood that the line brings (chi-square, 2 or 3 dof).
    channel
        ``x`` or ``x-z``.
    name
        What it is where that is known: ``sideband of 50 Hz at the table rate``.
    """

    scale: Scale
    frequency: float
    frequency_error: float
    amplitude: float
    amplitude_error: float
    phase: float
    phase_error: float
    significance: float
    channel: str
    name: str = ""
