"""``index.html`` of a campaign: how N scatters, the curves, the cells, and every row."""

import math
from collections.abc import Iterable, Mapping, Sequence
from itertools import product
from pathlib import Path
from typing import Any, Final

import matplotlib as mpl
import numpy as np
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sagnac.core.errors import rounded
from sagnac.core.units import HOUR
from sagnac.core.version import __version__
from sagnac.core.whole_files import write_text
from sagnac.fleet.runner import Campaign, Row
from sagnac.fleet.study import Repeatability
from sagnac.fleet.table import (
    Line,
    Scatter,
    groups_of,
    scatter_of,
    specifications_of,
    walk_limits,
    yield_of,
)
from sagnac.noise.estimates import Interval
from sagnac.report.figures import STYLE, PowersOfTen, styled, svg, write_png
from sagnac.report.frame import BLUE, GREEN, INK, OCHRE, ORANGE, literal
from sagnac.report.quantities import number, typeset
from sagnac.report.sections import rendered

# ---- figures -----------------------------------------------------------------------

# Panels beyond this are too small to read.
MOST_PANELS: Final = 48
_PANELS: Final = 4
# Recordings beyond this have no names in the overview, and a name no more characters.
_MOST_NAMES: Final = 30
_LONGEST_NAME: Final = 20
_PANEL: Final = (1.65, 1.5)
# Color of a point by its verdict; the empty one stands for a pass and for no stated limit.
_VERDICT_COLORS: Final = {"": BLUE, "fail": ORANGE, "undecided": OCHRE}
_TITLE: Final = {"fontsize": 7.0, "loc": "left", "pad": 3.0}


def curve_panels(rows: Sequence[Row], lines: Sequence[Line]) -> Figure:
    """Allan deviation of every recording, a panel for each unit and rate, all others faint.

    Parameters
    ----------
    rows, lines
        Those of one method and one choice of gyros, that have a curve.
    """
    panels: dict[str, list[Mapping[str, Any]]] = {}
    for row, line in zip(rows, lines, strict=True):
        curve = row.result.analysis.get("curve")
        if curve is not None:
            panels.setdefault(panel_title(line), []).append(curve)
    shown = list(panels.items())[:MOST_PANELS]
    deep = math.ceil(len(shown) / _PANELS)
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(_PANELS * _PANEL[0], max(deep, 1) * _PANEL[1] + 0.4))
        grid = figure.subplots(deep, _PANELS, sharex=True, sharey=True, squeeze=False)
        for axes, (title, curves) in zip(grid.flat, shown, strict=False):
            for others in panels.values():
                for curve in others:
                    axes.loglog(*_points(curve), color="#dcdcdc", linewidth=0.5)
            for curve in curves:
                axes.loglog(*_points(curve), color=BLUE, linewidth=0.9)
            axes.set_title(literal(title), **_TITLE)
            axes.tick_params(labelsize=7.0)
            for axis in (axes.xaxis, axes.yaxis):
                axis.set_major_formatter(PowersOfTen())
        for axes in grid.flat[len(shown) :]:
            axes.set_axis_off()
        for axes in grid.flat[max(len(shown) - _PANELS, 0) : len(shown)]:
            axes.tick_params(labelbottom=True)
        figure.supxlabel("cluster time τ (s)", fontsize=8.5)
        figure.supylabel("Allan deviation (°/h)", fontsize=8.5)
        figure.subplots_adjust(
            left=0.1, right=0.99, top=0.985 - 0.06 / max(deep, 1), bottom=0.45 / (deep * 1.5 + 0.4),
            hspace=0.32, wspace=0.12,
        )  # fmt: skip
    return figure


def panel_title(line: Line) -> str:
    """Subject of a panel: unit and rate, or the file's name if the unit is not known."""
    unit = line.unit or line.file.rpartition("/")[2].partition(".")[0]
    return f"{unit}, {line.rate_deg_per_s:g} °/s"


def control_chart(
    lines: Sequence[Line], found: Repeatability | None, limits: Sequence[float] = ()
) -> Figure:
    """N of every recording in its order, with the mean and where the next run will lie.

    Parameters
    ----------
    lines
        That show N.
    found
        How they scatter; None if they are too few.
    limits
        Of N, deg/sqrt(h), a line each.
    """
    with styled(4) as (figure, axes):
        for place, limit in enumerate(limits):
            label = None if place else "limit"
            axes.axhline(limit, color=INK, linewidth=1.2, linestyle="-.", label=label)
        _intervals(axes, np.arange(1.0, len(lines) + 1.0), lines)
        if found is not None:
            axes.axhline(found.mean.value, color=INK, linewidth=0.9, label="mean")
            axes.axhspan(
                found.mean.low, found.mean.high, color=GREEN, alpha=0.15, label="its interval"
            )
            if found.next_unit is not None:
                for limit in (found.next_unit.low, found.next_unit.high):
                    axes.axhline(limit, color=ORANGE, linewidth=0.9, linestyle="--")
                axes.plot([], [], "--", color=ORANGE, label="next unit")
            for outlier in found.outliers:
                axes.plot(
                    outlier.index + 1.0, lines[outlier.index].n_deg_per_sqrt_h, "o",
                    markersize=9.0, markerfacecolor="none", color=ORANGE,
                )  # fmt: skip
        _scale(axes, "recording, in the order of the table")
    return figure


