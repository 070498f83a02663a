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
from functools import partial
from typing import Final

from sagnac.core.errors import RecordingError
from sagnac.formats.statement import Statement, parsed_unit
from sagnac.formats.text import PLAIN, NumberStyle, Sample, TimeForm, form_of, is_in_doubt, style_of
from sagnac.recording.columns import ACCELEROMETER_NAMES, GYRO_NAMES

# ---- labview -----------------------------------------------------------------------

_BEGINNING: Final = "LabVIEW Measurement"
X_COLUMN: Final = "X_Value"


@dataclass(frozen=True, slots=True, kw_only=True)
class Preamble:
    """Statements of a preamble.

    Attributes
    ----------
    units
        Units of the channels, in their order; one that is not stated is empty.
    sample_rate
        Hz, where no column holds the times; None if one does.
    """

    units: tuple[str, ...] = ()
    sample_rate: float | None = None


def preamble_of(lines: Sequence[str], delimiter: str) -> Preamble | None:
    """The preamble among the lines before a table, None if LabVIEW did not write them.

    Parameters
    ----------
    lines
        From the first of the file.
    delimiter
        Between two fields.

    Examples
    --------
    >>> lines = ["LabVIEW Measurement", "X_Columns;No", "Delta_X;0,01", "Y_Unit_Label;deg/s"]
    >>> preamble_of(lines, ";")
    Preamble(units=('deg/s',), sample_rate=100.0)
    """
    if not lines or not lines[0].startswith(_BEGINNING):
        return None
    values: dict[str, list[str]] = {}
    for line in lines:
        key, *rest = line.split(delimiter)
        values[key.strip()] = [value.strip() for value in rest]
    units = values.get("Y_Unit_Label", [])
    steps = [text for text in values.get("Delta_X", []) if text]
    rate = None
    if steps and values.get("X_Columns", [""])[0].lower() == "no":
        style = style_of(steps)
        step = style.value(steps[0]) if style.holds(steps[0]) else 0.0
        # The step is written in decimals: 0.01 s stands for 100 Hz.
        rate = round(1.0 / step, 9) if step > 0.0 else None
    return Preamble(units=tuple(units), sample_rate=rate)


# ---- text presets ------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class Preset:
    """A table that a known program writes.

    Attributes
    ----------
    name
        Of the program or the data set.
    gyros
        Gyro -> name of its column.
    unit
        Of the gyros, which are rates.
    time
        Name and unit of the column of times.
    accelerometers
        Accelerometer -> name of its column, m/s²; they may be missing.
    """

    name: str
    gyros: Mapping[str, str]
    unit: str
    time: tuple[str, str]
    accelerometers: Mapping[str, str]

    def is_of(self, names: Sequence[str]) -> bool:
        """Whether a table with these columns is of this kind."""
        return {self.time[0], *self.gyros.values()} <= set(names)

    @property
    def units(self) -> dict[str, str]:
        """Units of the columns that it names."""
        name, unit = self.time
        return {
            **dict.fromkeys(self.gyros.values(), self.unit),
            **dict.fromkeys(self.accelerometers.values(), "m/s^2"),
            name: unit,
        }

    def statement(self, names: Sequence[str]) -> Statement:
        """Statements of a table with these columns."""
        has_all = set(self.accelerometers.values()) <= set(names)
        accelerometers = self.accelerometers if has_all else {}
        return Statement(
            kind="rate",
            columns={**self.gyros, **accelerometers},
            gyros=tuple(self.gyros),
            accelerometers=tuple(accelerometers) or None,
            time=self.time[0],
        )


def _axes(pattern: str, axes: str = "xyz", names: Sequence[str] = GYRO_NAMES) -> dict[str, str]:
    return {name: pattern.format(axis) for name, axis in zip(names, axes, strict=True)}


_forces = partial(_axes, names=ACCELEROMETER_NAMES)


PRESETS: Final = (
    # The data sets' own descriptions: "EuRoC MAV" (ASL format), which TUM-VI follows.
    Preset(
        name="EuRoC or TUM-VI", unit="rad/s", time=("timestamp [ns]", "ns"),
        gyros=_axes("w_RS_S_{} [rad s^-1]"), accelerometers=_forces("a_RS_S_{} [m s^-2]"),
    ),
    # Kalibr, kalibr_bagextractor and kalibr_bagcreater: imu0.csv.
    Preset(
        name="Kalibr", unit="rad/s", time=("timestamp", "ns"),
        gyros=_axes("omega_{}"), accelerometers=_forces("alpha_{}"),
    ),
    # ROS, rostopic echo -p: of a sensor_msgs/Imu, in SI.
    Preset(
        name="rostopic echo", unit="rad/s", time=("field.header.stamp", "ns"),
        gyros=_axes("field.angular_velocity.{}"),
        accelerometers=_forces("field.linear_acceleration.{}"),
    ),
    # PX4, ulog2csv: sensor_combined.
    Preset(
        name="ulog2csv", unit="rad/s", time=("timestamp", "us"),
        gyros=_axes("gyro_rad[{}]", "012"),
        accelerometers=_forces("accelerometer_m_s2[{}]", "012"),
    ),
)  # fmt: skip


