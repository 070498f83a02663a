"""Figures of an analysis: stability, spectrum, methods side by side. One style for all."""

import math
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from io import BytesIO, StringIO
from itertools import pairwise
from pathlib import Path
from typing import Any, Final

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke

from sagnac.analysis.result import Analysis
from sagnac.analysis.spectra import Spectrum
from sagnac.arrays import FloatArray
from sagnac.coefficients.laws import COEFFICIENT_NAMES, CoefficientName, allan_variance
from sagnac.formats.source import replacing
from sagnac.lines.model import Line
from sagnac.recording.difference import per_gyro
from sagnac.report.document import headline_fit, per_gyro_curve
from sagnac.report.wording import SYMBOLS, in_field_unit, number
from sagnac.units import DEGREE_PER_HOUR, DEGREE_PER_HOUR_PER_ROOT_HERTZ

INK: Final = "#1a1a1a"
QUIET: Final = "#9a9a9a"
FAINT: Final = "#e4e4e4"
BLUE: Final = "#1f5a96"
ORANGE: Final = "#c4561b"
GREEN: Final = "#2f7d5b"
COLORS: Final = {"none": QUIET, "fris": ORANGE, "fos-paper": GREEN, "fos": BLUE}
MARKERS: Final = {"none": "s", "fris": "^", "fos-paper": "D", "fos": "o"}

_STYLE: Final[dict[Any, Any]] = {
    "font.family": "DejaVu Sans",
    "font.size": 9.5,
    "axes.labelsize": 9.5,
    "axes.edgecolor": "#6b6b6b",
    "axes.linewidth": 0.7,
    "axes.labelcolor": INK,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.axisbelow": True,
    "axes.grid": True,
    "grid.color": FAINT,
    "grid.linewidth": 0.6,
    "xtick.color": "#6b6b6b",
    "ytick.color": "#6b6b6b",
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "xtick.labelsize": 8.5,
    "ytick.labelsize": 8.5,
    "xtick.minor.size": 1.8,
    "ytick.minor.size": 1.8,
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "lines.linewidth": 1.3,
    "lines.markersize": 3.6,
    "mathtext.fontset": "dejavusans",
    "svg.fonttype": "path",
    "path.simplify": True,
    "path.simplify_threshold": 0.3,
}
_SIZE: Final = (6.6, 4.5)
_FRAME: Final = {"left": 0.115, "right": 0.975, "bottom": 0.115}
_LEGEND_ROW: Final = 0.036  # of the height
# How the Allan deviation of each term rises with tau on a log-log plot.
_SLOPES: Final[Mapping[CoefficientName, str]] = {
    "quantization": "−1",
    "angle_random_walk": "−½",
    "bias_instability": "0",
    "rate_random_walk": "+½",
    "rate_ramp": "+1",
}
_ROOM_FOR_LABEL: Final = 75.0  # points
_HUNDREDTHS: Final = re.compile(r"(\.\d{2})\d+")
_LABELLED_LINES: Final = 8


def stability_figure(analysis: Analysis) -> Figure:
    """Allan deviation before and after removal, the five-term fit, and its slopes."""
    with _styled(legend_rows=1) as (figure, axes):
        before = per_gyro_curve(analysis.curve_before, analysis.gyros_differenced)
        after = per_gyro_curve(analysis.curve, analysis.gyros_differenced)
        if _removed(analysis):
            axes.plot(
                before.tau,
                before.deviation / DEGREE_PER_HOUR,
                color=QUIET,
                marker="s",
                markersize=2.8,
                linewidth=0.9,
                label="before removal",
            )
        axes.plot(
            after.tau,
            after.deviation / DEGREE_PER_HOUR,
            color=BLUE,
            marker="o",
            linestyle="none",
            label=_after(analysis),
        )
        axes.fill_between(
            after.tau,
            after.low / DEGREE_PER_HOUR,
            after.high / DEGREE_PER_HOUR,
            color=BLUE,
            alpha=0.2,
            linewidth=0,
            label=f"its {100 * after.confidence:g} % interval",
        )
        _logarithmic(axes, "cluster time τ (s)", f"Allan deviation, {_of(analysis)} (°/h)")
        _limits(axes, after.tau, before.deviation, after.deviation, after.low)
        _fitted(axes, analysis)
        _legend(axes, columns=4)
    return figure


