"""Axes, colours and labels that all pictures share."""

from types import NoneType
from typing import Any, Final

from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.lines import Line2D

from sagnac.analysis.result import Analysis
from sagnac.core.arrays import FloatArray
from sagnac.core.errors import require_type
from sagnac.core.units import SENSED, UNITS, Unit

INK: Final = "#1a1a1a"
QUIET: Final = "#9a9a9a"
BLUE: Final = "#1f5a96"
ORANGE: Final = "#c4561b"
GREEN: Final = "#2f7d5b"
OCHRE: Final = "#8a6d00"
# Of several curves, one after another.
COLORS: Final = (BLUE, ORANGE, GREEN, "#7a4f9a", OCHRE, INK)
MARKERS: Final = ("o", "s", "^", "D", "v")

DASHED: Final = (0, (5, 3))
DOTTED: Final = (0, (2, 3))

# Labels of a curve that stands alone: of the residual, or of the recording as it is.
STATES: Final = ("after removal", "as recorded")


def axes_of(given: Axes | None, drawn: object, *kinds: type, name: str = "analysis") -> Axes:
    """The axes given, else the current ones of ``pyplot``; for a result of one of the kinds.

    Raises
    ------
    TypeError
        If the argument `name` holds no such result, by itself an analysis, or these are no axes.
    """
    kinds = kinds or (Analysis,)
    require_type(name, drawn, kinds, f"give an object of {' or '.join(k.__name__ for k in kinds)}")
    require_type("ax", given, (Axes, NoneType), "give axes of matplotlib")
    if given is not None:
        return given
    from matplotlib import pyplot  # noqa: PLC0415  (half a second that a stability curve need not wait for)

    return pyplot.gca()


def band(
    axes: Axes, at: FloatArray, low: FloatArray, high: FloatArray, color: str, **more: Any
) -> None:
    """An interval, as a band of a fifth of its color."""
    axes.fill_between(at, low, high, color=color, linewidth=0, **{"alpha": 0.2, **more})


def next_style(axes: Axes) -> tuple[str, str]:
    """The color of `COLORS` that the fewest lines on the axes have, and a marker it has not yet."""
    drawn = [(to_hex(line.get_color()), line.get_marker()) for line in axes.lines]
    color = min(COLORS, key=[one for one, _ in drawn].count)
    return color, next((one for one in MARKERS if (color, one) not in drawn), MARKERS[0])


def model(axes: Axes, at: FloatArray, values: FloatArray, **style: Any) -> None:
    """A law or a fit, which limits need not hold: it may lie far below the data."""
    axes.add_artist(Line2D(at, values, **style))


def logarithmic(axes: Axes, across: str, up: str) -> None:
    """Both scales logarithmic, with limits that hold all data, and what they are of."""
    axes.set(xscale="log", yscale="log", xlabel=across, ylabel=up)
    axes.autoscale()


def without_data(axes: Axes, why: str) -> Axes:
    """Limits of logarithmic axes with nothing on them, which find none of their own."""
    if not axes.dataLim.width > 0.0:
        axes.set(xlim=(0.1, 10.0), ylim=(0.1, 10.0))
    axes.text(0.5, 0.5, why, transform=axes.transAxes, ha="center")
    return axes


def literal(text: str) -> str:
    """A text that is drawn as it is: dollar signs would make formulas of names."""
    return text.replace("$", r"\$")


def channel_of(analysis: Analysis) -> str:
    """Subject of a figure, for a label: ``x − z per gyro``."""
    readable = literal(analysis.channel).replace("-", " − ")
    return f"{readable} per gyro" if analysis.is_pair else readable


def rate_unit(analysis: Analysis) -> Unit:
    """Unit that rates are drawn in: deg/h, or mg of an accelerometer."""
    return UNITS[SENSED[analysis.sensor].rate_unit]


def removed(analysis: Analysis) -> bool:
    """Whether the periodic parts were removed."""
    return analysis.settings.method != "none"


def after_removal(analysis: Analysis) -> str:
    """State of the residual, for a label: as recorded if nothing was removed."""
    return STATES[0] if removed(analysis) else STATES[1]
