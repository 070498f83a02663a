"""How a text file is laid out: marks between fields, numbers, header, first row.

Tables known by their headers state nothing of kind and unit themselves. The preamble of LabVIEW
states units and rate: "Specification for the LabVIEW Measurement File (.lvm)", National
Instruments: lines of a key and a value for each channel; two headers, each ended by
``***End_of_Header***``.
"""

import csv
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import accumulate
from typing import Final, Literal

from sagnac.core.errors import RecordingError
from sagnac.formats import text as texts
from sagnac.formats.files import AGAIN
from sagnac.formats.source import Column, column
from sagnac.formats.statement import Statement, is_known, of_rates
from sagnac.formats.text import PLAIN, NumberStyle, TextFile, TimeForm, form_of, style_of

# ---- layout ------------------------------------------------------------------------

# What a column holds: numbers, integers too long for a float such as stamps in ns since 1970, or
# times.
Form = Literal["number", "integer"] | TimeForm
COMMENT: Final = ("#", "%")
_MOST_ROWS: Final = 200
_LONGEST_SHOWN: Final = 40
# What a field is that a column cannot hold.
_WRONG: Final[Mapping[Form, str]] = {
    "number": "not a number",
    "integer": "not an integer as in the rows before",
    "clock": "no time of the clock",
    "iso": "no date with a time",
    "iso-day-first": "no date with the day first and a time",
}
# An integer of more digits loses some as a float of 64 bits.
_LONG: Final = re.compile(r"[+-]?\d{16,}")


@dataclass(frozen=True, slots=True, kw_only=True)
class Layout:
    """How a text file is laid out.

    Attributes
    ----------
    text
        The file.
    columns
        In their order; those of one name have their numbers behind it.
    forms
        What each of them holds.
    delimiter
        Between two fields; a blank stands for any number of blanks and tabs.
    stated
        What the file states of itself.
    style
        How numbers are written.
    skip
        Lines before the first row of numbers.
    first_row
        Fields of that row, empty where there is none.
    doubts
        What the rows do not tell for sure, as it was taken; empty if nothing.
    """

    text: TextFile
    columns: tuple[Column, ...]
    forms: tuple[Form, ...]
    delimiter: str
    stated: Statement
    style: NumberStyle = PLAIN
    skip: int = 0
    first_row: tuple[str, ...] = ()
    doubts: tuple[str, ...] = ()

    def fault(self, wanted: Mapping[str, int]) -> RecordingError | None:
        """Fault of the first row that is no row of the table; None if all are.

        Parameters
        ----------
        wanted
            Key -> place of the columns that are taken.
        """
        number, fault = 0, None
        for number, line in enumerate(self.text.lines(), start=1):
            if fault is not None:
                # It is not the last one.
                return fault
            if number > self.skip and is_plain(line):
                fault = self._fault_of(f"line {number}", line, wanted)
        if fault is None or self.text.is_ended:
            return fault
        problem, remedy = f"the last line, {number}, is cut off", f"remove it, or {AGAIN}"
        return RecordingError(problem, channel=fault.channel, remedy=remedy)

    def _fault_of(self, name: str, line: str, wanted: Mapping[str, int]) -> RecordingError | None:
        remedy = "correct or remove that line"
        fields, columns = fields_of(line, self.delimiter), len(self.forms)
        if len(fields) != columns:
            start = line.strip()[:_LONGEST_SHOWN]
            problem = f"{name} has {len(fields)} fields and the first row {columns}: {start!r}"
            return RecordingError(problem, remedy=remedy)
        for key, place in wanted.items():
            form, text = self.forms[place], fields[place]
            is_right = form_of(text) == form.partition("-")[0]
            if form in ("number", "integer"):
                is_whole = text.lstrip("+-").isdecimal()
                is_right = self.style.holds(text) and (form == "number" or is_whole)
            if not is_right:
                problem = f"{name}: {text[:_LONGEST_SHOWN]!r} is {_WRONG[form]}"
                if form == "number" and ":" in text:
                    problem += ", and no time as they are read"
                    remedy = "write it as 2024-03-05T14:03:00.002, or as a number"
                return RecordingError(problem, channel=key, remedy=remedy)
        return None


