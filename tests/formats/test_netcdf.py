"""NetCDF 4."""

import h5netcdf
import numpy as np

from sagnac.formats import Statement, read
from tests.formats.examples import refused


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


def test_variables_are_scaled_as_their_attributes_say(tmp_path):
    counts = np.random.default_rng(3).integers(-3000, 3000, 500).astype(np.int16)
    path = saved(tmp_path / "run.nc", counts, scale_factor=0.01, add_offset=1.5)
    recording = read(path)
    assert recording.sample_rate == 100.0
    np.testing.assert_allclose(np.rad2deg(recording.gyros[0].values), 0.01 * counts + 1.5)


def test_missing_values_are_not_numbers(tmp_path):
    counts = np.arange(500, dtype=np.int16)
    counts[40] = -999
    path = saved(tmp_path / "run.nc", counts, missing_value=np.int16(-999))
    refused(path, "x:", "1 sample", "0.400 s", statement=Statement(kind="rate"))


def test_not_netcdf(tmp_path):
    path = tmp_path / "run.nc"
    path.write_bytes(b"CDF\x01" + bytes(100))
    refused(path, "is not NetCDF, or is damaged")
