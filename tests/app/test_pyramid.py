"""The pyramid against the lowest and highest values of the samples themselves."""

from itertools import pairwise

import numpy as np
import pytest

from sagnac.app.looks import Pyramid


def naive(values, first, stop):
    """Lowest and highest number from each first sample to the next."""
    edges = [*first.tolist(), stop]
    parts = [values[a:b] for a, b in pairwise(edges)]
    parts = [part[np.isfinite(part)] for part in parts]
    return (
        np.array([part.min() if part.size else np.nan for part in parts]),
        np.array([part.max() if part.size else np.nan for part in parts]),
    )


@pytest.mark.parametrize("size", [1, 63, 64, 65, 4097, 300_003])
@pytest.mark.parametrize("differenced", [False, True])
def test_a_window_holds_the_lowest_and_highest_value_of_every_block(size, differenced):
    random = np.random.default_rng(size)
    values = random.standard_normal(size)
    values[random.integers(0, size, size // 50)] = np.nan
    drawn = 3.0 * values
    if differenced:
        steps = np.diff(values)
        drawn = 3.0 * np.concatenate([steps[:1], steps]) if size > 1 else np.zeros(1)
    pyramid = Pyramid.of(values, factor=3.0, differenced=differenced)
    for start, stop in ((0, size), (size // 3, size), (size // 2, size // 2 + 700), (0, 1)):
        for most in (1, 7, 200, 1000):
            first, lowest, highest = pyramid.window(start, stop, most)
            # Blocks at the edges are whole, so that the last may reach past the window.
            step = first[-1] - first[-2] if first.size > 1 else size
            end = min(max(first[-1] + step, stop), size)
            low, high = naive(drawn, first, end)
            assert first[0] <= start
            np.testing.assert_array_equal(lowest[:-1], low[:-1])
            np.testing.assert_array_equal(highest[:-1], high[:-1])
            covered = naive(drawn, np.array([start]), min(stop, size))
            assert not np.nanmin(lowest, initial=np.inf) > covered[0][0]
            assert not np.nanmax(highest, initial=-np.inf) < covered[1][0]
            assert first.size <= 5 * most + 2


@pytest.mark.parametrize("differenced", [False, True])
def test_mean_and_deviation_are_those_of_all_numbers(differenced):
    random = np.random.default_rng(3)
    # More samples than are worked on at once, far from zero, some of them no numbers.
    values = 1e6 + np.cumsum(random.standard_normal(1_300_000))
    values[random.integers(0, values.size, 500)] = np.nan
    pyramid = Pyramid.of(values, factor=3.0, differenced=differenced).times(0.5)
    drawn = 1.5 * (np.diff(values, prepend=2.0 * values[0] - values[1]) if differenced else values)
    assert pyramid.mean == pytest.approx(np.nanmean(drawn), rel=1e-9)
    assert pyramid.deviation == pytest.approx(np.nanstd(drawn), rel=1e-9)
    _, _, high = pyramid.window(0, values.size, 50)
    assert np.nanmax(high) == pytest.approx(np.nanmax(drawn), rel=1e-12)


def test_without_a_number_there_is_no_mean():
    pyramid = Pyramid.of(np.full(100, np.nan))
    assert np.isnan([pyramid.mean, pyramid.deviation]).all()


def test_a_single_spike_is_seen_at_any_zoom():
    values = np.zeros(2_000_000)
    values[1_234_567] = 5.0
    pyramid = Pyramid.of(values)
    for most in (50, 333, 1500):
        first, _, high = pyramid.window(0, values.size, most)
        place = int(np.argmax(high))
        assert high[place] == 5.0
        assert first[place] <= 1_234_567
        assert place + 1 == first.size or first[place + 1] > 1_234_567


@pytest.mark.parametrize(("start", "stop", "most"), [(5, 5, 10), (200, 300, 10), (0, 10, 0)])
def test_a_window_without_samples_is_refused(start, stop, most):
    with pytest.raises(ValueError, match="no sample"):
        Pyramid.of(np.zeros(100)).window(start, stop, most)
