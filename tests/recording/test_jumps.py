"""Single steps far outside the rest."""

import numpy as np

from sagnac.recording.jumps import jump_notes
from sagnac.recording.model import Recording
from tests.recording.recordings import RATE, noise, rate_gyro


def test_a_step_is_said_with_its_place_and_the_longer_side():
    values = noise(0.05)
    values[7000:] += 500.0
    gyro = rate_gyro(values)
    (note,) = jump_notes(Recording(gyros=(gyro,), sample_rate=RATE), gyro)
    assert (note.level, note.channel) == ("warning", "x")
    assert note.text == (
        "1 jump of over 20 times the usual step, the first at 70.000 s; "
        "take the sound stretch with {slice 70.01:}"
    )


def test_noise_and_a_still_channel_have_no_jumps():
    for values in (noise(1.0), np.zeros(1000)):
        gyro = rate_gyro(values)
        assert jump_notes(Recording(gyros=(gyro,), sample_rate=RATE), gyro) == ()
