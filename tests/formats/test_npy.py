"""NumPy arrays by themselves."""

import numpy as np
import pytest

from sagnac.formats import Statement, columns, missing, read
from tests.formats.examples import refused

RANDOM = np.random.default_rng(4)
ROWS = RANDOM.standard_normal((500, 3))
STATED = {"kind": "rate", "unit": "deg/s", "sample_rate": 100.0}


@pytest.mark.parametrize("array", [ROWS, ROWS.T, np.asfortranarray(ROWS)])
def test_columns_have_numbers(tmp_path, array):
    np.save(tmp_path / "run.npy", array)
    assert columns(tmp_path / "run.npy") == ("1", "2", "3")
    recording = read(tmp_path / "run.npy", **STATED, columns={"x": "1", "z": "3"})
    np.testing.assert_allclose(recording.gyro("z").values_in(), ROWS[:, 2], rtol=1e-12)


def test_one_gyro_is_one_column(tmp_path):
    np.save(tmp_path / "run.npy", ROWS[:, 0].astype(np.float32))
    assert missing(tmp_path / "run.npy") == {
        "columns": "x=1",
        "kind": "KIND",
        "unit": "UNIT",
        "rate": "HZ",
    }
    recording = read(tmp_path / "run.npy", **STATED, columns={"x": "1"}, span=(1.0, 2.0))
    np.testing.assert_allclose(recording.gyros[0].values_in(), ROWS[100:200, 0], rtol=1e-6)


def test_one_gyro_may_be_long(tmp_path):
    np.save(tmp_path / "run.npy", np.resize(ROWS, 5000))
    assert read(tmp_path / "run.npy", **STATED, columns={"x": "1"}).samples == 5000


def test_records_have_names(tmp_path):
    records = np.zeros(500, dtype=[("x", "f8"), ("note", "U4"), ("alpha", "i4")])
    records["x"], records["alpha"] = ROWS[:, 0], np.arange(500)
    np.save(tmp_path / "run.npy", records)
    assert columns(tmp_path / "run.npy") == ("x", "alpha")
    recording = read(tmp_path / "run.npy", **STATED, table="alpha:deg")
    assert recording.table is not None
    np.testing.assert_allclose(recording.table.values_in(), np.arange(500.0), rtol=1e-12)


def test_what_is_no_table_is_refused(tmp_path):
    path = tmp_path / "run.npy"
    for array in (
        np.zeros((2, 3, 4)),
        np.array(["a", "b"]),
        np.ones(4, dtype=complex),
        np.ones(()),
        np.zeros((5000, 5001), dtype=np.int8),
    ):
        np.save(path, array)
        refused(path, "no table of real numbers", "shape (samples,) or (samples, channels)")
    np.save(path, np.array([{}, []], dtype=object), allow_pickle=True)
    refused(path, "npy")
    np.save(path, ROWS)
    path.write_bytes(path.read_bytes()[:-100])
    refused(path, "npy")


@pytest.mark.parametrize("time", ["datetime64[us]", "datetime64[ns]", "timedelta64[ms]"])
@pytest.mark.parametrize("suffix", ["npy", "npz"])
def test_dates_and_durations_are_time_stamps(tmp_path, time, suffix):
    path, begin = tmp_path / f"run.{suffix}", np.datetime64("2026-03-01T10:00:00")
    rates = Statement(kind="rate", unit="deg/s")
    for lost in (0, 10):
        elapsed = (10 * np.arange(500) + 10 * lost * (np.arange(500) >= 250)).astype("m8[ms]")
        records = np.zeros(500, dtype=[("time", time), ("x", "f8")])
        records["time"] = begin + elapsed if time.startswith("date") else elapsed
        records["x"] = ROWS[:, 0]
        if suffix == "npy":
            np.save(path, records)
        else:
            np.savez(path, time=records["time"], x=records["x"])
        if lost:
            refused(path, "time: has 1 gap", "0.11 s at 2.490 s", statement=rates)
        else:
            recording = read(path, rates)
            assert recording.sample_rate == pytest.approx(100.0, rel=1e-9)
            assert recording.samples == 500
