"""The rounds of a factored transform, one by one."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sagnac.spectrum.transforms import (
    Factors,
    combine_columns,
    factored,
    factors,
    scratch,
    split,
    transform_columns,
)


@settings(deadline=None)
@given(st.integers(1, 10**8))
def test_factors_make_up_the_length(length):
    by = factors(length)
    assert by.count * by.size == by.length == length


@pytest.mark.parametrize(
    ("length", "count"), [(2**18, 256), (10**6, 250), (131_101, 1), (3 * 131_101, 3)]
)
def test_the_divisor_nearest_the_usual_number_of_columns(length, count):
    assert factors(length).count == count
    assert factors(length).is_balanced == (128 <= count <= 512)


def test_split_deals_samples_into_rows_and_ends_with_zeros():
    by = Factors(count=4, size=5)
    with scratch(4, 3, np.float64) as columns:
        split(np.arange(1.0, 11.0), by, columns)
        rows = columns.read(slice(0, 4), slice(0, 3)).copy()
    np.testing.assert_array_equal(rows, [[1, 5, 9], [2, 6, 10], [3, 7, 0], [4, 8, 0]])


def test_rounds_are_the_transforms_they_say():
    generator = np.random.default_rng(0)
    by = Factors(count=6, size=10)
    values = generator.standard_normal((6, 10))
    with scratch(6, 6, np.complex128) as spectra:
        spectra.as_real().write(0, 0, values)
        transform_columns(spectra, by, 10)
        first = spectra.read(slice(0, 6), slice(0, 6)).copy()
        blocks = []
        combine_columns(spectra, by, lambda first, block: blocks.append((first, block)))
    np.testing.assert_allclose(first, np.fft.rfft(values), atol=1e-12)
    whole = np.fft.fft(values.T.reshape(-1))
    for start, block in blocks:
        for row, sums in enumerate(block):
            first = start + 10 * row
            np.testing.assert_allclose(sums, whole[first : first + sums.size], atol=1e-12)


def test_what_is_stored_comes_back_as_an_array():
    values = np.random.default_rng(1).standard_normal(55)

    def store(result, first, block):
        result.write(0, first, block.real)

    made = factored(values, Factors(count=6, size=10), 60, store)
    expected = np.fft.fft(values, 60).real
    for row in range(6):
        here = slice(10 * row, 10 * row + 6)
        np.testing.assert_allclose(made[here], expected[here], atol=1e-12)
