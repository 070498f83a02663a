"""The files of other tools, read back as these read them."""

import dataclasses
import json
import math
import re
import tomllib
from typing import get_args
from xml.etree import ElementTree

import numpy as np
import pytest
import yaml

import sagnac
from sagnac.core.errors import RecordingError
from sagnac.core.version import __version__
from sagnac.navigation.definitions import ToolName, definition_of
from sagnac.navigation.export import datasheet_setting
from sagnac.navigation.models import FilterModel, Markov, UpperLimit
from sagnac.navigation.settings import FilterSetting, measured_in, worst
from sagnac.navigation.tools import SettingsFile
from sagnac.noise.laws import markov_allan_variance
from tests.navigation.examples import changed, document, keys, written

TAU = np.array([1.0, 10.0])
TOOLS = get_args(ToolName)


def setting(name="x", white=1e-4, walk=1e-6, kind="gyro"):
    """A model of round figures: white 1e-4 rad/s/sqrt(Hz), walk 1e-6 rad/s^2/sqrt(Hz)."""
    deviation = white / np.sqrt(TAU)
    return FilterSetting(
        name=name,
        kind=kind,
        simple=FilterModel(white=white, walk=walk),
        full=FilterModel(
            white=white, markov=(Markov(driving_noise=2e-6, correlation_time=50.0),), angle=1e-9
        ),
        source="run.csv, SHA-256 abc",
        limit=UpperLimit(tau=TAU, deviation=deviation, limit=deviation, confidence=0.95),
        sample_rate=400.0,
        estimate=white,
    )


TRIAD = (setting("x"), setting("y", 3e-4, 2e-6), setting("z", 2e-4))
FORCES = tuple(
    setting(name, white, walk, "accelerometer")
    for name, white, walk in (("ax", 1e-3, 1e-5), ("ay", 2e-3, 3e-5), ("az", 4e-3, 2e-5))
)


@pytest.mark.parametrize("name", TOOLS)
def test_every_file_says_what_it_is_and_where_that_stands(name):
    text = written(name, settings=(setting(),))
    definition = definition_of(name)
    for said in (definition.reference, definition.text, __version__, "run.csv, SHA-256 abc"):
        assert said in text


@pytest.mark.parametrize("name", ["kalibr", "allan-variance-ros"])
def test_kalibr_by_the_worked_formula_of_its_wiki(name):
    text = written(name, settings=TRIAD)
    read = keys(text)
    assert float(read["gyroscope_noise_density"]) == pytest.approx(3e-4)  # y is the worst
    assert float(read["gyroscope_random_walk"]) == pytest.approx(2e-6)
    assert float(read["update_rate"]) == 400.0
    assert read["rostopic"] == "/imu0"
    # Kalibr: sigma_gd = sigma_g / sqrt(dt) = 3e-4 * 20, sigma_bgd = sigma_bg sqrt(dt) = 2e-6 / 20.
    assert "6.000000e-03 rad/s white, 1.000000e-07 rad/s per step" in text
    assert "accelerometer_noise_density" not in read


@pytest.mark.parametrize("name", ["kalibr", "allan-variance-ros", "openvins", "robot-localization"])
def test_a_yaml_parser_reads_numbers(name):
    text = written(name, settings=TRIAD, accelerometers=FORCES)
    # OpenCV's own first line, which YAML 1.1 writes with a space.
    read = yaml.safe_load(text.removeprefix("%YAML:1.0\n"))
    if name == "robot-localization":
        matrix = read["imu"]["angular_velocity_covariance"]
        assert matrix == pytest.approx(np.diag([3.6e-5] * 3).ravel())  # 9e-8 at 400 Hz
        matrix = read["imu"]["linear_acceleration_covariance"]
        assert matrix == pytest.approx(np.diag([6.4e-3] * 3).ravel())  # 1.6e-5 at 400 Hz
        return
    block = read["imu0"] if name == "openvins" else read
    # Keys of Kalibr's YAML formats. One noise covers all axes: az has the largest N, ay K.
    wanted = {
        "accelerometer_noise_density": 4e-3,
        "accelerometer_random_walk": 3e-5,
        "gyroscope_noise_density": 3e-4,
        "gyroscope_random_walk": 2e-6,
        "update_rate": 400.0,
    }
    assert {key: block[key] for key in wanted} == pytest.approx(wanted)
    assert block["rostopic"] == "/imu0"