def layout(text: TextFile) -> Layout:
    """The layout of a file by lines of it; the suffix ``.tsv`` says that tabs set fields apart.

    Raises
    ------
    RecordingError
        If it has no lines, or several and none of numbers.
    """
    head, is_tabbed = text.head, text.path.suffix.lower() == ".tsv"
    plain = [number for number, line in enumerate(head) if is_plain(line)]
    if not plain:
        raise RecordingError("has no header line", remedy="it must start with one like x[arcsec]")
    # The first that splits rows into equal counts of numbers is taken: a comma may stand before
    # decimals and a blank within a name, a semicolon or a tab does neither.
    split = _judged(text, ("\t",) if is_tabbed else (";", "\t", "|", ",", " "))

    def begins(place: int) -> bool:
        return all(split.is_row(split.fields(head[i])) for i in plain[place : place + 3])

    start = next((line for place, line in enumerate(plain) if begins(place)), None)
    units: list[str | None]
    if start is None:
        # A header and no table under it.
        start, header = len(head), head[plain[0]]
        delimiter = "\t" if is_tabbed else max((",", "\t", ";", " "), key=header.count)
        names, line = fields_of(header, delimiter), 0
        second = head[plain[1]].strip() if len(plain) > 1 else ""
        if second and not all(map(PLAIN.holds, fields_of(second, delimiter))):
            problem = f"has no line of numbers; line {plain[1] + 1} is {second[:_LONGEST_SHOWN]!r}"
            raise RecordingError(problem, remedy="give a file whose columns hold numbers")
        units = [None] * len(names)
        split = _Split(delimiter=delimiter, count=len(names), style=PLAIN, share=0.0, rows=())
    else:
        names, units, line = _header(head[:start], split)
    places = range(split.count)
    forms = [_form([row[place] for row in split.rows if row[place]]) for place in places]
    headers = [names[place] or str(place + 1) for place in places]
    stated, known = _stated(headers, head[:line], split.delimiter)
    columns = []
    for place, (header, form) in enumerate(zip(headers, forms, strict=True)):
        is_time = form not in ("number", "integer")
        unit = form.partition("-")[0] if is_time else units[place] or known.get(header)
        key = f"{header} (column {place + 1})" if headers.count(header) > 1 else header
        columns.append(replace(column(header, unit=unit), key=key, number=place + 1))
    return Layout(
        text=text,
        columns=tuple(columns),
        forms=tuple(forms),
        delimiter=split.delimiter,
        stated=stated,
        style=split.style,
        skip=start,
        first_row=tuple(split.fields(head[start])) if start < len(head) else (),
        doubts=_doubts(split, text.encoding, is_named=any(names)) if split.rows else (),
    )


def _form(held: Sequence[str]) -> Form:
    """What the fields of a column are."""
    times = [form_of(text) for text in held]
    if times and times[0] and all(times):
        return "iso-day-first" if texts.is_day_first(held) else times[0]
    are_whole = all(re.fullmatch(r"[+-]?\d+", text) for text in held)
    return "integer" if are_whole and any(map(_LONG.match, held)) else "number"


def fields_of(line: str, delimiter: str) -> list[str]:
    """The fields of a line, without blanks around them.

    Examples
    --------
    >>> fields_of('"1,5", 2', ",")
    ['1,5', '2']
    """
    if delimiter == " ":
        line = " ".join(line.split())
    if '"' in line:
        reader = csv.reader([line], delimiter=delimiter, skipinitialspace=True)
        return [field.strip() for field in next(reader, [])]
    return [field.strip() for field in line.split(delimiter)] if line else []


def is_plain(line: str) -> bool:
    """Whether a line is neither empty nor a comment."""
    return bool(line.strip()) and not line.lstrip().startswith(COMMENT)


def _doubts(split: "_Split", encoding: str, *, is_named: bool) -> tuple[str, ...]:
    """Notes on what may have been meant otherwise, and what was taken."""
    doubts = []
    numbers = [text for row in split.rows for text in row if form_of(text) is None]
    if split.style.decimal == ",":
        problem = " (not a mark between thousands)" if texts.is_in_doubt(numbers) else ""
        doubts.append(f"a decimal comma{problem}")
    if mark := split.style.thousands:
        doubts.append(f"{mark!r} between thousands" if mark.isprintable() else "a blank there")
    is_either = split.delimiter == "," and split.count == 2 and not any("." in n for n in numbers)
    if is_either and not is_named:
        doubts.append("two columns with a comma between (not a decimal comma)")
    if encoding == "cp1252":
        doubts.append("letters of Windows-1252")
    return tuple(doubts)


