"""Folders of EuRoC, and what formats that hold rates alone refuse."""

import hashlib
from dataclasses import replace

import numpy as np
import pytest
import yaml

from sagnac.core.errors import RecordingError, WouldOverwrite
from sagnac.formats import read, write
from sagnac.formats.csv import write_euroc as write_folder
from sagnac.formats.source import outgoing
from sagnac.recording.model import Channel, Recording
from tests.formats.examples import example, walk
from tests.formats.instruments import axes
from tests.formats.test_instruments import euroc

VALUES = axes(samples=300)
DATA = "mav0/imu0/data.csv"
SENSOR = "mav0/imu0/sensor.yaml"


def channel(name, values, kind="rate", unit="rad/s"):
    sensor = "accelerometer" if unit.startswith("m/") else "gyro"
    return Channel(name=name, kind=kind, shown_in=unit, sensor=sensor, values=values)


SIX = Recording(
    gyros=tuple(map(channel, "xyz", VALUES.gyros.T)),
    accelerometers=tuple(
        channel(f"a{axis}", values, unit="m/s^2")
        for axis, values in zip("xyz", VALUES.accelerometers.T, strict=True)
    ),
    sample_rate=200.0,
)
GYROS = replace(SIX, accelerometers=())


def test_what_is_written_is_a_folder_of_the_data_set(tmp_path):
    path = write(SIX, tmp_path / "unit.euroc")
    lines = (path / DATA).read_text().splitlines()
    assert lines[0] == euroc(tmp_path).read_text().splitlines()[0]
    stamps = np.array([line.partition(",")[0] for line in lines[1:]], dtype=np.int64)
    np.testing.assert_array_equal(np.diff(stamps), 5_000_000)
    stated = yaml.safe_load((path / SENSOR).read_text())
    assert (stated["sensor_type"], stated["rate_hz"]) == ("imu", 200.0)
    assert np.array_equal(np.reshape(stated["T_BS"]["data"], (4, 4)), np.eye(4))
    assert not any("density" in key for key in stated)


@pytest.mark.parametrize("suffix", ["euroc", "bag", "mcap", "db3"])
def test_six_axes_and_their_times_come_back(tmp_path, suffix):
    stamps = np.arange(300) / 200.0
    stamps[100:] += 0.02
    for times in (None, stamps):
        made = replace(SIX, times=times, sample_rate=200.0)
        path = write(made, tmp_path / f"unit.{suffix}")
        back = read(path)
        sensors = zip(
            (*back.gyros, *back.accelerometers), (*made.gyros, *made.accelerometers), strict=True
        )
        for one, other in sensors:
            assert (one.name, one.kind, one.sensor) == (other.name, "rate", other.sensor)
            np.testing.assert_array_equal(one.values, other.values)
        if times is None:
            assert (back.sample_rate, back.times) == (200.0, None)
        else:
            np.testing.assert_allclose(back.times, times, atol=1e-9)
    file = path / DATA if suffix == "euroc" else path
    assert back.provenance.path == str(file)
    assert back.provenance.sha256 == hashlib.sha256(file.read_bytes()).hexdigest()
    assert [one.name for one in tmp_path.iterdir()] == [path.name]


def test_noise_that_is_known_is_stated_in_si(tmp_path):
    known = {"gyro": (1.7e-4, 1.9e-5), "accelerometer": (2e-3, 3e-3)}
    write_folder(tmp_path / "unit.euroc", outgoing(SIX), known)
    stated = yaml.safe_load((tmp_path / "unit.euroc" / SENSOR).read_text())
    for name, values in zip(("gyroscope", "accelerometer"), known.values(), strict=True):
        assert stated[f"{name}_noise_density"] == values[0]
        assert stated[f"{name}_random_walk"] == values[1]


@pytest.mark.parametrize(
    ("suffix", "change", "said"),
    [
        ("bag", {"gyros": GYROS.gyros[:2]}, "2 gyros with 3 accelerometers"),
        ("mcap", {"table": example().table}, "cannot hold table"),
        ("bag", {"null_pulse": np.zeros(600, dtype=bool)}, "null_pulse"),
        ("euroc", {"temperature": np.linspace(20.0, 25.0, 600)}, "temperature"),
        ("euroc", {"accelerometers": ()}, "3 gyros with 0 accelerometers"),
        ("bag", {"gyros": tuple(channel(n, walk(), "angle", "rad") for n in "xyz")}, "x of kind"),
        ("euroc", {"gyros": tuple(channel(n, walk(), "increment", "rad") for n in "xyz")}, "z of"),
    ],
)
def test_what_such_a_format_cannot_hold_is_refused_in_one_line(tmp_path, suffix, change, said):
    long = {
        name: tuple(replace(one, values=np.tile(one.values, 2)) for one in getattr(SIX, name))
        for name in ("gyros", "accelerometers")
    }
    change = {
        name: tuple(replace(one, values=np.resize(one.values, 600)) for one in value)
        if isinstance(value, tuple)
        else value
        for name, value in change.items()
    }
    with pytest.raises(RecordingError, match=r"use \.parquet") as caught:
        write(replace(SIX, **{**long, **change}), tmp_path / f"unit.{suffix}")
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)
    assert not list(tmp_path.iterdir())


def test_a_folder_of_ours_is_replaced_and_what_else_it_holds_stays(tmp_path):
    path = write(SIX, tmp_path / "unit.euroc")
    (path / "mav0" / "cam0").mkdir()
    (path / "mav0" / "cam0" / "image").write_text("kept")
    doubled = replace(SIX, gyros=tuple(replace(g, values=2.0 * g.values) for g in SIX.gyros))
    write(doubled, path)
    np.testing.assert_array_equal(read(path).gyros[0].values, doubled.gyros[0].values)
    assert (path / "mav0" / "cam0" / "image").read_text() == "kept"
    (path / SENSOR).write_text("sensor_type: imu\n")
    with pytest.raises(WouldOverwrite):
        write(SIX, path)
    np.testing.assert_array_equal(read(path).gyros[0].values, doubled.gyros[0].values)


@pytest.mark.parametrize("suffix", ["bag", "mcap", "db3"])
def test_a_bag_of_ours_is_known_and_replaced(tmp_path, suffix):
    for scale in (1.0, 2.0):
        gyros = tuple(replace(one, values=scale * one.values) for one in SIX.gyros)
        path = write(replace(SIX, gyros=gyros), tmp_path / f"unit.{suffix}")
    np.testing.assert_array_equal(read(path).gyros[0].values, 2.0 * SIX.gyros[0].values)


def test_the_folder_one_stands_in_is_read(tmp_path, monkeypatch):
    monkeypatch.chdir(write(SIX, tmp_path / "unit.euroc"))
    assert read(".").samples == SIX.samples