def test_openvins_has_a_block_for_each():
    text = written("openvins", settings=TRIAD, each=True)
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

        def setAccelerometerCovariance(self, matrix):
            self.force = matrix

        def setBiasAccCovariance(self, matrix):
            self.force_walk = matrix

    made: dict = {}
    text = written("gtsam", settings=TRIAD, accelerometers=FORCES, each=True)
    assert re.findall(r"^[ \t]*(?:import|from) .*", text, re.MULTILINE) == ["import numpy"]
    exec(text, made)
    parameters = Parameters()
    made["set_gyroscope"](parameters)
    made["set_accelerometer"](parameters)
    # Continuous: N^2 (rad/s)^2/Hz and K^2, in the order x, y, z.
    assert np.allclose(np.diag(parameters.white), [1e-8, 9e-8, 4e-8])
    assert np.allclose(np.diag(parameters.walk), [1e-12, 4e-12, 1e-12])
    assert np.count_nonzero(parameters.white) == 3
    assert np.allclose(np.diag(parameters.force), [1e-6, 4e-6, 1.6e-5])
    assert np.allclose(np.diag(parameters.force_walk), [1e-10, 9e-10, 4e-10])


@pytest.mark.parametrize(
    ("names", "whites", "said"),
    [
        (("gz", "gx", "gy"), [3e-4, 2e-4, 1e-4], False),
        (("Gyro_X", "Gyro_Y", "Gyro_Z"), [1e-4, 3e-4, 2e-4], False),
        (("yaw", "pitch", "roll"), [1e-4, 3e-4, 2e-4], True),
        # The name of one tells, and the worst covers the others.
        (("x", "x2", "x3"), [1e-4, 3e-4, 3e-4], False),
    ],
)
def test_a_gyro_goes_to_the_axis_that_its_name_tells(names, whites, said):
    settings = [dataclasses.replace(one, name=name) for one, name in zip(TRIAD, names, strict=True)]
    file = SettingsFile(tool="psins", settings=tuple(settings), each=True)
    assert [one.simple.white for one in file.three["gyro"]] == whites
    assert ("taken for x, y and z in this order" in file.text()) == said
    # A file that names each gyro puts none on an axis.
    assert SettingsFile(tool="toml", settings=tuple(settings), each=True).notes == ()


def test_a_second_triad_is_covered_by_the_worst_of_all():
    more = tuple(dataclasses.replace(one, name=f"{one.name}2") for one in TRIAD)
    file = SettingsFile(tool="psins", settings=(*TRIAD, *more), each=True)
    assert [one.simple.white for one in file.three["gyro"]] == [3e-4] * 3


@pytest.mark.parametrize("name", ["robot-localization", "ros-imu"])
def test_a_message_of_ros_is_given_the_variance_of_a_sample(name):
    wanted = {"settings": TRIAD, "accelerometers": FORCES, "each": True, "rate": 100.0}
    read = yaml.safe_load(written(name, **wanted))["imu"]
    # N^2 times the rate: 1e-8 * 100.
    gyros = [1e-6, 0, 0, 0, 9e-6, 0, 0, 0, 4e-6]
    assert read["angular_velocity_covariance"] == pytest.approx(gyros)
    forces = [1e-4, 0, 0, 0, 4e-4, 0, 0, 0, 1.6e-3]
    assert read["linear_acceleration_covariance"] == pytest.approx(forces)
    # sensor_msgs/Imu.msg: the first element is -1 if there is no estimate.
    assert read.get("orientation_covariance", [-1])[0] == -1
    alone = yaml.safe_load(written(name, settings=TRIAD))["imu"]
    assert "linear_acceleration_covariance" not in alone


