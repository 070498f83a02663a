"""Marks in a record, and the stretches between them."""

import numpy as np
import pytest

from sagnac.core.marks import is_missing, longest_unmarked, marked_steps, stretches
from sagnac.quality.effects import remedy_of
from sagnac.recording.model import Recording
from tests.quality.recordings import noise, rate_gyro


@pytest.mark.parametrize("length", [1, 2, 7, 100])
@pytest.mark.parametrize("missing", [[], [0], [9], [2, 3, 7], [0, 4, 9], list(range(10))])
def test_marks_do_not_depend_on_the_blocks(monkeypatch, length, missing):
    monkeypatch.setattr("sagnac.core.arrays.BLOCK", length)
    values = np.arange(10.0)
    values[missing] = np.nan
    marks = is_missing(values)
    assert np.flatnonzero(marks).tolist() == missing
    firsts, afters = stretches(marks)
    assert [n for one in zip(firsts, afters, strict=True) for n in range(*one)] == missing
    edges = [-1, *missing, 10]
    lengths = np.diff(edges) - 1
    at = int(np.argmax(lengths))
    expected = slice(edges[at] + 1, edges[at + 1]) if lengths[at] else slice(0, 0)
    assert longest_unmarked(marks) == expected


@pytest.mark.parametrize("length", [1, 3, 100])
def test_steps_look_across_the_borders_of_blocks(monkeypatch, length):
    monkeypatch.setattr("sagnac.core.arrays.BLOCK", length)
    values = np.array([0.0, 0.0, 5.0, 5.0, 5.0, 0.0])
    marks = marked_steps(values, lambda steps: steps != 0.0)
    # The bad samples are those behind the steps.
    assert np.flatnonzero(marks).tolist() == [2, 5]
    assert longest_unmarked(marks) == slice(0, 2)


def test_the_remedy_names_a_slice_inside_the_stretch():
    recording = Recording(gyros=(rate_gyro(noise(1.0)),), sample_rate=300.0)
    text = remedy_of(recording, slice(100, 601))
    assert text == "take the sound stretch with {slice 0.334:2.000}"
    assert remedy_of(recording, slice(0, recording.samples)).endswith("{slice 0:}")
    assert "from its source" in remedy_of(recording, slice(5, 20))


def test_stamps_of_a_damaged_file_name_no_slice():
    gyro = rate_gyro(noise(1.0))
    times = np.arange(gyro.values.size) / 300.0
    times[100] = 1e307
    recording = Recording(gyros=(gyro,), sample_rate=300.0, times=times)
    assert "from its source" in remedy_of(recording, slice(100, 601))
