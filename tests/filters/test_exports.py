"""The files of other tools, read back as these read them."""

import dataclasses
import json
import math
import tomllib

import numpy as np
import pytest
import yaml

from sagnac.errors import RecordingError
from sagnac.filters.definitions import DEFINITIONS
from sagnac.filters.exports import FORMATS, Wanted, exported
from sagnac.filters.overbound import Overbound, UpperLimit
from sagnac.filters.sensors import Sensor, sensors_in
from sagnac.filters.settings import FilterSetting, setting_of
from sagnac.filters.state_space import FilterModel, Markov
from tests.filters.examples import document, keys

TAU = np.array([1.0, 10.0])


def setting(name="x", white=1e-4, walk=1e-6):
    """A model of round figures: white 1e-4 rad/s/sqrt(Hz), walk 1e-6 rad/s^2/sqrt(Hz)."""
    deviation = white / np.sqrt(TAU)
    sensor = Sensor(
        name=name,
        tau=TAU,
        deviation=deviation,
        edf=np.array([1e4, 1e3]),
        white=white,
        white_high=white,
        angle=0.0,
        sample_rate=400.0,
        source="run.csv, SHA-256 abc",
    )
    limit = UpperLimit(tau=TAU, deviation=deviation, limit=deviation, confidence=0.95)
    simple = Overbound(model=FilterModel(white=white, walk=walk), limit=limit)
    full = Overbound(
        model=FilterModel(
            white=white, markov=(Markov(driving_noise=2e-6, correlation_time=50.0),), angle=1e-9
        ),
        limit=limit,
    )
    return FilterSetting(sensor=sensor, simple=simple, full=full)


TRIAD = (setting("x"), setting("y", 3e-4, 2e-6), setting("z", 2e-4))


@pytest.mark.parametrize("name", list(FORMATS))
def test_every_file_says_what_it_is_and_where_that_stands(name):
    text = exported(name, Wanted(settings=(setting(),), version="9.9"))
    definition = DEFINITIONS.get(name, DEFINITIONS["toml"])
    for said in (definition.reference, definition.text, "9.9", "run.csv, SHA-256 abc"):
        assert said in text


@pytest.mark.parametrize("name", ["kalibr", "allan-variance-ros"])
def test_kalibr_by_the_worked_formula_of_its_wiki(name):
    text = exported(name, Wanted(settings=TRIAD))
    read = keys(text)
    assert float(read["gyroscope_noise_density"]) == pytest.approx(3e-4)  # y is the worst
    assert float(read["gyroscope_random_walk"]) == pytest.approx(2e-6)
    assert float(read["update_rate"]) == 400.0
    assert read["rostopic"] == "/imu0"
    # Kalibr: sigma_gd = sigma_g / sqrt(dt) = 3e-4 * 20, sigma_bgd = sigma_bg sqrt(dt) = 2e-6 / 20.
    assert "6.000000e-03 rad/s white, 1.000000e-07 rad/s per step" in text
    assert "accelerometer_noise_density" not in read
    stated = Wanted(settings=TRIAD, accelerometer=(2e-3, 3e-3))
    assert float(keys(exported(name, stated))["accelerometer_random_walk"]) == 3e-3


@pytest.mark.parametrize("name", ["kalibr", "allan-variance-ros", "openvins", "robot-localization"])
def test_a_yaml_parser_reads_numbers(name):
    text = exported(name, Wanted(settings=TRIAD, accelerometer=(2e-3, 3e-3)))
    # OpenCV's own first line, which YAML 1.1 writes with a space.
    read = yaml.safe_load(text.removeprefix("%YAML:1.0\n"))
    if name == "robot-localization":
        matrix = read["imu"]["angular_velocity_covariance"]
        assert matrix == pytest.approx(np.diag([3.6e-5] * 3).ravel())  # 9e-8 at 400 Hz
        return
    block = read["imu0"] if name == "openvins" else read
    # Keys of Kalibr's YAML formats.
    wanted = {
        "accelerometer_noise_density": 2e-3,
        "accelerometer_random_walk": 3e-3,
        "gyroscope_noise_density": 3e-4,
        "gyroscope_random_walk": 2e-6,
        "update_rate": 400.0,
    }
    assert {key: block[key] for key in wanted} == pytest.approx(wanted)
    assert block["rostopic"] == "/imu0"


def test_openvins_has_a_block_for_each():
    text = exported("openvins", Wanted(settings=TRIAD, each=True))
    assert text.startswith("%YAML:1.0\n")
    assert [line for line in text.splitlines() if line.startswith("imu")] == [
        "imu0:", "imu1:", "imu2:",
    ]  # fmt: skip
    assert text.count("  gyroscope_noise_density: ") == 3