def test_recordings_of_two_rates_are_told_of_where_a_sample_counts():
    slow, fast = (
        dataclasses.replace(setting(name), sample_rate=rate)
        for name, rate in (("x", 100.0), ("y", 200.0))
    )

    def said(tool, *settings, rate=None):
        file = SettingsFile(tool=tool, settings=settings, each=True, rate=rate)
        return [str(note) for note in file.notes if "Hz" in str(note)]

    (told,) = said("ros-imu", slow, fast)
    assert "100 and 200 Hz" in told
    assert "for 100 Hz" in told
    assert not said("ros-imu", slow, fast, rate=200.0)
    assert not said("ros-imu", slow, dataclasses.replace(fast, sample_rate=100.0))
    assert not said("gtsam", slow, fast)


def walk_as_markov(white, walk, time, tau):
    """Allan variance of the bias that KF-GINS and PSINS model, by the definition of each."""
    deviation, correlation = walk, time
    driving = np.sqrt(2.0 / correlation) * deviation  # 2 sigma^2/T
    return white**2 / tau + markov_allan_variance(tau, driving, correlation)


@pytest.mark.parametrize("each", [False, True])
def test_kf_gins_takes_white_noise_and_one_markov_bias_of_one_time(each):
    wanted = {"settings": TRIAD, "accelerometers": FORCES, "each": each}
    noise = yaml.safe_load(written("kf-gins", **wanted))["imunoise"]
    assert set(noise) == {"arw", "vrw", "gbstd", "abstd", "corrtime"}
    for axis in range(3):
        gyro = TRIAD[axis] if each else TRIAD[1]
        variance = walk_as_markov(
            math.radians(noise["arw"][axis]) / 60.0,
            math.radians(noise["gbstd"][axis]) / 3600.0,
            3600.0 * noise["corrtime"],
            TAU,
        )
        assert np.all(variance >= gyro.limit.limit**2 * (1.0 - 1e-5))
        assert np.all(variance <= gyro.limit.limit**2 * 1.1)
        force = FORCES[axis] if each else FORCES[2]
        variance = walk_as_markov(
            noise["vrw"][axis] / 60.0, 1e-5 * noise["abstd"][axis], 3600.0 * noise["corrtime"], TAU
        )
        assert np.all(variance >= force.limit.limit**2 * (1.0 - 1e-5))
        assert np.all(variance <= force.limit.limit**2 * 1.1)


def test_psins_is_called_with_the_units_of_its_own():
    text = written("psins", settings=TRIAD, accelerometers=FORCES, each=True)
    rows = [line for line in text.splitlines() if not line.startswith("%")]
    read = dict(re.findall(r"^(\w+) = \[?([^\]=]*?)\]?;$", "\n".join(rows), re.MULTILINE))
    assert rows[-1] == "imuerr = imuerrset(eb, db, web, wdb, sqrtR0G, TauG, sqrtR0A, TauA);"
    for kind, limits, white, size, deviation, rate, time in (
        ("gyro", TRIAD, "web", math.pi / 180 / 60, "sqrtR0G", math.pi / 180 / 3600, "TauG"),
        # PSINS, glvf.m: glv.g0 = 9.7803267714, and glv.ug = 1e-6 glv.g0.
        ("force", FORCES, "wdb", 9.7803267714e-6, "sqrtR0A", 9.7803267714e-6, "TauA"),
    ):
        whites = [float(one) * size for one in read[white].split("; ")]
        deviations = [float(one) * rate for one in read[deviation].split("; ")]
        for one, level, bias in zip(limits, whites, deviations, strict=True):
            variance = walk_as_markov(level, bias, float(read[time]), TAU)
            assert np.all(variance >= one.limit.limit**2 * (1.0 - 1e-5)), kind
            assert np.all(variance <= one.limit.limit**2 * 1.1), kind


