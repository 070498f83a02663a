"""The answer on gyros that five terms do not describe, through the whole analysis."""

import math
import re
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from benchmarks.gallery import (
    Gyro,
    common_pair,
    five_terms,
    low_passed,
    resonant,
    spiked,
    stepping,
    warming,
)
from scipy.signal import butter, lfilter

from sagnac.analysis.json_data import choice_data, covariance_data, parts_data
from sagnac.analysis.pipeline import analyze, still_bench
from sagnac.analysis.settings import Settings
from sagnac.recording.model import Provenance, Recording
from sagnac.report.document import analysis_document

RATE = 50.0
SAMPLES = 40_000
# One unit of N of the gallery, rad/sqrt(s).
UNIT = 1e-6


def recording_of(**gyros):
    increments = {name: UNIT * gyro.increments for name, gyro in gyros.items()}
    return Recording.from_arrays(**increments, kind="increment", unit="rad", sample_rate=RATE)


@cache
def analysis_of(make, **settings):
    gyro = make(np.random.default_rng(2), SAMPLES, RATE, **settings)
    found = analyze(recording_of(x=gyro), Settings(method="none"))
    return found, UNIT * gyro.angle_random_walk


def holds(found, truth):
    walk = found.angle_random_walk
    return walk.status == "estimated" and walk.low <= truth <= walk.high


def texts(found):
    return " | ".join(str(note) for note in found.notes)


def test_five_terms_are_answered_by_the_likelihood_of_the_whole_band():
    gyro = five_terms(np.random.default_rng(2), SAMPLES, RATE, gyro=Gyro())
    found = analyze(recording_of(x=gyro), Settings(method="none", interval=None))
    truth = UNIT * gyro.angle_random_walk
    assert holds(found, truth)
    assert found.average.member == "whole band"
    assert found.angle_random_walk == found.fits["likelihood"].coefficients["angle_random_walk"]
    assert "averages over narrow bands agree" in found.source
    assert "is steady" in texts(found)
    # The interval of the curve has no say in it.
    few = analyze(recording_of(x=gyro), Settings(gyros=("x",), method="none", interval=1.0))
    assert few.average.member == "whole band"
    assert few.angle_random_walk.value == pytest.approx(found.angle_random_walk.value, rel=1e-3)
    assert few.fits["likelihood"].coefficients["angle_random_walk"] == few.angle_random_walk
    assert holds(few, truth)


def test_where_the_levels_do_not_tell_the_interval_is_of_average_and_likelihood():
    # Two of the first forty records of white noise are so; this is one of them.
    noise = np.random.default_rng(36).standard_normal(4000)
    recording = Recording.from_arrays(x=noise, kind="rate", unit="deg/h", sample_rate=1.0)
    found = analyze(recording, Settings(method="none"))
    walk, fitted = found.angle_random_walk, found.fits["likelihood"].coefficients
    assert found.average.member == "both"
    assert walk.value == fitted["angle_random_walk"].value
    # The average lies lower, within 0.8 and 1.03 of this.
    assert walk.low < 0.9 * fitted["angle_random_walk"].low
    assert walk.high > 1.03 * walk.value
    assert walk.low <= np.radians(1.0) / 3600.0 <= walk.high
    assert "averages over narrow bands do not decide" in found.source
    assert "the whole band, and " in found.average.in_words()


@pytest.mark.parametrize("seed", [35, 61])
def test_an_interval_of_more_confidence_holds_one_of_less(seed):
    """The choice between fit and average, and the laws of slow noise, are those of 95 %."""
    draw = np.random.default_rng(seed)
    noise = draw.standard_normal(12_000) + 0.01 * np.cumsum(draw.standard_normal(12_000))
    recording = Recording.from_arrays(x=noise, kind="rate", unit="deg/h", sample_rate=1.0)
    found = [
        analyze(recording, method="none", confidence=confidence) for confidence in (0.8, 0.95, 0.99)
    ]
    low, usual, high = (one.angle_random_walk for one in found)
    assert len({one.average.member for one in found}) == 1
    assert high.low < usual.low < low.low < low.value == usual.value == high.value
    assert low.value < low.high < usual.high < high.high


@pytest.mark.parametrize("corner", [0.04, pytest.param(0.08, marks=pytest.mark.statistics)])
def test_a_low_pass_of_the_sensor_gives_no_false_bound(corner):
    found, truth = analysis_of(low_passed, gyro=Gyro(), corner=corner, order=2)
    assert holds(found, truth)
    assert found.average.member == "average"
    assert "average over bands and terms" in found.source
    assert "the spectrum falls to half at" in texts(found)