def spectrum_figure(analysis: Analysis) -> Figure:
    """Rate spectrum before and after removal, with the lines that were removed marked."""
    with _styled(legend_rows=2) as (figure, axes):
        before, after = (
            _decimated(spectrum, analysis.gyros_differenced)
            for spectrum in (analysis.spectrum_before, analysis.spectrum)
        )
        if _removed(analysis):
            axes.plot(*before, color=QUIET, linewidth=0.8, label="before removal")
        axes.plot(*after, color=BLUE, linewidth=0.8, alpha=0.7, label=_after(analysis))
        _logarithmic(axes, "frequency (Hz)", f"rate noise density, {_of(analysis)} (°/h/√Hz)")
        if not after[0].size:
            # Logarithmic axes find no limits of their own without data.
            axes.set(xlim=(0.1, 10.0), ylim=(0.1, 10.0))
            axes.text(0.5, 0.5, analysis.source, transform=axes.transAxes, ha="center")
            return figure
        axes.margins(x=0.01)
        if analysis.angle_random_walk.status == "estimated":
            level = math.sqrt(2.0) * analysis.angle_random_walk.value
            axes.axhline(
                level / DEGREE_PER_HOUR_PER_ROOT_HERTZ,
                color=INK,
                linewidth=0.9,
                linestyle=(0, (5, 3)),
                label="√2 N",
            )
        _mark_lines(axes, analysis)
        _legend(axes, columns=3)
    return figure


def comparison_figure(analyses: Mapping[str, Analysis]) -> Figure:
    """The stability curve that each method leaves, with the N it gives.

    Parameters
    ----------
    analyses
        By method, all of one recording.
    """
    with _styled(legend_rows=2) as (figure, axes):
        for method, analysis in analyses.items():
            curve = per_gyro_curve(analysis.curve, analysis.gyros_differenced)
            axes.errorbar(
                curve.tau,
                curve.deviation / DEGREE_PER_HOUR,
                yerr=np.maximum(
                    np.stack([curve.deviation - curve.low, curve.high - curve.deviation]), 0.0
                )
                / DEGREE_PER_HOUR,
                color=COLORS.get(method, INK),
                marker=MARKERS.get(method, "x"),
                linewidth=1.0,
                elinewidth=0.7,
                label=f"{method}: {_short_answer(analysis)}",
            )
        one = next(iter(analyses.values()))
        _logarithmic(axes, "cluster time τ (s)", f"Allan deviation, {_of(one)} (°/h)")
        _legend(axes, columns=2)
    return figure


def svg(figure: Figure, name: str, description: str) -> str:
    """The figure as an ``<svg>`` element to stand inside a page.

    Parameters
    ----------
    figure
        What to draw.
    name
        Goes before every id, so that two figures in one page do not share any.
    description
        For readers who do not see it.
    """
    text = StringIO()
    with mpl.rc_context({**_STYLE, "svg.hashsalt": name}):
        figure.savefig(text, format="svg", metadata={"Date": None, "Creator": None})
    drawing = text.getvalue()
    drawing = drawing[drawing.index("<svg") :]
    drawing = re.sub(r"<metadata>.*?</metadata>", "", drawing, flags=re.DOTALL)
    drawing = re.sub(r'\b(id="|href="#|url\(#)', rf"\g<1>{name}-", drawing)
    # A hundredth of a point is finer than any printer; glyphs (in font units) stay as they are.
    drawing = re.sub(
        r'(?<= d=")M [^"]*(?=")', lambda path: _HUNDREDTHS.sub(r"\1", path.group()), drawing
    )
    return re.sub(
        r"<svg [^>]*?(viewBox=\"[^\"]*\")[^>]*>",
        rf'<svg xmlns:xlink="http://www.w3.org/1999/xlink" \1 role="img" '
        rf'aria-label="{description}">',
        drawing,
        count=1,
    )


