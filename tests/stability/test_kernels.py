"""Compiled loops against their own source, and their definitions."""

import math

import numpy as np
import pytest

from sagnac.stability import _kernels

_WALK = np.cumsum(np.random.default_rng(3).standard_normal(601))


_LAGS = np.array([1, 2, 7, 60, 190], dtype=np.int64)


_STRETCHES = (np.array([0, 120, 300]), np.array([100, 30, 301]))


_GAPPED = np.where(np.isin(np.arange(601), [0, 100, 101, 300]), np.nan, _WALK)


_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(8)


@pytest.mark.parametrize(
    ("kernel", "arguments"),
    [
        ("accumulate_deviations", (_WALK, 0.3, 2.0, np.empty(601))),
        ("subtract_ramp", (_WALK, 0.25, 1.5, 300, np.empty(601))),
        ("sum_squared_second_differences", (_WALK, _LAGS, 0, 601, np.ones(5))),
        ("sum_squared_third_differences", (_WALK, _LAGS, 0, 601, np.ones(5))),
        ("window_difference", (_WALK, 60, 3, 63, 2.0)),
        ("sum_squared_differences_in_stretches", (_WALK, *_STRETCHES, _LAGS, 2)),
        ("sum_squared_differences_in_stretches", (_WALK, *_STRETCHES, _LAGS, 3)),
        ("sum_squared_window_differences_in_stretches", (_WALK, *_STRETCHES, _LAGS)),
        ("sum_squared_differences_with_gaps", (_GAPPED, 7, 2, 0, 500)),
        ("sum_squared_differences_with_gaps", (_GAPPED, 7, 3, 9, 601)),
        ("sum_squared_arms", (_WALK[:9], _WALK[9:18], _WALK[18:27], 2.0, -1.0, 1.0)),
        ("sum_modified_total_terms", (_WALK, 9, 2)),
        ("sum_modified_total_terms", (_WALK, 10, 1)),
        ("sum_theo1_terms", (_WALK, _WALK[::-1].copy(), 24, 3)),
        ("lag_one_order", (_WALK, np.array([0, 300]), np.array([60, 50]), 5, 2)),
        ("difference_covariance", (0.7, 12.0, -1, 3)),
        ("difference_covariance", (0.0, math.inf, -2, 2)),
        ("inverse_degrees_of_freedom", (900, 300, 300.0, 1, 2, _NODES, _WEIGHTS)),
    ],
)
def test_compiled_kernels_do_what_their_source_says(kernel, arguments):
    compiled = getattr(_kernels, kernel)
    assert compiled(*arguments) == pytest.approx(compiled.py_func(*arguments), rel=1e-11)


def test_compiled_windows_do_what_their_source_says():
    compiled = _kernels.sum_squared_window_differences
    arguments = (_WALK, _LAGS, 0, 601, np.ones(5), np.arange(5.0))
    for one, other in zip(compiled(*arguments), compiled.py_func(*arguments), strict=True):
        assert one == pytest.approx(other, rel=1e-11)


@pytest.mark.parametrize("walks", [0, 1, 2, 3])
@pytest.mark.parametrize(("cluster", "counts"), [(1, [400]), (3, [90, 60])])
def test_lag_one_order_is_its_definition(walks, cluster, counts):
    """Riley and Greenhall: less a parabola, differenced until r1/(1 + r1) < 1/4."""
    angle = np.random.default_rng(26).standard_normal(500)
    for _ in range(walks):
        angle = np.cumsum(angle)
    starts, total = np.array([7, 300])[: len(counts)], sum(counts)
    stretches = []
    for start, count in zip(starts, counts, strict=True):
        taken = angle[start : start + cluster * count : cluster]
        place = np.linspace(-1.0, 1.0, count)
        stretches.append(taken - np.polyval(np.polyfit(place, taken, 2), place))
    expected = None
    for order in range(4):
        centred = [stretch - stretch.mean() for stretch in stretches]
        r1 = sum(part[:-1] @ part[1:] for part in centred) / sum(part @ part for part in centred)
        # The parabola's parameters that differencing has not undone pull r1 down.
        r1 += max(3 - order, 1) / (total / len(counts))
        expected = order + r1 / (1.0 + r1)
        if expected - order < 0.25:
            break
        stretches = [np.diff(stretch) for stretch in stretches]
    found = _kernels.lag_one_order(angle, starts, np.array(counts), cluster, 3)
    assert found == pytest.approx(expected, rel=1e-6)
