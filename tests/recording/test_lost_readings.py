"""Readings of an encoder that were lost for long, taken from a gyro."""

import numpy as np
import pytest

from sagnac.analysis.pipeline import analyze
from sagnac.quality.check import integrity
from sagnac.recording.model import Recording
from tests.instruments import Readout, turntable

RATE = 50.0
MADE = turntable(
    11,
    seconds=120.0,
    sample_rate=RATE,
    table_rate=40.0,
    walk=0.02,
    jitter=1e-3,
    readout=Readout(step=1e-4),
)
TRUE = np.unwrap(MADE.encoder, period=360.0)


def recorded(encoder, kind="angle", gyros="xz") -> Recording:
    held = {name: MADE.angles[name] for name in gyros}
    if kind == "rate":
        held = {name: np.diff(one, append=np.nan) * RATE for name, one in held.items()}
        held = {name: np.append(one[:1], one[:-1]) for name, one in held.items()}
    return Recording.from_arrays(
        **held,
        table=encoder,
        kind=kind,
        unit="arcsec" if kind == "angle" else "arcsec/s",
        sample_rate=RATE,
    )


def lost(recording: Recording) -> list[str]:
    return [note.text for note in recording.notes if "lost at" in note.text]


@pytest.mark.parametrize("kind", ["angle", "rate"])
@pytest.mark.parametrize("how", ["NaN", "stuck"])
@pytest.mark.parametrize("seconds", [0.5, 1.0])
def test_a_gyro_tells_how_the_table_turned_meanwhile(seconds, how, kind):
    encoder = MADE.encoder.copy()
    # One of the places is where the readings start over.
    for first in (1500, int(np.argmin(np.diff(encoder[3000:]))) + 2990):
        row = slice(first, first + int(seconds * RATE))
        encoder[row] = np.nan if how == "NaN" else encoder[first - 1]
    recording = recorded(encoder, kind)
    (text,) = lost(recording)
    assert "2 places" in text
    assert integrity(recording) == ()
    off = np.degrees(recording.table.values) - TRUE
    # The gyro has 0.02 deg/sqrt(h), and its samples stand half a sample beside those of a rate.
    assert np.abs(off - np.median(off)).max() < (0.002 if kind == "angle" else 0.02)
    assert lost(recorded(MADE.encoder, kind)) == []


def test_more_than_two_turns_may_pass_unseen():
    encoder = MADE.encoder.copy()
    encoder[2000:2200] = np.nan
    recording = recorded(encoder)
    assert len(lost(recording)) == 1
    assert np.degrees(recording.table.values[-1] - recording.table.values[0]) == pytest.approx(
        TRUE[-1] - TRUE[0], abs=0.01
    )


def test_readings_that_no_gyro_tells_stay_missing():
    encoder = np.mod(TRUE, 360.0)
    encoder[2000:2050] = np.nan
    # The table moved otherwise than the gyros say, or none of them turns with it.
    other = np.mod(encoder + np.where(np.arange(encoder.size) > 2020, 20.0, 0.0), 360.0)
    across = Recording.from_arrays(
        x=np.random.default_rng(1).standard_normal(encoder.size),
        table=encoder,
        kind="rate",
        unit="arcsec/s",
        sample_rate=RATE,
    )
    at_the_end = np.where(np.arange(encoder.size) > 5900, np.nan, MADE.encoder)
    for recording in (recorded(other), across, recorded(at_the_end)):
        assert lost(recording) == []
        (note,) = integrity(recording)
        assert (note.channel, note.level) == ("table", "error")
        assert "NaN or infinite" in note.text


def test_a_pair_holds_its_noise_beside_an_encoder_of_which_every_thirtieth_reading_is_lost():
    encoder = MADE.encoder.copy()
    random = np.random.default_rng(2)
    for place in np.flatnonzero(random.random(encoder.size) < 0.03):
        encoder[place] = encoder[max(place - 1, 0)]
    encoder[2500:2520] = np.nan
    made = recorded(encoder)
    assert integrity(made) == ()
    walk = analyze(made, interval=0.1).angle_random_walk.to("deg/sqrt(h)")
    assert walk.status == "estimated"
    assert walk.low < MADE.walk < walk.high


def test_readings_that_are_missing_at_an_end_are_said_to_be():
    encoder = MADE.encoder.copy()
    encoder[[0, -1]] = np.nan
    (text,) = [note.text for note in integrity(recorded(encoder, "angle")) if "NaN" in note.text]
    assert "2 samples NaN or infinite, at an end of the record" in text
