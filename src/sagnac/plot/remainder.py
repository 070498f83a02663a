"""The residual against time and table angle, and N over parts of it."""

from typing import TYPE_CHECKING, Final

import numpy as np

from sagnac.analysis.result import Analysis
from sagnac.analysis.spectra import ByAngle, Residual
from sagnac.plot.frame import BLUE, INK, QUIET, axes_of, channel_of
from sagnac.units import DEGREE_PER_HOUR, DEGREE_PER_ROOT_HOUR

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Recordings longer than this are drawn in hours, s.
_LONG_S: Final = 7_000.0


def parts(analysis: Analysis, ax: "Axes | None" = None) -> "Axes":
    """N over parts of the recording (°/√h) against time, with the answer and its interval.

    Parameters
    ----------
    analysis
        What to draw; its `parts` are of one gyro.
    ax
        Where to draw; without it the current axis of ``pyplot``.

    Returns
    -------
    matplotlib.axes.Axes

    Examples
    --------
    >>> import numpy as np
    >>> from matplotlib.figure import Figure
    >>> from sagnac import Recording, analyze, plot
    >>> rate = 1e-6 * np.random.default_rng(1).standard_normal(6000)
    >>> recording = Recording.from_arrays(x=rate, kind="rate", unit="rad/s", sample_rate=10.0)
    >>> axes = plot.parts(analyze(recording), ax=Figure().add_subplot())
    >>> axes.get_ylabel()
    'N, x (°/√h)'
    """
    axes = axes_of(ax)
    answer = analysis.angle_random_walk
    if answer.status == "estimated":
        level = answer.value / DEGREE_PER_ROOT_HOUR
        axes.axhline(level, color=INK, linewidth=0.9, linestyle=(0, (5, 3)), label="the answer")
        axes.axhspan(
            answer.low / DEGREE_PER_ROOT_HOUR,
            answer.high / DEGREE_PER_ROOT_HOUR,
            color=QUIET,
            alpha=0.25,
            linewidth=0,
            label=f"its {100 * answer.confidence:g} % interval",
        )
    seen = [part for part in analysis.parts if part.shows]
    for number, part in enumerate(seen):
        middle, half = 0.5 * (part.start_s + part.stop_s), 0.5 * (part.stop_s - part.start_s)
        value, low, high = (one / DEGREE_PER_ROOT_HOUR for one in (part.value, part.low, part.high))
        axes.errorbar(
            [middle],
            [value],
            xerr=[half],
            yerr=[[value - low], [high - value]],
            color=BLUE,
            marker="o",
            markersize=3.6,
            elinewidth=0.9,
            linestyle="none",
            label="a part" if number == 0 else None,
        )
    if not seen:
        axes.text(0.5, 0.5, "no part shows N", transform=axes.transAxes, ha="center")
    axes.set(xlabel="time (s)", ylabel=f"N, {channel_of(analysis)} (°/√h)")
    if axes.get_legend_handles_labels()[0]:
        axes.legend()
    return axes


def residual(analysis: Analysis, ax: "Axes | None" = None) -> "Axes":
    """Mean rate of what removal leaves against time, °/h per gyro, less its mean.

    Parameters
    ----------
    analysis
        What to draw.
    ax
        Where to draw; without it the current axis of ``pyplot``.

    Raises
    ------
    ValueError
        If the analysis kept no residual.

    Examples
    --------
    >>> import numpy as np
    >>> from matplotlib.figure import Figure
    >>> from sagnac import Recording, analyze, plot
    >>> rate = np.random.default_rng(1).standard_normal(6000)
    >>> still = Recording.from_arrays(x=rate, kind="rate", unit="deg/h", sample_rate=10.0)
    >>> plot.residual(analyze(still), ax=Figure().add_subplot()).get_ylabel()
    'left (°/h)'
    """
    axes, kept = axes_of(ax), _residual(analysis)
    long = float(kept.time[-1]) > _LONG_S
    axes.plot(kept.time / (3600.0 if long else 1.0), kept.rate / DEGREE_PER_HOUR, color=BLUE)
    axes.set_xlabel(f"time ({'h' if long else 's'})")
    axes.set_ylabel("left (°/h)")
    return axes


def residual_by_angle(analysis: Analysis, ax: "Axes | None" = None) -> "Axes":
    """Mean rate over the turns of the table, °/h per gyro, of what removal leaves.

    Parameters
    ----------
    analysis, ax
        As in `residual`.

    Raises
    ------
    ValueError
        If the analysis kept none.

    Examples
    --------
    >>> from matplotlib.figure import Figure
    >>> from sagnac import RigConfig, analyze, plot, simulate
    >>> turning = simulate(RigConfig(duration_s=60.0, sample_rate_hz=50.0)).recording
    >>> found = analyze(turning, gyros=("x", "z"))
    >>> plot.residual_by_angle(found, ax=Figure().add_subplot()).get_xlabel()
    'table angle (°)'
    """
    axes, turn = axes_of(ax), _by_angle(analysis)
    axes.plot(np.degrees(turn.angle), turn.after / DEGREE_PER_HOUR, color=BLUE)
    axes.set_xlim(0.0, 360.0)
    axes.set_xticks(range(0, 361, 60))
    axes.set_xlabel("table angle (°)")
    axes.set_ylabel("left (°/h)")
    return axes


def orders(analysis: Analysis, ax: "Axes | None" = None) -> "Axes":
    """Amplitude of each order of the table angle, °/h per gyro, before and after removal.

    Parameters
    ----------
    analysis, ax
        As in `residual`.

    Raises
    ------
    ValueError
        If the analysis kept none.

    Examples
    --------
    >>> from matplotlib.figure import Figure
    >>> from sagnac import RigConfig, analyze, plot, simulate
    >>> turning = simulate(RigConfig(duration_s=60.0, sample_rate_hz=50.0)).recording
    >>> found = analyze(turning, gyros=("x", "z"))
    >>> plot.orders(found, ax=Figure().add_subplot()).get_xlabel()
    'order of the table angle'
    """
    axes, turn = axes_of(ax), _by_angle(analysis)
    for amplitude, color, marker, label in (
        (turn.amplitude_before, QUIET, "s", "before removal"),
        (turn.amplitude_after, BLUE, "o", "after removal"),
    ):
        axes.plot(
            turn.order, amplitude / DEGREE_PER_HOUR, color=color, marker=marker, markersize=2.2,
            linewidth=0.7, label=label,
        )  # fmt: skip
    axes.set_yscale("log")
    axes.set_xlabel("order of the table angle")
    axes.set_ylabel("amplitude (°/h)")
    axes.legend(loc="upper right")
    return axes


def _residual(analysis: Analysis) -> Residual:
    if analysis.residual is None:
        raise ValueError("analysis kept no residual")
    return analysis.residual


def _by_angle(analysis: Analysis) -> ByAngle:
    turn = _residual(analysis).by_angle
    if turn is None:
        raise ValueError("analysis has no table that turns")
    return turn
