"""The still bench with gaps: what is shown of the whole, and what of a stretch."""

import itertools

import numpy as np
import pytest
from matplotlib.figure import Figure

from sagnac import plot
from sagnac.analysis.pipeline import analyze, still_bench
from sagnac.analysis.settings import Settings
from sagnac.core.errors import RecordingError
from sagnac.recording.model import Channel, Recording

SAMPLES, RATE = 3000, 50.0
NONE = Settings(gyros=("x",), method="none", interval=None, estimators=("oadev", "mdev"))


def recording(values, kind="rate"):
    unit = {"rate": "rad/s", "increment": "rad", "angle": "rad"}[kind]
    return Recording(
        gyros=(Channel(name="x", kind=kind, shown_in=unit, values=values),), sample_rate=RATE
    )


def white(missing=()):
    values = np.random.default_rng(4).standard_normal(SAMPLES)
    values[list(missing)] = np.nan
    return values


def bench_of(recording, settings):
    return still_bench(recording, settings)[1]["x"]


def test_curves_are_of_the_whole_less_what_touches_a_gap():
    values = white([700, 701, 2900])
    made = bench_of(recording(values), NONE).analysis
    # Cluster means of ten samples and their successors, all there, straight from the definition.
    cluster = 10
    means = np.array([values[k : k + cluster].mean() for k in range(SAMPLES - cluster + 1)])
    steps = means[cluster:] - means[:-cluster]
    steps = steps[np.isfinite(steps)]
    at = int(np.argmin(np.abs(made.curve.tau - cluster / RATE)))
    assert made.curve.deviation[at] == pytest.approx(np.sqrt(0.5 * np.mean(steps**2)))
    assert made.curve.terms[at] == steps.size
    assert [curve.estimator for curve in made.family] == ["oadev", "mdev"]


def test_coefficients_are_of_the_longest_stretch_and_say_so():
    values = white([700, 701, 2900])
    both = bench_of(recording(values), NONE)
    made, cleaned = both.analysis, both.without_lines
    alone = analyze(recording(values[702:2900]), NONE)
    assert made.angle_random_walk == alone.angle_random_walk
    assert made.fits["weighted"].coefficients == alone.fits["weighted"].coefficients
    assert made.recording.samples == SAMPLES
    assert any("14.04 to 58 s" in str(note) for note in made.notes)
    assert cleaned.settings.method == "fos"
    assert made.density is not None


def test_the_density_with_gaps_is_of_the_rate():
    density = bench_of(recording(white([700, 701, 2900])), NONE).analysis.density
    low = (density.frequency > 1.0) & (density.frequency < RATE / 8.0)
    # White noise of one rad/s has twice its square over the sample rate, at every frequency.
    assert density.density[low].mean() == pytest.approx(2.0 / RATE, rel=0.1)


@pytest.mark.parametrize("kind", ["rate", "increment", "angle"])
def test_an_interval_averages_what_is_there(kind):
    values = white([1005])
    step = 10
    if kind == "angle":
        values = np.cumsum(np.nan_to_num(values))
        values[1000] = np.nan
    settings = Settings(gyros=("x",), method="none", interval=step / RATE)
    made = bench_of(recording(values, kind), settings).analysis
    assert made.curve.samples == SAMPLES // step
    if kind == "angle":
        coarse = values[::step]
    else:
        blocks = values.reshape(-1, step)
        coarse = blocks.mean(axis=1) if kind == "rate" else blocks.sum(axis=1)
    assert np.isnan(coarse).sum() == 1
    x = coarse if kind == "angle" else None
    if x is None:
        steps = np.diff(coarse if kind == "rate" else coarse * RATE / step)
    else:
        steps = np.diff(x, 2) * RATE / step
    steps = steps[np.isfinite(steps)]
    assert made.curve.deviation[0] == pytest.approx(np.sqrt(0.5 * np.mean(steps**2)))


def test_without_gaps_it_is_the_analysis():
    values = white()
    made = bench_of(recording(values), NONE).analysis
    assert made.angle_random_walk == analyze(recording(values), NONE).angle_random_walk
    assert np.array_equal(made.family[0].deviation, made.curve.deviation)


def test_a_record_too_short_for_an_estimator_is_one_line():
    short = Settings(gyros=("x",), method="none", interval=None, estimators=("theoh",))
    with pytest.raises(RecordingError, match=r"theoh: values: 80 .* too few") as caught:
        bench_of(recording(white()[:80]), short)
    assert "\n" not in str(caught.value)


def with_a_line():
    time = np.arange(SAMPLES) / RATE
    return recording(white() + 30.0 * np.sin(2.0 * np.pi * 7.3 * time))


def test_the_seconds_are_of_both_readings_with_lines_out_and_in(monkeypatch):
    ticks = itertools.count()
    # Each look at the clock is a second later, so that a stage takes one at least.
    monkeypatch.setattr("time.perf_counter", lambda: float(next(ticks)))
    made = bench_of(with_a_line(), Settings(gyros=("x",), method="none")).analysis
    assert made.seconds["check"] == made.seconds["difference"] == 2.0


def test_the_curve_is_drawn_with_the_lines_in_and_out():
    made = bench_of(with_a_line(), Settings(gyros=("x",), method="none")).analysis
    axes = plot.stability(made, ax=Figure().add_subplot())
    drawn = {line.get_label(): line.get_ydata() * np.radians(1.0) / 3600.0 for line in axes.lines}
    assert drawn["before removal"] == pytest.approx(made.curve.deviation)
    # White noise of one rad/s in a sample has that Allan deviation at one sample.
    assert drawn["after removal"][0] == pytest.approx(1.0, rel=0.1)
    assert drawn["before removal"][0] > 5.0
