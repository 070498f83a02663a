"""Accelerometers beside gyros: the same law in other units."""

import json
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure

from sagnac import plot
from sagnac.analysis.pipeline import analyze
from sagnac.analysis.planning import plan
from sagnac.analysis.settings import Settings
from sagnac.analysis.verdict import judge
from sagnac.core.errors import RecordingError
from sagnac.formats import Statement, read
from sagnac.navigation.align import align
from sagnac.navigation.export import export
from sagnac.recording.model import Channel, Recording
from sagnac.report import document, page, text
from sagnac.report.sections import force_rows

RATE = 100.0
WALK = 5e-4  # m/s/sqrt(s)
UNIT = 1.0 / 60.0  # m/s/sqrt(h) in SI


@pytest.fixture(scope="module")
def recording():
    generator = np.random.default_rng(17)
    noise = generator.normal(size=(2, 30_000)) * np.sqrt(RATE)
    return Recording(
        gyros=(Channel(name="x", kind="rate", values=1e-6 * noise[0]),),
        accelerometers=(
            Channel(
                name="az",
                kind="rate",
                values=9.81 + WALK * noise[1],
                shown_in="g",
                sensor="accelerometer",
            ),
        ),
        sample_rate=RATE,
    )


@pytest.fixture(scope="module")
def both(recording):
    return analyze(recording)


@pytest.fixture(scope="module")
def force(both):
    return both.accelerometers["az"]


def test_the_velocity_random_walk_that_was_put_in_is_held(force):
    walk = force.angle_random_walk
    assert walk.status == "estimated"
    assert walk.low < WALK < walk.high
    assert walk.to("m/s/sqrt(h)").value == pytest.approx(walk.value / UNIT)
    # 1 m/s/sqrt(h) is a sixtieth of 1 m/s^2/sqrt(Hz), which is 1e6/9.80665 ug/sqrt(Hz).
    assert walk.to("ug/sqrt(Hz)").value == pytest.approx(walk.value * 1e6 / 9.80665)
    assert "m/s/sqrt(h)" in repr(walk)
    with pytest.raises(ValueError, match=r"deg/sqrt\(h\)"):
        walk.to("deg/sqrt(h)")


@pytest.mark.parametrize(
    "use",
    [
        lambda force: judge(force, "2 deg/sqrt(h)"),  # 5e-4 m/s/sqrt(s), if m were rad: 1.7
        lambda force: plan(force, within=[], specification="2 deg/sqrt(h)"),
        lambda force: force.to_json(),
        align,
        lambda force: export(force, tool="kalibr"),
    ],
)
def test_an_accelerometer_alone_is_taken_for_no_gyro(force, use):
    with pytest.raises(RecordingError, match="az: is an accelerometer"):
        use(force)


def test_it_is_what_a_gyro_of_the_same_numbers_has(recording, force):
    samples = recording.accelerometers[0].values
    gyro = Channel(name="az", kind="rate", values=samples)
    # As a gyro it would turn at 562 deg/s.
    settings = Settings(method="fos", accepted=("motion",))
    as_gyro = analyze(Recording(gyros=(gyro,), sample_rate=RATE), settings)
    assert force.angle_random_walk.value == as_gyro.angle_random_walk.value
    assert force.angle_random_walk.high == as_gyro.angle_random_walk.high


def test_notes_are_in_units_of_force(force):
    said = " ".join(str(note) for note in force.notes)
    assert "velocity random walk" in said
    assert "deg" not in said
    assert "°" not in said


def test_page_terminal_and_json_hold_both(both, force):
    rows = {title: (unit, readings) for title, unit, readings in force_rows([force])}
    unit, (reading,) = rows["N velocity random walk"]
    assert unit == "m/s/√h"
    assert float(reading.split()[0]) == pytest.approx(WALK / UNIT, rel=0.05)
    shown = page.page(both)
    assert "<h2>Accelerometers</h2>" in shown
    assert reading in shown
    assert reading in text.accelerometers(both)
    assert text.accelerometers(replace(both, accelerometers={})) == ""
    made = json.loads(document.to_json(document.analysis_document(both)))
    of_force = made["accelerometers"]["az"]
    walk = of_force["velocity_random_walk"]
    assert walk["unit"] == "m/s/sqrt(h)"
    assert walk["value"] == pytest.approx(force.angle_random_walk.value / UNIT)
    assert set(of_force["coefficients"]) == {
        "velocity_quantization",
        "velocity_random_walk",
        "bias_instability",
        "acceleration_random_walk",
        "acceleration_ramp",
    }
    assert of_force["coefficients"]["bias_instability"]["unit"] == "mg"
    first = of_force["curve"]["deviation"][0] * 9.80665e-3
    assert first == pytest.approx(force.curve_before.deviation[0])
    alone = document.analysis_document(replace(both, accelerometers={}))
    assert "accelerometers" not in alone


