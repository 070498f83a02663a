"""Where a low-pass begins."""

import math

import numpy as np
from scipy.signal import butter, iirpeak, lfilter

from sagnac.noise.bounds import highest_coefficient, hump_above, roll_off
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
    assert 0.1 < found.cluster_time() < 60.0
    assert roll_off(levels, above=found.frequency).frequency == found.frequency
    assert math.isinf(roll_off(levels, above=2.0 * found.half).frequency)
    assert math.isinf(roll_off(levels_of(white + np.cumsum(0.02 * white))).frequency)
    assert math.isinf(roll_off(levels_of(white)).frequency)


def test_a_bound_is_of_levels_that_no_low_pass_lowers():
    white = np.random.default_rng(24).standard_normal(60_000)
    levels = levels_of(lfilter([0.1], [1.0, -0.9], white) / np.sqrt(RATE))
    bound = highest_coefficient(levels, np.full(levels.level.size, 2.0), 0.95)
    assert 1.0 < bound < 1.5


def swaying(seed, *, sensor):
    """White noise of a gyro below a bench that drifts as 1 up to a hump of sway at 2.5 Hz."""
    rng = np.random.default_rng(seed)
    drift, own = rng.standard_normal((2, 120_000))
    numerator, denominator = butter(4, 3.5 / (0.5 * RATE))
    hump = iirpeak(2.5, 2.0, fs=RATE)
    shaken = drift + 6.0 * lfilter(*hump, drift)
    return lfilter(numerator, denominator, shaken) / np.sqrt(RATE) + sensor * own / np.sqrt(RATE)


def test_a_hump_with_less_behind_it_is_told_of():
    band = (0.01, 0.5)
    found = hump_above(levels_of(swaying(3, sensor=0.2)), band, 1.0)
    assert 1.5 < found.frequency < 3.5 < found.behind
    assert found.walk > 3.0
    assert 0.17 < found.least < 0.23
    # A sensor whose own noise is as high behind the hump has its N there, too.
    assert hump_above(levels_of(swaying(4, sensor=1.0)), band, 1.0) is None


def test_a_low_pass_alone_is_no_hump():
    white = np.random.default_rng(13).standard_normal(60_000)
    levels = levels_of(lfilter([0.2], [1.0, -0.8], white))
    assert hump_above(levels, (0.01, 0.5), math.sqrt(RATE)) is None