@pytest.mark.parametrize("tool", ["psins", "gnss-ins-sim", "gazebo"])
@pytest.mark.parametrize("gyros", [TRIAD, (datasheet_setting("N=0.15deg/sqrt(h),B=3deg/h@30s"),)])
def test_a_bias_that_is_stated_of_accelerometers_is_not_forgotten_as_that_of_gyros(tool, gyros):
    bias = datasheet_setting("N=80ug/sqrt(Hz),B=0.01mg@100s")
    model = FilterModel(white=1e-3, walk=1e-5)
    walk = FilterSetting(name="a", kind="accelerometer", simple=model, full=model, source="stated")
    (of_bias,), (of_walk,) = (
        SettingsFile(tool=tool, settings=(*gyros, one), rate=200.0).held[-1].simple.markov
        for one in (bias, walk)
    )
    # B is the Allan deviation at its cluster time, which is the highest one.
    tau = np.array([90.0, 100.0, 110.0])
    deviation = np.sqrt(markov_allan_variance(tau, of_bias.driving_noise, of_bias.correlation_time))
    assert deviation[1] == pytest.approx(1e-5 * 9.80665, rel=1e-6)
    assert deviation[1] == np.max(deviation)
    # A walk has K sqrt(tau/3), for an hour.
    tau = np.array([1.0, 600.0, 3600.0])
    deviation = np.sqrt(markov_allan_variance(tau, of_walk.driving_noise, of_walk.correlation_time))
    np.testing.assert_allclose(deviation, 1e-5 * np.sqrt(tau / 3.0), rtol=0.05)


def with_white(wanted, times):
    """The same with accelerometers whose white noise is this many times as high."""
    (one,) = wanted["accelerometers"]
    louder = dataclasses.replace(one.simple, white=times * one.simple.white)
    force = dataclasses.replace(one, simple=louder, full=louder)
    return {**wanted, "accelerometers": (force,)}


@pytest.mark.parametrize("tool", TOOLS)
def test_measured_gyros_that_forget_nothing_go_with_accelerometers_that_are_stated(tool):
    model = FilterModel(white=1e-3, walk=1e-5)
    stated = FilterSetting(name="a", kind="accelerometer", simple=model, full=model, source="b")
    gyros = tuple(dataclasses.replace(one, full=one.simple) for one in TRIAD)
    wanted = {"settings": gyros, "accelerometers": (stated,), "rate": 200.0}
    file = SettingsFile(tool=tool, settings=(*gyros, stated), rate=200.0)
    forces = [one for one in file.held if one.kind == "accelerometer"]
    assert all(one.simple.white == 1e-3 for one in forces)
    # What a tool has no place for changes nothing in its file.
    louder = written(tool, **with_white(wanted, 2.0))
    assert (louder != written(tool, **wanted)) == bool(forces)


def test_imu_sensor_by_the_algorithm_of_its_page():
    """Single-sided: sample NoiseDensity sqrt(Fs), step of the walk RandomWalk/sqrt(Fs)."""
    text = written("imu-sensor", settings=TRIAD, accelerometers=FORCES, each=True)
    assert "imu.SampleRate = 400;" in text
    for sensor, group in (("gyro", TRIAD), ("accel", FORCES)):
        (body,) = re.findall(rf"= {sensor}params\((.*?)\);", text, re.DOTALL)
        assert "'NoiseType', 'single-sided'" in body
        white, walk = (
            [float(one) for one in re.search(rf"'{key}', \[(.*?)\]", body)[1].split(",")]
            for key in ("NoiseDensity", "RandomWalk")
        )
        for axis, one in enumerate(group):
            sample, step = white[axis] * math.sqrt(400.0), walk[axis] / math.sqrt(400.0)
            assert sample == pytest.approx(one.simple.white_per_sample(1 / 400.0))
            assert step == pytest.approx(one.simple.walk_per_sample(1 / 400.0))


def test_gazebo_by_the_recursion_of_its_noise_model():
    wanted = {"settings": TRIAD, "accelerometers": FORCES, "each": True, "rate": 100.0}
    root = ElementTree.fromstring(written("gazebo", **wanted))
    assert float(root.findtext("update_rate")) == 100.0
    for element, group in (("angular_velocity", TRIAD), ("linear_acceleration", FORCES)):
        for axis, one in zip("xyz", group, strict=True):
            noise = root.find(f"imu/{element}/{axis}/noise")
            assert noise.get("type") == "gaussian"
            sample, drive, time = (
                float(noise.findtext(key))
                for key in ("stddev", "dynamic_bias_stddev", "dynamic_bias_correlation_time")
            )
            # GaussianNoiseModel.cc: what a step of dt adds, and the decay that it meets.
            dt = 0.01
            added = math.sqrt(-(drive**2) * time / 2.0 * math.expm1(-2.0 * dt / time))
            stationary = added / math.sqrt(1.0 - math.exp(-dt / time) ** 2)
            variance = walk_as_markov(sample * math.sqrt(dt), stationary, time, TAU)
            assert np.all(variance >= one.limit.limit**2 * (1.0 - 1e-5))
            assert np.all(variance <= one.limit.limit**2 * 1.1)


