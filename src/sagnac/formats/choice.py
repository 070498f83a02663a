"""Which columns of a file are the gyros, the table, the time; of which kind and in which unit."""

import re
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Final, Literal

from sagnac.core import units
from sagnac.core.errors import Note, RecordingError
from sagnac.core.units import Sensor
from sagnac.formats.source import Column, Columns
from sagnac.formats.statement import Aspect, Statements, is_counts
from sagnac.recording.channel import KINDS, PICKOFF, Kind, quantity_of
from sagnac.recording.columns import GYRO_NAMES, NULL_PULSE_NAME, TEMPERATURE, USUAL_NAMES

# Characters of a list of columns that an error shows.
_MOST_LISTED: Final = 400
# Units of times that are written as text, which readers hand over in ns: of the clock, and dates
# with it.
TIME_FORMS: Final = ("clock", "iso")
_TIME_LIKE: Final = re.compile(
    r"(?i)(?:^|[^a-z])(?:time|timestamps?|stamps?|utc|zeit|uhrzeit|datetime|epoch)(?:$|[^a-z])"
    r"|^(?:t|sec|secs|seconds|X_Value)$|^time|time$|^t[_ ](?:s|ms|us|ns)$|^(?:milli|micro|nano)s"
)
# An encoder of a table that is not called as one is by itself.
_TABLE_LIKE: Final = re.compile(
    r"^enc|encod|table|^azim|^theta|^angle$|^phi$|drehtisch|^winkel$|rotary|^stage", re.IGNORECASE
)
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
                problem = "the column is named for two channels"
                remedy = "give each its own with {columns}, {table} and {time}"
                raise RecordingError(problem, channel=key, remedy=remedy)

    @property
    def sensors(self) -> list[tuple[Sensor, str, Column]]:
        """Gyros and accelerometers: what each is, the name wanted, and its column."""
        gyros: list[tuple[Sensor, str, Column]] = [("gyro", *one) for one in self.gyros.items()]
        return gyros + [("accelerometer", *one) for one in self.accelerometers.items()]

    @property
    def keys(self) -> tuple[str, ...]:
        """Names that the columns are loaded by: gyros and the rest, in this order."""
        sensed = (*self.gyros.values(), *self.accelerometers.values())
        beside = (self.table, self.time, self.null_pulse)
        taken = (*sensed, *beside, *self.pickoffs.values(), self.temperature)
        return tuple(column.key for column in taken if column is not None)


def choose(columns: Columns, statements: Statements) -> Choice:
    """The columns that are taken, by what is stated and by their names.

    Raises
    ------
    RecordingError
        If a column is not there, or stands for two channels.
    """
    gyros = choose_gyros(columns, statements)
    accelerometers = stated_sensors(columns, statements, "accelerometers")
    taken = [column.key for column in (*gyros.values(), *accelerometers.values())]
    time, notes = choose_time(columns, statements, taken)
    table = choose_one(columns, statements, "table", taken)
    if table is None and statements.role("table") is None:
        others = {*taken, time.key if time else ""}
        for one in columns:
            if one.key not in others and is_like_table(one):
                # A number goes through a shell as it is, whatever the name.
                name = one.name if one.name.isidentifier() else one.number or one.name
                problem = f"column {one.key} looks like the table's angle and is not taken"
                text = f"{problem}; {{table {name}:{one.unit or 'UNIT'}}} takes it"
                notes = (*notes, Note(channel="table", text=text))
    pickoffs = {gyro: choose_one(columns, statements, PICKOFF + gyro) for gyro in gyros}
    return Choice(
        gyros=gyros,
        accelerometers=accelerometers,
        pickoffs={gyro: column for gyro, column in pickoffs.items() if column is not None},
        table=table,
        time=time,
        null_pulse=choose_one(columns, statements, NULL_PULSE_NAME),
        temperature=choose_one(columns, statements, TEMPERATURE),
        notes=notes,
    )