def write_png(figure: Figure, path: Path) -> None:
    """The figure as a PNG of 200 dots per inch, whole or not at all."""
    picture = BytesIO()
    with mpl.rc_context(_STYLE):
        figure.savefig(picture, format="png", dpi=200, metadata={"Software": None})
    with replacing(path) as temporary:
        temporary.write_bytes(picture.getvalue())


@contextmanager
def _styled(legend_rows: int) -> Iterator[tuple[Figure, Axes]]:
    with mpl.rc_context(_STYLE):
        figure = Figure(figsize=_SIZE)
        axes = figure.add_subplot()
        figure.subplots_adjust(**_FRAME, top=0.98 - legend_rows * _LEGEND_ROW)
        yield figure, axes


def _of(analysis: Analysis) -> str:
    readable = analysis.channel.replace("-", " − ")
    return f"{readable} per gyro" if analysis.gyros_differenced > 1 else readable


def _removed(analysis: Analysis) -> bool:
    return analysis.settings.method != "none"


def _after(analysis: Analysis) -> str:
    return "after removal" if _removed(analysis) else "as recorded"


def _short_answer(analysis: Analysis) -> str:
    shown = in_field_unit("angle_random_walk", analysis.angle_random_walk)
    if shown.status == "not observable":
        return "N not observable"
    relation = "=" if shown.status == "estimated" else "<"
    width = 0.5 * (shown.high - shown.low)
    return f"N {relation} {number(shown.value, width)} °/√h"


def _logarithmic(axes: Axes, across: str, up: str) -> None:
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlabel(across)
    axes.set_ylabel(up)


def _legend(axes: Axes, columns: int) -> None:
    """Above the plot, where it hides no data."""
    axes.legend(
        loc="lower left",
        bbox_to_anchor=(-0.02, 0.995),
        ncols=columns,
        columnspacing=1.4,
        handlelength=1.6,
        handletextpad=0.5,
        borderaxespad=0.0,
        labelspacing=0.25,
    )


def _limits(axes: Axes, tau: FloatArray, *deviations: FloatArray) -> None:
    """Room for the data, not for what a fit says far below it."""
    values = np.concatenate(deviations) / DEGREE_PER_HOUR
    values = values[np.isfinite(values) & (values > 0.0)]
    if tau.size:
        axes.set_xlim(0.75 * tau.min(), 1.35 * tau.max())
    if values.size:
        axes.set_ylim(0.6 * values.min(), 1.7 * values.max())


def _fitted(axes: Axes, analysis: Analysis) -> None:
    """The fit that the answer rests on: its sum, and each term it estimated with its slope."""
    fit = headline_fit(analysis)
    if fit is None:
        return
    values = {
        name: fit.coefficients[name].value
        for name in COEFFICIENT_NAMES
        if name in fit.coefficients and fit.coefficients[name].status == "estimated"
    }
    if not values:
        return
    tau = np.geomspace(*axes.get_xlim(), 200)
    total = np.sqrt(allan_variance(tau, values)) / DEGREE_PER_HOUR
    axes.plot(tau, total, color=INK, linewidth=1.2, label=f"fit ({fit.method})")
    low, high = axes.get_ylim()
    for name, value in values.items():
        part = np.sqrt(allan_variance(tau, {name: value})) / DEGREE_PER_HOUR
        axes.plot(tau, part, color=INK, linewidth=0.7, linestyle=(0, (2, 3)))
        inside = np.flatnonzero((part > low) & (part < high))
        # No term lies above the sum, so the side below its line is free of data.
        _below(axes, tau[inside], part[inside], f"{SYMBOLS[name]}, slope {_SLOPES[name]}")


