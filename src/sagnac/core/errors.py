"""Errors in a recording and notes on it, as data: who, what, what to do.

Nothing here is worded for one place of use. A text may name an input of the package in braces,
``{slice 30:90}`` or ``{method fos}``: `worded` writes it as the reader would give it, the command
line as ``--slice 30:90``, a program as ``span=(30, 90)``.
"""

import math
import operator
import os
import re
import reprlib
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from difflib import get_close_matches
from importlib import import_module
from pathlib import Path
from typing import Any, Final, Literal, Self, SupportsIndex, get_args

Level = Literal["error", "warning", "remark"]
LEVELS: Final[tuple[Level, ...]] = get_args(Level)

# Characters of a value in a message.
_LONGEST_SHOWN: Final = 120
_SMALLEST_RISK: Final = 1e-9  # of an interval, and its confidence at least
_SHOWN: Final = reprlib.Repr()
_SHOWN.maxstring = _SHOWN.maxother = _LONGEST_SHOWN
# Marks that move the cursor of a terminal, colour it, end a line or turn the direction of reading,
# and halves of characters.
_CONTROLS: Final = re.compile(
    "[\x00-\x08\x0b-\x1f\x7f-\x9f\u200b-\u200f\u2028-\u202e\u2060-\u2069\ud800-\udfff\ufeff\ufffe\uffff]"
)
_INPUT: Final = re.compile(r"\{([a-z]+(?:-[a-z]+)*)(?: ([^{}]*))?\}")


def as_keyword(name: str, value: str) -> str:
    """An input as a program gives it.

    Examples
    --------
    >>> as_keyword("slice", "30:"), as_keyword("kind", "rate"), as_keyword("null-pulse", "")
    ('span=(30, None)', 'kind=rate', 'null_pulse')
    """
    # Inputs whose keyword in Python is not the name of the option.
    other = {"slice": "span", "rate": "sample_rate", "accept": "accepted"}
    key = other.get(name, name.replace("-", "_"))
    if key == "span" and value:
        start, _, stop = value.partition(":")
        value = f"({start or None}, {stop or None})"
    return f"{key}={value}" if value else key


def worded(text: str, form: Callable[[str, str], str] = as_keyword) -> str:
    """`text` with each input that it names in braces written by `form`.

    Parameters
    ----------
    text
        As notes and errors hold it.
    form
        Given the input's name and its value, empty where the text states none.

    Examples
    --------
    >>> worded("take the sound stretch ({slice 30:90})")
    'take the sound stretch (span=(30, 90))'
    >>> worded("name its encoder ({table})", lambda name, value: f"--{name} {value}".strip())
    'name its encoder (--table)'
    """
    return _INPUT.sub(lambda found: form(found[1], found[2] or ""), text)


@dataclass(frozen=True, slots=True, kw_only=True)
class Note:
    """One thing noticed.

    Attributes
    ----------
    level
        ``error``: no figure can rest on the data. ``warning``: a figure may be wrong.
        ``remark``: good to know.
    channel
        Gyro name, ``table``, ``time``, or empty where it is about the whole.
    text
        One line, without the channel; inputs of the package in braces (see `worded`).
    name
        What was found, one word by which it is accepted: ``clipping``. Empty if the note is no
        finding on the quality of the data.
    effect
        Factor by which a finding changes the angle random walk that is read, about; None if that
        is not known.

    Raises
    ------
    ValueError
        If the level is none of these, or the effect is negative.

    Examples
    --------
    >>> note = Note(level="warning", channel="x", name="clipping", text="is saturated", effect=0.9)
    >>> str(note)
    'x: is saturated'
    """

    text: str
    level: Level = "remark"
    channel: str = ""
    name: str = ""
    effect: float | None = None

    def __post_init__(self) -> None:
        require_choice("level", self.level, LEVELS)
        if self.effect is not None and not self.effect >= 0.0:
            raise refusal("effect", f"is {self.effect}; give a factor, 0 or more")

    def __str__(self) -> str:
        return worded(f"{self.channel}: {self.text}" if self.channel else self.text)


def ranked(notes: Iterable[Note]) -> tuple[Note, ...]:
    """Errors first, then warnings, then remarks; in their order otherwise, each once."""
    return tuple(sorted(dict.fromkeys(notes), key=lambda note: LEVELS.index(note.level)))


