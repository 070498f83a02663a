"""``index.html`` of a campaign: how N scatters, the curves, the cells, and every row."""

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from itertools import chain, groupby, product
from pathlib import Path
from typing import Any, Final

import matplotlib as mpl
import numpy as np
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from sagnac.core.errors import counted, rounded
from sagnac.core.units import HOUR
from sagnac.core.whole_files import write_text
from sagnac.fleet import runner, study, table
from sagnac.fleet.table import Line, groups_of, is_whole, yield_of
from sagnac.noise.estimates import Interval
from sagnac.report.figures import STYLE, PowersOfTen, styled, svg, write_png
from sagnac.report.frame import BLUE, GREEN, INK, OCHRE, ORANGE, literal
from sagnac.report.quantities import ending, figures, number, typeset
from sagnac.report.sections import rendered

# ---- figures -----------------------------------------------------------------------

Curve = Mapping[str, Any]
"""A curve as an ``analysis.json`` holds it."""
Lines = Sequence[Line]

# Panels beyond this are too small to read.
MOST_PANELS: Final = 48
_PANELS: Final = 4
# Recordings beyond this have no names in the overview, and a name no more characters.
_MOST_NAMES: Final = 30
_LONGEST_NAME: Final = 20
_PANEL: Final = (1.65, 1.5)
# Color of a point by its verdict; the empty one stands for a pass and for no stated limit.
_VERDICT_COLORS: Final = {"": BLUE, "fail": ORANGE, "undecided": OCHRE}


def curve_panels(panels: Mapping[str, Sequence[Curve]]) -> Figure:
    """Allan deviation of every recording, a panel for each unit and rate, all others faint.

    Parameters
    ----------
    panels
        By title, the curves of recordings of one method and one choice of gyros.
    """
    shown = list(panels.items())[:MOST_PANELS]
    deep = math.ceil(len(shown) / _PANELS)
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(_PANELS * _PANEL[0], deep * _PANEL[1] + 0.4))
        grid = figure.subplots(deep, _PANELS, sharex=True, sharey=True, squeeze=False)
        for axes, (title, curves) in zip(grid.flat, shown, strict=False):
            for curve in chain(*panels.values()):
                axes.loglog(*_points(curve), color="#dcdcdc", linewidth=0.5)
            for curve in curves:
                axes.loglog(*_points(curve), color=BLUE, linewidth=0.9)
            axes.set_title(literal(title), fontsize=7.0, loc="left", pad=3.0)
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
            left=0.1, right=0.99, top=0.985 - 0.06 / deep, bottom=0.45 / (deep * 1.5 + 0.4),
            hspace=0.32, wspace=0.12,
        )  # fmt: skip
    return figure