def find(columns: Columns, name: str) -> Column | None:
    """The column of that full name; else the only one of that name without a unit; else by number.

    Raises
    ------
    RecordingError
        If several have that name.
    """
    alike = [column for column in columns if column.key == name][:1]
    alike = alike or [column for column in columns if column.name == name]
    if len(alike) > 1:
        problem = f"more than one column has this name, {', '.join(one.key for one in alike)}"
        raise RecordingError(problem, channel=name, remedy="give the full name with {columns}")
    if not alike and name.isdecimal():
        alike = [column for column in columns if column.number == int(name)]
    return alike[0] if alike else None


def _named(columns: Columns, name: str, inputs: str) -> Column:
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
    remedy = f"name one with {inputs}"
    raise RecordingError(f"no such column; the file has {present}", channel=name, remedy=remedy)


def choose_gyros(columns: Columns, statements: Statements) -> dict[str, Column]:
    """The gyros that are stated, else those of ``x``, ``y`` and ``z`` that there are.

    Raises
    ------
    RecordingError
        If one that is stated is not there, or there is none.
    """
    if statements.gyros:
        return stated_sensors(columns, statements, "gyros")
    usual = {name: column for name in GYRO_NAMES if (column := find(columns, name)) is not None}
    if not usual:
        inputs = "{columns x=COLUMN} or {gyros COLUMN}, as sagnac check suggests"
        _named(columns, ", ".join(GYRO_NAMES), inputs)
    return usual


def stated_sensors(columns: Columns, statements: Statements, which: str) -> dict[str, Column]:
    """The ``gyros`` or ``accelerometers`` that are stated.

    Raises
    ------
    RecordingError
        If one is not there.
    """
    names, inputs = getattr(statements, which), f"{{{which}}} or {{columns NAME=COLUMN}}"
    return {name: _named(columns, statements.column(name) or name, inputs) for name in names}


