"""Kinematics of the table: integrals, averages, gains and how steadily it turns."""

import numpy as np
import pytest

from sagnac.core import arrays
from sagnac.table.kinematics import (
    are_whole,
    averaged,
    block_gain,
    harmonic_sum,
    harmonics_of,
    highest_harmonic,
    kinematics,
    rate_variation,
    sine_cosine_integrals,
    tells_drift,
)
from tests.table.turning import RATE, TURN, motion, reversing, time, wandering


@pytest.mark.parametrize("span", [2**18, 5000, 7])
def test_integrals_and_averages_are_the_same_by_blocks_of_any_length(monkeypatch, span):
    monkeypatch.setattr(arrays, "BLOCK", span)
    _, table = motion(wandering(60.0))
    found = kinematics(table, RATE)
    cosine, sine = sine_cosine_integrals(table, 1.0 / RATE)
    assert found.block == 10
    assert found.interval == pytest.approx(0.1)
    assert found.angle == pytest.approx(averaged(table, 10), rel=1e-14)
    assert found.cosine == pytest.approx(averaged(cosine, 10), abs=1e-12)
    assert found.sine == pytest.approx(averaged(sine, 10), abs=1e-12)
    assert found.starts[-1] == pytest.approx([cosine[-1], sine[-1]], abs=1e-12)
    with pytest.raises(ValueError, match="read-only"):
        found.angle[0] = 0.0


def test_integrals_are_trapezoids_of_the_cosine_and_the_sine_of_any_angle():
    generator = np.random.default_rng(2)
    for table in (
        np.cumsum(generator.uniform(-3.0, 3.0, 5000)),
        -4000.0 + np.linspace(0.0, 9.0, 5000),
        np.array([1e5]),
        np.empty(0),
    ):
        found = sine_cosine_integrals(table, 0.01)
        for integral, values in zip(found, (np.cos(table), np.sin(table)), strict=True):
            areas = 0.005 * (values[1:] + values[:-1])
            expected = np.concatenate([np.zeros(min(table.size, 1)), np.cumsum(areas)])
            assert integral == pytest.approx(expected, abs=1e-14)


def test_the_gain_of_a_block_is_what_averages_keep_of_a_harmonic():
    table = np.radians(40.0) * time(100.0)[::8]
    kinematic = kinematics(table, RATE)
    orders = np.array([1.0, 7.0, 20.0])
    gain = block_gain(kinematic, orders)
    assert gain[0] == pytest.approx(1.0, abs=1e-3)
    for order, size in zip(orders, gain, strict=True):
        averages = averaged(np.cos(order * table), kinematic.block)
        expected = size * np.cos(order * kinematic.angle)
        assert averages == pytest.approx(expected, abs=1e-9)


def test_the_highest_harmonic_has_two_and_a_half_averages_a_period():
    kinematic = kinematics(np.radians(40.0) * time(20.0)[::8], RATE)
    assert highest_harmonic(kinematic) == pytest.approx(0.4 * TURN / np.radians(4.0))
    assert highest_harmonic(kinematics(np.zeros(10), RATE)) == 0.0


def test_harmonics_are_multiples_of_the_angle_and_a_sum_takes_them_with_others():
    angle = np.linspace(-3.0, 9.0, 50)
    waves = harmonics_of(angle, 128)
    assert waves == pytest.approx(np.exp(1j * np.outer(np.arange(129), angle)), abs=1e-12)
    # Eight hundred turns on, a phase in double precision is off by 1e-10; their product is not.
    far = 5026.5 + angle
    exact = np.cos(np.outer(np.arange(129), far.astype(np.longdouble)))
    if np.finfo(np.longdouble).eps < 1e-18:
        assert harmonics_of(far, 128).real == pytest.approx(exact.astype(float), abs=1e-13)
    assert harmonics_of(angle, 0) == pytest.approx(np.ones((1, 50)))
    orders = np.array([128.0, 3.0, 300.0, 0.5, 3.0])
    assert are_whole(orders).tolist() == [True, True, False, False, True]
    cosine, sine = np.arange(5.0), 1.0 - np.arange(5.0)
    phase = np.outer(orders, angle)
    assert harmonic_sum(angle, orders, cosine + 1j * sine) == pytest.approx(
        cosine @ np.cos(phase) + sine @ np.sin(phase), abs=1e-10
    )


def test_variation_of_even_growing_and_reversing_rates():
    seconds = time(300.0)
    assert not tells_drift(kinematics(motion(np.full(seconds.size, 0.7))[1], RATE))
    growing = kinematics(motion(0.1 + 0.01 * seconds)[1], RATE)
    # Uniform from 0.1 to 3.1 rad/s: 3 / sqrt(12) over the root mean square.
    rms = np.sqrt(1.6**2 + 9.0 / 12.0)
    assert rate_variation(growing) == pytest.approx(np.sqrt(9.0 / 12.0) / rms, rel=0.01)
    assert tells_drift(growing)
    assert tells_drift(kinematics(motion(reversing(300.0))[1], RATE))
