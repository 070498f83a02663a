"""The quick median against the middle of the sorted values."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.ndimage import median_filter

from sagnac.spectrum.power_laws import median, running_median


@settings(max_examples=60, deadline=None)
@given(
    st.integers(1, 6000),
    st.sampled_from(["exponential", "ties", "rising", "every eighth"]),
    st.integers(0, 2**32 - 1),
)
def test_the_median_is_the_middle_value(size, kind, seed):
    values = np.random.default_rng(seed).exponential(size=size)
    if kind == "ties":
        values = np.floor(2.0 * values)
    elif kind == "rising":
        values = np.sort(values)
    elif kind == "every eighth":
        values[::8] = 1e3
    ordered = np.sort(values)
    middle = 0.5 * (ordered[(size - 1) // 2] + ordered[size // 2])
    assert median(values) == middle


@pytest.mark.parametrize("size", [1, 5, 41, 300])
def test_the_running_median_is_that_of_scipy(size):
    values = np.random.default_rng(size).exponential(size=size)
    wanted = median_filter(values, 41, mode="nearest")
    np.testing.assert_array_equal(running_median(values, 41), wanted)
