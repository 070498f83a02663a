"""The figures of an analysis and of the table in the style of the reports, as SVG and PNG."""

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from io import StringIO
from pathlib import Path
from typing import Final

import matplotlib as mpl
import numpy as np
from markupsafe import Markup, escape
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_svg import RendererSVG
from matplotlib.figure import Figure
from matplotlib.ticker import LogFormatterSciNotation, LogLocator, ScalarFormatter
from numpy.typing import ArrayLike

from sagnac.analysis.result import Analysis
from sagnac.analysis.spectra import ByAngle
from sagnac.core import units, whole_files
from sagnac.core.arrays import FloatArray
from sagnac.noise.cross_spectra import SelfNoise
from sagnac.report import density, deviation, frame, quantities
from sagnac.table.frames import table_to_gyro_matrix

# ---- style -------------------------------------------------------------------------

_STYLE_FILE: Final = Path(__file__).with_name("report.mplstyle")
STYLE: Final = mpl.rc_params_from_file(_STYLE_FILE, use_default_template=False)
_SIZE: Final = (6.6, 4.5)
_FRAME: Final = {"left": 0.115, "right": 0.975, "bottom": 0.115}
_ABOVE: Final = 0.09  # inches above a plot or its legend
_POWER: Final = re.compile(r"\$\\mathdefault\{(.*?)(?:\\times)?10\^\{(.*?)\}\}\$")


class PowersOfTen(LogFormatterSciNotation):
    """Labels of a logarithmic axis in plain characters.

    The mathematical layout of matplotlib takes a third of the time that a figure takes.

    Examples
    --------
    >>> from matplotlib.figure import Figure
    >>> axes = Figure().add_subplot(xscale="log")
    >>> axes.xaxis.set_major_formatter(PowersOfTen())
    >>> axes.xaxis.get_major_formatter()(1e-3)
    '10⁻³'
    """

    def __call__(self, value: float, position: int | None = None) -> str:
        """The label of a tick; empty if it takes none."""
        return _POWER.sub(_plain, super().__call__(value, position))


def _plain(power: re.Match[str]) -> str:
    factor, exponent = power.groups()
    return f"{factor}{'·' if factor else ''}10{exponent.translate(quantities.SUPERSCRIPTS)}"


class _Mantissas(ScalarFormatter):
    """Numbers of a linear axis, whose common power of ten stands with its unit."""

    def get_offset(self) -> str:
        """Empty: it would be written above the axis, in the legend's place."""
        return ""


def _name_power(axis: Axis) -> None:
    """Write the power of ten of a linear axis before its unit: ``N (10⁻⁵ °/√h)``."""
    formatter = _Mantissas(useOffset=False)
    formatter.set_powerlimits((-3, 4))
    axis.set_major_formatter(formatter)
    formatter.set_locs(axis.get_majorticklocs())  # type: ignore[arg-type]
    _, marked, exponent = ScalarFormatter.get_offset(formatter).partition("1e")
    if marked:
        name, bracket, unit = axis.get_label_text().rpartition("(")
        power = exponent.translate(quantities.SUPERSCRIPTS)
        axis.set_label_text(f"{name}{bracket}10{power} {unit}")


@contextmanager
def styled(columns: int = 0) -> Iterator[tuple[Figure, Axes]]:
    """A figure in the style of the reports, and its axis.

    At the end a legend of `columns` columns is put above the plot, if that is not 0.
    """
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=_SIZE)
        axes = figure.add_subplot()
        figure.subplots_adjust(**_FRAME, top=1.0 - _ABOVE / _SIZE[1])
        yield figure, axes
        if columns:
            legend_above(axes, columns)
        for each in figure.axes:
            for axis, scale in ((each.xaxis, each.get_xscale()), (each.yaxis, each.get_yscale())):
                if scale == "log":
                    axis.set_major_formatter(PowersOfTen())
                    # Two minor ticks a decade: matplotlib's eight take a fifth of a page's time.
                    axis.set_minor_locator(LogLocator(subs=(2.0, 5.0)))
                    axis.set_minor_formatter(PowersOfTen())
                else:
                    _name_power(axis)


