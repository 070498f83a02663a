"""What the readouts of several gyros together allow."""

import math

import numpy as np
import pytest

from sagnac.core.errors import RecordingError
from sagnac.quality.readout import joint_readout, readout_of
from sagnac.recording.channel import Channel
from sagnac.recording.model import Recording

RATE = 10.0
ARCSECOND = math.radians(1.0 / 3600.0)


def read_out(samples, sigma, seed=0):
    """A walk of `sigma` steps a sample, read out in whole steps."""
    return np.rint(np.cumsum(sigma * np.random.default_rng(seed).normal(size=samples)))


def recording(**sigmas):
    gyros = tuple(
        Channel(name=name, kind="angle", values=ARCSECOND * read_out(20_000, sigma))
        for name, sigma in sigmas.items()
    )
    return Recording(gyros=gyros, sample_rate=RATE)


def test_steps_of_dithered_readouts_add_up_to_the_step_of_the_pair_per_gyro():
    joint = joint_readout(recording(x=2.0, z=3.0), ("x", "z"), RATE)
    # The pair is its difference over sqrt(2).
    assert joint.step == pytest.approx((1.0 + 1.0) / math.sqrt(2.0) * ARCSECOND, rel=1e-6)
    assert (joint.every, joint.time, joint.notes) == (1, 0.0, ())


def test_the_slowest_readout_rules_the_angles_taken():
    of_two = recording(x=2.0, z=0.1)
    joint = joint_readout(of_two, ("x", "z"), RATE)
    alone = readout_of(of_two.gyro("z").values)
    assert joint.every == alone.every > 1
    assert joint.time == alone.every / RATE
    assert joint.notes[0].text.startswith("nothing dithers the readout step of z (1 arcsec)")


def test_too_few_dithered_angles_leave_a_bound():
    joint = joint_readout(recording(x=0.01), ("x",), RATE)
    assert joint.every is None
    assert joint.notes[0].level == "warning"
    assert "dither the readout step of x (1 arcsec) too few times" in joint.notes[0].text


def test_angles_may_be_taken_at_a_part_of_the_rate():
    one = recording(x=0.4)
    assert joint_readout(one, ("x",), RATE).every == 2
    assert joint_readout(one, ("x",), RATE / 2.0).every == 1


@pytest.mark.parametrize(("noise", "is_told"), [(0.001, True), (0.5, False)])
def test_an_encoder_that_turns_by_whole_steps_from_angle_to_angle_is_not_dithered(noise, is_told):
    """Eight steps of a tenth of a degree between two angles that are used, ten samples apart."""
    degree, turned = math.radians(1.0), 0.08 * np.arange(20_000)
    table = 0.1 * degree * np.floor((turned + 0.001 * np.sin(0.001 * turned) + 0.033) / 0.1)
    walk = noise * degree * np.random.default_rng(1).standard_normal(turned.size).cumsum()
    one = Recording(
        gyros=(Channel(name="x", kind="angle", values=degree * turned + walk),),
        sample_rate=100.0,
        table=Channel(name="table", kind="angle", values=table),
    )
    joint = joint_readout(one, ("x",), 10.0)
    assert (joint.every is None) == is_told
    assert any("the encoder, as x senses the table" in note.text for note in joint.notes) == is_told


@pytest.mark.parametrize(
    ("rates", "every"),
    [
        # Rests again and again; a start and a stop; rates that change, or turn back, with no rest.
        ([40.0, 0.0] * 15, None),
        ([0.0, *[40.0] * 13, *[25.0] * 15, 0.0], 1),
        ([40.0, 25.0] * 15, 1),
        ([40.0, -40.0] * 15, 1),
    ],
)
def test_an_encoder_that_rests_again_and_again_is_not_dithered_in_its_rests(rates, every):
    degree, random = math.radians(1.0), np.random.default_rng(2)
    speed = np.repeat(rates, 2000) + 0.0
    # A start takes a second; a servo that moves is never quite even.
    speed = np.convolve(speed, np.full(100, 0.01), mode="same")
    speed *= 1.0 + 0.1 * random.standard_normal(speed.size)
    turned, step = np.cumsum(speed) / 100.0, 360.0 / 4096.0
    walk = 0.01 * random.standard_normal(speed.size).cumsum() / 60.0
    one = Recording(
        gyros=(Channel(name="x", kind="angle", values=degree * (turned + walk)),),
        sample_rate=100.0,
        table=Channel(name="table", kind="angle", values=degree * step * np.rint(turned / step)),
    )
    joint = joint_readout(one, ("x",), 10.0)
    assert joint.every == every
    assert any("the encoder, as x senses the table" in note.text for note in joint.notes) == (
        every is None
    )
    assert joint_readout(one, ("x",), 10.0, with_encoder=False).every == 1


@pytest.mark.parametrize(
    ("arguments", "error", "words"),
    [
        ((("x",), 0.0), ValueError, "sample_rate is 0.0"),
        ((("q",), RATE), RecordingError, "no gyro 'q'"),
    ],
)
def test_what_makes_no_sense_is_refused(arguments, error, words):
    with pytest.raises(error, match=words):
        joint_readout(recording(x=1.0), *arguments)
