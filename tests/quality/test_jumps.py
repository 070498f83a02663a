"""Single steps far outside the rest."""

import numpy as np

from sagnac.core.errors import Note
from sagnac.quality.distribution import jump_notes
from sagnac.quality.profile import Profile
from sagnac.recording.channel import Channel
from sagnac.recording.model import Recording
from tests.quality.recordings import DEGREE, RATE, SECONDS, noise, rate_gyro


def jumps(channel: Channel) -> tuple[Note, ...]:
    recording = Recording(gyros=(channel,), sample_rate=RATE)
    return jump_notes(recording, Profile.of(recording, channel))


def test_a_step_is_said_with_its_place_and_the_longer_side():
    values = noise(0.05)
    values[7000:] += 500.0
    gyro = rate_gyro(values)
    (note,) = jumps(gyro)
    assert (note.level, note.channel) == ("warning", "x")
    assert note.text == (
        "1 jump of over 20 times the usual step, the first at 70.000 s; "
        "take the sound stretch with {slice 70.01:}"
    )


def test_noise_and_a_still_channel_have_no_jumps():
    for values in (noise(1.0), np.zeros(1000)):
        gyro = rate_gyro(values)
        assert jumps(gyro) == ()


def test_a_line_in_whole_samples_has_no_jumps():
    """Every eighth of 160,000 steps is one of the small ones of mains at a quarter of the rate."""
    mains = np.array([0.0, 1.0, 1.001, 0.001])
    for size in (160_001, 200_001):
        values = np.tile(mains, size // 4 + 1)[:size] + 1e-4 * noise(1.0)[np.arange(size) % 9000]
        assert jumps(rate_gyro(values)) == ()


def encoder(values: np.ndarray) -> Channel:
    return Channel(name="table", kind="angle", shown_in="deg", values=values)


def test_steps_of_an_encoder_that_a_steady_table_meets_evenly_are_no_jumps():
    # 20 steps of 0.01 deg a sample and one part in 20 000 more: one sample in a thousand has 21.
    step = 0.01 * DEGREE
    read = np.floor(20.0 * (1.0 + 5e-5) * SECONDS * DEGREE / step) * step
    more = np.mean(np.diff(read) > 20.5 * step)
    assert 0.0005 < more < 0.0015
    table = encoder(read)
    assert jumps(table) == ()
    # Its twin is off by ten degrees from some sample on.
    table = encoder(read + np.where(SECONDS >= 70.0, 10.0 * DEGREE, 0.0))
    (note,) = jumps(table)
    assert note.level == "warning"