def test_gnss_ins_sim_by_its_equations():
    text = written("gnss-ins-sim", settings=TRIAD, accelerometers=FORCES, each=True)
    names: dict = {}
    exec(text, names)
    found = names["imu_err"]
    for sensor, walk, group, size, rate in (
        ("gyro", "arw", TRIAD, math.radians(1.0) / 60.0, math.radians(1.0) / 3600.0),
        ("accel", "vrw", FORCES, 1.0 / 60.0, 1.0),
    ):
        assert not found[f"{sensor}_b"].any()
        for axis, one in enumerate(group):
            time = found[f"{sensor}_b_corr"][axis]
            deviation = found[f"{sensor}_b_stability"][axis] * rate
            # bias_drift: a = 1 - dt/T and b = deviation sqrt(1 - exp(-2 dt/T)).
            dt = 1e-3
            step = deviation * math.sqrt(1.0 - math.exp(-2.0 * dt / time))
            stationary = step / math.sqrt(1.0 - (1.0 - dt / time) ** 2)
            white = found[f"{sensor}_{walk}"][axis] * size
            variance = walk_as_markov(white, stationary, time, TAU)
            assert np.all(variance >= one.limit.limit**2 * (1.0 - 1e-3))
            assert np.all(variance <= one.limit.limit**2 * 1.1)
    alone = written("gnss-ins-sim", settings=TRIAD)
    assert alone.count("# not measured, set it") == 4


# What the line of a sensor above the body says: N, the Markov bias, its time.
SAID = (
    r"^[#%] ([\w, ]+): N (\S+) (\S+) .*?, Markov bias (\S+) (\S+) over (\S+) s, (\S+) of the Allan"
)


@pytest.mark.parametrize("each", [False, True])
@pytest.mark.parametrize("name", ["kf-gins", "psins"])
def test_the_lines_above_a_markov_bias_are_of_the_model_below_them(name, each):
    text = written(name, settings=TRIAD, accelerometers=FORCES, each=each)
    said = {found[0]: found[1:] for found in re.findall(SAID, text, re.MULTILINE)}
    worst = [f"the worst of {', '.join(one.name for one in group)}" for group in (TRIAD, FORCES)]
    assert list(said) == ([one.name for one in TRIAD + FORCES] if each else worst)
    if name == "kf-gins":
        body = yaml.safe_load(text)["imunoise"]
        time = [3600.0 * body["corrtime"]] * 2
        white, bias = body["arw"], body["gbstd"]
    else:
        read = dict(re.findall(r"^(\w+) = \[?([^\]=]*?)\]?;$", text, re.MULTILINE))
        time = [float(read["TauG"]), float(read["TauA"])]
        white, bias = ([float(one) for one in read[key].split("; ")] for key in ("web", "sqrtR0G"))
    for place, gyro in enumerate(TRIAD if each else (TRIAD[1],)):
        n, n_unit, deviation, rate, tau, inflation = said[gyro.name if each else worst[0]]
        assert (n_unit, rate) == ("deg/sqrt(h)", "deg/h")
        assert float(n) == pytest.approx(white[place], rel=1e-3)
        assert float(deviation) == pytest.approx(bias[place], rel=1e-3)
        assert float(tau) == pytest.approx(time[0], rel=1e-3)
        variance = walk_as_markov(
            math.radians(white[place]) / 60.0, math.radians(bias[place]) / 3600.0, time[0], TAU
        )
        median = np.median(np.sqrt(variance) / gyro.limit.deviation)
        assert float(inflation) == pytest.approx(median, abs=1e-3)
    assert float(said["az" if each else worst[1]][4]) == pytest.approx(time[1], rel=1e-3)


