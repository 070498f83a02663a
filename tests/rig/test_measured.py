"""A unit simulated from its measurement."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import butter, lfilter

import sagnac
from sagnac.core.units import COEFFICIENT_UNITS, FORCE_COEFFICIENT_UNITS
from sagnac.quality.readout import step_shown
from sagnac.report.document import analysis_document, to_json
from sagnac.rig.config import RigConfig
from sagnac.rig.measured import Measured, MeasuredSensor
from sagnac.rig.sections import AccelerometerConfig, ConfigurationError, GyroConfig, TableConfig
from sagnac.rig.simulate import simulate, write
from tests.handmade import analysis, estimate

STILL = TableConfig(rate_deg_per_s=0.0)
UNIT = RigConfig(
    duration_s=600.0,
    sample_rate_hz=50.0,
    kind="rate",
    table=STILL,
    gyro=GyroConfig(
        arw_deg_per_sqrt_h=(0.1, 0.2, 0.3),
        quantization_step_arcsec=0.0,
        angle_noise_arcsec=(5.0, 10.0, 15.0),
        rate_random_walk_deg_per_h_per_sqrt_h=(30.0, 60.0, 90.0),
    ),
    accelerometer=AccelerometerConfig(mode="triad", vrw_m_per_s_per_sqrt_h=(0.01, 0.02, 0.03)),
)


def test_an_analysis_and_its_document_give_the_same_unit(tmp_path):
    made = analysis(gyros=("x",), table_rate=None)
    document = json.loads(to_json(analysis_document(made)))
    one, other = RigConfig.from_analysis(made), RigConfig.from_analysis(document)
    made.to_json(tmp_path / "analysis.json")
    assert RigConfig.from_analysis(sagnac.Analysis.from_json(tmp_path / "analysis.json")) == other
    assert one.gyro.arw_deg_per_sqrt_h == pytest.approx((2.5e-5,) * 3)
    assert one.gyro.angle_noise_arcsec == pytest.approx((3e-4,) * 3)
    # 1e-11 rad/s/sqrt(s) in deg/h/sqrt(h).
    walk = 1e-11 * 180.0 / math.pi * 3600.0 * 60.0
    assert one.gyro.rate_random_walk_deg_per_h_per_sqrt_h == pytest.approx((walk,) * 3)
    assert one.gyro.bias_instability_deg_per_h == (0.0,) * 3  # an upper bound is no estimate
    assert (one.sample_rate_hz, one.duration_s, one.turning) == (0.5, 7200.0, False)
    for name in ("arw_deg_per_sqrt_h", "rate_random_walk_deg_per_h_per_sqrt_h"):
        assert getattr(one.gyro, name) == pytest.approx(getattr(other.gyro, name))
    said = Measured.of_document(document).left_out()
    assert said == [
        "no low-pass, since the spectrum shows none",
        "x: without bias instability, rate ramp, not estimated",
        "y, z: as x",
        "no mean: neither its biases nor how it stood, which are those of the table",
    ]


def test_each_gyro_of_a_triad_has_its_own_and_the_table_its_rate():
    triad = analysis(gyros=("x", "y", "z"))
    triad = replace(
        triad, per_gyro={**triad.per_gyro, "z": estimate(3.0 * 2.5e-5 / 3437.746770785)}
    )
    for given in (triad, json.loads(to_json(analysis_document(triad)))):
        made = RigConfig.from_analysis(given)
        assert made.gyro.arw_deg_per_sqrt_h == pytest.approx((2.5e-5, 2.5e-5, 7.5e-5))
        assert made.table.rate_deg_per_s == pytest.approx(40.0)


def test_a_gyro_goes_to_the_axis_that_its_name_tells():
    document = json.loads(to_json(analysis_document(analysis(gyros=("x",), table_rate=None))))
    walk = document["angle_random_walk"]["value"]
    louder = {**document, "angle_random_walk": {**document["angle_random_walk"], "value": 2 * walk}}
    for names, wanted in (
        (("gz", "gx", "gy"), [1.0, 1.0, 2.0]),
        (("yaw", "pitch", "roll"), [2.0, 1.0, 1.0]),  # no name tells
        (("x", "y", "spare"), [2.0, 1.0, 2.0]),  # the first stands for what none tells
    ):
        gyros = dict(zip(names, (louder, document, document), strict=True))
        unit = Measured.of_document({**document, "gyros": gyros})
        walks = unit.keys()["gyro"]["arw_deg_per_sqrt_h"]
        assert walks == pytest.approx(walk * np.array(wanted))
        assert ("z: as x" in unit.left_out()) == ("spare" in names)


def test_a_triad_on_a_table_has_the_low_pass_of_its_pair():
    document = json.loads(to_json(analysis_document(analysis(gyros=("x", "y", "z")))))
    document["low_pass"] = {"corner_hz": 0.1, "order": 2}
    made = RigConfig.from_analysis(document).gyro
    assert (made.low_pass_hz, made.low_pass_order) == ((0.1,) * 3, 2)
    said = [line for line in Measured.of_document(document).left_out() if "low-pass" in line]
    assert said == [f"{name}: low-pass of 0.1 Hz, order 2" for name in "xyz"]


def test_what_no_key_can_hold_is_refused():
    loud = analysis(gyros=("x",), answer=estimate(1.0))
    with pytest.raises(ConfigurationError, match=r"arw_deg_per_sqrt_h is 34\d\d.*from 0 to 10"):
        RigConfig.from_analysis(loud)


@pytest.mark.parametrize("kind", ["increment", "rate"])
def test_samples_of_a_kind_are_those_of_the_angle(kind, tmp_path):
    config = replace(UNIT, duration_s=20.0, kind=kind)
    angles = simulate(replace(config, kind="angle")).recording
    made = simulate(config).recording
    per = 50.0 if kind == "rate" else 1.0
    for name in ("x", "y", "z"):
        steps = np.diff(angles.gyro(name).values, prepend=0.0) * per
        np.testing.assert_allclose(made.gyro(name).values, steps, rtol=0, atol=1e-15)
        assert made.gyro(name).kind == kind
    path, _ = write(config, tmp_path / "unit.parquet")
    back = sagnac.read(path)
    for one in (*made.gyros, *made.accelerometers):
        read = {each.name: each for each in (*back.gyros, *back.accelerometers)}[one.name]
        assert (read.kind, read.sensor) == (kind, one.sensor)
        np.testing.assert_allclose(read.values, one.values, rtol=1e-12, atol=1e-18)


def test_accelerometers_at_rest_show_gravity_and_their_noise():
    made = simulate(UNIT).recording
    means = np.array([one.values.mean() for one in made.accelerometers])
    assert np.linalg.norm(means) == pytest.approx(9.80665, rel=1e-4)
    for share, one in zip((1.0, 2.0, 3.0), made.accelerometers, strict=True):
        # White acceleration of N varies by N^2 times the rate.
        wanted = share * 0.01 / 60.0 * math.sqrt(50.0)
        assert one.values.std() == pytest.approx(wanted, rel=0.02)


@pytest.mark.parametrize("which", ["", "second_"])
def test_a_markov_rate_has_its_deviation_and_its_time(which):
    config = replace(
        UNIT,
        duration_s=40_000.0,
        sample_rate_hz=1.0,
        gyro=GyroConfig(
            arw_deg_per_sqrt_h=0.0,
            quantization_step_arcsec=0.0,
            **{f"{which}markov_deviation_deg_per_h": 10.0, f"{which}markov_time_s": 50.0},
        ),
        accelerometer=AccelerometerConfig(),
    )
    rate = simulate(config).recording.gyro("x").values
    rate = (rate - rate.mean()) * 180.0 / math.pi * 3600.0
    # 400 correlation times: the variance to 7 %.
    assert rate.std() == pytest.approx(10.0, rel=0.1)
    lagged = float(np.mean(rate[50:] * rate[:-50])) / rate.var()
    assert lagged == pytest.approx(math.exp(-1.0), abs=0.08)


def test_a_unit_like_it_is_measured_like_it():
    def measured(config):
        """Of the first gyro and the first accelerometer alone, since each takes its time."""
        made = simulate(config).recording
        one = replace(made, gyros=made.gyros[:1], accelerometers=made.accelerometers[:1])
        found = sagnac.analyze(one)
        return found, found.accelerometers["ax"]

    first = measured(replace(UNIT, duration_s=200.0))
    again = measured(replace(RigConfig.from_analysis(first[0]), seed=2))
    for one, other in zip(first, again, strict=True):
        walk = other.angle_random_walk
        assert walk.low < one.angle_random_walk.value < walk.high


@pytest.mark.parametrize("order", [1, 2])
def test_the_low_pass_that_a_spectrum_shows_is_simulated_again(order):
    """20 and 8 Hz at 100 Hz; the gyro z has none."""
    gyro = replace(UNIT.gyro, angle_noise_arcsec=(0.0,) * 3, low_pass_hz=(20.0, 8.0, 0.0))
    unit = replace(
        UNIT,
        duration_s=300.0,
        sample_rate_hz=100.0,
        gyro=replace(gyro, low_pass_order=order),
        accelerometer=AccelerometerConfig(),
    )
    analysis = sagnac.analyze(simulate(unit).recording, method="none")
    again = RigConfig.from_analysis(analysis)
    assert again.gyro.low_pass_hz == pytest.approx((20.0, 8.0, 0.0), rel=0.05)
    assert (again.gyro.low_pass_order, again.kind) == (order, "rate")
    said = Measured.of_document(json.loads(analysis.to_json())).left_out()
    assert sum("low-pass of" in line for line in said) == 2
    assert any(line.startswith("x: low-pass of ") for line in said)


@pytest.mark.parametrize("order", [1, 2])
def test_an_analogue_low_pass_has_its_corner_and_its_order(order):
    """30 Hz at 200 Hz: it was read as 50 Hz of first order, and as 20 Hz of first order."""
    rate, fine, samples = 200.0, 8, 60_000
    white = 100.0 * np.random.default_rng(5).standard_normal(samples * fine)
    passed = lfilter(*butter(order, 30.0, fs=rate * fine), white).reshape(samples, fine)
    recording = sagnac.Recording.from_arrays(
        x=passed.mean(axis=1), kind="rate", unit="deg/h", sample_rate=rate
    )
    again = RigConfig.from_analysis(sagnac.analyze(recording, method="none")).gyro
    assert again.low_pass_hz[0] == pytest.approx(30.0, rel=0.15)
    assert again.low_pass_order == order


def test_steps_behind_a_low_pass_leave_its_corner_and_its_order():
    """Steps of 0.7 of the scatter are level up to half the sample rate, and no weaker filter."""
    unit = replace(
        UNIT,
        duration_s=300.0,
        sample_rate_hz=100.0,
        gyro=GyroConfig(
            arw_deg_per_sqrt_h=0.1,
            quantization_step_arcsec=0.0,
            rate_step_deg_per_h=30.0,
            low_pass_hz=20.0,
            low_pass_order=2,
        ),
        accelerometer=AccelerometerConfig(),
    )
    made = simulate(unit).recording
    analysis = sagnac.analyze(replace(made, gyros=made.gyros[:1]), method="none")
    again = RigConfig.from_analysis(analysis).gyro
    assert again.low_pass_hz[0] == pytest.approx(20.0, rel=0.05)
    assert again.low_pass_order == 2
    assert again.arw_deg_per_sqrt_h[0] == pytest.approx(0.1, rel=0.04)


def stepped(kind, step):
    """Gyros with readout steps of the rate or of the angle, and accelerometers likewise."""
    rate, angle = (step, 0.0) if kind == "rate" else (0.0, step)
    return replace(
        UNIT,
        duration_s=100.0,
        kind=kind,
        gyro=GyroConfig(
            arw_deg_per_sqrt_h=0.15, rate_step_deg_per_h=rate, quantization_step_arcsec=angle
        ),
        accelerometer=AccelerometerConfig(
            mode="triad",
            vrw_m_per_s_per_sqrt_h=0.06,
            acceleration_step_mg=0.02 * rate,
            quantization_step_mm_per_s=0.02 * angle,
        ),
    )


@pytest.mark.parametrize(
    ("kind", "step"), [("rate", 27.5), ("angle", 2.0), ("increment", 2.0), ("rate", 0.0)]
)
def test_the_step_that_the_samples_show_is_simulated_again(kind, step):
    """Beside it a unit without one, of which nothing is said."""
    made = simulate(stepped(kind, step)).recording
    made = replace(made, gyros=made.gyros[:1], accelerometers=made.accelerometers[:1])
    first = sagnac.analyze(made, method="none")
    document = json.loads(first.to_json())
    again = RigConfig.from_analysis(document)
    wanted = stepped(kind, step)
    for key in ("rate_step_deg_per_h", "quantization_step_arcsec"):
        assert getattr(again.gyro, key) == pytest.approx(getattr(wanted.gyro, key), rel=1e-6)
    for key in ("acceleration_step_mg", "quantization_step_mm_per_s"):
        found = getattr(again.accelerometer, key)
        assert found == pytest.approx(getattr(wanted.accelerometer, key), rel=1e-6)
    said = [line for line in Measured.of_document(document).left_out() if "readout" in line]
    assert len(said) == (2 if step else 0)
    # What the steps add is in the N that was measured, and not added once more.
    added = again.gyro.rate_step_deg_per_h[0] / 60.0 / math.sqrt(12.0 * 50.0)
    measured = first.angle_random_walk.to("deg/sqrt(h)").value
    assert math.hypot(again.gyro.arw_deg_per_sqrt_h[0], added) == pytest.approx(measured)
    shown = step_shown(simulate(replace(again, seed=9)).recording.gyros[0])
    assert shown == pytest.approx(step_shown(made.gyros[0]), rel=1e-6)


def test_a_pair_on_a_table_has_the_step_of_its_gyros():
    document = json.loads(to_json(analysis_document(analysis(gyros=("x", "z")))))
    assert RigConfig.from_analysis(document).gyro.quantization_step_arcsec == (0.0,) * 3
    shown = {"step": 5e-4, "unit": "arcsec"}
    document["readout"] = {"x": shown, "z": shown}
    made = RigConfig.from_analysis(document).gyro
    assert made.quantization_step_arcsec == pytest.approx((5e-4,) * 3)
    # Q of 3e-4 arcsec is more than the step makes.
    assert made.angle_noise_arcsec == pytest.approx((math.sqrt(9e-8 - 25e-8 / 12.0),) * 3)
    said = [line for line in Measured.of_document(document).left_out() if "readout" in line]
    assert said == ["x-z: readout step of 0.0005 arcsec"]


def test_a_rate_with_less_noise_than_its_steps_would_make_is_a_counted_angle():
    """Rates of 50 Hz in steps of 100 deg/h are 2 arcsec a sample, and 4 deg/h/sqrt(Hz) if lost."""
    for walk, by_rate in ((0.01, False), (1.0, True)):
        unit = Measured(
            sensors={
                "gyro": {
                    "x": MeasuredSensor(
                        coefficients={"angle_random_walk": walk, "quantization": 0.7},
                        readout={"step": 100.0, "unit": "deg/h"},
                    )
                }
            },
            recorded={"sample_rate_hz": 50.0, "duration_s": 60.0, "kind": "rate"},
        )
        gyro = RigConfig.from_mapping(unit.keys()).gyro
        assert gyro.rate_step_deg_per_h[0] == (100.0 if by_rate else 0.0)
        assert gyro.quantization_step_arcsec[0] == pytest.approx(0.0 if by_rate else 2.0)
        left = 0.7 if by_rate else math.sqrt(0.49 - 4.0 / 12.0)
        assert gyro.angle_noise_arcsec[0] == pytest.approx(left)
        added = 100.0 / 60.0 / math.sqrt(12.0 * 50.0) if by_rate else 0.0
        assert math.hypot(gyro.arw_deg_per_sqrt_h[0], added) == pytest.approx(walk)


def test_the_range_at_whose_ends_samples_pile_up_is_simulated_again():
    """A bias near the end of the range, and the same unit without a range."""
    unit = replace(stepped("rate", 5.0), accelerometer=AccelerometerConfig())
    for reach in (550.0 * 5.0, 0.0):
        gyro = replace(unit.gyro, bias_deg_per_h=(2_600.0,) * 3, range_deg_per_h=(reach,) * 3)
        made = simulate(replace(unit, gyro=gyro)).recording
        assert np.abs(made.gyros[0].values).max() * 206264.8 <= (reach or math.inf) * 1.001
        first = sagnac.analyze(replace(made, gyros=made.gyros[:1]), method="none")
        assert any(note.name == "clipping" for note in first.findings) == bool(reach)
        again = RigConfig.from_analysis(first)
        assert again.gyro.range_deg_per_h == pytest.approx((reach,) * 3, rel=1e-6)


@pytest.mark.parametrize(("deviation", "time"), [(10.0, 30.0), (0.0, 30.0)])
def test_a_markov_rate_that_the_spectrum_shows_is_simulated_again(deviation, time):
    """Beside it a unit without one, of which nothing is said."""
    unit = RigConfig(
        duration_s=7200.0,
        sample_rate_hz=5.0,
        kind="rate",
        table=STILL,
        gyro=GyroConfig(
            arw_deg_per_sqrt_h=0.1,
            quantization_step_arcsec=0.0,
            markov_deviation_deg_per_h=deviation,
            markov_time_s=time,
        ),
    )
    made = simulate(unit).recording
    first = sagnac.analyze(replace(made, gyros=made.gyros[:1]), method="none")
    again = RigConfig.from_analysis(first)
    said = Measured.of_document(json.loads(first.to_json())).left_out()
    noted = [note.text for note in first.notes if note.text.startswith("slow noise: a Markov")]
    assert len(noted) == any("Markov rate" in line for line in said) == (deviation > 0.0)
    assert again.gyro.markov_deviation_deg_per_h[0] == pytest.approx(deviation, rel=0.15)
    if deviation:
        assert again.gyro.markov_time_s[0] == pytest.approx(time, rel=0.3)
    curves = [
        sagnac.stability_curve(gyro.values, kind="rate", sample_rate=5.0).deviation
        for gyro in simulate(replace(again, seed=5)).recording.gyros
    ]
    seen = first.curve.tau < 200.0
    ratio = np.sqrt(np.mean(np.square(curves), axis=0)) / first.curve.deviation
    assert np.abs(ratio[seen] - 1.0).max() < 0.25


def test_two_markov_rates_go_from_the_note_through_the_document_to_the_rig(tmp_path):
    """Eight hours, a recording in which neither B nor K is estimated."""
    gyro = GyroConfig(
        arw_deg_per_sqrt_h=0.1,
        quantization_step_arcsec=0.0,
        markov_deviation_deg_per_h=15.0,
        markov_time_s=4.0,
        second_markov_deviation_deg_per_h=25.0,
        second_markov_time_s=100.0,
    )
    unit = RigConfig(
        duration_s=28_800.0, sample_rate_hz=2.0, kind="rate", seed=2, table=STILL, gyro=gyro
    )
    made = simulate(unit).recording
    first = sagnac.analyze(replace(made, gyros=made.gyros[:1]), method="none")
    (said,) = (note.text for note in first.notes if note.text.startswith("slow noise"))
    assert said.count("a Markov rate of") == 2
    assert said.endswith("describe it together; B and K are bounds")
    first.to_json(tmp_path / "analysis.json")
    again = RigConfig.from_analysis(sagnac.Analysis.from_json(tmp_path / "analysis.json")).gyro
    for key, precision in (("deviation_deg_per_h", 0.1), ("time_s", 0.25)):
        for which in ("markov", "second_markov"):
            found, wanted = (getattr(one, f"{which}_{key}")[0] for one in (again, gyro))
            assert found == pytest.approx(wanted, rel=precision)


def test_two_markov_rates_of_an_analysis_are_the_keys_of_both():
    unit = Measured(
        sensors={
            "gyro": {
                "x": MeasuredSensor(
                    coefficients={"angle_random_walk": 0.1}, markov=((15.0, 4.0), (25.0, 100.0))
                ),
                "z": MeasuredSensor(coefficients={"angle_random_walk": 0.2}, markov=((7.0, 30.0),)),
            }
        },
        recorded={"sample_rate_hz": 2.0, "duration_s": 100.0},
    )
    gyro = RigConfig.from_mapping(unit.keys()).gyro
    assert gyro.markov_deviation_deg_per_h == (15.0, 15.0, 7.0)
    assert gyro.markov_time_s == (4.0, 4.0, 30.0)
    assert gyro.second_markov_deviation_deg_per_h == (25.0, 25.0, 0.0)
    assert gyro.second_markov_time_s[:2] == (100.0, 100.0)
    assert sum("Markov rate of" in line for line in unit.left_out()) == 3


SEEDS = 200


def again_like(first, seed):
    """One gyro and the accelerometer along it, by turns, of a unit like the first."""
    made, axis = simulate(replace(first, seed=seed)).recording, seed % 3
    one = replace(
        made,
        gyros=made.gyros[axis : axis + 1],
        accelerometers=made.accelerometers[axis : axis + 1],
    )
    return axis, sagnac.analyze(one)


def levels(spectrum, duration):
    """Mean density of each half decade above 1/200 Hz, and its relative error by chance."""
    edges = np.geomspace(0.005, spectrum.frequency[-1], 8)
    place = np.digitize(spectrum.frequency, edges)
    width = np.gradient(spectrum.frequency)
    means = [
        np.average(spectrum.density[place == band], weights=width[place == band])
        for band in range(1, edges.size)
    ]
    return np.array(means), 1.0 / np.sqrt(duration * np.diff(edges))


@pytest.mark.statistics
def test_each_coefficient_measured_again_holds_the_first():
    """Six axes of 40 minutes with Q, N, B and K, by their own simulator, two hundred times."""
    unit = replace(
        UNIT,
        duration_s=2400.0,
        sample_rate_hz=20.0,
        gyro=replace(UNIT.gyro, bias_instability_deg_per_h=(5.0, 10.0, 0.0)),
        accelerometer=replace(UNIT.accelerometer, bias_instability_mg=(0.02, 0.0, 0.06)),
    )
    measured = sagnac.analyze(simulate(unit).recording)
    first = RigConfig.from_analysis(measured)
    keys = {"gyro": COEFFICIENT_UNITS, "accelerometer": FORCE_COEFFICIENT_UNITS}
    truth = {
        "gyro": {
            "quantization": first.gyro.angle_noise_arcsec,
            "angle_random_walk": first.gyro.arw_deg_per_sqrt_h,
            "bias_instability": first.gyro.bias_instability_deg_per_h,
            "rate_random_walk": first.gyro.rate_random_walk_deg_per_h_per_sqrt_h,
        },
        "accelerometer": {
            "quantization": first.accelerometer.velocity_noise_mm_per_s,
            "angle_random_walk": first.accelerometer.vrw_m_per_s_per_sqrt_h,
            "bias_instability": first.accelerometer.bias_instability_mg,
            "rate_random_walk": first.accelerometer.acceleration_random_walk_mg_per_sqrt_h,
        },
    }
    held: dict[str, list[bool]] = {}
    spectra: dict[int, list[np.ndarray]] = {0: [], 1: [], 2: []}
    for seed in range(100, 100 + SEEDS):
        axis, again = again_like(first, seed)
        spectra[axis].append(levels(again.spectrum, 2400.0)[0])
        (force,) = again.accelerometers.values()
        for sensor, one in (("gyro", again), ("accelerometer", force)):
            beside = {**one.coefficients, "angle_random_walk": one.angle_random_walk}
            for name, values in truth[sensor].items():
                value = values[axis] * next(iter(keys[sensor][name].values()))
                found = beside[name]
                if value > 0.0 and found.status != "not observable":
                    inside = found.low <= value <= found.high
                    held.setdefault(f"{sensor} {name}", []).append(inside)
    shares = {name: np.mean(one) for name, one in held.items()}
    print({name: (round(share, 3), len(held[name])) for name, share in shares.items()})
    for axis, one in enumerate(measured.gyros.values()):
        wanted, chance = levels(one.spectrum, 2400.0)
        ratio = np.mean(spectra[axis], axis=0) / wanted
        print(one.channel, ratio.round(3).tolist())
        assert np.all(np.abs(ratio - 1.0) < 0.03 + 3.0 * chance), one.channel
    for name, share in shares.items():
        assert share >= 0.93, name