def test_arrays_in_units_of_force_are_accelerometers(recording, force):
    values = recording.accelerometers[0].values
    made = Recording.from_arrays(
        x=recording.gyros[0].values,
        az=values / 9.80665,
        kind="rate",
        unit={"x": "rad/s", "az": "g"},
        sample_rate=RATE,
    )
    assert [one.name for one in made.gyros] == ["x"]
    assert [(one.name, one.sensor) for one in made.accelerometers] == [("az", "accelerometer")]
    found = analyze(made.of_accelerometer("az")).angle_random_walk
    assert found.value == pytest.approx(force.angle_random_walk.value, rel=1e-9)
    only = Recording.from_arrays(az=values, kind="rate", unit="m/s^2", sample_rate=RATE)
    assert analyze(only).angle_random_walk == force.angle_random_walk


def test_frames_hold_accelerometers_whose_unit_is_stated(recording):
    pytest.importorskip("pandas")
    back = Recording.from_frame(recording.to_frame())
    assert [(one.name, one.shown_in) for one in back.accelerometers] == [("az", "g")]
    np.testing.assert_allclose(
        back.accelerometers[0].values, recording.accelerometers[0].values, rtol=1e-12
    )
    frame = {"x[deg/s]": [1.0, 2.0], "ax": [1.0, 1.0], "ay[m/s^2]": [9.8, 9.9]}
    made = Recording.from_frame(frame, kind="rate", sample_rate=2.0)
    assert [one.name for one in made.accelerometers] == ["ay"]


def noisy_half_way(values):
    """The same with noise that grows threefold half-way: what is looked at in a unit of its own."""
    grown = values - values.mean()
    grown[grown.size // 2 :] *= 3.0
    return 9.81 + grown


def test_noise_of_an_accelerometer_that_changes_is_said_in_its_units(recording):
    (force,) = recording.accelerometers
    louder = replace(force, values=noisy_half_way(force.values))
    spoilt = replace(recording, accelerometers=(louder,))
    found = analyze(spoilt.of_accelerometer("az"))
    assert "unsteady" in {note.name for note in found.findings}


def test_a_note_on_an_accelerometer_speaks_of_its_own_random_walk(tmp_path):
    # A row is missing in the middle of ten minutes.
    random = np.random.default_rng(2)
    time = np.delete(np.arange(12_000) / 20.0, 6_000)
    noise = random.standard_normal((time.size, 2)) * [1e-4, 1e-3]
    header = "time[s],x[rad/s],ax[m/s^2]"
    path = tmp_path / "still.csv"
    np.savetxt(path, np.column_stack([time, noise]), delimiter=",", header=header, comments="")
    analysis = analyze(read(path, Statement(kind="rate", time="time", accelerometers=("ax",))))
    of_gyro, of_force = (
        " ".join(note.text for note in one.notes if note.effect is not None)
        for one in (analysis, analysis.accelerometers["ax"])
    )
    assert "angle random walk" in of_gyro
    assert "velocity random walk" in of_force
    assert "angle random walk" not in of_force


def test_pictures_and_datasets_are_in_the_units_of_the_sensor(both, force):
    milli_g = 9.80665e-3
    axes = plot.stability(force, ax=Figure().add_subplot())
    assert axes.get_ylabel() == "Allan deviation, az (mg)"
    drawn = {line.get_label(): line for line in axes.get_lines()}
    np.testing.assert_allclose(
        drawn["after removal"].get_ydata(), force.curve.deviation / milli_g, rtol=1e-12
    )
    with pytest.raises(ValueError, match="axes are in °/h"):
        plot.stability(force, ax=plot.stability(both, ax=Figure().add_subplot()))
    axes = plot.spectrum(force, ax=Figure().add_subplot())
    assert axes.get_ylabel() == "acceleration noise density, az (mg/√Hz)"
    drawn = {line.get_label(): line for line in axes.get_lines()}
    assert drawn["√2 N"].get_ydata()[0] == pytest.approx(np.sqrt(2.0) * WALK / milli_g, rel=0.05)
    axes = plot.parts(force, ax=Figure().add_subplot())
    assert axes.get_ylabel() == "N, az (m/s/√h)"
    drawn = {line.get_label(): line for line in axes.get_lines()}
    assert drawn["the answer"].get_ydata()[0] == pytest.approx(WALK / UNIT, rel=0.05)
    assert plot.lines(force, ax=Figure().add_subplot()).get_ylabel() == "amplitude (m/s)"
    assert plot.residual(force, ax=Figure().add_subplot()).get_ylabel() == "left (mg)"
    deviation = force.to_xarray()["deviation"]
    assert deviation.attrs["units"] == "mg"
    np.testing.assert_allclose(deviation, force.curve.deviation / milli_g, rtol=1e-12)
