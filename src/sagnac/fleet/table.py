"""The table of a campaign, and what it says: scatter of N, its prior, limits that are kept."""

import csv
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import MISSING, dataclass, field, fields
from pathlib import Path
from typing import Any, Final

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from scipy.special import betaincinv, ndtri

from sagnac.core.errors import RecordingError, counted, per_cent, visible
from sagnac.core.units import DEGREE_PER_ROOT_HOUR, field_unit
from sagnac.core.whole_files import replacing, write_text
from sagnac.fleet import runner, study
from sagnac.fleet.tasks import Row
from sagnac.formats.files import about
from sagnac.navigation.noise import GyroNoise
from sagnac.noise.laws import SYMBOLS
from sagnac.report.tables import csv_text
from sagnac.verdict.judgement import Decision, overall

# ---- table -------------------------------------------------------------------------


_WHOLE: Final = (math.nan, math.nan)


def _column(of: Callable[[Row], Any]) -> Any:
    """A column of the table, made of a row."""
    return field(metadata={"of": of})


def _number(row: Row, *keys: str | int) -> float:
    """A number of an analysis at these keys; NaN without it."""
    value: Any = row.analysis
    try:
        for key in keys:
            value = value[key]
    except KeyError:
        return math.nan
    return math.nan if value is None else float(value)


def _estimated(row: Row, name: str) -> float:
    """A coefficient in the field's unit, if it was estimated."""
    status = row.analysis.get("coefficients", {}).get(name, {}).get("status")
    return _number(row, "coefficients", name, "value") if status == "estimated" else math.nan


def _gyros(row: Row) -> tuple[str, ...]:
    """Names of the gyros of a recording that could be read."""
    return tuple(row.analysis.get("input", {}).get("gyros", ()))


def _rate(row: Row) -> float:
    """Table rate in deg/s: the label's, else the measured one to 0.1 deg/s; 0 at rest."""
    try:
        return float(row.task.labels.get("rate", ""))
    except ValueError:
        rate = row.analysis["input"].get("table_rate_deg_per_s") if row.analysis else math.nan
        return 0.0 if rate is None else round(abs(float(rate)), 1)


def _verdict(row: Row) -> str:
    """The verdict, empty if nothing was stated to be kept; what was not measured is undecided."""
    if row.state == "done":
        return str(row.analysis.get("verdict", {}).get("overall", ""))
    return "" if row.task.settings.specification is None else "undecided"


