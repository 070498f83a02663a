"""Rates that no gyro has."""

from sagnac.recording.model import Recording
from tests.recording.recordings import RATE, levels, noise, rate_gyro


def test_rates_that_no_gyro_has_are_warned_of():
    for scale in (1e-14, 1e6):
        gyro = rate_gyro(noise(scale) + 100.0 * scale)
        found = levels(Recording(gyros=(gyro,), sample_rate=RATE))
        assert any("looks wrong" in line for line in found["warning"])
