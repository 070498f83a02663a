"""The style of the figures."""

import matplotlib as mpl

from sagnac.report.style import STYLE, legend_above, styled


def test_the_style_ends_with_the_figure_and_the_legend_stands_above():
    size = mpl.rcParams["font.size"]
    with styled(legend_rows=2) as canvas:
        assert mpl.rcParams["font.size"] == STYLE["font.size"]
        canvas.axes.plot([1.0, 2.0], [1.0, 2.0], label="a")
        legend_above(canvas.axes, columns=2)
    assert mpl.rcParams["font.size"] == size
    legend = canvas.axes.get_legend().get_window_extent()
    assert legend.y0 >= canvas.axes.get_window_extent().y1 - 5.0
