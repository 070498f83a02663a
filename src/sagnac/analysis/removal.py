"""What is measured, and the method that takes its lines out."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from sagnac import series
from sagnac.analysis.settings import Settings
from sagnac.arrays import FloatArray
from sagnac.errors import RecordingError
from sagnac.lines.model import Line, Removal
from sagnac.lines.published import remove_lines_as_published
from sagnac.lines.search import remove_lines
from sagnac.recording.following import require_encoder_follows
from sagnac.recording.kinds import angle_of
from sagnac.recording.model import Recording
from sagnac.table.turns import SHORTEST, full_rotation_samples, is_turning


def measured_angle(
    recording: Recording, settings: Settings, where: str
) -> tuple[str, FloatArray, int]:
    """Name, angle (rad) and number of gyros of what is measured: a gyro, or a difference."""
    names = settings.gyros
    if not 1 <= len(names) <= 3 or len(set(names)) != len(names):
        raise RecordingError(
            f"{where}: gyros {','.join(names) or '(none)'}: name one gyro, a pair or a triad, "
            "each once (--gyros x,z)"
        )
    first = angle_of(recording.gyro(names[0]), recording.sample_rate)
    if len(names) == 1:
        return names[0], first, 1
    second = angle_of(recording.gyro(names[-1]), recording.sample_rate)
    return f"{names[0]}-{names[-1]}", series.less(first, second), 2


def table_angle(recording: Recording, settings: Settings, notes: list[str]) -> FloatArray | None:
    """Unwrapped table angle, or None where nothing turns."""
    if recording.table is None:
        return None
    table = recording.table.values
    if not is_turning(table):
        notes.append("the table does not turn: its angle is not used")
        return None
    if settings.method == "fos" and recording.duration < SHORTEST:
        raise RecordingError(
            f"{recording.duration:.4g} s of a turning table do not tell its motion from the gyro's "
            f"noise; take {SHORTEST:g} s or more, or the standing part (--slice)"
        )
    for name in settings.gyros:
        require_encoder_follows(recording, recording.gyro(name))
    return table


@dataclass(frozen=True, slots=True, kw_only=True)
class _Removed:
    """What a method leaves: points for the curve, and the full-rate residual if it has one."""

    points: FloatArray
    point_rate: float
    residual: FloatArray | None
    lines: tuple[Line, ...] = ()
    masked: tuple[tuple[float, float], ...] = ()
    taken: FloatArray = field(default_factory=lambda: np.empty((3, 0)))
    notes: tuple[str, ...] = ()
    unfinished: FloatArray | None = None


def remove_by_method(
    angle: FloatArray,
    table: FloatArray | None,
    recording: Recording,
    settings: Settings,
    *,
    channel: str,
    where: str,
    progress: Callable[[float], None],
) -> _Removed:
    """What the chosen method leaves of an angle, and what it took."""
    rate = recording.sample_rate
    if settings.method == "fris":
        if table is None and recording.null_pulse is None:
            raise RecordingError(
                f"{where}: full rotation interval sampling (--method fris) needs a turning table; "
                "name its encoder (--table COLUMN:UNIT) or its null pulse (--null-pulse COLUMN), "
                "or use --method fos"
            )
        try:
            times, values = full_rotation_samples(angle, table, recording.null_pulse)
        except RecordingError as error:
            raise RecordingError(f"{where}: table: {error}") from None
        turn_rate = (times.size - 1) / (times[-1] - times[0]) * rate
        note = (
            f"full rotation interval sampling: {times.size} angles, one a turn, every "
            f"{1.0 / turn_rate:.4g} s; the interval asked for plays no part. Lines in time are "
            "still in, folded at that interval: value and bounds may be wrong either way (use "
            "--method fos)"
        )
        return _Removed(points=values, point_rate=turn_rate, residual=None, notes=(note,))
    if settings.method == "fos-paper":
        # Each gyro first, then the difference: Eq. 21.
        parts = [
            remove_lines_as_published(
                angle_of(recording.gyro(name), rate), table, rate, channel=name, progress=progress
            )
            for name in dict.fromkeys((settings.gyros[0], settings.gyros[-1]))
        ]
        rest = parts[0].residual
        if len(parts) > 1:
            rest = series.less(rest, parts[1].residual)
        removal = Removal(
            residual=rest,
            lines=tuple(line for part in parts for line in part.lines),
            masked=tuple(band for part in parts for band in part.masked),
            taken=np.empty((3, 0)),
            notes=(
                "fos-paper lowers the mean square of an angle, and so takes the random walk's slow "
                "wander with the lines: value and bounds may lie below the truth (use --method "
                "fos)",
                *(note for part in parts for note in part.notes),
            ),
        )
    elif settings.method == "none":
        left_in = (
            "no line was removed: on a turning table the value and its bounds are of table motion "
            "and lines, not of the gyro (use --method fos)"
        )
        removal = Removal(
            residual=angle,
            lines=(),
            masked=(),
            taken=np.empty((3, 0)),
            notes=() if table is None else (left_in,),
        )
    else:
        removal = remove_lines(angle, table, rate, channel=channel, progress=progress)
    points, point_rate = at_interval(removal.residual, rate, settings.interval)
    return _Removed(
        points=points,
        point_rate=point_rate,
        residual=removal.residual,
        lines=removal.lines,
        masked=removal.masked,
        taken=removal.taken,
        notes=tuple(str(note) for note in removal.notes),
        unfinished=removal.unfinished,
    )


def at_interval(
    angle: FloatArray, sample_rate: float, interval: float | None
) -> tuple[FloatArray, float]:
    """Every so-many-th angle (Step 4), and their rate."""
    step = interval_samples(interval, sample_rate)
    return (angle if step == 1 else series.every(angle, step)), sample_rate / step


def interval_samples(interval: float | None, sample_rate: float) -> int:
    """The nearest whole number of samples in an interval; 1 where none is asked for."""
    return 1 if interval is None else max(1, round(interval * sample_rate))
