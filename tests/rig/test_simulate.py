"""The rig against what it says it simulates, by means that are not its own."""

import ast
import json
import math
import tracemalloc
from dataclasses import asdict, replace
from functools import reduce
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import cumulative_simpson
from scipy.interpolate import CubicSpline

import sagnac
from sagnac import formats
from sagnac.errors import RecordingError
from sagnac.rig.config import RigConfig, keys, preset
from sagnac.rig.sections import (
    ChoiceKey,
    DisturbanceConfig,
    EncoderConfig,
    GyroConfig,
    Key,
    PlatformConfig,
    TableConfig,
)
from sagnac.rig.simulate import blocks, simulate, write
from sagnac.rig.truth import truth_of
from sagnac.table.earth import earth_rate
from sagnac.table.frames import ideal_angle, shares_from_deviations, table_to_gyro_matrix

ARCSEC = math.pi / 648_000
DEG = math.pi / 180
NONE = (0.0, 0.0, 0.0)
NOISELESS = GyroConfig(arw_deg_per_sqrt_h=NONE, quantization_step_arcsec=NONE)
AT_REST = TableConfig(rate_deg_per_s=0.0)


def configured(**changes):
    """A noiseless rig at constant rate, short enough for a test, with changes."""
    return replace(
        RigConfig(
            duration_s=40.0,
            gyro=NOISELESS,
            platform=PlatformConfig(share_deviation=(0.001, 0.0, -0.001), heading_deg=20.0),
        ),
        **changes,
    )


def triad(config):
    return np.array([gyro.values for gyro in simulate(config).recording.gyros])


def true_table_angle(config):
    return np.concatenate([block.table_angle for block in blocks(config)])


def geometry(config):
    shares = shares_from_deviations(config.platform.share_deviation)
    earth = earth_rate(config.platform.latitude_deg * DEG, config.platform.heading_deg * DEG)
    return shares, earth


def from_first(angle):
    return angle - angle[..., :1]


# --- kinematics ------------------------------------------------------------------------------


@pytest.mark.parametrize(("rate", "sample_rate"), [(40.0, 500.0), (-80.0, 500.0), (40.0, 2.0)])
def test_kinematics_agree_with_eq_6_at_constant_rate(rate, sample_rate):
    config = configured(
        sample_rate_hz=sample_rate, table=TableConfig(rate_deg_per_s=rate, start_deg=10.0)
    )
    time = np.arange(config.samples) / sample_rate
    alpha = 10.0 * DEG + rate * DEG * time
    np.testing.assert_allclose(true_table_angle(config), alpha, atol=1e-12)
    expected = ideal_angle(time, alpha, rate * DEG, *geometry(config))
    difference = from_first(triad(config)) - from_first(expected)
    assert np.abs(difference).max() < 1e-6 * ARCSEC


def integrated_along(config, alpha, oversampling=16):
    """Eq. 4 along a table motion known at the samples, on a finer grid, by quadrature."""
    time = np.arange(alpha.size) / config.sample_rate_hz
    fine_time = np.linspace(0.0, time[-1], (alpha.size - 1) * oversampling + 1)
    fine = CubicSpline(time, alpha)(fine_time)
    shares, eta = geometry(config)
    matrix = table_to_gyro_matrix(*shares)
    along_b = np.array(
        [
            eta[0] * np.cos(fine) + eta[1] * np.sin(fine),
            eta[1] * np.cos(fine) - eta[0] * np.sin(fine),
            np.full(fine.size, eta[2]),
        ]
    )
    turned = cumulative_simpson(along_b, x=fine_time, initial=0.0)[:, ::oversampling]
    turned[2] += alpha - alpha[0]
    return matrix @ turned


@pytest.mark.parametrize(
    "table",
    [
        TableConfig(jitter_rms_deg_per_s=0.02, ripple=((12.0, 0.01), (36.0, 0.005))),
        TableConfig(reversal_interval_s=7.0, wander_fraction=0.02, wander_time_s=5.0),
        TableConfig(profile=((0.0, 0.0), (10.0, 60.0), (30.0, -20.0))),
    ],
    ids=["jitter and ripple", "wander and reversals", "profile"],
)
def test_kinematics_agree_with_quadrature_where_the_rate_varies(table):
    config = configured(table=table)
    expected = integrated_along(config, true_table_angle(config))
    assert np.abs(from_first(triad(config)) - expected).max() < 2e-6 * ARCSEC


