"""Rate noise density against frequency, of an analysis and of each gyro alone, and its lines."""

import math
from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise
from typing import Final

import numpy as np
from matplotlib.axes import Axes

from sagnac.analysis.result import Analysis
from sagnac.analysis.spectra import Spectrum
from sagnac.core.units import DEGREE_PER_HOUR_PER_ROOT_HERTZ, SENSED, UNITS
from sagnac.lines.model import Line, Scale
from sagnac.noise import cross_spectra, laws
from sagnac.report import frame

# ---- lines -------------------------------------------------------------------------


LABELLED_LINES: Final = 8
# Colour of the lines on a scale, and what the legend calls them.
SCALES: Final[Mapping[Scale, tuple[str, str]]] = {
    "angle": (frame.ORANGE, "line in table angle"),
    "time": (frame.GREEN, "line in time"),
}


def placed_lines(analysis: Analysis) -> list[tuple[float, Line]]:
    """Each line that has a frequency, with it (Hz); strongest first."""
    turns_per_s = abs(analysis.table_rate or 0.0) / (2.0 * math.pi)
    placed = [(line.hertz(turns_per_s), line) for line in analysis.lines]
    return [(at, line) for at, line in placed if line.scale == "time" or turns_per_s]


def short_position(line: Line) -> str:
    """Where a line stands, for a mark: its order or frequency."""
    return f"{line.frequency:.4g}×" if line.scale == "angle" else f"{line.frequency:.4g} Hz"


def lines(analysis: Analysis, ax: Axes | None = None) -> Axes:
    """Amplitude of each line against its frequency, with one standard deviation.

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
    axes, placed = frame.axes_of(ax, analysis), placed_lines(analysis)
    unit = UNITS[SENSED[analysis.sensor].integral_unit]
    for scale, (color, label) in SCALES.items():
        of_scale = [(at, line) for at, line in placed if line.scale == scale]
        if of_scale:
            figures = [(at, line.amplitude, line.amplitude_error) for at, line in of_scale]
            places, amplitude, error = np.array(figures).T
            axes.errorbar(
                places, amplitude / unit.size, yerr=error / unit.size, linestyle="none",
                marker="o" if scale == "angle" else "^", markersize=3.6, elinewidth=0.7,
                color=color, label=label,
            )  # fmt: skip
    frame.logarithmic(axes, "frequency (Hz)", f"amplitude ({unit.symbol})")
    if not placed:
        return frame.without_data(axes, "no line")
    for at, line in placed[:LABELLED_LINES]:
        axes.annotate(
            short_position(line), (at, line.amplitude / unit.size), xytext=(4.0, 4.0),
            textcoords="offset points", fontsize=7, color=SCALES[line.scale][0],
        )  # fmt: skip
    axes.legend()
    return axes


# ---- density -----------------------------------------------------------------------

_DRAWN_BINS: Final = 2400


def spectrum(analysis: Analysis, ax: Axes | None = None, *, label: str = "") -> Axes:
    """Rate noise density before and after removal, per gyro, its lines marked.

    Parameters
    ----------
    analysis
        What to draw; N is drawn too if it was estimated.
    ax
        Where to draw; without it the current axis of ``pyplot``.
    label
        What the legend calls its spectrum; unless stated what was done to it.

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
    axes, unit = frame.axes_of(ax, analysis), frame.rate_unit(analysis)
    shown = (analysis.spectrum_before, analysis.spectrum)
    before, after = (_drawn_bins(one, unit.size) for one in shown)
    if frame.removed(analysis):
        state = "before removal"
        axes.plot(before.frequency, before.density, color=frame.QUIET, linewidth=0.8, label=state)
    (color, _), label = frame.next_style(axes), label or frame.after_removal(analysis)
    axes.plot(after.frequency, after.density, color=color, linewidth=0.8, alpha=0.7, label=label)
    of = f"{SENSED[analysis.sensor].rate} noise density, {frame.channel_of(analysis)}"
    frame.logarithmic(axes, "frequency (Hz)", f"{of} ({unit.symbol}/√Hz)")
    if not after.frequency.size:
        return frame.without_data(axes, analysis.source)
    axes.margins(x=0.01)
    if analysis.angle_random_walk.status == "estimated":
        level = math.sqrt(2.0) * analysis.angle_random_walk.value / unit.size
        axes.axhline(level, color=frame.INK, linewidth=0.9, linestyle=frame.DASHED, label="√2 N")
    _rested_on(axes, analysis)
    _mark_lines(axes, analysis)
    axes.legend()
    return axes