class RecordingError(ValueError):
    """Something is wrong in the data: where, what, and what to do about it.

    Parameters
    ----------
    problem
        What is wrong, one line; inputs of the package in braces (see `worded`).
    path
        Of the file, empty where it is not known (yet: see `at`).
    channel
        Gyro name, ``table``, ``time``, or empty where it is about the whole.
    remedy
        What to do, one line; unless stated the usual one of the class, if it has any.

    Examples
    --------
    >>> try:
    ...     raise RecordingError("has 3 gaps", path="run.csv", channel="time", remedy="use {slice}")
    ... except RecordingError as error:
    ...     print(error)
    run.csv: time: has 3 gaps; use span
    """

    usual_remedy = ""

    def __init__(
        self, problem: str, *, path: str = "", channel: str = "", remedy: str = ""
    ) -> None:
        super().__init__(problem)
        self.problem, self.path, self.channel = problem, path, channel
        self.remedy = remedy or self.usual_remedy

    @classmethod
    def of(cls, note: Note, path: str = "") -> Self:
        """Text of a note of level ``error``."""
        return cls(note.text, path=path, channel=note.channel)

    def at(self, path: str) -> Self:
        """The same error; names the file if it named none."""
        where = self.path or path
        return type(self)(self.problem, path=where, channel=self.channel, remedy=self.remedy)

    def line(self, form: Callable[[str, str], str] = as_keyword) -> str:
        """The whole line, inputs of the package written by `form` (see `worded`)."""
        problem = f"{self.problem}; {self.remedy}" if self.remedy else self.problem
        # A recording that never was a file is called so, and nothing that makes one takes a span.
        if self.path == "recording" and "{slice" in problem:
            problem += "; in place of span take recording[FIRST:STOP], in samples"
        return ": ".join(part for part in (self.path, self.channel, worded(problem, form)) if part)

    def __str__(self) -> str:
        return self.line()


class WouldOverwrite(RecordingError):
    """A file is there that would be lost: why it is not written over.

    Examples
    --------
    >>> issubclass(WouldOverwrite, RecordingError)
    True
    """

    usual_remedy = "choose another output, or state {force} to write over it"


class MissingExtra(ImportError):
    """A package that only some uses need is not installed.

    Parameters
    ----------
    purpose
        What needs it, a noun that starts the sentence: ``a pandas frame``.
    package
        Its name.
    extra
        The extra of this package that brings it.

    Examples
    --------
    >>> print(MissingExtra("a frame", "pandas", "frames"))
    a frame needs pandas, which is not installed; install it with pip install '.[frames]' in the
    folder of sagnac's source
    """

    def __init__(self, purpose: str, package: str, extra: str) -> None:
        remedy = f"install it with pip install '.[{extra}]' in the folder of sagnac's source"
        problem = f"{purpose} needs {package}, which is not installed; {remedy}"
        super().__init__(problem, name=package)
        self.purpose, self.package, self.extra = purpose, package, extra

    def at(self, path: str) -> Self:
        """The same error with the file that the package was needed for."""
        return type(self)(f"{path}: {self.purpose}", self.package, self.extra)

    def __reduce__(self) -> tuple[type[Self], tuple[str, str, str]]:
        # An error that crosses to another process is made there from its parts.
        return type(self), (self.purpose, self.package, self.extra)


def extra_module(package: str, extra: str, purpose: str) -> Any:
    """A package that only some uses need, imported where it is needed.

    Parameters
    ----------
    package, extra, purpose
        As of `MissingExtra`.

    Raises
    ------
    MissingExtra
        If it is not installed.
    """
    try:
        return import_module(package)
    except ImportError:
        raise MissingExtra(purpose, package, extra) from None


def quoted(value: object) -> str:
    """A value as a message shows it: one line of at most 120 characters, whatever it is.

    Examples
    --------
    >>> quoted("fft"), quoted(list(range(100)))
    ("'fft'", '[0, 1, 2, 3, 4, 5, ...]')
    """
    text = " ".join(_SHOWN.repr(value).split())
    return text if len(text) <= _LONGEST_SHOWN else f"{text[: _LONGEST_SHOWN - 4]} ..."


