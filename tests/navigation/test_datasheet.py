"""Numbers that a data sheet states, as a filter takes them."""

import copy
import json
import math

import numpy as np
import pytest
import yaml

import sagnac
from sagnac.navigation.export import datasheet_setting, export
from sagnac.navigation.settings import measured_in
from sagnac.navigation.tools import SettingsFile
from sagnac.noise.laws import markov_allan_variance
from tests.navigation.examples import document, written

DEGREE = math.pi / 180.0
FORCE = datasheet_setting("N=80ug/sqrt(Hz),B=0.01mg@100s,range=8g")

AXES = ("ax", "ay", "az")
TILTED = (0.1, 0.2, 0.9747)  # 1 in all


@pytest.mark.parametrize(
    ("white", "kind"),
    [
        # 0.15 deg in an hour, as its square root.
        *((one, "gyro") for one in ("0.15deg/sqrt(h)", "0.0025deg/s/sqrt(Hz)", "9deg/h/sqrt(Hz)")),
        ("0.15°/√h", "gyro"),
        *((one, "accelerometer") for one in ("80ug/sqrt(Hz)", "80ug/rtHz", "80µg/√Hz")),
        *((one, "accelerometer") for one in ("0.08mg/√Hz", "0.08mg/rtHz", "0.0470719m/s/√hr")),
    ],
)
def test_units_of_n_are_one_number(white, kind):
    stated = datasheet_setting(f"N={white},B={'3deg/h' if kind == 'gyro' else '0.01mg'}@100s")
    truth = 0.15 * DEGREE / 60.0 if kind == "gyro" else 80e-6 * 9.80665
    assert stated.simple.white == pytest.approx(truth, rel=1e-6)
    assert (stated.kind, stated.limit) == (kind, None)


def test_both_models_have_the_lowest_allan_deviation_at_its_time():
    lowest, tau = 3.0 * DEGREE / 3600.0, np.array([100.0])
    stated = datasheet_setting("N=0.006deg/sqrt(h),B=3deg/h@100s")
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
    with pytest.raises(
        ValueError, match=r"states the sample rate; state the update rate \(.*in Python rate\)"
    ):
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


def test_what_is_exported_equals_its_copy_and_a_text_alone_is_one_data_sheet():
    text = "N=0.004deg/s/sqrt(Hz),B=2deg/h@100s"
    made = export(tool="kalibr", datasheet=text, rate=200.0)
    assert made == copy.deepcopy(made) == export(tool="kalibr", datasheet=[text], rate=200.0)
    assert made != export(tool="kalibr", datasheet=text, rate=100.0)
    with pytest.raises(ValueError, match="markov is 9; use 0, 1 or 2"):
        export(tool="toml", datasheet=text, markov=9)


def test_a_random_walk_far_above_or_below_the_lowest_deviation_is_a_wrong_unit():
    # 9 deg/h/sqrt(Hz) is an Allan deviation of 0.9 deg/h at 100 s.
    assert datasheet_setting("N=9deg/h/sqrt(Hz),B=0.5deg/h@100s").simple.white > 0.0
    with pytest.raises(ValueError, match="N alone makes 18 times B"):
        datasheet_setting("N=9deg/h/sqrt(Hz),B=0.05deg/h@100s")
    with pytest.raises(ValueError, match=r"N alone makes 0\.00012 times B"):
        datasheet_setting("N=0.004deg/sqrt(h),B=200deg/h@100s")


def test_an_accelerometer_without_noise_is_refused():
    gyro = "N=0.15deg/sqrt(h),B=3deg/h@100s"
    with pytest.raises(ValueError, match="no accelerometer is without noise"):
        export(tool="kalibr", datasheet=[gyro], accelerometer=(0.0, 0.0))
    assert export(tool="kalibr", datasheet=[gyro], accelerometer=(2e-3, 0.0)).notes == ()


def test_one_gyro_for_three_axes_is_said(tmp_path):
    one = document(tmp_path)
    (note,) = export(one, tool="psins").notes
    assert "stands for all three axes; it is of the mean square of two: one may have" in str(note)
    assert export(one, tool="toml").notes == ()
    (note,) = export(document(tmp_path, gyros=("x",)), tool="psins").notes
    assert str(note).endswith("stands for all three axes")


def test_two_gyros_for_three_axes_are_said_and_each_keeps_its_own():
    rate = np.random.default_rng(7).standard_normal((2, 20_000))
    still = {"kind": "rate", "unit": "deg/h", "sample_rate": 100.0}
    unit = sagnac.analyze(sagnac.Recording.from_arrays(x=rate[0], z=10.0 * rate[1], **still))
    for tool, axes in (("gtsam", "the third axis"), ("kalibr", "all three axes")):
        made = export(unit, tool=tool)
        (note,) = made.notes
        assert str(note) == f"x, z: were measured, and the worse of these gyros stands for {axes}"
        assert f"Remark: {note}" in made.text
    file = SettingsFile(tool="psins", settings=tuple(measured_in(unit)), each=True)
    x, y, z = (one.simple.white for one in file.three["gyro"])
    assert x == pytest.approx(0.1 * z, rel=0.1)
    assert y == pytest.approx(z)


def test_a_bound_on_the_random_walk_is_the_noise_and_never_zero():
    """Under a walk of the rate as strong as this, no N shows."""
    walk = np.cumsum(np.random.default_rng(9).standard_normal(20_000))
    still = {"kind": "rate", "unit": "deg/h", "sample_rate": 100.0}
    unit = sagnac.analyze(sagnac.Recording.from_arrays(x=walk, **still))
    bound = unit.angle_random_walk
    assert bound.status == "upper bound"
    (setting,) = measured_in(unit)
    assert setting.simple.white >= bound.high
    assert setting.full.white >= bound.high


def test_what_was_found_wrong_goes_with_the_settings(tmp_path):
    """Accelerometers whose unit is g, and was stated as m/s^2."""
    noise = np.random.default_rng(8).standard_normal((4, 20_000))
    forces = {name: mean + 1e-3 * one for name, mean, one in zip(AXES, TILTED, noise, strict=False)}
    unit = {"x": "deg/h"} | dict.fromkeys(AXES, "m/s^2")
    still = {"x": noise[3], **forces, "kind": "rate", "unit": unit, "sample_rate": 100.0}
    sagnac.write(sagnac.Recording.from_arrays(**still), tmp_path / "unit.parquet")
    analysis = sagnac.analyze(sagnac.read(tmp_path / "unit.parquet"))
    made = export(analysis, tool="kalibr")
    (warning,) = [note for note in made.notes if note.level == "warning"]
    assert "in g it would be gravity" in warning.text
    assert "Warning: ax, ay, az: " in made.text
    of_json = json.loads(export(analysis, tool="json").text)
    assert "gravity" in of_json["accelerometers"]["ax"]["warnings"][0]
    assert "warnings" not in of_json["sensors"]["x"]
