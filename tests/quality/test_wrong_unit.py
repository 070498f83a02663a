"""Rates that no gyro has."""

import numpy as np
import pytest

from sagnac.quality.check import judged
from sagnac.recording.model import Recording
from tests.quality.recordings import RATE, levels, noise, rate_gyro


def test_rates_that_no_gyro_has_are_warned_of():
    for scale in (1e-14, 1e6):
        gyro = rate_gyro(noise(scale) + 100.0 * scale)
        found = levels(Recording(gyros=(gyro,), sample_rate=RATE))
        assert any("looks wrong" in line for line in found["warning"])


def test_a_random_walk_that_no_gyro_has_is_warned_of_and_a_strong_one_is_not():
    # A standard deviation of one deg/s at RATE is N = 60/sqrt(RATE) deg/sqrt(h).
    for walk, is_said in ((10.0, False), (600.0, True)):
        gyro = rate_gyro(noise(walk / 60.0 * RATE**0.5))
        found = levels(Recording(gyros=(gyro,), sample_rate=RATE))
        assert any("unit or kind looks wrong" in line for line in found["warning"]) == is_said
        assert not found["error"]


def test_vibration_that_is_gone_from_second_to_second_is_no_wrong_unit():
    shaken = np.diff(noise(50.0), append=0.0)
    found = levels(Recording(gyros=(rate_gyro(shaken),), sample_rate=RATE))
    assert not any("looks wrong" in line for line in found["warning"])


def test_a_unit_of_time_too_large_is_named_by_its_factor():
    # Stamps in us called ms, or in ms called s: the samples cannot tell which.
    gyro = rate_gyro(noise(1e-6)[:30_000])
    (said,) = levels(Recording(gyros=(gyro,), sample_rate=0.1))["warning"]
    assert "1000 times too large" in said
    assert "time=COLUMN:ms (in place of s)" in said


@pytest.mark.parametrize("level", [(9.806,), (5.0, 8.437), (0.7, 0.714)])
def test_what_one_gyro_or_two_show_of_earths_rate_is_not_gravity(level):
    """An upright gyro shows 9.8 deg/h at 40.7 degrees of latitude; none shows 9.8 deg/s."""
    for unit, is_said in (("deg/h", False), ("deg/s", True)):
        shown = {
            name: rate + 0.2 * np.random.default_rng(seed).standard_normal(6000)
            for seed, (name, rate) in enumerate(zip("xz", level, strict=False))
        }
        still = Recording.from_arrays(**shown, kind="rate", unit=unit, sample_rate=100.0)
        assert any("gravity" in note.text for note in judged(still)) == is_said
