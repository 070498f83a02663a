"""Figure 1 of the paper, drawn anew: the table, its encoder, the triad and the frames."""

from collections.abc import Iterable
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from sagnac.arrays import FloatArray
from sagnac.plot.frame import BLUE, GREEN, INK, ORANGE, QUIET
from sagnac.report.style import styled
from sagnac.table.frames import shares_from_deviations, table_to_gyro_matrix
from sagnac.units import DEGREE

# The eye stands to the south-east, above the table.
_AZIMUTH: Final = -62.0 * DEGREE
_HEIGHT: Final = 24.0 * DEGREE
_TURNED: Final = 38.0 * DEGREE  # of the table since the null indicator
_HEADING: Final = 25.0 * DEGREE  # of the null indicator from north
_LENGTH: Final = 1.15
_RADIUS: Final = 1.0


def frames_figure(share_deviation: ArrayLike = (0.0, 0.0, 0.0)) -> Figure:
    """Local level (n), null (b0), table (b) and gyro (s) frames, true to Eq. 1.

    Parameters
    ----------
    share_deviation
        (3,) of e_x, e_y and e_z from 1/sqrt(3), Eq. 2.
    """
    shares = shares_from_deviations(share_deviation)
    level = np.eye(3)  # rows: north, east, down
    null, table = _turned(_HEADING), _turned(_HEADING + _TURNED)
    gyros = table_to_gyro_matrix(*shares) @ table
    with styled() as canvas:
        axes = canvas.axes
        axes.set_aspect("equal")
        axes.set_axis_off()
        _draw_table(axes, null, table)
        for rows, color, style, names in (
            (level, QUIET, "-", ("$x_n$ north", "$y_n$ east", "")),
            (null[:2], ORANGE, "--", ("$x_{b0}$, null", "$y_{b0}$")),
            (table, INK, "-", ("$x_b$", "$y_b$", "$z_b$, $z_n$ down, shaft")),
            (gyros, BLUE, "-", ("$x_s$", "$y_s$", "$z_s$")),
        ):
            _draw_axes(axes, rows, color, style, names)
        _draw_angle(axes)
        axes.set(xlim=(-1.4, 1.55), ylim=(-1.3, 0.6))
    return canvas.figure


def _turned(angle: float) -> FloatArray:
    """(3, 3) rows: the axes of a frame turned about down from north towards east."""
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.array([[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]])


def seen(points: ArrayLike) -> FloatArray:
    """(points, 2) where points in north, east and down stand on the page, without perspective."""
    north, east, down = np.atleast_2d(np.asarray(points, dtype=np.float64)).T
    across = east * np.cos(_AZIMUTH) - north * np.sin(_AZIMUTH)
    away = east * np.sin(_AZIMUTH) + north * np.cos(_AZIMUTH)
    return np.stack([across, away * np.sin(_HEIGHT) - down * np.cos(_HEIGHT)], axis=1)


def _draw_axes(axes: Axes, rows: FloatArray, color: str, style: str, names: Iterable[str]) -> None:
    for row, name in zip(rows, names, strict=True):
        ((across, up),) = seen(_LENGTH * row)
        axes.annotate(
            "",
            (across, up),
            (0.0, 0.0),
            arrowprops={"arrowstyle": "-|>", "color": color, "linestyle": style, "linewidth": 1.1},
        )
        axes.annotate(
            name,
            (1.09 * across, 1.09 * up),
            color=color,
            ha="left" if across > 0.9 else "center",
            va="center",
        )


def _draw_table(axes: Axes, null: FloatArray, table: FloatArray) -> None:
    """The turntable, the divisions of its encoder, and the null indicator."""
    around = np.linspace(0.0, 2.0 * np.pi, 361)
    for radius in (_RADIUS, 0.92 * _RADIUS):
        circle = radius * np.stack([np.cos(around), np.sin(around), 0.0 * around], axis=1)
        axes.plot(*seen(circle).T, color=QUIET, linewidth=0.8)
    for angle in np.arange(0.0, 360.0, 5.0) * DEGREE:
        mark = np.array([[np.cos(angle), np.sin(angle), 0.0]]) @ table
        axes.plot(
            *seen(np.concatenate([0.92 * mark, _RADIUS * mark])).T, color=QUIET, linewidth=0.5
        )
    place = seen(_RADIUS * null[:1])[0]
    axes.plot(*place, marker="o", color=ORANGE, markersize=4.5)


def _draw_angle(axes: Axes) -> None:
    """The table angle, from the null indicator to x_b."""
    arc = np.linspace(_HEADING, _HEADING + _TURNED, 40)
    curve = 0.55 * np.stack([np.cos(arc), np.sin(arc), 0.0 * arc], axis=1)
    axes.plot(*seen(curve).T, color=GREEN, linewidth=1.2)
    ((across, up),) = seen(0.63 * curve[curve.shape[0] // 2] / 0.55)
    axes.annotate(r"$\alpha$", (across, up), color=GREEN, ha="center", va="center")
