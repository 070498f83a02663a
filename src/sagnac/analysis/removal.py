"""The methods that take the periodic parts out of an angle, one function each."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from sagnac.analysis.measurement import Measurement
from sagnac.analysis.settings import Method, Settings
from sagnac.core.arrays import FloatArray
from sagnac.core.errors import Note, RecordingError
from sagnac.lines.model import Removal
from sagnac.lines.published import LITERAL, PublishedSearch, remove_lines_as_published
from sagnac.lines.search import remove_lines
from sagnac.recording.channel import PAIR_SIZE, angle_of, as_one_gyro
from sagnac.recording.model import Recording
from sagnac.table.turns import full_rotation_samples

Fraction = Callable[[float], None]


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


def remainder_of(
    measured: Measurement,
    table: FloatArray | None,
    recording: Recording,
    settings: Settings,
    progress: Fraction,
) -> Remainder:
    """Removes lines from what is measured by the chosen method.

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
    search = settings.published if settings.method == "fos-paper" else LITERAL
    request = Request(recording=recording, search=search, progress=progress)
    left = _METHODS[settings.method](measured, table, request)
    return left if not measured.is_pair else replace(left, removal=_per_gyro(left.removal))


def _per_gyro(removal: Removal) -> Removal:
    """The remainder of a difference of two gyros as the noise of one."""
    return replace(
        removal,
        residual=as_one_gyro(removal.residual),
        taken=removal.taken / [[1.0], [1.0], [PAIR_SIZE**2]],
        unfinished=None if removal.unfinished is None else as_one_gyro(removal.unfinished),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Request:
    """Input of a method beside the angle.

    Attributes
    ----------
    recording
        The gyros themselves.
    search
        How a published search is run.
    progress
        Called with the fraction done.
    """

    recording: Recording
    search: PublishedSearch
    progress: Fraction


def _untouched(angle: FloatArray, *notes: Note) -> Removal:
    """Nothing taken."""
    return Removal(residual=angle, lines=(), masked=(), taken=np.empty((3, 0)), notes=notes)


def _by_joint_fit(measured: Measurement, table: FloatArray | None, request: Request) -> Remainder:
    removal = remove_lines(
        measured.angle,
        table,
        measured.sample_rate,
        channel=measured.channel,
        progress=request.progress,
    )
    return Remainder(removal=removal, rate=measured.sample_rate)


def _as_published(measured: Measurement, table: FloatArray | None, request: Request) -> Remainder:
    """Steps 1 to 3 of the paper."""
    rate = measured.sample_rate
    angles = {measured.channel: measured.angle}
    if measured.is_pair:
        angles = {name: angle_of(request.recording.gyro(name), rate) for name in measured.gyros}
    removal = remove_lines_as_published(
        angles, table, rate, search=request.search, progress=request.progress
    )
    return Remainder(removal=removal, rate=rate)


def _once_a_turn(measured: Measurement, table: FloatArray | None, request: Request) -> Remainder:
    """Full rotation interval sampling (FRIS), Eqs. 8 and 9."""
    pulse = request.recording.null_pulse
    if table is None and pulse is None:
        raise RecordingError(
            "full rotation interval sampling ({method fris}) needs a turning table",
            remedy="name its encoder ({table COLUMN:UNIT}) or its null pulse "
            "({null-pulse COLUMN}), or use {method fos}",
        )
    times, values = full_rotation_samples(measured.angle, table, pulse)
    rate = (times.size - 1) / (times[-1] - times[0]) * measured.sample_rate
    note = Note(
        level="warning",
        text=f"full rotation interval sampling: {times.size} angles, one a turn, every "
        f"{1.0 / rate:.4g} s; the interval asked for plays no part. Lines in time are still in, "
        "folded at that interval: value and bounds may be wrong either way (use {method fos})",
    )
    return Remainder(removal=_untouched(values, note), rate=float(rate), once_a_turn=True)


def _not_at_all(measured: Measurement, table: FloatArray | None, _: Request) -> Remainder:
    left_in = Note(
        level="warning",
        text="no line was removed: on a turning table the value and its bounds are of table "
        "motion and lines, not of the gyro (use {method fos})",
    )
    notes = () if table is None else (left_in,)
    return Remainder(removal=_untouched(measured.angle, *notes), rate=measured.sample_rate)


_METHODS: Final[Mapping[Method, Callable[[Measurement, FloatArray | None, Request], Remainder]]] = {
    "fos": _by_joint_fit,
    "fos-paper": _as_published,
    "fos-korenberg": _as_published,
    "fris": _once_a_turn,
    "none": _not_at_all,
}
