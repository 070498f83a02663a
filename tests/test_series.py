"""Series in memory and mapped from a file read, write and give back memory alike."""

import numpy as np
import pytest

from sagnac import series


@pytest.fixture
def mapped(monkeypatch):
    monkeypatch.setattr(series, "IN_MEMORY", 1000)


def test_a_short_series_is_in_memory():
    assert not series.is_mapped(series.empty(1000))


def test_a_long_series_keeps_its_values_when_its_memory_is_given_back(mapped):
    long = series.empty(100_000)
    assert series.is_mapped(long)
    assert series.is_mapped(long[5:50])
    long[:] = np.arange(100_000)
    series.release(long[5:50], np.arange(3.0))
    assert np.array_equal(long, np.arange(100_000))


@pytest.mark.parametrize("size", [0, 1, 999, 1000, 1001, 12_345])
def test_spans_cover_every_sample_once_in_order(size):
    covered = [np.arange(size)[span] for span in series.spans(size, 1000)]
    assert np.array_equal(np.concatenate([np.empty(0, int), *covered]), np.arange(size))
    assert all(piece.size <= 1000 for piece in covered)


def test_results_come_in_the_order_of_the_spans(mapped):
    long = series.empty(50_000)
    long[:] = np.arange(50_000)
    firsts = list(series.each(lambda span: float(long[span][0]), 50_000, 700, release_of=(long,)))
    assert firsts == list(np.arange(0.0, 50_000.0, 700.0))


def test_an_error_in_a_span_reaches_the_caller():
    def work(span):
        if span.start == 2000:
            raise ValueError("span 2000")

    with pytest.raises(ValueError, match="span 2000"):
        list(series.each(work, 5000, 1000))


@pytest.mark.parametrize("size", [1, 2, 999, 1000, 1001, 12_345])
def test_values_by_spans_are_those_of_the_whole(mapped, monkeypatch, size):
    monkeypatch.setattr(series, "SPAN", 700)
    long = series.empty(size)
    long[:] = np.random.default_rng(0).standard_normal(size)
    assert series.extent(long) == (long.min(), long.max())
    assert series.mean(long) == pytest.approx(long.mean(), rel=1e-12)
    assert np.array_equal(series.differences(long), np.diff(long))
    for step in (1, 3, 50, 699, 700, 701, 20_000):
        assert np.array_equal(series.every(long, step), long[::step])
    places = np.sort(np.random.default_rng(1).integers(0, size, 40))
    assert np.array_equal(series.at(long, places), long[places])
    long[-1] = np.nan
    assert np.isnan(series.extent(long)).all()


def test_series_gone_through_are_given_back(mapped, monkeypatch):
    given_back = []
    monkeypatch.setattr(series, "SPAN", 1000)
    monkeypatch.setattr(series, "release", lambda *several: given_back.append(several))
    long = series.empty(10_000)
    assert list(series.through(10_000, long)) == list(series.spans(10_000))
    assert len(given_back) > 2
    assert all(several[0] is long for several in given_back)


def test_a_mapping_of_the_callers_is_left_alone(tmp_path):
    # Written pages of a private mapping live nowhere else: given back, they would be lost.
    np.save(tmp_path / "angle.npy", np.zeros(10_000))
    own = np.load(tmp_path / "angle.npy", mmap_mode="c")
    own[:] = 1.0
    assert not series.is_mapped(own)
    assert series.mean(own) == 1.0
    assert np.all(own == 1.0)