def test_the_filter_of_madgwick_by_its_equations():
    read = yaml.safe_load(written("imu-tools", settings=TRIAD, rate=100.0))
    made = read["imu_filter_madgwick"]["ros__parameters"]
    # beta = sqrt(3/4) of the error of a sample, zeta = sqrt(3/4) of its rate of change.
    assert made["gain"] == pytest.approx(math.sqrt(0.75) * 3e-3)
    assert made["zeta"] == pytest.approx(math.sqrt(0.75) * 2e-6 / 0.1)


def test_px4_by_hand():
    text = written("px4", settings=(setting(),))
    rows = [line.split("\t") for line in text.splitlines() if not line.startswith("#")]
    assert [row[2] for row in rows] == ["EKF2_GYR_NOISE", "EKF2_GYR_B_NOISE"]
    # At 100 Hz the angle of a step varies by N^2 dt = (dt noise)^2: noise = N * 10.
    assert float(rows[0][3]) == pytest.approx(1e-3)
    assert float(rows[1][3]) == pytest.approx(1e-5)
    assert "outside the range" not in text
    quiet = written("px4", settings=(setting(white=1e-8),))
    assert "outside the range of 0.0001 to 0.1" in quiet
    both = written("px4", settings=(setting(),), accelerometers=FORCES, rate=250.0)
    rows = [line.split("\t") for line in both.splitlines() if not line.startswith("#")]
    assert [row[2] for row in rows[2:]] == ["EKF2_ACC_NOISE", "EKF2_ACC_B_NOISE"]
    # One update of 4 ms: (dt noise)^2 = N^2 dt.
    assert (float(rows[2][3]) / 250.0) ** 2 == pytest.approx(4e-3**2 / 250.0)
    assert (float(rows[3][3]) / 250.0) ** 2 == pytest.approx(3e-5**2 / 250.0, rel=1e-6, abs=0.0)


def test_toml_and_json_say_the_same_in_both_forms():
    wanted = {"settings": TRIAD, "accelerometers": FORCES, "each": True, "rate": 400.0}
    as_json, as_toml = (
        json.loads(written("json", **wanted)),
        tomllib.loads(written("toml", **wanted)),
    )
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


def test_accelerometers_have_the_full_model_too():
    wanted = {"settings": TRIAD, "accelerometers": FORCES, "each": True}
    read = json.loads(written("json", **wanted))["accelerometers"]["az"]["full"]
    assert read["continuous"]["white_m_per_s2_per_sqrt_hz"] == 4e-3
    # 1 m/s/sqrt(h) is a sixtieth of 1 m/s^2/sqrt(Hz).
    assert read["continuous"]["white_m_per_s_per_sqrt_h"] == pytest.approx(60.0 * 4e-3)
    (markov,) = read["continuous"]["markov"]
    assert markov["deviation_m_per_s2"] == pytest.approx(2e-6 * 5.0)


def test_the_worst_covers_all_at_every_cluster_time():
    two = (setting("x", 1e-4, 9e-6), setting("y", 3e-4, 2e-6))
    found = worst(two)
    assert (found.simple.white, found.simple.walk) == (3e-4, 9e-6)
    for one in two:
        assert np.all(found.full.allan_deviation(TAU) >= one.limit.limit * (1.0 - 1e-9))


def test_a_walk_that_no_recording_shows_is_told_of_above_its_bound_too():
    bounded = dataclasses.replace(setting(walk=1e-6), walk_bound=8e-7)
    covered = "not estimated, at most 9.901; it covers all slow noise that the curve allows), "
    assert covered in bounded.in_words()
    assert "slow noise" not in dataclasses.replace(bounded, walk_bound=2e-6).in_words()
    assert (
        "(K not estimated, at most 9.901 deg/h/sqrt(h)), " in bounded.as_markov(1000.0).in_words()
    )
    for walk, is_seen in ((2e-6, True), (5e-7, False)):
        said = worst([bounded, setting("y", walk=walk)]).in_words()
        assert ("not estimated" not in said) is is_seen