def departure_from_eq_6(fraction):
    config = configured(duration_s=90.0, table=TableConfig(ripple=((12.0, fraction),)))
    time = np.arange(config.samples) / config.sample_rate_hz
    alpha = true_table_angle(config)
    expected = ideal_angle(time, alpha, 40.0 * DEG, *geometry(config))
    return (from_first(triad(config)) - from_first(expected)) / ARCSEC


def test_departure_from_eq_6_grows_with_the_variation_of_the_rate():
    """To first order in a ripple r at order m, Eq. 6 is off by beats of order m +- 1.

    dt = (d alpha / Omega)(1 - r cos(m alpha + p)), so that each order-1 term k of the sensed
    rate leaves angle harmonics of amplitude k r / (2 Omega (m +- 1)).
    """
    weak, strong = departure_from_eq_6(0.001), departure_from_eq_6(0.002)
    np.testing.assert_allclose(strong, 2.0 * weak, atol=0.01 * np.abs(strong).max())

    config = configured()
    shares, eta = geometry(config)
    matrix = table_to_gyro_matrix(*shares)
    strength = np.hypot(
        matrix[:, 0] * eta[0] + matrix[:, 1] * eta[1], matrix[:, 0] * eta[1] - matrix[:, 1] * eta[0]
    )
    alpha = 40.0 * DEG * np.arange(weak.shape[1]) / config.sample_rate_hz
    for order in (11, 13):
        measured = 2.0 * np.abs((weak - weak.mean(axis=1)[:, None]) @ np.exp(-1j * order * alpha))
        predicted = strength * 0.001 / (2.0 * 40.0 * DEG * order) / ARCSEC
        np.testing.assert_allclose(measured / alpha.size, predicted, rtol=0.01)


def test_wobble_tilts_the_sensed_axes():
    """Order 2 wobble a: the shaft's tilting is seen once a turn, with amplitude 2 a."""
    still = triad(configured())
    wobbling = triad(configured(table=TableConfig(wobble=((2.0, 3.0),))))
    shares, _ = geometry(configured())
    matrix = table_to_gyro_matrix(*shares)
    alpha = true_table_angle(configured())
    turns = alpha < 4 * 2 * math.pi
    seen = (wobbling - still)[:, turns] / ARCSEC
    amplitude = 2.0 * np.abs(seen @ np.exp(-1j * alpha[turns])) / turns.sum()
    in_plane = np.hypot(matrix[:, 0], matrix[:, 1])
    np.testing.assert_allclose(amplitude, 2.0 * 3.0 * in_plane, rtol=1e-3)


def test_wobble_tips_the_earth_rate_into_the_shaft():
    """Order 2 wobble a turns a part a of the Earth's horizontal rate h along the shaft,
    twice a turn: an angle a h / (2 Omega), shared as the table rate is."""
    still = triad(configured())
    wobbling = triad(configured(table=TableConfig(wobble=((2.0, 3600.0),))))
    shares, eta = geometry(configured())
    alpha = true_table_angle(configured())
    turns = alpha < 4 * 2 * math.pi
    seen = (wobbling - still)[:, turns]
    amplitude = 2.0 * np.abs(seen @ np.exp(-2j * alpha[turns])) / turns.sum()
    tipped = 3600.0 * ARCSEC * math.hypot(eta[0], eta[1]) / (2.0 * 40.0 * DEG)
    np.testing.assert_allclose(amplitude, shares * tipped, rtol=1e-3)


# --- table and encoder -----------------------------------------------------------------------


def test_jitter_has_the_rate_it_says_and_holds_the_angle():
    table = TableConfig(jitter_rms_deg_per_s=0.05, jitter_bandwidth_hz=5.0)
    config = configured(duration_s=400.0, table=table)
    time = np.arange(config.samples) / 500.0
    jitter = true_table_angle(config) - 40.0 * DEG * time
    # The central difference over 2 samples hardly blunts 5 Hz.
    assert np.gradient(jitter, 1 / 500.0).std() / DEG == pytest.approx(0.05, rel=0.03)
    assert jitter.std() == pytest.approx(0.05 * DEG / (2 * math.pi * 5.0), rel=0.05)


