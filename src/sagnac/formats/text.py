"""Text as instruments write it: encoding, lines, numbers (decimal commas) and times."""

import codecs
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from sagnac.core.arrays import IntegerArray
from sagnac.core.errors import RecordingError

# ---- text numbers ------------------------------------------------------------------

# What stands where a number is missing; pyarrow takes the same.
MISSING: Final = frozenset(
    {"", "#N/A", "#N/A N/A", "#NA", "-1.#IND", "-1.#QNAN", "-NaN", "-nan", "1.#IND", "1.#QNAN"}
    | {"N/A", "NA", "NULL", "NaN", "n/a", "nan", "null"}
)


@cache
def _number(decimal: str, thousands: str) -> re.Pattern[str]:
    """Numbers with these marks."""
    point = re.escape(decimal)
    whole = rf"(?:[1-9]\d{{0,2}}(?:{re.escape(thousands)}\d{{3}})+|\d+)" if thousands else r"\d+"
    number = rf"(?:{whole}(?:{point}\d*)?|{point}\d+)(?:[eE][+-]?\d+)?|inf|Inf|INF"
    return re.compile(rf"[+-]?(?:{number})\Z")


@dataclass(frozen=True, slots=True, kw_only=True)
class NumberStyle:
    """How numbers are written.

    Attributes
    ----------
    decimal
        Mark before the decimals: ``.`` or ``,``.
    thousands
        Mark between thousands; empty if there is none.
    """

    decimal: str = "."
    thousands: str = ""

    @property
    def pattern(self) -> str:
        """Regular expression of numbers so written, in a form that Arrow's engine reads, too."""
        return f"^(?:{_number(self.decimal, self.thousands).pattern[:-2]})$"

    def holds(self, text: str) -> bool:
        """Whether `text` is a number so written, or stands for a missing one."""
        return text in MISSING or _number(self.decimal, self.thousands).match(text) is not None

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
# The decimal mark and, behind it, the mark between thousands. The first style that reads most of a
# file's numbers is taken.
_MARKS: Final = (".", ",", ",.", ".,", ".'", ",\u00a0", ",\u202f")
STYLES: Final = tuple(NumberStyle(decimal=marks[0], thousands=marks[1:]) for marks in _MARKS)
_EITHER: Final = re.compile(r"[+-]?(?!0,)\d{1,3},\d{3}\Z")


def style_of(fields: Sequence[str]) -> NumberStyle:
    """The style that reads most of these fields, the plainest if several do.

    In ``0,512`` the comma is no mark between thousands, nor is it in the other fields then.

    Examples
    --------
    >>> style_of(["1,5", "2", "1e3"]).decimal
    ','
    """
    starts = {text.lstrip("+-")[:2] for text in fields}
    styles = [one for one in STYLES if not one.thousands or f"0{one.thousands}" not in starts]
    return max(styles, key=lambda style: sum(map(style.holds, fields)))


def is_in_doubt(fields: Sequence[str]) -> bool:
    """Whether every comma may stand before decimals or between thousands: ``1,234``.

    A point beside the comma, or another number of digits behind it, would tell.
    """
    commas = [text for text in fields if "," in text]
    return bool(commas) and all(map(_EITHER.match, commas)) and not any("." in t for t in fields)


# ---- text times --------------------------------------------------------------------

# Times of the clock; dates with one; such dates with the day first and strokes between.
TimeForm = Literal["clock", "iso", "iso-day-first"]

_TIME: Final = r"(?P<h>\d{1,2}):(?P<m>[0-5]\d)(?::(?P<s>[0-5]\d|60)(?:[.,](?P<f>\d{1,9})\d*)?)?"
_HALF: Final = r"\s*(?P<p>[AaPp]\.?[Mm]\.?)?"
_ZONE: Final = r"\s*(?:Z|(?P<z>[+-]\d{2}):?(?P<zm>\d{2}))?"
# Year first as ISO 8601 has it, day first with points, month first with strokes unless the dates
# show that the day stands first.
_DATES: Final = (
    r"(?P<y>\d{4})[-/.](?P<mo>\d{1,2})[-/.](?P<d>\d{1,2})",
    r"(?P<d>\d{1,2})\.(?P<mo>\d{1,2})\.(?P<y>\d{4})",
    r"(?P<mo>\d{1,2})/(?P<d>\d{1,2})/(?P<y>\d{4})",
    r"(?P<d>\d{1,2})/(?P<mo>\d{1,2})/(?P<y>\d{4})",
)
_CLOCK: Final = rf"^\s*{_TIME}{_HALF}\s*$"
*_ISO, _DAY_FIRST = (rf"^\s*{date}[T ]+{_TIME}{_HALF}{_ZONE}\s*$" for date in _DATES)
_STROKES: Final = re.compile(r"\s*(\d{1,2})/(\d{1,2})/\d{4}\b")
_DAY: Final = 86_400 * 10**9  # ns


