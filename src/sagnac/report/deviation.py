"""Deviation against cluster time; the residual against time and angle, and N over parts."""

import math
from collections.abc import Mapping
from typing import Final, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patheffects import withStroke

from sagnac.analysis.result import Analysis, headline_coefficients, headline_fit
from sagnac.analysis.spectra import ByAngle, Residual
from sagnac.core.arrays import FloatArray
from sagnac.core.errors import per_cent, refusal
from sagnac.core.units import DEGREE_PER_HOUR, SENSED, UNITS, field_unit
from sagnac.noise.laws import COEFFICIENT_NAMES, SYMBOLS, CoefficientName, allan_variance
from sagnac.report import frame
from sagnac.stability.curve import StabilityCurve

# How the Allan deviation of each term rises with tau on a log-log plot.
_SLOPES: Final = dict(zip(COEFFICIENT_NAMES, ("−1", "−½", "0", "+½", "+1"), strict=True))
# Name of the drawn sum, by the member of the average that gives the answer.
_NAMES: Final = {"average": "average", "both": "N of the likelihood", "whole band": "likelihood"}
# Label of the axis of deviations before the channel, and the units behind it.
_OF_CHANNEL: Final = "Allan deviation, "
_UNITS: Final = tuple(f" ({UNITS[one.rate_unit].symbol})" for one in SENSED.values())
# Units of a curve that was made of values, by the power of the second in them.
_OF_VALUES: Final = {
    -1: " (unit of the values per s)",
    0: " (unit of the values)",
    1: " (unit of the values × s)",
}


def stability(
    result: Analysis | StabilityCurve, ax: Axes | None = None, *, label: str = ""
) -> Axes:
    """Deviation against cluster time, with its interval; of an analysis with the fit.

    Parameters
    ----------
    result
        An analysis: Allan deviation before and after removal (°/h, of an accelerometer mg), the
        fit that the answer rests on, and each term that it estimated with its slope. Or one curve,
        in its own unit.
        Several gyros that were taken alone are drawn one over the other: of each the curve after
        removal and the fit, in a colour or with a marker of its own, with its name.
    ax
        Where to draw; without it the current axis of ``pyplot``. An analysis that joins others
        there is drawn over them in the same way. Limits hold what is there already.
    label
        What the legend calls it: of several analyses of gyros of one name, the unit of each. Unless
        stated the name of the gyro, what was done to it if it stands alone, or the estimator.

    Returns
    -------
    matplotlib.axes.Axes

    Raises
    ------
    ValueError
        If deviations in another unit are there already.

    Examples
    --------
    >>> import numpy as np
    >>> from matplotlib.figure import Figure
    >>> from sagnac import plot, stability_curve
    >>> rate = np.random.default_rng(1).standard_normal(1000)
    >>> curve = stability_curve(rate, kind="rate", sample_rate=10.0)
    >>> plot.stability(curve, ax=Figure().add_subplot()).get_xlabel()
    'cluster time τ (s)'
    """
    axes = frame.axes_of(ax, result, Analysis, StabilityCurve, name="result")
    if isinstance(result, StabilityCurve):
        # Rates are per time already, angles and increments are not; a time deviation is times tau.
        seconds = (result.estimator == "tdev") - (result.kind != "rate")
        _frame(axes, result.estimator, _OF_VALUES[seconds])
        _limits(axes, result.tau, result.deviation, result.low)
        _points(axes, result, 1.0, label=label or result.estimator)
    elif result.gyros or axes.collections:
        # The curve of an analysis that stood alone is called by its channel, as others join it.
        for line in axes.get_lines():
            if line.get_label() in frame.STATES:
                line.set_label(axes.get_ylabel().removeprefix(_OF_CHANNEL).rpartition(" (")[0])
        for analysis in result.each:
            name = frame.channel_of(analysis)
            named = f"{label}, {name}" if label and result.gyros else label
            _draw_over(axes, analysis, named or name)
    else:
        _draw_curves(axes, result, label)
    axes.legend()
    return axes


def _draw_over(axes: Axes, analysis: Analysis, label: str) -> None:
    """The curve after removal and the fit, in the next colour, beside those that are there."""
    curve = getattr(analysis, "curve_of_answer", None) or analysis.curve
    unit = frame.rate_unit(analysis)
    _frame(axes, "Allan deviation", f" ({unit.symbol})")
    _limits(axes, curve.tau, *(one / unit.size for one in (curve.deviation, curve.low)))
    color = _points(axes, curve, unit.size, label=label)
    if (fit := fit_of(analysis)) is not None:
        tau, total = fit.sum_over(*axes.get_xlim())
        frame.model(axes, tau, total, color=color, linewidth=1.0)


