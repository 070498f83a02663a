"""Compiled loops against their own source, and their definitions."""

import numpy as np
import pytest

from sagnac.stability import _kernels

_WALK = np.cumsum(np.random.default_rng(3).standard_normal(601))


_LAGS = np.array([1, 2, 7, 60, 190], dtype=np.int64)


_STRETCHES = np.array([[0, 100], [120, 150], [300, 601]])


@pytest.mark.parametrize(
    ("kernel", "arguments"),
    [
        ("sum_modified_total_terms", (_WALK, 9, 2)),
        ("sum_modified_total_terms", (_WALK, 10, 1)),
        ("sum_theo1_terms", (_WALK, _WALK[::-1].copy(), 24, 3)),
    ],
)
def test_compiled_kernels_do_what_their_source_says(kernel, arguments):
    compiled = getattr(_kernels, kernel)
    assert compiled(*arguments) == pytest.approx(compiled.py_func(*arguments), rel=1e-11)


@pytest.mark.parametrize(
    ("kernel", "arguments", "outputs"),
    [
        ("sum_squared_differences", (2, 0, 601), 1),
        ("sum_squared_differences", (3, 60, 400), 1),
        ("sum_squared_window_differences", (0, 601), 2),
    ],
)
def test_compiled_sums_do_what_their_source_says(kernel, arguments, outputs):
    compiled = getattr(_kernels, kernel)
    one, other = np.ones((2, outputs, 5))
    compiled(_WALK, _STRETCHES, _LAGS, *arguments, *one)
    compiled.py_func(_WALK, _STRETCHES, _LAGS, *arguments, *other)
    assert one == pytest.approx(other, rel=1e-11)
