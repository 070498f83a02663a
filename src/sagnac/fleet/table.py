"""The table of a campaign: one line for each row, as CSV and Parquet."""

import csv
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import MISSING, dataclass, fields, replace
from pathlib import Path
from typing import Any, Final

import pyarrow as pa
import pyarrow.parquet as pq

from sagnac.errors import RecordingError
from sagnac.fleet.runner import Row
from sagnac.fleet.spans import span_of
from sagnac.fleet.tasks import Task
from sagnac.formats.files import replacing
from sagnac.report.files import write_text
from sagnac.report.tables import csv_text

NUMBER: Final = pa.float64()
TEXT: Final = pa.string()
COUNT: Final = pa.int64()


@dataclass(frozen=True, slots=True, kw_only=True)
class Line:
    """One line of the table.

    Attributes
    ----------
    file, unit, day, rate_deg_per_s, method, gyros
        What it is of; the rate is that of its label, else the mean that was measured.
    start_s, stop_s
        Of the span; NaN for a whole recording.
    state
        ``done``, ``failed`` or ``lost``.
    status, n_deg_per_sqrt_h, low, high
        N per gyro, deg/sqrt(h), as in ``analysis.json``; NaN if there is none.
    confidence
        Of the interval.
    b_deg_per_h, k_deg_per_h_per_sqrt_h
        Where they were estimated, else NaN.
    band_low_hz, band_high_hz
        That N rests on.
    verdict
        Against the specification, if there is one.
    duration_s, lines, notes
        Length, and how many lines and notes.
    reason
        Why there is no answer.
    report, key
        Folder of the report, and key of the result.
    same_as
        File of an earlier row with the same data, which count once; empty if there is none.
    """

    file: str
    unit: str
    day: str
    rate_deg_per_s: float
    method: str
    gyros: str
    start_s: float
    stop_s: float
    state: str
    status: str
    n_deg_per_sqrt_h: float
    low: float
    high: float
    confidence: float
    b_deg_per_h: float
    k_deg_per_h_per_sqrt_h: float
    band_low_hz: float
    band_high_hz: float
    verdict: str
    duration_s: float
    lines: int
    notes: int
    reason: str
    report: str
    key: str
    same_as: str = ""


_TYPES: Final[Mapping[object, pa.DataType]] = {str: TEXT, float: NUMBER, int: COUNT}


def lines_of(rows: Iterable[Row]) -> list[Line]:
    """The lines of rows; one whose data an earlier row has, too, names its file.

    A copy is no second measurement, whatever it is called and in whatever format it is.
    """
    first: dict[object, str] = {}
    lines = []
    for row in rows:
        line, data = line_of(row), _data_of(row)
        if data is not None and data in first:
            line = replace(line, same_as=first[data])
        first.setdefault(data, line.file)
        lines.append(line)
    return lines


def _data_of(row: Row) -> object:
    """Fingerprint that no two measurements share: the curve to nine digits, and how it was made."""
    curve = row.result.analysis.get("curve", {}).get("deviation_deg_per_h")
    if row.result.state != "done" or not curve:
        return None
    task = row.task
    points = tuple(f"{value:.8e}" for value in curve)
    return task.settings.method, task.settings.interval, span_of(task), points


def line_of(row: Row) -> Line:
    """The line of a row."""
    task, analysis = row.task, row.result.analysis
    answer = analysis.get("angle_random_walk", {})
    given = analysis.get("input", {})
    start, stop = span_of(task) or (math.nan, math.nan)
    band = answer.get("band_hz", [None, None])
    return Line(
        file=task.path,
        unit=task.labels.get("unit", ""),
        day=task.labels.get("day", ""),
        rate_deg_per_s=_rate(task, given.get("table_rate_deg_per_s"), measured=bool(analysis)),
        method=task.settings.method,
        gyros=",".join(given.get("gyros", task.settings.gyros)),
        start_s=start,
        stop_s=stop,
        state=row.result.state,
        status=answer.get("status", ""),
        n_deg_per_sqrt_h=_number(answer.get("value")),
        low=_number(answer.get("low")),
        high=_number(answer.get("high")),
        confidence=task.settings.confidence,
        b_deg_per_h=_estimated(analysis, "bias_instability"),
        k_deg_per_h_per_sqrt_h=_estimated(analysis, "rate_random_walk"),
        band_low_hz=_number(band[0]),
        band_high_hz=_number(band[1]),
        verdict=_verdict(analysis.get("verdict")),
        duration_s=_number(given.get("duration_s")),
        lines=int(analysis.get("lines", 0)),
        notes=len(analysis.get("notes", ())),
        reason=row.result.reason,
        report=row.result.report,
        key=row.result.key,
    )


