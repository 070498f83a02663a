import numpy as np
import pytest

from sagnac.core.units import (
    DEGREE,
    DEGREE_PER_HOUR,
    DEGREE_PER_HOUR_PER_ROOT_HOUR,
    DEGREE_PER_ROOT_HOUR,
    EARTH_RATE,
)
from sagnac.navigation.error_model import Start, aligned
from sagnac.navigation.noise import GyroNoise
from sagnac.rig.sections import GyroConfig
from tests.navigation.strapdown import azimuth_errors, rig_noise

LATITUDE = 32.0 * DEGREE
NOISE = GyroNoise(angle_random_walk=1e-3 * DEGREE_PER_ROOT_HOUR)


def test_azimuth_of_white_noise_is_that_of_the_mean_rate() -> None:
    found = aligned(NOISE, latitude=LATITUDE, rest=600.0, start=Start(velocity_noise=1e-7))
    wanted = NOISE.angle_random_walk / (EARTH_RATE * np.cos(LATITUDE) * np.sqrt(600.0))
    # The tilt at each end is one more unknown; the measurements see it almost exactly.
    assert found.deviation[-1] == pytest.approx(wanted, rel=0.01)


def test_drift_is_the_floor_of_azimuth() -> None:
    drift = 0.01 * DEGREE_PER_HOUR
    found = aligned(NOISE, latitude=LATITUDE, rest=7200.0, start=Start(bias=drift))
    floor = drift / (EARTH_RATE * np.cos(LATITUDE))
    assert found.deviation[-1] == pytest.approx(floor, rel=0.02)


@pytest.mark.statistics
def test_closed_loop_on_the_gyros_of_the_rig_errs_as_foretold() -> None:
    walk = 0.002
    start = Start(tilt=0.05 * DEGREE, azimuth=0.5 * DEGREE, bias=0.002 * DEGREE_PER_HOUR)
    config = GyroConfig(
        arw_deg_per_sqrt_h=(1e-3,) * 3, rate_random_walk_deg_per_h_per_sqrt_h=(walk,) * 3
    )
    noise = GyroNoise(
        angle_random_walk=1e-3 * DEGREE_PER_ROOT_HOUR,
        rate_random_walk=walk * DEGREE_PER_HOUR_PER_ROOT_HOUR,
    )
    ratios = []
    for steps in (150, 600):
        # The root mean square of 500 runs alone scatters by 3 %, that of 2000 by 1.6 %.
        angles = rig_noise(config, runs=2000, steps=steps, seed=steps)
        errors = azimuth_errors(noise, angles, latitude=LATITUDE, start=start, seed=steps + 1)
        foretold = aligned(noise, latitude=LATITUDE, rest=float(steps), start=start).deviation[-1]
        ratios.append(foretold / np.sqrt(np.mean(errors**2)))
    print(ratios)
    assert ratios == pytest.approx([1.0, 1.0], abs=0.05)


def test_few_closed_loop_runs_err_by_the_right_size() -> None:
    start = Start(tilt=0.05 * DEGREE, azimuth=0.5 * DEGREE)
    config = GyroConfig(arw_deg_per_sqrt_h=(1e-3,) * 3)
    angles = rig_noise(config, runs=60, steps=200, seed=1)
    errors = azimuth_errors(NOISE, angles, latitude=LATITUDE, start=start, seed=2)
    foretold = aligned(NOISE, latitude=LATITUDE, rest=200.0, start=start).deviation[-1]
    # The root mean square of 60 runs scatters by 9 %.
    assert np.sqrt(np.mean(errors**2)) == pytest.approx(foretold, rel=0.3)


def test_wrong_starts_are_refused() -> None:
    with pytest.raises(ValueError, match="tilt is 0"):
        aligned(NOISE, latitude=LATITUDE, rest=60.0, start=Start(tilt=0.0))
    with pytest.raises(ValueError, match=r"rest is 0\.2"):
        aligned(NOISE, latitude=LATITUDE, rest=0.2)
    with pytest.raises(ValueError, match="nearer to a pole"):
        aligned(NOISE, latitude=89.5 * DEGREE, rest=60.0)
