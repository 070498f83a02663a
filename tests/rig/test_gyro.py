"""Each term of the gyros has the size that the configuration states."""

import math
from dataclasses import replace

import numpy as np
import pytest

from sagnac.noise.laws import markov_allan_variance
from sagnac.rig.config import RigConfig
from sagnac.rig.gyro import SensorErrors, SlowDrift
from sagnac.rig.ring_laser import dither_of, ring_lasers_of
from sagnac.rig.sections import GyroConfig, TableConfig
from sagnac.rig.simulate import blocks
from sagnac.rig.truth import truth_of
from tests.rig.rigs import (
    ARCSEC,
    DEG,
    NOISELESS,
    NONE,
    at_rest,
    configured,
    from_first,
    geometry,
    triad,
)


def allan_variance(angle, samples, sample_rate):
    """Overlapping, from its definition."""
    second = angle[2 * samples :] - 2.0 * angle[samples:-samples] + angle[: -2 * samples]
    tau = samples / sample_rate
    return np.mean(second**2) / (2.0 * tau**2)


def test_angle_random_walk_of_each_gyro():
    values = (1e-3, 2e-3, 4e-3)
    gyro = GyroConfig(arw_deg_per_sqrt_h=values, quantization_step_arcsec=NONE)
    angle = triad(at_rest(gyro, 20_000.0))
    step = np.diff(angle, axis=1)
    measured = step.std(axis=1) * math.sqrt(10.0) / (DEG / 60)
    np.testing.assert_allclose(measured, values, rtol=4 / math.sqrt(2 * step.shape[1]))
    correlation = np.corrcoef(step)
    assert np.abs(correlation - np.eye(3)).max() < 4 / math.sqrt(step.shape[1])


def test_quantization_is_uniform_with_the_truth_of_its_step():
    gyro = GyroConfig(arw_deg_per_sqrt_h=(1.0,) * 3, quantization_step_arcsec=(0.5, 0.2, 0.0))
    config = at_rest(gyro, 5_000.0)
    exact = triad(replace(config, gyro=replace(gyro, quantization_step_arcsec=NONE)))
    error = (triad(config) - exact) / ARCSEC
    truth = truth_of(config)
    for g, (name, step) in enumerate(zip("xyz", (0.5, 0.2, 0.0), strict=True)):
        assert np.abs(error[g]).max() <= 0.5 * step + 1e-9
        assert error[g].std() == pytest.approx(truth.gyros[name].quantization_arcsec, rel=0.02)


@pytest.mark.parametrize("rate", [10.0, 400.0])
def test_bias_instability_makes_its_allan_floor(rate):
    """sigma = B sqrt(2 ln 2 / pi), at cluster times from one sample to a thousand."""
    gyro = replace(NOISELESS, bias_instability_deg_per_h=(1.0, 2.0, 0.5))
    angle = triad(at_rest(gyro, 1_000_000.0 / rate, rate))
    for samples in (1, 2, 5, 30, 100, 300, 1000):
        relative = [
            math.sqrt(allan_variance(angle[g], samples, rate)) / (value * DEG / 3600)
            for g, value in enumerate((1.0, 2.0, 0.5))
        ]
        floor = math.sqrt(np.mean(np.square(relative)))
        assert floor == pytest.approx(math.sqrt(2 * math.log(2) / math.pi), rel=0.04)


def test_rate_random_walk_makes_its_allan_slope():
    """sigma^2 = K^2 tau / 3."""
    gyro = replace(NOISELESS, rate_random_walk_deg_per_h_per_sqrt_h=(1.0, 1.0, 1.0))
    angle = triad(at_rest(gyro, 100_000.0))
    for samples in (1, 3, 30, 100, 300):
        variance = np.mean([allan_variance(a, samples, 10.0) for a in angle])
        unit = DEG / 3600 / 60
        assert variance / (unit**2 * samples / 10.0 / 3.0) == pytest.approx(1.0, rel=0.05)


