"""Statements of a caller, of a TOML beside the file, or of the file about its columns.

All three speak one vocabulary, that of `Statement`, and are heard in this order. Units are as
people and files write them, counts among them: ``0.1arcsec``, ``counts``.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, fields
from pathlib import Path
from types import NoneType
from typing import Any, Final, Literal, TypedDict

from sagnac.core import documents, texts, units
from sagnac.core.errors import Note, RecordingError, one_line, quoted, refusal, require_type
from sagnac.core.overwriting import Outputs
from sagnac.formats.files import about
from sagnac.formats.registry import CSV, EUROC, EUROC_SENSOR
from sagnac.recording.channel import KINDS, PICKOFF
from sagnac.recording.columns import ACCELEROMETER_NAMES, GYRO_NAMES, TEMPERATURE

# ---- unit text ---------------------------------------------------------------------

_QUANTITIES: Final = ("angle", "rate", "velocity", "acceleration", "time")
_OF_GYROS: Final = ", ".join((*units.ANGLE_UNITS, *units.RATE_UNITS))
_OF_FORCES: Final = ", ".join((*units.ACCELERATION_UNITS, *units.VELOCITY_UNITS))
_UNITS: Final = f"use one of {_OF_GYROS} or counts; of accelerometers {_OF_FORCES}"
_COUNTS: Final = frozenset(
    {"count", "counts", "lsb", "pulse", "pulses", "digit", "digits", "tick", "ticks", "zähler"}
)


def is_counts(unit: str) -> bool:
    """Whether a unit is one count, its size not stated."""
    factor, name = units.split_factor(unit)
    return factor == 1.0 and name.lower() in _COUNTS


def is_size(unit: str) -> bool:
    """Whether a text is a unit of a gyro, an accelerometer or time, or a number of them."""
    factor, name = units.split_factor(unit)
    return factor > 0.0 and name in units.UNITS and units.UNITS[name].quantity in _QUANTITIES


def is_known(unit: str) -> bool:
    """The same, or one count.

    Examples
    --------
    >>> is_known("0.1arcsec"), is_known("counts"), is_known("furlong")
    (True, True, False)
    """
    return is_counts(unit) or is_size(unit)


# ---- statement ---------------------------------------------------------------------

COUNTER_BITS: Final = range(8, 49)
# Columns that are no gyros, by the names that `Statement.columns` has for them.
ROLES: Final = ("time", "table", "null_pulse")
# What is stated of each channel by itself.
Aspect = Literal["kind", "unit"]


class StatementFields(TypedDict, total=False):
    """The fields of a `Statement` as keywords, for editors and type checkers."""

    gyros: Sequence[str]
    kind: str | Mapping[str, str] | None
    unit: str | Mapping[str, str] | None
    scale: str | None
    sample_rate: float | None
    time: str | None
    table: str | None
    columns: Mapping[str, str]
    span: tuple[float | None, float | None] | None
    counter_bits: int | None
    counter_period: float | None
    null_pulse: str | None
    layout: str | Mapping[str, Any] | None
    accelerometers: Sequence[str]


@dataclass(frozen=True, slots=True, kw_only=True)
class Statement:
    """Facts about a recording besides its numbers. Nothing has a default.

    Attributes
    ----------
    gyros
        Names of the gyros wanted, or None for all there are.
    kind
        ``angle``, ``increment`` or ``rate``; one for all gyros, or by gyro name (``gyros`` for
        all that have none of their own).
    unit
        Unit of the gyros, or unit by name (``gyros``, ``table`` and ``time`` may stand there too).
        ``counts`` asks for `scale`; ``0.1arcsec`` states both at once.
    scale
        Size of one count: ``0.1arcsec``.
    sample_rate
        Samples per second. Where there are time stamps they rule, and this has to agree.
    time
        ``COLUMN`` or ``COLUMN:UNIT`` of the time stamps; ``none`` ignores those there are.
    table
        ``COLUMN`` or ``COLUMN:UNIT`` of the table angle; ``none`` ignores the one there is.
    columns
        Name wanted -> name in the file.
    span
        Start and stop to take, s from the first sample; either may be None.
    counter_bits
        Width of gyro counters that roll over (kind ``angle``), 8 to 48.
    counter_period
        Counts after which they start over, if that is no power of two: 1296000. One of both.
    null_pulse
        Column that is nonzero at the null pulse; ``none`` ignores the one there is.
    accelerometers
        Names of the accelerometers wanted; ``("none",)`` for none of those that the file states,
        None for these. Their units stand in `unit` by name, or for all of them under
        ``accelerometers``; a unit for all channels is that of the gyros. So does their kind,
        ``rate`` unless stated: mean specific force over the sample interval.
    layout
        How the records of a binary file are laid out: the name of a preset, the path of a TOML,
        or its table.

    Raises
    ------
    ValueError
        If a value cannot be; the message has the argument, the value and the choices.

    Examples
    --------
    >>> Statement(kind="angle", unit={"x": "arcsec", "table": "deg"}).kind
    'angle'
    >>> Statement(kind="angel")
    Traceback (most recent call last):
        ...
    sagnac.core.errors.ArgumentError: kind is 'angel'; use one of angle, increment, rate
    """

    gyros: tuple[str, ...] | None = None
    kind: str | Mapping[str, str] | None = None
    unit: str | Mapping[str, str] | None = None
    scale: str | None = None
    sample_rate: float | None = None
    time: str | None = None
    table: str | None = None
    columns: Mapping[str, str] = field(default_factory=dict)
    span: tuple[float | None, float | None] | None = None
    counter_bits: int | None = None
    counter_period: float | None = None
    null_pulse: str | None = None
    layout: str | Mapping[str, Any] | None = None
    accelerometers: tuple[str, ...] | None = None

    def __post_init__(self) -> None:
        """Refuse what cannot be, before any file is touched."""
        for name, is_right, remedy in _RULES:
            stated = getattr(self, name)
            is_by_name = name in ("kind", "unit") and isinstance(stated, Mapping)
            for value in stated.values() if is_by_name else (stated,):
                with suppress(TypeError, ValueError):
                    if value is None or is_right(value):
                        continue
                raise refusal(name, f"is {quoted(value)}; {remedy}")
        if self.counter_bits is not None and self.counter_period is not None:
            raise ValueError("counter_bits and a period are both given; give one of them")

    def of_channel(self, quantity: Aspect, name: str, sensor: units.Sensor = "gyro") -> str | None:
        """Statement of ``kind`` or ``unit`` of a channel: its own, or that of all of its sensor.

        One that names no channels is that of the gyros.

        Examples
        --------
        >>> stated = Statement(unit={"x": "deg/s", "accelerometers": "g"}, kind="rate")
        >>> stated.of_channel("unit", "ax", "accelerometer"), stated.of_channel("unit", "z")
        ('g', None)
        >>> stated.of_channel("kind", "z")
        'rate'
        """
        stated: str | Mapping[str, str] | None = getattr(self, quantity)
        if isinstance(stated, Mapping):
            return stated.get(name, stated.get(f"{sensor}s"))
        return stated if sensor == "gyro" else None


def _is_text(value: object) -> bool:
    return isinstance(value, str)


def _is_number(value: object) -> bool:
    # True is 1 to a program, not to a person.
    return isinstance(value, int | float) and not isinstance(value, bool)


def _are_names(names: tuple[object, ...]) -> bool:
    """Whether there is a name or more, all different and such as can be printed; not one text."""
    named = all(isinstance(name, str) and name and one_line(name) == name for name in names)
    return not isinstance(names, str) and bool(names) and named and len(set(names)) == len(names)


def _are_columns(columns: Mapping[str, str]) -> bool:
    are_texts = isinstance(columns, Mapping) and all(map(_is_text, columns.values()))
    return are_texts and (not columns or _are_names(tuple(columns)))


def _is_span(span: tuple[float | None, float | None]) -> bool:
    start, stop = (limit or 0.0 for limit in span)
    return 0.0 <= start < math.inf and (span[1] is None or start < stop < math.inf)


_COLUMNS: Final = "give name wanted -> name in the file, the names such as can be printed"
_SCALE: Final = "give the size of one count such as 0.1arcsec"
_RATE: Final = "give samples per second, above zero"
_NAMES: Final = "give one or more different names that can be printed, such as ('x', 'z')"
# Field of a statement, whether a value is right, and what to do about a wrong one.
_RULES: Final[tuple[tuple[str, Callable[[Any], bool], str], ...]] = (
    *((name, _is_text, "give text") for name in ("time", "table", "null_pulse")),
    *((name, _are_names, _NAMES) for name in ("gyros", "accelerometers")),
    ("columns", _are_columns, _COLUMNS),
    ("kind", lambda kind: _is_text(kind) and kind in KINDS, f"use one of {', '.join(KINDS)}"),
    ("unit", lambda unit: _is_text(unit) and is_known(unit), _UNITS),
    ("scale", lambda one: _is_text(one) and is_size(one), _SCALE),
    ("sample_rate", lambda rate: _is_number(rate) and 0.0 < rate < math.inf, _RATE),
    ("layout", lambda layout: isinstance(layout, str | Mapping), "give its TOML or a table"),
    ("span", _is_span, "give start and stop in s, not negative, the start below the stop"),
    ("counter_bits", lambda bits: bits in COUNTER_BITS, "give 8 to 48"),
    ("counter_period", lambda one: _is_number(one) and 2.0 <= one < 1e15, "give counts, 2 or more"),
)


def of_rates(rates: Sequence[str], forces: Sequence[str], time: str | None) -> Statement:
    """The statement of a file of rates: columns of x, y, z, of ax, ay, az if any, and of times."""
    columns = dict(zip((*GYRO_NAMES, *ACCELEROMETER_NAMES), (*rates, *forces), strict=False))
    own = ACCELEROMETER_NAMES if forces else None
    return Statement(kind="rate", columns=columns, gyros=GYRO_NAMES, accelerometers=own, time=time)


def one_statement(statement: Statement | None, stated: Mapping[str, Any]) -> Statement:
    """Statement of a caller, as a `Statement` or by its fields.

    Parameters
    ----------
    statement
        Or None.
    stated
        Field of `Statement` -> value.

    Raises
    ------
    ValueError
        If both are given, or a value cannot be.
    TypeError
        If there is no field of a name, or it is no statement.

    Examples
    --------
    >>> one_statement(None, {"kind": "rate"}).kind
    'rate'
    """
    if statement is not None and stated:
        fact = f"{', '.join(stated)} and a statement are given; state everything in one of the two"
        raise ValueError(fact)
    remedy = "give a Statement, or its fields by name"
    require_type("statement", statement, (Statement, NoneType), remedy)
    known = [item.name for item in fields(Statement)]
    if unknown := [name for name in stated if name not in known]:
        raise TypeError(f"{unknown[0]!r} is nothing to state; use one of {', '.join(known)}")
    return statement or Statement(**stated)


# Keys of a TOML; a span is the caller's alone.
VOCABULARY: Final = frozenset(item.name for item in fields(Statement)) - {"span"}
# Attributes by which a file states something of itself.
ATTRIBUTES: Final = VOCABULARY - {"columns", "layout"}
# ``time`` and ``table`` are columns of a file in which every entry has a name.
ARRAYS_STATED: Final = ATTRIBUTES - {"time", "table"}


# ---- precedence --------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class Statements:
    """Statements of caller, TOML and file, heard in this order.

    Attributes
    ----------
    caller, beside, file
        The statements; those that are not there state nothing.
    """

    caller: Statement = field(default_factory=Statement)
    beside: Statement = field(default_factory=Statement)
    file: Statement = field(default_factory=Statement)

    @property
    def in_order(self) -> tuple[Statement, Statement, Statement]:
        """The one heard first comes first."""
        return self.caller, self.beside, self.file

    def first(self, name: str) -> Any:
        """The first that is stated for a field of `Statement`, None if none is, or no field."""
        stated = (getattr(statement, name, None) for statement in self.in_order)
        return next((value for value in stated if value is not None), None)

    @property
    def counter_period(self) -> float | None:
        """Counts after which gyro counters start over, or None where nothing is stated."""
        for one in self.in_order:
            if period := one.counter_period or (one.counter_bits and 2.0**one.counter_bits):
                return float(period)
        return None

    @property
    def gyros(self) -> tuple[str, ...]:
        """Names of the gyros wanted by the first that names any; empty where none does."""
        others = (*ROLES, TEMPERATURE, *self.accelerometers)
        for one in self.in_order:
            named = (name for name in one.columns if not name.startswith(PICKOFF))
            if names := one.gyros or tuple(name for name in named if name not in others):
                return names
        return ()

    @property
    def accelerometers(self) -> tuple[str, ...]:
        """Names of the accelerometers wanted by the first that says so; empty if there are none."""
        names: tuple[str, ...] = self.first("accelerometers") or ()
        return () if names == ("none",) else names

    def column(self, name: str) -> str | None:
        """The file's name for `name`, or None where none gives one."""
        return next((one.columns[name] for one in self.in_order if name in one.columns), None)

    def role(self, role: str) -> str | None:
        """The column stated for ``time``, ``table`` or another that is no gyro, or None."""
        return self.first(role) or self.column(role)

    def own_unit(self, name: str) -> str | None:
        """The unit stated for `name` alone; one for all gyros does not count."""
        stated = (one.unit for one in self.in_order if isinstance(one.unit, Mapping))
        return next((unit[name] for unit in stated if name in unit), None)


