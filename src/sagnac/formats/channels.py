"""Raw numbers of a column -> channel in SI: kind, unit, size of one, and sample times."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np

from sagnac.core.arrays import FloatArray, blocks, elementwise
from sagnac.core.errors import Note, RecordingError, counted
from sagnac.core.units import (
    ANGLE_UNITS,
    RATE_UNITS,
    TIME_UNITS,
    Sensor,
    canonical,
    sizes,
    unit_of,
)
from sagnac.formats.choice import TIME_FORMS, Choice
from sagnac.formats.source import Column
from sagnac.formats.statement import Statements, parsed_unit
from sagnac.recording.channel import (
    KINDS,
    Channel,
    Conversion,
    Kind,
    finite_extent,
    quantity_of,
    unwrapped,
)
from sagnac.recording.columns import Sampling, sampling
from sagnac.recording.encoder_readings import table_of_readings

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
        taken = sampling(stamps[first:last], rate)
        return Stretch(first=first, stop=last, start=float(stamps[first]), sampling=taken)
    even = Sampling(times=None, sample_rate=rate or 0.0)
    return Stretch(first=first, stop=last, start=first / even.sample_rate, sampling=even)


def first_at(times: FloatArray, limit: float) -> int:
    """First sample at or after `limit`, s; their number if there is none."""
    for block in blocks(times.size):
        reached = times[block] >= limit - _SLACK
        if reached.any():
            return int(block.start + np.argmax(reached))
    return times.size


# ---- scales ------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class Scale:
    """Kind, unit and scale of the numbers of a column.

    Attributes
    ----------
    kind
        What one sample is.
    unit
        Unit of the numbers, as stated.
    factor
        SI size of one: rad, or rad/s for kind ``rate``.
    notes
        What was noticed of the statements.
    sensor
        ``gyro`` or ``accelerometer``.
    """

    kind: Kind
    unit: str
    factor: float
    notes: tuple[Note, ...] = ()
    sensor: Sensor = "gyro"


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
) -> tuple[str | None, str | None]:
    """Kind or unit of a channel as caller or TOML state it, and as its column or file does."""
    by_file: str | None = getattr(column, quantity)
    by_file = by_file or statements.file.of_channel(quantity, name, sensor)
    by_user = (one.of_channel(quantity, name, sensor) for one in statements.in_order[:2])
    return next(filter(None, by_user), None), by_file


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
    kind, unit = _kind(name, kinds[0] or kinds[1], sensor), units[0] or units[1]
    if sensor == "accelerometer":
        unit, factor = _unit_of_force(name, kind, unit)
        return Scale(kind=kind, unit=unit, factor=factor, sensor=sensor)
    unit = _sized_unit(name, unit, statements.first("scale"))
    by_caller = (
        statements.caller.of_channel("unit", name),
        statements.caller.of_channel("kind", name),
    )
    notes = [
        _contradiction(name, in_words, by_file, is_typed=typed is not None)
        for (in_words, by_file), typed in zip((units, kinds), by_caller, strict=True)
        if in_words and by_file and canonical(in_words) != canonical(by_file)
    ]
    return Scale(kind=kind, unit=unit, factor=_gyro_factor(name, kind, unit), notes=tuple(notes))


def _kind(name: str, stated: str | None, sensor: Sensor) -> Kind:
    if stated is None and sensor == "accelerometer":
        return "rate"
    for kind in KINDS:
        if kind == stated:
            return kind
    whose = f"{name}=" if sensor == "accelerometer" else ""
    raise RecordingError(
        "its kind is not stated"
        if stated is None
        else f"the file says kind {stated!r}, which is none",
        channel=name,
        remedy=f"state {{kind {whose}{'|'.join(KINDS)}}}",
    )


def _contradiction(name: str, taken: str, by_file: str, *, is_typed: bool) -> Note:
    """The file states another kind or unit than is taken.

    A caller knows what is typed; a TOML beside may be of the file that had this name before.
    """
    if is_typed:
        return Note(channel=name, text=f"the file says {by_file}, taken as {taken} as stated")
    text = (
        f"the file says {by_file} and the TOML beside it {taken}, which is taken; remove the TOML "
        f"if it is of another recording"
    )
    return Note(channel=name, text=text, level="warning")


def _unit_of_force(name: str, kind: Kind, unit: str | None) -> tuple[str, float]:
    """The unit of an accelerometer, and its size in SI."""
    remedy = f"state {{unit {name}=m/s^2}}, g or mg, or {{unit gyros=deg/s,accelerometers=g}}"
    if unit is None:
        raise RecordingError("its unit is not stated", channel=name, remedy=remedy)
    stated = parsed_unit(unit)
    known = sizes(quantity_of(kind, "accelerometer"))
    if stated.name not in known or not stated.factor > 0.0:
        raise RecordingError(
            f"unit {unit!r} is none of an accelerometer of kind {kind}",
            channel=name,
            remedy=remedy if kind == "rate" else f"state {{unit {name}=m/s}} or the right {{kind}}",
        )
    return unit, stated.factor * known[stated.name]


def _sized_unit(name: str, unit: str | None, scale: str | None) -> str:
    """The unit of the numbers: the one stated, or the size of a count if they are counts."""
    if unit is None and scale is None:
        raise RecordingError(
            "its unit is not stated", channel=name, remedy="state {unit}, arcsec for one"
        )
    if unit is not None and not parsed_unit(unit).is_known:
        raise RecordingError(
            f"unit {unit!r} is not known",
            channel=name,
            remedy="state {unit arcsec}, deg/s or counts",
        )
    if unit is None or parsed_unit(unit).is_counts:
        if scale is None:
            raise RecordingError(
                "it is in counts and their size is not stated",
                channel=name,
                remedy="state {scale 0.1arcsec}",
            )
        return scale
    if scale is not None:
        raise RecordingError(
            f"its unit {unit} and a scale per count contradict each other",
            channel=name,
            remedy="state {unit counts} and {scale}, or {unit} alone",
        )
    return unit


def _gyro_factor(name: str, kind: Kind, unit: str) -> float:
    """SI size of one `unit`, refused if it is none of the kind's quantity."""
    stated = parsed_unit(unit)
    wanted, other = (RATE_UNITS, ANGLE_UNITS) if kind == "rate" else (ANGLE_UNITS, RATE_UNITS)
    if stated.name not in wanted:
        quantity = "angle" if kind == "rate" else "rate"
        what = f"a unit of {quantity}" if stated.name in other else "no unit of a gyro"
        raise RecordingError(
            f"kind {kind} contradicts {stated.name}, {what}",
            channel=name,
            remedy="state the right {kind} or {unit}",
        )
    return stated.factor * wanted[stated.name]


