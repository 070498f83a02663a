"""Statements of a caller, of a TOML beside the file, or of the file about its columns.

All three speak one vocabulary, that of `Statement`.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any, Final

from sagnac.errors import one_line, quoted
from sagnac.formats.unit_text import KNOWN_UNITS, parsed_unit
from sagnac.recording.channel import KINDS

COUNTER_BITS: Final = range(8, 49)
# Columns that are no gyros, by the names that `Statement.columns` has for them.
ROLES: Final = ("time", "table", "null_pulse")


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
        Column that is nonzero at the null pulse.
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
    ValueError: kind is 'angel'; use one of angle, increment, rate
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
        _check_texts(self)
        _check_kind(self.kind)
        _check_unit(self.unit)
        _check_scale(self.scale)
        _check_sample_rate(self.sample_rate)
        _check_names("gyros", self.gyros)
        _check_names("columns", tuple(self.columns) or None)
        _check_names("accelerometers", self.accelerometers)
        _check_span(self.span)
        if self.counter_bits is not None and self.counter_bits not in COUNTER_BITS:
            raise ValueError(f"counter_bits is {quoted(self.counter_bits)}; give 8 to 48")
        _check_counter_period(self.counter_period)
        if self.counter_bits is not None and self.counter_period is not None:
            raise ValueError("counter_bits and counter_period are both given; give one of them")


def _check_counter_period(period: object) -> None:
    if period is None:
        return
    if isinstance(period, bool) or not isinstance(period, int | float) or not 2.0 <= period < 1e15:
        raise ValueError(f"counter_period is {quoted(period)}; give counts, 2 or more")


def _check_texts(statement: Statement) -> None:
    for name in ("scale", "time", "table", "null_pulse"):
        value = getattr(statement, name)
        if value is not None and not isinstance(value, str):
            raise ValueError(f"{name} is {quoted(value)}; give text")
    if not isinstance(statement.columns, Mapping) or not all(
        isinstance(name, str) for name in _values(statement.columns)
    ):
        raise ValueError(
            f"columns is {quoted(statement.columns)}; give name wanted -> name in the file"
        )


def _check_kind(kind: str | Mapping[str, str] | None) -> None:
    for one in _values(kind):
        if not isinstance(one, str) or one not in KINDS:
            raise ValueError(f"kind is {quoted(one)}; use one of {', '.join(KINDS)}")


def _check_unit(unit: str | Mapping[str, str] | None) -> None:
    for one in _values(unit):
        if not isinstance(one, str) or not parsed_unit(one).is_known:
            raise ValueError(f"unit is {quoted(one)}; {KNOWN_UNITS}")


def _check_scale(scale: str | None) -> None:
    if scale is not None:
        unit = parsed_unit(scale)
        if unit.is_counts or not unit.is_known:
            raise ValueError(
                f"scale is {quoted(scale)}; give the size of one count such as 0.1arcsec"
            )


def _check_sample_rate(sample_rate: float | None) -> None:
    if sample_rate is None:
        return
    # True is 1 to a program, not to a person.
    number = isinstance(sample_rate, int | float) and not isinstance(sample_rate, bool)
    if not number or not (math.isfinite(sample_rate) and sample_rate > 0.0):
        raise ValueError(
            f"sample_rate is {quoted(sample_rate)}; give samples per second, above zero"
        )


def _check_names(argument: str, names: tuple[str, ...] | None) -> None:
    if names is None:
        return
    named = all(isinstance(name, str) and name and one_line(name) == name for name in names)
    if not names or not named or len(set(names)) < len(names):
        raise ValueError(
            f"{argument} is {quoted(names)}; give one or more different names that can be printed"
        )


def _check_span(span: tuple[float | None, float | None] | None) -> None:
    if span is None:
        return
    start, stop = span
    for limit in (start, stop):
        if limit is not None and not (math.isfinite(limit) and limit >= 0.0):
            raise ValueError(f"span has the limit {limit!r}; give times in s, not negative")
    if stop is not None and stop <= (start or 0.0):
        raise ValueError(f"span is {start or 0.0:g}:{stop:g}; its start must be below its stop")


def _values(stated: str | Mapping[str, str] | None) -> tuple[str, ...]:
    if stated is None:
        return ()
    return tuple(stated.values()) if isinstance(stated, Mapping) else (stated,)


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
        If there is no field of a name.

    Examples
    --------
    >>> one_statement(None, {"kind": "rate"}).kind
    'rate'
    """
    if statement is not None and stated:
        raise ValueError(
            f"{', '.join(stated)} and a statement are given; state everything in one of the two"
        )
    known = [item.name for item in fields(Statement)]
    for name in stated:
        if name not in known:
            raise TypeError(f"{name!r} is nothing to state; use one of {', '.join(known)}")
    return statement or Statement(**stated)


def vocabulary() -> frozenset[str]:
    """Keys that a TOML or the attributes of a file may have; a span is the caller's alone."""
    return frozenset(item.name for item in fields(Statement)) - {"span"}


def of_name(stated: str | Mapping[str, str] | None, name: str) -> str | None:
    """Entry of a statement for gyro `name`: its own, or the one for all (``gyros``)."""
    if stated is None or isinstance(stated, str):
        return stated
    return stated.get(name, stated.get("gyros"))
