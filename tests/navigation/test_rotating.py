"""A triad that turns all the time: rates of Eq. 4, whole rotations, and the azimuth read off."""

import numpy as np
import pytest

from sagnac.core.units import DEGREE, DEGREE_PER_HOUR, DEGREE_PER_ROOT_HOUR, EARTH_RATE
from sagnac.navigation.error_model import north_rate, rotating_azimuth_error
from sagnac.navigation.noise import GyroNoise

LATITUDE = 32.0 * DEGREE
TURNING = 40.0 * DEGREE
SECONDS = 180.0  # 20 turns
STEP = 0.2
EQUAL = (1.0 / np.sqrt(3.0),) * 3


def triad(shares):
    """(3, 3) rows: orthogonal axes with these shares along the shaft, by Gram and Schmidt."""
    frame = np.linalg.qr(np.column_stack([shares, np.eye(3)[:, :2]]))[0]
    return frame[:, [1, 2, 0]] * np.sign(frame[0, 0])


def azimuths(walks, *, bias=0.0, further=0.0, shares=EQUAL, runs=2500, seed=1):
    """(runs,) azimuth of the null indicator less the truth, rad."""
    random = np.random.default_rng(seed)
    axes = triad(np.asarray(shares))
    steps = round(SECONDS / STEP)
    alpha = TURNING * STEP * (np.arange(steps) + 0.5)
    heading = random.uniform(-np.pi, np.pi, runs)
    drift = bias * random.standard_normal((runs, 3))
    found = np.zeros((runs, 2))
    slow = np.zeros((runs, 3))
    for number in range(steps):
        # From north-east-down into the axes of the table, Eq. 4.
        angle = heading + alpha[number]
        earth = EARTH_RATE * np.stack(
            [
                np.cos(LATITUDE) * np.cos(angle),
                -np.cos(LATITUDE) * np.sin(angle),
                np.full(runs, -np.sin(LATITUDE)),
            ],
            axis=1,
        )
        rate = (earth + np.array([0.0, 0.0, TURNING])) @ axes.T + drift + slow
        rate += np.asarray(walks) / np.sqrt(STEP) * random.standard_normal((runs, 3))
        slow += further * np.sqrt(STEP) * random.standard_normal((runs, 3))
        table = rate @ axes  # the axes are orthogonal
        cosine, sine = np.cos(alpha[number]), np.sin(alpha[number])
        found[:, 0] += cosine * table[:, 0] - sine * table[:, 1]
        found[:, 1] += sine * table[:, 0] + cosine * table[:, 1]
    off = np.arctan2(-found[:, 1], found[:, 0]) - heading
    return (off + np.pi) % (2.0 * np.pi) - np.pi


@pytest.mark.parametrize(
    ("walk", "bias", "further"),
    [(3e-4, 0.0, 0.0), (3e-4, 0.3, 0.0), (1e-4, 0.0, 2.0)],
    ids=["white", "bias averaged out", "rate random walk"],
)
def test_azimuth_errs_as_predicted(walk, bias, further):
    """2500 runs, whose root mean square scatters by 1.4 %."""
    size = walk * DEGREE_PER_ROOT_HOUR
    slow = further * DEGREE_PER_HOUR / 60.0
    errors = azimuths((size,) * 3, bias=bias * DEGREE_PER_HOUR, further=slow)
    noise = GyroNoise(angle_random_walk=size, rate_random_walk=slow)
    found = rotating_azimuth_error(
        noise, latitude=LATITUDE, times=np.array([SECONDS]), table_rate=TURNING,
        bias=bias * DEGREE_PER_HOUR,
    )  # fmt: skip
    assert found.deviation[0] == pytest.approx(np.sqrt(np.mean(errors**2)), rel=0.05)
    # At rest the same bias alone is many times that.
    if bias:
        still = bias * DEGREE_PER_HOUR / north_rate(LATITUDE)
        assert still > 5.0 * found.deviation[0]


def test_gyros_that_differ_mix_by_their_shares():
    walks = np.array([2e-4, 6e-4, 3e-4]) * DEGREE_PER_ROOT_HOUR
    shares = np.array([0.3, 0.5, np.sqrt(1.0 - 0.34)])
    errors = azimuths(walks, shares=shares, seed=2)
    mixed = GyroNoise(angle_random_walk=np.sqrt(0.5 * (1.0 - shares**2) @ walks**2))
    found = rotating_azimuth_error(
        mixed, latitude=LATITUDE, times=np.array([SECONDS]), table_rate=TURNING
    )
    assert found.deviation[0] == pytest.approx(np.sqrt(np.mean(errors**2)), rel=0.05)


def test_a_part_of_a_turn_leaves_a_part_of_the_bias():
    noise = GyroNoise(angle_random_walk=0.0)
    times = 9.0 * np.array([1.0, 1.5, 2.5, 10.5])
    found = rotating_azimuth_error(
        noise, latitude=0.0, times=times, table_rate=TURNING, bias=1e-6
    ).deviation
    assert found[0] == pytest.approx(0.0, abs=1e-6)
    expected = 1e-6 * 2.0 / (TURNING * times[1:]) / EARTH_RATE
    assert found[1:] == pytest.approx(expected, rel=1e-6)


def test_a_table_that_stands_and_less_than_a_turn_are_refused():
    noise = GyroNoise(angle_random_walk=1e-8)
    arguments = {"latitude": 0.5, "times": np.array([8.0])}
    with pytest.raises(ValueError, match="table_rate is 0"):
        rotating_azimuth_error(noise, table_rate=0.0, **arguments)
    for absurd in (1e300, -1e300):
        with pytest.raises(ValueError, match=r"table_rate is .*at most"):
            rotating_azimuth_error(noise, table_rate=absurd, **arguments)
    # One way or the other, the same.
    both = [rotating_azimuth_error(noise, table_rate=rate, **arguments) for rate in (-1e3, 1e3)]
    assert both[0].deviation == both[1].deviation > 0.0
    with pytest.raises(ValueError, match="times must be of a turn, 9 s"):
        rotating_azimuth_error(noise, table_rate=TURNING, **arguments)
