"""Jumps and saturation."""

import numpy as np

from sagnac.recording.model import Recording
from sagnac.recording.saturation import next_inwards
from tests.recording.recordings import RATE, levels, noise, rate_gyro


def test_jumps_and_saturation_are_warned_of():
    values = noise(0.05)
    values[7000:] += 500.0
    found = levels(Recording(gyros=(rate_gyro(values),), sample_rate=RATE))
    assert any("1 jump" in line and "70.000 s" in line for line in found["warning"])
    clipped = np.clip(noise(0.05), -0.1, 0.09)
    found = levels(Recording(gyros=(rate_gyro(clipped),), sample_rate=RATE))
    assert len([line for line in found["warning"] if "saturated" in line]) == 2
    for sound in (noise(0.05), np.rint(noise(3.0)), np.rint(noise(0.3))):
        assert levels(Recording(gyros=(rate_gyro(sound),), sample_rate=RATE))["warning"] == []


def test_the_value_next_to_an_extreme_one():
    values = np.array([3.0, -1.0, 5.0, 5.0, 4.5, -2.0])
    assert next_inwards(values, 5.0, "upper") == 4.5
    assert next_inwards(values, -2.0, "lower") == -1.0
    assert next_inwards(np.ones(4), 1.0, "upper") == -np.inf
    assert next_inwards(np.ones(4), 1.0, "lower") == np.inf
