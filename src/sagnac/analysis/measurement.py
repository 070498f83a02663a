"""What is measured: one gyro or the difference of two, and the table that it turns on."""

from dataclasses import dataclass

from sagnac import series
from sagnac.analysis.settings import Method
from sagnac.arrays import FloatArray
from sagnac.errors import Note, RecordingError
from sagnac.recording.encoder_mismatch import require_encoder_follows
from sagnac.recording.kinds import angle_of
from sagnac.recording.model import Recording
from sagnac.table.turns import SHORTEST, is_turning


@dataclass(frozen=True, slots=True, kw_only=True)
class Measurement:
    """The angle that an analysis is of.

    Attributes
    ----------
    channel
        ``x`` or ``x-z``.
    angle
        (samples,) rad.
    gyros
        One name, or the two that are differenced.
    sample_rate
        Hz.
    """

    channel: str
    angle: FloatArray
    gyros: tuple[str, ...]
    sample_rate: float

    @property
    def gyros_differenced(self) -> int:
        """1 for a gyro, 2 for a difference."""
        return len(self.gyros)


@dataclass(frozen=True, slots=True, kw_only=True)
class TurningTable:
    """The table as an analysis uses it.

    Attributes
    ----------
    angle
        (samples,) unwrapped, rad; None where nothing turns.
    notes
        Why an encoder that is there is not used.
    """

    angle: FloatArray | None
    notes: tuple[Note, ...] = ()


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
        angle=series.less(first, second),
        gyros=(gyros[0], gyros[-1]),
        sample_rate=rate,
    )


def turning_table(recording: Recording, gyros: tuple[str, ...], method: Method) -> TurningTable:
    """The table angle, if there is a table and it turns.

    Raises
    ------
    RecordingError
        If the encoder does not follow the gyros, or the recording is too short to tell its motion
        from their noise.
    """
    if recording.table is None:
        return TurningTable(angle=None)
    table = recording.table.values
    if not is_turning(table):
        note = Note(text="the table does not turn: its angle is not used")
        return TurningTable(angle=None, notes=(note,))
    if method == "fos" and recording.duration < SHORTEST:
        raise RecordingError(
            f"{recording.duration:.4g} s of a turning table do not tell its motion from the "
            "gyro's noise",
            remedy=f"take {SHORTEST:g} s or more, or the standing part ({{slice}})",
        )
    for name in gyros:
        require_encoder_follows(recording, recording.gyro(name))
    return TurningTable(angle=table)
