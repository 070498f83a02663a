"""Files of other formats with bytes changed or cut off: one line, and no other exception."""

import h5netcdf
import numpy as np
import pytest

from sagnac.core.errors import RecordingError
from sagnac.formats import read, write
from tests.formats.examples import example
from tests.formats.instruments import axes, bag, mseed, tdms, ulog

VALUES = axes(samples=60)


def netcdf(path):
    with h5netcdf.File(path, "w") as file:
        file.dimensions = {"time": 60}
        file.create_variable("x", ("time",), data=VALUES.gyros[:, 0]).attrs["units"] = "rad/s"
    return path


FILES = {
    "run.bag": lambda path: bag(path, VALUES),
    "run.mcap": lambda path: next(bag(path, VALUES).glob("*.mcap")),
    "run.db3": lambda path: next(bag(path, VALUES).glob("*.db3")),
    "run.tdms": lambda path: tdms(path, VALUES),
    "run.nc": netcdf,
    "run.ulg": lambda path: ulog(path, VALUES),
    "run.mseed": lambda path: mseed(path, np.arange(500)),
    "run.feather": lambda path: write(example(), path),
}


@pytest.mark.parametrize("name", FILES)
def test_damage_is_said_in_one_line(tmp_path, name):
    whole = FILES[name](tmp_path / name).read_bytes()
    generator = np.random.default_rng(21)
    path = tmp_path / f"bad{name[3:]}"
    # A process tries each of NetCDF first; tests/fuzz makes thousands.
    for trial in range(8 if name == "run.nc" else 24):
        content = bytearray(whole)
        if trial % 4 == 0:
            del content[int(generator.integers(1, len(whole))) :]
        else:
            for place in generator.integers(0, len(whole), 1 + trial % 7):
                content[place] = int(generator.integers(256))
        path.write_bytes(bytes(content))
        before = set(tmp_path.iterdir())
        said = ""
        try:
            read(path, kind="rate", unit="rad/s", sample_rate=100.0, verify=False)
        except RecordingError as error:
            said = str(error)
        assert "\n" not in said
        assert set(tmp_path.iterdir()) == before


def test_a_turning_table_whose_record_has_no_whole_row_is_too_short(tmp_path):
    path = tmp_path / "run.csv"
    path.write_text("time[s],x[deg/s],table[deg]\n0,10.3,0\n0.01,10.8,0.4\n0.02,10.3")
    with pytest.raises(RecordingError, match="samples are too few"):
        read(path, kind="rate", time="none", sample_rate=100.0)