# ---- metadata ----------------------------------------------------------------------


def beside_paths(path: Path) -> tuple[Path, ...]:
    """Where a TOML beside a file may lie: ``run.csv.toml``, else ``run.toml``; of ``.`` nowhere."""
    if not path.name:
        return ()
    return path.with_name(path.name + ".toml"), path.with_suffix(".toml")


def beside(path: Path) -> tuple[Statement, tuple[Note, ...]]:
    """The statement in ``FILE.toml`` (``run.csv.toml``, else ``run.toml``), and notes on it.

    ``run.toml`` may be something else altogether, for example the simulation that made the file:
    it counts only if all its keys are those of a statement, and a note says so if not.

    Raises
    ------
    RecordingError
        If the TOML cannot be read or states what cannot be; its path is that of the TOML.
    """
    for candidate in beside_paths(path):
        if candidate == path or not candidate.is_file():
            continue
        try:
            content = documents.read_toml(candidate)
        except (OSError, ValueError) as error:
            why = f"cannot be read ({error.strerror})" if isinstance(error, OSError) else str(error)
            raise RecordingError(why, path=str(candidate), remedy="correct or remove it") from None
        unknown = sorted(set(content) - VOCABULARY)
        if unknown and candidate.name != path.name + ".toml":
            text = f"{candidate.name} is not about this file ({unknown[0]}): ignored"
            # Fields of records make a layout, which --layout names.
            return Statement(), () if "fields" in content else (Note(text=text),)
        with about(candidate):
            return from_mapping(content), ()
    return Statement(), ()