@pytest.mark.parametrize("seed", [1, 4, 5])
def test_a_readout_that_rises_behind_a_low_pass_does_not_lower_the_walk(seed):
    """Ten minutes behind 2 Hz at 100 Hz: without a fall beside Q all three read 5 to 15 % low."""
    rng, gyro = np.random.default_rng(seed), Gyro(quantization=1.0)
    made = low_passed(rng, 60_000, 100.0, gyro=gyro, corner=0.02, order=1)
    recording = Recording.from_arrays(
        x=UNIT * made.increments, kind="increment", unit="rad", sample_rate=100.0
    )
    assert holds(analyze(recording, Settings(method="none")), UNIT)


@pytest.mark.parametrize("seed", [0, 1])
def test_two_filters_in_a_row_before_a_readout_are_not_taken_for_one(seed):
    """Behind two of first order at 3.1 Hz: a fall of one order down to the readout halves N."""
    rng = np.random.default_rng([77, seed])
    rate, samples, settle = 500.0, 300_000, 30_000
    noise = math.sqrt(rate) * rng.standard_normal(samples + settle)
    one = butter(1, 3.1, fs=rate)
    filtered = lfilter(*one, lfilter(*one, noise))[settle:]
    readout = np.diff(rng.standard_normal(samples + 1)) * 4.0 / math.sqrt(rate)
    recording = Recording.from_arrays(
        x=UNIT * (filtered / rate + readout), kind="increment", unit="rad", sample_rate=rate
    )
    assert holds(analyze(recording, Settings(method="none")), UNIT)


def test_slow_noise_behind_a_low_pass_is_estimated_by_the_band_below_it():
    walking = Gyro(rate_walk=0.3)
    found, truth = analysis_of(low_passed, gyro=walking, corner=0.04, order=2)
    assert holds(found, truth)
    assert (found.average.member, found.average.slow_terms) == ("average", "low band")
    assert choice_data(found)["slow_terms"] == "low band"
    assert found.average.band_hz[1] < 0.25 * RATE
    slow = found.coefficients["rate_random_walk"]
    assert slow.status == "estimated"
    assert slow.low <= 0.3 * UNIT <= slow.high
    assert "; B and K: likelihood fit of the spectrum" in found.source


def test_noise_that_changes_is_told_and_covered():
    found, truth = analysis_of(stepping, gyro=Gyro(), factor=1.5)
    assert holds(found, truth)
    (note,) = [note for note in found.notes if "random walk changes" in note.text]
    assert note.level == "warning"
    walk = found.angle_random_walk
    assert walk.low < 1.03 * UNIT
    assert walk.high > 1.45 * UNIT
    assert [part.start_s for part in found.parts] == pytest.approx(
        [0.0, 200.0, 400.0, 600.0], abs=0.2
    )


def test_spikes_are_counted_and_left_out():
    found, truth = analysis_of(spiked, gyro=Gyro(), every=20.0, height=20.0)
    assert holds(found, truth)
    assert "spikes were replaced by" in texts(found)


def test_a_warm_up_is_taken_off():
    found, truth = analysis_of(warming, gyro=Gyro(walk=0.1), rate=5.0, time=100.0)
    assert holds(found, truth)
    assert "(warm-up)" in texts(found)
    # It lasts for 460 of 600 s.
    assert "span=" not in texts(found).split("(warm-up)")[1].split("covariates")[0]


def test_a_short_warm_up_can_be_sliced_off_by_seconds_from_the_start_of_the_file():
    def begin_of(found):
        said = texts(found).split("(warm-up)")[1].split("covariates")[0]
        return int(re.search(r"span=\((1\d*),", said)[1])

    found, truth = analysis_of(warming, gyro=Gyro(walk=0.1), rate=20.0, time=30.0)
    assert holds(found, truth)
    file = Provenance(path="x.csv", sha256="", format="csv", span_s=(1000.0, 1800.0))
    later = analyze(replace(found.recording, provenance=file), Settings(method="none"))
    assert begin_of(later) == begin_of(found) + 1000


def test_two_gyros_that_share_noise_still_bench_are_each_what_they_are_alone():
    pair = common_pair(np.random.default_rng(4), SAMPLES, RATE, gyro=Gyro(), share=0.4)
    recording = recording_of(x=pair[0], z=pair[1])
    found = analyze(recording, Settings(gyros=("x", "z"), method="none"))
    assert not found.is_pair
    assert all(holds(one, UNIT) for one in found.gyros.values())
    alone = analyze(recording, Settings(gyros=("z",), method="none"))
    assert found.per_gyro["z"] == alone.angle_random_walk


