"""Dither taken out by its pick-off: against plain least squares, and against what was put in."""

import numpy as np
import pytest

from sagnac.lines.stripping import stripped


def swings(samples, seed=0, frequency=0.7746, randomness=0.05):
    """A randomised swing of one cycle in 1/frequency samples: above half the rate it folds."""
    random = np.random.default_rng(seed)
    steps = np.array([1.0, 1.0j]) @ random.standard_normal((2, samples)) * 0.05 * randomness
    shaken = np.empty(samples, dtype=complex)
    now = 0.0
    for n, step in enumerate(steps):
        now = 0.998 * now + step
        shaken[n] = now
    turning = np.exp(2j * np.pi * frequency * np.arange(samples))
    return (1.0 + shaken) * turning


def test_the_taps_are_those_of_plain_least_squares():
    random = np.random.default_rng(1)
    pickoff = random.standard_normal(500)
    angle = 0.01 * np.cumsum(random.standard_normal(500)) + 0.3 * pickoff
    steps = np.diff(pickoff)
    columns = np.stack([steps[:-2], steps[1:-1], steps[2:], np.ones(497)], axis=1)
    plain = np.linalg.lstsq(columns, np.diff(angle)[1:-1], rcond=None)[0]
    left, _ = stripped(angle, pickoff)
    follows = plain[0] * pickoff[:-2] + plain[1] * pickoff[1:-1] + plain[2] * pickoff[2:]
    offset = angle[1:-1] - follows - left[1:-1]
    assert np.ptp(offset) < 1e-12


def test_a_long_series_is_stripped_as_a_short_one():
    # Longer than a block of `series`, of which the ends have to meet.
    swing = swings(300_000)
    pickoff, residue = swing.real, np.real(0.01 * np.exp(0.8j) * swing)
    left = stripped(residue, pickoff)[0]
    # What the taps do not follow is the random change of the swing from one sample to the next:
    # 0.0025 rms in each of its two components here. Ends and seams are no worse.
    assert np.abs(left).max() < 5.0 * 0.01 * 0.0025 * np.sqrt(2.0)


@pytest.mark.parametrize("gain", [0.01, 0.01j, -0.002 + 0.005j])
def test_any_gain_and_delay_is_found_under_motion_and_noise(gain):
    samples = 200_000
    swing = swings(samples, seed=3)
    random = np.random.default_rng(4)
    table = 0.09 * np.arange(samples) + 1e-3 * np.sin(0.01 * np.arange(samples))
    walk = 1e-4 * np.cumsum(random.standard_normal(samples))
    pickoff = 5.0 + 1e3 * swing.real + 0.1 * random.standard_normal(samples)
    left, taken = stripped(table + walk + np.real(gain * swing), pickoff)
    left = left - table - walk
    left -= left.mean()
    # The swing's change from one sample to the next, 0.0025 rms, is not followed in quadrature.
    # Beside it stand the pick-off's noise, 1e-4 of the swing, and motion of 1e-5 a step, which
    # leaves 1e-5 sqrt(2 / n).
    assert np.sqrt(np.mean(left**2)) < 0.0025 * abs(np.imag(gain)) + 2e-6
    assert taken == pytest.approx(abs(gain) / np.sqrt(2.0), rel=0.01)


def test_an_angle_without_dither_is_left_as_it_is():
    samples = 100_000
    random = np.random.default_rng(5)
    walk = np.cumsum(random.standard_normal(samples))
    left = stripped(walk, swings(samples, seed=6).real)[0]
    taken = np.std(np.diff(left - walk)) / np.std(np.diff(walk))
    assert taken < 5.0 / np.sqrt(samples)


def test_refusals():
    with pytest.raises(ValueError, match="one length"):
        stripped(np.zeros(200), np.zeros(199))
    with pytest.raises(ValueError, match="100 samples or more"):
        stripped(np.zeros(50), np.ones(50))
    with pytest.raises(ValueError, match="does not move"):
        stripped(np.arange(200.0), np.ones(200))
