"""PSINS logs: the header, and files without one."""

import numpy as np

from sagnac.formats import Statement, columns, read
from tests.formats.examples import ARCSECOND, IMU_HEADER, imu, refused, save


def test_psins_header_states_rate_kind_and_factors(tmp_path):
    path, counts = imu(tmp_path / "run.imu")
    recording = read(path, Statement(span=(2.0, 7.0)))
    assert recording.sample_rate == 200.0
    assert [gyro.name for gyro in recording.gyros] == ["x", "y", "z"]
    assert {gyro.kind for gyro in recording.gyros} == {"increment"}
    assert recording.provenance.span_s == (2.0, 7.0)
    for gyro, column, factor in zip(recording.gyros, counts.T, (0.1, 0.2, 0.4), strict=False):
        expected = factor * ARCSECOND * column[400:1400]
        np.testing.assert_allclose(gyro.values, expected, rtol=1e-14)


def test_accelerometers_count_millionths_of_g_seconds(tmp_path):
    path, counts = imu(tmp_path / "run.imu")
    assert read(path).accelerometers == ()
    recording = read(path, accelerometers=("ax", "ay", "az"))
    assert [one.name for one in recording.accelerometers] == ["ax", "ay", "az"]
    for one, column in zip(recording.accelerometers, counts.T[3:], strict=True):
        assert (one.kind, one.sensor) == ("increment", "accelerometer")
        np.testing.assert_allclose(one.values, 125e-6 * 9.78 * column, rtol=1e-12)
    path, _ = imu(tmp_path / "gyros.imu", header=IMU_HEADER.replace("125 125 125", "0 0 0"))
    assert columns(path) == ("x", "y", "z")


def test_psins_damaged(tmp_path):
    path, _ = imu(tmp_path / "run.imu")
    save(path, path.read_text()[:-7])
    refused(path, "cut off")
    refused(imu(tmp_path / "none.imu", header="% nothing\n")[0], "header", "positive")
    refused(imu(tmp_path / "zero.imu", header=IMU_HEADER.replace(" 5.0 ", " 0 "))[0], "interval")
    refused(save(tmp_path / "words.imu", "hello\n"), "PSINS")
    refused(save(tmp_path / "short.imu", IMU_HEADER), "too few")
