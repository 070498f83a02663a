"""Columns of numbers taken as channels, pulses and seconds.

A frame whose columns are taken is one of pandas or xarray, or a dictionary; none is imported.
"""

import math
from collections.abc import Hashable, Mapping
from datetime import UTC, datetime
from types import NoneType
from typing import Any, Final, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from sagnac.core import arrays, errors, units
from sagnac.core.arrays import AnyArray, BooleanArray, FloatArray
from sagnac.core.errors import Note, RecordingError, counted, is_finite, quoted, refusal
from sagnac.recording.channel import Channel, Conversion, Kind, finite_extent, numbers, unwrapped

# ---- frames ------------------------------------------------------------------------

# What columns are called if nobody says otherwise.
GYRO_NAMES: Final = ("x", "y", "z")
ACCELEROMETER_NAMES: Final = ("ax", "ay", "az")
USUAL_NAMES: Final = {"table": ("table", "alpha", "encoder"), "time": ("time", "t")}
NULL_PULSE_NAME: Final = "null_pulse"
TEMPERATURE: Final = "temperature"

_Text = TypeVar("_Text", bound=str)


def columns_of(
    frame: Any, columns: Mapping[str, Hashable] | None, unit: str | Mapping[str, str] | None
) -> dict[str, Hashable]:
    """Name wanted -> name in the frame, for all that are wanted or, without a wish, known.

    An accelerometer is known by its name only if its unit is stated, by itself or in its header.

    Parameters
    ----------
    frame
        What has columns by name, and coordinates perhaps.
    columns
        Name wanted -> name in the frame, or None for the columns of known names.
    unit
        As stated, for all or by name.

    Raises
    ------
    TypeError
        If the frame, or `columns`, has no names.
    ValueError
        If a column is not there, two may be one that is wanted, or there is no gyro.
    """
    # What has a type of its numbers, as an array or one column, has no columns by name.
    if not hasattr(frame, "keys") or hasattr(type(frame), "dtype"):
        remedy = "give a frame of pandas or xarray, or a dictionary of columns"
        raise errors.ArgumentTypeError("frame", f"is {quoted(frame)}; {remedy}")
    remedy = "give {'x': NAME}, NAME in the frame"
    errors.require_type("columns", columns, (Mapping, NoneType), remedy)
    names = (*frame, *getattr(frame, "coords", ()))
    headers = [str(name) for name in names]
    # A frame made of an array has numbers for names, which may be wished for as a text, too.
    own = {**dict(zip(headers, names, strict=True)), **{name: name for name in names}}
    present, found = ", ".join(headers) or "no column", dict(columns or {})
    for name, header in found.items():
        if header not in list(own):
            raise ValueError(f"columns[{name!r}] is {quoted(header)}; the frame has {present}")
    wanted = {name: (name,) for name in (*GYRO_NAMES, *ACCELEROMETER_NAMES, NULL_PULSE_NAME)}
    for name, names in {**wanted, **USUAL_NAMES}.items() if columns is None else ():
        alike = [header for header in headers if units.split_header(header)[0] in names]
        if len(alike) > 1:
            remedy = f"name one with columns={{{name!r}: NAME}}"
            raise ValueError(f"{', '.join(alike)} may each be {name}; {remedy}")
        is_named = isinstance(unit, Mapping) and name in unit
        is_gyro = name not in ACCELEROMETER_NAMES
        if alike and (is_gyro or is_named or units.split_header(alike[0])[1] is not None):
            found[name] = alike[0]
    if not set(found) - {"table", "time", NULL_PULSE_NAME}:
        problem = f"the frame has no gyro; it has {present}: name one with columns={{'x': NAME}}"
        raise ValueError(problem)
    return {name: own[header] for name, header in found.items()}


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
        others = f", only that of {', '.join(stated)}" if stated else ""
        raise ValueError(f"the {argument} of gyro {name} is not stated{others}; state {argument}")
    return stated[name]


# ---- columns -----------------------------------------------------------------------


