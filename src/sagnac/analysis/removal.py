"""The methods that take the periodic parts out of a measurement."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from sagnac.analysis.measurement import Measurement
from sagnac.analysis.settings import Settings
from sagnac.core.arrays import BooleanArray, FloatArray
from sagnac.core.errors import Note, RecordingError
from sagnac.lines.model import Removal
from sagnac.lines.published import LITERAL, remove_lines_as_published
from sagnac.lines.search import remove_lines
from sagnac.recording.channel import angle_of
from sagnac.recording.model import Recording
from sagnac.table.turns import full_rotation_samples


@dataclass(frozen=True, slots=True, kw_only=True)
class Remainder:
    """An angle after a method removed its lines.

    Attributes
    ----------
    removal
        The angle left and what was taken, per gyro; its lines are of the channel that they name.
    rate
        Of the angle left, Hz: the sample rate, or one a turn.
    once_a_turn
        Whether there is but one angle for each turn of the table. Such angles lie between
        samples.
    """

    removal: Removal
    rate: float
    once_a_turn: bool = False

    @property
    def is_finished(self) -> bool:
        """Whether the search for lines came to an end."""
        return self.removal.unfinished is None


def remainder_of(
    measured: Measurement,
    table: FloatArray | None,
    recording: Recording,
    settings: Settings,
    progress: Callable[[float], None],
) -> Remainder:
    """Removes lines from what is measured by the chosen method.

    Here the difference of two gyros ends: what is left has the noise of one.

    Parameters
    ----------
    measured
        One gyro or a difference.
    table
        (samples,) unwrapped table angle, rad; None at rest.
    recording
        The gyros themselves, for a method that takes them one by one.
    settings
        Method, and how a published search is run.
    progress
        Called with the fraction done.

    Raises
    ------
    RecordingError
        If the method cannot be used on this recording.
    """
    rate = measured.sample_rate
    if settings.method == "fos":
        removal = remove_lines(
            measured.angle, table, rate, channel=measured.channel, progress=progress
        )
    elif settings.method == "fris":
        removal, rate = _once_a_turn(measured, table, recording.null_pulse)
    elif settings.method == "none":
        left_in = Note(
            level="warning",
            text="no line was removed: on a turning table the value and its bounds are of table "
            "motion and lines, not of the gyro (use {method fos})",
        )
        removal = _nothing_removed(measured.angle, *([] if table is None else [left_in]))
    else:
        # Steps 1 to 3 of the paper, which search each gyro of a pair first.
        angles = {measured.channel: measured.angle}
        if measured.is_pair:
            angles = {name: angle_of(recording.gyro(name), rate) for name in measured.gyros}
        search = settings.published if settings.method == "fos-paper" else LITERAL
        removal = remove_lines_as_published(angles, table, rate, search=search, progress=progress)
    if measured.is_pair:
        unfinished = removal.unfinished
        removal = replace(
            removal,
            residual=measured.noise(removal.residual),
            taken=removal.taken / [[1.0], [1.0], [measured.size**2]],
            unfinished=None if unfinished is None else measured.noise(unfinished),
        )
    return Remainder(removal=removal, rate=rate, once_a_turn=settings.method == "fris")


def _nothing_removed(angle: FloatArray, *notes: Note) -> Removal:
    return Removal(residual=angle, lines=(), masked=(), taken=np.empty((3, 0)), notes=notes)


def _once_a_turn(
    measured: Measurement, table: FloatArray | None, pulse: BooleanArray | None
) -> tuple[Removal, float]:
    """Full rotation interval sampling (FRIS), Eqs. 8 and 9: the angles left, and their rate, Hz."""
    if table is None and pulse is None:
        raise RecordingError(
            "full rotation interval sampling ({method fris}) needs a turning table",
            remedy="name its encoder ({table COLUMN:UNIT}) or its null pulse "
            "({null-pulse COLUMN}), or use {method fos}",
        )
    times, values = full_rotation_samples(measured.angle, table, pulse)
    rate = float((times.size - 1) / (times[-1] - times[0]) * measured.sample_rate)
    note = Note(
        level="warning",
        text=f"full rotation interval sampling: {times.size} angles, one a turn, every "
        f"{1.0 / rate:.4g} s; the interval asked for plays no part. Lines in time are still in, "
        "folded at that interval: value and bounds may be wrong either way (use {method fos})",
    )
    return _nothing_removed(values, note), rate