def test_the_still_bench_answers_with_the_lines_out():
    gyro = five_terms(np.random.default_rng(5), SAMPLES, RATE, gyro=Gyro())
    time = np.arange(SAMPLES) / RATE
    line = 1.0 * np.sin(2.0 * np.pi * 7.3 * time)
    recording = recording_of(x=replace(gyro, increments=gyro.increments + line))
    bench = still_bench(recording, Settings(gyros=("x",), method="none"))[1]["x"]
    assert [round(line.frequency, 3) for line in bench.analysis.lines] == [7.3]
    assert holds(bench.analysis, UNIT)
    assert bench.analysis.angle_random_walk == bench.without_lines.angle_random_walk
    assert "lines removed" in bench.analysis.source
    assert bench.as_it_is.lines == ()
    assert bench.analysis.curve is bench.as_it_is.curve


def test_resonances_are_no_angle_random_walk():
    gyro = resonant(
        np.random.default_rng(6), SAMPLES, RATE, gyro=Gyro(), frequencies=(9.2, 18.9), peak=1e4
    )
    bench = still_bench(recording_of(x=gyro), Settings(gyros=("x",), method="none"))[1]["x"]
    assert holds(bench.analysis, UNIT)


def test_what_the_answer_rests_on_as_plain_data():
    found, _ = analysis_of(low_passed, gyro=Gyro(), corner=0.1, order=2)
    choice = choice_data(found)
    assert choice["band_hz"][0] < choice["band_hz"][1] <= 0.5 * RATE
    assert "angle_random_walk" in choice["terms"]
    document = analysis_document(found)
    assert document["angle_random_walk"]["band_hz"] == choice["band_hz"]
    assert document["angle_random_walk"]["terms"] == choice["terms"]
    assert document["parts"] == parts_data(found)
    assert set(document["parts"][0]) == {"start_s", "stop_s", "value", "low", "high"}
    walk = document["angle_random_walk"]
    assert document["parts"][0]["value"] == pytest.approx(walk["value"], rel=0.3)
    assert document["coefficients"]["angle_random_walk"]["value"] == walk["value"]
    covariance = covariance_data(found)
    assert document["covariance"] == covariance
    index = covariance["names"].index("angle_random_walk")
    deviation = covariance["matrix"][index][index] ** 0.5
    assert deviation == pytest.approx(0.25 * (walk["high"] - walk["low"]), rel=0.3)


@pytest.mark.parametrize(("seed", "member"), [(1, "average"), (6, "both"), (12, "whole band")])
def test_a_fit_of_fewer_angles_stands_only_where_it_tells_more(seed, member):
    """A low-pass at a fifth of the rate: five terms describe angles at 5 Hz, but not every sample.

    The levels of the fewer angles bear all three fits out, or neither that nor reject them.
    """
    gyro = low_passed(np.random.default_rng(seed), 20_000, RATE, gyro=Gyro(), corner=0.2, order=2)
    found = analyze(recording_of(x=gyro), Settings(method="none", interval=2.0))
    walk, fitted = found.angle_random_walk, found.fits["likelihood"].coefficients
    fit = fitted["angle_random_walk"]
    assert found.average.member == member
    assert ("of 2000 angles of x at 0.2 s" in found.source) is (member != "average")
    # The relative width of the answer is that of every sample unless the fit is narrower.
    if member == "average":
        assert walk.high / walk.low < fit.high / fit.low
    elif member == "both":
        assert walk.value == fit.value
        # The average of these lies lower: the mixture reaches further down, and not so far up.
        assert (walk.low < fit.low, fit.value < walk.high < fit.high) == (True, True)
    else:
        assert walk == fit


def test_slow_noise_that_falls_to_n_is_no_low_pass_and_loosens_no_bound():
    """White noise of 1.5 deg/sqrt(h) below a Markov rate of 40 s; Q was bounded at 10 degrees."""
    white, driven = np.random.default_rng(3).standard_normal((2, 30_000))
    decay = np.exp(-1.0 / 200.0)
    slow = 4.0 * lfilter([np.sqrt(1.0 - decay**2)], [1.0, -decay], driven)
    rates = 1.5 / 60.0 * (np.sqrt(5.0) * white + slow)
    recording = Recording.from_arrays(x=rates, kind="rate", unit="deg/s", sample_rate=5.0)
    analysis = analyze(recording)
    walk = analysis.angle_random_walk.to("deg/sqrt(h)")
    assert walk.low < 1.5 < walk.high
    assert "the spectrum falls" not in texts(analysis)
    assert analysis.coefficients["quantization"].to("arcsec").high < 50.0
