"""The table: its motion, and Eq. 4 integrated along it, by means that are not its own."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import cumulative_simpson, quad
from scipy.interpolate import CubicSpline
from scipy.signal import welch

from sagnac.rig.config import table_command
from sagnac.rig.sections import TableConfig
from sagnac.rig.table import RandomStreams, movers_of, substeps_of
from sagnac.table.frames import earth_rate, shares_from_deviations, table_to_gyro_matrix
from tests.rig.rigs import (
    ARCSEC,
    DEG,
    configured,
    from_first,
    geometry,
    ideal_angle,
    triad,
    true_table_angle,
)


def turn(alpha):
    """Coordinates in a frame turned by alpha about z."""
    return np.array(
        [
            [math.cos(alpha), math.sin(alpha), 0.0],
            [-math.sin(alpha), math.cos(alpha), 0.0],
            [0.0, 0.0, 1.0],
        ]
    )


@pytest.mark.parametrize("rate_deg", [40.0, -13.0])
def test_ideal_angle_is_the_integral_of_the_sensed_rate(rate_deg):
    """Eq. 6 against Eq. 4 integrated by quadrature, one gyro and one time at a time."""
    rate = math.radians(rate_deg)
    shares = shares_from_deviations((0.001, 0.0005, -0.0015))
    eta = earth_rate(math.radians(28.2), 0.7)
    matrix = table_to_gyro_matrix(*shares)

    def sensed(time, gyro):
        return (matrix @ (np.array([0.0, 0.0, rate]) + turn(rate * time) @ eta))[gyro]

    times = np.array([0.0, 0.37, 4.5, 21.0])
    angle = ideal_angle(times, rate * times, rate, shares, eta)
    for gyro in range(3):
        for k, time in enumerate(times):
            expected = quad(sensed, 0.0, time, args=(gyro,), epsabs=1e-13, limit=200)[0]
            assert angle[gyro, k] == pytest.approx(expected, abs=1e-11)


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


# --- the parts by themselves -----------------------------------------------------------------


def test_command_is_straight_between_knots_and_constant_outside():
    config = TableConfig(profile=((1.0, 0.0), (3.0, 10.0)), start_deg=5.0)
    command = table_command(config, 60.0)
    time = np.array([-1.0, 0.0, 1.0, 2.0, 3.0, 4.0])
    np.testing.assert_allclose(command.rate_at(time) / DEG, [0, 0, 0, 5, 10, 10])
    np.testing.assert_allclose(command.angle_at(time) / DEG, [5, 5, 5, 7.5, 15, 25], rtol=1e-12)


def test_reversals_ramp_around_their_times():
    config = TableConfig(rate_deg_per_s=20.0, reversal_interval_s=10.0, acceleration_deg_per_s2=10)
    command = table_command(config, 25.0)
    np.testing.assert_array_equal(command.time, [0.0, 8.0, 12.0, 18.0, 22.0])
    np.testing.assert_allclose(command.rate / DEG, [20, 20, -20, -20, 20])


def test_substeps_follow_the_turn_and_the_servo():
    calm = TableConfig(rate_deg_per_s=40.0)
    command = table_command(calm, 60.0)
    assert substeps_of(calm, command, 0.002) == 1
    assert substeps_of(calm, command, 1.0) == math.ceil(40.0 * DEG / 0.02)
    shaking = replace(calm, jitter_rms_deg_per_s=0.1, jitter_bandwidth_hz=100.0)
    assert substeps_of(shaking, command, 0.01) == math.ceil(2 * math.pi / 0.5)


def advanced(mover, commanded, pieces):
    drive, rate = np.zeros(commanded.size), np.zeros(commanded.size)
    for part in np.array_split(np.arange(commanded.size), pieces):
        mover.advance(commanded[part], drive[part[0] : part[-1] + 1], rate[part[0] : part[-1] + 1])
    return drive, rate


def mover_of(config, seed=1):
    (mover,) = movers_of(config, 0.002, RandomStreams(seed))
    return mover


@pytest.mark.parametrize(
    "config",
    [
        TableConfig(jitter_rms_deg_per_s=0.1),
        TableConfig(jitter_rms_deg_per_s=0.1, jitter_spectrum="rate"),
        TableConfig(wander_fraction=0.01),
        TableConfig(hunting_rms_deg_per_s=0.1),
    ],
)
def test_movers_do_not_depend_on_how_they_are_advanced(config):
    commanded = np.full(1000, 40.0 * DEG)
    whole, parts = (advanced(mover_of(config), commanded, n) for n in (1, 7))
    np.testing.assert_array_equal(whole, parts)


def test_rate_noise_has_its_size_and_correlation():
    config = TableConfig(jitter_rms_deg_per_s=0.1, jitter_bandwidth_hz=5.0, jitter_spectrum="rate")
    drive, rate = advanced(mover_of(config, 2), np.zeros(200_000), 3)
    assert rate.std() == pytest.approx(0.1 * DEG, rel=0.05)
    assert np.corrcoef(rate[:-1], rate[1:])[0, 1] == pytest.approx(
        math.exp(-2 * math.pi * 5.0 * 0.002), rel=0.01
    )
    steps = 0.5 * 0.002 * (rate[1:] + rate[:-1])
    np.testing.assert_allclose(np.diff(drive), steps, atol=1e-15)


def test_a_servo_that_hunts_makes_a_band_of_its_frequency_and_quality():
    """The density of the angle is that of the oscillator's equation, its rms the one stated."""
    table = TableConfig(
        rate_deg_per_s=20.0, hunting_rms_deg_per_s=0.03, hunting_hz=2.0, hunting_quality=8.0
    )
    config = configured(duration_s=2000.0, sample_rate_hz=50.0, table=table)
    angle = true_table_angle(config) - 20.0 * DEG * np.arange(config.samples) / 50.0
    # Sampled angles of an oscillator; above 20 Hz hardly anything is left to fold.
    frequency, density = welch(angle, 50.0, nperseg=2048)
    inside = (frequency > 0.5) & (frequency < 6.0)
    ratio = frequency[inside] / 2.0
    variance = (0.03 * DEG / (2 * math.pi * 2.0)) ** 2
    law = 4.0 * variance / (2 * math.pi * 2.0 * 8.0) / ((1 - ratio**2) ** 2 + (ratio / 8.0) ** 2)
    # About 97 segments, half of them overlapping: a bin scatters by 12 %, their mean by 1 %.
    assert np.mean(density[inside] / law) == pytest.approx(1.0, abs=0.05)
    assert frequency[np.argmax(density)] == pytest.approx(2.0, abs=0.1)
    # 2000 s hold some 1600 ring-downs of 8/(2 pi) s.
    assert angle.std() == pytest.approx(math.sqrt(variance), rel=0.08)


