"""Channels that stick at one value."""

import numpy as np
import pytest

from sagnac.quality.check import integrity
from sagnac.quality.samples import stuck_run
from sagnac.recording.channel import Channel
from sagnac.recording.model import Recording
from tests.quality.recordings import RATE, SAMPLES, noise, rate_gyro


@pytest.mark.parametrize("step", [0.3, 1.0, 5.0, 20.0])
@pytest.mark.parametrize("kind", ["angle", "increment"])
def test_a_quiet_quantized_gyro_is_not_stuck(step, kind):
    for seed in range(5):
        angle = np.cumsum(noise(0.05, seed)) + 0.002 * np.arange(SAMPLES)
        counts = np.rint(angle / step)
        values = counts if kind == "angle" else np.diff(counts, prepend=0.0)
        gyro = Channel(name="x", kind=kind, shown_in="arcsec", values=values * 1e-6)
        recording = Recording(gyros=(gyro,), sample_rate=RATE)
        assert not [finding for finding in integrity(recording) if "stuck" in str(finding)]


@pytest.mark.parametrize("length", [400, 2000])
@pytest.mark.parametrize("quantum", [0.0, 0.1])
def test_a_channel_that_sticks_once_is_found_where_it_does(length, quantum):
    values = noise(0.05)
    values = np.rint(values / quantum) * quantum if quantum else values
    values[5000 : 5000 + length] = values[5000]
    findings = integrity(Recording(gyros=(rate_gyro(values),), sample_rate=RATE))
    assert findings[0].level == "error"
    assert f"for {length}" in findings[0].text or quantum
    assert "50.0" in findings[0].text or quantum


def test_a_run_is_stuck_beside_short_ones_only():
    short = np.random.default_rng(0).normal(size=500)
    stuck = np.concatenate([short, np.full(150, 9.0), short])
    assert stuck_run(stuck) == slice(500, 650)
    # The tenth longest run is a tenth as long.
    often = np.concatenate([stuck, *[np.full(15, 20.0 + n) for n in range(10)]])
    assert stuck_run(often) is None
    assert stuck_run(np.zeros(20)) == slice(0, 20)