def test_rate_jitter_lets_the_angle_walk():
    """First-order rate noise of rms s and bandwidth f walks by s sqrt(2 t / (2 pi f))."""
    table = TableConfig(jitter_rms_deg_per_s=0.05, jitter_spectrum="rate")
    config = configured(duration_s=4000.0, sample_rate_hz=100.0, table=table)
    jitter = true_table_angle(config) - 40.0 * DEG * np.arange(config.samples) / 100.0
    step = np.diff(jitter[::200])
    walk = 0.05 * DEG * math.sqrt(2.0 * 2.0 / (2.0 * math.pi * 8.0))
    assert step.std() == pytest.approx(walk, rel=0.08)


def test_encoder_reads_the_true_angle_with_its_error():
    config = configured(
        table=TableConfig(jitter_rms_deg_per_s=0.01),
        encoder=EncoderConfig(periodic_error=((1.0, 1.0), (3.0, 0.4))),
    )
    alpha = true_table_angle(config)
    table = simulate(config).recording.table
    assert table is not None
    line = 2 * math.pi / 7_200_000
    np.testing.assert_allclose(table.values / line, np.rint(table.values / line), atol=1e-6)
    error = (table.values - alpha) / ARCSEC
    terms = np.array([f(k * alpha) for k in (1, 3) for f in (np.cos, np.sin)]).T
    fitted, *_ = np.linalg.lstsq(terms, error, rcond=None)
    assert math.hypot(*fitted[:2]) == pytest.approx(1.0, abs=0.01)
    assert math.hypot(*fitted[2:]) == pytest.approx(0.4, abs=0.01)
    left = error - terms @ fitted
    assert np.abs(left).max() < 0.5 * 0.18 + 0.01
    assert left.std() == pytest.approx(0.18 / math.sqrt(12), rel=0.03)


@pytest.mark.parametrize("rate", [40.0, -40.0, 0.05])
def test_null_pulse_marks_each_turn(rate):
    start = -0.25 if abs(rate) < 1 else 100.0
    duration = 20.0 if abs(rate) < 1 else 95.0
    config = configured(
        duration_s=duration,
        table=TableConfig(rate_deg_per_s=rate, start_deg=start, jitter_rms_deg_per_s=1e-4),
        encoder=EncoderConfig(null_accuracy_arcsec=2.0),
    )
    recording = simulate(config).recording
    assert recording.null_pulse is not None
    alpha = true_table_angle(config)
    pulses = np.flatnonzero(recording.null_pulse)
    nulls = 2 * math.pi * np.arange(-20, 20)
    passed = np.sum((nulls > alpha.min()) & (nulls < alpha.max()))
    assert pulses.size == passed > 0
    off = (alpha[pulses] - 2 * math.pi * np.rint(alpha[pulses] / (2 * math.pi))) / ARCSEC
    per_sample = abs(rate) * 3600 / 500.0
    assert np.all(np.abs(off) < per_sample + 5 * 2.0)


def test_null_errors_have_the_accuracy_stated():
    """At a slow crossing per sample the pulse is off by its own error: 2 arcsec rms."""
    table = TableConfig(rate_deg_per_s=360.0, reversal_interval_s=0.0)
    config = configured(
        duration_s=400.0,
        sample_rate_hz=2000.0,
        table=table,
        encoder=EncoderConfig(null_accuracy_arcsec=600.0),
    )
    recording = simulate(config).recording
    assert recording.null_pulse is not None
    alpha = true_table_angle(config)[recording.null_pulse]
    off = (alpha - 2 * math.pi * np.rint(alpha / (2 * math.pi))) / ARCSEC
    per_sample = 360.0 * 3600 / 2000.0
    assert off.mean() == pytest.approx(per_sample / 2, abs=4 * 600 / math.sqrt(400))
    expected = math.hypot(600.0, per_sample / math.sqrt(12))
    assert off.std() == pytest.approx(expected, rel=4 / math.sqrt(800))


def test_a_table_at_rest_has_no_encoder_columns():
    recording = simulate(configured(table=AT_REST)).recording
    assert recording.table is None
    assert recording.null_pulse is None
    # Earth rate alone: C_b^s eta t.
    shares, eta = geometry(configured())
    rate = table_to_gyro_matrix(*shares) @ eta
    expected = rate[:, None] * np.arange(recording.samples) / 500.0
    measured = np.array([gyro.values for gyro in recording.gyros])
    np.testing.assert_allclose(from_first(measured), expected, atol=1e-13)


