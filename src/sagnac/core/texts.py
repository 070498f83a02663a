"""Inputs as text, in the words of the command line: from text to value, and back.

The command line, a page, a TOML and the attributes of a file all state inputs so: ``x,z`` for
names, ``x=rate,z=angle`` one by one, ``630:930`` for a span, ``100ms`` for a time.
"""

import json
import re
from collections.abc import Callable, Mapping
from functools import wraps
from typing import Any, Final, TypeVar

from sagnac.core.errors import one_line, refusal, require_type
from sagnac.core.units import unit_of

Value = TypeVar("Value")
Span = tuple[float | None, float | None]

OPTION_OF: Final = {
    "sample_rate": "rate",
    "span": "slice",
    "accepted": "accept",
    "estimators": "estimator",
    "specification": "spec",
    "tool": "format",
}
"""Inputs of the library that the command line calls otherwise."""


def by_axis(named: Mapping[str, Value]) -> dict[str, Value]:
    """Sensors by the axis that the last letter of each name tells, else those called x, ay, …

    Examples
    --------
    >>> by_axis({"gz": 3, "Gyro_X": 1}), by_axis({"x": 1, "x2": 2}), by_axis({"roll": 1})
    ({'z': 3, 'x': 1}, {'x': 1}, {})
    """
    told = {re.sub("[^a-z]", "", name.lower())[-1:]: one for name, one in named.items()}
    if len(told) == len(named) and set(told) <= set("xyz"):
        return told
    return {name[-1]: one for name, one in named.items() if re.fullmatch("a?[xyz]", name)}


def names(text: str) -> tuple[str, ...]:
    """``x,z`` as names.

    Raises
    ------
    ValueError
        If a name is empty.
    """
    listed = tuple(name.strip() for name in text.split(","))
    if "" in listed:
        raise ValueError(f"{text!r}; give names with commas between them, such as x,z")
    return listed


def by_name(text: str) -> dict[str, str]:
    """``x=A,z=B`` as a mapping.

    Raises
    ------
    ValueError
        If a name or a value is missing.
    """
    pairs = [item.partition("=") for item in text.split(",")]
    if any(not name.strip() or not value.strip() for name, _, value in pairs):
        raise ValueError(f"{text!r}; give NAME=VALUE with commas between, such as x=A,z=B")
    names = [name.strip() for name, _, _ in pairs]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise ValueError(f"{text!r} names {twice} twice; give it once")
    return {name.strip(): value.strip() for name, _, value in pairs}


def one_or_by_name(text: str) -> str | dict[str, str]:
    """``rate`` for all gyros, or ``x=rate,z=angle`` one by one."""
    return by_name(text) if "=" in text else text


def giving(example: str) -> Callable[[Callable[[str], Value]], Callable[[str], Value]]:
    """Has a function say what to give if it can make nothing of a text."""

    def of(convert: Callable[[str], Value]) -> Callable[[str], Value]:
        @wraps(convert)
        def converted(text: str) -> Value:
            try:
                return convert(text)
            except (KeyError, ValueError, OverflowError):
                raise ValueError(f"{text!r}; give {example}") from None

        return converted

    return of


@giving("START:STOP in s, the start below the stop, such as 630:930")
def span(text: str) -> Span:
    """``START:STOP`` in s; either may be left out.

    Raises
    ------
    ValueError
        If it is none.
    """
    start, stop = (float(end) if end.strip() else None for end in text.split(":"))
    if stop is not None and not (start or 0.0) < stop:
        raise ValueError
    return start, stop


@giving("a time above zero such as 1s, 100ms or 2h")
def seconds(text: str) -> float:
    """``1``, ``1s``, ``100ms`` or ``2h`` in s.

    Raises
    ------
    ValueError
        If it is no time above zero.
    """
    stripped = text.strip()
    value = float(stripped) if is_bare(stripped) else unit_of(numbered(stripped), "time").size
    if not 0.0 < value < float("inf"):
        raise ValueError
    return value


def numbered(text: str) -> str:
    """A unit with a number before it; ``s`` alone would be one second."""
    if not text[:1].isdigit() and not text.startswith("."):
        raise ValueError(text)
    return text


