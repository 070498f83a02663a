"""Bags of ROS 1 and 2, and MCAP."""

import sqlite3

import numpy as np
import pytest
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

from sagnac.core.errors import RecordingError
from sagnac.formats import columns, read, write
from sagnac.formats import rosbag as module
from tests.formats.examples import refused
from tests.formats.instruments import axes, bag
from tests.formats.test_euroc import GYROS, SIX, VALUES


@pytest.mark.parametrize("suffix", [".bag", ".mcap", ".db3"])
def test_a_bag_with_one_imu_needs_no_option(tmp_path, suffix, monkeypatch):
    monkeypatch.setattr(module, "_BLOCK", 250)
    values = axes(lost=3)
    path = bag(tmp_path / f"run{suffix}", values)
    if suffix == ".mcap":
        (path,) = path.glob("*.mcap")
    recording = read(path)
    assert [gyro.name for gyro in recording.gyros] == ["x", "y", "z"]
    for gyro, column in zip(recording.gyros, values.gyros.T, strict=True):
        assert (gyro.kind, gyro.shown_in) == ("rate", "rad/s")
        np.testing.assert_array_equal(gyro.values, column)
    np.testing.assert_allclose(
        recording.times, (values.stamps - values.stamps[0]) * 1e-9, atol=1e-9
    )
    assert any("topic /imu" in str(note) for note in recording.notes)
    assert len(recording.provenance.sha256) == 64


def test_accelerometers_and_the_time_of_arrival_are_columns_too(tmp_path):
    values = axes(samples=100)
    path = bag(tmp_path / "run.bag", values)
    assert columns(path)[:2] == ("stamp", "received")
    source = module.open_source(path)
    read_back = source.load(["received", "linear_acceleration.z"])
    np.testing.assert_array_equal(read_back["linear_acceleration.z"], values.accelerometers[:, 2])
    np.testing.assert_array_equal(read_back["received"], values.stamps + 2_000_000)


def test_of_several_topics_one_is_named(tmp_path):
    values = axes(samples=100)
    path = bag(tmp_path / "run.bag", values, ("/imu0", "/imu1"))
    refused(path, "no such column", "/imu0/angular_velocity.x")
    stated = {"x": "/imu1/angular_velocity.x"}
    recording = read(path, columns=stated, time="/imu1/stamp")
    np.testing.assert_array_equal(recording.gyros[0].values, values.gyros[:, 0])
    assert any("the IMU topics are /imu0, /imu1" in str(note) for note in recording.notes)


def test_a_bag_that_is_none_or_cut_off(tmp_path):
    whole = bag(tmp_path / "run.bag", axes(samples=300)).read_bytes()
    for name, content in (
        ("cut", whole[: len(whole) // 2]),
        ("none", b"#ROSBAG V2.0\n" + bytes(99)),
    ):
        path = tmp_path / f"{name}.bag"
        path.write_bytes(content)
        with pytest.raises(RecordingError, match="is not ROS bag, or is damaged or cut off"):
            read(path)


def test_a_full_disk_is_said_by_the_database_of_a_bag_as_well(tmp_path, monkeypatch):
    def full(*_):
        raise sqlite3.OperationalError("database or disk is full")

    monkeypatch.setattr(module, "_write_messages", full)
    with pytest.raises(RecordingError, match=r"unit\.db3: cannot be written \(database or disk is"):
        write(GYROS, tmp_path / "unit.db3")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("suffix", ["bag", "mcap", "db3"])
@pytest.mark.parametrize("forces", [True, False])
def test_the_library_reads_what_is_written(tmp_path, suffix, forces, monkeypatch):
    """Every field of every message, over the seams of blocks, with or without accelerometers."""
    monkeypatch.setattr(module, "_BLOCK", 120)
    recording = SIX if forces else GYROS
    path = write(recording, tmp_path / f"unit.{suffix}")
    with AnyReader([path], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as made:
        (connection,) = made.connections
        assert (connection.topic, connection.msgtype) == ("/imu", "sensor_msgs/msg/Imu")
        found = [
            (stamp, made.deserialize(raw, connection.msgtype)) for _, stamp, raw in made.messages()
        ]
    assert len(found) == recording.samples
    for n, (stamp, message) in enumerate(found):
        header, turned, pushed = (
            message.header,
            message.angular_velocity,
            message.linear_acceleration,
        )
        assert stamp == header.stamp.sec * 10**9 + header.stamp.nanosec == 10**9 + n * 5_000_000
        assert getattr(header, "seq", n) == n
        assert [turned.x, turned.y, turned.z] == VALUES.gyros[n].tolist()
        assert [pushed.x, pushed.y, pushed.z] == (
            VALUES.accelerometers[n].tolist() if forces else [0.0] * 3
        )
        assert message.orientation_covariance[0] == -1.0
        assert message.angular_velocity_covariance.tolist() == [0.0] * 9
        assert message.linear_acceleration_covariance[0] == (0.0 if forces else -1.0)
    assert [one.name for one in read(path).accelerometers] == (["ax", "ay", "az"] if forces else [])