def test_gtsam_is_set_by_the_file_itself():
    class Parameters:
        def setGyroscopeCovariance(self, matrix):
            self.white = matrix

        def setBiasOmegaCovariance(self, matrix):
            self.walk = matrix

    made: dict = {}
    exec(exported("gtsam", Wanted(settings=TRIAD, each=True)), made)
    parameters = Parameters()
    made["set_gyroscope"](parameters)
    # Continuous: N^2 (rad/s)^2/Hz and K^2, in the order x, y, z.
    assert np.allclose(np.diag(parameters.white), [1e-8, 9e-8, 4e-8])
    assert np.allclose(np.diag(parameters.walk), [1e-12, 4e-12, 1e-12])
    assert np.count_nonzero(parameters.white) == 3


def test_robot_localization_is_given_the_variance_of_a_sample():
    text = exported("robot-localization", Wanted(settings=TRIAD, each=True, rate=100.0))
    matrix = json.loads(text.partition("covariance: ")[2].partition("]")[0] + "]")
    # N^2 times the rate: 1e-8 * 100.
    assert matrix == pytest.approx([1e-6, 0, 0, 0, 9e-6, 0, 0, 0, 4e-6])


def test_px4_by_hand():
    text = exported("px4", Wanted(settings=(setting(),)))
    rows = [line.split("\t") for line in text.splitlines() if not line.startswith("#")]
    assert [row[2] for row in rows] == ["EKF2_GYR_NOISE", "EKF2_GYR_B_NOISE"]
    # At 100 Hz the angle of a step varies by N^2 dt = (dt noise)^2: noise = N * 10.
    assert float(rows[0][3]) == pytest.approx(1e-3)
    assert float(rows[1][3]) == pytest.approx(1e-5)
    assert "outside the range" not in text
    quiet = exported("px4", Wanted(settings=(setting(white=1e-8),)))
    assert "outside the range of 0.0001 to 0.1" in quiet


def test_toml_and_json_say_the_same_in_both_forms():
    wanted = Wanted(settings=TRIAD, each=True, rate=400.0)
    as_json, as_toml = json.loads(exported("json", wanted)), tomllib.loads(exported("toml", wanted))
    assert as_json == as_toml
    full = as_json["sensors"]["x"]["full"]
    (continuous,), (discrete,) = full["continuous"]["markov"], full["discrete"]["markov"]
    assert discrete["decay"] == pytest.approx(math.exp(-1.0 / (400.0 * 50.0)))
    assert continuous["deviation_rad_per_s"] == pytest.approx(2e-6 * 5.0)
    simple = as_json["sensors"]["y"]["simple"]
    assert simple["discrete"]["white_rad_per_s"] == pytest.approx(3e-4 * 20.0)
    assert simple["continuous"]["white_deg_per_sqrt_h"] == pytest.approx(
        3e-4 * 180.0 / math.pi * 60.0
    )


def test_what_a_tool_cannot_hold_is_refused():
    with pytest.raises(RecordingError, match="one gyro noise for all axes"):
        exported("kalibr", Wanted(settings=TRIAD, each=True))
    with pytest.raises(ValueError, match="format is 'xml'"):
        exported("xml", Wanted(settings=TRIAD))
    with pytest.raises(ValueError, match="rate"):
        Wanted(settings=TRIAD, rate=0.0)


def test_a_triad_has_three_and_each_its_own(tmp_path):
    sensors = sensors_in(document(tmp_path, gyros=("x", "y", "z")))
    assert [sensor.name for sensor in sensors] == ["x", "y", "z"]
    pair = sensors_in(document(tmp_path, name="pair.json"))
    assert [sensor.name for sensor in pair] == ["x-z"]
    assert pair[0].sample_rate == 0.5
    assert pair[0].angle > 0.0


def test_a_setting_lies_above_the_curve_and_above_the_answer(tmp_path):
    (sensor,) = sensors_in(document(tmp_path))
    made = setting_of(sensor)
    sound = sensor.edf >= 10.0
    for bound in (made.simple, made.full):
        assert np.all(bound.model.allan_deviation(sensor.tau[sound]) >= sensor.deviation[sound])
        assert bound.model.white >= sensor.white_high
    assert made.simple.model.walk > 0.0
    # N behind a low-pass: the curve shows less than the spectrum does.
    hidden = dataclasses.replace(sensor, white=1e-6, white_high=1.1e-6)
    assert setting_of(hidden).simple.model.white == pytest.approx(1.1e-6)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("{", "is no JSON"),
        ("[]", "is no document of schema"),
        ('{"schema": "other/1"}', "is no document of schema"),
        ('{"schema": "sagnac.analysis/1"}', "breaks its schema"),
    ],
)
def test_what_is_no_analysis_is_named(tmp_path, content, said):
    path = tmp_path / "other.json"
    path.write_text(content)
    with pytest.raises(RecordingError, match=rf"other\.json: {said}"):
        sensors_in(path)
