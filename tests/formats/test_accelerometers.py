"""Accelerometers in files: columns, units, kinds."""

import numpy as np
import pytest

from sagnac.formats import Statement, missing, read
from tests.formats.examples import refused, save, text
from tests.formats.instruments import axes, bag

pytestmark = pytest.mark.usefixtures("trusted_hdf5")

ROWS = 300
NOISE = np.random.default_rng(5).normal(size=(2, ROWS))
STATED = {"kind": "rate", "sample_rate": 100.0}


@pytest.mark.parametrize(
    ("unit", "size"),
    [("m/s^2", 1.0), ("m s^-2", 1.0), ("g", 9.80665), ("mg", 9.80665e-3), ("2.5ug", 2.4516625e-5)],
)
def test_units(tmp_path, unit, size):
    path = save(tmp_path / "run.csv", text("x[deg/s],ax,temperature", *NOISE, NOISE[0]))
    recording = read(path, accelerometers=("ax",), unit={"ax": unit}, **STATED)
    (force,) = recording.accelerometers
    assert (force.name, force.kind, force.sensor) == ("ax", "rate", "accelerometer")
    np.testing.assert_allclose(force.values, size * NOISE[1], rtol=1e-12)
    assert recording.gyros[0].sensor == "gyro"
    of_all = read(path, accelerometers=("ax",), unit={"accelerometers": unit}, **STATED)
    np.testing.assert_array_equal(of_all.accelerometers[0].values, force.values)
    assert read(path, **STATED).accelerometers == ()


def test_increments_of_velocity(tmp_path):
    path = save(tmp_path / "run.csv", text("x[arcsec],az[m/s]", *NOISE))
    stated = {"sample_rate": 100.0, "accelerometers": ("az",)}
    recording = read(path, kind={"x": "increment", "az": "increment"}, **stated)
    assert recording.accelerometers[0].kind == "increment"
    refused(
        path,
        "az: unit 'm/s' is not one of acceleration",
        statement=Statement(kind={"x": "increment"}, **stated),
    )


def test_what_cannot_be(tmp_path):
    path = save(tmp_path / "run.csv", text("x[deg/s],ax", *NOISE))
    wanted = Statement(accelerometers=("ax",), **STATED)
    refused(path, "ax: its unit is not stated", "--unit ax=m/s^2", statement=wanted)
    wanted = Statement(accelerometers=("ay",), **STATED)
    refused(path, "ay: no such column", "--accelerometers", statement=wanted)
    wanted = Statement(accelerometers=("ax",), unit={"ax": "deg/s"}, **STATED)
    refused(path, "ax: unit 'deg/s' is not one of acceleration", statement=wanted)
    stuck = save(tmp_path / "stuck.csv", text("x[deg/s],ax[g]", NOISE[0], np.ones(ROWS)))
    (note,) = read(stuck, accelerometers=("ax",), **STATED).notes
    assert (note.name, note.channel, note.level) == ("stuck", "ax", "error")


@pytest.mark.parametrize("quantity", ["unit", "kind"])
def test_what_is_stated_of_accelerometers_is_heard_or_refused(tmp_path, quantity):
    path = save(tmp_path / "run.csv", text("gx,fx", *NOISE))
    given = {"unit": {"gyros": "rad/s"}, "kind": {"gyros": "rate"}, "sample_rate": 100.0}
    of_forces = {"unit": "m/s^2", "kind": "rate"}
    given[quantity] |= {"accelerometers": of_forces[quantity]}
    columns = {"x": "gx", "ax": "fx"}
    said = f"accelerometers: its {quantity} is stated, and there is no such channel"
    refused(path, said, "--accelerometers", statement=Statement(columns=columns, **given))
    # Its twins: the accelerometer is named, is not taken, or nothing is stated of accelerometers.
    given["unit"] |= {"accelerometers": "m/s^2"}
    six = read(path, columns=columns, accelerometers=("ax",), **given)
    assert [one.name for one in six.accelerometers] == ["ax"]
    assert read(path, columns={"x": "gx"}, **given).accelerometers == ()
    both = read(path, columns=columns, unit="rad/s", kind="rate", sample_rate=100.0)
    assert [one.name for one in both.gyros] == ["x", "ax"]


def test_a_file_that_states_six_axes_needs_no_option_and_three_can_be_left_out(tmp_path):
    values = axes()
    path = bag(tmp_path / "run.bag", values)
    assert missing(path) == {}
    recording = read(path)
    assert [one.name for one in recording.accelerometers] == ["ax", "ay", "az"]
    for force, column in zip(recording.accelerometers, values.accelerometers.T, strict=True):
        assert (force.kind, force.shown_in) == ("rate", "m/s^2")
        np.testing.assert_array_equal(force.values, column)
    assert read(path, accelerometers=("none",)).accelerometers == ()
    assert [one.name for one in read(path, accelerometers=("az",)).accelerometers] == ["az"]
    part = read(path, span=(1.0, 2.0))
    np.testing.assert_array_equal(part.accelerometers[2].values, values.accelerometers[200:400, 2])
