"""Tapered spectra against the tapers themselves."""

import numpy as np
import pytest

from sagnac.core import arrays
from sagnac.spectrum.periodogram import multitaper, periodogram
from sagnac.spectrum.transforms import transform_length
from tests.spectrum.examples import SAMPLES, as_series


def test_multitaper_is_the_mean_over_orthonormal_tapers():
    values = np.random.default_rng(11).standard_normal(90)
    size = values.size
    length = transform_length(size)
    n, frequency = np.arange(size), np.arange(length // 2 + 1) / length
    wave = np.exp(-2j * np.pi * np.outer(frequency, n))
    tapers = [
        np.sqrt(2.0 / (size + 1)) * np.sin(np.pi * k * (n + 1) / (size + 1)) for k in (1, 2, 3)
    ]
    np.testing.assert_allclose(np.array(tapers) @ np.array(tapers).T, np.eye(3), atol=1e-12)
    expected = np.mean([np.abs(wave @ (taper * values)) ** 2 for taper in tapers], axis=0)
    np.testing.assert_allclose(multitaper(values, 3), expected, rtol=1e-9)


def test_multitaper_of_a_mapped_series(monkeypatch):
    values = np.random.default_rng(13).standard_normal(135_000)
    monkeypatch.setattr(arrays, "IN_MEMORY", 1000)
    monkeypatch.setattr(arrays, "BLOCK", 7000)
    power = multitaper(as_series(values), 2)
    assert arrays.is_mapped(power)
    size = values.size
    place = np.pi * np.arange(1, size + 1) / (size + 1)
    expected = sum(
        np.abs(np.fft.rfft(values * np.sin(k * place), transform_length(size))) ** 2 for k in (1, 2)
    ) / (size + 1)
    np.testing.assert_allclose(power, expected, rtol=1e-9, atol=1e-12)


def test_multitaper_of_a_walk_has_no_leakage_where_a_periodogram_has():
    generator = np.random.default_rng(12)
    frequency = np.fft.rfftfreq(transform_length(SAMPLES))
    law = 1.0 / (4.0 * np.sin(np.pi * frequency[200:]) ** 2)
    ratios = {"multitaper": [], "periodogram": []}
    for _ in range(20):
        walk = np.cumsum(generator.standard_normal(SAMPLES))
        for name, ratio in ratios.items():
            ratio.append(
                np.mean(
                    {"multitaper": multitaper, "periodogram": periodogram}[name](
                        walk - walk.mean()
                    )[200:]
                    / law
                )
            )
    assert np.mean(ratios["multitaper"]) == pytest.approx(1.0, abs=0.01)
    assert np.mean(ratios["periodogram"]) > 1.3
