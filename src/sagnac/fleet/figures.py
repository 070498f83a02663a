"""Figures of a campaign: curves side by side, N in its order, N against time."""

import math
from collections.abc import Mapping, Sequence
from typing import Any, Final

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sagnac.fleet.runner import Row
from sagnac.fleet.table import Line
from sagnac.plot.frame import BLUE, GREEN, INK, ORANGE, literal
from sagnac.repeatability.study import Repeatability
from sagnac.report.style import STYLE, PowersOfTen, legend_above, styled
from sagnac.units import HOUR

# Panels beyond this are too small to read.
MOST_PANELS: Final = 48
_COLUMNS: Final = 4
_PANEL: Final = (1.65, 1.5)
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
    deep = math.ceil(len(shown) / _COLUMNS)
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(_COLUMNS * _PANEL[0], max(deep, 1) * _PANEL[1] + 0.4))
        grid = figure.subplots(deep, _COLUMNS, sharex=True, sharey=True, squeeze=False)
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
        for axes in grid.flat[max(len(shown) - _COLUMNS, 0) : len(shown)]:
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
    with styled() as canvas:
        for place, limit in enumerate(limits):
            label = None if place else "limit"
            canvas.axes.axhline(limit, color=INK, linewidth=1.2, linestyle="-.", label=label)
        _intervals(canvas.axes, np.arange(1.0, len(lines) + 1.0), lines)
        if found is not None:
            canvas.axes.axhline(found.mean.value, color=INK, linewidth=0.9, label="mean")
            canvas.axes.axhspan(
                found.mean.low, found.mean.high, color=GREEN, alpha=0.15, label="its interval"
            )
            if found.next_unit is not None:
                for limit in (found.next_unit.low, found.next_unit.high):
                    canvas.axes.axhline(limit, color=ORANGE, linewidth=0.9, linestyle="--")
                canvas.axes.plot([], [], "--", color=ORANGE, label="next unit")
            for outlier in found.outliers:
                canvas.axes.plot(
                    outlier.index + 1.0, lines[outlier.index].n_deg_per_sqrt_h, "o",
                    markersize=9.0, markerfacecolor="none", color=ORANGE,
                )  # fmt: skip
        _scale(canvas.axes, "recording, in the order of the table")
        legend_above(canvas.axes, columns=4)
    return canvas.figure


def time_chart(lines: Sequence[Line]) -> Figure:
    """N of the spans of one recording against time, with intervals."""
    middle = np.array([0.5 * (line.start_s + line.stop_s) for line in lines]) / HOUR
    with styled() as canvas:
        _intervals(canvas.axes, middle, lines)
        _scale(canvas.axes, "time from the start (h)")
        legend_above(canvas.axes, columns=2)
    return canvas.figure


def _intervals(axes: Axes, place: Any, lines: Sequence[Line]) -> None:
    """Values with bars; bounds as arrows that point down."""
    kinds = (("estimated", "o", "N with its interval"), ("upper bound", "v", "upper bound"))
    for status, marker, label in kinds:
        chosen = [index for index, line in enumerate(lines) if line.status == status]
        if not chosen:
            continue
        value = np.array([lines[index].n_deg_per_sqrt_h for index in chosen])
        reach = None
        if status == "estimated":
            low = np.array([lines[index].low for index in chosen])
            high = np.array([lines[index].high for index in chosen])
            reach = np.maximum(np.stack([value - low, high - value]), 0.0)
        axes.errorbar(
            place[chosen], value, yerr=reach, fmt=marker, color=BLUE, elinewidth=0.8,
            markersize=3.6, label=label,
        )  # fmt: skip


def _scale(axes: Axes, across: str) -> None:
    axes.set_xlabel(across)
    axes.set_ylabel("N per gyro (°/√h)")
    low, high = axes.get_ylim()
    if low > 0.0 and high > 4.0 * low:
        axes.set_yscale("log")


def _points(curve: Mapping[str, Any]) -> tuple[list[float], list[float]]:
    return curve["tau_s"], curve["deviation_deg_per_h"]
