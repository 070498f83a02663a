import numpy as np
import pytest

from sagnac.core.units import DEGREE, EARTH_RATE, STANDARD_GRAVITY
from sagnac.navigation.error_model import (
    DRIFTS,
    EARTH_RADIUS,
    POSITIONS,
    TILTS,
    aligned,
    position_error,
    step_of,
    system_matrix,
)
from sagnac.navigation.noise import GyroNoise

QUIET = GyroNoise(angle_random_walk=0.0)


def test_tilt_oscillates_with_schulers_period() -> None:
    values = np.linalg.eigvals(system_matrix(0.0))
    schuler = np.sqrt(STANDARD_GRAVITY / EARTH_RADIUS)
    fast = np.sort(np.abs(values.imag))[-4:]
    assert fast == pytest.approx(np.full(4, schuler), rel=0.06)
    assert 2.0 * np.pi / schuler / 60.0 == pytest.approx(84.4, abs=0.2)


def test_drift_moves_position_by_schulers_law() -> None:
    drift, time = 1e-8, 1200.0
    covariance = np.zeros((10, 10))
    covariance[DRIFTS, DRIFTS] = np.diag([0.0, drift**2, 0.0])
    found = position_error(QUIET, latitude=0.5, covariance=covariance, seconds=time)
    schuler = np.sqrt(STANDARD_GRAVITY / EARTH_RADIUS)
    wanted = EARTH_RADIUS * drift * (time - np.sin(schuler * time) / schuler)
    assert found.deviation[-1] == pytest.approx(wanted, rel=0.02)


def test_azimuth_error_and_the_drift_behind_it_cancel() -> None:
    drift = 1e-8
    north = EARTH_RATE * np.cos(0.5)
    alone = np.zeros((10, 10))
    alone[2, 2] = (drift / north) ** 2
    together = alone.copy()
    together[8, 8] = drift**2
    together[2, 8] = together[8, 2] = drift**2 / north
    times = {"latitude": 0.5, "seconds": 1800.0}
    single = position_error(QUIET, covariance=alone, **times).deviation[-1]
    both = position_error(QUIET, covariance=together, **times).deviation[-1]
    assert both < 0.15 * single


def test_noise_of_a_step_is_that_of_many_short_ones() -> None:
    noise = GyroNoise(angle_random_walk=1e-6, rate_random_walk=1e-8)
    long, short = step_of(noise, 0.5, 60.0), step_of(noise, 0.5, 1.0)
    covariance = np.zeros((10, 10))
    for _ in range(60):
        covariance = short.transition @ covariance @ short.transition.T + short.noise
    assert np.diag(long.noise) == pytest.approx(np.diag(covariance), rel=1e-9, abs=0.0)
    # Integrals of a random walk of tilt and of drift, before Schuler turns them back.
    wanted = STANDARD_GRAVITY**2 * (1e-12 * 60.0**5 / 20.0 + 1e-16 * 60.0**7 / 252.0)
    assert long.noise[5, 5] == pytest.approx(wanted, rel=0.01)


def test_alignment_is_the_better_start() -> None:
    noise = GyroNoise(angle_random_walk=1e-3 * DEGREE / 60.0)
    short, long = (
        position_error(
            noise,
            latitude=0.5,
            covariance=aligned(noise, latitude=0.5, rest=seconds).covariance,
            seconds=3600.0,
        )
        for seconds in (60.0, 900.0)
    )
    assert long.deviation[-1] < short.deviation[-1]
    assert TILTS.stop == 3
    assert POSITIONS.start == 5