def self_noise(found: cross_spectra.SelfNoise, ax: Axes | None = None) -> Axes:
    """Noise of each gyro alone with its interval, and what all share (°/h/√Hz).

    Parameters
    ----------
    found
        What to draw; a band in which the noise of a gyro cannot be told is left blank.
    ax
        Where to draw; without it the current axis of ``pyplot``.

    Returns
    -------
    matplotlib.axes.Axes

    Examples
    --------
    >>> import numpy as np
    >>> from matplotlib.figure import Figure
    >>> from sagnac import Recording, plot, self_noise
    >>> noise = np.random.default_rng(1).standard_normal((4, 20_000))
    >>> x, y, z = 30.0 * noise[3] + noise[:3]
    >>> still = Recording.from_arrays(x=x, y=y, z=z, kind="rate", unit="deg/h", sample_rate=10.0)
    >>> axes = plot.self_noise(self_noise(still), ax=Figure().add_subplot())
    >>> axes.get_ylabel()
    'rate noise density of each alone (°/h/√Hz)'
    """
    axes = frame.axes_of(ax, found, cross_spectra.SelfNoise, name="found")
    frequency, unit = found.frequency, DEGREE_PER_HOUR_PER_ROOT_HERTZ
    axes.plot(frequency, np.sqrt(found.motion) / unit, color=frame.QUIET, label="what all share")
    for place, name in enumerate(found.gyros):
        color, marker = frame.next_style(axes)
        ends = (found.density, found.low, found.high)
        density, low, high = (np.sqrt(one[place]) / unit for one in ends)
        axes.plot(frequency, density, color=color, marker=marker, label=frame.literal(name))
        frame.band(axes, frequency, low, high, color, alpha=0.15)
    frame.logarithmic(axes, "frequency (Hz)", "rate noise density of each alone (°/h/√Hz)")
    axes.legend()
    return axes


def _rested_on(axes: Axes, analysis: Analysis) -> None:
    """The band that the answer rests on, and the law of its model and of each term there."""
    choice = analysis.average
    if choice is None or choice.law is None or analysis.angle_random_walk.status != "estimated":
        return
    lowest, highest = axes.get_xlim()
    low, high = max(choice.band_hz[0], lowest), min(choice.band_hz[1], highest)
    if not low < high:
        return
    label = f"band of the {'average' if choice.member == 'both' else 'answer'}"
    axes.axvspan(low, high, color=frame.ORANGE, alpha=0.08, linewidth=0, label=label)
    unit, law = frame.rate_unit(analysis).size, choice.law
    at = np.geomspace(low, min(high, 0.5 / law.interval), 200)
    # Those that the law holds, which need not be the terms of the heaviest model.
    terms = {
        laws.SYMBOLS[name]: alone
        for name, alone in zip(laws.STOCHASTIC_NAMES, np.diag(law.squares), strict=True)
        if alone.any()
    }
    other = law.slow.in_words()
    label = ", ".join(terms) + f" ({other})" * bool(other)
    label += " behind a low-pass" * any(law.falls)
    root = np.sqrt(law.density(at)) / unit
    frame.model(axes, at, root, color=frame.ORANGE, linewidth=1.3, label=label)
    for alone in terms.values() if len(terms) > 1 else ():
        root = np.sqrt(replace(law, squares=tuple(alone)).density(at)) / unit
        frame.model(axes, at, root, color=frame.ORANGE, linewidth=0.7, linestyle=frame.DOTTED)


def _mark_lines(axes: Axes, analysis: Analysis) -> None:
    """A tick above the spectrum for each line, the strongest with their names."""
    placed = placed_lines(analysis)
    if not placed:
        return
    low, high = axes.get_ylim()
    axes.set_ylim(low, high * (high / low) ** 0.28)
    stage = axes.get_xaxis_transform()  # x in Hz, y a share of the height
    for scale, (color, label) in SCALES.items():
        places = [frequency for frequency, line in placed if line.scale == scale]
        if places:
            axes.plot(
                places, np.full(len(places), 0.82), linestyle="none", marker="|", markersize=7,
                markeredgewidth=1.0, color=color, transform=stage, label=label,
            )  # fmt: skip
    taken: list[float] = []
    span = math.log(axes.get_xlim()[1] / axes.get_xlim()[0])
    for frequency, line in placed:
        here = math.log(frequency) / span
        if len(taken) == LABELLED_LINES or any(abs(here - other) < 0.035 for other in taken):
            continue
        taken.append(here)
        axes.text(
            frequency, 0.845, short_position(line), transform=stage, rotation=90, ha="center",
            va="bottom", fontsize=7, color=SCALES[line.scale][0], clip_on=False,
        )  # fmt: skip


def _drawn_bins(measured: Spectrum, unit: float) -> Spectrum:
    """Root density in a unit, lowest and highest of each log-spaced bin: no peak is lost."""
    keep = (measured.frequency > 0.0) & (measured.density > 0.0)
    frequency, level = measured.frequency[keep], np.sqrt(measured.density[keep]) / unit
    if frequency.size <= _DRAWN_BINS:
        return Spectrum(frequency=frequency, density=level)
    edges = np.geomspace(frequency[0], frequency[-1] * (1.0 + 1e-12), _DRAWN_BINS // 2 + 1)
    bounds = pairwise(np.unique(np.searchsorted(frequency, edges)).tolist())
    bins = ((start, level[start:stop]) for start, stop in bounds)
    chosen = [start + at for start, own in bins for at in sorted({own.argmin(), own.argmax()})]
    return Spectrum(frequency=frequency[chosen], density=level[chosen])