def write_overview(
    lines: Sequence[Line], limits: Sequence[float], folder: Path
) -> tuple[Path, ...]:
    """Write ``campaign.png``: N of every gyro of every whole recording, in the table's order.

    Parameters
    ----------
    lines
        Of the table.
    limits
        Of N, deg/sqrt(h), a line each.
    folder
        Of the campaign.

    Returns
    -------
    tuple of Path
        The picture; none if no recording shows N, and an earlier picture goes then.

    Raises
    ------
    RecordingError
        If the folder cannot be written to.
    """
    path = folder / "campaign.png"
    groups = groups_of(line for line in lines if not math.isnan(line.n_deg_per_sqrt_h))
    shown = [line for line in lines if any(line in group for group in groups.values())]
    if not shown:
        path.unlink(missing_ok=True)
        return ()
    figure = control_chart(shown, None, limits)
    if len(shown) <= _MOST_NAMES:
        (axes,) = figure.axes
        several = len(groups) > 1
        names = [_row_name(line, several=several) for line in shown]
        axes.set_xticks(range(1, len(shown) + 1), names, rotation=60, ha="right", fontsize=7.0)
        axes.set_xlabel("")
        figure.subplots_adjust(bottom=0.09 + 0.009 * max(map(len, names)))
    write_png(figure, path)
    return (path,)


def _row_name(line: Line, *, several: bool) -> str:
    name = Path(line.file).stem
    name = name if len(name) <= _LONGEST_NAME else f"…{name[1 - _LONGEST_NAME :]}"
    return literal(f"{name}, {line.gyros}" if several else name)


def time_chart(lines: Sequence[Line]) -> Figure:
    """N of the spans of one recording against time, with intervals."""
    middle = np.array([0.5 * (line.start_s + line.stop_s) for line in lines]) / HOUR
    with styled(2) as (figure, axes):
        _intervals(axes, middle, lines)
        _scale(axes, "time from the start (h)")
    return figure


def _intervals(axes: Axes, place: Any, lines: Sequence[Line]) -> None:
    """Values with bars; bounds as arrows that point down. What does not pass has its own color."""
    kinds = (("estimated", "o", "N with its interval"), ("upper bound", "v", "upper bound"))
    verdicts = [line.verdict if line.verdict in _VERDICT_COLORS else "" for line in lines]
    for (status, marker, label), (verdict, color) in product(kinds, _VERDICT_COLORS.items()):
        shown = [line.status == status for line in lines]
        chosen = np.flatnonzero(np.array(shown) & (np.array(verdicts) == verdict))
        if not chosen.size:
            continue
        ends = [(lines[i].low, lines[i].n_deg_per_sqrt_h, lines[i].high) for i in chosen.tolist()]
        low, value, high = np.transpose(ends)
        reach = None
        if status == "estimated":
            reach = np.maximum(np.stack([value - low, high - value]), 0.0)
        axes.errorbar(
            place[chosen], value, yerr=reach, fmt=marker, color=color, elinewidth=0.8,
            markersize=3.6, label=f"{label}: {verdict}" if verdict else label,
        )  # fmt: skip


def _scale(axes: Axes, across: str) -> None:
    axes.set_xlabel(across)
    axes.set_ylabel("N per gyro (°/√h)")
    low, high = axes.get_ylim()
    if low > 0.0 and high > 4.0 * low:
        axes.set_yscale("log")


def _points(curve: Mapping[str, Any]) -> tuple[list[float], list[float]]:
    return curve["tau_s"], curve["deviation_deg_per_h"]


# ---- page --------------------------------------------------------------------------

_BETWEEN: Final = {
    "unit": "between units",
    "day": "between days",
    "rate": "between rates",
    "run": "between runs",
}


