"""What would have to be stated for a file to be read."""

import numpy as np
import pytest

from sagnac.formats import missing, read, write
from tests.formats.examples import example, save

ROWS = 300


def table(path, header, *columns, mark=","):
    rows = "".join(mark.join(f"{v:.10g}" for v in row) + "\n" for row in zip(*columns, strict=True))
    return save(path, f"{header}\n{rows}" if header else rows)


NOISE = np.random.default_rng(8).normal(size=ROWS)
SECONDS = np.arange(ROWS) / 50.0


@pytest.mark.parametrize(
    ("header", "columns", "expected"),
    [
        ("time[s],x[deg/s]", (SECONDS, NOISE), {"kind": "rate"}),
        (
            "stamp,gyro_x,gyro_z,acc_x",
            (SECONDS * 1e6, NOISE, NOISE, NOISE),
            {
                "columns": "x=gyro_x,z=gyro_z",
                "kind": "KIND",
                "unit": "UNIT",
                "time": "stamp:us",
            },
        ),
        (
            "n,Kreisel X [Zähler],Kreisel Y [°/s]",
            (SECONDS, NOISE, NOISE),
            {
                "columns": "x=Kreisel X [Zähler],y=Kreisel Y [°/s]",
                "scale": "SIZE",
                "kind": "x=KIND,y=rate",
                "rate": "HZ",
            },
        ),
        (
            "",
            (254_500 + SECONDS, NOISE, NOISE, NOISE, NOISE),
            {"columns": "x=2,y=3,z=4", "kind": "KIND", "unit": "UNIT", "time": "1:s"},
        ),
        (
            "x[arcsec],alpha",
            (NOISE, NOISE),
            {"kind": "KIND", "table": "alpha:UNIT", "rate": "HZ"},
        ),
    ],
)
def test_what_is_missing(tmp_path, header, columns, expected):
    assert missing(table(tmp_path / "run.csv", header, *columns)) == expected


def test_nothing_is_missing_where_all_is_stated_and_what_is_suggested_is_enough(tmp_path):
    path = table(tmp_path / "run.csv", "stamp,gyro_x[deg/s]", SECONDS * 1e9, NOISE)
    found = missing(path)
    assert found == {"columns": "x=gyro_x[deg/s]", "kind": "rate", "time": "stamp:ns"}
    recording = read(path, columns={"x": "gyro_x[deg/s]"}, kind=found["kind"], time=found["time"])
    assert recording.sample_rate == 50.0
    np.testing.assert_allclose(np.rad2deg(recording.gyros[0].values), NOISE, rtol=1e-9)
    assert missing(path, columns={"x": "gyro_x"}, kind="rate", time="stamp:ns") == {}


def test_a_file_of_our_own_misses_nothing(tmp_path):
    assert missing(write(example(), tmp_path / "run.h5")) == {}
