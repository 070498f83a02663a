import numpy as np
import pytest

from sagnac.core.units import DEGREE, EARTH_RATE
from sagnac.navigation.align import align
from sagnac.navigation.error_model import azimuth_error, rotating_azimuth_error
from sagnac.navigation.models import Markov
from sagnac.navigation.noise import GyroNoise

NORTH = EARTH_RATE * np.cos(0.5)


def test_two_positions_err_as_half_the_difference_of_two_means() -> None:
    walk, further = 3e-7, 2e-9
    random = np.random.default_rng(1)
    half = 400
    rate = walk * random.standard_normal((3000, 2 * half))
    rate += further * np.cumsum(random.standard_normal((3000, 2 * half)), axis=1)
    rate += random.standard_normal((3000, 1))  # a bias, which turning the gyro takes out
    means = 0.5 * (rate[:, :half].mean(axis=1) - rate[:, half:].mean(axis=1))
    noise = GyroNoise(angle_random_walk=walk, rate_random_walk=further)
    found = azimuth_error(noise, latitude=0.5, times=np.array([2.0 * half]))
    assert found.deviation[0] == pytest.approx(means.std() / NORTH, rel=0.04)


def test_a_markov_rate_counts_for_two_positions() -> None:
    deviation, lasting, rest = 5e-5, 30.0, 600
    random = np.random.default_rng(2)
    decay = np.exp(-1.0 / lasting)
    rate = np.empty((rest, 4000))
    rate[0] = deviation * random.standard_normal(4000)
    for now, before in zip(rate[1:], rate, strict=False):
        now[:] = decay * before + deviation * np.sqrt(1 - decay**2) * random.standard_normal(4000)
    means = 0.5 * (rate[: rest // 2].mean(axis=0) - rate[rest // 2 :].mean(axis=0))
    markov = Markov.of_deviation(deviation, lasting, error=0.2)
    noise = GyroNoise(angle_random_walk=1e-7, markov=(markov,))
    found = azimuth_error(noise, latitude=0.5, times=np.array([float(rest)]), confidence=0.6827)
    assert found.deviation[0] == pytest.approx(means.std() / NORTH, rel=0.04)
    # Half of the relative error of the variance.
    assert found.high[0] / found.deviation[0] == pytest.approx(np.exp(0.1), rel=1e-3)


def test_azimuth_is_that_of_the_gyro_that_is_loudest_over_the_rest() -> None:
    quiet = GyroNoise(angle_random_walk=3.1e-7)
    walks = GyroNoise(angle_random_walk=3e-7, rate_random_walk=2e-9)
    found = align((quiet, walks, quiet), latitude=0.5, rest=600.0, table_rate=0.7).prospect
    assert found is not None
    assert found.rotating is not None
    times = np.array([600.0])
    for error, noise, how in (
        (found.compass, walks, {}),
        # The table turns faster than this gyro walks.
        (found.rotating, quiet, {"table_rate": 0.7, "bias": 0.0}),
    ):
        law = rotating_azimuth_error if how else azimuth_error
        expected = law(noise, latitude=0.5, times=times, **how).deviation[-1]
        assert error.deviation[-1] == pytest.approx(expected)


def test_flicker_is_a_floor_and_latitude_divides() -> None:
    noise = GyroNoise(angle_random_walk=1e-9, bias_instability=1e-8)
    times = np.array([1e2, 1e6])
    found = azimuth_error(noise, latitude=0.0, times=times)
    assert found.deviation[1] == pytest.approx(found.floor, rel=1e-3)
    assert found.floor == pytest.approx(
        1e-8 * np.sqrt(2.0 * np.log(2.0) / np.pi) / np.sqrt(2.0) / EARTH_RATE
    )
    north = azimuth_error(noise, latitude=60.0 * DEGREE, times=times)
    assert north.deviation == pytest.approx(2.0 * found.deviation)


def test_interval_comes_from_the_covariance_of_the_coefficients() -> None:
    covariance = np.zeros((3, 3))
    covariance[0, 0] = (0.1e-7) ** 2
    noise = GyroNoise(angle_random_walk=1e-7, covariance=covariance)
    found = azimuth_error(noise, latitude=0.0, times=np.array([100.0]), confidence=0.6827)
    assert found.high[0] / found.deviation[0] == pytest.approx(np.exp(0.1), rel=1e-3)
    assert found.low[0] / found.deviation[0] == pytest.approx(np.exp(-0.1), rel=1e-3)


@pytest.mark.parametrize(
    ("bounds", "added"),
    [
        ({"rate_random_walk": 1e-8}, 1e-16 * 400.0 / 12.0),
        # The floor of Allan's variance by two.
        ({"bias_instability": 1e-7}, 1e-14 * np.log(2.0) / np.pi),
    ],
)
def test_the_interval_reaches_to_what_an_upper_bound_allows(bounds, added) -> None:
    noise = GyroNoise(angle_random_walk=1e-7, unseen=tuple(bounds), bounds=bounds)
    found = azimuth_error(noise, latitude=0.5, times=np.array([400.0]))
    white = 1e-14 / 400.0
    assert found.low == pytest.approx([np.sqrt(white) / NORTH])
    assert found.deviation == pytest.approx([np.sqrt(white) / NORTH])
    assert found.high == pytest.approx([np.sqrt(white + added) / NORTH])


def test_the_interval_of_slow_noise_that_is_only_likely_reaches_from_none_to_its_bound() -> None:
    name = "rate_random_walk"
    noise = GyroNoise(
        angle_random_walk=1e-7, rate_random_walk=5e-9, unseen=(name,), bounds={name: 1e-8}
    )
    found = azimuth_error(noise, latitude=0.5, times=np.array([400.0]))
    ends = [1e-14 / 400.0 + walk**2 * 400.0 / 12.0 for walk in (0.0, 5e-9, 1e-8)]
    wanted = np.sqrt(ends) / NORTH
    assert [found.low[0], found.deviation[0], found.high[0]] == pytest.approx(wanted)


def test_a_pole_and_no_time_are_refused() -> None:
    noise = GyroNoise(angle_random_walk=1e-7)
    with pytest.raises(ValueError, match="nearer to a pole"):
        azimuth_error(noise, latitude=90.0 * DEGREE, times=np.array([1.0]))
    with pytest.raises(ValueError, match="above zero"):
        azimuth_error(noise, latitude=0.0, times=np.array([0.0]))
