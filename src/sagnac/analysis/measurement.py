"""The measurement: one gyro or the difference of two."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from sagnac.core.arrays import FloatArray, blocks, elementwise, extent
from sagnac.core.errors import RecordingError
from sagnac.quality.gaps import not_finite_notes, stuck_notes
from sagnac.recording.channel import angle_of, as_one_gyro
from sagnac.recording.model import Recording

# A departure from a straight line by fewer units of the last place is rounding.
_ROUNDING: Final = 64.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Measurement:
    """The angle that an analysis is of.

    Attributes
    ----------
    channel
        ``x`` or ``x-z``.
    angle
        (samples,) rad; of two gyros their difference.
    gyros
        One name, or the two that are differenced.
    sample_rate
        Hz.
    weights
        Of the two gyros of a difference; their squares add up to 2.
    """

    channel: str
    angle: FloatArray
    gyros: tuple[str, ...]
    sample_rate: float
    weights: tuple[float, float] = (1.0, 1.0)

    def per_gyro(self) -> "Measurement":
        """The same with the noise of one gyro: a difference over sqrt(2)."""
        return replace(self, angle=as_one_gyro(self.angle)) if self.is_pair else self

    @property
    def is_pair(self) -> bool:
        """Whether it is the difference of two gyros."""
        return len(self.gyros) > 1

    def share(self, shares: Mapping[str, float]) -> float:
        """Share of the table's rate in the angle, from the shares of the gyros."""
        if not self.is_pair:
            return shares.get(self.gyros[0], 0.0)
        (first, second), (one, other) = self.gyros, self.weights
        return one * shares.get(first, 0.0) - other * shares.get(second, 0.0)


def measure(recording: Recording, gyros: tuple[str, ...]) -> Measurement:
    """The angle of one gyro, or of the first less the last of several.

    Parameters
    ----------
    recording
        Has these gyros.
    gyros
        One to three names.

    Raises
    ------
    RecordingError
        If the recording lacks one of them.
    """
    rate = recording.sample_rate
    first = angle_of(recording.gyro(gyros[0]), rate)
    if len(gyros) == 1:
        return Measurement(channel=gyros[0], angle=first, gyros=gyros, sample_rate=rate)
    second = angle_of(recording.gyro(gyros[-1]), rate)
    return Measurement(
        channel=f"{gyros[0]}-{gyros[-1]}",
        angle=elementwise(np.subtract, first, second),
        gyros=(gyros[0], gyros[-1]),
        sample_rate=rate,
    )


def require_sound(recording: Recording, gyros: tuple[str, ...]) -> None:
    """Refuse a gyro with missing samples, or one that is stuck.

    Raises
    ------
    RecordingError
        For the first of them.
    """
    for gyro in map(recording.gyro, gyros):
        notes = not_finite_notes(recording, gyro.name, gyro.values)
        for note in (*notes, *stuck_notes(recording, gyro)):
            if note.level == "error":
                raise RecordingError.of(note)


def require_noise(measured: Measurement) -> None:
    """Refuse a measurement that turns evenly to the last place of its numbers.

    Raises
    ------
    RecordingError
        If there is no noise in it, as in the difference of two copies of one gyro.
    """
    angle = measured.angle
    slope = (angle[-1] - angle[0]) / max(angle.size - 1, 1)
    largest = max(map(abs, extent(angle)))
    rounding = _ROUNDING * float(np.spacing(largest))
    for block in blocks(angle.size):
        line = angle[0] + slope * np.arange(block.start, block.stop)
        if np.abs(angle[block] - line).max() > rounding:
            return
    what = "the two gyros turn alike" if measured.is_pair else "it turns evenly"
    raise RecordingError(
        f"holds no noise: {what} to the last place of the numbers",
        channel=measured.channel,
        remedy="name other gyros with {gyros} or {columns}",
    )
