"""Kinds and units: what is stated, by whom, and what contradicts it."""

from dataclasses import replace

import numpy as np
import pytest

from sagnac.core.errors import RecordingError
from sagnac.formats import Statement, read
from sagnac.formats.choice import choose, role_unit, scale_of
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


def kind_of(of_column, statements):
    return scale_of("x", replace(of_column, unit="deg/s"), statements).kind


def test_the_kind_is_that_of_caller_toml_column_file_in_this_order():
    of_column = column("x", kind="rate")
    others = {"beside": {"kind": "rate"}, "file": {"kind": "rate"}}
    with pytest.raises(RecordingError, match="unit 'deg/s' is not one of angle"):
        kind_of(of_column, three(caller={"kind": "angle"}, **others))
    assert kind_of(of_column, three(file={"kind": "angle"})) == "rate"
    assert kind_of(column("x", kind="angle"), three(beside={"kind": "rate"})) == "rate"
    assert kind_of(column("x"), three(file={"kind": "rate"})) == "rate"
    assert kind_of(column("x"), three(caller={"kind": {"x": "rate", "z": "angle"}})) == "rate"
    with pytest.raises(RecordingError, match="x: the file says kind 'speed', which is none"):
        kind_of(column("x", kind="speed"), three())


def test_counts_of_an_encoder_are_asked_for_with_their_size():
    with pytest.raises(RecordingError, match=r"table=enc:0\.01deg"):
        role_unit("table", column("enc", unit="counts"))
    size = role_unit("table", column("enc", unit="0.01deg")).size
    assert size == pytest.approx(np.deg2rad(0.01))


def test_the_unit_in_words_is_taken_and_a_contradiction_noted():
    scale = scale_of("x", column("x[deg]"), three(caller={"kind": "angle", "unit": "arcsec"}))
    assert scale.unit == "arcsec"
    assert [str(note) for note in scale.notes] == [
        "x: the file says deg, taken as arcsec as stated"
    ]
    alike = scale_of("x", column("x[deg]"), three(caller={"kind": "angle", "unit": "°"}))
    assert alike.notes == ()


@pytest.mark.parametrize(
    ("name", "kind", "unit", "named"),
    [
        ("gx_dps", "rate", "rad/s", "deg/s"),
        ("gx_dps", "rate", "mdps", "deg/s"),
        ("Wx_deg_h", "rate", "deg/s", "deg/h"),
        ("imu.gyro_rad_s.1", "rate", "deg/s", "rad/s"),
        ("theta x deg", "angle", "arcsec", "deg"),
        # The same unit, one of another quantity, a count, and names that only look like one.
        ("gx_dps", "rate", "°/s", None),
        ("gx_dps", "rate", "0.00875dps", None),
        ("gx_dps", "increment", "deg", None),
        ("gyro_s", "rate", "deg/h", None),
        ("dps", "rate", "deg/h", None),
        ("angle turn", "angle", "deg", None),
        ("x_dps[deg/h]", "rate", "deg/h", None),
    ],
)
def test_a_unit_in_the_name_of_a_column_against_the_stated_one_is_told(name, kind, unit, named):
    notes = scale_of("x", column(name), three(caller={"kind": kind, "unit": unit})).notes
    said = f"x: its column {name} is named as in {named}, and is taken as {unit} as stated"
    assert [str(note) for note in notes] == ([] if named is None else [said])
    assert all((note.name, note.level) == ("units", "warning") for note in notes)


def test_the_unit_in_a_name_is_no_contradiction_of_counts():
    stated = {"kind": "rate", "unit": "counts", "scale": "0.01deg/s"}
    assert scale_of("x", column("gx_dps"), three(caller=stated)).notes == ()