def write_page(campaign: Campaign, lines: Sequence[Line], folder: Path, title: str) -> Path:
    """Write ``index.html``; it links to the report of each row.

    Parameters
    ----------
    campaign
        What was done.
    lines
        Its table, a line for each row of `Campaign.each`.
    folder
        Of the campaign.
    title
        Of the page.

    Raises
    ------
    RecordingError
        If the folder cannot be written to.
    """
    by_key = {
        (line.key, line.file, line.gyros): row
        for row, line in zip(campaign.each, lines, strict=True)
    }
    specifications = specifications_of(campaign)
    limits = walk_limits(campaign)
    failed = [line for line in lines if line.state != "done"]
    twice = sum(bool(line.same_as) for line in lines)
    equal = f" {twice} have the data of another and do not count." * bool(twice)
    text = rendered(
        "campaign.html",
        title=title,
        counts=f"{len(lines)} rows, {len(lines) - len(failed)} done, {len(failed)} not.{equal}",
        failed=[reason_text(line.file, line.reason) for line in failed],
        groups=[
            _group(names, found, by_key, limits)
            for names, found in groups_of(lines).items()
            if any(line.state == "done" for line in found)
        ],
        verdict=yield_of(campaign),
        limits=[typeset(limit.in_words) for one in specifications for limit in one.limits],
        spans=_span_figures(lines),
        **_listed(lines),
        answer=_answer,
        states=[line.state for line in lines],
        version=__version__,
    )
    path = folder / "index.html"
    write_text(path, text)
    return path


def reason_text(file: str, reason: str) -> str:
    """Why a file has no answer; the file stands first, once."""
    return reason if reason.startswith(file) else f"{file}: {reason}"


def _group(
    names: tuple[str, str],
    lines: Sequence[Line],
    by_key: dict[tuple[str, str, str], Row],
    limits: Sequence[float],
) -> dict[str, Any]:
    done = [line for line in lines if line.state == "done"]
    method, gyros = names
    name = f"{method}-{gyros}".replace(",", "-")
    scatter = scatter_of(done, done[0].confidence)
    rows = [by_key[line.key, line.file, line.gyros] for line in done]
    many = len({panel_title(line) for line in done}) > MOST_PANELS
    panels = f"the first {MOST_PANELS} units and rates" if many else "each unit and rate"
    figures = []
    if any("curve" in row.result.analysis for row in rows):
        drawn = svg(curve_panels(rows, done), f"curves-{name}", "Allan deviation by unit")
        caption = f"Allan deviation per gyro, a panel for {panels}; grey: all others."
        figures.append((Markup(drawn), caption))
    if scatter.lines:
        chart = control_chart(scatter.lines, scatter.found, limits)
        caption = f"N of each recording{' and its limit' if limits else ''}."
        figures.append((Markup(svg(chart, f"chart-{name}", "N by recording")), caption))
    return {
        "title": f"{_gyros_title(gyros)}, method {method}",
        "confidence": f"{100.0 * done[0].confidence:g} %",
        "why": scatter.why,
        "left_out": scatter.left_out,
        "figures": figures,
        "units": _by_unit(done),
        **_scatter_words(scatter),
    }


def _gyros_title(gyros: str) -> str:
    return f"Gyros {gyros.replace(',', ' − ')}" if "," in gyros else f"Gyro {gyros}"


def _scatter_words(scatter: Scatter) -> dict[str, Any]:
    found = scatter.found
    if found is None:
        return {"mean": None}
    value, interval = _figures(found.mean)
    return {
        "mean": {"value": value, "interval": interval},
        "runs": found.runs,
        "deviations": deviation_words(found),
        "hidden": [(_BETWEEN.get(name, name), why) for name, why in found.hidden.items()],
        "predictions": _predictions(found),
        "outliers": [
            f"{Path(scatter.lines[one.index].file).name}: N is "
            f"{number(scatter.lines[one.index].n_deg_per_sqrt_h)} °/√h where the others give "
            f"{number(one.foretold)} °/√h ({abs(one.deviations):.1f} standard deviations); "
            f"without it the mean is {number(one.mean_without)} °/√h"
            for one in found.outliers
        ],
    }


def deviation_words(found: Repeatability) -> list[tuple[str, str, str]]:
    """Components of the scatter of N: standard deviation and its interval."""
    words = [
        (
            _BETWEEN.get(name, name),
            _percent(one.value) if one.status == "estimated" else f"at most {_percent(one.value)}",
            f"{_percent(one.low)} … {_percent(one.high)}",
        )
        for name, one in found.deviations.items()
    ]
    if found.within > 0.0:
        words.append(("within a run, of its own interval", _percent(found.within), "known"))
    return words


