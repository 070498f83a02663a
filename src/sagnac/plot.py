"""Pictures of a result on an axis of matplotlib: stability, spectrum, lines.

Each function takes a result and an axis, draws, and gives the axis back; without an axis it
draws on the current one of ``pyplot``. Values are in the field's units and per gyro.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING, Final

import numpy as np

from sagnac.analysis.headline_fit import headline_coefficients, headline_fit
from sagnac.analysis.residuals import ByAngle, Residual
from sagnac.analysis.result import Analysis
from sagnac.analysis.spectra import Spectrum
from sagnac.arrays import FloatArray
from sagnac.coefficients.laws import (
    COEFFICIENT_NAMES,
    SYMBOLS,
    CoefficientName,
    allan_variance,
)
from sagnac.lines.model import Line, Scale
from sagnac.recording.difference import per_gyro
from sagnac.stability.curve import StabilityCurve
from sagnac.units import (
    ARCSECOND,
    DEGREE_PER_HOUR,
    DEGREE_PER_HOUR_PER_ROOT_HERTZ,
    DEGREE_PER_ROOT_HOUR,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["lines", "orders", "parts", "residual", "residual_by_angle", "spectrum", "stability"]

INK: Final = "#1a1a1a"
QUIET: Final = "#9a9a9a"
BLUE: Final = "#1f5a96"
ORANGE: Final = "#c4561b"
GREEN: Final = "#2f7d5b"

# How the Allan deviation of each term rises with tau on a log-log plot.
_SLOPES: Final[Mapping[CoefficientName, str]] = {
    "quantization": "−1",
    "angle_random_walk": "−½",
    "bias_instability": "0",
    "rate_random_walk": "+½",
    "rate_ramp": "+1",
}
_ROOM_FOR_LABEL: Final = 75.0  # points
_LABELLED_LINES: Final = 8
_DRAWN_BINS: Final = 2400
# Recordings longer than this are drawn in hours, s.
_LONG_S: Final = 7_000.0


@dataclass(frozen=True, slots=True, kw_only=True)
class _ScaleStyle:
    color: str
    label: str


_SCALES: Final[Mapping[Scale, _ScaleStyle]] = {
    "angle": _ScaleStyle(color=ORANGE, label="line in table angle"),
    "time": _ScaleStyle(color=GREEN, label="line in time"),
}


def stability(result: Analysis | StabilityCurve, ax: "Axes | None" = None) -> "Axes":
    """Deviation against cluster time, with its interval; of an analysis with the fit.

    Parameters
    ----------
    result
        An analysis: Allan deviation before and after removal (°/h), the fit that the answer
        rests on, and each term that it estimated with its slope. Or one curve, in its own unit.
        The curve of a difference of two gyros is drawn per gyro, as the answer is.
    ax
        Where to draw; without it the current axis of ``pyplot``.

    Returns
    -------
    matplotlib.axes.Axes

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
    axes = _axes(ax)
    if isinstance(result, StabilityCurve):
        _draw_curve(axes, result.per_gyro())
    else:
        _draw_curves(axes, result)
    axes.legend()
    return axes


def spectrum(analysis: Analysis, ax: "Axes | None" = None) -> "Axes":
    """Rate noise density before and after removal (°/h/√Hz, per gyro), its lines marked.

    Parameters
    ----------
    analysis
        What to draw; N is drawn too if it was estimated.
    ax
        Where to draw; without it the current axis of ``pyplot``.

    Returns
    -------
    matplotlib.axes.Axes

    Examples
    --------
    A still gyro of white rate noise with a vibration at 2 Hz:

    >>> import numpy as np
    >>> from matplotlib.figure import Figure
    >>> from sagnac import Recording, analyze, plot
    >>> rate = 1e-6 * np.random.default_rng(1).standard_normal(6000)
    >>> rate += 1e-6 * np.cos(2.0 * np.pi * 2.0 * np.arange(6000) / 10.0)
    >>> recording = Recording.from_arrays(x=rate, kind="rate", unit="rad/s", sample_rate=10.0)
    >>> axes = plot.spectrum(analyze(recording), ax=Figure().add_subplot())
    >>> axes.get_ylabel()
    'rate noise density, x (°/h/√Hz)'
    """
    axes = _axes(ax)
    before, after = (
        _drawn_bins(one, analysis.gyros_differenced)
        for one in (analysis.spectrum_before, analysis.spectrum)
    )
    if removed(analysis):
        axes.plot(
            before.frequency, before.density, color=QUIET, linewidth=0.8, label="before removal"
        )
    axes.plot(
        after.frequency,
        after.density,
        color=BLUE,
        linewidth=0.8,
        alpha=0.7,
        label=_after(analysis),
    )
    logarithmic(axes, "frequency (Hz)", f"rate noise density, {channel_of(analysis)} (°/h/√Hz)")
    if not after.frequency.size:
        # Logarithmic axes find no limits of their own without data.
        axes.set(xlim=(0.1, 10.0), ylim=(0.1, 10.0))
        axes.text(0.5, 0.5, analysis.source, transform=axes.transAxes, ha="center")
        return axes
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
    _rested_on(axes, analysis)
    _mark_lines(axes, analysis)
    axes.legend()
    return axes


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
    axes = _axes(ax)
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


