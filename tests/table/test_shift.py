"""The time shift between encoder and gyro, and the rate that it shows in."""

import numpy as np
import pytest

from sagnac.table.kinematic_fit import KinematicFit, kinematic_fit
from sagnac.table.kinematics import averaged, kinematics
from sagnac.table.shift import rate_with_table, shifted_kinematics
from tests.table.turning import EARTH_TERMS, RATE, SHARE, motion, reversing, sensed, wandering


def test_the_rate_with_the_table_is_the_derivative_of_all_but_the_drift():
    _, table = motion(wandering(200.0))
    kinematic = kinematics(table, RATE)
    found = KinematicFit(
        share=SHARE,
        drift=1e-3,
        earth=EARTH_TERMS,
        shift=0.0,
        orders=np.array([2.0]),
        cosine=np.array([1e-3]),
        sine=np.array([-2e-3]),
    )
    alpha = kinematic.angle
    speed = np.gradient(alpha, 0.1)
    rate = SHARE - 2.0 * 1e-3 * np.sin(2.0 * alpha) - 2.0 * 2e-3 * np.cos(2.0 * alpha)
    expected = rate * speed + EARTH_TERMS[0] * np.cos(alpha) + EARTH_TERMS[1] * np.sin(alpha)
    inner = slice(20, -20)
    assert rate_with_table(kinematic, found)[inner] == pytest.approx(
        expected[inner], abs=1e-3 * np.abs(expected).max()
    )


def shift_found(angle, encoder):
    kinematic = kinematics(encoder, RATE)
    averages = averaged(angle, kinematic.block)
    found = kinematic_fit(averages, kinematic, np.empty(0), with_drift=True)
    return shifted_kinematics(averages, encoder, kinematic, np.empty(0), found)


@pytest.mark.parametrize("lag", [0.021, -0.008])
def test_a_shift_is_found_from_where_it_is_not(lag):
    fine, _ = motion(reversing(300.0))
    grid = np.arange(fine.size) / (8.0 * RATE)
    encoder = np.interp(grid[::8] + lag, grid, fine)
    assert shift_found(sensed(fine, share=0.577), encoder).lag == pytest.approx(lag, abs=1e-4)


def test_a_gyro_that_does_not_sense_the_table_keeps_the_lag_known():
    _, table = motion(reversing(300.0))
    noise = np.cumsum(1e-6 * np.random.default_rng(1).standard_normal(table.size))
    assert shift_found(noise, table).lag == pytest.approx(0.0, abs=1.0)