# --- disturbances ----------------------------------------------------------------------------


def test_disturbances_are_those_of_the_truth():
    config = configured(
        duration_s=200.0,
        disturbances=DisturbanceConfig(
            angle=((1.0, 0.6), (7.0, 0.2), (2.5, 0.1)), time=((1.37, 0.05), (50.0, 0.02))
        ),
    )
    simulation = simulate(config)
    quiet = triad(replace(config, disturbances=DisturbanceConfig()))
    gyros = np.array([gyro.values for gyro in simulation.recording.gyros])
    left = (gyros - quiet) / ARCSEC
    alpha = true_table_angle(config)
    time = np.arange(config.samples) / 500.0
    for line in simulation.truth.lines:
        if line.scale == "angle":
            argument = line.order * alpha
        else:
            argument = 2 * math.pi * line.frequency_hz * time
        for g, name in enumerate("xyz"):
            amplitude, phase = line.amplitude_arcsec[name], line.phase_rad[name]
            # Eqs. 10 and 11: nothing at zero.
            left[g] -= amplitude * (np.cos(argument + phase) - math.cos(phase))
        x, z = (
            line.amplitude_arcsec[name] * np.exp(1j * line.phase_rad[name]) for name in ("x", "z")
        )
        assert line.difference_amplitude_arcsec["x-z"] == pytest.approx(abs(x - z))
    assert np.abs(left).max() < 1e-6
    put_in = {line.order or line.frequency_hz for line in simulation.truth.lines}
    assert put_in == {1.0, 7.0, 2.5, 1.37, 50.0}
    for line in simulation.truth.lines:
        largest = dict([*config.disturbances.angle, *config.disturbances.time])
        position = line.order or line.frequency_hz
        assert all(
            0.5 * largest[position] <= a <= largest[position]
            for a in line.amplitude_arcsec.values()
        )


def test_earth_rate_harmonic_of_the_truth():
    config = configured()
    order_one = truth_of(config).earth_rate_order_one
    assert order_one is not None
    alpha = true_table_angle(config)
    for g, gyro in enumerate(triad(config) / ARCSEC):
        terms = np.array([np.cos(alpha), np.sin(alpha), alpha, np.ones(alpha.size)]).T
        cosine, sine = np.linalg.lstsq(terms, gyro, rcond=None)[0][:2]
        name = "xyz"[g]
        assert math.hypot(cosine, sine) == pytest.approx(order_one.amplitude_arcsec[name], rel=1e-6)
        assert math.atan2(-sine, cosine) == pytest.approx(order_one.phase_rad[name], abs=1e-6)
    assert truth_of(configured(table=AT_REST)).earth_rate_order_one is None


# --- noise -----------------------------------------------------------------------------------


def allan_variance(angle, samples, sample_rate):
    """Overlapping, from its definition."""
    second = angle[2 * samples :] - 2.0 * angle[samples:-samples] + angle[: -2 * samples]
    tau = samples / sample_rate
    return np.mean(second**2) / (2.0 * tau**2)


def at_rest(gyro, duration, sample_rate=10.0, seed=3):
    return RigConfig(
        duration_s=duration, sample_rate_hz=sample_rate, seed=seed, table=AT_REST, gyro=gyro
    )


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


def test_bias_instability_makes_its_allan_floor():
    """sigma = B sqrt(2 ln 2 / pi), at cluster times from seconds to minutes."""
    gyro = replace(NOISELESS, bias_instability_deg_per_h=(1.0, 2.0, 0.5))
    angle = triad(at_rest(gyro, 200_000.0))
    for samples in (30, 100, 300, 1000):
        relative = [
            math.sqrt(allan_variance(angle[g], samples, 10.0)) / (value * DEG / 3600)
            for g, value in enumerate((1.0, 2.0, 0.5))
        ]
        floor = math.sqrt(np.mean(np.square(relative)))
        assert floor == pytest.approx(math.sqrt(2 * math.log(2) / math.pi), rel=0.04)


