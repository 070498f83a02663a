"""Blocks that stand in a record twice, found by their values."""

import numpy as np
import pytest

from sagnac.core import arrays
from sagnac.quality.samples import longest_twice


@pytest.mark.parametrize(("first", "samples", "again"), [(0, 64, 500), (700, 1000, 2500)])
def test_a_block_is_found_where_it_was_put(first, samples, again):
    values = np.random.default_rng(first).standard_normal(5000)
    block, distance = longest_twice(np.insert(values, again, values[first : first + samples]))
    assert (block, block.start + distance) == (slice(first, first + samples), again)


def test_the_longer_of_two_is_told():
    values = np.random.default_rng(3).standard_normal(5000)
    doubled = np.concatenate([values, values[100:200], values[1000:1500]])
    assert longest_twice(doubled) == (slice(1000, 1500), 4100)


@pytest.mark.parametrize("length", [1, 64, 777, 1000])
def test_blocks_of_any_length_lose_no_window(monkeypatch, length):
    """The repetition lies across their borders; zeros fill the room for windows in the first."""
    monkeypatch.setattr(arrays, "BLOCK", length)
    values = np.random.default_rng(5).standard_normal(5000)
    block, distance = longest_twice(np.insert(values, 2500, values[700:1700]))
    assert (block, block.start + distance) == (slice(700, 1700), 2500)
    assert longest_twice(np.zeros(4000))[1] == 0


@pytest.mark.parametrize(
    "values",
    [
        np.zeros(4000),
        np.tile(np.arange(40.0), 100),
        np.rint(0.3 * np.random.default_rng(1).standard_normal(200_000)),
        np.rint(3.0 * np.random.default_rng(2).standard_normal(200_000)),
        np.random.default_rng(3).standard_normal(100),
    ],
)
def test_what_goes_round_or_takes_few_values_is_no_block(values):
    assert longest_twice(values)[1] == 0


def test_a_dither_that_comes_round_is_no_block_twice():
    """Increments of a dithered ring laser, read out coarsely, were said to be there again."""
    for seed in range(6):
        random = np.random.default_rng(seed)
        phase = 2.0 * np.pi * np.cumsum(0.4127 + 2e-5 * random.normal(size=200_000))
        angle = 60.0 * np.sin(phase) + np.cumsum(0.005 * random.normal(size=phase.size))
        values = np.diff(np.round(angle / 1.2))
        assert longest_twice(values)[1] == 0
