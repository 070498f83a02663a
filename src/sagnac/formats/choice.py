"""Which columns of a file are the gyros, their pick-offs, the table, the time, the null pulse."""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Final

from sagnac.core.errors import Note, RecordingError
from sagnac.core.units import TIME_UNITS, Sensor, canonical
from sagnac.formats.source import Column
from sagnac.formats.statement import Statements
from sagnac.recording.channel import PICKOFF
from sagnac.recording.columns import (
    GYRO_NAMES,
    NULL_PULSE_NAME,
    TABLE_NAMES,
    TEMPERATURE,
    TIME_NAMES,
)

# Characters of a list of columns that an error shows.
_MOST_LISTED: Final = 400
# Units of times that are written as text, which readers hand over in ns: of the clock, and dates
# with it.
TIME_FORMS: Final = ("clock", "iso")
_TIME_LIKE: Final = re.compile(
    r"(?:^|[^a-z])(?:time|timestamps?|stamps?|utc|zeit|uhrzeit|datetime|epoch)(?:$|[^a-z])"
    r"|^(?:t|sec|secs|seconds|X_Value)$|^time|time$",
    re.IGNORECASE,
)
# Role of a column -> the names that it usually has, its own unless listed. No name alone makes a
# column the temperature of the unit.
_USUAL_NAMES: Final = {"table": TABLE_NAMES, "time": TIME_NAMES, TEMPERATURE: ()}
# Roles with an input of their own, by which a column of it is stated.
_INPUTS: Final = {
    "table": "{table COLUMN:UNIT}",
    "time": "{time COLUMN:UNIT}",
    NULL_PULSE_NAME: "{null-pulse COLUMN}",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Choice:
    """The columns that are taken.

    Attributes
    ----------
    gyros, accelerometers
        Name wanted -> column.
    pickoffs
        Name of a dithered gyro -> column of its pick-off.
    table, time
        With the unit that is stated of them; None where there is none, or none is wanted.
    null_pulse, temperature
        None where there is none.
    notes
        What was left out.
    """

    gyros: Mapping[str, Column]
    accelerometers: Mapping[str, Column] = field(default_factory=dict)
    pickoffs: Mapping[str, Column] = field(default_factory=dict)
    table: Column | None = None
    time: Column | None = None
    null_pulse: Column | None = None
    temperature: Column | None = None
    notes: tuple[Note, ...] = ()

    def __post_init__(self) -> None:
        keys = self.keys
        for key in keys:
            if keys.count(key) > 1:
                raise RecordingError(
                    "the column is named for two channels",
                    channel=key,
                    remedy="give each its own with {columns}, {table} and {time}",
                )

    @property
    def sensors(self) -> dict[Sensor, Mapping[str, Column]]:
        """Gyros and accelerometers: name wanted -> column of each."""
        return {"gyro": self.gyros, "accelerometer": self.accelerometers}

    @property
    def keys(self) -> tuple[str, ...]:
        """Names that the columns are loaded by: gyros and the rest, in this order."""
        sensed = (*self.gyros.values(), *self.accelerometers.values())
        beside = (self.table, self.time, self.null_pulse)
        taken = (*sensed, *beside, *self.pickoffs.values(), self.temperature)
        return tuple(column.key for column in taken if column is not None)


def choose(columns: Sequence[Column], statements: Statements) -> Choice:
    """The columns that are taken, by what is stated and by their names.

    Raises
    ------
    RecordingError
        If a column is not there, or stands for two channels.
    """
    gyros = choose_gyros(columns, statements)
    accelerometers = choose_accelerometers(columns, statements)
    taken = frozenset(column.key for column in (*gyros.values(), *accelerometers.values()))
    time, notes = choose_time(columns, statements, taken)
    pickoffs = {gyro: choose_one(columns, statements, PICKOFF + gyro) for gyro in gyros}
    return Choice(
        gyros=gyros,
        accelerometers=accelerometers,
        pickoffs={gyro: column for gyro, column in pickoffs.items() if column is not None},
        table=choose_one(columns, statements, "table", taken),
        time=time,
        null_pulse=choose_one(columns, statements, NULL_PULSE_NAME),
        temperature=choose_one(columns, statements, TEMPERATURE),
        notes=notes,
    )


def find(columns: Sequence[Column], name: str) -> Column | None:
    """The column of that full name, else the only one of that name without its unit, or number.

    Raises
    ------
    RecordingError
        If several have that name.
    """
    for column in columns:
        if column.key == name:
            return column
    alike = [column for column in columns if column.name == name]
    if len(alike) > 1:
        keys = ", ".join(column.key for column in alike)
        raise RecordingError(
            f"more than one column has this name, {keys}",
            channel=name,
            remedy="give the full name with {columns}",
        )
    if not alike and name.isdecimal():
        alike = [column for column in columns if column.number == int(name)]
    return alike[0] if alike else None


def _named(columns: Sequence[Column], name: str, inputs: str) -> Column:
    """The column of a name that is stated by `inputs`.

    Raises
    ------
    RecordingError
        If it is not there.
    """
    column = find(columns, name)
    if column is not None:
        return column
    present = ", ".join(column.key for column in columns) or "no numeric column"
    if len(present) > _MOST_LISTED:
        present = present[:_MOST_LISTED] + " ..."
    raise RecordingError(
        f"no such column; the file has {present}", channel=name, remedy=f"name one with {inputs}"
    )


def choose_gyros(columns: Sequence[Column], statements: Statements) -> dict[str, Column]:
    """The gyros that are stated, else those of ``x``, ``y`` and ``z`` that there are.

    Raises
    ------
    RecordingError
        If one that is stated is not there, or there is none.
    """
    if statements.gyros:
        return _stated(columns, statements, statements.gyros, "{gyros}")
    usual = {name: column for name in GYRO_NAMES if (column := find(columns, name)) is not None}
    # If none is there, the error names all three.
    return usual or _stated(columns, statements, [", ".join(GYRO_NAMES)], "{gyros}")


def choose_accelerometers(columns: Sequence[Column], statements: Statements) -> dict[str, Column]:
    """The accelerometers that are stated.

    Raises
    ------
    RecordingError
        If one is not there.
    """
    return _stated(columns, statements, statements.accelerometers, "{accelerometers}")


def _stated(
    columns: Sequence[Column], statements: Statements, names: Iterable[str], option: str
) -> dict[str, Column]:
    inputs = f"{option} or {{columns NAME=COLUMN}}"
    return {name: _named(columns, statements.column(name) or name, inputs) for name in names}


def choose_one(
    columns: Sequence[Column],
    statements: Statements,
    role: str,
    taken: frozenset[str] = frozenset(),
) -> Column | None:
    """The column of a role: the one stated, else the first of a usual name that is not `taken`.

    Parameters
    ----------
    columns
        Of the file.
    statements
        Of caller, TOML and file.
    role
        ``table``, ``null_pulse``, ``temperature``, or ``pickoff_`` and a gyro.
    taken
        Keys of columns that are something else.

    Raises
    ------
    RecordingError
        If one that is stated is not there.
    """
    return next(_possible(columns, statements, role, taken), None)


def choose_time(
    columns: Sequence[Column], statements: Statements, taken: frozenset[str]
) -> tuple[Column | None, tuple[Note, ...]]:
    """The time stamps, and notes: the column stated, else the first of a usual name not `taken`.

    Stamps without a unit are left out, with a note, if a sample rate is stated.

    Raises
    ------
    RecordingError
        If one that is stated is not there.
    """
    possible = _possible(columns, statements, "time", taken)
    is_rated = statements.first("sample_rate") is not None
    if statements.role("time") is not None:
        return next(possible, None), ()
    left_out: list[Column] = []
    first = None
    while first is None and (one := next(possible, None)) is not None:
        if one.unit is not None or not is_rated:
            first = one
        else:
            left_out.append(one)
    texts = [
        f"column {one.key} has no unit and is left out, the rate is stated; "
        f"{{time {one.key}:UNIT}} takes it"
        for one in left_out
    ]
    if first is None:
        # The only column of times by its unit, where no rate is stated; else an offer of each.
        others = {*taken, *(one.key for one in left_out)}
        like = [one for one in columns if one.key not in others and is_like_time(one)]
        sure = [one for one in like if one.unit is not None]
        if is_rated:
            texts += [
                f"column {one.key} looks like time stamps and is not taken, the rate is stated; "
                f"{{time {one.name}:{one.unit or 'UNIT'}}} takes it and shows samples that are "
                "missing"
                for one in like
            ]
        elif len(sure) == 1:
            (first,) = sure
            texts.append(f"column {first.key} is taken as the time")
    return first, tuple(Note(channel="time", text=text) for text in texts)


def _possible(
    columns: Sequence[Column], statements: Statements, role: str, taken: frozenset[str]
) -> Iterator[Column]:
    """Columns of a role: the one stated as ``COLUMN`` or ``COLUMN:UNIT``, else of usual names.

    Raises
    ------
    RecordingError
        If the one that is stated is not there.
    """
    stated, unit = statements.role(role), statements.own_unit(role)
    if stated is None:
        for name in _USUAL_NAMES.get(role, (role,)):
            column = find(columns, name)
            if column is not None and column.key not in taken:
                yield _in_unit(column, role, unit)
    elif stated != "none":
        if role in ("table", "time") and ":" in stated and find(columns, stated) is None:
            stated, _, unit = stated.rpartition(":")
        inputs = _INPUTS.get(role, f"{{columns {role}=COLUMN}}")
        yield _in_unit(_named(columns, stated, inputs), role, unit)


def _in_unit(column: Column, role: str, unit: str | None) -> Column:
    """A column in the unit that is stated of it, if one is.

    Raises
    ------
    RecordingError
        If it holds times as text, and the unit is another one, or the other way round.
    """
    if unit is None or unit == column.unit:
        return column
    is_text = column.unit in TIME_FORMS
    if role == "time" and (is_text or unit in TIME_FORMS):
        held = f"times as text, not numbers in {unit}" if is_text else "numbers, not times as text"
        raise RecordingError(
            f"column {column.key} holds {held}",
            channel=role,
            remedy=f"state {{time {column.key}:{column.unit if is_text else 's'}}}",
        )
    return replace(column, unit=unit)


def is_time_unit(unit: str) -> bool:
    """Whether a unit is one of time, or says that times are written as text."""
    return canonical(unit) in TIME_UNITS or unit in TIME_FORMS


def is_like_time(column: Column) -> bool:
    """Whether a column looks like one of times, by its name or unit.

    Examples
    --------
    >>> [is_like_time(Column(key=name, name=name)) for name in ("Timestamp", "gps_time", "rate")]
    [True, True, False]
    """
    if column.unit is not None:
        return is_time_unit(column.unit)
    return _TIME_LIKE.search(column.name) is not None
