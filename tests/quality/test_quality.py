"""Checks of the data, against recordings whose fault is known because it was put in."""

import numpy as np
import pytest

from sagnac.core import arrays
from sagnac.core.errors import LEVELS, Note, RecordingError
from sagnac.quality.check import check
from sagnac.quality.encoder import require_encoder_follows
from sagnac.quality.samples import longest_whole_stretch, with_gaps_marked
from sagnac.recording.channel import angle_of
from sagnac.recording.model import Recording
from tests.quality.recordings import RATE, faulty, mapped, noise, rate_gyro


def outcome(work, *arguments):
    try:
        return work(*arguments)
    except RecordingError as error:
        return str(error)


@pytest.mark.parametrize("length", [97, 1000, 2999])
@pytest.mark.parametrize("name", faulty())
def test_findings_and_values_are_the_same_span_by_span(monkeypatch, name, length):
    recording = faulty()[name]
    gyro = recording.gyros[0]
    found = check(recording)
    follows = outcome(require_encoder_follows, recording, gyro)
    marked = outcome(with_gaps_marked, recording)
    stretch, start = longest_whole_stretch(recording, "x")
    sound = bool(np.isfinite(gyro.values).all())
    angle = angle_of(gyro, RATE) if sound else None

    monkeypatch.setattr(arrays, "IN_MEMORY", 0)
    monkeypatch.setattr(arrays, "BLOCK", length)
    long = mapped(recording)
    assert check(long) == found
    assert outcome(require_encoder_follows, long, long.gyros[0]) == follows
    marked_long = outcome(with_gaps_marked, long)
    if isinstance(marked, str):
        assert marked_long == marked
    else:
        assert marked_long.notes == marked.notes
        assert marked_long.sample_rate == pytest.approx(marked.sample_rate, rel=1e-14)
        assert np.array_equal(marked_long.gyros[0].values, marked.gyros[0].values, equal_nan=True)
    stretch_long, start_long = longest_whole_stretch(long, "x")
    assert start_long == start
    assert np.array_equal(stretch_long.gyros[0].values, stretch.gyros[0].values)
    if stretch.times is not None:
        assert np.array_equal(stretch_long.times, stretch.times, equal_nan=True)
    if angle is not None:
        rounding = 1e-13 * np.abs(gyro.values).max()
        assert angle_of(long.gyros[0], RATE) == pytest.approx(angle, rel=1e-12, abs=rounding)


def test_a_fault_of_every_kind_is_among_the_recordings():
    messages = " ".join(str(finding) for one in faulty().values() for finding in check(one))
    for words in (
        "NaN or infinite",
        "stuck at one value",
        "every sample is the same",
        "jump",
        "saturated",
        "does not follow",
        "times as fast",
        "does not turn",
        "looks wrong",
        "gap",
        "backwards",
        "repeated stamp",
        "interval",
        "clock is too coarse",
    ):
        assert words in messages, words


def test_errors_come_first_and_warnings_before_remarks():
    for recording in faulty().values():
        ranks = [LEVELS.index(note.level) for note in check(recording)]
        assert ranks == sorted(ranks)


def test_too_few_samples_are_all_that_is_said():
    short = Recording(gyros=(rate_gyro(noise(1.0)[:15]),), sample_rate=RATE)
    text = "15 samples are too few, at least 16 are needed; give a longer file or a wider {slice}"
    assert check(short) == (Note(level="error", text=text),)
