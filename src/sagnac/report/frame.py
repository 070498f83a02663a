"""Axes, colours and labels that all pictures share."""

from typing import Any, Final

from matplotlib.axes import Axes

from sagnac.analysis.result import Analysis
from sagnac.core.arrays import FloatArray

INK: Final = "#1a1a1a"
QUIET: Final = "#9a9a9a"
BLUE: Final = "#1f5a96"
ORANGE: Final = "#c4561b"
GREEN: Final = "#2f7d5b"
OCHRE: Final = "#8a6d00"
# Of several curves, one after another.
COLORS: Final = (BLUE, ORANGE, GREEN, "#7a4f9a", OCHRE, INK)

DASHED: Final = (0, (5, 3))
DOTTED: Final = (0, (2, 3))

# Labels of a curve that stands alone: of the residual, or of the recording as it is.
STATES: Final = ("after removal", "as recorded")


def axes_of(given: Axes | None) -> Axes:
    """The axes given, else the current ones of ``pyplot``."""
    if given is not None:
        return given
    from matplotlib import pyplot  # noqa: PLC0415  (half a second that a stability curve need not wait for)

    return pyplot.gca()


def band(
    axes: Axes, at: FloatArray, low: FloatArray, high: FloatArray, color: str, **more: Any
) -> None:
    """An interval, as a band of a fifth of its color."""
    axes.fill_between(at, low, high, color=color, linewidth=0, **{"alpha": 0.2, **more})


def logarithmic(axes: Axes, across: str, up: str) -> None:
    """Both scales logarithmic, and what they are of."""
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlabel(across)
    axes.set_ylabel(up)


def literal(text: str) -> str:
    """A text that is drawn as it is: dollar signs would make formulas of names."""
    return text.replace("$", r"\$")


def channel_of(analysis: Analysis) -> str:
    """Subject of a figure, for a label: ``x − z per gyro``."""
    readable = literal(analysis.channel).replace("-", " − ")
    return f"{readable} per gyro" if analysis.is_pair else readable


def removed(analysis: Analysis) -> bool:
    """Whether the periodic parts were removed."""
    return analysis.settings.method != "none"


def after_removal(analysis: Analysis) -> str:
    """State of the residual, for a label: as recorded if nothing was removed."""
    return STATES[0] if removed(analysis) else STATES[1]
