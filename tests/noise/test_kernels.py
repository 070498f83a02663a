"""Steps of the covariance of overlapped variances, each by itself."""

import numpy as np
import pytest

from sagnac.noise import _kernels

NODES, WEIGHTS = np.polynomial.legendre.leggauss(8)


def counted(first, second, angles):
    pairs, lags, counts = _kernels.counted_lags(
        first, np.array([second, second]), angles, NODES, WEIGHTS
    )
    assert np.count_nonzero(pairs == 0) == np.count_nonzero(pairs == 1)
    return lags[pairs == 1], counts[pairs == 1]


@pytest.mark.parametrize(("first", "second"), [(1, 1), (2, 9), (9, 130), (30, 7)])
def test_counts_are_how_often_the_record_holds_the_lags(first, second):
    """Between breaks an integral stands for the sum: the same of a straight line, near of more."""
    angles = 601
    lags, counts = counted(first, second, angles)
    starts, others = np.arange(angles - 2 * first), np.arange(angles - 2 * second)
    reach = max(2 * second, 2 * first) + 127 * max(first, second)
    every = np.subtract.outer(starts, others)
    every = every[np.abs(every) <= reach]
    assert np.abs(lags).max() <= reach
    for power in range(4):
        size = (1e-4 if power else 1e-12) * (np.abs(every) ** power).sum()
        assert counts @ lags**power == pytest.approx((1.0 * every**power).sum(), abs=size)


def test_far_lags_of_a_long_record_are_left_out():
    lags, _ = counted(1, 1, 1_000_001)
    assert (lags.min(), lags.max()) == (-129.0, 129.0)


@pytest.mark.parametrize(("first", "second"), [(1, 1), (2, 9), (30, 7)])
def test_covariances_are_the_sum_over_every_lag(first, second):
    angles = 401
    factors = np.array([first, second])
    found = _kernels.overlapped_covariances(factors, angles, NODES, WEIGHTS)
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