def lines(analysis: Analysis, ax: "Axes | None" = None) -> "Axes":
    """Amplitude of each line (″) against its frequency, with one standard deviation.

    A line in table angle stands at its order times the mean table rate; orders of a table at
    rest have no frequency and are left out.

    Parameters
    ----------
    analysis
        What to draw. Amplitudes are of the channel that each line names, not per gyro.
    ax
        Where to draw; without it the current axis of ``pyplot``.

    Returns
    -------
    matplotlib.axes.Axes

    Examples
    --------
    A still gyro of white rate noise with a vibration at 2 Hz:

    >>> import numpy as np
    >>> from matplotlib.figure import Figure
    >>> from sagnac import Recording, analyze, plot
    >>> rate = 1e-6 * np.random.default_rng(1).standard_normal(6000)
    >>> rate += 1e-6 * np.cos(2.0 * np.pi * 2.0 * np.arange(6000) / 10.0)
    >>> recording = Recording.from_arrays(x=rate, kind="rate", unit="rad/s", sample_rate=10.0)
    >>> axes = plot.lines(analyze(recording), ax=Figure().add_subplot())
    >>> axes.get_ylabel()
    'amplitude (″)'
    """
    axes = _axes(ax)
    placed = _placed(analysis)
    for scale in _SCALES:
        _draw_amplitudes(axes, scale, [(at, line) for at, line in placed if line.scale == scale])
    logarithmic(axes, "frequency (Hz)", "amplitude (″)")
    if not placed:
        axes.set(xlim=(0.1, 10.0), ylim=(0.1, 10.0))
        axes.text(0.5, 0.5, "no line", transform=axes.transAxes, ha="center")
        return axes
    for at, line in placed[:_LABELLED_LINES]:
        axes.annotate(
            _short_position(line),
            (at, line.amplitude / ARCSECOND),
            xytext=(4.0, 4.0),
            textcoords="offset points",
            fontsize=7,
            color=_SCALES[line.scale].color,
        )
    axes.legend()
    return axes


def logarithmic(axes: "Axes", across: str, up: str) -> None:
    """Both scales logarithmic, and what they are of."""
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlabel(across)
    axes.set_ylabel(up)


def channel_of(analysis: Analysis) -> str:
    """What is drawn, for a label: ``x − z per gyro``."""
    readable = analysis.channel.replace("-", " − ")
    return f"{readable} per gyro" if analysis.gyros_differenced > 1 else readable