def _draw_curves(axes: Axes, analysis: Analysis, label: str) -> None:
    """The curves before and after removal, with the fit."""
    after, state = analysis.curve, frame.after_removal(analysis)
    unit = frame.rate_unit(analysis)
    # An analysis that was read again holds the curve after removal alone.
    before = getattr(analysis, "curve_before", None) if frame.removed(analysis) else None
    if (without := getattr(analysis, "curve_of_answer", None)) is not None:
        before, after, state = after, without, frame.STATES[0]
    _frame(axes, f"{_OF_CHANNEL}{frame.channel_of(analysis)}", f" ({unit.symbol})")
    shown = (after.deviation, after.low, *([] if before is None else [before.deviation]))
    _limits(axes, after.tau, *(one / unit.size for one in shown))
    if before is not None:
        axes.plot(
            before.tau, before.deviation / unit.size, color=frame.QUIET, marker="s",
            markersize=2.8, linewidth=0.9, label="before removal",
        )  # fmt: skip
    _points(axes, after, unit.size, label=label or state)
    _fitted(axes, analysis)


def _frame(axes: Axes, name: str, unit: str) -> None:
    """Axes of deviations, which have to be in the unit of those that are there already."""
    for other in (*_UNITS, *_OF_VALUES.values()):
        if other != unit and axes.get_ylabel().endswith(other):
            stated, held = (one.strip(" ()") for one in (unit, other))
            raise refusal("result", f"is in {stated} and axes are in {held}; give it other axes")
    frame.logarithmic(axes, "cluster time τ (s)", f"{name}{unit}")


def _points(axes: Axes, curve: StabilityCurve, unit: float, *, label: str) -> str:
    """The points of a curve and its interval, in `unit`; gives their color."""
    color, marker = frame.next_style(axes)
    deviation, low, high = (one / unit for one in (curve.deviation, curve.low, curve.high))
    axes.plot(curve.tau, deviation, color=color, marker=marker, linestyle="none", label=label)
    interval = f"its {per_cent(curve.confidence)} interval"
    frame.band(axes, curve.tau, low, high, color, label=interval)
    return color


def _limits(axes: Axes, tau: FloatArray, *deviations: FloatArray) -> None:
    """Room for data that are drawn next, and for those that are there already."""
    there = axes.dataLim
    across = np.concatenate([tau, [there.minposx, there.x1]])
    up = np.concatenate([*deviations, [there.minposy, there.y1]])
    across, up = (one[np.isfinite(one) & (one > 0.0)] for one in (across, up))
    if across.size:
        axes.set_xlim(0.75 * across.min(), 1.35 * across.max())
    if up.size:
        axes.set_ylim(0.6 * up.min(), 1.7 * up.max())


class _Drawn(NamedTuple):
    """Terms of the answer that are drawn, in the unit of rates, and from which time on, s."""

    name: str
    values: Mapping[CoefficientName, float]
    shortest: float

    def sum_over(self, left: float, right: float) -> tuple[FloatArray, FloatArray]:
        """Cluster times between two, s, and the deviation of all terms there."""
        tau = np.geomspace(max(left, self.shortest), right, 200)
        return tau, np.sqrt(allan_variance(tau, self.values))


def fit_of(analysis: Analysis) -> _Drawn | None:
    """Basis of the answer; None if it estimated no term."""
    fit, average = headline_fit(analysis), analysis.average
    coefficients = headline_coefficients(analysis) if fit is None else fit.coefficients
    there = {name: coefficients[name] for name in COEFFICIENT_NAMES if name in coefficients}
    unit = frame.rate_unit(analysis).size
    values = {name: one.value / unit for name, one in there.items() if one.status == "estimated"}
    name, shortest = _NAMES["average"], 0.0
    if fit is not None:
        name = fit.method
    elif average is not None:
        name = _NAMES[average.member]
        # What the average says holds below the upper edge of its band.
        shortest = 0.5 / average.band_hz[1] if average.terms else 0.0
    return _Drawn(name=name, values=values, shortest=shortest) if values else None


def _fitted(axes: Axes, analysis: Analysis) -> None:
    """Basis of the answer: its sum, and each term it estimated with its slope."""
    fit = fit_of(analysis)
    if fit is None:
        return
    tau, total = fit.sum_over(*axes.get_xlim())
    frame.model(axes, tau, total, color=frame.INK, linewidth=1.2, label=f"fit ({fit.name})")
    low, high = axes.get_ylim()
    for name, value in fit.values.items():
        part = np.sqrt(allan_variance(tau, {name: value}))
        frame.model(axes, tau, part, color=frame.INK, linewidth=0.7, linestyle=frame.DOTTED)
        inside = np.flatnonzero((part > low) & (part < high))
        # No term lies above the sum, so the side below its line is free of data.
        _below(axes, tau[inside], part[inside], f"{SYMBOLS[name]}, slope {_SLOPES[name]}")