def test_a_markov_rate_makes_its_allan_variance():
    """One as short as two samples, too."""
    gyro = replace(
        NOISELESS, markov_deviation_deg_per_h=(1.0, 1.0, 1.0), markov_time_s=(0.2, 1.0, 20.0)
    )
    angle = triad(at_rest(gyro, 20_000.0))
    unit = DEG / 3600
    for samples in (1, 3, 30, 100):
        for time, one in zip(gyro.markov_time_s, angle, strict=True):
            law = markov_allan_variance(samples / 10.0, unit * math.sqrt(2.0 / time), time)
            # The record has a thousand of the longest correlation times.
            assert allan_variance(one, samples, 10.0) / law == pytest.approx(1.0, rel=0.1)


def test_deterministic_errors():
    gyro = replace(
        NOISELESS,
        bias_deg_per_h=(0.3, 0.0, 0.0),
        rate_ramp_deg_per_h_per_h=(0.0, 2.0, 0.0),
        temperature_coefficient_deg_per_h_per_k=(0.0, 0.0, 0.1),
        warm_up_k=5.0,
        warm_up_time_s=200.0,
    )
    config = at_rest(gyro, 1000.0)
    added = from_first(triad(config)) - from_first(triad(replace(config, gyro=NOISELESS)))
    time = np.arange(config.samples) / 10.0
    per_hour = DEG / 3600
    np.testing.assert_allclose(added[0], 0.3 * per_hour * time, atol=1e-15)
    np.testing.assert_allclose(added[1], 2.0 * per_hour / 3600 * time**2 / 2, atol=1e-12)
    warming = 0.1 * per_hour * 5.0 * (time - 200.0 * (1 - np.exp(-time / 200.0)))
    np.testing.assert_allclose(added[2], warming, atol=1e-12)


def test_a_still_ring_laser_shows_no_earth_rate():
    gyro = GyroConfig(mode="still")
    config = at_rest(gyro, 50.0)
    assert np.ptp(triad(config)) == 0.0
    assert truth_of(config).gyros["x"].arw_deg_per_sqrt_h == 0.0
    assert np.ptp(triad(replace(config, gyro=replace(gyro, mode="ideal")))) > 100 * ARCSEC


def test_dithered_mode_has_the_random_walk_of_its_turn_rounds():
    gyro = GyroConfig(mode="dithered", quantization_step_arcsec=NONE)
    config = at_rest(gyro, 4000.0)
    step = np.diff(triad(config), axis=1)
    measured = step.std(axis=1) * math.sqrt(10.0) / (DEG / 60)
    lock_in = np.array(gyro.lock_in_deg_per_h) / 3600
    kicks = 60 * lock_in * math.sqrt(1.5 / 3600 / (2 * math.pi * 100.0))
    expected = np.hypot(kicks, 2.5e-5)
    np.testing.assert_allclose(measured, expected, rtol=4 / math.sqrt(2 * step.shape[1]))
    truth = truth_of(config)
    np.testing.assert_allclose(
        [truth.gyros[name].arw_deg_per_sqrt_h for name in "xyz"], expected, rtol=1e-6
    )
    assert truth.pairs["x-z"].arw_deg_per_sqrt_h == pytest.approx(
        math.sqrt((expected[0] ** 2 + expected[2] ** 2) / 2), rel=1e-6
    )