def visible(text: str) -> str:
    """`text` with the marks that a terminal or another program would obey written as numbers.

    Line ends and tabs stay.

    Examples
    --------
    >>> print(visible("run" + chr(27) + "[2J.csv"))
    run\\u001b[2J.csv
    """
    return _CONTROLS.sub(lambda found: f"\\u{ord(found[0]):04x}", text)


def one_line(text: str) -> str:
    """The same with line ends and tabs as numbers, too: what a name from outside is shown as.

    Examples
    --------
    >>> print(one_line("run" + chr(10) + "import os"))
    run\\u000aimport os
    """
    return visible(text).replace("\n", "\\u000a").replace("\t", "\\u0009")


def rounded(value: float, digits: int = 2) -> str:
    """A number rounded to some significant digits, written as a person does: no power of ten.

    Examples
    --------
    >>> rounded(8123.4), rounded(99.96), rounded(0.01234), rounded(7.0)
    ('8100', '100', '0.012', '7')
    """
    if value == 0.0 or not math.isfinite(value):
        return f"{value:g}"
    places = digits - 1 - math.floor(math.log10(abs(value)))
    text = f"{round(value, places):.{max(places, 0)}f}"
    return text.rstrip("0").rstrip(".") if "." in text else text


def per_cent(confidence: float) -> str:
    """A confidence for a sentence, in per cent to twelve digits.

    Examples
    --------
    >>> per_cent(0.95), per_cent(0.683), per_cent(0.9999999)
    ('95 %', '68.3 %', '99.99999 %')
    """
    return f"{100.0 * confidence:.12g} %"


