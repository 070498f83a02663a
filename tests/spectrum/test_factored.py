"""A factored transform: its factors, and what its two rounds make."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sagnac.core import arrays
from sagnac.spectrum.transforms import columns_of, factored, is_balanced


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


@pytest.mark.parametrize("mapped", [False, True])
@pytest.mark.parametrize("dtype", [np.complex64, np.complex128])
@pytest.mark.parametrize("samples", [55, 60])
def test_two_rounds_are_the_whole_transform(monkeypatch, mapped, dtype, samples):
    monkeypatch.setattr("sagnac.spectrum.transforms._COLUMNS", 6)
    monkeypatch.setattr("sagnac.spectrum.transforms._COMBINED", 4)
    monkeypatch.setattr(arrays, "IN_MEMORY", 0 if mapped else 1000)
    values = np.random.default_rng(1).standard_normal(samples)
    whole = np.fft.fft(values, 60)
    stored = []

    def store(result, first, block):
        result[:, first : first + block.shape[1]] = block.real
        stored.append((first, block.copy()))

    made = factored(values.__getitem__, samples, 60, 57, store, dtype=dtype)
    assert made.size == 57
    assert arrays.is_mapped(made) == mapped
    assert [first for first, _ in stored] == [0, 4]
    for start, block in stored:
        assert block.shape[0] == columns_of(60) == 6
        for row, sums in enumerate(block):
            first = start + 10 * row
            np.testing.assert_allclose(sums, whole[first : first + sums.size], atol=1e-5)
            here = slice(first, min(first + sums.size, 57))
            expected = whole[here].real
            atol = 1e-12 if dtype is np.complex128 else 1e-5
            np.testing.assert_allclose(made[here], expected, atol=atol)
