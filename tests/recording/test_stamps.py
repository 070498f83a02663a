"""Rate and evenness of time stamps."""

import numpy as np
import pytest

from sagnac.core import arrays
from sagnac.core.errors import RecordingError
from sagnac.recording.stamps import median_step, require_forwards, sampling


@pytest.mark.parametrize("size", [2, 3, 1000, 1001])
@pytest.mark.parametrize("repeats", [True, False])
def test_the_median_interval_is_exact_span_by_span(monkeypatch, size, repeats):
    random = np.random.default_rng(size)
    for stamps in (
        np.cumsum(random.exponential(size=size)),
        np.floor(np.arange(size) * 1.3) * 0.001,
        np.cumsum(
            random.choice([-0.5, 0.0, 0.01, np.nan, 1e300], p=[0.1, 0.3, 0.4, 0.1, 0.1])
            * np.ones(size)
        ),
        np.zeros(size),
    ):
        with np.errstate(invalid="ignore", over="ignore"):
            steps = np.diff(stamps)
            kept = steps[np.isfinite(steps) & (steps >= 0.0 if repeats else steps > 0.0)]
            expected = float(np.median(kept)) if kept.size else np.nan
            with monkeypatch.context() as patch:
                patch.setattr(arrays, "IN_MEMORY", 0)
                patch.setattr(arrays, "BLOCK", 97)
                long = arrays.empty(size)
                long[:] = stamps
                found = median_step(long, repeats=repeats)
            assert median_step(stamps, repeats=repeats) == pytest.approx(expected, nan_ok=True)
        assert found == expected or (np.isnan(found) and np.isnan(expected))


def test_even_stamps_give_their_rate_and_are_left_out():
    taken = sampling(1e4 + np.arange(1000) / 100.0)
    assert (taken.times, taken.sample_rate, taken.notes) == (None, 100.0, ())


def test_stamps_on_a_coarse_clock_are_taken_as_uniform_and_noted():
    taken = sampling(np.rint(1000.0 * np.arange(5000) / 99.9) / 1000.0)
    assert taken.times is None
    assert taken.sample_rate == pytest.approx(99.9, rel=1e-5)
    assert "on a clock of 0.001 s: taken as uniform" in str(taken.notes[0])


def test_uneven_stamps_stay():
    stamps = np.arange(1000) / 100.0 + 0.003 * np.random.default_rng(0).uniform(size=1000)
    taken = sampling(stamps)
    np.testing.assert_array_equal(taken.times, stamps - stamps[0])
    assert taken.notes[0].channel == "time"
    assert "not uniform" in taken.notes[0].text


def test_stamps_and_a_rate_have_to_agree():
    stamps = np.arange(1000) / 100.0
    taken = sampling(stamps, 100.5)
    assert taken.sample_rate == 100.0
    (note,) = taken.notes
    assert note.text == "100.5 Hz is stated, and the stamps give 100 Hz, which is taken"
    # Nothing is said of a rate that the stamps bear out, or that they cannot tell from theirs.
    assert sampling(stamps, 100.0).notes == ()
    coarse = sampling(np.floor(10.0 * stamps) / 10.0, 100.3)
    assert [note.text for note in coarse.notes if "stated" in note.text] == []
    with pytest.raises(RecordingError, match=r"time: the stamps give 100 Hz but 50 Hz is stated"):
        sampling(stamps, 50.0)


def test_stamps_that_do_not_run_forwards_need_a_rate():
    with pytest.raises(RecordingError, match="time: does not run forwards"):
        sampling(np.zeros(10))
    assert sampling(np.zeros(10), 5.0).sample_rate == 5.0
    assert sampling(-np.arange(50.0), 3.0).sample_rate == 3.0
    # One stamp that jumps back leaves the usual interval.
    assert sampling(np.array([0.0, 0.5, 1.0, 1.5, -1.0])).sample_rate == 2.0


def test_stamps_off_an_even_spacing_are_noted_with_the_worst():
    stamps = np.arange(100) / 8.0
    stamps[50] += 0.0613
    assert "stamps up to 0.0613 s off an even spacing" in sampling(stamps).notes[0].text


@pytest.mark.parametrize("gap", [False, True])
def test_stamps_that_are_no_times_are_refused(gap):
    stamps = 1e-320 * np.arange(100.0)
    if gap:
        stamps[50] = np.nan
    with pytest.raises(RecordingError, match="faster than any sensor samples"):
        sampling(stamps)


@pytest.mark.parametrize(
    ("period", "tick"),
    [(2.0**32, 1e-6), (2.0**32, 1e-3), (2.0**24, 1e-6), (2.0**16, 1e-3), (604_800.0, 1.0)],
)
def test_stamps_go_on_where_their_clock_starts_over(period, tick):
    """Counters in us and ms, and the second of a GPS week; a sample comes late now and then."""
    late = np.where(np.random.default_rng(4).random(9000) < 0.01, 0.004, 0.0)
    times = 0.01 * np.arange(9000) + late
    begins = period * tick - 30.0
    stamps = np.mod(np.round((begins + times) / tick, 3), period) * tick
    taken = sampling(stamps)
    assert taken.sample_rate == pytest.approx(100.0, rel=1e-3)
    assert taken.times is not None
    np.testing.assert_allclose(np.diff(taken.times), np.diff(times), atol=1.1 * min(tick, 1e-3))
    assert "starts over at" in taken.notes[0].text


def test_a_clock_that_starts_over_thousands_of_times_is_followed():
    """Sixteen bits of microseconds at 500 Hz: 30,000 times in half an hour."""
    ticks = 2000 * np.arange(1_000_000)
    taken = sampling((ticks % 2**16) * 1e-6)
    assert (taken.sample_rate, taken.times) == (500.0, None)
    assert "30517 times" in taken.notes[0].text


@pytest.mark.parametrize("length", [30.0, 60.0, 3600.0])
def test_logs_that_are_put_together_are_not_run_on(length):
    """Each begins at 0, and nobody knows what passed between them."""
    log = 0.1 * np.arange(round(10.0 * length))
    for stated in (None, 10.0):
        taken = sampling(np.concatenate([log, log]), stated)
        with pytest.raises(RecordingError, match="runs backwards 1 time"):
            require_forwards(taken)
