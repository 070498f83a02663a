"""Numbers as instruments write them: decimal commas, marks between thousands."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final

_SPACES: Final = "\u00a0\u202f"
# What stands where a number is missing; pyarrow takes the same.
MISSING: Final = frozenset(
    {"", "#N/A", "#N/A N/A", "#NA", "-1.#IND", "-1.#QNAN", "-NaN", "-nan", "1.#IND", "1.#QNAN"}
    | {"N/A", "NA", "NULL", "NaN", "n/a", "nan", "null"}
)


@dataclass(frozen=True, slots=True, kw_only=True)
class NumberStyle:
    """How numbers are written.

    Attributes
    ----------
    decimal
        Mark before the decimals: ``.`` or ``,``.
    thousands
        Mark between thousands; empty if there is none.

    Raises
    ------
    ValueError
        If the two are the same, or the decimal mark is neither.
    """

    decimal: str = "."
    thousands: str = ""
    _pattern: re.Pattern[str] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        if self.decimal not in (".", ",") or self.decimal == self.thousands:
            raise ValueError(
                f"decimal is {self.decimal!r} and thousands {self.thousands!r}; "
                "use . or , and another mark"
            )
        point = re.escape(self.decimal)
        whole = r"\d+"
        if self.thousands:
            whole = rf"(?:\d{{1,3}}(?:{re.escape(self.thousands)}\d{{3}})+|\d+)"
        number = rf"(?:{whole}(?:{point}\d*)?|{point}\d+)(?:[eE][+-]?\d+)?|inf|Inf|INF"
        object.__setattr__(self, "_pattern", re.compile(rf"[+-]?(?:{number})\Z"))

    def holds(self, text: str) -> bool:
        """Whether `text` is a number so written, or stands for a missing one."""
        return text in MISSING or self._pattern.match(text) is not None

    def value(self, text: str) -> float:
        """The number that `text` is, NaN if it stands for a missing one.

        Raises
        ------
        ValueError
            If it is none.

        Examples
        --------
        >>> NumberStyle(decimal=",", thousands=".").value("1.234,5")
        1234.5
        """
        if not self.holds(text):
            raise ValueError(f"{text!r} is not a number")
        if text in MISSING:
            return float("nan")
        plain = text.replace(self.thousands, "") if self.thousands else text
        return float(plain.replace(self.decimal, "."))


PLAIN: Final = NumberStyle()
# The first that reads most of a file's numbers is taken.
STYLES: Final = (
    PLAIN,
    NumberStyle(decimal=","),
    NumberStyle(decimal=",", thousands="."),
    NumberStyle(decimal=".", thousands=","),
    NumberStyle(decimal=".", thousands="'"),
    *(NumberStyle(decimal=",", thousands=space) for space in _SPACES),
)
_EITHER: Final = re.compile(r"[+-]?\d{1,3},\d{3}\Z")


def style_of(fields: Sequence[str]) -> NumberStyle:
    """The style that reads most of these fields, the plainest if several do.

    Examples
    --------
    >>> style_of(["1,5", "2", "1e3"]).decimal
    ','
    """
    return max(STYLES, key=lambda style: sum(map(style.holds, fields)))


def is_in_doubt(fields: Sequence[str]) -> bool:
    """Whether every comma may stand before decimals or between thousands: ``1,234``.

    A point beside the comma, or another number of digits behind it, would tell.
    """
    with_comma = [text for text in fields if "," in text]
    return (
        bool(with_comma)
        and all(_EITHER.match(text) for text in with_comma)
        and not any(text.startswith(("0,", "-0,", "+0,")) for text in with_comma)
        and not any("." in text for text in fields)
    )