def preset_of(names: Sequence[str]) -> Preset | None:
    """The preset that a table with these columns is of, None if it is of none.

    Examples
    --------
    >>> preset_of(["timestamp", "omega_x", "omega_y", "omega_z", "alpha_x"]).name
    'Kalibr'
    """
    return next((preset for preset in PRESETS if preset.is_of(names)), None)


# ---- text layout -------------------------------------------------------------------

# The first that splits rows into equal counts of numbers is taken: a comma may stand before
# decimals and a blank within a name, a semicolon or a tab does neither.
_DELIMITERS: Final = (";", "\t", "|", ",", " ")
# Stands between the fields of a file of one column: no number holds it.
_NOTHING: Final = ";"
_COMMENT: Final = "#%"
_MOST_ROWS: Final = 200
# A column is one of numbers or times if this share of its fields are such.
_MOSTLY: Final = 0.9
# An integer of more digits loses some as a float of 64 bits.
_DIGITS_OF_FLOAT: Final = 15


@dataclass(frozen=True, slots=True, kw_only=True)
class Field:
    """One column of a text file.

    Attributes
    ----------
    name
        As its header has it, or its number if it has none.
    unit
        As the line of units under the header states it, or None.
    time
        How its times are written; None for a column of numbers.
    is_long
        Whether it holds integers too long for a float, such as stamps in ns since 1970.
    """

    name: str
    unit: str | None = None
    time: TimeForm | None = None
    is_long: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Layout:
    """How a text file is laid out.

    Attributes
    ----------
    fields
        The columns, in their order.
    delimiter
        Between two fields; a blank stands for any number of blanks and tabs.
    style
        How numbers are written.
    skip
        Lines before the first row of numbers.
    preamble
        The lines before the header.
    first_row
        Fields of that row, empty where there is none.
    doubts
        What the rows do not tell for sure, as it was taken; empty if nothing.
    """

    fields: tuple[Field, ...]
    delimiter: str
    style: NumberStyle = PLAIN
    skip: int = 0
    preamble: tuple[str, ...] = ()
    first_row: tuple[str, ...] = ()
    doubts: tuple[str, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the columns."""
        return tuple(field.name for field in self.fields)


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


@dataclass(frozen=True, slots=True, kw_only=True)
class _Split:
    """Rows split by one mark.

    `share` is that of fields which are numbers or times, in rows of the usual count.
    """

    delimiter: str
    count: int
    style: NumberStyle
    share: float
    rows: tuple[tuple[str, ...], ...]


def _split(lines: Sequence[str], delimiter: str, *, count: int | None = None) -> _Split:
    """The lines split, those of `count` fields or, without, of the usual number."""
    single = count == 1
    rows = [[line.strip()] if single else fields_of(line, delimiter) for line in lines]
    if count is None:
        count = Counter(map(len, rows)).most_common(1)[0][0] if rows else 0
    usual = tuple(tuple(row) for row in rows if len(row) == count)
    filled = [text for row in usual for text in row if text]
    style = style_of([text for text in filled if form_of(text) is None])
    number = sum(style.holds(text) or form_of(text) is not None for text in filled)
    share = number / max(len(filled), 1) * len(usual) / max(len(rows), 1)
    return _Split(delimiter=delimiter, count=count, style=style, share=share, rows=usual)


def _holds(text: str, split: _Split) -> bool:
    """Whether a field is a number or a time, or stands for a missing one."""
    return split.style.holds(text) or form_of(text) is not None


def _is_row(fields: Sequence[str], split: _Split, numeric: Sequence[int]) -> bool:
    """Whether a line is one of the table: its columns of numbers and times hold such."""
    if len(fields) != split.count:
        return False
    held = [fields[column] for column in numeric]
    return any(held) and all(_holds(text, split) for text in held)


def _numeric(split: _Split) -> list[int]:
    """Columns that mostly hold numbers or times; lines that hold none are of the header."""
    rows = [row for row in split.rows if any(text and _holds(text, split) for text in row)]
    found = []
    for column in range(split.count):
        texts = [row[column] for row in rows if row[column]]
        if texts and sum(_holds(text, split) for text in texts) >= _MOSTLY * len(texts):
            found.append(column)
    return found


def _is_plain(line: str) -> bool:
    """Whether a line is neither empty nor a comment."""
    return bool(line.strip()) and line.lstrip()[0] not in _COMMENT


def _judged(sample: Sample, *, tabs: bool) -> _Split:
    """The rows split by the likeliest mark.

    The mark is judged by the last lines, which are rows if anything is; how numbers are written,
    by as many lines as there are.
    """
    head = [line for line in sample.head if _is_plain(line)]
    later = [line for line in sample.later if _is_plain(line)]
    later = later[:: max(1, len(later) // _MOST_ROWS)]
    last = head[-min(max(4, len(head) // 4), _MOST_ROWS) :] if len(head) > 2 else head[-1:]
    best = _best(last + later, _first_words(head), tabs=tabs)
    every = head[-_MOST_ROWS:] + head[:_MOST_ROWS] if len(head) > _MOST_ROWS else head
    return _split(every + later, best.delimiter, count=best.count)


def _best(lines: Sequence[str], header: str, *, tabs: bool) -> _Split:
    """The lines split by the mark that leaves the most numbers."""
    tried = [_split(lines, one) for one in (("\t",) if tabs else _DELIMITERS)]
    several = [one for one in tried if one.count > 1]
    single = _split(lines, _NOTHING, count=1)
    best = max(several, key=lambda one: round(one.share, 2), default=single)
    if single.share < best.share or best is single:
        return best
    # "0,5" is one number with a decimal comma, or two: the header tells.
    named = len(fields_of(header, best.delimiter)) if header else best.count
    return best if best.share >= single.share and named == best.count else single


def layout(sample: Sample, *, tabs: bool = False) -> Layout:
    """The layout of a file from lines of it.

    Parameters
    ----------
    sample
        Lines of the file.
    tabs
        Whether tabs are known to set fields apart; else the likeliest mark is found.

    Raises
    ------
    RecordingError
        If it has no lines.
    """
    if not any(map(_is_plain, sample.head)):
        raise RecordingError("has no header line", remedy="it must start with one like x[arcsec]")
    split = _judged(sample, tabs=tabs)
    numeric = _numeric(split)
    # Lines of the header may be among them.
    table = tuple(row for row in split.rows if _is_row(row, split, numeric))
    split = replace(split, rows=table)
    start = _first_row(sample.head, split, numeric)
    if start is None:
        return _without_rows(sample.head, tabs=tabs)
    header = _header(sample.head[:start], split)
    times = {column: _time_form(split, column) for column in numeric}
    fields = tuple(
        Field(
            name=header.names[column] or str(column + 1),
            unit=header.units[column],
            time=times.get(column),
            is_long=column in numeric and times[column] is None and _is_long(split, column),
        )
        for column in range(split.count)
    )
    return Layout(
        fields=fields,
        delimiter=split.delimiter,
        style=split.style,
        skip=start,
        preamble=sample.head[: header.line],
        first_row=tuple(_fields(sample.head[start], split)),
        doubts=_doubts(split, header, sample.encoding),
    )


def _first_words(lines: Sequence[str]) -> str:
    """The last of the first lines that holds a word, which is the header if there is one."""
    words = [line for line in lines[:_MOST_ROWS] if re.search(r"[^\W\d_]{2,}|^[a-zA-Z]", line)]
    return words[-1] if words else ""


def _fields(line: str, split: _Split) -> list[str]:
    return [line.strip()] if split.count == 1 else fields_of(line, split.delimiter)


def _first_row(head: Sequence[str], split: _Split, numeric: Sequence[int]) -> int | None:
    """Number of the first line of the table, None if there is none."""
    if not numeric:
        return None
    usable = [i for i, line in enumerate(head) if _is_plain(line)]
    for place, line in enumerate(usable):
        following = usable[place + 1 : place + 3]
        if all(_is_row(_fields(head[i], split), split, numeric) for i in (line, *following)):
            return line
    return None


def _time_form(split: _Split, column: int) -> TimeForm | None:
    texts = [row[column] for row in split.rows if row[column]]
    forms = [form_of(text) for text in texts]
    return next((form for form in forms if form), None) if all(forms) else None


def _is_long(split: _Split, column: int) -> bool:
    texts = [row[column] for row in split.rows if row[column]]
    return all(re.fullmatch(r"[+-]?\d+", text) for text in texts) and any(
        len(text.lstrip("+-")) > _DIGITS_OF_FLOAT for text in texts
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Header:
    """Names and units of the columns, and the line that they begin on."""

    names: tuple[str, ...]
    units: tuple[str | None, ...]
    line: int
    is_there: bool


def _header(before: Sequence[str], split: _Split) -> _Header:
    """The header: the last line before the table that has a name a column.

    A comment counts if it stands right before the table, and a line of units may stand between.

    Raises
    ------
    RecordingError
        If the line that must be it has another number of names.
    """
    filled = [i for i, line in enumerate(before) if line.strip(" \t,;|")]
    units: tuple[str | None, ...] = (None,) * split.count
    if filled:
        stated = _units(_names(before[filled[-1]], split))
        if len(filled) > 1 and stated is not None and len(stated) == split.count:
            units = stated
            filled.pop()
    if not filled:
        return _Header(names=("",) * split.count, units=units, line=0, is_there=False)
    line = filled[-1]
    is_comment = before[line].lstrip()[0] in _COMMENT
    names = _names(before[line], split)
    if len(names) == split.count and not all(PLAIN.holds(name) for name in names):
        groups = _groups(before[filled[-2]], split) if len(filled) > 1 else None
        if len(set(names)) < len(names) and groups is not None:
            # "x" under "gyro" and "x" under "quaternion" are told apart by both rows.
            names = [f"{group} {name}".strip() for group, name in zip(groups, names, strict=True)]
            line = filled[-2]
        return _Header(names=tuple(names), units=units, line=line, is_there=True)
    if not is_comment and len(names) > 1 and split.count > 1:
        raise RecordingError(
            f"line {line + 1} names {len(names)} columns and the rows after it have {split.count}"
            f" fields with {_said(split.delimiter)} between them",
            remedy="give every column a name, or remove that line and name columns by number",
        )
    return _Header(names=("",) * split.count, units=units, line=line + 1, is_there=False)


def _names(line: str, split: _Split) -> list[str]:
    """Names in a header line, as many as columns if that can be."""
    text = line.strip("\r\n").lstrip()
    text = text.lstrip(_COMMENT).strip(" ") if text[:1] in _COMMENT and text else line
    names = _fields(text, split)
    if len(names) != split.count and split.delimiter == " ":
        for mark in (r"\t+|\s{2,}", r"\s*,\s*", r"\s*;\s*", r"\s+(?![\[(])"):
            other = [name.strip('" ') for name in re.split(mark, text.strip())]
            if len(other) == split.count:
                return other
    while len(names) > split.count and names[-1] in ("", "Comment"):
        names.pop()
    return names


def _groups(line: str, split: _Split) -> list[str] | None:
    """Groups above the names of columns, each up to the next; None if it is no such row."""
    fields = _fields(line, split)
    fields += [""] * (split.count - len(fields))
    if len(fields) != split.count or any(PLAIN.holds(one) for one in fields if one):
        return None
    groups, last = [], ""
    for one in fields:
        last = one or last
        groups.append(last)
    return groups if len({*groups}) > 1 else None


def _units(fields: Sequence[str]) -> tuple[str | None, ...] | None:
    """The units in a line that holds nothing else, None if it does."""
    bare = [text.strip("[]() ") for text in fields]
    if not any(bare) or not all(not text or parsed_unit(text).is_known for text in bare):
        return None
    # A column of the name "s" or "as" may be one; two such in a row are units.
    return tuple(text or None for text in bare)


def _said(delimiter: str) -> str:
    return {"\t": "a tab", " ": "blanks"}.get(delimiter, repr(delimiter))


def _doubts(split: _Split, header: _Header, encoding: str) -> tuple[str, ...]:
    """Notes on what may have been meant otherwise, and what was taken."""
    doubts = []
    numbers = [text for row in split.rows for text in row if form_of(text) is None]
    if split.style.decimal == ",":
        said = "a decimal comma"
        if is_in_doubt(numbers):
            said += " (not a mark between thousands)"
        doubts.append(said)
    if split.style.thousands:
        mark = split.style.thousands
        doubts.append(f"{mark!r} between thousands" if mark.isprintable() else "a blank there")
    is_either = split.delimiter == "," and split.count == 2 and not any("." in n for n in numbers)
    if is_either and not header.is_there:
        doubts.append("two columns with a comma between (not a decimal comma)")
    if encoding == "cp1252":
        doubts.append("letters of Windows-1252")
    return tuple(doubts)


def _without_rows(head: Sequence[str], *, tabs: bool) -> Layout:
    """The layout of a file that has a header and no table under it."""
    lines = [line for line in head if line.strip()]
    header = next(line for line in lines if _is_plain(line))
    delimiter = "\t" if tabs else max((",", "\t", ";", " "), key=header.count)
    names = fields_of(header, delimiter)
    return Layout(
        fields=tuple(Field(name=name or str(i + 1)) for i, name in enumerate(names)),
        delimiter=delimiter,
        skip=len(head),
        first_row=(),
    )
