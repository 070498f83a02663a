"""A periodic component, and what removing all of them leaves."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from sagnac.core.arrays import FloatArray
from sagnac.core.errors import Note, quoted, refusal, require_choice
from sagnac.core.units import ANGLE_UNITS, VELOCITY_UNITS
from sagnac.recording.channel import Compared

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
        Peak amplitude of the angle and its standard deviation, rad (m/s of an accelerometer);
        `amplitude_in` converts.
    phase, phase_error
        rad, of ``amplitude * cos(2 pi f t + phase)`` at the first sample, or of
        ``amplitude * cos(order * alpha + phase)``, alpha the table angle from where the encoder
        reads zero, its periodic error in it.
    significance
        Drop of -2 log likelihood that the line brings.
    channel
        ``x`` or ``x-z``.
    name
        What it is where that is known: ``sideband of 50 Hz at the table rate``.

    Raises
    ------
    ValueError
        If the scale is none of these, or the amplitude is below zero.

    Examples
    --------
    >>> import numpy as np
    >>> from sagnac import remove_lines
    >>> random = np.random.default_rng(1)
    >>> tone = 1e-6 * np.cos(2.0 * np.pi * 7.3 * np.arange(4000) / 100.0)
    >>> angle = np.cumsum(1e-8 * random.standard_normal(4000)) + tone
    >>> removal = remove_lines(angle, None, 100.0, channel="x")
    >>> (line,) = removal.lines
    >>> line.scale, round(line.frequency, 3)
    ('time', 7.3)
    >>> abs(line.amplitude - 1e-6) < 4.0 * line.amplitude_error
    True
    >>> value, error = line.amplitude_in("arcsec")
    >>> round(value, 2), error < 0.01
    (0.21, True)
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

    def __post_init__(self) -> None:
        require_choice("scale", self.scale, Scale)
        if self.amplitude < 0.0:
            raise refusal("amplitude", f"is {self.amplitude}; give zero or more")

    def amplitude_in(self, unit: str) -> tuple[float, float]:
        """The amplitude and its standard deviation in a unit of the field.

        Parameters
        ----------
        unit
            Of angle (``arcsec``, ``deg``, ``rad``); of velocity (``um/s``, ``m/s``) for a line of
            an accelerometer.

        Raises
        ------
        ValueError
            If it is none of these.
        """
        sizes = {**ANGLE_UNITS, **VELOCITY_UNITS}
        if unit not in sizes:
            raise refusal("unit", f"is {quoted(unit)}; use one of {', '.join(sizes)}")
        return self.amplitude / sizes[unit], self.amplitude_error / sizes[unit]

    def hertz(self, turn_rate: float) -> float:
        """Frequency, Hz, beside a table that makes `turn_rate` turns a second."""
        return self.frequency * (turn_rate if self.scale == "angle" else 1.0)


def lines_of(scales: Iterable[Scale], channel: str, **columns: ArrayLike) -> list[Line]:
    """Lines of a channel whose other numbers stand in columns, (lines,) or one for all each."""
    rows = np.stack(np.broadcast_arrays(*columns.values()), axis=-1).tolist()
    return [
        Line(scale=scale, channel=channel, **dict(zip(columns, row, strict=True)))
        for scale, row in zip(scales, rows, strict=True)
    ]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Removal(Compared):
    """An angle after the removal of lines, and what was removed.

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
        density, (rad/s)^2/Hz. Read-only.
    notes
        What was noticed.
    unfinished
        (samples,) the angle without table motion but with all lines, rad, if the search did not
        come to an end and nobody knows what `residual` lacks; None if it did.

    Raises
    ------
    ValueError
        If `taken` has another shape.

    Examples
    --------
    >>> import numpy as np
    >>> from sagnac import remove_lines
    >>> random = np.random.default_rng(1)
    >>> tone = 1e-6 * np.cos(2.0 * np.pi * 7.3 * np.arange(4000) / 100.0)
    >>> angle = np.cumsum(1e-8 * random.standard_normal(4000)) + tone
    >>> removal = remove_lines(angle, None, 100.0, channel="x")
    >>> len(removal.lines), removal.residual.shape, bool(removal.residual.std() < angle.std())
    (1, (4000,), True)
    """

    residual: FloatArray
    lines: tuple[Line, ...]
    masked: tuple[tuple[float, float], ...]
    taken: FloatArray
    notes: tuple[Note, ...]
    unfinished: FloatArray | None = None

    def __post_init__(self) -> None:
        if self.taken.ndim != 2 or self.taken.shape[0] != 3:
            raise refusal("taken", f"has shape {self.taken.shape}; give (3, bands)")
        # A view: the caller's own array stays as it is. The long residual is left writable, since
        # compiled loops would be compiled again for an array that is not.
        taken = np.asarray(self.taken).view()
        taken.flags.writeable = False
        object.__setattr__(self, "taken", taken)
