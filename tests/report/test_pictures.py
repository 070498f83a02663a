"""Pictures on an axis."""

import dataclasses
import math

import numpy as np
import pytest
from benchmarks.gallery import Gyro, low_passed
from matplotlib import pyplot
from matplotlib.figure import Figure

from sagnac import plot
from sagnac.analysis.pipeline import analyze
from sagnac.analysis.settings import Settings
from sagnac.analysis.spectra import ByAngle, Residual
from sagnac.noise.cross_spectra import self_noise
from sagnac.noise.model_average import ModelChoice
from sagnac.noise.slow_laws import SlowLaw
from sagnac.recording.model import Recording
from sagnac.stability.curve import stability_curve
from tests.handmade import N, analysis
from tests.report.examples import CASES

DEGREE_PER_HOUR = math.pi / 180.0 / 3600.0
DEGREE_PER_HOUR_PER_ROOT_HERTZ = DEGREE_PER_HOUR


def drawn(axes):
    return {line.get_label(): line for line in axes.get_lines()}


@pytest.mark.parametrize("draw", [plot.stability, plot.spectrum, plot.lines])
@pytest.mark.parametrize("name", CASES)
def test_a_result_and_an_axis_and_nothing_else(draw, name):
    axes = Figure().add_subplot()
    assert draw(CASES[name], axes) is axes
    assert axes.get_xlabel()
    assert axes.get_ylabel()
    # The page draws the curves and spectra of all.
    if name in ("pair", "no lines", "not observable"):
        axes.figure.draw_without_rendering()


@pytest.mark.parametrize("draw", [plot.stability, plot.spectrum, plot.lines])
def test_without_an_axis_the_current_one_of_pyplot_is_drawn_on(draw):
    with pyplot.rc_context({"backend": "agg"}):
        axes = pyplot.figure().add_subplot()
        try:
            assert draw(analysis()) is axes
        finally:
            pyplot.close()


def test_the_curve_lies_beside_the_headline():
    pair = analysis()
    axes = plot.stability(pair, Figure().add_subplot())
    points = drawn(axes)["after removal"].get_ydata()
    np.testing.assert_allclose(points, pair.curve.deviation / DEGREE_PER_HOUR)
    # Far from the quantization at short times, the curve is N over the root of tau.
    near = np.argmin(np.abs(pair.curve.tau - 30.0))
    level = N / math.sqrt(pair.curve.tau[near]) / DEGREE_PER_HOUR
    assert points[near] == pytest.approx(level, rel=0.15)


def test_a_curve_alone_is_drawn_in_its_own_unit():
    curve = analysis(gyros=("x",)).curve
    axes = plot.stability(curve, Figure().add_subplot())
    np.testing.assert_array_equal(drawn(axes)["oadev"].get_ydata(), curve.deviation)


@pytest.mark.parametrize(
    ("kind", "estimator", "power"),
    [
        ("rate", "oadev", 0),
        ("rate", "tdev", 1),
        ("increment", "hdev", -1),
        ("angle", "oadev", -1),
        ("angle", "tdev", 0),
    ],
)
def test_the_label_of_a_curve_has_its_unit(kind, estimator, power):
    """A curve of rates was called one of the unit of its values per second."""
    steps = np.random.default_rng(2).standard_normal(400)
    # The same gyro on a clock in s, and on one in ms whose values stay: what is per second is a
    # thousandth, what is times a second is a thousand times as much.
    slow, fast = (
        stability_curve(steps, kind=kind, sample_rate=rate, estimator=estimator)
        for rate in (1.0, 1000.0)
    )
    np.testing.assert_allclose(slow.deviation[0] / fast.deviation[0], 1000.0**power)
    words = {-1: " per s", 0: "", 1: " × s"}[power]
    axes = plot.stability(slow, Figure().add_subplot())
    assert axes.get_ylabel() == f"{estimator} (unit of the values{words})"
    # Another in the same unit joins it.
    plot.stability(fast, axes)


