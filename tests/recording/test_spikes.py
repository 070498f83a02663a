"""Single samples far off their neighbours."""

import numpy as np
import pytest

from sagnac.recording.spikes import find_spikes, without_spikes
from sagnac.rig.gallery import Gyro, spiked

RATE = 100.0


def test_spikes_are_found_and_weighed():
    rng = np.random.default_rng(15)
    gyro = spiked(rng, 40_000, RATE, gyro=Gyro(), every=10.0, height=40.0)
    found = find_spikes(gyro.increments, sample_rate=RATE)
    assert 25 <= found.index.size <= 60
    before, after = np.var(gyro.increments), np.var(without_spikes(gyro.increments, found))
    assert after * RATE == pytest.approx(1.0, rel=0.02)
    assert found.added_walk**2 == pytest.approx((before - after) * RATE, rel=0.1)
    assert find_spikes(rng.standard_normal(40_000), sample_rate=RATE).index.size == 0
