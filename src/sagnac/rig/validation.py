"""Configuration that is checked by its annotations, which the documentation quotes.

A key is a field of a frozen dataclass, and its annotation holds the rule that its value keeps::

    rate_deg_per_s: Annotated[float, Number(-400.0, 400.0, "commanded rate")] = 40.0
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields, is_dataclass, replace
from difflib import get_close_matches
from functools import cache
from typing import Annotated, Any, get_args, get_origin, get_type_hints

from sagnac.errors import quoted


class ConfigurationError(ValueError):
    """A key holds what it must not: the key and its value (`problem`), what to do (`remedy`)."""

    def __init__(self, problem: str, remedy: str) -> None:
        super().__init__(f"{problem}; {remedy}")
        self.problem, self.remedy = problem, remedy


@dataclass(frozen=True, slots=True)
class Number:
    """A number between two bounds."""

    low: float
    high: float
    meaning: str


class Whole(Number):
    """A whole number between two bounds."""


class PerGyro(Number):
    """Three numbers, of x, y and z; a single one is taken for all of them."""


@dataclass(frozen=True, slots=True)
class PairsOf:
    """A list of pairs; the meaning of each half is its name and unit."""

    first: Number
    second: Number
    meaning: str


@dataclass(frozen=True, slots=True)
class Choice:
    """One of a few words."""

    choices: tuple[str, ...]
    meaning: str


Rule = Number | PairsOf | Choice


def allowed(rule: Rule) -> str:
    """Values that a key of this rule may hold, in words."""
    if isinstance(rule, Choice):
        return ", ".join(f'`"{choice}"`' for choice in rule.choices)
    if isinstance(rule, PairsOf):
        halves = (f"{half.meaning} {allowed(half)}" for half in (rule.first, rule.second))
        return f"list of [{', '.join(halves)}]"
    form = "" if isinstance(rule, Whole) else "g"
    return f"{rule.low:{form}} to {rule.high:{form}}"


@cache
def rules_of(section: type, prefix: str = "") -> dict[str, Rule]:
    """Rule of each key of a section, and of the sections in it, by the key's dotted name."""
    found: dict[str, Rule] = {}
    for name, hint in get_type_hints(section, include_extras=True).items():
        if get_origin(hint) is Annotated:
            found[prefix + name] = get_args(hint)[1]
        else:
            found |= rules_of(hint, f"{prefix}{name}.")
    return found


def check(section: Any, prefix: str = "") -> None:
    """Check each key of a section in its ``__post_init__``, and store lists as tuples.

    `prefix` begins the keys' dotted names. Sections within the section check themselves.

    Raises
    ------
    ConfigurationError
        If a key holds what its rule does not allow.
    """
    rules = rules_of(section.__class__)
    for field in fields(section):
        value, name = getattr(section, field.name), prefix + field.name
        if field.name in rules:
            object.__setattr__(section, field.name, _checked(rules[field.name], name, value))
        elif not is_dataclass(value):
            raise ConfigurationError(f"{name} is {quoted(value)}", f"it is a table, write [{name}]")


def overlaid(base: Any, values: Mapping[str, Any], prefix: str = "") -> Any:
    """`base` with what nested tables state instead; `ConfigurationError` as by `check`."""
    known = [field.name for field in fields(base)]
    changes: dict[str, Any] = {}
    for key, value in values.items():
        if key not in known:
            near = [*get_close_matches(key, known), *(name for name in known if key in name)]
            meant = f"did you mean {prefix}{near[0]}? " if near else ""
            problem = f"unknown key {prefix + key!r}"
            raise ConfigurationError(problem, f"{meant}known here: {', '.join(known)}")
        section = isinstance(value, Mapping) and is_dataclass(getattr(base, key))
        changes[key] = overlaid(getattr(base, key), value, f"{key}.") if section else value
    return replace(base, **changes)


def _checked(rule: Rule, name: str, value: Any) -> Any:
    if isinstance(rule, Choice):
        _require(
            value in rule.choices,
            f"{name} is {quoted(value)}",
            f"use one of {', '.join(rule.choices)}",
        )
    elif isinstance(rule, PairsOf):
        halves = (rule.first, rule.second)
        expected = f"it must be a list of pairs [{', '.join(half.meaning for half in halves)}]"
        _require(isinstance(value, list | tuple), f"{name} is {quoted(value)}", expected)
        for pair in value:
            whole = isinstance(pair, list | tuple) and len(pair) == len(halves)
            _require(whole, f"{name} holds {quoted(pair)}", expected)
        names = [f"{name} ({half.meaning})" for half in halves]
        return tuple(tuple(map(_checked, halves, names, pair)) for pair in value)
    elif isinstance(rule, PerGyro):
        three = (value,) * 3 if isinstance(value, int | float) else value
        whole = isinstance(three, list | tuple) and len(three) == 3
        _require(whole, f"{name} is {quoted(value)}", "it must be a number or a list of three")
        return tuple(_checked(Number(rule.low, rule.high, ""), name, one) for one in three)
    else:
        problem, limits = f"{name} is {quoted(value)}", allowed(rule)
        if isinstance(rule, Whole):
            _require(isinstance(value, int), problem, "it must be a whole number")
        number = isinstance(value, int | float) and not isinstance(value, bool)
        _require(number, problem, f"it must be a number from {limits}")
        _require(rule.low <= value <= rule.high, problem, f"it must lie from {limits}")
    return value


def _require(true: bool, problem: str, remedy: str) -> None:
    if not true:
        raise ConfigurationError(problem, remedy)