@pytest.mark.parametrize("status", ["not observable", None])
def test_a_walk_of_which_a_recording_tells_nothing_looks_not_measured(tmp_path, status):
    path = document(tmp_path)
    stated = json.loads(path.read_text())["coefficients"]
    nothing = {} if status is None else {**stated["rate_random_walk"], "status": status}
    changed(path, coefficients={**stated, "rate_random_walk": nothing} if status else {})
    (found,) = measured_in(path)
    assert "(not estimated)" in found.in_words()
    assert " s (K not estimated), " in found.as_markov(1000.0).in_words()
    seen = dict(stated["rate_random_walk"], status="estimated", value=1.0, low=0.9, high=1.1)
    changed(path, coefficients={**stated, "rate_random_walk": seen})
    (found,) = measured_in(path)
    assert "not estimated" not in found.in_words()


def test_white_noise_far_above_an_upper_bound_is_told_of(tmp_path):
    path = document(tmp_path)
    stated = json.loads(path.read_text())["angle_random_walk"]
    for share, said in ((0.1, True), (1.0, False)):
        bound = share * stated["high"]
        walk = {**stated, "status": "upper bound", "low": 0.0, "value": bound, "high": bound}
        changed(path, angle_random_walk=walk)
        text = sagnac.export(path, tool="kalibr").text
        assert f"(not estimated, at most {bound:.4g})" in text
        assert ("times the upper bound, since" in text) is said


def test_the_range_of_a_file_is_that_of_all_that_it_holds():
    short = dataclasses.replace(TRIAD[2].limit, tau=TAU[:1], deviation=np.ones(1), limit=np.ones(1))
    settings = (*TRIAD[:2], dataclasses.replace(TRIAD[2], limit=short))
    assert "at 95 % from 1 to 1 s." in written("gtsam", settings=settings, each=True)
    assert json.loads(written("json", settings=settings, each=True))["tau_s"] == [1.0, 1.0]
    assert json.loads(written("json", settings=TRIAD))["tau_s"] == [1.0, 10.0]


def test_the_worst_is_named_by_all_whether_they_were_measured_or_stated():
    two = (setting("x", 1e-4, 9e-6), setting("y", 3e-4, 2e-6))
    stated = tuple(dataclasses.replace(one, limit=None) for one in two)
    assert worst(two).name == worst(stated).name == "the worst of x, y"
    assert worst(two[:1]).name == worst((two[0], two[0])).name == "x"


def test_what_a_tool_cannot_hold_is_refused():
    with pytest.raises(RecordingError, match="one gyro noise for all axes"):
        written("kalibr", settings=TRIAD, each=True)
    with pytest.raises(ValueError, match="rate"):
        written("px4", TRIAD, rate=0.0)


def test_a_triad_has_three_and_each_its_own(tmp_path):
    sensors = measured_in(document(tmp_path, gyros=("x", "y", "z")))
    assert [sensor.name for sensor in sensors] == ["x", "y", "z"]
    pair = measured_in(document(tmp_path, name="pair.json"))
    assert [sensor.name for sensor in pair] == ["x-z"]
    assert pair[0].sample_rate == 0.5


def test_nothing_is_exported_of_a_triad_whose_gyros_are_not_told_apart(tmp_path):
    """Its curve is of the first and the last, and says nothing of the one between."""
    path = document(tmp_path, gyros=("x", "y", "z"))
    each = json.loads(path.read_text(encoding="utf-8"))["per_gyro"]
    changed(
        path, per_gyro={name: {**one, "status": "not observable"} for name, one in each.items()}
    )
    with pytest.raises(RecordingError, match=r"x: .*its noise is not told from"):
        measured_in(path)


def test_a_setting_lies_above_the_curve_and_above_the_answer(tmp_path):
    path = document(tmp_path)
    stated = json.loads(path.read_text(encoding="utf-8"))
    curve, walk = stated["curve"], stated["angle_random_walk"]
    sound = np.array(curve["edf"]) >= 10.0
    tau = np.array(curve["tau_s"])[sound]
    deviation = np.array(curve["deviation_deg_per_h"])[sound] * math.pi / 648_000.0
    size = math.pi / 180.0 / 60.0  # deg/sqrt(h)
    (made,) = measured_in(path)
    for model in (made.simple, made.full, made.as_markov(100.0).simple):
        assert np.all(model.allan_deviation(tau) >= deviation)
        assert model.white >= walk["high"] * size * (1.0 - 1e-12)
    assert made.simple.walk > 0.0
    # N behind a low-pass: the curve shows less than the spectrum does.
    changed(path, angle_random_walk={**walk, "value": 1e-6 / size, "high": 1.1e-6 / size})
    assert measured_in(path)[0].simple.white == pytest.approx(1.1e-6)