@pytest.mark.parametrize(
    ("after", "rates", "times"),
    [
        ("back", [20, 0, 0, -20, -20, 0, 0, 20], [6, 8, 12, 14, 16, 18, 22, 24]),
        ("onward", [20, 0, 0, 20, 20, 0, 0, 20], [6, 8, 12, 14, 16, 18, 22, 24]),
    ],
)
def test_a_table_dwells_and_then_turns_back_or_onward(after, rates, times):
    config = TableConfig(
        rate_deg_per_s=20.0,
        reversal_interval_s=10.0,
        acceleration_deg_per_s2=10.0,
        dwell_s=4.0,
        after_dwell=after,
    )
    command = table_command(config, 25.0)
    np.testing.assert_allclose(command.rate_at(np.array(times, dtype=float)) / DEG, rates)
    stands = command.angle_at(np.array([8.0, 9.0, 12.0])) / DEG
    # 6 s at full rate and a ramp of 2 s at half of it.
    np.testing.assert_allclose(stands, 6 * 20.0 + 2 * 10.0)


def test_a_table_may_stop_and_go_on_without_a_dwell():
    config = TableConfig(
        reversal_interval_s=10.0, acceleration_deg_per_s2=40.0, after_dwell="onward"
    )
    command = table_command(config, 15.0)
    np.testing.assert_allclose(
        command.rate_at(np.array([8.9, 9.5, 10.0, 10.5, 11.1])) / DEG, [40, 20, 0, 20, 40]
    )
