"""Stamps, rates and slices."""

from itertools import pairwise

import numpy as np
import pytest

from sagnac.core import arrays
from sagnac.core.errors import RecordingError
from sagnac.formats import Statement, read
from sagnac.formats.source import Source, Stored, in_memory
from sagnac.recording.stamps import Sampling, first_at, stretch_of
from tests.formats.examples import SAMPLES, refused, timed, walk


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


@pytest.mark.parametrize("start", [1000.0, SAMPLES / 100.0 - 0.01])
def test_a_slice_beyond_the_end_is_blamed_on_the_slice(tmp_path, start):
    path = timed(tmp_path / "run.csv", walk())
    said = "fewer than two samples"
    refused(path, said, "--slice", statement=Statement(kind="angle", span=(start, None)))
    options = {"time": "none", "sample_rate": 100.0, "span": (start, None)}
    refused(path, said, "--slice", statement=Statement(kind="angle", **options))


@pytest.mark.parametrize(
    ("stop", "said"), [(5.0, False), (None, False), (6.0, False), (6.005, False), (100.0, True)]
)
def test_a_slice_that_asks_for_more_than_there_is_is_told_so(tmp_path, stop, said):
    path = timed(tmp_path / "run.csv", walk())
    for stated in ({}, {"time": "none", "sample_rate": 100.0}):
        recording = read(path, Statement(kind="angle", span=(1.0, stop), **stated))
        texts = [note.text for note in recording.notes]
        assert any("up to 100 s and the file ends at 6 s" in text for text in texts) == said


@pytest.mark.parametrize(
    ("span", "first", "stop"),
    [(None, 0, 100), ((None, None), 0, 100), ((1.0, None), 10, 100), ((1.01, 2.0), 11, 20)],
)
def test_a_slice_by_rate_and_by_stamps_is_the_same(span, first, stop):
    stamps = np.arange(100) / 10.0
    for stretch in (stretch_of(100, span, 10.0), stretch_of(100, span, None, stamps)):
        assert (stretch.first, stretch.stop) == (first, stop)
        assert stretch.start == pytest.approx(first / 10.0)
        assert stretch.span_s == pytest.approx((first / 10.0, stop / 10.0))
        assert stretch.sampling == Sampling(times=None, sample_rate=10.0)


def test_integers_by_their_first_lose_nothing_as_floats():
    raw = 1_700_000_000 * 10**9 + 10_000_000 * np.arange(100, dtype=np.uint64)
    source = Source(format="CSV", columns=(), load=lambda keys: {"t": raw})
    whole = source.opened(["t"]).read(["t"], 0, 100, by_first=True)["t"]
    np.testing.assert_array_equal(whole, 10_000_000.0 * np.arange(100))
    with pytest.raises(RecordingError, match="t: holds integers beyond 2"):
        source.opened(["t"]).read(["t"], 0, 100)


@pytest.mark.parametrize("in_memory", [0, 100])
@pytest.mark.parametrize("sizes", [(10,), (3, 7), (1, 4, 5), (3, 4), (8, 3)])
def test_pieces_of_a_column_stand_one_after_the_other(monkeypatch, in_memory, sizes):
    monkeypatch.setattr(arrays, "IN_MEMORY", in_memory)
    values = np.arange(11, dtype=np.int32)
    edges = np.cumsum((0, *sizes))
    stored = Stored(
        format="CSV",
        lengths={"x": 10},
        pieces=lambda keys, start, stop: ({"x": values[a:b]} for a, b in pairwise(edges)),
    )
    if sum(sizes) != 10:
        with pytest.raises(RecordingError, match="is not CSV, or is damaged or cut off"):
            stored.read(["x"], 0, 10)
        return
    found = stored.read(["x"], 0, 10)["x"]
    assert found.dtype == np.float64
    np.testing.assert_array_equal(found, values[:10])
    assert arrays.is_mapped(found) == (in_memory == 0)


def test_a_whole_column_is_taken_over_unless_it_may_not_be_written_to():
    whole, constant = np.arange(10.0), np.arange(10.0)
    constant.flags.writeable = False
    found = in_memory({"x": whole, "z": constant}).read(["x", "z"], 0, 10)
    assert np.shares_memory(found["x"], whole)
    assert not np.shares_memory(found["z"], constant)


def test_the_first_stamp_at_a_limit():
    times = np.array([0.0, 1.0, 2.0 - 1e-10, 3.0])
    assert first_at(times, 2.0) == 2
    assert first_at(times, 9.0) == 4
