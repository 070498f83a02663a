"""NetCDF 4, by h5netcdf, and classic files, by SciPy."""

import h5netcdf
import numpy as np
import pytest
from scipy.io import netcdf_file

from sagnac.formats import Statement, columns, read
from tests.formats.examples import refused

pytestmark = pytest.mark.usefixtures("trusted_hdf5")


def saved(path, values, **attributes):
    with h5netcdf.File(path, "w") as file:
        file.dimensions = {"time": values.size}
        time = file.create_variable("time", ("time",), data=np.arange(values.size) * 10)
        time.attrs["units"] = "milliseconds since 2024-03-05 14:03:00"
        gyro = file.create_variable("x", ("time",), data=values)
        gyro.attrs["units"] = "deg/s"
        for key, value in attributes.items():
            gyro.attrs[key] = value
        file.attrs["kind"] = "rate"
    return path


def test_hdf5_is_scaled_as_its_attributes_say_and_that_is_noted(tmp_path):
    counts = np.random.default_rng(3).integers(-3000, 3000, 500).astype(np.int16)
    path = saved(tmp_path / "run.h5", counts, scale_factor=0.01, add_offset=1.5)
    stated = Statement(kind="rate", sample_rate=100.0, time="none")
    recording = read(path, stated)
    np.testing.assert_allclose(np.rad2deg(recording.gyros[0].values), 0.01 * counts + 1.5)
    assert any("x: taken times scale_factor" in str(note) for note in recording.notes)
    # What is no number is another's attribute.
    path = saved(tmp_path / "own.h5", counts, scale_factor="0.01 deg/s/LSB", missing_value="none")
    recording = read(path, stated)
    np.testing.assert_allclose(np.rad2deg(recording.gyros[0].values), counts)
    assert not any("scale_factor" in str(note) for note in recording.notes)


def test_missing_values_are_not_numbers(tmp_path):
    counts = np.arange(500, dtype=np.int16)
    counts[40] = -999
    path = saved(tmp_path / "run.nc", counts, missing_value=np.int16(-999))
    refused(path, "x:", "1 sample", "0.400 s", statement=Statement(kind="rate"))


def classic(path, values, version=1, records=None, **attributes):
    """A classic file; with `records` the time is its unlimited dimension."""
    with netcdf_file(path, "w", version=version) as file:
        file.createDimension("time", (records and None) or values.size)
        file.createDimension("axes", 3)
        time = file.createVariable("time", "i4", ("time",))
        time[:] = np.arange(values.size) * 10
        time.units = "milliseconds since 2024-03-05 14:03:00"
        gyro = file.createVariable("x", values.dtype.newbyteorder(">"), ("time",))
        gyro[:] = values
        gyro.units = "deg/s"
        for key, value in attributes.items():
            setattr(gyro, key, value)
        file.createVariable("matrix", "f8", ("axes", "axes"))[:] = np.eye(3)
        file.kind = "rate"
    return path


@pytest.mark.parametrize("version", [1, 2])
@pytest.mark.parametrize("records", [False, True])
def test_classic_files_are_read_too(tmp_path, version, records):
    counts = np.random.default_rng(3).integers(-3000, 3000, 501).astype(np.int16)
    path = classic(
        tmp_path / "run.nc", counts, version, records, scale_factor=np.float64(0.01), add_offset=1.5
    )
    assert columns(path) == ("time", "x")
    recording = read(path)
    assert recording.sample_rate == 100.0
    np.testing.assert_allclose(np.rad2deg(recording.gyros[0].values), 0.01 * counts + 1.5)
    assert recording.gyros[0].values.dtype.isnative


def test_missing_values_of_a_classic_file_are_not_numbers(tmp_path):
    values = np.arange(500.0)
    values[40] = -999.0
    path = classic(tmp_path / "run.nc", values, _FillValue=-999.0)
    refused(path, "x:", "1 sample", "0.400 s", statement=Statement(kind="rate"))


def test_a_classic_file_that_is_cut_off(tmp_path):
    path = classic(tmp_path / "run.nc", np.arange(500.0))
    whole = path.read_bytes()
    for size in (4, 20, len(whole) // 2):
        path.write_bytes(whole[:size])
        refused(path, "is not NetCDF, or is damaged")


def test_data_of_64_bits_are_refused_with_what_to_do(tmp_path):
    path = tmp_path / "run.nc"
    path.write_bytes(b"CDF\x05" + bytes(100))
    refused(path, "CDF-5", "nccopy -k nc4 run.nc run-4.nc")


def test_not_netcdf(tmp_path):
    path = tmp_path / "run.nc"
    path.write_bytes(b"CDF\x01" + 100 * b"\xff")
    refused(path, "is not NetCDF, or is damaged")