def _reason(analysis: Mapping[str, Any]) -> str:
    """The reason why a row has no estimate, and then why it does not pass; empty if none."""
    answer, reasons = analysis.get("angle_random_walk", {}), []
    if answer and answer["status"] != "estimated":
        reasons = [one["text"] for one in analysis.get("findings", ()) if one["level"] == "error"]
        reasons = reasons or ([answer["source"]] if "source" in answer else [])
    limits = analysis.get("verdict", {}).get("limits", ())
    missed = [one for one in limits if one["verdict"] != "pass"]
    reasons += [f"{SYMBOLS[one['coefficient']]}: {one['reason']}" for one in missed]
    return "; ".join(dict.fromkeys(reasons))


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
        Why there is no answer, or only a bound, and why a limit is not kept or not decided.
    report, key
        Folder of the report, and key of the result.
    same_as
        File of an earlier row with the same data, which count once; empty if there is none.
    """

    file: str = _column(lambda row: visible(row.task.path))
    unit: str = _column(lambda row: visible(row.task.labels.get("unit", "")))
    day: str = _column(lambda row: visible(row.task.labels.get("day", "")))
    rate_deg_per_s: float = _column(_rate)
    method: str = _column(lambda row: row.task.settings.method)
    gyros: str = _column(lambda row: ",".join(_gyros(row) or row.task.settings.gyros))
    start_s: float = _column(lambda row: (row.task.span or _WHOLE)[0])
    stop_s: float = _column(lambda row: (row.task.span or _WHOLE)[1])
    state: str = _column(lambda row: row.state)
    status: str = _column(lambda row: row.analysis.get("angle_random_walk", {}).get("status", ""))
    n_deg_per_sqrt_h: float = _column(lambda row: _number(row, "angle_random_walk", "value"))
    low: float = _column(lambda row: _number(row, "angle_random_walk", "low"))
    high: float = _column(lambda row: _number(row, "angle_random_walk", "high"))
    confidence: float = _column(lambda row: row.task.settings.confidence)
    b_deg_per_h: float = _column(lambda row: _estimated(row, "bias_instability"))
    k_deg_per_h_per_sqrt_h: float = _column(lambda row: _estimated(row, "rate_random_walk"))
    band_low_hz: float = _column(lambda row: _number(row, "angle_random_walk", "band_hz", 0))
    band_high_hz: float = _column(lambda row: _number(row, "angle_random_walk", "band_hz", 1))
    verdict: str = _column(_verdict)
    duration_s: float = _column(lambda row: _number(row, "input", "duration_s"))
    lines: int = _column(lambda row: len(row.analysis.get("lines", ())))
    notes: int = _column(lambda row: len(row.analysis.get("notes", ())))
    reason: str = _column(lambda row: row.reason or _reason(row.analysis))
    report: str = _column(lambda row: row.report)
    key: str = _column(lambda row: row.task.key)
    same_as: str = ""


_FIELDS: Final = fields(Line)
_TYPES: Final[dict[Any, Any]] = {str: pa.string(), float: pa.float64(), int: pa.int64()}


def lines_of(rows: Iterable[Row]) -> list[Line]:
    """The lines of rows; one whose data an earlier row has, too, names its file.

    A copy is no second measurement, whatever it is called and in whatever format it is. One that
    was not measured is told by its key, which holds the digest of the file.
    """
    first: dict[object, str] = {}
    lines = []
    for row in rows:
        data, columns = _data_of(row), [one for one in _FIELDS if one.metadata]
        same_as = first.get(data, "") if data is not None else ""
        first.setdefault(data, row.task.path)
        values = {column.name: column.metadata["of"](row) for column in columns}
        lines.append(Line(**values, same_as=visible(same_as)))
    return lines


def _data_of(row: Row) -> object:
    """Fingerprint that no two measurements share: the curve to nine digits, and how it was made."""
    task, analysis = row.task, row.analysis
    if row.state != "done":
        return task.key, _gyros(row)
    curve = analysis.get("curve", {}).get("deviation_deg_per_h")
    if not curve:
        return None
    points = tuple(f"{value:.8e}" for value in curve)
    return task.settings.method, task.settings.interval, task.span, points


def write_tables(lines: Sequence[Line], folder: Path) -> tuple[Path, Path]:
    """Write ``campaign.csv`` and ``campaign.parquet``.

    Numbers of the CSV have all their digits, so that two tables of the same campaign are the same
    text.

    Raises
    ------
    RecordingError
        If the folder cannot be written to.
    """
    columns = {}
    for column in _FIELDS:
        held = [getattr(line, column.name) for line in lines]
        columns[column.name] = pa.array(held, _TYPES[column.type], from_pandas=True)
    rows = zip(*(column.to_pylist() for column in columns.values()), strict=True)
    cells = (["" if value is None else str(value) for value in row] for row in rows)
    write_text(folder / "campaign.csv", csv_text(list(columns), cells))
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
    remedy = "give an analysis.json, the folder of a campaign, or its campaign.csv"
    try:
        text = file.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        problem = error.strerror if isinstance(error, OSError) else "not UTF-8"
        raise RecordingError(f"cannot be read ({problem})", path=str(file), remedy=remedy) from None
    try:
        return [_line_of_texts(row) for row in csv.DictReader(text.splitlines())]
    except KeyError:
        raise RecordingError("is no table of a campaign", path=str(file), remedy=remedy) from None
    except (ValueError, TypeError):
        raise RecordingError("has a row that is cut", path=str(file), remedy=remedy) from None


def rows_replaced(folder: Path, rows: Iterable[Row]) -> int:
    """How many lines the ``campaign.csv`` of a folder has that are of none of these rows."""
    try:
        before = read_table(folder)
    except RecordingError:
        return 0
    keys = {row.task.key for row in rows}
    return sum(line.key not in keys for line in before)


def _line_of_texts(row: Mapping[str, str]) -> Line:
    values: dict[str, Any] = {}
    for column in _FIELDS:
        # A table of an earlier version has no column for what has a default.
        text = row[column.name] if column.default is MISSING else row.get(column.name, "")
        if column.type is str:
            values[column.name] = text
        else:
            values[column.name] = float(text or "nan") if column.type is float else int(text)
    return Line(**values)


def is_whole(line: Line) -> bool:
    """Whether a line is of a whole recording whose data no earlier one has."""
    return math.isnan(line.start_s) and not line.same_as


def groups_of(lines: Iterable[Line]) -> dict[tuple[str, str], list[Line]]:
    """What may be compared: answers of whole recordings by method and gyros, equal data once."""
    groups: dict[tuple[str, str], list[Line]] = {}
    for line in lines:
        if is_whole(line) and line.state == "done":
            groups.setdefault((line.method, line.gyros), []).append(line)
    return groups


def left_out(lines: Iterable[Line]) -> str:
    """How many whole recordings have no answer or no label, in words; empty if none."""
    whole = [line for line in lines if is_whole(line)]
    count = sum(line.state != "done" for line in whole)
    words = [f"{counted(count, 'row')} without an answer left out"] if count else []
    for name in ("unit", "day"):
        bare = sum(not getattr(line, name) for line in whole)
        if 0 < bare < len(whole):
            words.append(f"{counted(bare, 'row')} without a {name}, each taken for one of its own")
    return "; ".join(words)


# ---- scatter -----------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class Scatter:
    """Scatter of one group.

    Attributes
    ----------
    lines
        Those that show N, in the order of the runs.
    left_out
        How many of the group do not.
    answer
        In deg/sqrt(h); None if the lines are too few.
    why
        Why there is none.
    """

    lines: tuple[Line, ...]
    left_out: int
    answer: study.Repeatability | None
    why: str = ""


def scatter_of(lines: Sequence[Line], confidence: float | None = None) -> Scatter:
    """How N scatters over the units, days and rates of some lines.

    Parameters
    ----------
    lines
        Of one method and one choice of gyros.
    confidence
        Of the intervals; that of the lines unless given.
    """
    shown = tuple(line for line in lines if line.status == "estimated")
    runs = [
        study.Run(
            value=line.n_deg_per_sqrt_h,
            low=line.low,
            high=line.high,
            confidence=line.confidence,
            labels={"unit": line.unit, "day": line.day, "rate": f"{line.rate_deg_per_s:g}"},
        )
        for line in shown
    ]
    answer, why = None, ""
    try:
        answer = study.repeatability(runs, confidence=confidence or lines[0].confidence)
    except RecordingError as error:
        why = str(error)
    return Scatter(lines=shown, left_out=len(lines) - len(shown), answer=answer, why=why)


# ---- prior -------------------------------------------------------------------------


def prior_of(path: Path, *, confidence: float = 0.95) -> tuple[GyroNoise, str]:
    """N of the next unit on a new day or, if the campaign has one unit, of its next day.

    Parameters
    ----------
    path
        Folder of a campaign, or its ``campaign.csv``.
    confidence
        Of the interval that is foretold.

    Returns
    -------
    noise
        N is the median that is foretold, and the root of its variance half of the interval over
        the normal quantile, both of ln N; B and K were not foretold.
    words
        Of what it is foretold, and from what.

    Raises
    ------
    RecordingError
        If it is no campaign, has several methods or choices of gyros, or does not show how N
        scatters over days.
    """
    table = read_table(path)
    with about(path):
        groups = groups_of(table)
        if len(groups) != 1:
            held = "; ".join(f"{method} of {gyros}" for method, gyros in groups)
            remedy = "give a campaign of one method and one choice of gyros ({gyros x})"
            raise RecordingError(f"holds {held or 'no recording with an answer'}", remedy=remedy)
        (lines,) = groups.values()
        scatter = scatter_of(lines, confidence)
        if scatter.answer is None:
            raise RecordingError(scatter.why)
        foretold, what = scatter.answer.next_unit, "the next unit on a new day, at a new rate"
        if foretold is None:
            if len(scatter.answer.next_day) != 1:
                remedy = "measure a unit on three days or more"
                raise RecordingError("does not show how N scatters over days", remedy=remedy)
            ((unit, foretold),) = scatter.answer.next_day.items()
            what = f"unit {unit} on a new day, at a new rate"
    reach = math.log(foretold.high / foretold.low) / (2.0 * float(ndtri(0.5 + 0.5 * confidence)))
    value = foretold.value * DEGREE_PER_ROOT_HOUR
    covariance = np.diag([(value * reach) ** 2, 0.0, 0.0])
    unseen: Final = ("bias_instability", "rate_random_walk")
    noise = GyroNoise(angle_random_walk=value, covariance=covariance, unseen=unseen)
    runs = f"{scatter.answer.runs} runs ({lines[0].method}, {lines[0].gyros})"
    ends = f"[{foretold.low:.3g}, {foretold.high:.3g}] deg/sqrt(h), {per_cent(confidence)}"
    words = f"N is that foretold for {what} by {runs}: {foretold.value:.3g} {ends}"
    words += "; B and K are not foretold: the analysis of a run has them, or their bounds"
    return noise, "; ".join(filter(None, (words, left_out(table))))


# ---- verdicts ----------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class Yield:
    """Decisions on whole recordings.

    Attributes
    ----------
    gyros
        Of each gyro of each recording that was measured.
    units
        Of each unit: it fails if one of its gyros does, and does not pass if a recording of it
        could not be measured. A unit that has no name is a recording.
    unmeasured
        Units of which a recording could not be measured.
    """

    gyros: tuple[Decision, ...]
    units: tuple[Decision, ...]
    unmeasured: int = 0

    @property
    def decision(self) -> Decision:
        """``fail`` if one fails, else ``undecided`` if one is, else ``pass``."""
        return overall(list(self.units))

    @property
    def share(self) -> tuple[float, float]:
        """Interval of the share of units that pass at 95 % (Clopper and Pearson, 1934).

        Units, since the gyros of one are not independent of each other.
        """
        tail = 0.5 * (1.0 - 0.95)
        passed = self.units.count("pass")
        bad = len(self.units) - passed
        low = float(betaincinv(passed, bad + 1.0, tail)) if passed else 0.0
        high = float(betaincinv(passed + 1.0, bad, 1.0 - tail)) if bad else 1.0
        return low, high

    def in_words(self) -> str:
        """Gyros: ``3 pass, 1 fail, 0 undecided``."""
        return ", ".join(f"{self.gyros.count(one)} {one}" for one in ("pass", "fail", "undecided"))

    def share_in_words(self) -> str:
        """Units: ``3 of 4 units pass, 1 in part or not measured, yield 75 % (19 to 99 %)``."""
        ends = " to ".join(f"{100.0 * end:.0f}" for end in self.share)
        passed, units = self.units.count("pass"), len(self.units)
        without = f", {self.unmeasured} in part or not measured" if self.unmeasured else ""
        passing = f"{passed} of {counted(units, 'unit')} pass{without}"
        return f"{passing}, yield {100.0 * passed / units:.0f} % ({ends} %)"


def yield_of(campaign: runner.Campaign) -> Yield | None:
    """The decisions of a campaign, equal data once; None if nothing was stated to be kept."""
    units: dict[str, list[Decision]] = {}
    unmeasured: set[str] = set()
    lines = lines_of(campaign.rows)
    labelled = any(line.unit for line in lines)
    for row, line in zip(campaign.rows, lines, strict=True):
        if not line.verdict or row.task.span is not None or line.same_as:
            continue
        # A file beside those of the units that cannot be read is of none: notes, or a list.
        if labelled and not line.unit and row.state != "done":
            continue
        unit = line.unit or line.file
        decisions = units.setdefault(unit, [])
        if row.state == "done":
            decisions.extend(row.analysis["verdict"]["gyros"].values())
        else:
            unmeasured.add(unit)
    if not units:
        return None
    gyros = tuple(decision for decisions in units.values() for decision in decisions)
    for unit in unmeasured:
        units[unit].append("undecided")
    return Yield(gyros=gyros, units=tuple(map(overall, units.values())), unmeasured=len(unmeasured))


def walk_limits(campaign: runner.Campaign) -> tuple[float, ...]:
    """Limits of N that were stated, deg/sqrt(h)."""
    size = field_unit("angle_random_walk").size
    limits = [one for one in campaign.limits if one.coefficient == "angle_random_walk"]
    return tuple(one.value / size for one in limits)
