"""One style for all figures of the reports."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Final

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.markers import TICKDOWN, TICKLEFT, MarkerStyle
from matplotlib.ticker import LogFormatterSciNotation, NullLocator, ScalarFormatter

from sagnac.plot.frame import INK

_FAINT: Final = "#e4e4e4"
_TICKS: Final = "#6b6b6b"
_MINOR_TICK: Final = 1.8  # points

STYLE: Final[dict[Any, Any]] = {
    "font.family": "DejaVu Sans",
    "font.size": 9.5,
    "axes.labelsize": 9.5,
    "axes.edgecolor": _TICKS,
    "axes.linewidth": 0.7,
    "axes.labelcolor": INK,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.axisbelow": True,
    "axes.grid": True,
    "grid.color": _FAINT,
    "grid.linewidth": 0.6,
    "xtick.color": _TICKS,
    "ytick.color": _TICKS,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "xtick.labelsize": 8.5,
    "ytick.labelsize": 8.5,
    "xtick.minor.size": _MINOR_TICK,
    "ytick.minor.size": _MINOR_TICK,
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "lines.linewidth": 1.3,
    "lines.markersize": 3.6,
    "mathtext.fontset": "dejavusans",
    "svg.fonttype": "path",
    "path.simplify": True,
    "path.simplify_threshold": 0.3,
    # Whatever layout a user's own settings ask for: plots and legends are placed here.
    "figure.autolayout": False,
    "figure.constrained_layout.use": False,
}
_SIZE: Final = (6.6, 4.5)
_FRAME: Final = {"left": 0.115, "right": 0.975, "bottom": 0.115}
_LEGEND_ROW: Final = 0.165  # inches
_ABOVE: Final = 0.09  # inches above a plot or its legend
_POWER: Final = re.compile(r"\$\\mathdefault\{(.*?)(?:\\times)?10\^\{(.*?)\}\}\$")
_RAISED: Final = str.maketrans("-−0123456789", "⁻⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


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
    return f"{factor}{'·' if factor else ''}10{exponent.translate(_RAISED)}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Canvas:
    """A figure and the one axis in it."""

    figure: Figure
    axes: Axes


class _Mantissas(ScalarFormatter):
    """Numbers of a linear axis; their common power of ten stands with the unit of the axis."""

    def __init__(self) -> None:
        super().__init__(useOffset=False)
        self.set_powerlimits((-3, 4))

    def get_offset(self) -> str:
        """Nothing: it would stand above the axis, where the legend is."""
        return ""

    def power(self) -> str:
        """Factor that the numbers are to be multiplied with, ``10⁻⁵``; empty if by nothing."""
        _, marked, exponent = super().get_offset().partition("1e")
        return f"10{exponent.translate(_RAISED)}" if marked else ""


def _name_power(axis: Axis) -> None:
    """Write the power of ten of a linear axis before its unit: ``N (10⁻⁵ °/√h)``."""
    formatter = _Mantissas()
    axis.set_major_formatter(formatter)
    formatter.set_locs(axis.get_majorticklocs())  # type: ignore[arg-type]
    power = formatter.power()
    if power:
        name, bracket, unit = axis.get_label_text().rpartition("(")
        axis.set_label_text(f"{name}{bracket}{power} {unit}")


def _draw_minor_ticks_at_once(axes: Axes, axis: Axis) -> None:
    """Draw the minor ticks of a logarithmic axis as one line, unless some of them have labels.

    matplotlib makes several objects of each tick: that took a third of the time of a page.
    """
    low, high = sorted(axis.get_view_interval())
    if high <= 10.0 * low:
        # Within a decade there are labels.
        return
    places = np.array([place for place in axis.get_minorticklocs() if low <= place <= high])
    axis.set_minor_locator(NullLocator())
    across = axis is axes.xaxis
    none = np.zeros_like(places)
    axes.add_artist(
        Line2D(
            *((places, none) if across else (none, places)),
            transform=axes.get_xaxis_transform() if across else axes.get_yaxis_transform(),
            linestyle="none",
            marker=MarkerStyle(TICKDOWN if across else TICKLEFT),
            markersize=_MINOR_TICK,
            markeredgewidth=mpl.rcParams["xtick.minor.width"],
            color=_TICKS,
            clip_on=False,
        )
    )


@contextmanager
def styled() -> Iterator[Canvas]:
    """A figure in the style of the reports."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=_SIZE)
        axes = figure.add_subplot()
        figure.subplots_adjust(**_FRAME, top=1.0 - _ABOVE / _SIZE[1])
        yield Canvas(figure=figure, axes=axes)
        for each in figure.axes:
            for axis, scale in ((each.xaxis, each.get_xscale()), (each.yaxis, each.get_yscale())):
                if scale == "log":
                    axis.set_major_formatter(PowersOfTen())
                    axis.set_minor_formatter(PowersOfTen())
                    _draw_minor_ticks_at_once(each, axis)
                else:
                    _name_power(axis)


def legend_above(axes: Axes, columns: int) -> None:
    """Put the legend above the plot, so that it hides no data, and make room for its rows."""
    rows = -(-len(axes.get_legend_handles_labels()[0]) // columns)
    figure = axes.get_figure(root=True)
    assert figure is not None
    top = 1.0 - (_ABOVE + rows * _LEGEND_ROW) / figure.get_figheight()
    figure.subplots_adjust(top=top)
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