def _below(axes: Axes, tau: FloatArray, level: FloatArray, text: str) -> None:
    """Write along and below the middle of a line, if there is room for it."""
    if tau.size == 0:
        return
    points = axes.transData.transform(np.stack([tau, level], axis=1))
    run, rise = points[-1] - points[0]
    # A label takes 75 points.
    if math.hypot(run, rise) < 75.0 * axes.figure.dpi / 72.0:
        return
    middle, slope = tau.size // 2, math.degrees(math.atan2(rise, run))
    axes.annotate(
        text, (tau[middle], level[middle]), xytext=(0, -4.0), textcoords="offset points",
        rotation=slope, rotation_mode="anchor", ha="center", va="top", fontsize=8, color="#4a4a4a",
        path_effects=[withStroke(linewidth=2.2, foreground="white")],
    )  # fmt: skip


# ---- against time and table angle ------------------------------------------------------


def parts(analysis: Analysis, ax: Axes | None = None) -> Axes:
    """N over parts of the recording against time, with the answer and its interval.

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
    axes, answer = frame.axes_of(ax, analysis), analysis.angle_random_walk
    unit = field_unit("angle_random_walk", analysis.sensor)
    if answer.status == "estimated":
        own, name = answer.to(unit.name), "the answer"
        interval = f"its {per_cent(answer.confidence)} interval"
        axes.axhline(own.value, color=frame.INK, linewidth=0.9, linestyle=frame.DASHED, label=name)
        axes.axhspan(own.low, own.high, color=frame.QUIET, alpha=0.25, linewidth=0, label=interval)
    seen = [part for part in analysis.parts if part.shows]
    for number, part in enumerate(seen):
        middle, half = 0.5 * (part.start_s + part.stop_s), 0.5 * (part.stop_s - part.start_s)
        value, low, high = (one / unit.size for one in (part.value, part.low, part.high))
        axes.errorbar(
            [middle], [value], xerr=[half], yerr=[[value - low], [high - value]], color=frame.BLUE,
            marker="o", markersize=3.6, elinewidth=0.9, linestyle="none",
            label="a part" if number == 0 else None,
        )  # fmt: skip
    if not seen:
        axes.text(0.5, 0.5, "no part shows N", transform=axes.transAxes, ha="center")
    axes.set(xlabel="time (s)", ylabel=f"N, {frame.channel_of(analysis)} ({unit.symbol})")
    if axes.get_legend_handles_labels()[0]:
        axes.legend()
    return axes


def residual(analysis: Analysis, ax: Axes | None = None) -> Axes:
    """Mean rate of what removal leaves against time, per gyro, less its mean.

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
    axes, kept, unit = frame.axes_of(ax, analysis), _residual(analysis), frame.rate_unit(analysis)
    # Recordings longer than two hours or so are drawn in hours.
    long = float(kept.time[-1]) > 7_000.0
    axes.plot(kept.time / (3600.0 if long else 1.0), kept.rate / unit.size, color=frame.BLUE)
    axes.set(xlabel=f"time ({'h' if long else 's'})", ylabel=f"left ({unit.symbol})")
    return axes


def residual_by_angle(analysis: Analysis, ax: Axes | None = None) -> Axes:
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
    axes, turn = frame.axes_of(ax, analysis), _by_angle(analysis)
    axes.plot(np.degrees(turn.angle), turn.after / DEGREE_PER_HOUR, color=frame.BLUE)
    axes.set(xlim=(0.0, 360.0), xticks=range(0, 361, 60))
    axes.set(xlabel="table angle (°)", ylabel="left (°/h)")
    return axes


def orders(analysis: Analysis, ax: Axes | None = None) -> Axes:
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
    axes, turn = frame.axes_of(ax, analysis), _by_angle(analysis)
    before = (turn.amplitude_before, frame.QUIET, "s", "before removal")
    after = (turn.amplitude_after, frame.BLUE, "o", "after removal")
    for amplitude, color, marker, label in (before, after):
        axes.plot(
            turn.order, amplitude / DEGREE_PER_HOUR, color=color, marker=marker, markersize=2.2,
            linewidth=0.7, label=label,
        )  # fmt: skip
    axes.set(yscale="log", xlabel="order of the table angle", ylabel="amplitude (°/h)")
    # Room above the points for the legend.
    low, high = axes.get_ylim()
    axes.set_ylim(low, high * (high / low) ** 0.3)
    axes.legend(loc="upper right", ncols=2)
    return axes


def _residual(analysis: Analysis) -> Residual:
    if analysis.residual is None:
        raise ValueError("analysis kept no residual")
    return analysis.residual


def _by_angle(analysis: Analysis) -> ByAngle:
    if (turn := _residual(analysis).by_angle) is None:
        raise refusal("analysis", "has no table that turns")
    return turn