def form_of(text: str) -> TimeForm | None:
    """Kind of time that a text is, None if it is none.

    Examples
    --------
    >>> form_of("14:03:00,002"), form_of("2024-03-05T14:03:00Z"), form_of("14.03")
    ('clock', 'iso', None)
    """
    if any(re.match(pattern, text) for pattern in _ISO):
        return "iso"
    return "clock" if re.match(_CLOCK, text) else None


def is_day_first(texts: Sequence[str]) -> bool:
    """Whether dates with strokes have the day first: their first number changes from day to day.

    Without a midnight it does not matter which of the two it is.

    Examples
    --------
    >>> is_day_first(["05/03/2024 23:59:59", "06/03/2024 00:00:01"])
    True
    >>> is_day_first(["03/05/2024 23:59:59", "03/06/2024 00:00:01"])
    False
    """
    dates = {date.groups() for date in map(_STROKES.match, texts) if date}
    first, second = ({int(date[place]) for date in dates} for place in (0, 1))
    return max(first, default=0) > 12 or (len(first) > 1 and len(second) == 1)


def nanoseconds(texts: Any, form: TimeForm) -> IntegerArray:
    """Times of an Arrow array of text, ns: from midnight, or from 1970.

    Raises
    ------
    ValueError
        If one is no such time.
    """
    patterns = {"clock": (_CLOCK,), "iso": _ISO, "iso-day-first": (_DAY_FIRST,)}
    for pattern in patterns[form]:
        parts = pc.extract_regex(texts, pattern)
        if parts.null_count < len(parts) or not len(parts):
            break
    if parts.null_count:
        raise ValueError("a time cannot be read")

    def words(name: str) -> NDArray[np.str_]:
        return np.asarray(pc.struct_field(parts, name).to_numpy(zero_copy_only=False), dtype=str)

    def number(name: str, width: int = 1) -> IntegerArray:
        """Digits of a part as numbers, 0 where there are none."""
        digits = pc.utf8_rpad(pc.struct_field(parts, name), width, "0")
        return np.asarray(pc.cast(digits, pa.int64()).to_numpy(zero_copy_only=False))

    half = np.char.lower(words("p"))
    hour = np.where(half == "", number("h"), number("h") % 12) + 12 * np.char.startswith(half, "p")
    seconds = 3600 * hour + 60 * number("m") + number("s")
    if form != "clock":
        year = (number("y") - 1970).astype("datetime64[Y]")
        month = year.astype("datetime64[M]") + (number("mo") - 1)
        day = month.astype("datetime64[D]") + (number("d") - 1)
        zone = words("z")
        hours = np.where(zone == "", "0", zone).astype(np.int64)
        minutes = 60 * hours + np.where(np.char.startswith(zone, "-"), -1, 1) * number("zm")
        seconds = seconds + day.astype("datetime64[s]").astype(np.int64) - 60 * minutes
    return np.asarray(seconds * 10**9 + number("f", 9), dtype=np.int64)


