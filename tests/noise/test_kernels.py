"""Steps of the covariance of overlapped variances, each by itself."""

import numpy as np
import pytest

from sagnac.noise import _kernels
from sagnac.noise.laws import overlapped_allan_covariances


def test_far_lags_of_a_long_record_are_left_out():
    breaks = _kernels.lag_breaks(1, np.array([1, 1]), 1_000_001)
    assert np.array_equal(breaks[0], breaks[1])
    assert (breaks.min(), breaks.max()) == (-129.0, 129.0)


@pytest.mark.parametrize(("first", "second"), [(1, 1), (2, 9), (9, 130), (30, 7)])
def test_covariances_are_the_sum_over_every_lag(first, second):
    angles = 401
    found = overlapped_allan_covariances((first, second), angles=angles, interval=1.0)
    covariance, total = np.empty(5), np.zeros((5, 5))
    covariance[4] = (first * second) ** 2
    reach = 129.0 * max(first, second)
    for lag in range(-(angles - 2 * second - 1), angles - 2 * first):
        if abs(lag) <= reach:
            held = min(angles - 2 * first, angles - 2 * second + lag) - max(0, lag)
            _kernels.second_difference_covariances(float(lag), first, second, covariance)
            total += held * np.outer(covariance, covariance)
    total[4, 4] = 0.0
    total *= 0.5 / ((first * second) ** 2 * (angles - 2 * first) * (angles - 2 * second))
    assert found[:, :, 0, 1] == pytest.approx(total, rel=1e-6, abs=1e-6 * np.abs(total).max())
    assert np.array_equal(found[:, :, 1, 0], found[:, :, 0, 1])