@pytest.mark.parametrize(
    ("stated", "header", "said"),
    [
        ({}, "x", "its unit is not stated"),
        ({}, "x[furlong]", "unit 'furlong' is not one of angle"),
        ({"unit": "counts"}, "x", "counts and their size is not stated"),
        ({"scale": "0.1arcsec"}, "x[deg]", "a scale per count contradict"),
        ({"unit": "deg/s"}, "x", "unit 'deg/s' is not one of angle"),
        ({"unit": "ms"}, "x", "unit 'ms' is not one of angle"),
    ],
)
def test_units_that_are_missing_or_contradict(stated, header, said):
    with pytest.raises(RecordingError, match=f"x: .*{said}"):
        scale_of("x", column(header), three(caller={"kind": "angle", **stated}))


@pytest.mark.parametrize(
    ("stated", "header", "first"),
    [
        ({}, "x", "state {unit rad}"),
        ({"unit": "deg/s"}, "x", "state {unit rad}"),
        ({}, "x[deg/s]", "state the right {kind}, or {unit rad}"),
        ({"scale": "1deg/s"}, "x", "state the right {scale} or {kind}"),
    ],
    ids=["missing", "stated", "by the file", "by the scale"],
)
def test_the_remedy_begins_with_what_is_likely_wrong(stated, header, first):
    with pytest.raises(RecordingError) as error:
        scale_of("x", column(header), three(caller={"kind": "angle", **stated}))
    assert error.value.remedy.startswith(first)


def test_an_accelerometer_in_velocity_is_told_to_state_its_own_kind():
    wrong = three(caller={"kind": "increment"})
    with pytest.raises(RecordingError, match="not one of acceleration") as error:
        scale_of("ax", column("ax[m/s]"), wrong, "accelerometer")
    # Of all three at once: a remedy for ax alone led to the same error of ay.
    remedy = "state {kind gyros=increment,accelerometers=increment}"
    assert error.value.remedy.startswith(remedy)
    right = three(caller={"kind": {"gyros": "increment", "accelerometers": "increment"}})
    assert scale_of("ax", column("ax[m/s]"), right, "accelerometer").kind == "increment"
    with pytest.raises(RecordingError, match="furlong") as error:
        scale_of("ax", column("ax[furlong]"), wrong, "accelerometer")
    assert "increment" not in error.value.remedy


def chosen(*headers, caller):
    """What is chosen among these columns, the gyro x besides."""
    return choose([column(one) for one in ("x[deg]", *headers)], three(caller=caller))


def test_the_unit_of_the_table_is_that_beside_its_name_first():
    both = {"table": "alpha:arcmin", "unit": {"table": "rad"}}
    table = chosen("alpha[deg]", caller=both).table
    assert (table.unit, role_unit("table", table).name) == ("arcmin", "arcmin")
    table = chosen("alpha[deg]", caller={}).table
    assert role_unit("table", table).size == pytest.approx(np.deg2rad(1.0))
    table = chosen("alpha[deg]", caller={"unit": {"table": "rad"}}).table
    assert role_unit("table", table).size == 1.0
    # One unit for all gyros is not the table's.
    table = chosen("alpha[deg]", caller={"unit": "rad"}).table
    assert role_unit("table", table).name == "deg"
    for header, said in (("alpha", "is not stated"), ("alpha[deg/s]", "not one of angle")):
        with pytest.raises(RecordingError, match=f"table: .*{said}"):
            role_unit("table", chosen(header, caller={}).table)


def test_the_unit_of_time():
    assert role_unit("time", chosen("t[ms]", caller={}).time).size == 1e-3
    for header, said in (("t", "is not stated"), ("t[deg]", "not one of time")):
        with pytest.raises(RecordingError, match=f"time: .*{said}"):
            role_unit("time", chosen(header, caller={}).time)
    written = replace(column("t"), unit="clock")
    with pytest.raises(RecordingError, match="t holds times as text, not numbers in ms"):
        choose((column("x"), written), three(caller={"time": "t:ms"}))
    with pytest.raises(RecordingError, match="t holds no times as text, such as 14:03:00"):
        choose((column("x"), column("t")), three(caller={"time": "t:clock"}))


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
