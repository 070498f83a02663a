"""Fourier and cosine transforms against direct sums and against one whole transform."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.fft import dct, idct

from sagnac.core import arrays
from sagnac.spectrum.periodogram import periodogram
from sagnac.spectrum.transforms import (
    cosine_length,
    cosine_transform,
    even_then_odd,
    is_balanced,
    power_spectrum,
    sine_taper,
    transform_length,
)
from tests.spectrum.examples import as_series


@settings(deadline=None)
@given(st.integers(2, 3_000_000))
def test_transform_length_is_even_and_long_enough(samples):
    length = transform_length(samples)
    assert length % 2 == 0
    assert samples <= length <= 1.1 * samples + 8


@pytest.mark.parametrize("mapped", [False, True])
@pytest.mark.parametrize(
    ("samples", "padding"), [(131_072, 1), (150_001, 1), (140_003, 2), (65_537, 2), (90_000, 3)]
)
def test_a_long_periodogram_is_that_of_one_transform(monkeypatch, samples, padding, mapped):
    steps = np.random.default_rng(samples).standard_normal(samples)
    if mapped:
        monkeypatch.setattr(arrays, "IN_MEMORY", 1000)
        monkeypatch.setattr(arrays, "BLOCK", 7000)
    power = periodogram(as_series(steps), padding)
    assert arrays.is_mapped(power) == mapped
    length = padding * transform_length(samples)
    expected = np.abs(np.fft.rfft(steps, length)) ** 2 / samples
    assert power.size == length // 2 + 1
    np.testing.assert_allclose(power, expected, rtol=1e-11, atol=1e-12)


@pytest.mark.parametrize("size", [1.0, 30.0, 1e3])
def test_single_precision_adds_little_beside_a_line(size):
    # Beyond the leakage of a line on a whole bin nothing but noise of unit power is left.
    samples = 150_000
    steps = np.random.default_rng(5).standard_normal(samples)
    steps += size * np.cos(2.0 * np.pi * 12_345 / samples * np.arange(samples))
    exact, single = (periodogram(steps, 2, single=one) for one in (False, True))
    amplitude = np.abs(np.sqrt(single) - np.sqrt(exact))
    usual = np.sqrt(exact.mean())
    assert 0.0 < np.sqrt(np.mean(amplitude**2)) < 2e-7 * usual
    assert amplitude.max() < 1e-4 * usual


@settings(max_examples=30, deadline=None)
@given(st.integers(2, 3000), st.integers(1, 3), st.integers(2, 60), st.integers(0, 2**32 - 1))
def test_a_factored_transform_of_any_length(samples, padding, columns, seed):
    steps = np.random.default_rng(seed).standard_normal(samples)
    length = padding * transform_length(samples)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("sagnac.spectrum.transforms._FACTORED", 0)
        patch.setattr("sagnac.spectrum.transforms._COLUMNS", columns)
        patch.setattr("sagnac.spectrum.transforms._COMBINED", 16)
        power = periodogram(steps, padding)
    expected = np.abs(np.fft.rfft(steps, length)) ** 2 / samples
    np.testing.assert_allclose(power, expected, rtol=1e-9, atol=1e-12)


@settings(max_examples=60, deadline=None)
@given(st.integers(1, 3000), st.integers(2, 60), st.booleans(), st.integers(0, 2**32 - 1))
def test_cosine_transform_is_the_direct_sum(samples, columns, mapped, seed):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("sagnac.spectrum.transforms._FACTORED", 500)
        patch.setattr("sagnac.spectrum.transforms._COLUMNS", columns)
        patch.setattr("sagnac.spectrum.transforms._COMBINED", 16)
        if mapped:
            patch.setattr(arrays, "IN_MEMORY", 100)
            patch.setattr(arrays, "BLOCK", 700)
        length = cosine_length(samples)
        values = np.random.default_rng(seed).standard_normal(length)
        transform = cosine_transform(as_series(values))
    assert samples - 2 * columns < length <= samples
    place = np.pi * np.outer(np.arange(length), np.arange(length) + 0.5) / length
    expected = np.sqrt(2.0 / length) * (np.cos(place) @ values)
    expected[0] /= np.sqrt(2.0)
    np.testing.assert_allclose(transform, expected, atol=1e-10)


@pytest.mark.parametrize("mapped", [False, True])
@pytest.mark.parametrize("samples", [131_072, 131_101, 200_003, 262_147])
def test_a_long_cosine_transform_turns_back_into_its_values(monkeypatch, samples, mapped):
    if mapped:
        monkeypatch.setattr(arrays, "IN_MEMORY", 1000)
        monkeypatch.setattr(arrays, "BLOCK", 7000)
    length = cosine_length(samples)
    assert samples - 10 < length <= samples
    values = np.random.default_rng(samples).standard_normal(length)
    transform = cosine_transform(as_series(values))
    assert arrays.is_mapped(transform) == mapped
    np.testing.assert_allclose(idct(transform, type=2, norm="ortho"), values, atol=1e-12)


@settings(max_examples=40, deadline=None)
@given(st.integers(1, 200), st.integers(1, 210))
def test_even_then_odd_by_blocks_is_that_of_the_whole(samples, length):
    values = np.arange(float(samples))
    whole = np.concatenate([values[::2], values[1::2][::-1]])
    for block in arrays.blocks(samples, length):
        np.testing.assert_array_equal(even_then_odd(values, block), whole[block])


@pytest.mark.parametrize(("first", "last"), [(0, 5), (0, 2000), (700, 1900), (1999, 2000)])
@pytest.mark.parametrize("order", [1, 4])
def test_a_block_of_a_sine_taper(first, last, order):
    expected = np.sin(np.pi * order * (np.arange(2000) + 1) / 2001)[first:last]
    np.testing.assert_allclose(sine_taper(2000, order, first, last), expected, atol=1e-13)


def test_a_tapered_power_spectrum_is_that_of_the_tapered_values():
    values = np.random.default_rng(3).standard_normal(500)
    tapered = values * np.sin(np.pi * 2 * np.arange(1, 501) / 501)
    expected = 0.3 * np.abs(np.fft.rfft(tapered, 512)) ** 2
    np.testing.assert_allclose(power_spectrum(values, 512, 0.3, 2), expected, rtol=1e-9, atol=1e-12)


def is_quick(length):
    """Whether a length is balanced and has no prime factor above 31, by trial division."""
    rest = length
    for divisor in range(2, 32):
        while rest % divisor == 0:
            rest //= divisor
    return rest == 1 and is_balanced(length)


def test_cosine_length_is_the_next_quick_one():
    assert cosine_length(1000) == 1000
    for samples in (131_072, 131_101, 1_299_709, 3_599_999):
        length = cosine_length(samples)
        assert is_quick(length)
        assert not any(is_quick(more) for more in range(length + 1, samples + 1))


def test_cosine_length_leaves_few_samples_out_if_no_length_near_is_quick(monkeypatch):
    monkeypatch.setattr("sagnac.spectrum.transforms._SMALL_PRIMES", 1)
    length = cosine_length(1_299_709)
    assert is_balanced(length)
    assert not any(is_balanced(more) for more in range(length + 1, 1_299_710))


def test_a_short_cosine_transform_is_that_of_scipy():
    values = np.random.default_rng(4).standard_normal(1001)
    np.testing.assert_array_equal(cosine_transform(values), dct(values, type=2, norm="ortho"))