def test_several_gyros_on_one_axis_are_told_apart():
    alone = {name: dataclasses.replace(analysis(gyros=("x",)), channel=name) for name in "xyz"}
    unit = dataclasses.replace(alone["x"], gyros=alone)
    together = plot.stability(unit, Figure().add_subplot())
    one_by_one = Figure().add_subplot()
    for one in alone.values():
        plot.stability(one, one_by_one)
    for axes in (together, one_by_one):
        curves = [drawn(axes)[name] for name in alone]
        assert len({line.get_color() for line in curves}) == 3
        for line in curves:
            expected = alone["x"].curve.deviation / DEGREE_PER_HOUR
            np.testing.assert_allclose(line.get_ydata(), expected)
        legend = [text.get_text() for text in axes.get_legend().get_texts()]
        assert [text for text in legend if text in alone] == list(alone)
        assert axes.get_ylabel() == "Allan deviation (°/h)"


def legend_of(axes):
    return [text.get_text() for text in axes.get_legend().get_texts()]


@pytest.mark.parametrize("draw", [plot.stability, plot.spectrum])
def test_units_whose_gyros_have_one_name_are_told_apart_by_a_label(draw):
    """Two analyses of a gyro called x stood in the legend as x and x."""
    axes, one = Figure().add_subplot(), analysis(gyros=("x",))
    for label in ("unit 7", "unit 8"):
        draw(one, axes, label=label)
    assert [text for text in legend_of(axes) if text.startswith("unit")] == ["unit 7", "unit 8"]
    assert not {"x", "after removal", "as recorded"} & set(legend_of(axes))


def test_a_label_stands_for_a_curve_and_before_each_of_several_gyros():
    alone = {name: dataclasses.replace(analysis(gyros=("x",)), channel=name) for name in "xyz"}
    unit = dataclasses.replace(alone["x"], gyros=alone)
    axes = plot.stability(unit, Figure().add_subplot(), label="unit 7")
    assert [text for text in legend_of(axes) if "unit" in text] == [
        "unit 7, x", "unit 7, y", "unit 7, z",
    ]  # fmt: skip
    axes = plot.stability(alone["x"].curve, Figure().add_subplot(), label="unit 7")
    assert legend_of(axes)[0] == "unit 7"
    assert "oadev" not in legend_of(axes)


@pytest.mark.parametrize("draw", [plot.stability, plot.spectrum])
def test_without_a_label_legends_are_as_they_were(draw):
    one = analysis(gyros=("x",))
    assert "after removal" in legend_of(draw(one, Figure().add_subplot()))
    axes = Figure().add_subplot()
    plot.stability(one, plot.stability(one, axes))
    assert legend_of(axes).count("x") == 2


def test_limits_hold_what_is_on_the_axes_already():
    low = analysis(gyros=("x",))
    spectrum = dataclasses.replace(low.spectrum, density=1e-4 * low.spectrum.density)
    axes = Figure().add_subplot()
    axes.plot([2000.0, 90_000.0], [1e4, 1e4])
    plot.stability(low, axes)
    axes.plot([1.0, 2.0], [1e-4, 1e-4])
    plot.stability(low, axes)
    assert axes.get_xlim()[1] > 90_000.0
    assert axes.get_ylim()[0] < 1e-4
    assert axes.get_ylim()[1] > 1e4
    axes = Figure().add_subplot()
    for one in (low, dataclasses.replace(low, spectrum=spectrum, spectrum_before=spectrum)):
        plot.spectrum(one, axes)
    after = [line for line in axes.get_lines() if line.get_label() == "after removal"]
    assert len({line.get_color() for line in after}) == 2
    bottom, top = axes.get_ylim()
    assert all(bottom < line.get_ydata().min() < line.get_ydata().max() < top for line in after)


def test_a_second_curve_has_limits_and_a_color_of_its_own():
    curve = analysis(gyros=("x",)).curve
    low = {name: 1e-3 * getattr(curve, name) for name in ("deviation", "low", "high")}
    axes = Figure().add_subplot()
    for one in (curve, dataclasses.replace(curve, **low)):
        plot.stability(one, axes)
    assert len({line.get_color() for line in axes.get_lines()}) == 2
    bottom, top = axes.get_ylim()
    assert bottom < low["low"].min()
    assert top > curve.deviation.max()