def removed(analysis: Analysis) -> bool:
    """Whether the periodic parts were removed."""
    return analysis.settings.method != "none"


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
    """
    axes, kept = _axes(ax), _residual(analysis)
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
    """
    axes, turn = _axes(ax), _by_angle(analysis)
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
    """
    axes, turn = _axes(ax), _by_angle(analysis)
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


def _axes(given: "Axes | None") -> "Axes":
    if given is not None:
        return given
    from matplotlib import pyplot  # noqa: PLC0415  (half a second that a stability curve need not wait for)

    return pyplot.gca()


def _draw_curve(axes: "Axes", curve: StabilityCurve) -> None:
    """One curve, in the unit of the values that it was made of."""
    unit = "unit of the values" if curve.estimator == "tdev" else "unit of the values per s"
    _points(axes, curve, 1.0, label=curve.estimator)
    logarithmic(axes, "cluster time τ (s)", f"{curve.estimator} ({unit})")
    _limits(axes, curve.tau, curve.deviation, curve.low)


def _draw_curves(axes: "Axes", analysis: Analysis) -> None:
    """The curves before and after removal, in °/h, with the fit."""
    before, after = analysis.curve_before.per_gyro(), analysis.curve.per_gyro()
    if removed(analysis):
        axes.plot(
            before.tau,
            before.deviation / DEGREE_PER_HOUR,
            color=QUIET,
            marker="s",
            markersize=2.8,
            linewidth=0.9,
            label="before removal",
        )
    _points(axes, after, DEGREE_PER_HOUR, label=_after(analysis))
    logarithmic(axes, "cluster time τ (s)", f"Allan deviation, {channel_of(analysis)} (°/h)")
    _limits(
        axes,
        after.tau,
        *(array / DEGREE_PER_HOUR for array in (before.deviation, after.deviation, after.low)),
    )
    _fitted(axes, analysis)


def _after(analysis: Analysis) -> str:
    return "after removal" if removed(analysis) else "as recorded"


def _points(axes: "Axes", curve: StabilityCurve, unit: float, *, label: str) -> None:
    """The points of a curve and its interval, in `unit`."""
    axes.plot(
        curve.tau, curve.deviation / unit, color=BLUE, marker="o", linestyle="none", label=label
    )
    axes.fill_between(
        curve.tau,
        curve.low / unit,
        curve.high / unit,
        color=BLUE,
        alpha=0.2,
        linewidth=0,
        label=f"its {100 * curve.confidence:g} % interval",
    )


def _limits(axes: "Axes", tau: FloatArray, *deviations: FloatArray) -> None:
    """Room for the data, not for what a fit says far below it."""
    values = np.concatenate(deviations)
    values = values[np.isfinite(values) & (values > 0.0)]
    if tau.size:
        axes.set_xlim(0.75 * tau.min(), 1.35 * tau.max())
    if values.size:
        axes.set_ylim(0.6 * values.min(), 1.7 * values.max())


def _rested_on(axes: "Axes", analysis: Analysis) -> None:
    """The band that the answer rests on, and the law of its model and of each term there."""
    resting = analysis.average
    if resting is None or resting.law is None or analysis.angle_random_walk.status != "estimated":
        return
    lowest, highest = axes.get_xlim()
    low, high = max(resting.band_hz[0], lowest), min(resting.band_hz[1], highest)
    if not low < high:
        return
    axes.axvspan(low, high, color=ORANGE, alpha=0.08, linewidth=0, label="band of the answer")
    frequency = np.geomspace(low, min(high, 0.5 / resting.law.interval), 200)
    bottom, top = axes.get_ylim()
    root = np.sqrt(resting.law.density(frequency)) / DEGREE_PER_HOUR_PER_ROOT_HERTZ
    letters = ", ".join(SYMBOLS[name] for name in resting.terms)
    behind = " behind a low-pass" if resting.law.order else ""
    axes.plot(frequency, root, color=ORANGE, linewidth=1.3, label=f"{letters}{behind}")
    for place, square in enumerate(resting.law.squares):
        if square > 0.0 and len(resting.terms) > 1:
            alone = tuple(
                square if one == place else 0.0 for one in range(len(resting.law.squares))
            )
            term = np.sqrt(replace(resting.law, squares=alone).density(frequency))
            axes.plot(
                frequency,
                term / DEGREE_PER_HOUR_PER_ROOT_HERTZ,
                color=ORANGE,
                linewidth=0.7,
                linestyle=(0, (2, 3)),
            )
    # A term may lie far below the data within its band.
    axes.set_ylim(bottom, top)


def _fitted(axes: "Axes", analysis: Analysis) -> None:
    """What the answer rests on: its sum, and each term it estimated with its slope."""
    fit = headline_fit(analysis)
    shortest = 0.0
    if fit is None and analysis.average is not None and analysis.average.terms:
        # What the average says holds below the upper edge of its band.
        shortest = 0.5 / analysis.average.band_hz[1]
    coefficients = headline_coefficients(analysis) if fit is None else fit.coefficients
    values = {
        name: coefficients[name].value
        for name in COEFFICIENT_NAMES
        if name in coefficients and coefficients[name].status == "estimated"
    }
    if not values:
        return
    left, right = axes.get_xlim()
    tau = np.geomspace(max(left, shortest), right, 200)
    total = np.sqrt(allan_variance(tau, values)) / DEGREE_PER_HOUR
    name_of_fit = "average" if fit is None else fit.method
    axes.plot(tau, total, color=INK, linewidth=1.2, label=f"fit ({name_of_fit})")
    low, high = axes.get_ylim()
    for name, value in values.items():
        part = np.sqrt(allan_variance(tau, {name: value})) / DEGREE_PER_HOUR
        axes.plot(tau, part, color=INK, linewidth=0.7, linestyle=(0, (2, 3)))
        inside = np.flatnonzero((part > low) & (part < high))
        # No term lies above the sum, so the side below its line is free of data.
        _below(axes, tau[inside], part[inside], f"{SYMBOLS[name]}, slope {_SLOPES[name]}")


def _below(axes: "Axes", tau: FloatArray, level: FloatArray, text: str) -> None:
    """Write along and below the middle of a line, if there is room for it."""
    from matplotlib.patheffects import withStroke  # noqa: PLC0415

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


def _mark_lines(axes: "Axes", analysis: Analysis) -> None:
    """A tick above the spectrum for each line, the strongest with their names."""
    placed = _placed(analysis)
    if not placed:
        return
    low, high = axes.get_ylim()
    axes.set_ylim(low, high * (high / low) ** 0.28)
    stage = axes.get_xaxis_transform()  # x in Hz, y a share of the height
    for scale, style in _SCALES.items():
        places = [frequency for frequency, line in placed if line.scale == scale]
        if places:
            axes.plot(
                places,
                np.full(len(places), 0.82),
                linestyle="none",
                marker="|",
                markersize=7,
                markeredgewidth=1.0,
                color=style.color,
                transform=stage,
                label=style.label,
            )
    taken: list[float] = []
    span = math.log(axes.get_xlim()[1] / axes.get_xlim()[0])
    for frequency, line in placed:
        here = math.log(frequency) / span
        if len(taken) == _LABELLED_LINES or any(abs(here - other) < 0.035 for other in taken):
            continue
        taken.append(here)
        axes.text(
            frequency,
            0.845,
            _short_position(line),
            transform=stage,
            rotation=90,
            ha="center",
            va="bottom",
            fontsize=7,
            color=_SCALES[line.scale].color,
            clip_on=False,
        )


def _draw_amplitudes(axes: "Axes", scale: Scale, placed: list[tuple[float, Line]]) -> None:
    if not placed:
        return
    amplitude, error = (
        np.array([getattr(line, name) for _, line in placed]) / ARCSECOND
        for name in ("amplitude", "amplitude_error")
    )
    axes.errorbar(
        np.array([at for at, _ in placed]),
        amplitude,
        yerr=error,
        linestyle="none",
        marker="o",
        markersize=3.6,
        elinewidth=0.7,
        color=_SCALES[scale].color,
        label=_SCALES[scale].label,
    )


def _short_position(line: Line) -> str:
    return f"{line.frequency:.4g}×" if line.scale == "angle" else f"{line.frequency:.4g} Hz"


def _placed(analysis: Analysis) -> list[tuple[float, Line]]:
    """Each line that has a frequency, with it (Hz); strongest first."""
    turns_per_s = abs(analysis.table_rate or 0.0) / (2.0 * math.pi)
    placed = []
    for line in analysis.lines:
        if line.scale == "time":
            placed.append((line.frequency, line))
        elif turns_per_s:
            placed.append((line.frequency * turns_per_s, line))
    return placed


def _drawn_bins(measured: Spectrum, gyros_differenced: int) -> Spectrum:
    """Root density of one gyro, lowest and highest of each log-spaced bin: no peak is lost."""
    size = per_gyro(1.0, gyros_differenced) / DEGREE_PER_HOUR_PER_ROOT_HERTZ
    keep = (measured.frequency > 0.0) & (measured.density > 0.0)
    frequency, level = measured.frequency[keep], size * np.sqrt(measured.density[keep])
    if frequency.size <= _DRAWN_BINS:
        return Spectrum(frequency=frequency, density=level)
    edges = np.geomspace(frequency[0], frequency[-1] * (1.0 + 1e-12), _DRAWN_BINS // 2 + 1)
    starts = np.unique(np.searchsorted(frequency, edges)).tolist()
    chosen: list[int] = []
    for start, stop in pairwise(starts):
        part = level[start:stop]
        chosen.extend(sorted({start + int(part.argmin()), start + int(part.argmax())}))
    return Spectrum(frequency=frequency[chosen], density=level[chosen])