# ---- rows --------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class _Split:
    """Lines split by one mark.

    `share` is that of fields which are numbers or times, in rows of the usual count; `numeric` are
    the places of the columns that mostly hold such: lines that hold none are of the header.
    """

    delimiter: str
    count: int
    style: NumberStyle
    share: float
    rows: tuple[tuple[str, ...], ...]
    numeric: tuple[int, ...] = ()

    def fields(self, line: str) -> list[str]:
        return [line.strip()] if self.count == 1 else fields_of(line, self.delimiter)

    def holds(self, text: str) -> bool:
        """Whether a field is a number or a time, or stands for a missing one."""
        return self.style.holds(text) or form_of(text) is not None

    def is_row(self, fields: Sequence[str]) -> bool:
        """Whether a line is one of the table: its columns of numbers and times hold such."""
        held = [fields[place] for place in self.numeric if len(fields) == self.count]
        return any(held) and all(map(self.holds, held))

    def table(self) -> "_Split":
        """The same with its `numeric` columns, and without lines of a header."""
        rows = [row for row in self.rows if any(text and self.holds(text) for text in row)]
        numeric = []
        for place in range(self.count):
            held = [row[place] for row in rows if row[place]]
            # A column is one of numbers or times if nine fields in ten are such.
            if held and sum(map(self.holds, held)) >= 0.9 * len(held):
                numeric.append(place)
        known = replace(self, numeric=tuple(numeric))
        return replace(known, rows=tuple(filter(known.is_row, self.rows)))


def _split(lines: Sequence[str], delimiter: str, count: int | None = None) -> _Split:
    """The lines split, those of `count` fields or, without, of the usual number."""
    rows = [[line.strip()] if count == 1 else fields_of(line, delimiter) for line in lines]
    if count is None:
        count = Counter(map(len, rows)).most_common(1)[0][0] if rows else 0
    usual = tuple(tuple(row) for row in rows if len(row) == count)
    filled = [text for row in usual for text in row if text]
    style = style_of([text for text in filled if form_of(text) is None])
    split = _Split(delimiter=delimiter, count=count, style=style, share=0.0, rows=usual)
    share = sum(map(split.holds, filled)) / max(len(filled), 1) * len(usual) / max(len(rows), 1)
    return replace(split, share=share)