def test_rate_random_walk_makes_its_allan_slope():
    """sigma^2 = K^2 tau / 3."""
    gyro = replace(NOISELESS, rate_random_walk_deg_per_h_per_sqrt_h=(1.0, 1.0, 1.0))
    angle = triad(at_rest(gyro, 100_000.0))
    for samples in (30, 100, 300):
        variance = np.mean([allan_variance(a, samples, 10.0) for a in angle])
        unit = DEG / 3600 / 60
        assert variance == pytest.approx(unit**2 * samples / 10.0 / 3.0, rel=0.05)


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


# --- ring laser modes ------------------------------------------------------------------------


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


# --- streams, blocks, files ------------------------------------------------------------------

HARSH = replace(
    preset("harsh"),
    duration_s=3.0,
    table=TableConfig(
        rate_deg_per_s=300.0,
        jitter_rms_deg_per_s=0.02,
        wander_fraction=0.02,
        ripple=((12.0, 0.001),),
        wobble=((1.0, 2.0), (2.0, 1.0)),
        reversal_interval_s=1.1,
        acceleration_deg_per_s2=2000.0,
    ),
)


@pytest.mark.parametrize("block_samples", [1, 77, 1000])
@pytest.mark.parametrize("mode", ["ideal", "dithered"])
def test_blocks_are_the_recording_whatever_their_size(block_samples, mode):
    gyro = replace(HARSH.gyro, mode=mode, dither_rate_deg_per_s=400.0)
    config = replace(
        HARSH,
        sample_rate_hz=100.0,
        disturbances=DisturbanceConfig(angle=((1.0, 0.5), (3.5, 0.2)), time=((7.3, 0.1),)),
        gyro=gyro,
    )
    recording = simulate(config).recording
    parts = list(blocks(config, block_samples))
    assert [part.first for part in parts] == list(range(0, 300, block_samples))
    for g, gyro_channel in enumerate(recording.gyros):
        joined = np.concatenate([part.angles[g] for part in parts])
        np.testing.assert_array_equal(joined, gyro_channel.values)
    np.testing.assert_array_equal(
        np.concatenate([part.table for part in parts]), recording.table.values
    )
    np.testing.assert_array_equal(
        np.concatenate([part.null_pulse for part in parts]), recording.null_pulse
    )


def test_seed_reproduces_and_channels_are_independent():
    first, again = triad(HARSH), triad(HARSH)
    np.testing.assert_array_equal(first, again)
    assert not np.any(first[0] == triad(replace(HARSH, seed=2))[0])
    louder = replace(HARSH.gyro, arw_deg_per_sqrt_h=(1.0, 2.5e-5, 2.5e-5))
    changed = triad(replace(HARSH, gyro=louder))
    np.testing.assert_array_equal(changed[1:], first[1:])
    assert not np.array_equal(changed[0], first[0])


def test_memory_does_not_grow_with_the_duration():
    config = replace(preset("paper"), sample_rate_hz=400.0)
    list(blocks(replace(config, duration_s=1.0)))

    def peak(duration):
        tracemalloc.start()
        for _ in blocks(replace(config, duration_s=duration), 10_000):
            pass
        size = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return size

    assert peak(4000.0) < 1.1 * peak(250.0)


def test_parquet_holds_the_recording_with_all_that_is_needed_to_read_it(tmp_path):
    config = replace(preset("paper"), duration_s=200.0)
    parts = []
    path, truth_path = write(config, tmp_path / "run.parquet", parts.append)
    assert parts == sorted(parts)
    assert parts[-1] == 1.0
    read = formats.read(path)
    made = simulate(config)
    assert read.sample_rate == 500.0
    assert [(g.name, g.kind, g.shown_in) for g in read.gyros] == [
        (name, "angle", "arcsec") for name in "xyz"
    ]
    for a, b in zip(read.gyros, made.recording.gyros, strict=True):
        np.testing.assert_allclose(a.values, b.values, rtol=1e-15, atol=1e-15)
    np.testing.assert_allclose(
        from_first(read.table.values), from_first(made.recording.table.values), atol=1e-11
    )
    np.testing.assert_array_equal(read.null_pulse, made.recording.null_pulse)

    truth = json.loads(truth_path.read_text())
    assert truth == json.loads(json.dumps(asdict(made.truth)))
    assert truth["schema"] == "sagnac.truth/1"
    assert truth["seed"] == 1
    assert truth["table_rate_deg_per_s"] == pytest.approx(40.0)
    assert truth["pairs"]["x-z"]["arw_deg_per_sqrt_h"] == pytest.approx(2.5e-5)
    assert len([line for line in truth["lines"] if line["scale"] == "angle"]) == 12
    assert truth_path.name == "run.parquet.truth.json"


