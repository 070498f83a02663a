"""Encoders whose readings start over elsewhere than at a full turn of the stated unit."""

from dataclasses import replace

import numpy as np
import pytest

from sagnac.analysis.pipeline import analyze
from sagnac.quality.check import judged
from sagnac.recording.model import Recording
from tests.instruments import Readout, turntable


def recorded(scale: float, *, running: bool = False, lowest: float = 0.0, **how) -> Recording:
    """Two gyros beside an encoder that counts a turn as `scale` times 360, from `lowest` on."""
    made = turntable(
        7,
        seconds=120.0,
        sample_rate=50.0,
        walk=0.02,
        jitter=5e-5,
        readout=Readout(step=1e-4),
        **how,
    )
    encoder = np.mod(made.encoder - lowest, 360.0) + lowest
    encoder = scale * (np.unwrap(encoder, period=360.0) if running else encoder)
    return Recording.from_arrays(
        **{name: made.angles[name] for name in "xz"},
        table=encoder,
        kind="angle",
        unit="arcsec",
        sample_rate=50.0,
    )


def beside(angle, *, scale: float, sample_rate: float, share: float = 1.0, walk: float):
    """Two gyros that turn by a share of a table angle, rad, and an encoder of `scale` degrees."""
    white = np.random.default_rng(5).standard_normal((2, angle.size))
    gyros = dict(zip("xz", share * angle + np.cumsum(walk * white, axis=1), strict=True))
    return Recording.from_arrays(
        **gyros,
        table=scale * np.mod(np.rad2deg(angle), 360.0),
        kind="angle",
        unit="rad",
        sample_rate=sample_rate,
    )


def leaps(recording: Recording) -> list[str]:
    return [note.text for note in judged(recording) if "start over" in note.text]


@pytest.mark.parametrize("motion", ["steady", "reversing", "dwelling"])
@pytest.mark.parametrize("scale", [0.9999, 0.99998, 1.0001])
def test_a_turn_of_other_counts_is_named_with_its_unit(scale, motion):
    (text,) = leaps(recorded(scale, table_rate=40.0, motion=motion))
    assert ("short of" if scale < 1.0 else "beyond") in text
    right = float(text.split("COLUMN:")[1].split("deg")[0])
    assert right == pytest.approx(1.0 / scale, abs=2e-6)


@pytest.mark.parametrize("motion", ["steady", "reversing", "dwelling"])
def test_a_turn_that_closes_is_sound(motion):
    assert leaps(recorded(1.0, table_rate=40.0, motion=motion)) == []
    assert leaps(recorded(1.0, table_rate=40.0, motion=motion, lowest=-180.0)) == []
    # A running angle has no place at which it starts over.
    assert leaps(recorded(0.9999, table_rate=40.0, motion=motion, running=True)) == []


def test_an_encoder_that_starts_over_in_the_middle_is_seen_there():
    (text,) = leaps(recorded(0.9999, table_rate=40.0, lowest=-180.0))
    assert "short of" in text


@pytest.mark.parametrize("share", [0.577, -0.577])
@pytest.mark.parametrize("scale", [1.0, 65535.0 / 65536.0])
def test_a_table_that_steps_past_its_zero_brakes_there_in_every_turn(scale, share):
    seconds = np.arange(180_000) / 100.0
    # A quarter of a turn a minute, in 3 s, from 20 deg on: the encoder starts over on the way.
    moved = np.clip(seconds % 60.0 / 3.0, 0.0, 1.0)
    moved -= np.sin(2.0 * np.pi * moved) / (2.0 * np.pi)
    angle = np.deg2rad(20.0 + 90.0 * (seconds // 60.0 + moved))
    found = leaps(beside(angle, scale=scale, sample_rate=100.0, share=share, walk=1e-8))
    assert len(found) == (scale != 1.0)
    for text in found:
        right = float(text.split("COLUMN:")[1].split("deg")[0])
        assert right == pytest.approx(1.0 / scale, abs=5e-7)


@pytest.mark.parametrize("scale", [1.0, 0.9999])
@pytest.mark.parametrize("phase", [0.0, 0.3, 2.0])
def test_a_ripple_of_the_motor_is_no_leap(scale, phase):
    seconds = np.arange(60_000) / 200.0
    # A motor of 24 poles at 100 deg/s moves the table itself by 10 arcsec.
    angle = np.deg2rad(100.0 * seconds)
    angle += 5e-5 * np.sin(24.0 * angle + phase) + 1.5e-5 * np.sin(48.0 * angle)
    found = leaps(beside(angle, scale=scale, sample_rate=200.0, walk=1e-7))
    assert len(found) == (scale != 1.0)


@pytest.mark.parametrize("scale", [1.0, 0.9999])
@pytest.mark.parametrize("rate", [8.325, -16.65])
def test_half_a_step_of_a_coarse_encoder_on_an_even_table_is_no_leap(rate, scale):
    # Five samples turn by nearly a whole number of steps, so that most excesses are alike.
    seconds, step = np.arange(100_000) / 250.0, 0.01
    angle = np.deg2rad(rate * seconds)
    made = beside(angle, scale=1.0, sample_rate=250.0, walk=1e-9)
    counts = np.rint((rate * seconds + 0.003 * np.sin(angle)) * scale / step) * step
    encoder = np.mod(counts, 360.0 * scale)
    wrapped = Recording.from_arrays(
        **{one.name: one.values for one in made.gyros},
        table=encoder,
        kind="angle",
        unit="rad",
        sample_rate=250.0,
    )
    assert len(leaps(wrapped)) == (scale != 1.0)


def test_one_gyro_beside_such_an_encoder_has_a_bound_and_a_pair_its_noise():
    bad, sound = (recorded(scale, table_rate=40.0) for scale in (0.9999, 1.0))
    alone = [
        analyze(replace(one, gyros=one.gyros[:1]), interval=0.1).angle_random_walk
        for one in (bad, sound)
    ]
    assert [one.status for one in alone] == ["upper bound", "estimated"]
    assert alone[0].to("deg/sqrt(h)").high > 0.02
    pair = analyze(bad, interval=0.1).angle_random_walk.to("deg/sqrt(h)")
    assert pair.low < 0.02 < pair.high