def write_tables(lines: Sequence[Line], folder: Path) -> tuple[Path, Path]:
    """Write ``campaign.csv`` and ``campaign.parquet``.

    Numbers of the CSV have all their digits, so that two tables of the same campaign are the same
    text.

    Raises
    ------
    RecordingError
        If the folder cannot be written to.
    """
    names = [field.name for field in fields(Line)]
    text = csv_text(names, ([_cell(getattr(one, name)) for name in names] for one in lines))
    write_text(folder / "campaign.csv", text)
    columns = {
        field.name: pa.array([_null(getattr(one, field.name)) for one in lines], _TYPES[field.type])
        for field in fields(Line)
    }
    with replacing(folder / "campaign.parquet") as temporary:
        pq.write_table(pa.table(columns), temporary)
    return folder / "campaign.csv", folder / "campaign.parquet"


def read_table(path: Path) -> list[Line]:
    """The lines of a ``campaign.csv``, or of the one in a folder.

    Raises
    ------
    RecordingError
        If there is none, or it is no table of a campaign.
    """
    file = path / "campaign.csv" if path.is_dir() else path
    remedy = "give the folder of a campaign or its campaign.csv"
    try:
        text = file.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        problem = error.strerror if isinstance(error, OSError) else "not UTF-8"
        raise RecordingError(f"cannot be read ({problem})", path=str(file), remedy=remedy) from None
    try:
        return [_line_of_texts(row) for row in csv.DictReader(text.splitlines())]
    except (KeyError, ValueError, TypeError) as error:
        raise RecordingError(
            f"is no table of a campaign ({error})", path=str(file), remedy=remedy
        ) from None


def _line_of_texts(row: Mapping[str, str]) -> Line:
    values: dict[str, Any] = {}
    for field in fields(Line):
        # A table of an earlier version has no column for what has a default.
        text = row[field.name] if field.default is MISSING else row.get(field.name, "")
        if field.type is str:
            values[field.name] = text
        else:
            values[field.name] = float(text or "nan") if field.type is float else int(text)
    return Line(**values)


def groups_of(lines: Iterable[Line]) -> dict[tuple[str, str], list[Line]]:
    """Lines of whole recordings by method and gyros, equal data once: what may be compared."""
    groups: dict[tuple[str, str], list[Line]] = {}
    for line in lines:
        if math.isnan(line.start_s) and not line.same_as:
            groups.setdefault((line.method, line.gyros), []).append(line)
    return groups


def _rate(task: Task, table_rate: Any, *, measured: bool) -> float:
    """Table rate in deg/s: the label's, else the measured one to 0.1 deg/s; 0 at rest."""
    label = task.labels.get("rate", "")
    try:
        return float(label)
    except ValueError:
        if not measured:
            return math.nan
        return 0.0 if table_rate is None else round(abs(float(table_rate)), 1)


def _verdict(verdict: Any) -> str:
    """The decision of an ``analysis.json``, which holds one only if a specification was given."""
    if isinstance(verdict, Mapping):
        return str(verdict.get("overall", ""))
    return verdict if isinstance(verdict, str) else ""


def _estimated(analysis: Any, name: str) -> float:
    found = analysis.get("coefficients", {}).get(name, {})
    return _number(found.get("value")) if found.get("status") == "estimated" else math.nan


def _number(value: Any) -> float:
    return math.nan if value is None else float(value)


def _null(value: Any) -> Any:
    return None if isinstance(value, float) and math.isnan(value) else value


def _cell(value: Any) -> str:
    value = _null(value)
    return "" if value is None else repr(value) if isinstance(value, float) else str(value)
