"""Where a low-pass begins."""

import math

import numpy as np
from scipy.signal import lfilter

from sagnac.coefficients.bounds import highest_coefficient, roll_off, unlowered
from sagnac.spectrum.levels import robust_levels
from sagnac.spectrum.tapered import tapered_spectrum

RATE = 100.0


def levels_of(increments):
    return robust_levels(tapered_spectrum(increments, sample_rate=RATE))


def test_roll_off_is_seen_and_a_floor_is_not():
    rng = np.random.default_rng(13)
    white = rng.standard_normal(60_000)
    levels = levels_of(lfilter([0.2], [1.0, -0.8], white))
    found = roll_off(levels)
    assert 0.8 < found.frequency < 4.0
    assert not unlowered([0.1], found)[0]
    assert unlowered([60.0], found)[0]
    assert math.isinf(roll_off(levels_of(white + np.cumsum(0.02 * white))).frequency)
    assert math.isinf(roll_off(levels_of(white)).frequency)


def test_a_bound_is_of_levels_that_no_low_pass_lowers():
    white = np.random.default_rng(24).standard_normal(60_000)
    levels = levels_of(lfilter([0.1], [1.0, -0.9], white) / np.sqrt(RATE))
    bound = highest_coefficient(levels, np.full(levels.level.size, 2.0), 0.95)
    assert 1.0 < bound < 1.5
