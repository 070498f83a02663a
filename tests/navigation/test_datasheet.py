"""Numbers that a data sheet states, as a filter takes them."""

import json
import math

import numpy as np
import pytest
import yaml

from sagnac.navigation.export import datasheet_setting, export
from sagnac.noise.laws import markov_allan_variance
from tests.navigation.examples import document, written

DEGREE = math.pi / 180.0
FORCE = datasheet_setting("N=80ug/sqrt(Hz),B=0.01mg@100s,range=8g")


@pytest.mark.parametrize(
    "white", ["0.15deg/sqrt(h)", "0.0025deg/s/sqrt(Hz)", "9deg/h/sqrt(Hz)", "0.15°/√h"]
)
def test_units_of_n_are_one_number(white):
    stated = datasheet_setting(f"N={white},B=3deg/h@100s")
    # 0.15 deg in an hour, as its square root.
    assert stated.simple.white == pytest.approx(0.15 * DEGREE / 60.0)
    assert (stated.kind, stated.limit) == ("gyro", None)


def test_both_models_have_the_lowest_allan_deviation_at_its_time():
    lowest, tau = 3.0 * DEGREE / 3600.0, np.array([100.0])
    stated = datasheet_setting("N=1e-6deg/sqrt(h),B=3deg/h@100s")
    assert stated.simple.allan_deviation(tau) == pytest.approx([lowest], rel=1e-4)
    (rate,) = stated.full.markov
    tried = np.geomspace(1.0, 1e4, 4001)
    variance = markov_allan_variance(tried, rate.driving_noise, rate.correlation_time)
    assert tried[np.argmax(variance)] == pytest.approx(100.0, rel=0.01)
    assert math.sqrt(variance.max()) == pytest.approx(lowest, rel=1e-3)


def test_every_number_is_marked_as_stated_and_is_not_inflated():
    gyro = datasheet_setting("N=0.15deg/sqrt(h),B=3deg/h@100s,bandwidth=40Hz,range=450deg/s")
    wanted = {"settings": (gyro,), "accelerometers": (FORCE,), "rate": 200.0}
    text = written("kalibr", **wanted)
    read = yaml.safe_load(text)
    assert read["gyroscope_noise_density"] == pytest.approx(0.15 * DEGREE / 60.0, rel=1e-6)
    assert read["accelerometer_noise_density"] == pytest.approx(80e-6 * 9.80665, rel=1e-6)
    assert text.count("; stated, not measured") == 4
    assert "bandwidth 40Hz, range 450deg/s" in text
    assert "lies above the Allan deviation" not in text
    plain = json.loads(written("json", **wanted))
    assert plain["sensors"]["gyro"]["measured"] is False
    assert plain["sensors"]["gyro"]["stated"] == {"bandwidth": "40Hz", "range": "450deg/s"}
    noise = yaml.safe_load(written("kf-gins", **wanted))["imunoise"]
    assert noise["arw"] == pytest.approx([0.15] * 3, rel=1e-6)
    # A Markov bias of stationary deviation s and time T has its highest Allan deviation, 0.617 s.
    assert noise["gbstd"] == pytest.approx([3.0 / 0.6173] * 3, rel=2e-3)
    with pytest.raises(ValueError, match="states the sample rate"):
        written("json", settings=(gyro,))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("N=0.15deg/sqrt(h)", "N and B are needed"),
        ("N=0.15deg/sqrt(h),B=3deg/h", "no cluster time"),
        ("N=0.15,B=3deg/h@100s", "is no number with one of deg/sqrt"),
        ("N=0.15deg/sqrt(h),B=3deg/h@0s", "0s' is no number above zero"),
        ("N=0.15deg/sqrt(h),B=3deg/h@9parsec", "is no number with one of s, ms"),
        ("N=-1deg/sqrt(h),B=3deg/h@100s", "is no number with one of deg/sqrt"),
        ("N=0.15deg/sqrt(h),B=3mg@100s", "one sensor at a time"),
        ("N=0.15deg/sqrt(h),N=1deg/sqrt(h),B=3deg/h@9s", "N stands there twice"),
        ("noise=1deg/sqrt(h)", "is none of N, B, bandwidth, range"),
        ("N=0.15deg/sqrt(h),B=3deg/h@1s,bandwidth=40deg", "one of Hz, kHz"),
        ("", "is none of"),
    ],
)
def test_what_is_missing_or_wrong_is_named(text, said):
    with pytest.raises(ValueError, match=said):
        datasheet_setting(text)


def test_a_random_walk_far_above_the_lowest_deviation_is_a_wrong_unit():
    # 9 deg/h/sqrt(Hz) is an Allan deviation of 0.9 deg/h at 100 s.
    assert datasheet_setting("N=9deg/h/sqrt(Hz),B=0.5deg/h@100s").simple.white > 0.0
    with pytest.raises(ValueError, match="N alone makes 18 times B"):
        datasheet_setting("N=9deg/h/sqrt(Hz),B=0.05deg/h@100s")


def test_an_accelerometer_without_noise_is_refused():
    gyro = "N=0.15deg/sqrt(h),B=3deg/h@100s"
    with pytest.raises(ValueError, match="no accelerometer is without noise"):
        export(tool="kalibr", datasheet=[gyro], accelerometer=(0.0, 0.0))
    assert export(tool="kalibr", datasheet=[gyro], accelerometer=(2e-3, 0.0)).notes == ()


def test_one_gyro_for_three_axes_is_said(tmp_path):
    one = document(tmp_path)
    (note,) = export(one, tool="psins").notes
    assert "stands for all three axes" in str(note)
    assert export(one, tool="toml").notes == ()
    assert export([one, one, one], tool="psins").notes == ()