def test_a_curve_in_another_unit_is_refused():
    found = analysis(gyros=("x",))
    for first, second in ((found, found.curve), (found.curve, found)):
        axes = plot.stability(first, Figure().add_subplot())
        with pytest.raises(ValueError, match=r"result is in .*°/h.*; give it other axes"):
            plot.stability(second, axes)


def test_lines_stand_at_their_frequency_and_amplitude():
    axes = plot.lines(analysis(), Figure().add_subplot())
    of_angle, of_time = (container[0] for container in axes.containers)
    # 40 deg/s is one turn in 9 s.
    np.testing.assert_allclose(of_angle.get_xdata(), [1 / 9, 2 / 9, 12 / 9])
    np.testing.assert_allclose(of_angle.get_ydata(), [0.6, 0.32, 0.2])
    np.testing.assert_allclose(of_time.get_xdata(), [50.0003, 0.0137])


def test_orders_of_a_table_at_rest_are_left_out():
    axes = plot.lines(analysis(table_rate=None), Figure().add_subplot())
    assert [container.get_label() for container in axes.containers] == ["line in time"]


def test_lines_of_angle_and_time_are_told_apart_in_grey():
    shapes = {}
    for rate in (None, 0.7):
        axes = plot.lines(analysis(table_rate=rate), Figure().add_subplot())
        handles, names = axes.get_legend_handles_labels()
        shapes[rate] = {
            name: one.lines[0].get_marker() for one, name in zip(handles, names, strict=True)
        }
    assert len(set(shapes[0.7].values())) == 2
    # A scale keeps its shape where the other is not there.
    assert shapes[None] == {"line in time": shapes[0.7]["line in time"]}


