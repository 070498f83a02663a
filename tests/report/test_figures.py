"""The figures of the reports."""

import dataclasses
import math
from xml.etree import ElementTree

import numpy as np
import pytest

from sagnac.report import figures, quantities
from tests.handmade import analysis
from tests.report.examples import CASES


@pytest.mark.parametrize("made", CASES.values(), ids=CASES.keys())
def test_a_comparison_can_be_drawn(made, tmp_path):
    """The other figures are drawn by the page of each."""
    path = tmp_path / "compared.png"
    figures.write_png(figures.comparison_figure({"fos": made, "none": made}), path)
    assert path.read_bytes().startswith(b"\x89PNG")
    assert list(tmp_path.iterdir()) == [path]
    # The legend has the digits of the table beside it.
    (axes,) = figures.comparison_figure({"fos": made}).axes
    value = quantities.reading_cells(made.angle_random_walk, plain=False)[0]
    (label,) = axes.get_legend_handles_labels()[1]
    assert value.lstrip("–") in label


def test_ten_gyros_are_told_apart_and_none_is_cut_off():
    names = [f"gyro_{number:02}_rate" for number in range(10)]
    (axes,) = figures.curves_figure([analysis(gyros=(one,), table_rate=None) for one in names]).axes
    shown = [one.get_text() for one in axes.get_legend().get_texts()]
    assert shown == names
    assert axes.get_legend().get_window_extent().x1 <= axes.figure.bbox.x1
    assert axes.get_legend().get_window_extent().y1 <= axes.figure.bbox.y1
    assert len({(one.get_color(), one.get_marker()) for one in axes.get_lines()}) == 10


def test_fit_passes_through_the_curve_it_was_made_from():
    made = analysis()
    axes = figures.report_figures(made)["stability"].axes[0]
    drawn = {line.get_label(): line for line in axes.get_lines()}
    fit = drawn["fit (likelihood)"]
    points = drawn["after removal"]
    level = np.interp(np.log(points.get_xdata()), np.log(fit.get_xdata()), np.log(fit.get_ydata()))
    # The first points have thousands of degrees of freedom.
    np.testing.assert_allclose(np.exp(level)[:10], points.get_ydata()[:10], rtol=0.05)


def test_spectrum_lies_at_root_two_n():
    axes = figures.report_figures(analysis())["spectrum"].axes[0]
    drawn = {line.get_label(): line for line in axes.get_lines()}
    level = float(drawn["√2 N"].get_ydata()[0])
    assert level == pytest.approx(math.sqrt(2.0) * 60.0 * 2.5e-5)  # deg/h/sqrt(Hz)
    after = drawn["after removal"]
    high = np.asarray(after.get_xdata()) > 1.0
    assert np.median(np.asarray(after.get_ydata())[high]) == pytest.approx(level, rel=0.02)


def test_a_spectrum_of_many_bins_keeps_its_peaks():
    random = np.random.default_rng(3)
    frequency = np.linspace(1e-3, 250.0, 400_000)
    density = random.gamma(4, 1 / 4, frequency.size)
    density[123_456] = 1e6
    made = analysis()
    made = dataclasses.replace(
        made, spectrum=dataclasses.replace(made.spectrum, frequency=frequency, density=density)
    )
    axes = figures.report_figures(made)["spectrum"].axes[0]
    after = {line.get_label(): line for line in axes.get_lines()}["after removal"]
    assert len(after.get_xdata()) < 5000
    assert np.asarray(after.get_xdata())[np.argmax(after.get_ydata())] == frequency[123_456]


def test_a_description_and_a_name_are_no_marks_of_the_page():
    figure = figures.report_figures(analysis())["stability"]
    hostile = 'x" onload="alert(1)"><script>alert(2)</script>\\1 \\input'
    drawing = figures.svg(figure, 'a"b \\g', hostile)
    root = ElementTree.fromstring(drawing)
    assert root.attrib["aria-label"] == hostile
    assert "onload" not in root.attrib
    assert not [one for one in root.iter() if one.tag.endswith("script")]
    ids = [one.attrib["id"] for one in root.iter() if "id" in one.attrib]
    assert ids
    assert all(one.startswith("a_22b_20_5cg-") for one in ids)