def from_mapping(content: Mapping[str, Any]) -> Statement:
    """A statement from TOML keys or file attributes.

    Attributes are flat: ``x,z`` stands for a list and ``x=arcsec,table=deg`` for a mapping.

    Raises
    ------
    RecordingError
        If a key is not of the vocabulary or a value cannot be.
    """
    if unknown := sorted(set(content) - VOCABULARY):
        known = ", ".join(sorted(VOCABULARY))
        raise RecordingError(f"{unknown[0]!r} is not known", remedy=f"use {known}")
    try:
        return Statement(**{key: _value(key, value) for key, value in content.items()})
    except (TypeError, ValueError) as error:
        why = " ".join(str(error).split())
        raise RecordingError(why, remedy="correct it there or state the option") from None


def by_attributes(attributes: Mapping[str, Any]) -> Statement:
    """The statement of a file about itself, in attributes that may hold other things, too.

    Raises
    ------
    RecordingError
        If a value cannot be.
    """
    return from_mapping({key: attributes[key] for key in attributes if key in ATTRIBUTES})


def _value(key: str, stated: Any) -> Any:
    """The value of a field of `Statement` from what stands in a TOML or an attribute."""
    if isinstance(stated, str):
        return texts.value_of(key, stated)
    if key in ("gyros", "accelerometers"):
        if not isinstance(stated, list | tuple):
            raise ValueError(f"{key} is {stated!r}; give names")
        return tuple(stated)
    is_whole = key == "counter_bits" and isinstance(stated, float) and stated.is_integer()
    return int(stated) if is_whole else stated


def of_simulation(path: Path) -> Outputs:
    """A simulated recording, its truth, and the TOML that a text needs."""
    truth = path.with_name(path.name + ".truth.json")
    return Outputs(paths=(path, truth, *_toml_of(path)), mark=truth, kind="truth")


def of_conversion(path: Path) -> Outputs:
    """A recording in another format, and the TOML that a text needs."""
    truth, beside = path.with_name(path.name + ".truth.json"), _toml_of(path)
    # One that a simulation made has its truth beside it, which would be of another recording.
    own = path / EUROC_SENSOR if path.suffix.lower() in EUROC.suffixes else path
    mark = truth if truth.exists() else (*beside, own)[0]
    return Outputs(paths=(path, *beside), mark=mark, kind="recording")


def _toml_of(path: Path) -> tuple[Path, ...]:
    """The TOML that says of a text what its columns are."""
    return (path.with_name(path.name + ".toml"),) if path.suffix.lower() in CSV.suffixes else ()
