"""Columns of a frame and what they are for: pandas, xarray, or a dictionary; none is imported."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Final, TypeVar

import numpy as np

from sagnac.errors import quoted
from sagnac.recording.channel import Kind
from sagnac.units import split_header

# What columns are called if nobody says otherwise.
GYRO_NAMES: Final = ("x", "y", "z")
ACCELEROMETER_NAMES: Final = ("ax", "ay", "az")
TABLE_NAMES: Final = ("table", "alpha", "encoder")
TIME_NAMES: Final = ("time", "t")
NULL_PULSE_NAME: Final = "null_pulse"
TEMPERATURE: Final = "temperature"

_Text = TypeVar("_Text", bound=str)


@dataclass(frozen=True, slots=True, kw_only=True)
class FrameColumns:
    """Columns of a frame that make a recording.

    Attributes
    ----------
    gyros
        Name -> column, of accelerometers, too.
    kind, unit
        One for all of them, or by name.
    times, table, null_pulse
        The column, or None.
    time_unit, table_unit
        As the headers state them, else ``s`` and ``deg``.
    """

    gyros: dict[str, Any]
    kind: Kind | Mapping[str, Kind]
    unit: Mapping[str, str]
    times: Any
    time_unit: str
    table: Any
    table_unit: str
    null_pulse: Any


def columns_of(
    frame: Any,
    columns: Mapping[str, str] | None,
    *,
    kind: Kind | Mapping[str, Kind] | None,
    unit: str | Mapping[str, str] | None,
    dates: bool,
) -> FrameColumns:
    """Find the columns of a recording in a frame.

    Parameters
    ----------
    frame
        What has columns by name.
    columns
        Name wanted -> name in the frame, or None for the columns of known names.
    kind, unit
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
    return FrameColumns(
        gyros={name: frame[found[name]] for name in gyros},
        kind=kind,
        unit={name: _unit_for(name, unit, stated[name]) for name in gyros},
        times=times,
        time_unit=stated.get("time") or "s",
        table=taken("table"),
        table_unit=stated.get("table") or "deg",
        null_pulse=taken(NULL_PULSE_NAME),
    )


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
    if unit is not None:
        return stated_for(name, unit, "unit")
    if in_header is None:
        raise ValueError(f"the unit of gyro {name} is not stated; state unit, deg/s for one")
    return in_header


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
        if alike and (name not in ACCELEROMETER_NAMES or _has_unit(name, alike[0], unit)):
            found[name] = alike[0]
    return found


def _has_unit(name: str, header: str, unit: str | Mapping[str, str] | None) -> bool:
    """Whether the unit of a column is stated by its own name or in its header."""
    return split_header(header)[1] is not None or (isinstance(unit, Mapping) and name in unit)