def counted(count: int, noun: str) -> str:
    """``1 sample``, ``2 samples``."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


class _OfArgument(Exception):
    """What is wrong with an argument, whose name stands apart from the words on it."""

    def __init__(self, argument: str, problem: str, where: str = "") -> None:
        super().__init__(argument, problem, where)
        self.argument, self.problem, self.where = argument, problem, where

    def __str__(self) -> str:
        return f"{self.where}{self.argument} {self.problem}"


class ArgumentError(_OfArgument, ValueError):
    """An argument that cannot be, such as a confidence of 2.

    Attributes
    ----------
    argument
        Its name.
    problem
        Its value and what is wrong, with the remedy.
    where
        What comes before its name, such as the channel that it is of.

    Examples
    --------
    >>> print(ArgumentError("confidence", "is 2; give a number between 0 and 1"))
    confidence is 2; give a number between 0 and 1
    """


class ArgumentTypeError(_OfArgument, TypeError):
    """An argument of another type than it may be of; attributes as of `ArgumentError`."""


refusal: Final = ArgumentError
"""`ArgumentError` by a shorter name, for the many lines that raise it."""


def require_type(name: str, value: object, wanted: type | tuple[type, ...], remedy: str) -> None:
    """Refuse a value of another type.

    Raises
    ------
    TypeError
        With the argument, the value and the remedy.
    """
    if not isinstance(value, wanted):
        raise ArgumentTypeError(name, f"is {quoted(value)}; {remedy}")


def require_progress(progress: object, name: str = "progress") -> None:
    """Refuse what cannot be called with the progress of a task, and is not None.

    Raises
    ------
    TypeError
        With the value.
    """
    if not (progress is None or callable(progress)):
        raise ArgumentTypeError(name, f"is {quoted(progress)}; give a function, or None")


def path_of(name: str, path: str | os.PathLike[str]) -> Path:
    """The path that an argument states.

    Raises
    ------
    TypeError
        If it is none; with the argument and the value.
    ValueError
        If it is empty, which would be the folder where one is.
    """
    require_type(name, path, (str, os.PathLike), "give a path")
    if not os.fspath(path):
        raise refusal(name, "is empty; give a path")
    return Path(path)


def require_name(name: str, value: object) -> None:
    """Refuse what names no channel: no text, or an empty one.

    Raises
    ------
    ValueError
        With the argument and the value.
    """
    if not isinstance(value, str) or not value:
        raise refusal(name, f"is {quoted(value)}; give the channel a name, x for one")


def require_choice(name: str, value: object, allowed: Any) -> None:
    """Refuse a value that is not one of the choices.

    Parameters
    ----------
    name
        Of the argument, for the message.
    value
        What was given.
    allowed
        The choices, or the `Literal` of them.

    Raises
    ------
    ValueError
        With the argument, the value and the choices.
    """
    choices = get_args(allowed) or tuple(allowed)
    if value not in choices:
        raise refusal(name, f"is {quoted(value)}; use one of {', '.join(map(str, choices))}")


def choices_of(name: str, given: Iterable[str], allowed: Any) -> tuple[str, ...]:
    """Several choices, each one of those allowed.

    Parameters
    ----------
    name, allowed
        See `require_choice`.
    given
        The choices; a text alone would be taken for its letters.

    Raises
    ------
    ValueError
        With the argument, the value and the choices.

    Examples
    --------
    >>> choices_of("accepted", ["units"], ["clipping", "units"])
    ('units',)
    """
    if isinstance(given, str) or not isinstance(given, Iterable):
        example = (get_args(allowed) or tuple(allowed))[0]
        raise refusal(name, f"is {quoted(given)}; give names, such as ({example!r},)")
    chosen = tuple(given)
    for one in chosen:
        require_choice(name, one, allowed)
    return chosen


def require_keywords(function: str, given: Iterable[str], known: Iterable[str]) -> None:
    """Refuse a keyword that a function does not take.

    Parameters
    ----------
    function
        Its name, for the message.
    given
        Keywords that were given.
    known
        Keywords that it takes.

    Raises
    ------
    TypeError
        With the function, the keyword, and the one that is nearest to it, or all.

    Examples
    --------
    >>> require_keywords("analyze", ["metod"], ["gyros", "method"])
    Traceback (most recent call last):
        ...
    TypeError: analyze has no keyword 'metod'; did you mean method?
    """
    known = list(known)
    for name in given:
        if name not in known:
            near = get_close_matches(name, known, 1)
            meant = f"did you mean {near[0]}?" if near else f"use one of {', '.join(known)}"
            raise TypeError(f"{function} has no keyword {name!r}; {meant}")


def is_finite(value: Any) -> bool:
    """Whether a value is one finite number; text, None, True and lists of numbers are not.

    Examples
    --------
    >>> is_finite(2), is_finite("2"), is_finite(float("nan")), is_finite(True)
    (True, False, False, False)
    """
    try:
        return math.isfinite(value) and not isinstance(value, bool)
    except TypeError:
        return False


def as_several(value: Any) -> tuple[Any, ...]:
    """The values of a list, or of what goes through one by one; else the one value, or text.

    Examples
    --------
    >>> as_several([1.0, 2.0]), as_several(1.0), as_several("1"), as_several(None)
    ((1.0, 2.0), (1.0,), ('1',), (None,))
    """
    return tuple(value) if isinstance(value, Iterable) and not isinstance(value, str) else (value,)


def require_count(name: str, value: object, least: int) -> None:
    """Refuse what is no whole number, or too small a one.

    Raises
    ------
    ValueError
        With the argument, the value and the least that will do.
    """
    number = operator.index(value) if isinstance(value, SupportsIndex) else None
    if number is None or number < least or isinstance(value, bool):
        raise refusal(name, f"is {quoted(value)}; give a whole number of {least} or more")


def is_band(value: Any) -> bool:
    """Whether a value is two frequencies, Hz, the lower first; the other may be infinite."""
    edges = as_several(value)
    numbers = len(edges) == 2 and all(is_finite(edge) or edge == math.inf for edge in edges)
    return numbers and 0.0 <= edges[0] < edges[1]


def require_confidence(confidence: float) -> None:
    """Refuse a confidence that is no probability.

    Raises
    ------
    ValueError
        If it is not between 0 and 1, or so near to either that its interval is none.
    """
    if not (is_finite(confidence) and 0.0 < confidence < 1.0):
        raise refusal("confidence", f"is {quoted(confidence)}; give a number between 0 and 1")
    if not _SMALLEST_RISK <= confidence <= 1.0 - _SMALLEST_RISK:
        remedy = f"give {_SMALLEST_RISK:g} or more, and at most that far from 1"
        raise refusal("confidence", f"is {confidence!r}; {remedy}")


def require_shape(name: str, shape: tuple[int, ...], wanted: tuple[int, ...]) -> None:
    """Refuse an array of another shape.

    Raises
    ------
    ValueError
        With the argument, its shape and the one that is wanted.
    """
    if shape != wanted:
        raise refusal(name, f"has shape {shape}; give {wanted}")