def _predictions(found: Repeatability) -> list[tuple[str, str, str]]:
    units = {
        f"Unit {unit}, one recording on a new day": one for unit, one in found.next_day.items()
    }
    if found.next_unit is not None:
        units = {"Next unit, one recording": found.next_unit, **units}
    shown = {what: _figures(one) for what, one in units.items()}
    rows = [(what, f"{value} °/√h", f"{ends} °/√h") for what, (value, ends) in shown.items()]
    if found.drift is not None:
        ends = (found.drift.value, found.drift.low, found.drift.high)
        value, low, high = (f"{rounded(100.0 * part)} %" for part in ends)
        rows.append(("Drift of N a day", value, f"{low} … {high}"))
    return rows


def _by_unit(lines: Iterable[Line]) -> dict[str, list[Line]]:
    """Lines of each unit that was measured on several days or at several rates."""
    units: dict[str, list[Line]] = {}
    for line in lines:
        units.setdefault(line.unit, []).append(line)
    return {
        unit: own
        for unit, own in units.items()
        if len({line.rate_deg_per_s for line in own}) > 1 or len({line.day for line in own}) > 1
    }


def _span_figures(lines: Iterable[Line]) -> list[tuple[Markup, str]]:
    recordings: dict[tuple[str, str, str], list[Line]] = {}
    for line in lines:
        if not math.isnan(line.start_s) and line.state == "done":
            recordings.setdefault((line.file, line.method, line.gyros), []).append(line)
    return [
        (
            Markup(svg(time_chart(own), f"spans-{place}", "N against time")),
            f"{Path(file).name}, gyros {gyros}, {method}: N of each span against time.",
        )
        for place, ((file, method, gyros), own) in enumerate(recordings.items())
    ]


def _listed(lines: Sequence[Line]) -> dict[str, Any]:
    """Every row, and the columns in which at least one row has something."""
    rows = [_cells(line) for line in lines]
    filled = [name for name in rows[0] if any(row[name]["text"] for row in rows)] if rows else []
    return {"columns": {name: "numeric" in rows[0][name] for name in filled}, "rows": rows}


def _cells(line: Line) -> dict[str, dict[str, Any]]:
    """A row of the table by the names of its columns: text, key to sort by, what stands beside."""
    value, interval = _answer(line)
    file = {"text": Path(line.file).name, "key": line.file}
    span = "" if math.isnan(line.start_s) else f"{line.start_s / 3600:g}–{line.stop_s / 3600:g}"
    found = line.state == "done"
    return {
        "File": {**file, "link": f"{line.report}/report.html" if line.report else ""},
        "Unit": _plain(line.unit),
        "Day": _plain(line.day),
        "Rate (°/s)": _numeric(line.rate_deg_per_s, f"{line.rate_deg_per_s:g}"),
        "Gyros": _plain(line.gyros),
        "Method": _plain(line.method),
        "Span (h)": _numeric(line.start_s, span),
        "N (°/√h)": {**_numeric(line.n_deg_per_sqrt_h, value), "range": _beside(line, interval)},
        "Verdict": {**_plain(line.verdict), "range": _why(line) * bool(line.verdict)},
        "Lines": _numeric(line.lines if found else math.nan, str(line.lines)),
        "Notes": _numeric(line.notes if found else math.nan, str(line.notes)),
        "Length (h)": _numeric(line.duration_s, f"{line.duration_s / 3600.0:.3g}"),
    }


def _plain(text: str) -> dict[str, Any]:
    return {"text": text, "key": text}


def _why(line: Line) -> str:
    """Why it does not pass; that of what was not measured stands at the head of the page."""
    return line.reason if line.state == "done" else "not measured"


def _beside(line: Line, interval: str) -> str:
    """Text beside N: its interval, or whose data these are, or why it is no estimate."""
    if line.same_as:
        return f"the data of {Path(line.same_as).name}"
    # Beside a verdict it stands there.
    why = line.reason if line.state == "done" and not line.verdict else ""
    return f"{interval}: {why}" if why else interval


def _numeric(value: float, text: str) -> dict[str, Any]:
    missing = math.isnan(value)
    return {"text": "" if missing else text, "key": "" if missing else value, "numeric": True}


def _answer(line: Line) -> tuple[str, str]:
    if line.status == "estimated":
        return _figures(Interval(value=line.n_deg_per_sqrt_h, low=line.low, high=line.high))
    if line.status == "upper bound":
        return f"< {number(line.high)}", line.status
    return "–", line.status or line.state


def _figures(one: Interval) -> tuple[str, str]:
    width = 0.5 * (one.high - one.low)
    return number(one.value, width), f"{number(one.low, width)} … {number(one.high, width)}"


def _percent(part: float) -> str:
    return f"{rounded(100.0 * part)} %" if part < 9.995 else f"{100.0 * part:.0f} %"
