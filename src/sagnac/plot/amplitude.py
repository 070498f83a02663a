"""Amplitude of each line against its frequency."""

from typing import TYPE_CHECKING

import numpy as np

from sagnac.analysis.result import Analysis
from sagnac.lines.model import Line, Scale
from sagnac.plot.frame import axes_of, logarithmic
from sagnac.plot.marks import LABELLED_LINES, SCALES, placed_lines, short_position
from sagnac.units import (
    ARCSECOND,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes


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
    axes = axes_of(ax)
    placed = placed_lines(analysis)
    for scale in SCALES:
        _draw_amplitudes(axes, scale, [(at, line) for at, line in placed if line.scale == scale])
    logarithmic(axes, "frequency (Hz)", "amplitude (″)")
    if not placed:
        axes.set(xlim=(0.1, 10.0), ylim=(0.1, 10.0))
        axes.text(0.5, 0.5, "no line", transform=axes.transAxes, ha="center")
        return axes
    for at, line in placed[:LABELLED_LINES]:
        axes.annotate(
            short_position(line),
            (at, line.amplitude / ARCSECOND),
            xytext=(4.0, 4.0),
            textcoords="offset points",
            fontsize=7,
            color=SCALES[line.scale].color,
        )
    axes.legend()
    return axes


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
        color=SCALES[scale].color,
        label=SCALES[scale].label,
    )