def _below(axes: Axes, tau: FloatArray, level: FloatArray, text: str) -> None:
    """Write along and below the middle of a line, if there is room for it."""
    if tau.size == 0:
        return
    points = axes.transData.transform(np.stack([tau, level], axis=1))
    run, rise = points[-1] - points[0]
    if math.hypot(run, rise) < _ROOM_FOR_LABEL * axes.figure.dpi / 72.0:
        return
    middle = tau.size // 2
    axes.annotate(
        text,
        (tau[middle], level[middle]),
        xytext=(0, -4.0),
        textcoords="offset points",
        rotation=math.degrees(math.atan2(rise, run)),
        rotation_mode="anchor",
        ha="center",
        va="top",
        fontsize=8,
        color="#4a4a4a",
        path_effects=[withStroke(linewidth=2.2, foreground="white")],
    )


def _mark_lines(axes: Axes, analysis: Analysis) -> None:
    """A tick above the spectrum for each line, the strongest with their names."""
    marked = [
        (frequency, line)
        for line in analysis.lines
        if (frequency := _hertz(line, analysis.table_rate)) is not None
    ]
    if not marked:
        return
    low, high = axes.get_ylim()
    axes.set_ylim(low, high * (high / low) ** 0.28)
    stage = axes.get_xaxis_transform()  # x in Hz, y a share of the height
    for scale, color, marker, label in (
        ("angle", ORANGE, "|", "line in table angle"),
        ("time", GREEN, "|", "line in time"),
    ):
        places = [frequency for frequency, line in marked if line.scale == scale]
        if places:
            axes.plot(
                places,
                np.full(len(places), 0.82),
                linestyle="none",
                marker=marker,
                markersize=7,
                markeredgewidth=1.0,
                color=color,
                transform=stage,
                label=label,
            )
    taken: list[float] = []
    span = math.log(axes.get_xlim()[1] / axes.get_xlim()[0])
    for frequency, line in marked:
        here = math.log(frequency) / span
        if len(taken) == _LABELLED_LINES or any(abs(here - other) < 0.035 for other in taken):
            continue
        taken.append(here)
        axes.text(
            frequency,
            0.845,
            f"{line.frequency:.4g}×" if line.scale == "angle" else f"{line.frequency:.4g} Hz",
            transform=stage,
            rotation=90,
            ha="center",
            va="bottom",
            fontsize=7,
            color=ORANGE if line.scale == "angle" else GREEN,
            clip_on=False,
        )


def _hertz(line: Line, table_rate: float | None) -> float | None:
    """Where a line stands in the spectrum; None for an order of a table that does not turn."""
    if line.scale == "time":
        return line.frequency
    if not table_rate:
        return None
    return line.frequency * abs(table_rate) / (2.0 * math.pi)


def _decimated(
    spectrum: Spectrum, gyros_differenced: int, points: int = 2400
) -> tuple[FloatArray, FloatArray]:
    """Root density of one gyro, lowest and highest of each log-spaced bin: no peak is lost."""
    size = per_gyro(1.0, gyros_differenced) / DEGREE_PER_HOUR_PER_ROOT_HERTZ
    keep = (spectrum.frequency > 0.0) & (spectrum.density > 0.0)
    frequency, level = spectrum.frequency[keep], size * np.sqrt(spectrum.density[keep])
    if frequency.size <= points:
        return frequency, level
    edges = np.geomspace(frequency[0], frequency[-1] * (1.0 + 1e-12), points // 2 + 1)
    starts = np.unique(np.searchsorted(frequency, edges)).tolist()
    chosen: list[int] = []
    for start, stop in pairwise(starts):
        part = level[start:stop]
        chosen.extend(sorted({start + int(part.argmin()), start + int(part.argmax())}))
    return frequency[chosen], level[chosen]
