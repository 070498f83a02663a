"""Arrays in memory and mapped from a file read, write and give back memory alike."""

import statistics

import numpy as np
import pytest

from sagnac.core import arrays


@pytest.fixture
def mapped(monkeypatch):
    monkeypatch.setattr(arrays, "IN_MEMORY", 1000)


def resident(values):
    """KiB of the process that are pages of files, after the values were read."""
    assert np.isfinite(values).all()
    return file_pages()


def file_pages():
    """KiB of the process that are pages of files or shared."""
    with open("/proc/self/status", encoding="ascii") as status:
        fields = dict(line.split(":", 1) for line in status)
    return sum(int(fields[name].split()[0]) for name in ("RssFile", "RssShmem"))


def test_a_short_array_is_in_memory():
    assert not arrays.is_mapped(arrays.empty(1000))


def test_a_long_array_keeps_its_values_when_its_memory_is_given_back(mapped):
    long = arrays.empty(100_000)
    assert arrays.is_mapped(long)
    assert arrays.is_mapped(long[5:50])
    long[:] = np.arange(100_000)
    arrays.release()
    assert np.array_equal(long, np.arange(100_000))


def test_the_memory_of_every_mapped_array_is_given_back(mapped):
    first, second = (arrays.empty(500_000) for _ in range(2))
    first[:], second[:] = 1.0, 2.0
    before = resident(first)
    before = max(before, resident(second))
    arrays.release()
    # Each is 3906 KiB.
    assert before - file_pages() > 7500


def test_values_at_places_are_those_of_the_array_and_leave_none_of_it_in_memory(mapped):
    long = arrays.empty(2**20)
    long[:] = np.arange(2**20)
    arrays.release()
    places = np.arange(1, 2**20, 500)[:, np.newaxis] + np.array([-1, 0, 1])
    before = file_pages()
    found = arrays.values_at(long, places)
    # The whole array is 8192 KiB.
    assert file_pages() - before < 1000
    np.testing.assert_array_equal(found, places)


def test_an_array_that_is_gone_is_not_given_back(mapped):
    long = arrays.empty(2000)
    del long
    arrays.release()


@pytest.mark.parametrize("size", [0, 1, 999, 1000, 1001, 12_345])
def test_blocks_cover_every_sample_once_in_order(size):
    covered = [np.arange(size)[block] for block in arrays.blocks(size, 1000)]
    assert np.array_equal(np.concatenate([np.empty(0, int), *covered]), np.arange(size))
    assert all(piece.size <= 1000 for piece in covered)


def test_blocks_have_the_usual_length_unless_stated(monkeypatch):
    monkeypatch.setattr(arrays, "BLOCK", 400)
    assert [block.stop for block in arrays.blocks(1000)] == [400, 800, 1000]
    assert [block.stop for block in arrays.blocks(10, 9)] == [9, 10]
    assert [block.stop for block in arrays.blocks(1000, start=300)] == [700, 1000]
    assert [block.stop for block in arrays.blocks(1000, multiple=150)] == [300, 600, 900, 1000]
    assert [block.stop for block in arrays.blocks(1000, multiple=700)] == [700, 1000]


@pytest.mark.parametrize("size", [1, 2, 999, 1000, 1001, 12_345])
def test_values_by_blocks_are_those_of_the_whole(mapped, monkeypatch, size):
    monkeypatch.setattr(arrays, "BLOCK", 700)
    long = arrays.empty(size)
    long[:] = np.random.default_rng(0).standard_normal(size)
    assert arrays.extent(long) == (long.min(), long.max())
    assert arrays.mean(long) == pytest.approx(long.mean(), rel=1e-12)
    assert np.array_equal(arrays.differences(long), np.diff(long))
    for step in (1, 3, 50, 699, 700, 701, 20_000):
        assert np.array_equal(arrays.every(long, step), long[::step])
    assert arrays.all_finite(long)
    long[-1] = np.nan
    assert np.isnan(arrays.extent(long)).all()
    assert not arrays.all_finite(long)


@pytest.mark.parametrize("size", [1, 2, 3, 4, 7, 100, 1001])
def test_the_median_is_the_middle_one_or_midway_between_two(size):
    random = np.random.default_rng(size)
    for values in (random.standard_normal(size), random.integers(0, 3, size) * 0.1):
        before = values.copy()
        assert arrays.median(values) == statistics.median(values.tolist())
        np.testing.assert_array_equal(values, before)


def test_an_operation_is_on_a_number_or_one_by_one_and_in_place_if_asked(mapped, monkeypatch):
    monkeypatch.setattr(arrays, "BLOCK", 700)
    values, other = np.random.default_rng(0).standard_normal((2, 5000))
    difference = arrays.elementwise(np.subtract, values, other)
    assert arrays.is_mapped(difference)
    assert np.array_equal(difference, values - other)
    assert np.array_equal(arrays.elementwise(np.divide, np.arange(3), 2.0), [0.0, 0.5, 1.0])
    single = np.array([0.1, 0.3], dtype=np.float32)
    assert np.array_equal(arrays.elementwise(np.multiply, single, 0.7), single.astype(float) * 0.7)
    assert arrays.elementwise(np.multiply, difference, 2.0, out=difference) is difference
    assert np.array_equal(difference, 2.0 * (values - other))


@pytest.fixture
def given_back(monkeypatch):
    """How often memory was given back."""
    calls = []
    monkeypatch.setattr(arrays, "release", lambda: calls.append(None))
    return calls


def test_memory_is_given_back_on_the_way_and_at_the_end(given_back):
    seen = [len(given_back) for _ in arrays.blocks(10_000, 1000)]
    assert 0 < seen[-1] < len(given_back)


def test_memory_is_given_back_after_an_error_or_a_break(given_back):
    def fail():
        for block in arrays.blocks(2000, 1000):
            raise ValueError(block)

    with pytest.raises(ValueError, match="slice"):
        fail()
    assert given_back
    given_back.clear()
    for _ in arrays.blocks(2000, 1000):
        break
    assert given_back


def test_a_mapping_of_the_callers_is_left_alone(tmp_path):
    # Written pages of a private mapping live nowhere else: given back, they would be lost.
    np.save(tmp_path / "angle.npy", np.zeros(10_000))
    own = np.load(tmp_path / "angle.npy", mmap_mode="c")
    own[:] = 1.0
    assert not arrays.is_mapped(own)
    assert arrays.mean(own) == 1.0
    arrays.release()
    assert np.all(own == 1.0)
