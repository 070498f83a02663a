"""A factored transform: its factors, and what its two rounds make."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sagnac.spectrum.transforms import columns_of, is_balanced


@settings(deadline=None)
@given(st.integers(1, 10**8))
def test_columns_divide_the_length(length):
    assert length % columns_of(length) == 0


@pytest.mark.parametrize(
    ("length", "count"), [(2**18, 256), (10**6, 250), (131_101, 1), (3 * 131_101, 3)]
)
def test_the_divisor_nearest_the_usual_number_of_columns(length, count):
    assert columns_of(length) == count
    assert is_balanced(length) == (128 <= count <= 512)