def is_bare(text: str) -> bool:
    """Whether a text is a number without a unit."""
    return text.replace(".", "", 1).isdigit()


whole_number: Final = giving("a whole number")(int)
"""``7`` as a number; ``1.5`` is none."""

# What is no text itself.
_VALUES: Final[Mapping[str, Callable[[str], Any]]] = {
    **dict.fromkeys(("gyros", "accelerometers", "covariates", "accept", "estimator"), names),
    **dict.fromkeys(("kind", "unit"), one_or_by_name),
    **dict.fromkeys(("rate", "counter_period", "confidence"), giving("a number")(float)),
    "columns": by_name,
    "counter_bits": whole_number,
    "interval": seconds,
    "slice": span,
}


def keywords(texts: Mapping[str, str]) -> dict[str, Any]:
    """The keywords of `sagnac.read` and `sagnac.analyze` that texts state as the command line does.

    Parameters
    ----------
    texts
        Option -> text, such as `sagnac.missing` gives.

    Returns
    -------
    dict
        Input of the library -> value.

    Raises
    ------
    ValueError
        If a text is none of its option.

    Examples
    --------
    >>> keywords({"columns": "x=gyro_x,z=gyro_z", "rate": "100", "slice": "630:930"})
    {'columns': {'x': 'gyro_x', 'z': 'gyro_z'}, 'sample_rate': 100.0, 'span': (630.0, 930.0)}
    """
    require_type("texts", texts, Mapping, "give option -> text, as missing(path) does")
    inputs = {option: name for name, option in OPTION_OF.items()}
    plain = {option.replace("-", "_"): text for option, text in texts.items()}
    return {inputs.get(option, option): value_of(option, text) for option, text in plain.items()}


def value_of(option: str, text: str) -> Any:
    """The value that a text states of an option, or of an input of the library.

    Raises
    ------
    ValueError
        If it is none of it.
    """
    try:
        return _VALUES.get(OPTION_OF.get(option, option), str)(text)
    except ValueError as error:
        raise refusal(option, f"is {error}") from None


def text_of(value: Any) -> str:
    """A value as it is typed: a mapping as ``x=A,z=B``, names as ``x,z``, a span as ``630:930``."""
    if isinstance(value, Mapping):
        return ",".join(f"{name}={one}" for name, one in value.items())
    if isinstance(value, float):
        return repr(value).removesuffix(".0")
    if isinstance(value, tuple) and not all(isinstance(one, str) for one in value):
        return ":".join("" if one is None else text_of(one) for one in value)
    return ",".join(value) if isinstance(value, tuple) else str(value)


# ---- toml --------------------------------------------------------------------------


def toml_table(table: Mapping[str, Any]) -> str:
    """A table as TOML, a line for each key; a table in it stands in braces.

    Examples
    --------
    >>> print(toml_table({"gyros": ("x", "z"), "unit": {"x": "deg/h"}}), end="")
    gyros = ["x", "z"]
    unit = {x = "deg/h"}
    """
    return "".join(f"{_key(key)} = {_value(value)}\n" for key, value in table.items())


def toml_tables(table: Mapping[str, Any], path: str = "") -> str:
    """A table as TOML: plain values first, then the tables below them."""
    plain = {key: value for key, value in table.items() if not isinstance(value, Mapping)}
    text = toml_table(plain)
    for key, value in table.items():
        if isinstance(value, Mapping):
            below = f"{path}{_key(key)}."
            text += f"\n[{below[:-1]}]\n{toml_tables(value, below)}"
    return text


def _key(key: str) -> str:
    # TOML takes these names without quotes.
    return key if re.fullmatch(r"[A-Za-z0-9_-]+", key) else _value(key)


def _value(value: Any) -> str:
    if isinstance(value, list | tuple):
        return f"[{', '.join(_value(item) for item in value)}]"
    if isinstance(value, Mapping):
        items = (f"{_key(key)} = {_value(item)}" for key, item in value.items())
        return "{" + ", ".join(items) + "}"
    if isinstance(value, str):
        # TOML escapes as JSON does, and the delete character as well.
        return json.dumps(one_line(value), ensure_ascii=False)
    return json.dumps(value)