def test_rate_biased_mode_has_scale_factor_and_noise_of_its_rate():
    gyro = GyroConfig(mode="rate-biased", quantization_step_arcsec=NONE)
    config = replace(
        configured(gyro=gyro, duration_s=2000.0, sample_rate_hz=20.0),
        table=TableConfig(rate_deg_per_s=5.0),
    )
    ideal = replace(config, gyro=NOISELESS)
    lost = triad(config) - triad(ideal)
    shares, eta = geometry(config)
    lock_in = np.array(gyro.lock_in_deg_per_h) * DEG / 3600
    sensed = shares * (5.0 * DEG + eta[2])
    truth = truth_of(config)
    noise = np.array([truth.gyros[name].arw_deg_per_sqrt_h for name in "xyz"]) * DEG / 60
    drift = (lost[:, -1] - lost[:, 0]) / 2000.0
    nonlinear = -0.5 * lock_in**2 / sensed
    np.testing.assert_array_less(np.abs(drift - nonlinear), 4 * noise / math.sqrt(2000.0))
    assert np.all(np.abs(nonlinear) > 10 * noise / math.sqrt(2000.0))

    step = np.diff(lost, axis=1)
    measured = step.std(axis=1) * math.sqrt(20.0)
    np.testing.assert_allclose(measured, noise, rtol=4 / math.sqrt(2 * step.shape[1]))
    fringe = 1.5 * ARCSEC
    scatter = lock_in * math.sqrt(150.0) * fringe / (2 * math.pi) / sensed
    np.testing.assert_allclose(noise, np.hypot(scatter, 2.5e-5 * DEG / 60), rtol=1e-3)


# --- the parts by themselves -----------------------------------------------------------------


def test_lasers_and_dither_are_those_of_the_mode():
    assert ring_lasers_of(GyroConfig()) == ()
    assert len(ring_lasers_of(GyroConfig(mode="still"))) == 3
    assert dither_of(GyroConfig(mode="rate-biased")) is None
    assert dither_of(GyroConfig(mode="dithered")).frequency == 400.0


@pytest.mark.parametrize("pieces", [1, 3, 50])
def test_slow_drift_holds_each_value_across_blocks(pieces):
    config = GyroConfig(
        arw_deg_per_sqrt_h=0.1,
        bias_instability_deg_per_h=1.0,
        rate_random_walk_deg_per_h_per_sqrt_h=1.0,
    )
    drift, values = drifted(config, pieces)
    assert drift.hold == 10
    held = values[:100].reshape(10, 10)
    assert np.all(held == held[:, :1])
    assert np.unique(values).size == 11


@pytest.mark.parametrize("slow", ["bias_instability_deg_per_h", "markov_deviation_deg_per_h"])
def test_slow_drift_that_white_noise_does_not_hide_is_not_held(slow):
    """Each sample has its own, the same whatever the blocks."""
    config = replace(GyroConfig(arw_deg_per_sqrt_h=1e-3), **{slow: (1.0,) * 3})
    drift, values = drifted(replace(config, markov_time_s=(0.1,) * 3), 1)
    assert drift.hold == 1
    assert np.unique(values).size == values.size
    _, parted = drifted(replace(config, markov_time_s=(0.1,) * 3), 7)
    np.testing.assert_array_equal(parted, values)


def drifted(config, pieces):
    """The drift of gyro x at 500 Hz, and 101 values of it in some pieces."""
    rig = RigConfig(duration_s=60.0, sample_rate_hz=500.0)
    drift = SlowDrift(SensorErrors.of(config, 0), rig, np.random.default_rng(5))
    parts = np.array_split(np.arange(101), pieces)
    return drift, np.concatenate([drift.advance(int(p[0]), p.size) for p in parts])


def test_trend_is_bias_ramp_and_warming():
    errors = replace(
        SensorErrors.of(GyroConfig(), 0),
        bias=1.0, ramp=2.0, per_kelvin=3.0, warm_up=4.0, warm_up_time=5.0,
    )  # fmt: skip
    drift = errors.trend(np.array([-0.5, 0.0, 5.0]))
    expected = [0.0, 1.0, 1.0 + 10.0 + 12.0 * (1.0 - math.exp(-1.0))]
    np.testing.assert_allclose(drift, expected, rtol=1e-12, atol=1e-15)


# --- the sensor's own low-pass ----------------------------------------------------------------