def legend_above(axes: Axes, columns: int) -> None:
    """Put the legend above the plot, so that it hides no data, and make room for its rows.

    It has `columns` columns, or fewer if names are so long that the figure would cut it off.
    """
    figure = axes.get_figure(root=True)
    assert figure is not None
    legend = axes.legend(
        loc="lower left",
        bbox_to_anchor=(-0.02, 0.995),
        ncols=columns,
        columnspacing=1.4,
        handlelength=1.6,
        handletextpad=0.5,
        borderaxespad=0.0,
        labelspacing=0.25,
    )
    if columns > 1 and legend.get_window_extent().x1 > figure.bbox.x1:
        legend_above(axes, columns - 1)
        return
    rows = -(-len(legend.get_texts()) // columns)
    # A row of the legend takes 0.165 inches.
    figure.subplots_adjust(top=1.0 - (_ABOVE + rows * 0.165) / figure.get_figheight())


# ---- figures -----------------------------------------------------------------------

# Colour and marker of a curve by the method that leaves it.
_METHOD_STYLES: Final = {
    "none": (frame.QUIET, "s"), "fris": (frame.ORANGE, "^"), "fos-paper": (frame.GREEN, "D"),
    "fos-korenberg": (frame.INK, "v"), "fos": (frame.BLUE, "o"),
}  # fmt: skip


def report_figures(analysis: Analysis) -> dict[str, Figure]:
    """The figures of one analysis by name, drawn once for the page and for the files beside it.

    ``stability``, ``spectrum``, ``parts`` (of two parts or more that show N) and ``residual``; one
    that there is nothing for is left out. Of several gyros at rest ``stability`` alone, of all.
    """
    if analysis.gyros:
        return {"stability": curves_figure(list(analysis.gyros.values()))}
    drawn = {"stability": _drawn(deviation.stability, analysis, 4)}
    drawn["spectrum"] = _drawn(density.spectrum, analysis, 3)
    if sum(part.shows for part in analysis.parts) > 1:
        drawn["parts"] = _drawn(deviation.parts, analysis, 3)
    if analysis.residual is not None and analysis.residual.time.size > 1:
        drawn["residual"] = _residual_figure(analysis, analysis.residual.by_angle)
    return drawn


def self_noise_figure(found: SelfNoise) -> Figure:
    """Noise density of each of several gyros alone, and what all share."""
    return _drawn(density.self_noise, found, 4)


def _drawn(draw: Callable[..., Axes], result: Analysis | SelfNoise, columns: int) -> Figure:
    """A picture of a result, its legend above it."""
    with styled() as (figure, axes):
        draw(result, axes)
        if axes.get_legend() is not None:
            legend_above(axes, columns)
    return figure


def _residual_figure(analysis: Analysis, by_angle: ByAngle | None) -> Figure:
    """The residual against time; on a table also against its angle, and by orders."""
    draws = (deviation.residual, deviation.residual_by_angle, deviation.orders)
    with styled() as (figure, axes):
        if by_angle is not None:
            figure.clear()
            figure.set_size_inches(figure.get_figwidth(), 6.4)
            for draw, one in zip(draws, figure.subplots(3, 1), strict=True):
                draw(analysis, one)
            figure.subplots_adjust(**{**_FRAME, "bottom": 0.085}, top=0.98, hspace=0.42)
        else:
            deviation.residual(analysis, axes)
            figure.subplots_adjust(bottom=0.11, top=0.96)
    return figure


def comparison_figure(analyses: Mapping[str, Analysis]) -> Figure:
    """The stability curve that each method leaves, with the N it gives.

    Parameters
    ----------
    analyses
        By method, all of one recording.
    """
    with styled(2) as (figure, axes):
        for method, analysis in analyses.items():
            curve = analysis.curve
            reach = np.stack([curve.deviation - curve.low, curve.high - curve.deviation])
            color, marker = _METHOD_STYLES.get(method, (frame.INK, "x"))
            axes.errorbar(
                curve.tau, curve.deviation / units.DEGREE_PER_HOUR,
                yerr=np.maximum(reach, 0.0) / units.DEGREE_PER_HOUR, color=color, marker=marker,
                linewidth=1.0, elinewidth=0.7, label=f"{method}: {_short_answer(analysis)}",
            )  # fmt: skip
        channel = frame.channel_of(next(iter(analyses.values())))
        frame.logarithmic(axes, "cluster time τ (s)", f"Allan deviation, {channel} (°/h)")
    return figure


def curves_figure(analyses: Sequence[Analysis]) -> Figure:
    """Allan deviation of gyros, or of accelerometers, against cluster time, as recorded."""
    unit = frame.rate_unit(analyses[0])
    with styled(6) as (figure, axes):
        for analysis in analyses:
            curve, (color, marker) = analysis.curve_before, frame.next_style(axes)
            ends = (curve.deviation, curve.low, curve.high)
            deviation, low, high = (one / unit.size for one in ends)
            axes.plot(
                curve.tau, deviation, color=color, marker=marker, markersize=3.0, linewidth=0.9,
                label=frame.literal(analysis.channel),
            )  # fmt: skip
            frame.band(axes, curve.tau, low, high, color, alpha=0.15)
        frame.logarithmic(axes, "cluster time τ (s)", f"Allan deviation ({unit.symbol})")
    return figure


def svg(figure: Figure, name: str, description: str) -> Markup:
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
        figure.dpi = 72
        renderer = RendererSVG(*figure.bbox.size, text, metadata={"Date": None, "Creator": None})
        figure.draw(renderer)
        renderer.finalize()
    drawing = text.getvalue()
    drawing = drawing[drawing.index("<svg") :]
    drawing = re.sub(r"<metadata>.*?</metadata>", "", drawing, flags=re.DOTALL)
    before = re.sub(r"[^A-Za-z0-9-]", lambda found: f"_{ord(found[0]):x}", name)
    for mark in (' id="', 'href="#', "url(#"):
        drawing = drawing.replace(mark, f"{mark}{before}-")
    # A hundredth of a point is finer than any printer; glyphs (in font units) stay as they are.
    outline = re.compile(r'(?<= d=")M [^"]*(?=")')
    drawing = outline.sub(lambda path: re.sub(r"(?<=\.\d{2})\d+", "", path.group()), drawing)
    view = re.findall(r'viewBox="[^"]*"', drawing)[0]
    label = f'role="img" aria-label="{escape(description)}"'
    head = f'<svg xmlns:xlink="http://www.w3.org/1999/xlink" {view} {label}>'
    return Markup(head + drawing.partition(">")[2])


def write_png(figure: Figure, path: Path) -> None:
    """The figure as a PNG of 200 dots per inch, whole or not at all.

    Raises
    ------
    RecordingError
        If the folder cannot be written to.
    """
    with mpl.rc_context(STYLE), whole_files.replacing(path) as temporary:
        figure.dpi = 200
        fast = {"compress_level": 1}
        FigureCanvasAgg(figure).print_png(temporary, metadata={"Software": None}, pil_kwargs=fast)


def _short_answer(analysis: Analysis) -> str:
    value, _, status = quantities.reading_cells(analysis.angle_random_walk, plain=False)
    relation = "= " if status == "estimated" else ""
    return f"N {status}" if status == "not observable" else f"N {relation}{value} °/√h"


# ---- frames figure -----------------------------------------------------------------

# The eye stands to the south-east, above the table.
_AZIMUTH: Final = -62.0 * units.DEGREE
_HEIGHT: Final = 24.0 * units.DEGREE
_TURNED: Final = 38.0 * units.DEGREE  # of the table since the null indicator
_HEADING: Final = 25.0 * units.DEGREE  # of the null indicator from north
_INNER: Final = 0.92  # radius of the inner circle, of the rim's


def frames_figure() -> Figure:
    """Local level (n), null (b0), table (b) and gyro (s) frames, true to Eq. 1, of equal shares."""
    null, table = _turned(_HEADING), _turned(_HEADING + _TURNED)
    gyros = table_to_gyro_matrix(*np.full(3, 1.0 / np.sqrt(3.0))) @ table
    with styled() as (figure, axes):
        axes.set_aspect("equal")
        axes.set_axis_off()
        _draw_table(axes, null, table)
        for rows, color, style, names in (
            # Rows of the level frame: north, east, down.
            (np.eye(3), frame.QUIET, "-", ("$x_n$ north", "$y_n$ east", "")),
            (null[:2], frame.ORANGE, "--", ("$x_{b0}$, null", "$y_{b0}$")),
            (table, frame.INK, "-", ("$x_b$", "$y_b$", "$z_b$, $z_n$ down, shaft")),
            (gyros, frame.BLUE, "-", ("$x_s$", "$y_s$", "$z_s$")),
        ):
            arrow = {"arrowstyle": "-|>", "color": color, "linestyle": style, "linewidth": 1.1}
            for (across, up), name in zip(seen(1.15 * rows), names, strict=True):
                axes.annotate("", (across, up), (0.0, 0.0), arrowprops=arrow)
                side = "left" if across > 0.9 else "center"
                axes.annotate(name, (1.09 * across, 1.09 * up), color=color, ha=side, va="center")
        # The table angle, from the null indicator to x_b.
        arc = _around(np.linspace(_HEADING, _HEADING + _TURNED, 40))
        axes.plot(*seen(0.55 * arc).T, color=frame.GREEN, linewidth=1.2)
        ((across, up),) = seen(0.63 * arc[20])
        axes.annotate(r"$\alpha$", (across, up), color=frame.GREEN, ha="center", va="center")
        axes.set(xlim=(-1.4, 1.55), ylim=(-1.3, 0.6))
    return figure


def _turned(angle: float) -> FloatArray:
    """(3, 3) rows: the axes of a frame turned about down from north towards east."""
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.array([[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]])


def _around(angles: FloatArray) -> FloatArray:
    """(angles, 3) where the rim of the table is at angles from the first axis of a frame."""
    return np.stack([np.cos(angles), np.sin(angles), 0.0 * angles], axis=1)


def seen(points: ArrayLike) -> FloatArray:
    """(points, 2) where points in north, east and down stand on the page, without perspective."""
    north, east, down = np.atleast_2d(np.asarray(points, dtype=np.float64)).T
    across = east * np.cos(_AZIMUTH) - north * np.sin(_AZIMUTH)
    away = east * np.sin(_AZIMUTH) + north * np.cos(_AZIMUTH)
    return np.stack([across, away * np.sin(_HEIGHT) - down * np.cos(_HEIGHT)], axis=1)


def _draw_table(axes: Axes, null: FloatArray, table: FloatArray) -> None:
    """The turntable, the divisions of its encoder, and the null indicator."""
    for radius in (1.0, _INNER):
        circle = radius * _around(np.linspace(0.0, 2.0 * np.pi, 361))
        axes.plot(*seen(circle).T, color=frame.QUIET, linewidth=0.8)
    for mark in _around(np.arange(0.0, 360.0, 5.0) * units.DEGREE) @ table:
        axes.plot(*seen([_INNER * mark, mark]).T, color=frame.QUIET, linewidth=0.5)
    axes.plot(*seen(null[:1])[0], marker="o", color=frame.ORANGE, markersize=4.5)
