"""Periodograms and their bins against sums."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sagnac.core import arrays
from sagnac.spectrum.periodogram import bin_sums, density, periodogram, smoothed
from sagnac.spectrum.transforms import transform_length
from tests.spectrum.examples import SAMPLES, as_series


@settings(max_examples=40, deadline=None)
@given(st.integers(2, 60), st.integers(1, 3), st.integers(0, 2**32 - 1))
def test_periodogram_is_the_square_of_the_fourier_sum(samples, padding, seed):
    steps = np.random.default_rng(seed).standard_normal(samples)
    power = periodogram(steps, padding)
    length = padding * transform_length(samples)
    number = np.arange(samples)
    direct = [
        np.sum(steps * np.exp(-2j * np.pi * bin_ * number / length)) for bin_ in range(power.size)
    ]
    assert power.size == length // 2 + 1
    assert power == pytest.approx(np.abs(direct) ** 2 / samples, abs=1e-11)


@pytest.mark.parametrize("block", [5, 200, 10_000])
def test_bin_sums_go_from_each_edge_to_before_the_next(monkeypatch, block):
    monkeypatch.setattr("sagnac.spectrum.periodogram.BLOCK", block)
    values = np.random.default_rng(0).standard_normal(1000)
    edges = np.array([3, 4, 10, 99, 100, 101, 350, 500, 997])
    expected = [values[one:other].sum() for one, other in pairwise(edges)]
    found = bin_sums(values, edges)
    np.testing.assert_allclose(found, expected, atol=1e-12)


def test_density_of_white_rate_noise_is_one_sided():
    # Angle increments of a rate with density N^2 (two-sided) have variance N^2 / rate; the
    # one-sided density is twice N^2.
    n, rate = 2.5e-9, 250.0
    assert density(np.array([n**2 / rate]), rate)[0] == pytest.approx(2.0 * n**2, rel=1e-9, abs=0.0)


def test_smoothed_keeps_power_and_peaks():
    power = np.ones(SAMPLES // 2 + 1)
    power[12_345] = 1e6
    frequency, mean = smoothed(power)
    assert np.all(np.diff(frequency) > 0.0)
    assert frequency.size <= 2000
    at = np.argmax(mean)
    assert frequency[at] == pytest.approx(12_345 / SAMPLES, rel=5e-3)
    assert np.delete(mean, at) == pytest.approx(1.0)
    # Narrow at the low end: the first bins are the periodogram's own.
    assert frequency[:5] * SAMPLES == pytest.approx([1, 2, 3, 4, 5])


def test_smoothed_power_by_spans_is_the_mean_over_each_bin(monkeypatch):
    monkeypatch.setattr(arrays, "IN_MEMORY", 1000)
    monkeypatch.setattr(arrays, "BLOCK", 700)
    power = np.random.default_rng(6).exponential(size=9000)
    frequency, mean = smoothed(as_series(power), 300)
    edges = np.unique(np.floor(np.geomspace(1, power.size, 301)).astype(int))
    means = [power[low:high].mean() for low, high in pairwise(edges)]
    centers = [np.mean(np.arange(low, high)) for low, high in pairwise(edges)]
    np.testing.assert_allclose(mean, means, rtol=1e-12)
    np.testing.assert_allclose(frequency, np.array(centers) / (2 * (power.size - 1)), rtol=1e-12)