def test_nothing_is_exported_of_a_gyro_whose_data_are_in_error():
    """Its curve is of the table that it turns with."""
    rate = 40.0 + 0.01 * np.random.default_rng(6).standard_normal(12_000)
    gyro = {"x": rate, "kind": "rate", "unit": "deg/s", "sample_rate": 100.0}
    analysis = sagnac.analyze(sagnac.Recording.from_arrays(**gyro))
    assert analysis.angle_random_walk.status == "not observable"
    with pytest.raises(sagnac.RecordingError, match=r"x: nothing can be exported, .* turns"):
        sagnac.export(analysis, tool="kalibr")
    still = sagnac.analyze(sagnac.Recording.from_arrays(**{**gyro, "x": rate - 40.0}))
    assert "gyroscope_noise_density" in sagnac.export(still, tool="kalibr").text


def six_axes(**other):
    """A gyro and three accelerometers of 0.03 m/s/sqrt(h), half an hour at 50 Hz, some changed."""
    random, samples = np.random.default_rng(6), 90_000
    noise = 0.03 / 60.0 * math.sqrt(50.0) * random.standard_normal((samples, 3)) + [0.0, 0.0, 9.8]
    sensors = {"x": 1e-4 * random.standard_normal(samples)}
    sensors |= dict(zip(("ax", "ay", "az"), noise.T, strict=True))
    sensors |= {name: change(sensors[name]) for name, change in other.items()}
    units = {name: "m/s^2" if name[0] == "a" else "rad/s" for name in sensors}
    recording = sagnac.Recording.from_arrays(**sensors, kind="rate", unit=units, sample_rate=50.0)
    return sagnac.analyze(recording, method="none")


def warnings_of(analysis):
    notes = sagnac.export(analysis, tool="toml").notes
    return [str(note) for note in notes if note.level != "remark"]


def test_nothing_is_exported_of_an_accelerometer_whose_data_are_in_error():
    """One that stands at its limit shows half of its noise."""
    spoilt = six_axes(az=lambda force: np.minimum(force, 9.8))
    for one in (spoilt, sagnac.Analysis.from_json(spoilt.to_json())):
        with pytest.raises(RecordingError, match=r"az: .* no velocity .* leave that accelerometer"):
            sagnac.export(one, tool="kalibr")


def test_what_is_wrong_of_an_accelerometer_is_a_warning():
    stepped = six_axes(ay=lambda force: force + 0.1 * (np.arange(force.size) > 50_000))
    for one in (stepped, sagnac.Analysis.from_json(stepped.to_json())):
        warning, *_ = warnings_of(one)
        stepped_at = re.match(r"ay: its rate steps .*, at ([\d.]+) s", warning)
        assert float(stepped_at[1]) == pytest.approx(1000.0, abs=28.1)


def test_a_ramp_that_a_walk_has_to_cover_is_a_warning():
    """A bench that tilts by 1 degree in half an hour: 34.9 mg/h of gravity."""
    tilts = 9.80665 * math.radians(1.0) * np.linspace(0.0, 1.0, 90_000)
    (warning,) = warnings_of(six_axes(ay=lambda force: force + tilts))
    ramp = re.match(r"ay: a ramp of ([\d.]+) mg/h is in its curve", warning)
    assert float(ramp[1]) == pytest.approx(34.9, abs=0.2)


def test_of_sound_accelerometers_there_is_no_warning():
    analysis = six_axes()
    assert warnings_of(analysis) == []
    for one in sagnac.export(analysis, tool="toml").settings[1:]:
        assert 0.03 < one.simple.white * 60.0 < 0.036
