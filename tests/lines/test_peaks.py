"""Peaks over table angle: sums over even angles against sums over the samples; floors of bins."""

import numpy as np
import pytest

from sagnac.core import arrays
from sagnac.lines import _kernels
from sagnac.lines.detection import Peaks, peaks


def test_spread_products_have_the_sums_of_the_samples():
    generator = np.random.default_rng(6)
    table = np.cumsum(generator.normal(0.02, 0.05, 4001))
    middle, own = 0.5 * (table[1:] + table[:-1]), np.diff(table)
    scale = 8 * 10.0 / (2.0 * np.pi)  # eight angles to a cycle of order 10
    # A strong order far beyond, which even angles fold onto order 7.
    products = generator.normal(size=4000) + 100.0 * np.cos(73.0 * middle)
    grid = np.zeros(int(np.ptp(table) * scale) + 5)
    _kernels.spread(table, products / own, table.min(), scale, grid)
    angles = table.min() + (np.arange(grid.size) - 1.0) / scale
    for order in (0.3, 2.4, 7.0, 7.77, 10.0):
        direct = np.sum(products * np.exp(1j * order * middle))
        shared = np.sum(grid * np.exp(1j * order * angles))
        # The transform of a cubic B-spline, at `order` over the angles' rate in cycles.
        shared /= np.sinc(order / (2.0 * np.pi * scale)) ** 4
        # The strong order sums up to 200000 at its own place.
        assert shared == pytest.approx(direct, abs=100.0)


def naive_level(floor, halves, n):
    whole = n // 2
    after = min((n + 1) // 2, floor.size - 1)
    return max(0.5 * (floor[whole] + floor[after]), halves[min(whole, halves.size - 1)])


@pytest.mark.parametrize("bins", [10, 11])
def test_the_floor_at_half_bins_is_that_of_their_neighbours_or_of_the_halves(bins):
    generator = np.random.default_rng(1)
    floor, halves = generator.uniform(1.0, 2.0, 11), generator.uniform(1.0, 2.0, bins)
    found = [_kernels.level_at(floor, halves, n) for n in range(21)]
    assert found == [naive_level(floor, halves, n) for n in range(21)]
    assert _kernels.level_at(floor, np.empty(0), 7) == floor[7]


def test_a_peak_is_placed_at_the_top_of_a_parabola():
    power = np.ones(64)
    power[30:33] = 80.0, 100.0, 90.0
    found = peaks(power, np.ones(64), 50.0, 8)
    # Vertex of the parabola through (30, 80), (31, 100), (32, 90).
    assert found.place == pytest.approx([31.0 + 5.0 / 30.0])
    assert found.height.tolist() == [100.0]
    assert peaks(power, np.ones(64), 50.0, 40).place.size == 0
    assert peaks(power, np.ones(64), 50.0, 63).place.size == 0


@pytest.mark.parametrize("block", [7, 1000])
def test_peaks_by_blocks_are_those_of_the_whole(monkeypatch, block):
    monkeypatch.setattr(arrays, "BLOCK", block)
    generator = np.random.default_rng(2)
    power = generator.exponential(size=401)
    floor, halves = generator.uniform(1.0, 2.0, 201), generator.uniform(1.0, 2.0, 200)
    ratio = power / [naive_level(floor, halves, n) for n in range(401)]
    tops = [n for n in range(8, 400) if 0.9 < ratio[n] >= ratio[n - 1] and ratio[n] > ratio[n + 1]]
    found = peaks(power, floor, 1.0, 8, halves)
    assert np.rint(found.place).tolist() == tops
    assert found.height.tolist() == power[tops].tolist()


def test_peaks_have_one_height_each():
    with pytest.raises(ValueError, match=r"place has shape \(2,\); give \(3,\)"):
        Peaks(place=np.zeros(2), height=np.zeros(3))
