"""The style of the figures."""

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg

from sagnac.report import figures as style
from sagnac.report.figures import STYLE, legend_above, styled


def test_the_style_ends_with_the_figure_and_the_legend_stands_above():
    size = mpl.rcParams["font.size"]
    with styled() as (_figure, axes):
        assert mpl.rcParams["font.size"] == STYLE["font.size"]
        axes.plot([1.0, 2.0], [1.0, 2.0], label="a")
        legend_above(axes, columns=2)
    assert mpl.rcParams["font.size"] == size
    legend = axes.get_legend().get_window_extent()
    assert legend.y0 >= axes.get_window_extent().y1 - 5.0


@pytest.mark.parametrize("entries", [1, 3, 4, 7, 9])
def test_the_room_above_follows_the_rows_of_the_legend(entries):
    with styled() as (figure, axes):
        for number in range(entries):
            axes.plot([1.0, 2.0], [1.0, 2.0], label=f"entry {number}")
        legend_above(axes, columns=3)
    legend = axes.get_legend().get_window_extent()
    assert legend.y0 >= axes.get_window_extent().y1 - 5.0
    assert legend.y1 <= figure.bbox.y1
    assert legend.y1 >= 0.97 * figure.bbox.y1


def test_the_power_of_ten_stands_with_the_unit():
    with styled() as (figure, axes):
        axes.plot([0.0, 900.0], [2.1e-5, 2.6e-5])
        axes.set(xlabel="time (s)", ylabel="N, x (°/√h)")
    figure.draw_without_rendering()
    assert axes.get_ylabel() == "N, x (10⁻⁵ °/√h)"
    assert axes.get_xlabel() == "time (s)"
    assert axes.yaxis.get_offset_text().get_text() == ""
    shown = {label.get_text() for label in axes.get_yticklabels()}
    assert {"2.2", "2.4", "2.6"} <= shown


def test_a_linear_axis_of_ordinary_numbers_names_no_power():
    with styled() as (_figure, axes):
        axes.plot([0.0, 1.0], [100.0, 101.0])
        axes.set_ylabel("rate (°/h)")
    assert axes.get_ylabel() == "rate (°/h)"


def drawn(axes):
    """The picture of the figure of some axes, (height, width, 4)."""
    canvas = FigureCanvasAgg(axes.figure)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba()).copy()


def test_within_a_decade_minor_ticks_keep_their_labels():
    with style.styled() as (_figure, axes):
        axes.loglog([2.0, 5.0], [1.0, 1.0])
    drawn(axes)
    labels = [label.get_text() for label in axes.get_xticklabels(minor=True)]
    assert any(labels)


@pytest.mark.parametrize("layout", ["figure.constrained_layout.use", "figure.autolayout"])
def test_a_layout_of_the_users_own_settings_moves_no_figure(layout):
    def place(settings):
        with mpl.rc_context(settings), styled() as (figure, axes):
            axes.plot([1.0, 2.0], [3.0, 4.0], label="a")
            legend_above(axes, 2)
            FigureCanvasAgg(figure).draw()
        return axes.get_position().bounds

    assert place({layout: True}) == place({})
