"""Kinds and units: what is stated, by whom, and what contradicts it."""

import numpy as np
import pytest

from sagnac.core.errors import RecordingError
from sagnac.formats import Statement, read
from sagnac.formats.channels import gyro_kind, gyro_scale, table_scale, time_unit
from sagnac.formats.choice import Placed
from sagnac.formats.source import column
from sagnac.formats.statement import Statements
from tests.formats.examples import ARCSECOND, SAMPLES, refused, save, text, walk


def test_counts_take_their_size_from_the_scale(tmp_path):
    counts = np.rint(10.0 * walk())
    path = save(tmp_path / "run.csv", text("x", counts))
    stated = Statement(kind="angle", unit="counts", scale="0.1arcsec", sample_rate=100.0)
    values = read(path, stated).gyros[0].values
    np.testing.assert_allclose(values, 0.1 * ARCSECOND * counts, rtol=1e-14)


def test_kind_unit_and_rate_are_never_defaulted(tmp_path):
    x = walk()
    path = save(tmp_path / "run.csv", text("x[deg/s]", x))
    refused(path, "x:", "--kind", statement=Statement(sample_rate=10.0))
    refused(path, "--rate", "--time", statement=Statement(kind="rate"))
    refused(
        path, "x:", "angle", "deg/s", "--unit", statement=Statement(kind="angle", sample_rate=10.0)
    )
    bare = save(tmp_path / "bare.csv", text("x,t,alpha", x, np.arange(SAMPLES), x))
    refused(bare, "x:", "--unit", statement=Statement(kind="angle", time="t:s", table="none"))
    refused(bare, "time", "--time t:s", statement=Statement(kind="angle", unit="deg", table="none"))
    refused(
        bare,
        "table",
        "--table alpha:deg",
        statement=Statement(kind="angle", unit="deg", sample_rate=1.0),
    )
    counts = Statement(kind="angle", unit="counts", sample_rate=1.0, table="none")
    refused(bare, "x:", "--scale", statement=counts)
    both = Statement(kind="angle", unit="deg", scale="0.1arcsec", sample_rate=1.0, table="none")
    refused(bare, "x:", "contradict", "--unit", statement=both)


def three(caller=None, beside=None, file=None):
    return Statements(
        caller=Statement(**caller or {}),
        beside=Statement(**beside or {}),
        file=Statement(**file or {}),
    )


def test_the_kind_is_that_of_caller_toml_column_file_in_this_order():
    of_column = column("x", kind="increment")
    everything = {"caller": {"kind": "rate"}, "beside": {"kind": "angle"}, "file": {"kind": "rate"}}
    assert gyro_kind("x", of_column, three(**everything)) == "rate"
    assert gyro_kind("x", of_column, three(beside={"kind": "angle"})) == "angle"
    assert gyro_kind("x", of_column, three(file={"kind": "rate"})) == "increment"
    assert gyro_kind("x", column("x"), three(file={"kind": "rate"})) == "rate"
    assert (
        gyro_kind("x", column("x"), three(caller={"kind": {"x": "rate", "z": "angle"}})) == "rate"
    )
    with pytest.raises(RecordingError, match="x: the file says kind 'speed', which is none"):
        gyro_kind("x", column("x", kind="speed"), three())


def test_the_unit_in_words_is_taken_and_a_contradiction_noted():
    scale = gyro_scale("x", column("x[deg]"), three(caller={"kind": "angle", "unit": "arcsec"}))
    assert (scale.unit, scale.factor) == ("arcsec", pytest.approx(ARCSECOND))
    assert [str(note) for note in scale.notes] == [
        "x: the file says deg, taken as arcsec as stated"
    ]
    alike = gyro_scale("x", column("x[deg]"), three(caller={"kind": "angle", "unit": "°"}))
    assert alike.notes == ()


@pytest.mark.parametrize(
    ("stated", "header", "said"),
    [
        ({}, "x", "its unit is not stated"),
        ({}, "x[furlong]", "unit 'furlong' is not known"),
        ({"unit": "counts"}, "x", "counts and their size is not stated"),
        ({"scale": "0.1arcsec"}, "x[deg]", "a scale per count contradict"),
        ({"unit": "deg/s"}, "x", "kind angle contradicts deg/s, a unit of rate"),
        ({"unit": "ms"}, "x", "kind angle contradicts ms, no unit of a gyro"),
    ],
)
def test_units_that_are_missing_or_contradict(stated, header, said):
    with pytest.raises(RecordingError, match=f"x: .*{said}"):
        gyro_scale("x", column(header), three(caller={"kind": "angle", **stated}))


def test_the_unit_of_the_table_is_that_beside_its_name_first():
    placed = Placed(column=column("alpha[deg]"), unit="arcmin")
    assert table_scale(placed, three()).unit == "arcmin"
    placed = Placed(column=column("alpha[deg]"), unit=None)
    assert table_scale(placed, three()).factor == pytest.approx(np.deg2rad(1.0))
    assert table_scale(placed, three(caller={"unit": {"table": "rad"}})).factor == 1.0
    # One unit for all gyros is not the table's.
    assert table_scale(placed, three(caller={"unit": "rad"})).unit == "deg"
    for unit, said in ((None, "is not stated"), ("deg/s", "not one of angle")):
        with pytest.raises(RecordingError, match=f"table: .*{said}"):
            table_scale(Placed(column=column("alpha"), unit=unit), three())


def test_the_unit_of_time():
    assert time_unit(Placed(column=column("t[ms]"), unit=None), three()) == 1e-3
    for unit, said in ((None, "is not stated"), ("deg", "not one of time")):
        with pytest.raises(RecordingError, match=f"time: .*{said}"):
            time_unit(Placed(column=column("t"), unit=unit), three())


def test_one_unit_for_the_gyros_stands_beside_one_for_the_accelerometers(tmp_path):
    x = walk()
    path = save(tmp_path / "run.csv", text("x,y,ax", x, x, x))
    stated = {"kind": "rate", "sample_rate": 100.0, "accelerometers": ("ax",)}
    found = read(path, **stated, unit={"gyros": "deg/s", "y": "deg/h", "accelerometers": "g"})
    assert [one.shown_in for one in found.gyros] == ["deg/s", "deg/h"]
    assert [one.shown_in for one in found.accelerometers] == ["g"]


@pytest.mark.parametrize(
    ("stated", "said"),
    [
        ({"unit": {"gyro": "deg/s", "x": "deg/h"}}, "gyro: its unit is stated, .*x, gyros, "),
        ({"unit": {"x": "deg/h", "accelerometer": "g"}}, "accelerometer: its unit is stated"),
        ({"unit": {"x": "deg/h", "w_x": "deg/s"}}, "w_x: its unit is stated"),
        ({"unit": "deg/h", "kind": {"x": "rate", "table": "angle"}}, "table: its kind is stated"),
    ],
)
def test_a_unit_of_nothing_is_refused(stated, said, tmp_path):
    path = save(tmp_path / "run.csv", text("w_x,y", walk(), walk()))
    given = {"kind": "rate", "sample_rate": 100.0, "columns": {"x": "w_x"}, **stated}
    with pytest.raises(RecordingError, match=said):
        read(path, **given)


def test_a_unit_of_a_column_that_is_not_taken_now_is_borne(tmp_path):
    path = save(tmp_path / "run.csv", text("x,y", walk(), walk()))
    units = {"x": "deg/h", "y": "deg/s", "table": "deg", "time": "s", "accelerometers": "g"}
    assert len(read(path, kind="rate", sample_rate=100.0, gyros=("x",), unit=units).gyros) == 1
