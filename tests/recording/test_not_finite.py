"""Samples that are NaN or infinite."""

import numpy as np
from sagnac.quality.gaps import not_finite_notes

from sagnac.recording.model import Recording
from tests.quality.recordings import RATE, noise, rate_gyro


def test_they_are_counted_with_the_first_and_the_remedy():
    values = noise(1.0)
    values[[300, 301, 900]] = np.nan, np.inf, np.nan
    recording = Recording(gyros=(rate_gyro(values),), sample_rate=RATE)
    (note,) = not_finite_notes(recording, "x", values)
    assert (note.level, note.channel) == ("error", "x")
    assert note.text == (
        "3 samples NaN or infinite, the first at 3.000 s; take the sound stretch with {slice 9.01:}"
    )
    (of_table,) = not_finite_notes(recording, "table", values)
    assert "more than can be interpolated (4 in a row, or as long as a gyro" in of_table.text
    assert not_finite_notes(recording, "x", noise(1.0)) == ()