@pytest.mark.parametrize("order", [1, 2])
def test_a_low_pass_has_the_response_of_its_order(order):
    """|H|^2 = 1/(1 + w^(2 order)) with w the ratio of tangents that the bilinear map makes."""
    plain = GyroConfig(arw_deg_per_sqrt_h=(1.0,) * 3, quantization_step_arcsec=NONE)
    passed = replace(plain, low_pass_hz=(1.0, 2.0, 0.0), low_pass_order=order)
    before, after = (
        np.fft.rfft(np.diff(triad(at_rest(gyro, 4_000.0)), axis=1) * np.hanning(39_999))
        for gyro in (plain, passed)
    )
    frequency = np.fft.rfftfreq(39_999, 0.1)
    np.testing.assert_array_equal(after[2], before[2])
    for gyro, corner in ((0, 1.0), (1, 2.0)):
        for wanted in (0.1, corner, 2.0 * corner):
            near = np.abs(frequency - wanted) < 0.01
            ratio = np.sum(np.abs(after[gyro][near]) ** 2) / np.sum(np.abs(before[gyro][near]) ** 2)
            tangents = math.tan(math.pi * wanted / 10.0) / math.tan(math.pi * corner / 10.0)
            assert ratio == pytest.approx(1.0 / (1.0 + tangents ** (2 * order)), rel=0.03)


def test_a_low_pass_passes_a_steady_rate_from_the_first_sample_on():
    """Only what turns with the table, the Earth's 15 deg/h, lags by up to the time constant."""
    gyro = replace(NOISELESS, low_pass_hz=(2.0, 2.0, 2.0))
    table = TableConfig(rate_deg_per_s=10.0)
    plain, passed = (triad(configured(table=table, gyro=each)) for each in (NOISELESS, gyro))
    time_constant = 1.0 / (2.0 * math.pi * 2.0)
    np.testing.assert_allclose(passed, plain, rtol=0.0, atol=2.0 * 15.0 * ARCSEC * time_constant)


def test_the_truth_states_the_low_pass():
    config = configured(gyro=replace(NOISELESS, low_pass_hz=(50.0, 10.0, 0.0)))
    assert truth_of(config).low_pass_hz == {"x": 50.0, "y": 10.0, "z": 0.0}
    with pytest.raises(ValueError, match=r"gyro\.low_pass_hz 250 is not below 250 Hz"):
        configured(gyro=replace(NOISELESS, low_pass_hz=(250.0, 0.0, 0.0)))


# --- the readout of a rate ------------------------------------------------------------------


def test_a_rate_is_shown_in_whole_steps_within_its_range_and_what_is_lost_is_lost():
    """Steps of 0.8 of the scatter, and the same gyro without: white errors that add up."""
    rate, step, limit = 10.0, 20.0, 45.0
    plain = GyroConfig(
        arw_deg_per_sqrt_h=25.0 / 60.0 / math.sqrt(rate), quantization_step_arcsec=NONE
    )
    true = np.diff(triad(at_rest(plain, 4_000.0)), axis=1) * rate / (DEG / 3600.0)
    coarse = replace(
        plain, rate_step_deg_per_h=(step, step, 0.0), range_deg_per_h=(0.0, limit, limit)
    )
    angles = triad(at_rest(coarse, 4_000.0))
    shown = np.diff(angles, axis=1) * rate / (DEG / 3600.0)
    np.testing.assert_allclose(shown[0], step * np.rint(true[0] / step), atol=1e-6)
    np.testing.assert_allclose(
        shown[1], step * np.rint(np.clip(true[1], -limit, limit) / step), atol=1e-6
    )
    np.testing.assert_allclose(shown[2], np.clip(true[2], -limit, limit), atol=1e-6)
    error = shown[0] - true[0]
    assert error.var() == pytest.approx(step**2 / 12.0, rel=0.03)
    # White: over a hundred samples it is a hundredth.
    assert error[:39_900].reshape(-1, 100).mean(axis=1).var() == pytest.approx(
        step**2 / 1200.0, rel=0.25
    )
    short = at_rest(coarse, 30.0)
    parts = [columns for columns, _ in blocks(short, 77)]
    pieces = [np.concatenate([part[name] for part in parts]) for name in "xyz"]
    np.testing.assert_array_equal(pieces, triad(short))