def past_midnight(times: IntegerArray) -> IntegerArray:
    """Times of the clock made continuous: a step back by over half a day is midnight.

    Parameters
    ----------
    times
        (samples,) ns from midnight.
    """
    days = np.cumsum(np.diff(times, prepend=times[:1]) < -_DAY // 2)
    return np.asarray(times + days * _DAY)


# ---- text file ---------------------------------------------------------------------

_HEAD_BYTES: Final = 1 << 16
_PART_BYTES: Final = 1 << 14
_LONGEST_LINE: Final = 1 << 20


def encoding_of(head: bytes) -> str:
    """Codec of a text by its first bytes: UTF-8, UTF-16 or, if it is neither, cp1252.

    Raises
    ------
    RecordingError
        If this is no text.

    Examples
    --------
    >>> encoding_of("Zähler".encode("cp1252")), encoding_of("x;y".encode("utf-16"))
    ('cp1252', 'utf-16-le')
    """
    orders = ("utf-16-le", codecs.BOM_UTF16_LE, 1), ("utf-16-be", codecs.BOM_UTF16_BE, 0)
    for name, mark, first in orders:
        # Digits and marks of a text without a mark of its order have a zero beside each.
        is_beside = head[first::2].count(0) > 0.9 * (len(head) // 2) and len(head) >= 4
        if head.startswith(mark) or (is_beside and not head[1 - first :: 2].count(0)):
            return name
    if b"\0" in head:
        remedy = "unpack it if it is packed, or give it the suffix of its own format"
        raise RecordingError("holds binary data, not text", remedy=remedy)
    try:
        codecs.getincrementaldecoder("utf-8")().decode(head)
    except UnicodeDecodeError:
        return "cp1252"
    return "utf-8"


@dataclass(frozen=True, slots=True, kw_only=True)
class TextFile:
    """A text file, with lines of it that its layout is judged by.

    Attributes
    ----------
    path
        Of the file.
    encoding
        See `encoding_of`.
    head
        Its first lines, whole.
    later
        Whole lines from its middle and its end.
    is_ended
        Whether its last line has its end.
    """

    path: Path
    encoding: str
    head: tuple[str, ...]
    later: tuple[str, ...] = ()
    is_ended: bool = True

    def lines(self) -> Iterator[str]:
        """All lines, one after the other, without their ends."""
        with self.path.open(encoding=self.encoding, errors="replace", newline=None) as stream:
            for number, line in enumerate(stream):
                yield _plain(line.lstrip("\ufeff") if number == 0 else line).rstrip("\n")

    def blocks(self, *, blanks: bool) -> Iterator[bytes]:
        """Blocks of whole lines, about 1 MiB each, as UTF-8.

        Parameters
        ----------
        blanks
            Whether runs of blanks and tabs become one blank and those at the ends of lines go.

        Raises
        ------
        ValueError
            If a line is longer than any table's.
        """
        decoder = codecs.getincrementaldecoder(self.encoding)("replace")
        pending = b""
        with self.path.open("rb") as stream:
            while part := stream.read(_LONGEST_LINE):
                block = pending + _plain(decoder.decode(part)).encode()
                # A carriage return at the very end may be half of a line end.
                end = 1 + max(block.rfind(b"\n"), block.rfind(b"\r", 0, -1))
                pending = block[end:]
                if len(pending) > _LONGEST_LINE:
                    raise ValueError("a line is longer than 1 MiB")
                if end:
                    yield _single(block[:end]) if blanks else block[:end]
        if pending:
            yield _single(pending) if blanks else pending


def text_file(path: Path) -> TextFile:
    """A text file by its first lines, and some from its middle and its end.

    Raises
    ------
    RecordingError
        If this is no text, or a line is longer than any table's.
    """
    size, later = path.stat().st_size, list[str]()
    with path.open("rb") as stream:
        start = stream.read(_HEAD_BYTES)
        encoding = encoding_of(start)
        head = _lines(start, encoding)
        is_ended = not head[-1]
        if size > len(start):
            # The last one may be cut.
            head.pop()
            if not head:
                problem = f"has no line end in its first {_HEAD_BYTES // 1024} KiB"
                raise RecordingError(problem, remedy="give a table with a line for each sample")
            for place in (size // 2, size - _PART_BYTES) if size > 4 * _HEAD_BYTES else ():
                stream.seek(place - place % 2)
                later += _lines(stream.read(_PART_BYTES), encoding)[1:-1]
            stream.seek(size - 2 - size % 2)
            is_ended = not _lines(stream.read(), encoding)[-1]
    return TextFile(
        path=path, encoding=encoding, head=tuple(head), later=tuple(later), is_ended=is_ended
    )


def _lines(part: bytes, encoding: str) -> list[str]:
    """Lines of a part of a file, the last one up to its end; empty if that has one."""
    return re.split(r"\r\n|\n|\r", _plain(part.decode(encoding, errors="replace").lstrip("\ufeff")))


def _plain(text: str) -> str:
    """Text with the minus that a programming language knows, for the one that is printed."""
    return text.replace("\N{MINUS SIGN}", "-")


def _single(lines: bytes) -> bytes:
    """Lines with one blank between two fields and none at their ends."""
    tidy = lines.replace(b"\t", b" ").replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    while b"  " in tidy:
        tidy = tidy.replace(b"  ", b" ")
    return tidy.replace(b"\n ", b"\n").replace(b" \n", b"\n").strip(b" ")
