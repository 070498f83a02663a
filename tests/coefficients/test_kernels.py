"""Steps of the covariance of overlapped variances, each by itself."""

import numpy as np
import pytest

from sagnac.coefficients import _kernels

NODES, WEIGHTS = np.polynomial.legendre.leggauss(8)


def test_breaks_are_sorted_lags_inside_the_record():
    first, second, angles = 9, 130, 601
    breaks, far = np.empty(27), np.empty(27)
    _kernels.lag_breaks(first, second, angles, breaks)
    assert np.all(np.diff(breaks) >= 0.0)
    assert breaks[0] == -(angles - 2 * second - 1)
    assert breaks[-1] == angles - 2 * first - 1
    for p in range(3):
        for q in range(3):
            assert q * second - p * first in breaks
    # In a long record far lags are left out.
    _kernels.lag_breaks(1, 1, 1_000_001, far)
    assert (far[0], far[-1]) == (-129.0, 129.0)


@pytest.mark.parametrize("panels", [_kernels.PANELS, _kernels.WHOLE])
def test_panel_points_sum_a_cubic_over_every_lag(panels):
    lag, span = 40.0, 900.0
    count = (panels.size - 1) * NODES.size
    points = [
        _kernels.panel_point(number, lag, span, panels, NODES, WEIGHTS) for number in range(count)
    ]
    places, weights = np.array(points).T
    assert weights.sum() == pytest.approx(span)
    assert np.all((places > lag + 0.5) & (places < lag + span + 0.5))
    exact = ((lag + span + 0.5) ** 4 - (lag + 0.5) ** 4) / 4.0
    assert weights @ places**3 == pytest.approx(exact, rel=1e-12)


def test_products_count_how_often_the_record_holds_a_lag():
    first, second, angles, lag = 3, 5, 101, 17.0
    covariance, total = np.empty(6), np.zeros((6, 6))
    covariance[5] = (first * second) ** 2
    _kernels.add_products(lag, 2.0, first, second, angles, 0.0, covariance, total)
    starts = np.arange(angles - 2 * first)
    held = np.count_nonzero(np.isin(starts - int(lag), np.arange(angles - 2 * second)))
    assert total == pytest.approx(2.0 * held * np.outer(covariance, covariance))


@pytest.mark.parametrize(("first", "second"), [(1, 1), (2, 9), (30, 7)])
def test_summed_products_are_the_sum_over_every_lag(first, second):
    angles = 121
    found = np.full((6, 6), np.nan)
    _kernels.summed_products(
        first, second, angles, 4.5, _kernels.PANELS, _kernels.WHOLE, NODES, WEIGHTS, np.empty(27),
        np.empty(6), found,
    )  # fmt: skip
    covariance, total = np.empty(6), np.zeros((6, 6))
    covariance[5] = (first * second) ** 2
    reach = 129.0 * max(first, second)
    for lag in range(-(angles - 2 * second - 1), angles - 2 * first):
        if abs(lag) <= reach:
            _kernels.add_products(lag, 1.0, first, second, angles, 4.5, covariance, total)
    total[5, 5] = 0.0
    assert found == pytest.approx(total, rel=1e-6, abs=1e-6 * np.abs(total).max())
