"""A periodic component, and what removing all of them leaves."""

from dataclasses import dataclass
from typing import Literal

from sagnac.arrays import FloatArray

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
        rad, of ``amplitude * cos(2 pi f t + phase)`` at the first sample, or of
        ``amplitude * cos(order * alpha + phase)``.
    significance
        Drop of -2 log likelihood that the line brings.
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


@dataclass(frozen=True, slots=True, kw_only=True)
class Removal:
    """What `remove_lines` leaves, and what it took.

    Attributes
    ----------
    residual
        (samples,) the angle without table motion and lines, rad.
    lines
        Strongest first.
    masked
        (low, high) bands in Hz whose noise went with the lines.
    taken
        (3, bands) noise that went with the lines: frequency and bandwidth, Hz, and one-sided rate
        density, (rad/s)^2/Hz.
    notes
        What was noticed.
    unfinished
        (samples,) the angle without table motion but with all lines, rad, where the search did not
        come to an end and nobody knows what `residual` lacks; None where it did.
    """

    residual: FloatArray
    lines: tuple[Line, ...]
    masked: tuple[tuple[float, float], ...]
    taken: FloatArray
    notes: tuple[str, ...]
    unfinished: FloatArray | None = None