def table_scale(column: Column) -> Scale:
    """Unit of the table angle.

    Raises
    ------
    RecordingError
        If none is stated, or it is not one of angle.
    """
    unit = parsed_unit(column.unit or "")
    if not unit.is_angle:
        raise _no_unit("table", column)
    factor = unit.factor * ANGLE_UNITS[unit.name]
    return Scale(kind="angle", unit=column.unit or "", factor=factor)


def time_unit(column: Column) -> float:
    """Seconds in one unit of the time stamps.

    Raises
    ------
    RecordingError
        If none is stated, or it is not one of time.
    """
    name = "ns" if column.unit in TIME_FORMS else canonical(column.unit or "")
    if name not in TIME_UNITS:
        raise _no_unit("time", column)
    return TIME_UNITS[name]


def _no_unit(role: Literal["table", "time"], column: Column) -> RecordingError:
    usual, quantity = ("deg", "angle") if role == "table" else ("s", "time")
    remedy = f"state {{{role} {column.key}:{usual}}}"
    problem = f"unit {column.unit!r} is not one of {quantity}"
    if column.unit is None:
        problem = f"the unit of column {column.key} is not stated"
        remedy += ", or leave it out with {table none}" if role == "table" else ""
    return RecordingError(problem, channel=role, remedy=remedy)


# ---- channels ----------------------------------------------------------------------


def gyro_channel(
    name: str, raw: FloatArray, scale: Scale, counter_period: float | None
) -> Conversion:
    """A gyro or an accelerometer.

    Parameters
    ----------
    name
        As the user calls it.
    raw
        (samples,) as the file has them; written over.
    scale
        Kind, and size of one raw number.
    counter_period
        Counts after which a counter starts over, or None.

    Raises
    ------
    RecordingError
        If it cannot be such a counter: it is no angle, or spans more than that holds.
    """
    readings, notes = raw, tuple[Note, ...]()
    if counter_period is not None:
        readings, notes = _running(name, raw, scale, counter_period)
    values = elementwise(np.multiply, readings, scale.factor, out=readings)
    channel = Channel(
        name=name, kind=scale.kind, shown_in=scale.unit, values=values, sensor=scale.sensor
    )
    return Conversion(channel=channel, notes=notes)


def _running(
    name: str, raw: FloatArray, scale: Scale, period: float
) -> tuple[FloatArray, tuple[Note, ...]]:
    """A counter of angle that starts over at `period`, made continuous, and how often it did."""
    if scale.kind != "angle":
        raise RecordingError(
            f"a counter that rolls over is an angle, not kind {scale.kind}",
            channel=name,
            remedy="state {kind angle}, or leave out {counter-bits} and {counter-period}",
        )
    extent = finite_extent(raw)
    if extent >= period:
        raise RecordingError(
            f"it spans {extent:.6g} counts, more than a counter of {period:.9g} holds",
            channel=name,
            remedy="state the right {counter-bits} or {counter-period}",
        )
    continuous, wraps = unwrapped(raw, period)
    bits = math.log2(period)
    what = f"{bits:g} bit counter" if bits.is_integer() else f"counter of {period:.9g}"
    text = f"the {what} rolled over {counted(wraps, 'time')}: unwrapped"
    return continuous, (Note(channel=name, text=text),) if wraps else ()


def table_channel(raw: FloatArray, scale: Scale, counter_period: float | None) -> Conversion:
    """The table angle: missing samples filled in where they can be, and unwrapped.

    Parameters
    ----------
    raw
        (samples,) as the file has them; written over.
    scale
        Size of one raw number.
    counter_period
        Counts after which counters start over, or None. A table in a plain unit is none.
    """
    return table_of_readings(
        raw,
        # Notes show the unit as it is stated.
        replace(unit_of(scale.unit, "angle"), name=scale.unit),
        shown_in=scale.unit,
        counter_period=None if parsed_unit(scale.unit).is_plain else counter_period,
    )
