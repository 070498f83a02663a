"""Samples that are NaN or infinite."""

from dataclasses import replace

import numpy as np

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
        "3 samples NaN or infinite, the first at 3.000 s; take the sound stretch with {slice 9.01:}"
    )
    table = Channel(name="table", kind="angle", values=values)
    sound = Recording(gyros=(rate_gyro(noise(1.0)),), sample_rate=RATE)
    (of_table,) = integrity(replace(sound, table=table))
    assert "more than can be interpolated (4 in a row, or as long as a gyro" in of_table.text
    assert integrity(sound) == ()
