"""Columns of numbers taken as channels, stamps and pulses, converted and unwrapped."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from sagnac import series
from sagnac.arrays import BooleanArray, FloatArray
from sagnac.errors import Note, RecordingError, counted
from sagnac.recording.channel import Channel, Kind, numbers
from sagnac.recording.encoder_readings import angle_of_readings
from sagnac.recording.kinds import finite_extent
from sagnac.recording.unwrapping import unwrapped
from sagnac.units import sensor_of, time_scale, unit_of


@dataclass(frozen=True, slots=True, kw_only=True)
class Taken:
    """A channel made of a column, and what was noticed on the way."""

    channel: Channel
    notes: tuple[Note, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Pulses:
    """First samples of pulses, (samples,) bool, and what was noticed on the way."""

    rising: BooleanArray
    notes: tuple[Note, ...] = ()


def gyro_of(
    name: str, values: ArrayLike, *, kind: Kind, unit: str, period: float | None = None
) -> Taken:
    """A gyro of a column in a unit of the field; an accelerometer if the unit is one of force.

    Parameters
    ----------
    name
        Of the gyro.
    values
        (samples,) in `unit`.
    kind, unit
        See `Channel.from_values`.
    period
        Reading at which a counter of angle starts over, in `unit`; None if it never does.
        Accelerometers have none.

    Raises
    ------
    ValueError
        If an argument makes no sense, or the readings exceed the period.
    """
    sensor = sensor_of(unit)
    if period is None or sensor == "accelerometer":
        return Taken(channel=Channel.from_values(name, values, kind=kind, unit=unit, sensor=sensor))
    if kind != "angle":
        raise ValueError(
            f"period is {period:g} and gyro {name} of kind {kind}; only a counter of kind angle "
            "starts over"
        )
    if not 0.0 < period < np.inf:
        raise ValueError(f"period is {period}; give the reading at which the counter starts over")
    size = unit_of(unit, "angle").size
    readings = np.asarray(numbers(values, name), dtype=np.float64)
    extent = finite_extent(readings)
    if extent >= period:
        raise RecordingError(
            f"it spans {extent:.6g}, more than a period of {period:.6g} holds",
            channel=name,
            remedy="state the right {period}",
        )
    running, wraps = unwrapped(readings, period)
    notes = (
        (Note(text=f"the counter rolled over {counted(wraps, 'time')}: unwrapped", channel=name),)
        if wraps
        else ()
    )
    angle = series.made(lambda block: running[block] * size, running.size, running)
    return Taken(
        channel=Channel(name=name, kind=kind, values=angle, shown_in=unit),
        notes=notes,
    )


def table_of(values: ArrayLike, *, unit: str) -> Taken:
    """The table of a column of encoder readings: missing ones filled, unwrapped.

    Raises
    ------
    ValueError
        If `unit` is not one of angle or the values are no column of numbers.
    """
    stated = unit_of(unit, "angle")
    readings = np.array(numbers(values, "table"), dtype=np.float64)
    taken = angle_of_readings(readings, stated)
    return Taken(
        channel=Channel(name="table", kind="angle", values=taken.angle, shown_in=unit),
        notes=taken.notes,
    )


def seconds_of(values: ArrayLike, *, unit: str) -> FloatArray:
    """Time stamps in s from the first, shape (samples,).

    Integers, and dates of numpy, which state their own unit, lose nothing by the size of the
    epoch.

    Raises
    ------
    ValueError
        If `unit` is not one of time, or the values are no column of numbers or dates.
    """
    stamps = np.asarray(values)
    if stamps.dtype.kind in "mM":
        if stamps.ndim != 1:
            raise ValueError(f"times has shape {stamps.shape}; give one column, shape (samples,)")
        return np.asarray((stamps - stamps[:1]) / np.timedelta64(1, "s"), dtype=np.float64)
    scale = time_scale(unit)
    column = numbers(values, "times")
    return np.asarray(column - column[:1], dtype=np.float64) * scale


def pulses_of(values: ArrayLike, *, column: str = "") -> Pulses:
    """First sample of every pulse in a column of two levels, one of them 0.

    Parameters
    ----------
    values
        (samples,), not 0 while a pulse is up.
    column
        What the source calls it, for the message; empty if it has no name.

    Raises
    ------
    RecordingError
        If the column takes more than two values.
    """
    given = np.asarray(values)
    levels = numbers(given.astype(np.uint8) if given.dtype.kind == "b" else given, "null_pulse")
    rising = np.empty(levels.size, dtype=np.bool_)

    def is_finite(block: slice) -> bool:
        np.not_equal(levels[block], 0, out=rising[block])
        return bool(np.isfinite(levels[block]).all())

    some = series.every(levels, max(1, levels.size // 100_000))
    if np.unique(some).size > 2 or not all(series.map(is_finite, levels.size, levels)):
        raise RecordingError(
            f"{f'column {column} ' if column else ''}takes more than two values",
            channel="null_pulse",
            remedy="name a column of 0 and 1 with {null-pulse}",
        )
    high = np.count_nonzero(rising)
    rising[1:] &= ~rising[:-1]
    if np.count_nonzero(rising) == high:
        return Pulses(rising=rising)
    note = Note(text="stays up for more than a sample; its first is taken", channel="null_pulse")
    return Pulses(rising=rising, notes=(note,))
