"""Samples that are NaN or infinite."""

from dataclasses import replace

import numpy as np

from sagnac import analyze, check
from sagnac.quality.check import integrity
from sagnac.recording.channel import Channel
from sagnac.recording.model import Recording
from tests.quality.recordings import RATE, noise, rate_gyro


def test_they_are_counted_with_the_first_and_the_remedy():
    values = noise(1.0)
    values[[300, 301, 900]] = np.nan, np.inf, np.nan
    recording = Recording(gyros=(rate_gyro(values),), sample_rate=RATE)
    (note,) = integrity(recording)
    assert (note.level, note.channel) == ("error", "x")
    assert note.text == (
        "3 samples NaN or infinite, the first at 3.000 s; leave these rows out and keep the time "
        "stamps, or take the sound stretch with {slice 9.01:}"
    )
    table = Channel(name="table", kind="angle", values=values)
    sound = Recording(gyros=(rate_gyro(noise(1.0)),), sample_rate=RATE)
    (of_table,) = integrity(replace(sound, table=table))
    assert "more than can be interpolated (4 in a row, or as long as a gyro" in of_table.text
    assert integrity(sound) == ()


def test_without_their_rows_and_with_stamps_the_whole_record_is_read():
    """The remedy was to mark zeros as NaN, and a recording with NaN was refused."""
    rng = np.random.default_rng(3)
    rates, times = 0.3 + 0.02 * rng.standard_normal(60_000), np.arange(60_000) / 100.0
    lost = rng.random(60_000) < 0.004
    stated = {"kind": "rate", "unit": "deg/s"}
    zeros = Recording.from_arrays(x=np.where(lost, 0.0, rates), sample_rate=100.0, **stated)
    (found,) = [note for note in check(zeros) if note.name == "dropouts"]
    missing = Recording.from_arrays(x=np.where(lost, np.nan, rates), sample_rate=100.0, **stated)
    for text in (found.text, integrity(missing)[0].text):
        assert "leave these rows out and keep the time stamps" in text
    kept = Recording.from_arrays(x=rates[~lost], times=times[~lost], **stated)
    walk = analyze(kept).angle_random_walk.to("deg/sqrt(h)")
    assert walk.low < 0.12 < walk.high < 1.03 * walk.low


def test_rows_of_a_long_gap_are_not_to_be_left_out():
    values = noise(1.0)
    values[300:310] = np.nan
    (note,) = integrity(Recording(gyros=(rate_gyro(values),), sample_rate=RATE))
    assert "leave" not in note.text
