"""The figures of an analysis in the style of the reports, as SVG and PNG."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from io import BytesIO, StringIO
from itertools import cycle
from pathlib import Path
from typing import Final

import matplotlib as mpl
import numpy as np
from markupsafe import escape
from matplotlib.figure import Figure

from sagnac import plot
from sagnac.analysis.result import Analysis
from sagnac.plot.frame import BLUE, GREEN, INK, ORANGE, QUIET, channel_of, literal, logarithmic
from sagnac.report.files import write_bytes
from sagnac.report.quantities import curve_unit, in_field_unit, number
from sagnac.report.style import STYLE, legend_above, styled
from sagnac.units import DEGREE_PER_HOUR, Unit

COLORS: Final = {
    "none": QUIET,
    "fris": ORANGE,
    "fos-paper": GREEN,
    "fos-korenberg": INK,
    "fos": BLUE,
}
MARKERS: Final = {"none": "s", "fris": "^", "fos-paper": "D", "fos-korenberg": "v", "fos": "o"}

_HUNDREDTHS: Final = re.compile(r"(\.\d{2})\d+")


def stability_figure(analysis: Analysis) -> Figure:
    """Allan deviation before and after removal, the five-term fit, and its slopes."""
    with styled() as canvas:
        plot.stability(analysis, canvas.axes)
        legend_above(canvas.axes, columns=4)
    return canvas.figure


def spectrum_figure(analysis: Analysis) -> Figure:
    """Rate spectrum before and after removal, with the lines that were removed marked."""
    with styled() as canvas:
        plot.spectrum(analysis, canvas.axes)
        if canvas.axes.get_legend() is not None:
            legend_above(canvas.axes, columns=3)
    return canvas.figure


def parts_figure(analysis: Analysis) -> Figure | None:
    """N over parts of the recording against time; None if fewer than two parts show it."""
    if sum(part.shows for part in analysis.parts) < 2:
        return None
    with styled() as canvas:
        plot.parts(analysis, canvas.axes)
        legend_above(canvas.axes, columns=3)
    return canvas.figure


def residual_figure(analysis: Analysis) -> Figure | None:
    """The residual against time; on a table also against its angle, and by orders."""
    if analysis.residual is None or analysis.residual.time.size < 2:
        return None
    with styled() as canvas:
        figure = canvas.figure
        sides = {"left": figure.subplotpars.left, "right": figure.subplotpars.right}
        figure.clear()
        if analysis.residual.by_angle is None:
            plot.residual(analysis, figure.add_subplot())
            figure.subplots_adjust(top=0.96, **sides)
        else:
            figure.set_size_inches(figure.get_figwidth(), 6.4)
            against_time, against_angle, orders = figure.subplots(3, 1)
            plot.residual(analysis, against_time)
            plot.residual_by_angle(analysis, against_angle)
            plot.orders(analysis, orders)
            figure.subplots_adjust(top=0.98, bottom=0.085, hspace=0.42, **sides)
    return figure


def comparison_figure(analyses: Mapping[str, Analysis]) -> Figure:
    """The stability curve that each method leaves, with the N it gives.

    Parameters
    ----------
    analyses
        By method, all of one recording.
    """
    with styled() as canvas:
        for method, analysis in analyses.items():
            curve = analysis.curve.per_gyro()
            reach = np.stack([curve.deviation - curve.low, curve.high - curve.deviation])
            canvas.axes.errorbar(
                curve.tau,
                curve.deviation / DEGREE_PER_HOUR,
                yerr=np.maximum(reach, 0.0) / DEGREE_PER_HOUR,
                color=COLORS.get(method, INK),
                marker=MARKERS.get(method, "x"),
                linewidth=1.0,
                elinewidth=0.7,
                label=f"{method}: {_short_answer(analysis)}",
            )
        one = next(iter(analyses.values()))
        logarithmic(canvas.axes, "cluster time τ (s)", f"Allan deviation, {channel_of(one)} (°/h)")
        legend_above(canvas.axes, columns=2)
    return canvas.figure


def unit_figure(analysis: Analysis) -> Figure:
    """Allan deviation of each gyro that was taken alone, as recorded."""
    return curves_figure(list(analysis.gyros.values()), curve_unit("oadev"))


def curves_figure(analyses: Sequence[Analysis], unit: Unit) -> Figure:
    """Allan deviation of several channels against cluster time, as recorded, in a unit of rate."""
    with styled() as canvas:
        for analysis, color in zip(analyses, cycle((BLUE, ORANGE, GREEN, INK)), strict=False):
            curve = analysis.curve_before
            canvas.axes.plot(
                curve.tau,
                curve.deviation / unit.size,
                color=color,
                marker="o",
                markersize=3.0,
                linewidth=0.9,
                label=literal(analysis.channel),
            )
            canvas.axes.fill_between(
                curve.tau,
                curve.low / unit.size,
                curve.high / unit.size,
                color=color,
                alpha=0.15,
                linewidth=0,
            )
        logarithmic(canvas.axes, "cluster time τ (s)", f"Allan deviation ({unit.symbol})")
        legend_above(canvas.axes, columns=6)
    return canvas.figure


@dataclass(frozen=True, slots=True, kw_only=True)
class ReportFigures:
    """The figures of one analysis, drawn once for the page and for the files beside it.

    Attributes
    ----------
    stability
        Allan deviation against cluster time.
    spectrum
        Rate spectrum.
    parts
        N against time; None if fewer than two parts show it.
    residual
        What removal leaves, against time and table angle; None if it was not kept.
    """

    stability: Figure
    spectrum: Figure
    parts: Figure | None = None
    residual: Figure | None = None


def report_figures(analysis: Analysis) -> ReportFigures:
    """The figures of a report."""
    return ReportFigures(
        stability=stability_figure(analysis),
        spectrum=spectrum_figure(analysis),
        parts=parts_figure(analysis),
        residual=residual_figure(analysis),
    )


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
    with mpl.rc_context({**STYLE, "svg.hashsalt": name}):
        figure.savefig(text, format="svg", metadata={"Date": None, "Creator": None})
    drawing = text.getvalue()
    drawing = drawing[drawing.index("<svg") :]
    drawing = re.sub(r"<metadata>.*?</metadata>", "", drawing, flags=re.DOTALL)
    before = re.sub(r"[^A-Za-z0-9-]", lambda found: f"_{ord(found[0]):x}", name)
    drawing = re.sub(r'\b(id="|href="#|url\(#)', rf"\g<1>{before}-", drawing)
    # A hundredth of a point is finer than any printer; glyphs (in font units) stay as they are.
    drawing = re.sub(
        r'(?<= d=")M [^"]*(?=")', lambda path: _HUNDREDTHS.sub(r"\1", path.group()), drawing
    )
    # Names in the description are neither marks of the page nor groups of the pattern.
    said = escape(description)
    return re.sub(
        r"<svg [^>]*?(viewBox=\"[^\"]*\")[^>]*>",
        lambda found: (
            f'<svg xmlns:xlink="http://www.w3.org/1999/xlink" {found[1]} role="img" '
            f'aria-label="{said}">'
        ),
        drawing,
        count=1,
    )


def write_png(figure: Figure, path: Path) -> None:
    """The figure as a PNG of 200 dots per inch, whole or not at all.

    Raises
    ------
    RecordingError
        If the folder cannot be written to.
    """
    picture = BytesIO()
    with mpl.rc_context(STYLE):
        figure.savefig(picture, format="png", dpi=200, metadata={"Software": None})
    write_bytes(path, picture.getvalue())


def _short_answer(analysis: Analysis) -> str:
    shown = in_field_unit("angle_random_walk", analysis.angle_random_walk)
    if shown.status == "not observable":
        return "N not observable"
    relation = "=" if shown.status == "estimated" else "<"
    width = 0.5 * (shown.high - shown.low)
    return f"N {relation} {number(shown.value, width)} °/√h"
