"""Columns of numbers taken as channels, stamps and pulses, converted and unwrapped.

A frame whose columns are taken is one of pandas or xarray, or a dictionary; none is imported.

Encoder readings that were lost for longer than a polynomial bridges are taken from a gyro. Where
the encoder is silent a gyro goes on. Between the last reading and the next one its turn, divided by
its share of the table's rate and tilted to meet both, is the table's: off by no more than the
gyro's own noise, and by as little of its wrong share as the rate changes meanwhile.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from sagnac.core.arrays import (
    BooleanArray,
    FloatArray,
    IntegerArray,
    elementwise,
    every,
    is_finite,
    mean,
)
from sagnac.core.errors import Note, RecordingError, counted, quoted
from sagnac.core.units import DEGREE, sensor_of, split_header, time_scale, unit_of
from sagnac.recording.channel import Channel, Kind, angle_of, finite_extent, numbers, unwrapped
from sagnac.recording.encoder_readings import LARGEST_SHARE_MISSING, angle_of_readings, runs
from sagnac.recording.stamps import Places, is_not_finite

# ---- frames ------------------------------------------------------------------------

# What columns are called if nobody says otherwise.
GYRO_NAMES: Final = ("x", "y", "z")
ACCELEROMETER_NAMES: Final = ("ax", "ay", "az")
TABLE_NAMES: Final = ("table", "alpha", "encoder")
TIME_NAMES: Final = ("time", "t")
NULL_PULSE_NAME: Final = "null_pulse"
TEMPERATURE: Final = "temperature"

_Text = TypeVar("_Text", bound=str)


def columns_of(
    frame: Any,
    columns: Mapping[str, str] | None,
    *,
    kind: Kind | Mapping[str, Kind] | None,
    unit: str | Mapping[str, str] | None,
    time_unit: str | None,
    table_unit: str | None,
    dates: bool,
) -> dict[str, Any]:
    """The columns of a recording in a frame, as arguments of `Recording.from_arrays`.

    Parameters
    ----------
    frame
        What has columns by name.
    columns
        Name wanted -> name in the frame, or None for the columns of known names.
    kind, unit, time_unit, table_unit
        As stated; what headers and attributes state if None.
    dates
        Whether the dates of an index are the time if no column is.

    Raises
    ------
    ValueError
        If a column is not there, or neither argument nor frame states a kind or a unit.
    """
    found = _named_columns(frame, columns, unit)
    stated = {name: split_header(header)[1] for name, header in found.items()}
    gyros = [name for name in found if name not in ("table", "time", NULL_PULSE_NAME)]
    if not gyros:
        raise ValueError(
            f"the frame has no gyro; it has {', '.join(_headers(frame)) or 'no column'}: "
            "name one with columns={'x': NAME}"
        )
    kind = kind or getattr(frame, "attrs", {}).get("kind")
    if kind is None:
        raise ValueError("kind is not stated; state angle, increment or rate")

    def taken(name: str) -> Any:
        return frame[found[name]] if name in found else None

    times = taken("time")
    index = getattr(frame, "index", None)
    if times is None and dates and np.asarray(index).dtype.kind in "mM":
        times = index
    return {
        "kind": kind,
        "unit": {name: _unit_for(name, unit, stated[name]) for name in gyros},
        "times": times,
        "time_unit": time_unit or stated.get("time") or "s",
        "table": taken("table"),
        "table_unit": table_unit or stated.get("table") or "deg",
        "null_pulse": taken(NULL_PULSE_NAME),
        **{name: frame[found[name]] for name in gyros},
    }


def stated_for(name: str, stated: _Text | Mapping[str, _Text], argument: str) -> _Text:
    """Statement of an argument for one gyro: the one for all, or its own.

    Raises
    ------
    ValueError
        If it states something by name and nothing for this gyro.
    """
    if not isinstance(stated, Mapping):
        return stated
    if name not in stated:
        raise ValueError(
            f"{argument} is stated for {', '.join(stated) or 'none'} and not for gyro {name}"
        )
    return stated[name]


def _unit_for(name: str, unit: str | Mapping[str, str] | None, in_header: str | None) -> str:
    """Unit of a gyro: as stated, else as its header says."""
    if unit is None and in_header is None:
        raise ValueError(f"the unit of gyro {name} is not stated; state unit, deg/s for one")
    return in_header or "" if unit is None else stated_for(name, unit, "unit")


def _headers(frame: Any) -> list[str]:
    """Names of the columns of a frame, and of its coordinates if it has such."""
    return [str(name) for name in (*frame, *getattr(frame, "coords", ()))]


def _named_columns(
    frame: Any, columns: Mapping[str, str] | None, unit: str | Mapping[str, str] | None
) -> dict[str, str]:
    """Name wanted -> name in the frame, for all that are wanted or, without a wish, known.

    An accelerometer is known by its name only if its unit is stated, by itself or in its header.
    """
    headers = _headers(frame)
    if columns is not None:
        for name, header in columns.items():
            if header not in headers:
                raise ValueError(
                    f"columns[{name!r}] is {quoted(header)}; the frame has {', '.join(headers)}"
                )
        return dict(columns)
    wanted: Iterable[tuple[str, tuple[str, ...]]] = (
        *((name, (name,)) for name in (*GYRO_NAMES, *ACCELEROMETER_NAMES)),
        ("table", TABLE_NAMES),
        ("time", TIME_NAMES),
        (NULL_PULSE_NAME, (NULL_PULSE_NAME,)),
    )
    found = {}
    for name, names in wanted:
        alike = [header for header in headers if split_header(header)[0] in names]
        if len(alike) > 1:
            raise ValueError(
                f"{', '.join(alike)} may each be {name}; name one with columns={{{name!r}: NAME}}"
            )
        named = isinstance(unit, Mapping) and name in unit
        is_gyro = name not in ACCELEROMETER_NAMES
        if alike and (is_gyro or named or split_header(alike[0])[1] is not None):
            found[name] = alike[0]
    return found


# ---- columns -----------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class Conversion:
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
) -> Conversion:
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
        return Conversion(
            channel=Channel.from_values(name, values, kind=kind, unit=unit, sensor=sensor)
        )
    if kind != "angle":
        raise ValueError(
            f"period is {period:g} and gyro {name} of kind {kind}; only a counter of kind angle "
            "starts over"
        )
    if not 0.0 < period < np.inf:
        raise ValueError(f"period is {period}; give the reading at which the counter starts over")
    readings = np.asarray(numbers(values, name), dtype=np.float64)
    extent = finite_extent(readings)
    if extent >= period:
        raise RecordingError(
            f"it spans {extent:.6g}, more than a period of {period:.6g} holds",
            channel=name,
            remedy="state the right {period}",
        )
    running, wraps = unwrapped(readings, period)
    note = Note(text=f"the counter rolled over {counted(wraps, 'time')}: unwrapped", channel=name)
    angle = elementwise(np.multiply, running, unit_of(unit, "angle").size)
    channel = Channel(name=name, kind=kind, values=angle, shown_in=unit)
    return Conversion(channel=channel, notes=(note,) if wraps else ())


def table_of(values: ArrayLike, *, unit: str) -> Conversion:
    """The table of a column of encoder readings: missing ones filled, unwrapped.

    Raises
    ------
    ValueError
        If `unit` is not one of angle or the values are no column of numbers.
    """
    stated = unit_of(unit, "angle")
    readings = np.array(numbers(values, "table"), dtype=np.float64)
    taken = angle_of_readings(readings, stated)
    channel = Channel(name="table", kind="angle", values=taken.angle, shown_in=unit)
    return Conversion(channel=channel, notes=taken.notes)


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
    np.not_equal(levels, 0, out=rising)
    some = every(levels, max(1, levels.size // 100_000))
    if np.unique(some).size > 2 or not is_finite(levels):
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


# ---- lost readings -----------------------------------------------------------------

# Places that tell a gyro's share, seconds that each looks ahead, and the least share, as it is for
# a gyro that senses its table.
_PLACES: Final = 2000
_AHEAD: Final = 1.0
_LEAST_SHARE: Final = 0.05
# A gyro and the readings on both sides agree to this part of what was turned, and this angle; the
# readings may have started over meanwhile.
_AGREE: Final = 0.03
_AT_LEAST: Final = 0.1 * DEGREE
_TURN: Final = 2.0 * math.pi


def with_lost_readings(
    table: Conversion, gyros: Sequence[Channel], sample_rate: float
) -> Conversion:
    """The table with missing readings taken from the gyro that senses it most.

    Parameters
    ----------
    table
        (samples,) unwrapped, NaN where readings are missing.
    gyros
        Beside it.
    sample_rate
        Hz.

    Returns
    -------
    Conversion
        As it was if more than `LARGEST_SHARE_MISSING` are missing, if some are at either end, or
        if no gyro agrees with the readings on both sides.
    """
    values = table.channel.values
    if not values.size or math.isfinite(mean(values)):
        return table
    lost = Places(values=values, test=is_not_finite).all()
    firsts, lengths = runs(lost)
    inside = lost.size and lost[0] > 0 and lost[-1] < values.size - 1
    if not inside or lost.size > LARGEST_SHARE_MISSING * values.size:
        return table
    shares = {
        gyro.name: _share(angle_of(gyro, sample_rate), values, sample_rate)
        for gyro in gyros
        if math.isfinite(mean(gyro.values))
    }
    name = max(shares, key=lambda one: abs(shares[one]), default="")
    if not name or not abs(shares[name]) > _LEAST_SHARE:
        return table
    gyro = next(one for one in gyros if one.name == name)
    turned = angle_of(gyro, sample_rate)
    filled = _bridged(values, firsts, firsts + lengths, turned, shares[name])
    if filled is None:
        return table
    text = (
        f"{counted(int(lost.size), 'reading')} lost at {counted(int(firsts.size), 'place')}, the "
        f"longest for {lengths.max() / sample_rate:.3g} s, the first at "
        f"{firsts[0] / sample_rate:.3f} s: gyro {name} tells how the table turned meanwhile"
    )
    note = Note(name="lost", level="warning", channel="table", text=text)
    return replace(table, channel=replace(table.channel, values=filled), notes=(*table.notes, note))


def _share(angle: FloatArray, table: FloatArray, sample_rate: float) -> float:
    """Share of the table's rate that a gyro senses; 0 if nothing turns."""
    ahead = max(1, round(_AHEAD * sample_rate))
    if table.size <= ahead:
        return 0.0
    places = np.linspace(0, table.size - 1 - ahead, _PLACES).astype(np.int64)
    by_table = table[places + ahead] - table[places]
    by_gyro = angle[places + ahead] - angle[places]
    known = np.isfinite(by_table)
    if not known.any():
        return 0.0
    turning = known & (np.abs(by_table) > 0.2 * np.quantile(np.abs(by_table[known]), 0.9))
    return float(np.median(by_gyro[turning] / by_table[turning])) if turning.any() else 0.0


def _bridged(
    values: FloatArray, firsts: IntegerArray, afters: IntegerArray, turned: FloatArray, share: float
) -> FloatArray | None:
    """The table angle with its gaps bridged; None if a gyro does not agree with one."""
    filled = elementwise(np.add, values, 0.0)
    for first, after in zip(firsts.tolist(), afters.tolist(), strict=True):
        path = (turned[first - 1 : after + 1] - turned[first - 1]) / share
        gap = float(filled[after] - filled[first - 1])
        around = _TURN * round((float(path[-1]) - gap) / _TURN)
        rest = gap + around - float(path[-1])
        if abs(rest) > max(_AT_LEAST, _AGREE * abs(float(path[-1]))):
            return None
        if around:
            # What is behind was unwrapped without what passed meanwhile.
            filled[after:] += around
        tilt = rest * np.linspace(0.0, 1.0, path.size)
        filled[first:after] = filled[first - 1] + (path + tilt)[1:-1]
    return filled
