"""PX4 logs."""

import numpy as np

from sagnac.formats import columns, read
from tests.formats.examples import refused
from tests.formats.instruments import axes, ulog


def test_the_only_gyro_needs_no_option(tmp_path):
    values = axes()
    path = ulog(tmp_path / "run.ulg", values, dropout_ms=120)
    recording = read(path)
    for gyro, column in zip(recording.gyros, values.gyros.T, strict=True):
        np.testing.assert_array_equal(gyro.values, column.astype(np.float32))
    assert abs(recording.sample_rate - 200.0) < 1e-6
    assert "sensor_accel.z" in columns(path)
    assert any("dropped out 1 time, 120 ms" in str(note) for note in recording.notes)


def test_a_log_that_is_none(tmp_path):
    path = tmp_path / "run.ulg"
    path.write_bytes(b"ULog\x01\x12\x35\x01" + bytes(8))
    refused(path, "logs none of sensor_gyro")
    path.write_bytes(b"ULog\x01")
    refused(path, "is not ULog, or is damaged")