def choose_one(
    columns: Columns, statements: Statements, role: str, taken: Collection[str] = ()
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
    columns: Columns, statements: Statements, taken: Collection[str] = ()
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
    fact = "has no unit and is left out, the rate is stated"
    texts = [f"column {one.key} {fact}; {{time {one.key}:UNIT}} takes it" for one in left_out]
    if first is None:
        # The only column of times by its unit, where no rate is stated; else an offer of each.
        others = {*taken, *(one.key for one in left_out)}
        like = [one for one in columns if one.key not in others and is_like_time(one)]
        sure = [one for one in like if one.unit is not None]
        if is_rated:
            fact = "looks like time stamps and is not taken, the rate is stated"
            for one in like:
                takes = f"{{time {one.name}:{one.unit or 'UNIT'}}} takes it"
                texts.append(f"column {one.key} {fact}; {takes} and shows samples that are missing")
        elif len(sure) == 1:
            (first,) = sure
            texts.append(f"column {first.key} is taken as the time")
    return first, tuple(Note(channel="time", text=text) for text in texts)


def _possible(
    columns: Columns, statements: Statements, role: str, taken: Collection[str]
) -> Iterator[Column]:
    """Columns of a role: the one stated as ``COLUMN`` or ``COLUMN:UNIT``, else of usual names.

    Raises
    ------
    RecordingError
        If the one that is stated is not there.
    """
    stated, unit = statements.role(role), statements.own_unit(role)
    if stated is None:
        # No name alone makes a column the temperature of the unit.
        for name in {**USUAL_NAMES, TEMPERATURE: ()}.get(role, (role,)):
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
        held = f"times as text, not numbers in {unit}"
        remedy = f"state {{time {column.key}:{column.unit}}}"
        if not is_text:
            held = "no times as text, such as 14:03:00.002 or 2024-03-05T14:03:00Z"
            remedy = f"write them so, or state {{time {column.key}:s}} if they are numbers"
        raise RecordingError(f"column {column.key} holds {held}", channel=role, remedy=remedy)
    return replace(column, unit=unit)


def is_time_unit(unit: str) -> bool:
    """Whether a unit is one of time, or says that times are written as text."""
    return units.canonical(unit) in units.TIME_UNITS or unit in TIME_FORMS


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


def is_like_table(column: Column) -> bool:
    """Whether a column looks like the angle of a table, by its name and unit.

    Examples
    --------
    >>> [is_like_table(Column(key=name, name=name)) for name in ("EncoderPos", "enc_time", "gx")]
    [True, False, False]
    """
    # One without a unit may be an angle.
    unit = "deg" if column.unit is None else column.unit
    may_be_angle = is_counts(unit) or units.split_factor(unit)[1] in units.ANGLE_UNITS
    return may_be_angle and not is_like_time(column) and bool(_TABLE_LIKE.search(column.name))


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


def require_known(choice: Choice, columns: Columns, statements: Statements) -> None:
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
    # What is stated of accelerometers is not heard if ax is read as a gyro.
    misread = not choice.accelerometers and bool({"ax", "ay", "az"} & set(choice.gyros))
    for quantity, roles in (("kind", ()), ("unit", ("table", "time"))):
        known = dict.fromkeys((*taken, "gyros", *["accelerometers"] * (not misread), *roles))
        for statement in (statements.caller, statements.beside):
            stated = getattr(statement, quantity)
            for name in stated if isinstance(stated, Mapping) else ():
                if name not in known and name not in others:
                    problem = f"its {quantity} is stated, and there is no such channel"
                    remedy = f"state {{{quantity}}} of {', '.join(known)}"
                    remedy += ", or name the {accelerometers}" if misread else ""
                    raise RecordingError(problem, channel=name, remedy=remedy)


def stated_for(
    quantity: Aspect, name: str, column: Column, statements: Statements, sensor: Sensor = "gyro"
) -> tuple[str | None, str | None, str | None]:
    """Kind or unit of a channel as caller, TOML, and its column or else the file state it."""
    caller, beside, file = (one.of_channel(quantity, name, sensor) for one in statements.in_order)
    return caller, beside, getattr(column, quantity) or file


def scale_of(name: str, column: Column, statements: Statements, sensor: Sensor = "gyro") -> Scale:
    """Kind and unit of a channel: as caller or TOML state it, else its column, else the file.

    The kind of an accelerometer is ``rate`` unless another is stated.

    Raises
    ------
    RecordingError
        If kind, unit or the size of a count is not stated, or they contradict each other.
    """
    by_kind = stated_for("kind", name, column, statements, sensor)
    by_unit = stated_for("unit", name, column, statements, sensor)
    stated, unit = (next(filter(None, one), None) for one in (by_kind, by_unit))
    of_one = "" if sensor == "gyro" else f"{name}="
    if stated is None and sensor == "accelerometer":
        stated = "rate"
    kind = next((one for one in KINDS if one == stated), None)
    if kind is None:
        problem = "its kind is not stated"
        if stated is not None:
            problem = f"the file says kind {stated!r}, which is none"
        remedy = f"state {{kind {of_one}{'|'.join(KINDS)}}}"
        raise RecordingError(problem, channel=name, remedy=remedy)
    scale = statements.first("scale") if sensor == "gyro" else None
    if scale is not None and not is_counts(unit or "counts"):
        problem = f"its unit {unit} and a scale per count contradict each other"
        remedy = "state {unit counts} and {scale}, or {unit} alone"
        raise RecordingError(problem, channel=name, remedy=remedy)
    if scale is None and sensor == "gyro" and is_counts(unit or ""):
        problem = "it is in counts and their size is not stated"
        size = "0.1deg/h" if kind == "rate" else "0.1arcsec"
        raise RecordingError(problem, channel=name, remedy=f"state {{scale {size}}}")
    unit, quantity = scale or unit, quantity_of(kind, sensor)
    usual = next(iter(units.sizes(quantity)))
    other = f"another of {quantity}" if sensor == "gyro" else "{unit gyros=deg/s,accelerometers=g}"
    remedy = f"state {{unit {of_one}{usual}}} or {other}, or the right {{kind}}"
    if scale is not None:
        remedy = "state the right {scale} or {kind}"
    elif unit is not None and not any(by_unit[:2]):
        # The file says it itself: the kind that was stated is the more likely fault.
        remedy = f"state the right {{kind}}, or {{unit {of_one}{usual}}} or {other}"
    if sensor == "accelerometer" and kind == "rate" and unit in units.VELOCITY_UNITS:
        # A kind without a name is that of the gyros alone.
        remedy = "state {kind gyros=increment,accelerometers=increment}, or the right {unit}"
    known_unit(name, unit, quantity, remedy)
    notes = [
        contradiction(by_file, caller or beside or "", is_typed=caller is not None, channel=name)
        for caller, beside, by_file in (by_unit, by_kind)
        if by_file and units.canonical(caller or beside or by_file) != units.canonical(by_file)
    ]
    named = None if by_unit[2] else unit_in_name(column.name, quantity)
    factor, taken = units.split_factor(unit or "")
    # A number before a unit is the size of a count, which no name tells.
    if named and factor == 1.0 and units.UNITS[taken].size != units.UNITS[named].size:
        text = f"its column {column.name} is named as in {named}, and is taken as {unit} as stated"
        notes.append(Note(name="units", channel=name, text=text, level="warning"))
    return Scale(kind=kind, unit=unit or "", notes=tuple(notes))


def unit_in_name(name: str, quantity: units.Quantity) -> str | None:
    """The unit of a quantity that a name ends on after another word, None if it ends on none.

    Examples
    --------
    >>> unit_in_name("gx_dps", "rate"), unit_in_name("gyro_x", "rate")
    ('deg/s', None)
    """
    words = re.findall(r"[^\W_]+", re.sub(r"\.\d+$|(?<=_)per_", "", name))
    ends = [units.canonical("/".join(words[-count:])) for count in (2, 1) if len(words) > count]
    # A turn is a word as well.
    return next((one for one in ends if one in units.sizes(quantity) and one != "rev"), None)


def contradiction(by_file: str, taken: str, *, is_typed: bool, channel: str = "") -> Note:
    """The file states something else than is taken.

    What is typed may be of another file, and so may a TOML beside: a warning.
    """
    text = f"the file says {by_file}, taken as {taken} as stated"
    if not is_typed:
        problem = f"the file says {by_file} and the TOML beside it {taken}, which is taken"
        text = f"{problem}; remove the TOML if it is of another recording"
    return Note(name="units", channel=channel, text=text, level="warning")


def role_unit(role: Literal["table", "time"], column: Column) -> units.Unit:
    """Unit of the table angle, or of the time stamps.

    Raises
    ------
    RecordingError
        If none is stated, or it is one of something else.
    """
    quantity, usual = ("angle", "deg") if role == "table" else ("time", "s")
    if is_counts(column.unit or ""):
        # What a count is worth stands before its unit.
        usual = f"0.01{usual}"
    remedy = f"state {{{role} {column.key}:{usual}}}, or leave it out with {{{role} none}}"
    return known_unit(role, "ns" if column.unit in TIME_FORMS else column.unit, quantity, remedy)


def known_unit(channel: str, unit: str | None, quantity: units.Quantity, remedy: str) -> units.Unit:
    """The unit that is stated of a channel.

    Raises
    ------
    RecordingError
        If there is none, or it is none of the quantity.
    """
    if unit is None:
        raise RecordingError("its unit is not stated", channel=channel, remedy=remedy)
    try:
        return units.unit_of(unit, quantity)
    except ValueError:
        problem = f"unit {unit!r} is not one of {quantity}"
        raise RecordingError(problem, channel=channel, remedy=remedy) from None
