"""Sums over table angle and over tones, against direct sums."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sagnac.core import arrays
from sagnac.spectrum import sums
from sagnac.spectrum.sums import angle_series, angle_sums, tone_sums
from tests.spectrum.examples import as_series


@settings(max_examples=40, deadline=None)
@given(st.integers(1, 40), st.integers(1, 30), st.integers(0, 2**32 - 1))
def test_angle_sums_are_the_direct_sums(samples, orders, seed):
    generator = np.random.default_rng(seed)
    # Any number of turns, in either direction.
    phase = generator.uniform(-300.0, 300.0, samples)
    strengths = generator.standard_normal(samples)
    sums = angle_sums(phase, strengths, orders)
    direct = [np.sum(strengths * np.exp(-1j * k * phase)) for k in range(orders + 1)]
    # The transform is good to 1e-9 of the strengths' sum.
    assert sums == pytest.approx(np.array(direct), abs=3e-9 * np.abs(strengths).sum())


@pytest.mark.parametrize("several", [1, 2, 5])
def test_angle_sums_of_several_strengths(several):
    generator = np.random.default_rng(several)
    phase = generator.uniform(-30.0, 30.0, 200)
    strengths = generator.standard_normal((several, 200))
    direct = strengths @ np.exp(-1j * np.outer(phase, np.arange(41)))
    sums = angle_sums(phase, strengths, 40)
    assert sums.shape == (several, 41)
    np.testing.assert_allclose(sums, direct, atol=2e-7)


@settings(max_examples=40, deadline=None)
@given(st.integers(1, 40), st.integers(0, 30), st.integers(0, 2**32 - 1))
def test_angle_series_is_the_direct_series(samples, orders, seed):
    generator = np.random.default_rng(seed)
    phase = generator.uniform(-300.0, 300.0, samples)
    sums = generator.standard_normal(orders + 1) + 1j * generator.standard_normal(orders + 1)
    direct = sum((c * np.exp(1j * k * phase)).real for k, c in enumerate(sums))
    total = np.abs(sums).sum()
    made = angle_series(phase, sums)
    assert made == pytest.approx(direct, abs=3e-9 * total)


def exact_phase(frequency, numbers, center):
    """2 pi f (n - center) without whole turns; fractions do not round."""
    cycles = (Fraction(frequency) * (Fraction(int(n)) - Fraction(center)) for n in numbers)
    return 2.0 * np.pi * np.array([float(turns - round(turns)) for turns in cycles])


def naive_tone_sums(values, frequencies):
    numbers, center = np.arange(values.size), 0.5 * (values.size - 1)
    lags = 2.0 * np.pi * (numbers - center) / (values.size + 1)
    sums = np.empty((2, len(frequencies)), dtype=complex)
    for index, frequency in enumerate(frequencies):
        waved = values * np.exp(1j * exact_phase(frequency, numbers, center))
        sums[:, index] = waved.sum(), (waved * lags).sum()
    return sums


@settings(max_examples=40, deadline=None)
@given(st.integers(1, 1400), st.integers(0, 5), st.integers(0, 2**32 - 1))
def test_tone_sums_are_the_direct_sums(samples, tones, seed):
    generator = np.random.default_rng(seed)
    values = generator.standard_normal(samples)
    frequencies = generator.uniform(-0.5, 0.5, tones)
    sums = tone_sums(values, frequencies)
    atol = 3e-14 * np.abs(values).sum()
    np.testing.assert_allclose(sums, naive_tone_sums(values, frequencies), atol=atol)


def test_tone_sums_by_spans_and_of_a_mapped_series(monkeypatch):
    generator = np.random.default_rng(5)
    values = generator.standard_normal(1800)
    frequencies = generator.uniform(0.0, 0.5, 40)
    monkeypatch.setattr(arrays, "IN_MEMORY", 100)
    monkeypatch.setattr(arrays, "BLOCK", 300)
    monkeypatch.setattr("sagnac.spectrum.sums._TONES_AT_ONCE", 16)
    sums = tone_sums(as_series(values), frequencies)
    np.testing.assert_allclose(sums, naive_tone_sums(values, frequencies), atol=1e-10)


@pytest.mark.parametrize(("start", "count"), [(0, 1), (0, 700), (43_000_001, 1100)])
@pytest.mark.parametrize("tones", [0, 1, 30])
def test_tones_are_the_direct_sum(monkeypatch, start, count, tones):
    monkeypatch.setattr("sagnac.spectrum.sums._TONES_AT_ONCE", 16)
    generator = np.random.default_rng(tones)
    frequencies = generator.uniform(-0.5, 0.5, tones)
    cosine, sine = generator.standard_normal((2, tones))
    center = 21_599_999.5
    made = sums.tones(start, count, center, frequencies, cosine + 1j * sine)
    direct = np.zeros(count)
    for frequency, c, s in zip(frequencies, cosine, sine, strict=True):
        phase = exact_phase(frequency, range(start, start + count), center)
        direct += c * np.cos(phase) + s * np.sin(phase)
    np.testing.assert_allclose(made, direct, rtol=0.0, atol=1e-14 * np.hypot(cosine, sine).sum())
