"""The table of a campaign, and what it says: scatter of N, its prior, limits that are kept."""

import csv
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import MISSING, dataclass, fields, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from scipy.special import betaincinv, ndtri

from sagnac.core.errors import RecordingError, counted
from sagnac.core.units import DEGREE_PER_ROOT_HOUR, field_unit
from sagnac.core.whole_files import replacing, write_text
from sagnac.fleet.runner import Campaign, Row
from sagnac.fleet.study import Repeatability, Run, repeatability
from sagnac.fleet.tasks import Task, span_of
from sagnac.navigation.noise import GyroNoise
from sagnac.noise.estimates import Interval
from sagnac.noise.laws import SYMBOLS
from sagnac.report.sections import csv_text
from sagnac.verdict.judgement import Decision, overall
from sagnac.verdict.limits import Specification

# ---- table -------------------------------------------------------------------------


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


_TYPES: Final[Mapping[object, pa.DataType]] = {
    str: pa.string(),
    float: pa.float64(),
    int: pa.int64(),
}


def lines_of(rows: Iterable[Row]) -> list[Line]:
    """The lines of rows; one whose data an earlier row has, too, names its file.

    A copy is no second measurement, whatever it is called and in whatever format it is. One that
    was not measured is told by its key, which holds the digest of the file.
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
    if row.result.state != "done":
        return row.result.key, tuple(row.result.analysis.get("input", {}).get("gyros", ()))
    if not curve:
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
        verdict=_verdict_on(row),
        duration_s=_number(given.get("duration_s")),
        lines=int(analysis.get("lines", 0)),
        notes=len(analysis.get("notes", ())),
        reason=row.result.reason or _reason(analysis),
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
    keys = {row.result.key for row in rows}
    return sum(line.key not in keys for line in before)


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


def _verdict_on(row: Row) -> str:
    """Its verdict, empty if nothing was stated to be kept; what was not measured is undecided."""
    stated = row.task.settings.specification is not None
    if row.result.state != "done":
        return "undecided" if stated else ""
    return str(row.result.analysis.get("verdict", {}).get("overall", ""))


def _reason(analysis: Mapping[str, Any]) -> str:
    """The reason why a row has no estimate, and then why it does not pass; empty if none."""
    answer, reasons = analysis.get("angle_random_walk", {}), []
    if answer and answer.get("status") != "estimated":
        spoilt = [one["text"] for one in analysis.get("findings", ()) if one["level"] == "error"]
        reasons += spoilt or [answer["source"]] if "source" in answer else spoilt
    for one in analysis.get("verdict", {}).get("limits", ()):
        if one["verdict"] != "pass":
            reasons.append(f"{SYMBOLS[one['coefficient']]}: {one['reason']}")
    return "; ".join(dict.fromkeys(reasons))


def _estimated(analysis: Any, name: str) -> float:
    found = analysis.get("coefficients", {}).get(name, {})
    return _number(found.get("value")) if found.get("status") == "estimated" else math.nan


def _number(value: Any) -> float:
    return math.nan if value is None else float(value)


def _null(value: Any) -> Any:
    return None if isinstance(value, float) and math.isnan(value) else value


def _cell(value: Any) -> str:
    return "" if _null(value) is None else str(value)


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
    found
        The answer, deg/sqrt(h); None if the lines are too few.
    why
        Why there is none.
    """

    lines: tuple[Line, ...]
    left_out: int
    found: Repeatability | None
    why: str = ""


def scatter_of(lines: Sequence[Line], confidence: float) -> Scatter:
    """How N scatters over the units, days and rates of some lines.

    Parameters
    ----------
    lines
        Of one method and one choice of gyros.
    confidence
        Of the intervals.
    """
    shown = tuple(line for line in lines if line.status == "estimated")
    found, why = None, ""
    try:
        found = repeatability([_run_of(line) for line in shown], confidence=confidence)
    except RecordingError as error:
        why = str(error)
    return Scatter(lines=shown, left_out=len(lines) - len(shown), found=found, why=why)


def _run_of(line: Line) -> Run:
    stated = {"unit": line.unit, "day": line.day, "rate": f"{line.rate_deg_per_s:g}"}
    labels = {name: label for name, label in stated.items() if label}
    value, confidence = line.n_deg_per_sqrt_h, line.confidence
    return Run(value=value, low=line.low, high=line.high, confidence=confidence, labels=labels)


# ---- prior -------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class Prior:
    """N of a run not yet made.

    Attributes
    ----------
    noise
        N is the median that is foretold, and the root of its variance half of the interval over
        the normal quantile, both of ln N; B and K were not foretold.
    words
        Of what it is foretold, and from what.
    """

    noise: GyroNoise
    words: str


