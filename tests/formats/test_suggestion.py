"""What would have to be stated for a file to be read."""

import h5py
import numpy as np
import pytest
from scipy.io import savemat

from sagnac.cli import main
from sagnac.core.errors import RecordingError
from sagnac.core.texts import keywords
from sagnac.formats import gyros_in, missing, read, write
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
            "t,gx,gy,ax,T\ns,deg/s,deg/s,g,hPa",
            (SECONDS, NOISE, NOISE, NOISE, NOISE),
            {"columns": "x=gx,y=gy", "kind": "rate"},
        ),
        (
            "time,cnt_x,cnt_z,angle",
            (SECONDS, NOISE, NOISE, NOISE),
            {
                "columns": "x=cnt_x,z=cnt_z",
                "kind": "KIND",
                "unit": "UNIT",
                "time": "time:s",
                "table": "angle:UNIT",
            },
        ),
        (
            "x[deg/s],angle,time[s]",
            (NOISE, NOISE, SECONDS),
            {"kind": "rate", "table": "angle:UNIT"},
        ),
        ("x[deg/s],y[deg],time[s]", (NOISE, NOISE, SECONDS), {"kind": "x=rate,y=KIND"}),
        (
            "gx_dps,gy_deg_per_h,time[s]",
            (NOISE, NOISE, SECONDS),
            {"columns": "x=gx_dps,y=gy_deg_per_h", "kind": "rate", "unit": "x=deg/s,y=deg/h"},
        ),
        (
            "gx_dps,gy_raw,time[s]",
            (NOISE, NOISE, SECONDS),
            {"columns": "x=gx_dps,y=gy_raw", "kind": "x=rate,y=KIND", "unit": "x=deg/s,y=UNIT"},
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


INDEX = np.arange(ROWS, dtype=float)


def test_two_rows_of_a_header_tell_gyros_from_quaternions(tmp_path):
    header = (
        ",orientation,,,,angular velocity [deg/s],,,linear acceleration,,\n"
        "time[s],w,x,y,z,x,y,z,x,y,z"
    )
    gyros = [NOISE + n for n in range(3)]
    path = table(
        tmp_path / "two.csv", header, SECONDS, *[np.sin(SECONDS)] * 4, *gyros, *[NOISE] * 3
    )
    found = missing(path)
    # Their names hold a mark of lists or none: by their numbers or names, they are columns 6 to 8.
    recording = read(
        path,
        columns=dict(one.split("=") for one in found["columns"].split(",")),
        kind="rate",
        unit="deg/s",
    )
    for gyro, values in zip(recording.gyros, gyros, strict=True):
        np.testing.assert_allclose(gyro.values_in(), values, rtol=1e-9)
    # Rows of a title above names that are told apart are no groups.
    titled = table(tmp_path / "one.csv", "run 7,,\ntime[s],x,z", SECONDS, NOISE, NOISE)
    assert missing(titled) == {"kind": "KIND", "unit": "UNIT"}


def test_quaternions_are_no_gyros(tmp_path):
    turning = [np.sin(SECONDS + n) for n in range(4)]
    path = table(
        tmp_path / "run.csv", "time[s],q_w,q_x,q_y,q_z,w_x,w_y,w_z", SECONDS, *turning, *[NOISE] * 3
    )
    assert missing(path)["columns"] == "x=w_x,y=w_y,z=w_z"


@pytest.mark.parametrize("names", [("p", "q", "r"), ("roll_rate", "pitch_rate", "yaw rate")])
def test_body_rates_by_their_names_in_flight_are_candidates(tmp_path, names):
    path = table(tmp_path / "run.csv", f"time[s],{','.join(names)}", SECONDS, *[NOISE] * 3)
    assert gyros_in(path) == names
    # Angles, and quaternions of one letter and a number, are none.
    others = ",".join((*names, "roll", "yaw", "q0", "q_1"))
    path = table(tmp_path / "all.csv", f"time[s],{others}", SECONDS, *[NOISE] * 7)
    assert gyros_in(path) == names


@pytest.mark.parametrize("name", ["t", "time", "stamp", "sample"])
def test_the_number_of_a_row_is_no_time(tmp_path, name):
    path = table(tmp_path / "run.csv", f"{name},x[deg/s]", INDEX, NOISE)
    assert missing(path) == {"kind": "rate", "rate": "HZ"}
    read(path, kind="rate", sample_rate=100.0)
    bare = table(tmp_path / "bare.csv", "", INDEX, NOISE)
    assert missing(bare)["rate"] == "HZ"
    # Even steps of another size are stamps.
    stamps = table(tmp_path / "stamps.csv", f"{name},x[deg/s]", 10.0 * INDEX, NOISE)
    assert missing(stamps).get("time", "sample:ms") == f"{name}:ms"


def test_a_ramp_is_no_gyro(tmp_path):
    ramp, still = 20.0 + 0.001 * INDEX, np.full(ROWS, 3.3)
    path = table(tmp_path / "bare.csv", "", 254_500 + SECONDS, NOISE, ramp, still, NOISE)
    assert missing(path)["columns"] == "x=2,y=5"


def test_one_candidate_is_filled_in_and_several_are_listed(tmp_path, capsys):
    path = table(tmp_path / "one.csv", "time[s],out,supply", SECONDS, NOISE, np.full(ROWS, 5.0))
    assert missing(path) == {"columns": "x=out", "kind": "KIND", "unit": "UNIT"}
    path = table(tmp_path / "two.csv", "time[s],left,right", SECONDS, NOISE, NOISE)
    assert missing(path)["columns"] == "x=COLUMN"
    assert gyros_in(path) == ("left", "right")
    assert main(["check", str(path)]) == 1
    shown = capsys.readouterr().out
    assert "COLUMN may be any of left, right" in shown
    assert "--gyros left,right" in shown
    assert "--columns x=left,y=right" in shown


def test_a_column_of_words_hides_no_gyro(tmp_path):
    """Loggers write a letter for the state beside the numbers, whatever the columns are called."""
    rows = "".join(
        f"S,{a:.6f},{a * b:.6f},{b:.6f}\n" for a, b in zip(NOISE, NOISE[::-1], strict=True)
    )
    path = save(tmp_path / "run.csv", f"state,one,two,three\n{rows}")
    assert missing(path) == {"columns": "x=COLUMN", "kind": "KIND", "unit": "UNIT", "rate": "HZ"}
    assert gyros_in(path) == ("one", "two", "three")


GRAVITY = np.outer([-8.4, 0.1, 5.2], np.ones(ROWS))
"""Along three axes, m/s²: 9.88 together."""


@pytest.mark.parametrize("size", [1.0, 1.0 / 9.81, 1000.0 / 9.81], ids=["m/s^2", "g", "mg"])
@pytest.mark.parametrize("is_first", [True, False])
def test_three_columns_without_names_that_show_gravity_are_no_gyros(tmp_path, size, is_first):
    forces = [one + 0.01 * np.roll(NOISE, 7 * n) for n, one in enumerate(size * GRAVITY)]
    rates = [0.05 * np.roll(NOISE, n) for n in range(3)]
    columns = [*forces, *rates] if is_first else [*rates, *forces]
    expected = "x=5,y=6,z=7" if is_first else "x=2,y=3,z=4"
    found = missing(table(tmp_path / "run.csv", "", SECONDS, *columns))
    assert found == {"columns": expected, "kind": "KIND", "unit": "UNIT", "time": "1:s"}


@pytest.mark.parametrize("suffix", [".mat", ".h5"])
def test_the_columns_of_an_only_array_are_those_of_a_table_without_names(tmp_path, suffix):
    """The rate alone would hide lost samples."""
    array = np.stack([SECONDS, NOISE, NOISE[::-1], np.roll(NOISE, 5)], axis=1)
    path = tmp_path / f"run{suffix}"
    if suffix == ".mat":
        savemat(path, {"log": array})
    else:
        with h5py.File(path, "w") as file:
            file["log"] = array
    assert missing(path) == {
        "columns": "x=log.2,y=log.3,z=log.4",
        "kind": "KIND",
        "unit": "UNIT",
        "time": "log.1:s",
    }


def test_words_before_the_times_hide_them_not(tmp_path):
    rows = "".join(f"gyro,{at:.2f},{one:.6f}\n" for at, one in zip(SECONDS, NOISE, strict=True))
    path = save(tmp_path / "run.csv", rows)
    assert missing(path) == {"columns": "x=3", "kind": "KIND", "unit": "UNIT", "time": "2:s"}


def test_a_damaged_file_is_called_so_before_anything_is_asked_for(tmp_path, capsys):
    path = table(tmp_path / "run.csv", "", NOISE, NOISE, NOISE)
    path.write_text(path.read_text() + "1,2\n" + "1,2,3\n" * 3)
    assert main(["check", str(path)]) == 1
    said = capsys.readouterr()
    assert not said.out
    assert f"{path}: line {ROWS + 1} has 2 fields and the first row 3" in said.err


def test_a_unit_that_is_not_known_is_asked_for(tmp_path):
    with h5py.File(tmp_path / "run.h5", "w") as file:
        file.attrs["sample_rate"] = 50.0
        for name, unit in (("x", "deg per s"), ("z", "deg/s")):
            file[name] = NOISE
            file[name].attrs["unit"] = unit
    assert missing(tmp_path / "run.h5") == {"kind": "x=KIND,z=rate", "unit": "x=UNIT"}
    stated = keywords({"kind": "rate", "unit": "x=deg/s"})
    values = read(tmp_path / "run.h5", **stated)["x"].values
    np.testing.assert_allclose(np.rad2deg(values), NOISE)


@pytest.mark.parametrize(("kind", "scale"), [("angle", "0.1arcsec"), ("rate", "0.1deg/h")])
def test_counts_are_read_with_the_size_that_is_asked_for(tmp_path, kind, scale):
    path = table(tmp_path / "run.csv", "x", np.rint(100 * NOISE))
    with pytest.raises(RecordingError, match=f"state scale={scale}$"):
        read(path, kind=kind, unit="counts", sample_rate=50.0)
    assert read(path, kind=kind, unit="counts", scale=scale, sample_rate=50.0).samples == ROWS


def test_what_is_wrong_with_a_file_that_is_asked_about_names_it(tmp_path):
    rows = "".join(f"{n},{n % 7},3\n" for n in range(ROWS))
    path = save(tmp_path / "run.csv", f"{rows}time,x,z\n{rows}")
    with pytest.raises(RecordingError, match=r"run\.csv: .*line 301: 'x' is not a number"):
        missing(path)