def control_chart(
    lines: Lines, found: study.Repeatability | None, limits: Sequence[float] = ()
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
            mean = found.mean
            axes.axhline(mean.value, color=INK, linewidth=0.9, label="mean")
            axes.axhspan(mean.low, mean.high, color=GREEN, alpha=0.15, label="its interval")
            if found.next_unit is not None:
                for limit in (found.next_unit.low, found.next_unit.high):
                    axes.axhline(limit, color=ORANGE, linewidth=0.9, linestyle="--")
                axes.plot([], [], "--", color=ORANGE, label="next unit")
            if away := [one.index for one in found.outliers]:
                y = [lines[index].n_deg_per_sqrt_h for index in away]
                (ring,) = axes.plot(np.add(away, 1.0), y, "o", label="off the others")
                ring.set(markersize=9.0, markerfacecolor="none", color=ORANGE)
        _scale(axes, "recording, in the order of the table")
    # Not every row of the table shows N: a number would name another row.
    _name(figure, lines)
    return figure


def _name(figure: Figure, shown: Lines) -> None:
    """Name recordings below their values; of very many, count them."""
    (axes,) = figure.axes
    # Gyros of one recording stand side by side: a name for each, or for all of them in the middle.
    of_files = [list(own) for _, own in groupby(enumerate(shown, 1), lambda one: one[1].file)]
    if len(of_files) > _MOST_NAMES:
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        return
    many = len(shown) > _MOST_NAMES
    named = of_files if many else [[one] for one in enumerate(shown, 1)]
    places = [float(np.mean([place for place, _ in own])) for own in named]
    names = [ending(Path(own[0][1].file).stem, _LONGEST_NAME) for own in named]
    if not many and len(groups_of(shown)) > 1:
        names = [f"{name}, {line.gyros}" for name, line in zip(names, shown, strict=True)]
    axes.set_xticks(places, list(map(literal, names)), rotation=60, ha="right", fontsize=7.0)
    axes.set_xlabel("")
    figure.subplots_adjust(bottom=0.09 + 0.009 * max(map(len, names)))


def write_overview(lines: Lines, limits: Sequence[float], folder: Path) -> tuple[Path, ...]:
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
    shown = [line for line in lines if is_whole(line) and not math.isnan(line.n_deg_per_sqrt_h)]
    if not shown:
        path.unlink(missing_ok=True)
        return ()
    write_png(control_chart(shown, None, limits), path)
    return (path,)


def _intervals(axes: Axes, place: Any, lines: Lines) -> None:
    """Values with bars; bounds as arrows that point down. What does not pass has its own color."""
    estimated = ("estimated", "o", "N", "N with its interval")
    kinds = (estimated, ("upper bound", "v", "bound", "upper bound"))
    looks = [(one.status, one.verdict if one.verdict in _VERDICT_COLORS else "") for one in lines]
    for (status, marker, short, label), (verdict, color) in product(kinds, _VERDICT_COLORS.items()):
        chosen = [i for i, look in enumerate(looks) if look == (status, verdict)]
        if not chosen:
            continue
        ends = [(lines[i].low, lines[i].n_deg_per_sqrt_h, lines[i].high) for i in chosen]
        low, value, high = np.transpose(ends)
        reach = None
        if status == "estimated":
            reach = np.maximum(np.stack([value - low, high - value]), 0.0)
        axes.errorbar(
            place[chosen], value, yerr=reach, fmt=marker, color=color, elinewidth=0.8,
            markersize=3.6, label=f"{short}: {verdict}" if verdict else label,
        )  # fmt: skip


def _scale(axes: Axes, across: str) -> None:
    axes.set_xlabel(across)
    axes.set_ylabel("N per gyro (°/√h)")
    # The axis itself begins below zero where one of many stands far above the others.
    low, high = axes.dataLim.intervaly
    if low > 0.0 and high > 4.0 * low:
        axes.set_yscale("log")


def _points(curve: Curve) -> tuple[list[float], list[float]]:
    return curve["tau_s"], curve["deviation_deg_per_h"]


# ---- page --------------------------------------------------------------------------

_BETWEEN: Final = {name: f"between {name}s" for name in (*study.FACTORS, "run")}


def write_page(campaign: runner.Campaign, lines: Lines, folder: Path, title: str) -> Path:
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
    pairs = zip(campaign.each, lines, strict=True)
    curves = {line: row.analysis["curve"] for row, line in pairs if "curve" in row.analysis}
    limits = table.walk_limits(campaign)
    failed = [line for line in lines if line.state != "done"]
    kinds = Counter(line.status or line.state for line in lines).most_common()
    of_each = ", ".join(f"{size} {kind}" for kind, size in kinds)
    twice = sum(bool(line.same_as) for line in lines)
    equal = f" {twice} have the data of another and do not count." * bool(twice)
    rows = [(line, _cells(line)) for line in lines]
    columns = rows[0][1] if rows else {}
    text = rendered(
        "campaign.html",
        title=title,
        counts=f"{len(lines)} rows: {of_each}.{equal}",
        failed=[reason_text(line.file, line.reason) for line in failed],
        groups=[_group(own, curves, limits) for own in groups_of(lines).values()],
        verdict=yield_of(campaign),
        limits=[typeset(limit.in_words) for limit in campaign.limits],
        spans=_span_figures(lines),
        rows=rows,
        columns=[name for name in columns if any(cells[name][0] for _, cells in rows)],
        answer=_answer,
        predictions=_predictions,
        between=_BETWEEN,
        **_IN_WORDS,
    )
    path = folder / "index.html"
    write_text(path, text)
    return path


def terminal_text(campaign: runner.Campaign, lines: Lines, replaced: int) -> str:
    """A campaign as a terminal shows it.

    Rows without an estimate, or that do not pass, stand with their reason; the table has all.

    Parameters
    ----------
    campaign, lines
        As of `write_page`.
    replaced
        Lines of another campaign that the table had before.
    """
    groups, whole = groups_of(lines), list(filter(is_whole, lines))
    # The command names these files itself, among its errors.
    failed = {row.task.key for row in campaign.failed}
    # A file that could not be read tells no gyros: it is one less for each.
    named = [(one.method, one.gyros) for one in whole]
    return rendered(
        "campaign.txt",
        campaign=campaign,
        lines=lines,
        whole=len(whole),
        groups=[
            (*key, own, sum(map(named.count, (key, (key[0], "")))), scatter.answer, scatter.lines)
            for key, own in groups.items()
            for scatter in [table.scatter_of(own)]
        ],
        several=len({method for method, _ in groups}) > 1,
        left_out=table.left_out(lines),
        told=[line for line in whole if line.reason and line.key not in failed],
        verdict=yield_of(campaign),
        replaced=replaced,
        counted=counted,
        **_IN_WORDS,
    )


def reason_text(file: str, reason: str) -> str:
    """Why a file has no answer; the file stands first, once."""
    return reason if reason.startswith(file) else f"{file}: {reason}"


def _group(lines: Lines, curves: Mapping[Line, Curve], limits: Sequence[float]) -> dict[str, Any]:
    """Lines of one method and one choice of gyros: their scatter and figures."""
    scatter, method, gyros = table.scatter_of(lines), lines[0].method, lines[0].gyros
    name = f"{method}-{gyros}".replace(",", "-")
    panels: dict[str, list[Curve]] = {}
    for line in lines:
        if line in curves:
            unit = line.unit or line.file.rpartition("/")[2].partition(".")[0]
            panels.setdefault(f"{unit}, {line.rate_deg_per_s:g} °/s", []).append(curves[line])
    many = len(panels) > MOST_PANELS
    of_each = f"the first {MOST_PANELS} units and rates" if many else "each unit and rate"
    drawn = []
    if panels:
        caption = f"Allan deviation per gyro, a panel for {of_each}; grey: all others."
        text = svg(curve_panels(panels), f"curves-{name}", "Allan deviation by unit")
        drawn.append((Markup(text), caption))
    if scatter.lines:
        caption = f"N of each recording{' and its limit' if limits else ''}."
        chart = control_chart(scatter.lines, scatter.answer, limits)
        drawn.append((Markup(svg(chart, f"chart-{name}", "N by recording")), caption))
    of_gyros = f"Gyros {gyros.replace(',', ' − ')}" if "," in gyros else f"Gyro {gyros}"
    title = f"{of_gyros}, method {method}"
    return {"title": title, "lines": lines, "scatter": scatter, "figures": drawn}


def deviation_words(found: study.Repeatability) -> list[tuple[str, str, str]]:
    """Components of the scatter of N: standard deviation and its interval."""
    words = []
    for name, one in found.deviations.items():
        most = "" if one.status == "estimated" else "at most "
        ends = f"{_percent(one.low)} … {_percent(one.high)}"
        words.append((_BETWEEN.get(name, name), f"{most}{_percent(one.value)}", ends))
    if found.within > 0.0:
        words.append(("within a run, of its own interval", _percent(found.within), "known"))
    return words


def outlier_words(found: study.Repeatability, lines: Lines) -> list[str]:
    """Runs that the others do not bear out, in words; `lines` are those that show N."""
    return [
        f"{Path(lines[one.index].file).name}: N is {number(lines[one.index].n_deg_per_sqrt_h)} "
        f"°/√h where the others give {number(one.foretold)} °/√h ({abs(one.deviations):.1f} "
        f"standard deviations); without it the mean is {number(one.mean_without)} °/√h"
        for one in found.outliers
    ]


def of_logarithm(one: Interval) -> tuple[str, str]:
    """Value and interval of what has its interval in ln N: digits that its low end needs, too."""
    return figures(one, width=0.5 * one.low * math.log(one.high / one.low))


# What both templates call.
_IN_WORDS: Final = {one.__name__: one for one in (deviation_words, outlier_words, of_logarithm)}


def _predictions(found: study.Repeatability) -> list[tuple[str, str, str]]:
    units = {} if found.next_unit is None else {"Next unit, one recording": found.next_unit}
    for unit, one in found.next_day.items():
        units[f"Unit {unit}, one recording on a new day"] = one
    shown = {what: of_logarithm(one) for what, one in units.items()}
    rows = [(what, f"{value} °/√h", f"{ends} °/√h") for what, (value, ends) in shown.items()]
    if found.drift is not None:
        ends = (found.drift.value, found.drift.low, found.drift.high)
        # A slope of ln N, of which a few days leave several a day: N falls by its whole at most.
        changes = (math.expm1(min(part, 300.0)) for part in ends)
        value, low, high = (_percent(part).replace("-", "−") for part in changes)
        rows.append(("Drift of N a day", value, f"{low} … {high}"))
    return rows


def _span_figures(lines: Iterable[Line]) -> list[tuple[Markup, str]]:
    """N of the spans of each recording against time, with intervals."""
    recordings: dict[tuple[str, str, str], list[Line]] = {}
    for line in lines:
        if not math.isnan(line.start_s) and line.state == "done":
            recordings.setdefault((line.file, line.method, line.gyros), []).append(line)
    drawn = []
    for place, ((file, method, gyros), own) in enumerate(recordings.items()):
        middle = np.array([0.5 * (line.start_s + line.stop_s) for line in own]) / HOUR
        with styled(2) as (figure, axes):
            _intervals(axes, middle, own)
            _scale(axes, "time from the start (h)")
        caption = f"{Path(file).name}, gyros {gyros}, {method}: N of each span against time."
        drawn.append((Markup(svg(figure, f"spans-{place}", "N against time")), caption))
    return drawn


def _cells(line: Line) -> dict[str, tuple[str, str | float, str | None]]:
    """A row of the table by the names of its columns: text, key to sort by, what stands beside."""
    value, interval = _answer(line)
    span = f"{line.start_s / 3600:g}–{line.stop_s / 3600:g}"
    # Beside a verdict stands why it does not pass; beside N its interval, or whose data these are,
    # or why it is no estimate. What was not measured stands at the head of the page.
    done, why = line.state == "done", None
    if line.verdict:
        why = line.reason if done else "not measured"
    elif done and line.reason:
        interval = f"{interval}: {line.reason}"
    if line.same_as:
        interval = f"the data of {Path(line.same_as).name}"
    return {
        "File": (Path(line.file).name, line.file, None),
        "Unit": (line.unit, line.unit, None),
        "Day": (line.day, line.day, None),
        "Rate (°/s)": _numeric(line.rate_deg_per_s, f"{line.rate_deg_per_s:g}"),
        "Gyros": (line.gyros, line.gyros, None),
        "Method": (line.method, line.method, None),
        "Span (h)": _numeric(line.start_s, span),
        "N (°/√h)": (*_numeric(line.n_deg_per_sqrt_h, value)[:2], interval),
        "Verdict": (line.verdict, line.verdict, why),
        "Lines": _numeric(line.lines if done else math.nan, str(line.lines)),
        "Notes": _numeric(line.notes if done else math.nan, str(line.notes)),
        "Length (h)": _numeric(line.duration_s, f"{line.duration_s / 3600.0:.3g}"),
    }


def _numeric(value: float, text: str) -> tuple[str, float, None]:
    return "" if math.isnan(value) else text, value, None


def _answer(line: Line) -> tuple[str, str]:
    if line.status == "estimated":
        return figures(Interval(value=line.n_deg_per_sqrt_h, low=line.low, high=line.high))
    if line.status == "upper bound":
        return f"< {number(line.high)}", line.status
    return "–", line.status or line.state


def _percent(part: float) -> str:
    if part >= 9.995:
        return f"{100.0 * part:.0f} %" if part < 1e4 else f"{number(100.0 * part)} %"
    return f"{rounded(100.0 * part)} %"