def prior_of(path: Path, *, confidence: float = 0.95) -> Prior:
    """N of the next unit on a new day or, if the campaign has one unit, of its next day.

    Parameters
    ----------
    path
        Folder of a campaign, or its ``campaign.csv``.
    confidence
        Of the interval that is foretold.

    Raises
    ------
    RecordingError
        If it is no campaign, has several methods or choices of gyros, or does not show how N
        scatters over days.
    """
    groups = groups_of(read_table(path))
    try:
        lines = _only_group(groups)
        scatter = scatter_of(lines, confidence)
        if scatter.found is None:
            raise RecordingError(scatter.why)
        foretold, what = _foretold(scatter.found)
    except RecordingError as error:
        raise error.at(str(path)) from None
    reach = math.log(foretold.high / foretold.low) / (2.0 * float(ndtri(0.5 + 0.5 * confidence)))
    value = foretold.value * DEGREE_PER_ROOT_HOUR
    covariance = np.zeros((3, 3))
    covariance[0, 0] = (value * reach) ** 2
    return Prior(
        noise=GyroNoise(
            angle_random_walk=value,
            covariance=covariance,
            unseen=("bias_instability", "rate_random_walk"),
        ),
        words=f"N is that foretold for {what} by {scatter.found.runs} runs "
        f"({lines[0].method}, {lines[0].gyros}): {foretold.value:.3g} "
        f"[{foretold.low:.3g}, {foretold.high:.3g}] deg/sqrt(h), {100.0 * confidence:g} %",
    )


def _only_group(groups: dict[tuple[str, str], list[Line]]) -> Sequence[Line]:
    if len(groups) != 1:
        held = "; ".join(f"{method} of {gyros}" for method, gyros in groups) or "no recording"
        raise RecordingError(
            f"holds {held}", remedy="give a campaign of one method and one choice of gyros"
        )
    (lines,) = groups.values()
    return lines


def _foretold(found: Repeatability) -> tuple[Interval, str]:
    if found.next_unit is not None:
        return found.next_unit, "the next unit on a new day, at a new rate"
    if len(found.next_day) == 1:
        ((unit, foretold),) = found.next_day.items()
        return foretold, f"unit {unit} on a new day, at a new rate"
    raise RecordingError(
        "does not show how N scatters over days", remedy="measure a unit on three days or more"
    )


# ---- verdicts ----------------------------------------------------------------------

_CONFIDENCE: Final = 0.95


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
        tail = 0.5 * (1.0 - _CONFIDENCE)
        passed = self.units.count("pass")
        bad = len(self.units) - passed
        low = float(betaincinv(passed, bad + 1.0, tail)) if passed else 0.0
        high = float(betaincinv(passed + 1.0, bad, 1.0 - tail)) if bad else 1.0
        return low, high

    def in_words(self) -> str:
        """Gyros: ``3 pass, 1 fail, 0 undecided``."""
        names: tuple[Decision, ...] = ("pass", "fail", "undecided")
        return ", ".join(f"{self.gyros.count(name)} {name}" for name in names)

    def share_in_words(self) -> str:
        """Units: ``3 of 4 units pass, 1 not measured, yield 75 % (19 to 99 %)``."""
        low, high = self.share
        passed, units = self.units.count("pass"), len(self.units)
        without = f", {self.unmeasured} not measured" if self.unmeasured else ""
        return (
            f"{passed} of {counted(units, 'unit')} pass{without}, "
            f"yield {100.0 * passed / units:.0f} % ({100.0 * low:.0f} to {100.0 * high:.0f} %)"
        )


def yield_of(campaign: Campaign) -> Yield | None:
    """The decisions of a campaign, equal data once; None if nothing was stated to be kept."""
    found: dict[str, list[Decision]] = {}
    unmeasured: set[str] = set()
    for row, line in zip(campaign.rows, lines_of(campaign.rows), strict=True):
        if not line.verdict or span_of(row.task) is not None or line.same_as:
            continue
        unit = row.task.labels.get("unit") or row.task.path
        decisions = found.setdefault(unit, [])
        if row.result.state == "done":
            decisions.extend(row.result.analysis["verdict"]["gyros"].values())
        else:
            unmeasured.add(unit)
    if not found:
        return None
    without: list[Decision] = ["undecided"]
    return Yield(
        gyros=tuple(decision for unit in found.values() for decision in unit),
        units=tuple(
            overall([*decisions, *without * (unit in unmeasured)])
            for unit, decisions in found.items()
        ),
        unmeasured=len(unmeasured),
    )


def specifications_of(campaign: Campaign) -> tuple[Specification, ...]:
    """Statements, each once."""
    stated = [row.task.settings.specification for row in campaign.rows]
    return tuple(dict.fromkeys(one for one in stated if one is not None))


def walk_limits(campaign: Campaign) -> tuple[float, ...]:
    """Limits of N that were stated, deg/sqrt(h)."""
    return tuple(
        limit.value / field_unit("angle_random_walk").size
        for one in specifications_of(campaign)
        for limit in one.limits
        if limit.coefficient == "angle_random_walk"
    )
