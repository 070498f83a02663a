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
    series._release(long[5:50], np.arange(3.0))
    assert np.array_equal(long, np.arange(100_000))


@pytest.mark.parametrize("size", [0, 1, 999, 1000, 1001, 12_345])
def test_spans_cover_every_sample_once_in_order(size):
    covered = [np.arange(size)[span] for span in series._spans(size, 1000)]
    assert np.array_equal(np.concatenate([np.empty(0, int), *covered]), np.arange(size))
    assert all(piece.size <= 1000 for piece in covered)


def test_results_come_in_the_order_of_the_spans(mapped):
    long = series.empty(50_000)
    long[:] = np.arange(50_000)
    firsts = series.map(lambda span: float(long[span][0]), 50_000, long, length=700)
    assert firsts == list(np.arange(0.0, 50_000.0, 700.0))


def test_an_error_in_a_span_reaches_the_caller():
    def work(span):
        if span.start == 2000:
            raise ValueError("span 2000")

    with pytest.raises(ValueError, match="span 2000"):
        series.map(work, 5000, length=1000)


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
    monkeypatch.setattr(series, "_release", lambda *several: given_back.append(several))
    long = series.empty(10_000)
    assert list(series._through(10_000, long)) == list(series._spans(10_000))
    assert len(given_back) > 2
    assert all(several[0] is long for several in given_back)


@pytest.fixture
def given_back(monkeypatch):
    """What `_release` was called with, each time."""
    calls = []
    monkeypatch.setattr(series, "_release", lambda *several: calls.append(several))
    return calls


@pytest.mark.parametrize("size", [0, 1, 999, 1000, 1001, 12_345])
def test_map_works_on_every_sample_once_in_order(size):
    blocks = series.map(lambda block: np.arange(size)[block], size, length=1000)
    assert np.array_equal(np.concatenate([np.empty(0, int), *blocks]), np.arange(size))


def test_blocks_have_the_length_of_a_span_unless_stated(monkeypatch):
    monkeypatch.setattr(series, "SPAN", 400)
    assert [block.stop for block in series.map(lambda block: block, 1000)] == [400, 800, 1000]
    assert [block.stop for block in series.map(lambda block: block, 10, length=9)] == [9, 10]


def test_total_adds_in_the_order_of_the_blocks():
    # Added in another order, the small ones would count.
    parts = {0: 1e16, 1: 1.0, 2: 1.0, 3: -1e16}
    assert series.total(lambda block: parts[block.start], 4, length=1) == 0.0
    rows = series.total(lambda block: np.array([1.0, block.start]), 3, length=1)
    assert np.array_equal(rows, [3.0, 3.0])


def test_total_of_nothing_is_refused():
    with pytest.raises(ValueError, match="size is 0"):
        series.total(lambda block: 1.0, 0)


def test_reduce_hands_the_state_from_block_to_block():
    def step(seen, block):
        return (*seen, block.start)

    assert series.reduce(step, (), 10, length=4) == (0, 4, 8)
    assert series.reduce(step, ("start",), 0) == ("start",)


@pytest.mark.parametrize("size", [0, 1, 999, 1001, 12_345])
def test_made_is_what_work_returns(mapped, size):
    values = np.random.default_rng(size).standard_normal(size)
    twice = series.made(lambda block: 2.0 * values[block], size, length=700)
    assert series.is_mapped(twice) == (size > 1000)
    assert np.array_equal(twice, 2.0 * values)


def test_first_where_stops_at_the_first_place():
    values = np.array([1.0, 2.0, 3.0, 4.0, 9.0, 9.0, 1.0])
    tested = []

    def test(block):
        tested.append(block.start)
        return values[block] == 9.0

    assert series.first_where(test, values.size, length=2) == 4
    assert tested == [0, 2, 4]
    assert series.first_where(lambda block: values[block] > 10.0, values.size, length=2) == 7
    assert series.first_where(lambda block: values[block] > 10.0, 0) == 0


@pytest.mark.parametrize(
    "use",
    [
        lambda long: series.map(lambda block: None, long.size, long),
        lambda long: series.total(lambda block: 1.0, long.size, long),
        lambda long: series.reduce(lambda state, block: state, 0, long.size, long),
        lambda long: series.made(lambda block: np.zeros(1000), long.size, long),
        lambda long: series.first_where(lambda block: np.array([False]), long.size, long),
    ],
)
def test_touched_series_are_given_back_on_the_way_and_at_the_end(
    mapped, monkeypatch, given_back, use
):
    monkeypatch.setattr(series, "SPAN", 1000)
    long = series.empty(10_000)
    use(long)
    assert len(given_back) > 2
    assert all(any(one is long for one in several) for several in given_back)


def test_touched_series_are_given_back_after_an_error(mapped, given_back):
    long = series.empty(2000)

    def fail(block):
        raise ValueError("no")

    for use in (series.map, series.total):
        given_back.clear()
        try:
            use(fail, long.size, long, length=1000)
        except ValueError:
            # Not only when nobody holds the error any more.
            assert given_back
        else:
            pytest.fail("no error")


@pytest.mark.parametrize("in_memory", [0, 100])
@pytest.mark.parametrize("pieces", [(10,), (3, 7), (1, 4, 5), (3, 4), ()])
def test_filling_holds_the_pieces_one_after_the_other(monkeypatch, in_memory, pieces):
    monkeypatch.setattr(series, "IN_MEMORY", in_memory)
    filling = series.Filling(10)
    values = np.arange(10, dtype=np.int32)
    first = 0
    for size in pieces:
        filling.append(values[first : first + size])
        first += size
    assert filling.filled.dtype == np.float64
    assert np.array_equal(filling.filled, values[:first])
    assert series.is_mapped(filling.filled) == (in_memory == 0)


def test_filling_takes_over_a_whole_array_and_copies_a_view_that_may_not_be_written_to():
    values = np.arange(10.0)
    filling = series.Filling(10)
    filling.append(values)
    assert np.shares_memory(filling.filled, values)
    constant = np.arange(10.0)
    constant.flags.writeable = False
    filling = series.Filling(10)
    filling.append(constant)
    assert not np.shares_memory(filling.filled, constant)


def test_filling_refuses_more_than_there_is_room_for():
    filling = series.Filling(10)
    filling.append(np.zeros(8))
    with pytest.raises(ValueError, match="room for 10"):
        filling.append(np.zeros(3))


def test_a_mapping_of_the_callers_is_left_alone(tmp_path):
    # Written pages of a private mapping live nowhere else: given back, they would be lost.
    np.save(tmp_path / "angle.npy", np.zeros(10_000))
    own = np.load(tmp_path / "angle.npy", mmap_mode="c")
    own[:] = 1.0
    assert not series.is_mapped(own)
    assert series.mean(own) == 1.0
    assert np.all(own == 1.0)


def test_series_gone_through_at_once_are_given_back_also_after_an_error(mapped, given_back):
    long = series.empty(2000)
    with series.gone_through(long):
        assert not given_back
    assert given_back == [(long,)]
    with pytest.raises(ValueError, match="no"), series.gone_through(long):
        raise ValueError("no")
    assert len(given_back) == 2


def test_scale_is_in_place(mapped):
    long = series.made(lambda block: np.arange(block.start, block.stop, dtype=float), 5000)
    assert series.scale(long, 1.0) is long
    assert series.scale(long, 0.5) is long
    assert np.array_equal(long, 0.5 * np.arange(5000))