def _judged(text: TextFile, delimiters: Sequence[str]) -> _Split:
    """The table split by the mark that leaves the most numbers.

    The mark is judged by the last lines, which are rows if anything is; how numbers are written,
    by as many lines as there are.
    """
    head, later = (list(filter(is_plain, lines)) for lines in (text.head, text.later))
    later = later[:: max(1, len(later) // _MOST_ROWS)]
    last = head[-min(max(4, len(head) // 4), _MOST_ROWS) :] if len(head) > 2 else head[-1:]
    # The last of the first lines that holds a word is the header if there is one.
    words = [line for line in head[:_MOST_ROWS] if re.search(r"[^\W\d_]{2,}|^[a-zA-Z]", line)]
    tried = [_split(last + later, one) for one in delimiters]
    # No number holds what stands between the fields of a file of one column.
    single = _split(last + later, ";", 1)
    several = [one for one in tried if one.count > 1]
    best = max(several, key=lambda one: round(one.share, 2), default=single)
    # "0,5" is one number with a decimal comma, or two: the header tells.
    named = len(fields_of(words[-1], best.delimiter)) if words else best.count
    if single.share > best.share or (single.share == best.share and named != best.count):
        best = single
    every = head[-_MOST_ROWS:] + head[:_MOST_ROWS] if len(head) > _MOST_ROWS else head
    return _split(every + later, best.delimiter, best.count).table()


# ---- header ------------------------------------------------------------------------


def _header(before: Sequence[str], split: _Split) -> tuple[list[str], list[str | None], int]:
    """Names and units of the columns, and the line that they begin on; empty names if none.

    The header is the last line before the table that has a name a column. A comment counts if it
    stands right before the table, and a line of units may stand between.

    Raises
    ------
    RecordingError
        If the line that must be it has another number of names.
    """
    filled = [i for i, line in enumerate(before) if line.strip(" \t,;|")]
    nothing = [""] * split.count
    units: list[str | None] = [None] * split.count
    if len(filled) > 1:
        above, last = (_names(before[line], split) for line in filled[-2:])
        is_named = len(above) == len({*above}) == split.count
        if len(stated := _units(last, is_named=is_named)) == split.count:
            units = stated
            filled.pop()
    if not filled:
        return nothing, units, 0
    line = filled[-1]
    names = _names(before[line], split)
    if len(names) == split.count and not all(map(PLAIN.holds, names)):
        groups = _groups(before[filled[-2]], split) if len(filled) > 1 else []
        if len(set(names)) < len(names) and groups:
            # "x" under "gyro" and "x" under "quaternion" are told apart by both rows.
            names = [f"{group} {name}".strip() for group, name in zip(groups, names, strict=True)]
            line = filled[-2]
        return names, units, line
    if is_plain(before[line]) and len(names) > 1 and split.count > 1:
        mark = {"\t": "a tab", " ": "blanks"}.get(split.delimiter, repr(split.delimiter))
        rows = f"the rows after it have {split.count} fields with {mark} between them"
        problem = f"line {line + 1} names {len(names)} columns and {rows}"
        remedy = "give every column a name, or remove that line and name columns by number"
        raise RecordingError(problem, remedy=remedy)
    return nothing, units, line + 1


def _names(line: str, split: _Split) -> list[str]:
    """Names in a header line, as many as columns if that can be."""
    text = line.strip("\r\n").lstrip()
    text = text.lstrip("".join(COMMENT)).strip(" ") if text.startswith(COMMENT) else line
    names = split.fields(text)
    if len(names) != split.count and split.delimiter == " ":
        for mark in (r"\t+|\s{2,}", r"\s*,\s*", r"\s*;\s*", r"\s+(?![\[(])"):
            other = [name.strip('" ') for name in re.split(mark, text.strip())]
            if len(other) == split.count:
                return other
    while len(names) > split.count and names[-1] in ("", "Comment"):
        names.pop()
    if len(names) == split.count - 1 and not any(row[-1] for row in split.rows):
        # Rows end with a mark, and the header does not.
        names.append("")
    return names


def _groups(line: str, split: _Split) -> list[str]:
    """Groups above the names of columns, each up to the next; none if it is no such row."""
    fields = split.fields(line)
    fields += [""] * (split.count - len(fields))
    if len(fields) != split.count or any(PLAIN.holds(one) for one in fields if one):
        return []
    groups = list(accumulate(fields, lambda last, one: one or last, initial=""))[1:]
    return groups if len({*groups}) > 1 else []


def _units(fields: Sequence[str], *, is_named: bool) -> list[str | None]:
    """The known units in a line of units; none if it is no such line.

    All its fields have to be known, or half of them if the line above names every column: "UTC" and
    "hPa" are no units here.
    """
    bare = [text.strip("[]() ") for text in fields]
    known = [text if is_known(text) else None for text in bare]
    filled = sum(map(bool, bare))
    if not filled or sum(map(bool, known)) < (0.5 * filled if is_named else filled):
        return []
    return known


# ---- known tables ------------------------------------------------------------------

_X_COLUMN: Final = "X_Value"
# Column of the times, its unit, and those of the gyros (rad/s) and of the accelerometers (m/s^2),
# which may be missing, by the name and the number of an axis, of tables that known programs write.
PRESETS: Final = (
    # The data sets' own descriptions: "EuRoC MAV" (ASL format), which TUM-VI follows.
    ("timestamp [ns]", "ns", "w_RS_S_{} [rad s^-1]", "a_RS_S_{} [m s^-2]"),
    # Kalibr, kalibr_bagextractor and kalibr_bagcreater: imu0.csv.
    ("timestamp", "ns", "omega_{}", "alpha_{}"),
    # ROS, rostopic echo -p: of a sensor_msgs/Imu, in SI.
    ("field.header.stamp", "ns", "field.angular_velocity.{}", "field.linear_acceleration.{}"),
    # PX4, ulog2csv: sensor_combined.
    ("timestamp", "us", "gyro_rad[{1}]", "accelerometer_m_s2[{1}]"),
)


# A statement, and units by the names of columns.
_Stated = tuple[Statement, Mapping[str, str]]


def _stated(names: Sequence[str], preamble: Sequence[str], delimiter: str) -> _Stated:
    """Statements of a known program by header and preamble, and units by the names of columns."""
    for time, unit, *quantities in PRESETS:
        rates, forces = (list(map(one.format, "xyz", range(3))) for one in quantities)
        if {time, *rates} <= set(names):
            units = {**dict.fromkeys(rates, "rad/s"), **dict.fromkeys(forces, "m/s^2"), time: unit}
            return of_rates(rates, forces if set(forces) <= set(names) else (), time), units
    if preamble and preamble[0].startswith("LabVIEW Measurement"):
        return _by_labview(names, preamble, delimiter)
    return Statement(), {}


def _by_labview(names: Sequence[str], preamble: Sequence[str], delimiter: str) -> _Stated:
    """Units of the channels, and the rate where no column holds the times."""
    rows = ([word.strip() for word in line.split(delimiter)] for line in preamble)
    values = {key: rest for key, *rest in rows}
    channels = [name for name in names if name != _X_COLUMN]
    stated = zip(channels, values.get("Y_Unit_Label", []), strict=False)
    units = {name: unit for name, unit in stated if is_known(unit)}
    steps = [text for text in values.get("Delta_X", []) if text]
    if steps and values.get("X_Columns", [""])[0].lower() == "no":
        style = style_of(steps)
        step = style.value(steps[0]) if style.holds(steps[0]) else 0.0
        if step > 0.0:
            # The step is written in decimals: 0.01 s stands for 100 Hz. X_Value is empty then.
            return Statement(sample_rate=round(1.0 / step, 9), time="none"), units
    if _X_COLUMN not in names:
        return Statement(), units
    return Statement(time=_X_COLUMN), {**units, _X_COLUMN: "s"}
