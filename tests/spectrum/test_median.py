"""The quick median against the middle of the sorted values."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from sagnac.spectrum.median import median


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
