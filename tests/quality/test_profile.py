"""The noise of a channel, in one pass."""

import numpy as np
import pytest

from sagnac.quality.profile import Profile
from sagnac.recording.channel import Channel

STEP = 0.001 / 206_264.8  # 0.001 arcsec, rad


@pytest.mark.parametrize("turned", [0.0, 1.0, 300.0])
def test_the_step_of_a_readout_is_found_however_far_the_angle_has_turned(turned):
    generator = np.random.default_rng(4)
    walk = np.cumsum(0.1 * generator.standard_normal(50_000)) + np.arange(50_000) * 0.01
    angle = turned + STEP * np.round(walk)
    profile = Profile(
        sample_rate=1.0, channel=Channel(name="x", kind="angle", shown_in="rad", values=angle)
    )
    assert profile.step == pytest.approx(STEP, rel=1e-4)
    assert profile.is_coarse
