"""Kind and unit of the numbers of a column, and the samples of a file that are taken."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final, Literal

from sagnac.core.arrays import FloatArray, blocks
from sagnac.core.errors import Note, RecordingError
from sagnac.core.units import Quantity, Sensor, Unit, canonical, sizes, unit_of
from sagnac.formats.choice import TIME_FORMS, Choice
from sagnac.formats.source import Column
from sagnac.formats.statement import Statements, is_counts
from sagnac.recording.channel import KINDS, Kind, quantity_of
from sagnac.recording.columns import Sampling, sampling

# ---- sampling ----------------------------------------------------------------------

Span = tuple[float | None, float | None]

# A stamp that misses the limit of a slice by less than this, s, is at it.
_SLACK: Final = 1e-9


@dataclass(frozen=True, slots=True, kw_only=True)
class Stretch:
    """The samples of a file that are taken, and when they were.

    Attributes
    ----------
    first, stop
        First sample of the file that is taken, and the one after the last.
    start
        Time of the first, s from the first sample of the file.
    sampling
        Rate and times of those taken.
    """

    first: int
    stop: int
    start: float
    sampling: Sampling

    @property
    def span_s(self) -> tuple[float, float]:
        """Start of the first sample and end of the last, s from the first of the file."""
        return self.start, self.start + (self.stop - self.first) / self.sampling.sample_rate


def stretch_of(
    samples: int, span: Span | None, rate: float | None, stamps: FloatArray | None = None
) -> Stretch:
    """The samples that lie in a span, their rate and their times.

    Parameters
    ----------
    samples
        In the file.
    span
        Start and stop to take, s from the first sample, or None for all.
    rate
        Samples per second that are stated, or None.
    stamps
        (two samples or more,) s from the first of the file; None for uniform samples.

    Raises
    ------
    RecordingError
        If fewer than two samples lie in the span, time does not run forwards, the stamps
        contradict the rate, or there is neither.
    """
    if stamps is None and rate is None:
        raise RecordingError(
            "one sample or none is too few to tell a rate",
            channel="time",
            remedy="give a longer file",
        )

    def first_after(limit: float, known: int) -> int:
        if stamps is None:
            return min(samples, math.ceil(limit * (rate or 0.0) - 1e-6))
        return known + first_at(stamps[known:], limit)

    start, stop = span or (None, None)
    first = first_after(start, 0) if start else 0
    last = samples if stop is None else first_after(stop, first)
    if span is not None and last - first < 2:
        raise RecordingError(
            "fewer than two samples lie in the slice", remedy="widen {slice START:STOP}"
        )
    if stamps is not None:
        began, taken = float(stamps[first]), sampling(stamps[first:last], rate)
    else:
        taken = Sampling(times=None, sample_rate=rate or 0.0)
        began = first / taken.sample_rate
    return Stretch(first=first, stop=last, start=began, sampling=taken)


def first_at(times: FloatArray, limit: float) -> int:
    """First sample at or after `limit`, s; their number if there is none."""
    for block in blocks(times.size):
        reached = times[block] >= limit - _SLACK
        if reached.any():
            return int(block.start + reached.argmax())
    return times.size


# ---- kinds and units ---------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class Scale:
    """Kind and unit of the numbers of a gyro or an accelerometer, and notes on the statements.

    Attributes
    ----------
    kind
        What one sample is.
    unit
        Unit of the numbers, as stated; ``0.1arcsec`` for counts of that size.
    notes
        What was noticed of the statements.
    """

    kind: Kind
    unit: str
    notes: tuple[Note, ...] = ()


def require_known(choice: Choice, columns: Sequence[Column], statements: Statements) -> None:
    """Refuse a kind or unit of a name that is no channel and no column of the file.

    Raises
    ------
    RecordingError
        If caller or TOML state one, which would be heard by nobody.
    """
    taken = {**choice.gyros, **choice.accelerometers}
    keys = {column.key for column in taken.values()}
    others = {one.name for one in columns if one.key not in keys}
    others |= {name for one in statements.in_order for name in one.columns}
    for quantity, roles in (("kind", ()), ("unit", ("table", "time"))):
        known = dict.fromkeys((*taken, "gyros", "accelerometers", *roles))
        for statement in (statements.caller, statements.beside):
            stated = getattr(statement, quantity)
            for name in stated if isinstance(stated, Mapping) else ():
                if name not in known and name not in others:
                    raise RecordingError(
                        f"its {quantity} is stated, and there is no such channel",
                        channel=name,
                        remedy=f"state {{{quantity}}} of {', '.join(known)}",
                    )


def stated_for(
    quantity: Literal["kind", "unit"],
    name: str,
    column: Column,
    statements: Statements,
    sensor: Sensor = "gyro",
) -> tuple[str | None, str | None, str | None]:
    """Kind or unit of a channel as caller, TOML, and its column or else the file state it."""
    caller, beside, file = (one.of_channel(quantity, name, sensor) for one in statements.in_order)
    by_column: str | None = getattr(column, quantity)
    return caller, beside, by_column or file


def scale_of(name: str, column: Column, statements: Statements, sensor: Sensor = "gyro") -> Scale:
    """Kind and unit of a channel: as caller or TOML state it, else its column, else the file.

    The kind of an accelerometer is ``rate`` unless another is stated.

    Raises
    ------
    RecordingError
        If kind, unit or the size of a count is not stated, or they contradict each other.
    """
    kinds = stated_for("kind", name, column, statements, sensor)
    units = stated_for("unit", name, column, statements, sensor)
    stated, unit = (next(filter(None, one), None) for one in (kinds, units))
    of_one = "" if sensor == "gyro" else f"{name}="
    if stated is None and sensor == "accelerometer":
        stated = "rate"
    kind = next((one for one in KINDS if one == stated), None)
    if kind is None:
        raise RecordingError(
            "its kind is not stated"
            if stated is None
            else f"the file says kind {stated!r}, which is none",
            channel=name,
            remedy=f"state {{kind {of_one}{'|'.join(KINDS)}}}",
        )
    scale = statements.first("scale") if sensor == "gyro" else None
    if scale is not None and not is_counts(unit or "counts"):
        raise RecordingError(
            f"its unit {unit} and a scale per count contradict each other",
            channel=name,
            remedy="state {unit counts} and {scale}, or {unit} alone",
        )
    if scale is None and sensor == "gyro" and is_counts(unit or ""):
        raise RecordingError(
            "it is in counts and their size is not stated",
            channel=name,
            remedy="state {scale 0.1arcsec}",
        )
    unit, quantity = scale or unit, quantity_of(kind, sensor)
    usual = next(iter(sizes(quantity)))
    known_unit(
        name,
        unit,
        quantity,
        f"state {{unit {of_one}{usual}}} or another of {quantity}, or the right {{kind}}",
    )
    notes = [
        _contradiction(name, caller, beside, by_file)
        for caller, beside, by_file in (units, kinds)
        if by_file and canonical(caller or beside or by_file) != canonical(by_file)
    ]
    return Scale(kind=kind, unit=unit or "", notes=tuple(notes))


def _contradiction(name: str, caller: str | None, beside: str | None, by_file: str) -> Note:
    """The file states another kind or unit than is taken.

    A caller knows what is typed; a TOML beside may be of the file that had this name before.
    """
    if caller is None:
        return toml_contradiction(by_file, beside, channel=name)
    return Note(channel=name, text=f"the file says {by_file}, taken as {caller} as stated")


def toml_contradiction(by_file: str, by_toml: str | None, channel: str = "") -> Note:
    """A warning that the TOML beside a file states something else than the file."""
    text = (
        f"the file says {by_file} and the TOML beside it {by_toml}, which is taken; remove the "
        "TOML if it is of another recording"
    )
    return Note(channel=channel, text=text, level="warning")


def role_unit(role: Literal["table", "time"], column: Column) -> Unit:
    """Unit of the table angle, or of the time stamps.

    Raises
    ------
    RecordingError
        If none is stated, or it is one of something else.
    """
    usual, quantity = _ROLES[role]
    remedy = f"state {{{role} {column.key}:{usual}}}, or leave it out with {{{role} none}}"
    return known_unit(role, "ns" if column.unit in TIME_FORMS else column.unit, quantity, remedy)


_ROLES: Final[Mapping[str, tuple[str, Quantity]]] = {
    "table": ("deg", "angle"),
    "time": ("s", "time"),
}


def known_unit(channel: str, unit: str | None, quantity: Quantity, remedy: str) -> Unit:
    """The unit that is stated of a channel.

    Raises
    ------
    RecordingError
        If there is none, or it is none of the quantity.
    """
    if unit is None:
        raise RecordingError("its unit is not stated", channel=channel, remedy=remedy)
    try:
        return unit_of(unit, quantity)
    except ValueError:
        raise RecordingError(
            f"unit {unit!r} is not one of {quantity}", channel=channel, remedy=remedy
        ) from None
