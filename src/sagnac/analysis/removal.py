"""The methods that take the periodic parts out of an angle, one function each."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from sagnac import series
from sagnac.analysis.measurement import Measurement
from sagnac.analysis.settings import Method
from sagnac.arrays import FloatArray
from sagnac.errors import Note, RecordingError
from sagnac.lines.model import Removal
from sagnac.lines.published import remove_lines_as_published
from sagnac.lines.search import remove_lines
from sagnac.recording.kinds import angle_of
from sagnac.recording.model import Recording
from sagnac.table.turns import full_rotation_samples

Fraction = Callable[[float], None]


@dataclass(frozen=True, slots=True, kw_only=True)
class Remainder:
    """What a method leaves of an angle.

    Attributes
    ----------
    removal
        The angle left, and what was taken.
    rate
        Of the angle left, Hz: the sample rate, or one a turn.
    once_a_turn
        Whether there is but one angle for each turn of the table. Such angles lie between
        samples.
    """

    removal: Removal
    rate: float
    once_a_turn: bool = False


def remainder_of(
    measured: Measurement,
    table: FloatArray | None,
    recording: Recording,
    method: Method,
    progress: Fraction,
) -> Remainder:
    """What the chosen method leaves of what is measured.

    Parameters
    ----------
    measured
        One gyro or a difference.
    table
        (samples,) unwrapped table angle, rad; None at rest.
    recording
        The gyros themselves, for a method that takes them one by one.
    method
        Which.
    progress
        Called with the fraction done.

    Raises
    ------
    RecordingError
        If the method cannot be used on this recording.
    """
    return _METHODS[method](measured, table, recording, progress)


def _untouched(angle: FloatArray, *notes: Note) -> Removal:
    """Nothing taken."""
    return Removal(residual=angle, lines=(), masked=(), taken=np.empty((3, 0)), notes=notes)


def _by_joint_fit(
    measured: Measurement, table: FloatArray | None, _: Recording, progress: Fraction
) -> Remainder:
    removal = remove_lines(
        measured.angle, table, measured.sample_rate, channel=measured.channel, progress=progress
    )
    return Remainder(removal=removal, rate=measured.sample_rate)


def _as_published(
    measured: Measurement, table: FloatArray | None, recording: Recording, progress: Fraction
) -> Remainder:
    """Each gyro first, then the difference: Eqs. 20 and 21."""
    rate = measured.sample_rate
    parts = [
        remove_lines_as_published(
            angle_of(recording.gyro(name), rate), table, rate, channel=name, progress=progress
        )
        for name in measured.gyros
    ]
    rest = parts[0].residual
    if len(parts) > 1:
        rest = series.less(rest, parts[1].residual)
    greedy = Note(
        level="warning",
        text="fos-paper lowers the mean square of an angle, and so takes the random walk's slow "
        "wander with the lines: value and bounds may lie below the truth (use {method fos})",
    )
    removal = Removal(
        residual=rest,
        lines=tuple(line for part in parts for line in part.lines),
        masked=tuple(band for part in parts for band in part.masked),
        taken=np.empty((3, 0)),
        notes=(greedy, *(note for part in parts for note in part.notes)),
    )
    return Remainder(removal=removal, rate=rate)


def _once_a_turn(
    measured: Measurement, table: FloatArray | None, recording: Recording, _: Fraction
) -> Remainder:
    """Full rotation interval sampling (FRIS), Eqs. 8 and 9."""
    if table is None and recording.null_pulse is None:
        raise RecordingError(
            "full rotation interval sampling ({method fris}) needs a turning table",
            remedy="name its encoder ({table COLUMN:UNIT}) or its null pulse "
            "({null-pulse COLUMN}), or use {method fos}",
        )
    times, values = full_rotation_samples(measured.angle, table, recording.null_pulse)
    rate = (times.size - 1) / (times[-1] - times[0]) * measured.sample_rate
    note = Note(
        level="warning",
        text=f"full rotation interval sampling: {times.size} angles, one a turn, every "
        f"{1.0 / rate:.4g} s; the interval asked for plays no part. Lines in time are still in, "
        "folded at that interval: value and bounds may be wrong either way (use {method fos})",
    )
    return Remainder(removal=_untouched(values, note), rate=float(rate), once_a_turn=True)


def _not_at_all(
    measured: Measurement, table: FloatArray | None, _: Recording, progress: Fraction
) -> Remainder:
    del progress
    left_in = Note(
        level="warning",
        text="no line was removed: on a turning table the value and its bounds are of table "
        "motion and lines, not of the gyro (use {method fos})",
    )
    notes = () if table is None else (left_in,)
    return Remainder(removal=_untouched(measured.angle, *notes), rate=measured.sample_rate)


_METHODS: Final[
    Mapping[Method, Callable[[Measurement, FloatArray | None, Recording, Fraction], Remainder]]
] = {
    "fos": _by_joint_fit,
    "fos-paper": _as_published,
    "fris": _once_a_turn,
    "none": _not_at_all,
}