def gyro_of(
    name: str,
    values: ArrayLike,
    *,
    kind: Kind,
    unit: str,
    period: float | None = None,
    out: FloatArray | None = None,
    inputs: str = "{period}",
) -> Conversion:
    """A gyro of a column in a unit of the field; an accelerometer if the unit is one of force.

    Parameters
    ----------
    name
        Of the gyro.
    values
        (samples,) in `unit`.
    kind, unit, out
        See `Channel.from_values`.
    period
        Reading at which a counter of angle starts over, in `unit`; None if it never does.
        Accelerometers have none.
    inputs
        Those that state the period, for the message.

    Raises
    ------
    ValueError
        If an argument makes no sense.
    RecordingError
        If it cannot be such a counter: it is no angle, or spans more than that holds.
    """
    sensor, notes = units.sensor_of(unit), tuple[Note, ...]()
    if period is not None and sensor == "gyro":
        if kind != "angle":
            problem = f"a counter that starts over is an angle, not kind {kind}"
            remedy = f"state {{kind angle}}, or leave out {inputs}"
            raise RecordingError(problem, channel=name, remedy=remedy)
        if not (is_finite(period) and period > 0.0):
            remedy = "give the reading at which the counter starts over"
            raise refusal("period", f"is {quoted(period)}; {remedy}")
        readings = np.asarray(numbers(values, name), dtype=np.float64)
        extent = finite_extent(readings)
        if extent >= period:
            problem = f"it spans {extent:.6g}, more than a counter of {period:.9g} holds"
            raise RecordingError(problem, channel=name, remedy=f"state the right {inputs}")
        values, wraps = unwrapped(readings, period)
        bits = math.log2(period)
        counter = f"{bits:g} bit counter" if bits.is_integer() else f"counter of {period:.9g}"
        text = f"the {counter} rolled over {counted(wraps, 'time')}: unwrapped"
        notes = (Note(channel=name, text=text),) if wraps else ()
    channel = Channel.from_values(name, values, kind=kind, unit=unit, sensor=sensor, out=out)
    return Conversion(channel=channel, notes=notes)


def with_dates(values: ArrayLike) -> AnyArray:
    """An array of values; dates of Python or of a frame become those of numpy, in UTC.

    Examples
    --------
    >>> with_dates([datetime(2026, 1, 1, tzinfo=UTC)])
    array(['2026-01-01T00:00:00.000000'], dtype='datetime64[us]')
    """
    column = np.asarray(values)
    if not (column.dtype.kind == "O" and column.size and isinstance(column.flat[0], datetime)):
        return column
    if not isinstance(values, list | tuple | np.ndarray):
        # A frame knows its time zone, and parts of a microsecond.
        return np.asarray(values, dtype="datetime64[ns]")
    utc = [one.astimezone(UTC).replace(tzinfo=None) if one.tzinfo else one for one in column]
    return np.array(utc, dtype="datetime64[us]")


def seconds_of(values: ArrayLike, *, unit: str) -> FloatArray:
    """Time stamps in s from the first, shape (samples,).

    Integers, and dates, which state their own unit, lose nothing by the size of the epoch.

    Raises
    ------
    ValueError
        If `unit` is not one of time, or the values are no column of numbers or dates.
    """
    stamps = with_dates(values)
    if stamps.dtype.kind in "mM":
        if stamps.ndim != 1:
            raise refusal("times", f"has shape {stamps.shape}; give one column, shape (samples,)")
        return np.asarray((stamps - stamps[:1]) / np.timedelta64(1, "s"), dtype=np.float64)
    scale = units.unit_of(unit, "time", "time_unit").size
    column = numbers(values, "times")
    return np.asarray(column - column[:1], dtype=np.float64) * scale


def pulses_of(values: ArrayLike, *, column: str = "") -> tuple[BooleanArray, tuple[Note, ...]]:
    """First samples of pulses in a column of two levels, one of them 0, and what was noticed.

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
    some = arrays.every(levels, max(1, levels.size // 100_000))
    if np.unique(some).size > 2 or not arrays.all_finite(levels):
        problem = f"{f'column {column} ' if column else ''}takes more than two values"
        remedy = "name a column of 0 and 1 with {null-pulse}"
        raise RecordingError(problem, channel="null_pulse", remedy=remedy)
    high = levels != 0
    rising = high.copy()
    rising[1:] &= ~high[:-1]
    if np.array_equal(rising, high):
        return rising, ()
    text = "stays up for more than a sample; its first is taken"
    return rising, (Note(text=text, channel="null_pulse"),)