@pytest.mark.parametrize("suffix", ["csv", "npz", "mat"])
def test_other_formats_hold_the_encoder_as_it_reads(tmp_path, suffix):
    config = replace(preset("paper"), duration_s=20.0)
    path, _ = write(config, tmp_path / f"run.{suffix}")
    read = formats.read(path)
    made = simulate(config).recording
    for a, b in zip(read.gyros, made.gyros, strict=True):
        np.testing.assert_allclose(a.values, b.values, rtol=1e-14, atol=1e-14)
    np.testing.assert_allclose(
        from_first(read.table.values), from_first(made.table.values), atol=1e-11
    )
    if suffix == "csv":
        column = np.genfromtxt(path, delimiter=",", names=True)["tabledeg"]
        assert 0.0 <= column.min() < column.max() < 360.0
        np.testing.assert_allclose(column * 20_000, np.rint(column * 20_000), atol=1e-4)


def test_nothing_is_left_of_a_file_that_cannot_be_written(tmp_path):
    config = replace(preset("paper"), duration_s=1.0)
    with pytest.raises(RecordingError, match="suffix"):
        write(config, tmp_path / "run.xyz")
    with pytest.raises(RecordingError, match="cannot be written"):
        write(config, tmp_path / "nowhere" / "run.parquet")

    def stop(_):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write(config, tmp_path / "run.parquet", stop)
    assert list(tmp_path.iterdir()) == []


# --- configuration ---------------------------------------------------------------------------