def test_the_spectrum_shows_the_band_and_the_model_of_the_answer():
    gyro = low_passed(np.random.default_rng(3), 20_000, 100.0, gyro=Gyro(), corner=0.05)
    recording = Recording.from_arrays(
        x=1e-6 * gyro.increments, kind="increment", unit="rad", sample_rate=100.0
    )
    found = analyze(recording, Settings(method="none"))
    axes = plot.spectrum(found, Figure().add_subplot())
    model = next(line for label, line in drawn(axes).items() if label.startswith("N"))
    place, height = model.get_data()
    assert found.average.band_hz[0] <= place[0] * 1.01
    assert place[-1] <= found.average.band_hz[1] * 1.01
    # sqrt(2) N at the foot of the band, in the unit of the axis, as the heaviest model has it.
    unit = 2.0**0.5 / DEGREE_PER_HOUR_PER_ROOT_HERTZ
    walk = found.angle_random_walk
    assert unit * walk.low <= height[len(height) // 3] <= unit * walk.high
    axes = plot.parts(found, Figure().add_subplot())
    shown = sum(part.shows for part in found.parts)
    assert len(axes.containers) == shown >= 2


def test_a_law_in_place_of_flicker_is_named_at_the_spectrum():
    rate = np.random.default_rng(3).standard_normal(20_000)
    still = analyze(Recording.from_arrays(x=rate, kind="rate", unit="deg/h", sample_rate=50.0))
    choice = still.average
    law = dataclasses.replace(choice.law, slow=SlowLaw(slope=1.4))
    other = dataclasses.replace(still, average=dataclasses.replace(choice, law=law))
    labels = [
        plot.spectrum(one, Figure().add_subplot()).get_legend_handles_labels()[1]
        for one in (still, other)
    ]
    assert "N" in labels[0]
    assert "N (noise of f^-1.4 in place of B)" in labels[1]


def test_the_spectrum_names_the_terms_of_the_law_that_is_drawn():
    rate = np.random.default_rng(3).standard_normal(20_000)
    still = analyze(Recording.from_arrays(x=rate, kind="rate", unit="deg/h", sample_rate=50.0))
    choice = still.average
    assert choice.terms == ("angle_random_walk",)
    # A law of the whole band may hold what the heaviest model lacks.
    walk = choice.law.squares[1]
    law = dataclasses.replace(choice.law, squares=(0.0, walk, 0.0, 1e-4 * walk))
    other = dataclasses.replace(still, average=dataclasses.replace(choice, law=law))
    axes = plot.spectrum(other, Figure().add_subplot())
    assert "N, K" in axes.get_legend_handles_labels()[1]
    assert [line.get_linewidth() for line in axes.get_lines()].count(0.7) == 2


def test_residuals_against_time_and_table_angle():
    time, angle = np.linspace(0.0, 9000.0, 50), np.linspace(0.1, 6.2, 8)
    turn = ByAngle(
        angle=angle,
        before=np.cos(angle),
        after=0.1 * np.cos(angle),
        order=np.arange(1.0, 4.0),
        amplitude_before=np.ones(3),
        amplitude_after=0.1 * np.ones(3),
    )
    made = dataclasses.replace(
        analysis(), residual=Residual(time=time, rate=np.sin(time), by_angle=turn)
    )
    axes = plot.residual(made, Figure().add_subplot())
    assert axes.get_xlabel() == "time (h)"
    assert axes.lines[0].get_xdata()[-1] == pytest.approx(2.5)
    line = plot.residual_by_angle(made, Figure().add_subplot()).lines[0]
    assert line.get_ydata() * DEGREE_PER_HOUR == pytest.approx(turn.after)
    axes = plot.orders(made, Figure().add_subplot())
    assert len(axes.lines) == 2
    # No point lies under the legend.
    axes.figure.draw_without_rendering()
    box = axes.get_legend().get_window_extent()
    points = np.vstack([one.get_xydata() for one in axes.lines])
    shown = axes.transData.transform(points[points[:, 1] > 0.0])
    assert not any(box.contains(*point) for point in shown)
    for draw in (plot.residual, plot.residual_by_angle, plot.orders):
        with pytest.raises(ValueError, match="analysis kept no residual"):
            draw(analysis(), Figure().add_subplot())


def test_each_gyro_alone_is_drawn_with_its_interval_and_what_all_share():
    random = np.random.default_rng(3)
    shared, *alone = random.standard_normal((4, 20_000)) * [[30.0], [1.0], [2.0], [4.0]]
    channels = dict(zip("xyz", np.array(alone) + shared, strict=True))
    still = Recording.from_arrays(**channels, kind="rate", unit="deg/h", sample_rate=10.0)
    axes = plot.self_noise(self_noise(still), Figure().add_subplot())
    levels = {name: np.nanmedian(line.get_ydata()) for name, line in drawn(axes).items()}
    # White samples of s deg/h at 10 Hz: one-sided root density s sqrt(2/10).
    wanted = {"what all share": 30.0, "x": 1.0, "y": 2.0, "z": 4.0}
    assert levels == pytest.approx({k: v * math.sqrt(0.2) for k, v in wanted.items()}, rel=0.1)
    assert len(axes.collections) == 3
    axes.figure.draw_without_rendering()


@pytest.mark.parametrize(
    ("member", "name"),
    [("average", "average"), ("both", "N of the likelihood"), ("whole band", "likelihood")],
)
def test_a_fit_whose_interval_was_widened_is_named_as_what_it_is(member, name):
    found = analysis()
    answer = found.angle_random_walk
    choice = ModelChoice(member=member, terms=("angle_random_walk",), band_hz=(0.001, 0.5))
    wider = dataclasses.replace(
        found,
        angle_random_walk=dataclasses.replace(answer, high=1.01 * answer.high),
        average=choice,
        coefficients=found.fits["likelihood"].coefficients,
    )
    legend = plot.stability(wider, Figure().add_subplot()).get_legend()
    assert f"fit ({name})" in [text.get_text() for text in legend.get_texts()]
