"""Stamps, rates and slices."""

import numpy as np
import pytest

from sagnac.formats import Statement, read
from sagnac.formats.channels import (
    first_at,
    sampled_by_rate,
    sampled_by_stamps,
    stamps_in_seconds,
)
from sagnac.formats.source import in_memory
from sagnac.recording.stamps import Sampling
from tests.formats.examples import SAMPLES, refused, timed, walk


def test_stamps_on_a_coarse_clock_are_uniform_and_jitter_is_kept(tmp_path):
    times = np.round(np.arange(SAMPLES) / 512.0, 3)
    recording = read(timed(tmp_path / "coarse.csv", walk(), times), Statement(kind="angle"))
    assert recording.times is None
    assert recording.sample_rate == pytest.approx(512.0, rel=1e-3)
    assert any("clock" in str(note) for note in recording.notes)
    times = np.arange(SAMPLES) / 100.0
    times[300] = times[299]
    recording = read(timed(tmp_path / "repeat.csv", walk(), times), Statement(kind="angle"))
    np.testing.assert_allclose(recording.times, times, atol=1e-12)
    assert any("1 repeated stamp" in str(note) for note in recording.notes)


def test_time_none_ignores_the_stamps(tmp_path):
    times = np.arange(SAMPLES) / 100.0
    times[300:] += 9.0
    path = timed(tmp_path / "run.csv", walk(), times)
    refused(path, "time", "1 gap", "5 steps", "2.990 s", "--slice")
    recording = read(path, Statement(kind="angle", time="none", sample_rate=100.0))
    assert recording.times is None
    assert recording.samples == SAMPLES


def test_slice_takes_the_sound_stretch_that_the_message_names(tmp_path):
    values = walk()
    values[100:103] = np.nan
    path = timed(tmp_path / "run.csv", values)
    message = refused(path, "x:", "3 samples NaN or infinite", "1.000 s")
    start = float(message.split("--slice ")[1].rstrip(":"))
    recording = read(path, Statement(kind="angle", span=(start, None)))
    assert recording.samples == SAMPLES - 103
    assert recording.provenance.span_s == pytest.approx((1.03, 6.0))


def test_rate_has_to_agree_with_the_stamps(tmp_path):
    path = timed(tmp_path / "run.csv", walk())
    refused(
        path, "100 Hz", "500 Hz", "--rate", statement=Statement(kind="angle", sample_rate=500.0)
    )


@pytest.mark.parametrize("start", [1000.0, SAMPLES / 100.0 - 0.01])
def test_a_slice_beyond_the_end_is_blamed_on_the_slice(tmp_path, start):
    path = timed(tmp_path / "run.csv", walk())
    said = "fewer than two samples"
    refused(path, said, "--slice", statement=Statement(kind="angle", span=(start, None)))
    options = {"time": "none", "sample_rate": 100.0, "span": (start, None)}
    refused(path, said, "--slice", statement=Statement(kind="angle", **options))


@pytest.mark.parametrize(
    ("span", "first", "stop"),
    [(None, 0, 100), ((None, None), 0, 100), ((1.0, None), 10, 100), ((1.01, 2.0), 11, 20)],
)
def test_a_slice_by_rate_and_by_stamps_is_the_same(span, first, stop):
    stamps = np.arange(100) / 10.0
    for stretch in (sampled_by_rate(100, 10.0, span), sampled_by_stamps(stamps, span, None)):
        assert (stretch.first, stretch.stop) == (first, stop)
        assert stretch.start == pytest.approx(first / 10.0)
        assert stretch.span_s == pytest.approx((first / 10.0, stop / 10.0))
        assert stretch.sampling == Sampling(times=None, sample_rate=10.0)


def test_stamps_are_seconds_from_the_first_and_no_more_than_are_needed():
    raw = 1_700_000_000 * 10**9 + 10_000_000 * np.arange(100)
    whole = stamps_in_seconds(in_memory({"t": raw}), "t", 1e-9, None)
    np.testing.assert_allclose(whole, np.arange(100) / 100.0, atol=1e-15)


def test_the_first_stamp_at_a_limit():
    times = np.array([0.0, 1.0, 2.0 - 1e-10, 3.0])
    assert first_at(times, 2.0) == 2
    assert first_at(times, 9.0) == 4