def test_toml_is_laid_over_its_preset(tmp_path):
    path = tmp_path / "rig.toml"
    path.write_text(
        'preset = "paper"\nduration_s = 60\nseed = 9\n'
        "[table]\nrate_deg_per_s = 20\nprofile = [[0, 10], [30, 20]]\n"
        "[gyro]\narw_deg_per_sqrt_h = 3e-5\nbias_deg_per_h = [1, 2, 3]\n"
    )
    config = RigConfig.from_toml(path)
    assert (config.duration_s, config.seed, config.table.rate_deg_per_s) == (60, 9, 20)
    assert config.table.profile == ((0, 10), (30, 20))
    assert config.gyro.arw_deg_per_sqrt_h == (3e-5, 3e-5, 3e-5)
    assert config.gyro.bias_deg_per_h == (1, 2, 3)
    assert config.disturbances == preset("paper").disturbances
    assert RigConfig.from_mapping({}) == RigConfig()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("speed = 3", r"unknown key 'speed'; known here: duration_s, "),
        ("[table]\nrate = 40", r"unknown key 'table\.rate'; known here: rate_deg_per_s, "),
        ("table = 3", r"table is 3; it is a table, write \[table\]"),
        ("[table]\nrate_deg_per_s = 900", r"table\.rate_deg_per_s is 900; .*from -400 to 400"),
        ("[table]\nrate_deg_per_s = nan", r"table\.rate_deg_per_s is nan; .*from -400 to 400"),
        ('[table]\nrate_deg_per_s = "40"', r"table\.rate_deg_per_s is '40'; it must be a number"),
        ("seed = 1.5", r"seed is 1\.5; it must be a whole number"),
        ("seed = true", r"seed is True; it must be a number"),
        ("[table]\nripple = [[12, 0.5]]", r"table\.ripple \(fraction\) is 0\.5; .*0 to 0\.2"),
        ("[table]\nripple = [12, 0.1]", r"table\.ripple holds 12; .*pairs \[order, fraction\]"),
        ("[table]\nripple = 12", r"table\.ripple is 12; it must be a list of pairs"),
        ("[gyro]\narw_deg_per_sqrt_h = [1, 2]", r"arw_deg_per_sqrt_h is \(1, 2\); .*list of three"),
        ("[gyro]\narw_deg_per_sqrt_h = -1", r"gyro\.arw_deg_per_sqrt_h is -1; .*from 0 to 10"),
        ('[gyro]\nmode = "fast"', r"gyro\.mode is 'fast'; use one of ideal, still, dithered"),
        ('preset = "calm"', r"preset 'calm' does not exist; use one of quiet, paper, harsh"),
        ("[disturbances]\ntime = [[300, 1]]", r"300 Hz is above 250 Hz, half of sample_rate_hz"),
        ("[table]\nprofile = [[5, 1], [5, 2]]", r"table\.profile: times .* do not increase"),
        ("duration_s = 0.01\nsample_rate_hz = 1", r"holds no sample at 1 Hz; make it longer"),
        (
            "[table]\nreversal_interval_s = 0.5",
            r"reversal_interval_s 0\.5 leaves no time to turn round in 0\.8 s",
        ),
        (
            "[table]\nripple = [[1, 0.2], [2, 0.2], [3, 0.2], [4, 0.2], [5, 0.2]]",
            r"table\.ripple: fractions add up to 1",
        ),
        ('[gyro]\nmode = "still"', r"gyro\.mode is 'still' on a turning table"),
        (
            '[gyro]\nmode = "rate-biased"\n[table]\nreversal_interval_s = 10',
            r"gyro x comes down to 0 deg/s; the table must turn one way and give it 0\.0667",
        ),
        (
            '[gyro]\nmode = "dithered"\ndither_rate_deg_per_s = 20',
            r"gyro\.mode 'dithered': input rate .* raise the dither's rate",
        ),
        ("table]", r"not TOML"),
    ],
)
def test_a_wrong_configuration_is_refused_in_one_line(tmp_path, text, message):
    path = tmp_path / "rig.toml"
    path.write_text(text)
    with pytest.raises(ValueError, match=message) as caught:
        RigConfig.from_toml(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert "\n" not in str(caught.value)


def test_a_missing_configuration_is_refused(tmp_path):
    with pytest.raises(ValueError, match=r"none\.toml: no such file"):
        RigConfig.from_toml(tmp_path / "none.toml")
    with pytest.raises(ValueError, match="cannot be opened"):
        RigConfig.from_toml(tmp_path)


def test_every_key_is_documented_with_its_default_and_range():
    text = (Path(__file__).parents[2] / "docs" / "simulate.md").read_text()
    rows = [
        [cell.strip() for cell in line.strip("|").split(" | ")]
        for line in text.splitlines()
        if line.startswith("| `")
    ]
    known = keys()
    assert [row[0].strip("`") for row in rows] == list(known)
    for name, default, allowed, meaning in rows:
        rule = known[name.strip("`")]
        assert meaning == rule.meaning
        value = reduce(getattr, name.strip("`").split("."), RigConfig())
        shown = json.loads(default.strip("`"))
        if isinstance(value, tuple) and not isinstance(shown, list):
            shown = [shown] * 3
        assert (list(value) if isinstance(value, tuple) else value) == shown
        if isinstance(rule, Key):
            low, high = allowed.split(" to ")
            assert (float(low), float(high)) == (rule.low, rule.high)
        elif isinstance(rule, ChoiceKey):
            assert tuple(word.strip('`" ') for word in allowed.split(",")) == rule.choices
        else:
            for what, low, high in (rule.first, rule.second):
                assert f"{what} {low:g} to {high:g}" in allowed


@pytest.mark.parametrize("name", ["quiet", "paper", "harsh"])
def test_presets_run_and_hold_their_place_in_the_paper(name):
    config = preset(name)
    assert max(abs(d) for d in config.platform.share_deviation) <= 0.002  # Eq. 2
    assert config.encoder.lines == 7_200_000
    simulation = simulate(replace(config, duration_s=2.0))
    assert all(np.isfinite(g.values).all() for g in simulation.recording.gyros)


def test_simulator_and_estimators_share_nothing():
    estimators = ("spectrum", "stability", "lines", "coefficients", "analysis")
    house = Path(sagnac.__file__).parent
    for file in [*(house / "rig").glob("*.py"), house / "table" / "frames.py"]:
        for node in ast.walk(ast.parse(file.read_text())):
            if isinstance(node, ast.ImportFrom):
                parts = [*(node.module or "").split("."), *(name.name for name in node.names)]
                assert parts[0] != "sagnac" or parts[1] not in estimators
