"""Whole recordings: streams, blocks, files."""

import ast
import json
import math
import sys
import tracemalloc
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest
import yaml

import sagnac
from sagnac import formats
from sagnac.core.errors import MissingExtra, RecordingError
from sagnac.rig.config import RigConfig, preset
from sagnac.rig.sections import AccelerometerConfig, DisturbancesConfig, GyroConfig, TableConfig
from sagnac.rig.simulate import blocks, simulate, write
from tests.rig.rigs import HARSH, from_first, triad


@pytest.mark.parametrize("block_samples", [1, 77, 1000])
@pytest.mark.parametrize("mode", ["ideal", "dithered"])
def test_blocks_are_the_recording_whatever_their_size(block_samples, mode):
    gyro = replace(
        HARSH.gyro,
        mode=mode,
        dither_rate_deg_per_s=400.0,
        low_pass_hz=(20.0, 5.0, 0.0),
        low_pass_order=2,
    )
    config = replace(
        HARSH,
        sample_rate_hz=100.0,
        disturbances=DisturbancesConfig(angle=((1.0, 0.5), (3.5, 0.2)), time=((7.3, 0.1),)),
        gyro=gyro,
    )
    recording = simulate(config).recording
    parts = [columns for columns, _ in blocks(config, block_samples)]
    assert len(parts) == -(-300 // block_samples)
    for gyro in recording.gyros:
        joined = np.concatenate([part[gyro.name] for part in parts])
        np.testing.assert_array_equal(joined, gyro.values)
    np.testing.assert_array_equal(
        np.concatenate([part["table"] for part in parts]), recording.table.values
    )
    np.testing.assert_array_equal(
        np.concatenate([part["null_pulse"] for part in parts]), recording.null_pulse
    )


def test_seed_reproduces_and_channels_are_independent():
    first, again = triad(HARSH), triad(HARSH)
    np.testing.assert_array_equal(first, again)
    assert not np.any(first[0] == triad(replace(HARSH, seed=2))[0])
    louder = replace(HARSH.gyro, arw_deg_per_sqrt_h=(1.0, 2.5e-5, 2.5e-5))
    changed = triad(replace(HARSH, gyro=louder))
    np.testing.assert_array_equal(changed[1:], first[1:])
    assert not np.array_equal(changed[0], first[0])


def test_memory_does_not_grow_with_the_duration():
    config = replace(preset("paper"), sample_rate_hz=400.0)
    list(blocks(replace(config, duration_s=1.0)))

    def peak(duration):
        tracemalloc.start()
        for _ in blocks(replace(config, duration_s=duration), 10_000):
            pass
        size = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return size

    assert peak(1600.0) < 1.1 * peak(100.0)


def test_parquet_holds_the_recording_with_all_that_is_needed_to_read_it(tmp_path):
    config = replace(preset("paper"), duration_s=200.0)
    parts = []
    path, truth_path = write(config, tmp_path / "run.parquet", parts.append)
    assert parts == sorted(parts)
    assert parts[-1] == 1.0
    read = formats.read(path)
    made = simulate(config)
    assert read.sample_rate == 500.0
    assert [(g.name, g.kind, g.shown_in) for g in read.gyros] == [
        (name, "angle", "arcsec") for name in "xyz"
    ]
    for a, b in zip(read.gyros, made.recording.gyros, strict=True):
        np.testing.assert_allclose(a.values, b.values, rtol=1e-15, atol=1e-15)
    np.testing.assert_allclose(
        from_first(read.table.values), from_first(made.recording.table.values), atol=1e-11
    )
    np.testing.assert_array_equal(read.null_pulse, made.recording.null_pulse)

    truth = json.loads(truth_path.read_text())
    assert truth == json.loads(json.dumps(asdict(made.truth)))
    assert truth["schema"] == "sagnac.truth/1"
    assert truth["seed"] == 1
    assert truth["table_rate_deg_per_s"] == pytest.approx(40.0)
    assert truth["pairs"]["x-z"]["arw_deg_per_sqrt_h"] == pytest.approx(2.5e-5)
    assert len([line for line in truth["lines"] if line["scale"] == "angle"]) == 12
    assert truth_path.name == "run.parquet.truth.json"


@pytest.mark.parametrize("suffix", ["csv", "npz", "mat"])
def test_other_formats_hold_the_encoder_as_it_reads(tmp_path, suffix):
    config = replace(preset("paper"), duration_s=20.0)
    path, _ = write(config, tmp_path / f"run.{suffix}")
    read = formats.read(path)
    made = simulate(config).recording
    for a, b in zip(read.gyros, made.gyros, strict=True):
        np.testing.assert_allclose(a.values, b.values, rtol=1e-14, atol=1e-14)
    np.testing.assert_allclose(
        from_first(read.table.values), from_first(made.table.values), atol=1e-11
    )
    if suffix == "csv":
        column = np.genfromtxt(path, delimiter=",", names=True)["tabledeg"]
        assert 0.0 <= column.min() < column.max() < 360.0
        np.testing.assert_allclose(column * 20_000, np.rint(column * 20_000), atol=1e-4)


SIX = RigConfig(
    duration_s=5.0,
    sample_rate_hz=100.0,
    kind="rate",
    table=TableConfig(rate_deg_per_s=0.0),
    gyro=GyroConfig(
        arw_deg_per_sqrt_h=(0.1, 0.3, 0.2), rate_random_walk_deg_per_h_per_sqrt_h=(5.0, 6.0, 7.0)
    ),
    accelerometer=AccelerometerConfig(
        mode="triad",
        vrw_m_per_s_per_sqrt_h=(0.06, 0.03, 0.0),
        acceleration_random_walk_mg_per_sqrt_h=(1.0, 2.0, 3.0),
    ),
)


@pytest.mark.parametrize("suffix", ["bag", "mcap", "euroc"])
def test_six_axes_are_written_as_a_bag_or_a_folder(tmp_path, suffix):
    for seed in (1, 2):
        config = replace(SIX, seed=seed)
        path, truth_path = write(config, tmp_path / f"unit.{suffix}")
    back, made = formats.read(path), simulate(config).recording
    for one, other in zip(
        (*back.gyros, *back.accelerometers), (*made.gyros, *made.accelerometers), strict=True
    ):
        np.testing.assert_array_equal(one.values, other.values)
    assert json.loads(truth_path.read_text())["seed"] == 2
    assert {one.name for one in tmp_path.iterdir()} == {path.name, truth_path.name}


def test_a_folder_of_euroc_states_the_densities_that_were_put_in(tmp_path):
    path, _ = write(SIX, tmp_path / "unit.euroc")
    stated = yaml.safe_load((path / "mav0" / "imu0" / "sensor.yaml").read_text())
    # 0.3 deg/sqrt(h), 7 deg/h/sqrt(h), 0.06 m/s/sqrt(h) and 3 mg/sqrt(h) are the largest.
    assert stated["gyroscope_noise_density"] == pytest.approx(math.radians(0.3) / 60.0, rel=1e-6)
    assert stated["gyroscope_random_walk"] == pytest.approx(
        math.radians(7.0) / 3600.0 / 60.0, rel=1e-6
    )
    assert stated["accelerometer_noise_density"] == pytest.approx(0.001, rel=1e-6)
    assert stated["accelerometer_random_walk"] == pytest.approx(3e-3 * 9.80665 / 60.0, rel=1e-6)


def test_the_densities_of_a_folder_of_euroc_hold_the_noise_of_its_steps(tmp_path):
    coarse = replace(
        SIX,
        duration_s=60.0,
        gyro=replace(SIX.gyro, rate_step_deg_per_h=(0.0, 400.0, 0.0)),
        accelerometer=replace(SIX.accelerometer, acceleration_step_mg=(2.0, 0.0, 0.0)),
    )
    path, _ = write(coarse, tmp_path / "unit.euroc")
    stated = yaml.safe_load((path / "mav0" / "imu0" / "sensor.yaml").read_text())
    made = simulate(coarse).recording
    for name, channels in (("gyroscope", made.gyros), ("accelerometer", made.accelerometers)):
        most = max(float(np.std(one.values)) for one in channels)
        density = stated[f"{name}_noise_density"]
        assert most == pytest.approx(density * math.sqrt(coarse.sample_rate_hz), rel=0.04)


@pytest.mark.parametrize(
    ("suffix", "config", "said"),
    [
        ("bag", preset("paper"), "table, null_pulse, x of kind angle"),
        ("bag", replace(SIX, kind="increment"), "az of kind increment"),
        ("euroc", replace(SIX, accelerometer=AccelerometerConfig()), "3 gyros with 0 accelerom"),
    ],
)
def test_what_a_format_cannot_hold_is_refused_before_it_is_simulated(
    tmp_path, suffix, config, said
):
    parts = []
    with pytest.raises(RecordingError, match=said):
        write(config, tmp_path / f"unit.{suffix}", parts.append)
    assert (parts, list(tmp_path.iterdir())) == ([], [])


def test_a_library_that_is_missing_is_named_before_it_is_simulated(tmp_path, monkeypatch):
    for loaded in [one for one in sys.modules if one.partition(".")[0] == "rosbags"]:
        monkeypatch.delitem(sys.modules, loaded)
    monkeypatch.delitem(sys.modules, "sagnac.formats.rosbag", raising=False)
    monkeypatch.setitem(sys.modules, "rosbags", None)
    parts = []
    with pytest.raises(
        MissingExtra, match=r"unit\.bag: writing ROS bag needs rosbags.*'\.\[ros\]'"
    ):
        write(SIX, tmp_path / "unit.bag", parts.append)
    assert (parts, list(tmp_path.iterdir())) == ([], [])


def test_nothing_is_left_of_a_file_that_cannot_be_written(tmp_path):
    config = replace(preset("paper"), duration_s=1.0)
    with pytest.raises(RecordingError, match="suffix"):
        write(config, tmp_path / "run.xyz")
    with pytest.raises(RecordingError, match="cannot be written"):
        write(config, tmp_path / "nowhere" / "run.parquet")

    def stop(_):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write(config, tmp_path / "run.parquet", stop)
    assert list(tmp_path.iterdir()) == []


def test_simulator_and_estimators_share_nothing():
    estimators = ("spectrum", "stability", "lines", "coefficients", "analysis")
    # From the room `table` it takes the frames of the paper, and nothing that fits.
    frames = {"earth_rate", "shares_from_deviations", "table_to_gyro_matrix"}
    house = Path(sagnac.__file__).parent
    for file in [*(house / "rig").glob("*.py"), house / "table" / "frames.py"]:
        for node in ast.walk(ast.parse(file.read_text())):
            if isinstance(node, ast.ImportFrom):
                for alias in node.names:
                    parts = f"{node.module}.{alias.name}".split(".")
                    assert parts[0] != "sagnac" or parts[1] not in estimators
                    assert parts[:2] != ["sagnac", "table"] or parts[-1] in frames


@pytest.mark.parametrize(
    ("name", "mode", "last", "table", "nulls"),
    [
        (
            "harsh",
            "ideal",
            (11.934819600153254, 11.88326832503946, 11.862528615879135),
            20.594334522154085,
            [1, 917, 1836, 2747],
        ),
        (
            "paper",
            "dithered",
            (12.112401001703253, 12.091252161266276, 12.07050636645191),
            20.937007231502896,
            [0, 900, 1800, 2700],
        ),
    ],
)
def test_a_seed_gives_the_numbers_that_it_always_gave(name, mode, last, table, nulls):
    """Angles at the last sample, without rounding that could fall the other way elsewhere.

    The encoder is latched with the gyros, as it was when the numbers were taken.
    """
    base = preset(name)
    lines = tuple(line for line in base.disturbances.time if line[0] <= 50.0)
    config = replace(
        base,
        duration_s=30.0,
        sample_rate_hz=100.0,
        seed=4,
        gyro=replace(base.gyro, mode=mode, quantization_step_arcsec=0.0),
        encoder=replace(base.encoder, latch_jitter_s=0.0),
        disturbances=replace(base.disturbances, time=lines),
    )
    recording = simulate(config).recording
    np.testing.assert_allclose([g.values[-1] for g in recording.gyros], last, rtol=1e-11)
    assert recording.table.values[-1] == pytest.approx(table, abs=2e-6)
    assert np.flatnonzero(recording.null_pulse).tolist() == nulls


def test_what_is_no_configuration_is_refused(tmp_path):
    with pytest.raises(TypeError, match=r"config is 'paper'; give a RigConfig"):
        simulate("paper")
    with pytest.raises(TypeError, match="give a RigConfig"):
        write({}, tmp_path / "run.csv")
