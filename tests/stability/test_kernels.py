"""Compiled loops against their own source, and their definitions."""

import numpy as np
import pytest

from sagnac.stability import _kernels

_WALK = np.cumsum(np.random.default_rng(3).standard_normal(601))


_LAGS = np.array([1, 2, 7, 60, 190], dtype=np.int64)


_STRETCHES = (np.array([0, 120, 300]), np.array([100, 30, 301]))


_GAPPED = np.where(np.isin(np.arange(601), [0, 100, 101, 300]), np.nan, _WALK)


@pytest.mark.parametrize(
    ("kernel", "arguments"),
    [
        ("sum_squared_differences", (_WALK, _LAGS, 2, 0, 601, np.ones(5))),
        ("sum_squared_differences", (_WALK, _LAGS, 3, 0, 601, np.ones(5))),
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
