"""Robust levels against known noise, with lines and without."""

import math

import numpy as np
import pytest

from sagnac.noise.laws import rate_density_basis
from sagnac.spectrum.levels import robust_levels
from sagnac.spectrum.tapered import tapered_spectrum

RATE = 100.0


def levels_of(increments):
    return robust_levels(tapered_spectrum(increments, sample_rate=RATE))


def test_levels_have_no_bias_and_the_shape_they_say():
    rng = np.random.default_rng(5)
    found, shapes = [], None
    for _ in range(150):
        levels = levels_of(rng.standard_normal(8000))
        found.append(levels.level / (2.0 * RATE))
        shapes = levels.shape
    found = np.array(found)
    error = found.std(axis=0) / math.sqrt(len(found))
    assert np.all(np.abs(found.mean(axis=0) - 1.0) < 4.5 * error)
    assert np.all(np.abs(found.var(axis=0) * shapes - 1.0) < 0.5)


def test_levels_have_no_bias_where_segments_begin():
    """A long record has cells of its whole length below, and of averaged segments above."""
    rng = np.random.default_rng(15)
    found = []
    for _ in range(30):
        # Twelve segments and a bit, as of 1,600,000 samples by default.
        noise = rng.standard_normal(100_000)
        levels = robust_levels(tapered_spectrum(noise, sample_rate=RATE, segment=2**13))
        found.append(levels.level / (2.0 * RATE))
    found = np.array(found)
    error = found.std(axis=0) / math.sqrt(len(found))
    assert np.all(np.abs(found.mean(axis=0) - 1.0) < 4.5 * error)


@pytest.mark.parametrize("column", [0, 3])
def test_levels_of_steep_noise_follow_its_law(column):
    def sampled(frequency):
        # A walk that is sampled is not averaged over the interval, which takes a sixth of a step.
        step = np.array([0.0, 0.0, 0.0, 1.0 / (3.0 * RATE**2)])
        return rate_density_basis(frequency, 1.0 / RATE) + step

    rng = np.random.default_rng(6)
    ratio = []
    for _ in range(60):
        noise = rng.standard_normal(8001)
        values = np.diff(noise) if column == 0 else np.cumsum(noise[1:]) / RATE**1.5
        levels = levels_of(values)
        law = levels.law(sampled)[:, column]
        ratio.append(levels.level / law)
    ratio = np.array(ratio)
    error = ratio.std(axis=0) / math.sqrt(len(ratio))
    assert np.all(np.abs(ratio.mean(axis=0) - 1.0) < 4.5 * error + 0.03)


def test_lines_in_a_bin_do_not_move_its_level():
    rng = np.random.default_rng(7)
    time = np.arange(60_000) / RATE
    noise = rng.standard_normal(time.size)
    lines = sum(0.5 * np.sin(2 * np.pi * f * time) for f in (11.0, 11.5, 12.1, 23.0, 31.7))
    plain, with_lines = levels_of(noise), levels_of(noise + lines)
    touched = with_lines.outstanding > 0.0
    assert touched.any()
    assert np.allclose(with_lines.level[touched], plain.level[touched], rtol=0.06)


def test_masked_bands_are_left_out():
    rng = np.random.default_rng(8)
    spectrum = tapered_spectrum(rng.standard_normal(20_000), sample_rate=RATE)
    levels = robust_levels(spectrum, masked=[(9.0, 21.0)])
    assert not np.any((levels.frequency > 9.1) & (levels.frequency < 20.9))
