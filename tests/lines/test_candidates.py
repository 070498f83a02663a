"""Candidates of lines in table angle: sums over even angles against sums over the samples."""

import numpy as np
import pytest

from sagnac.lines import _kernels


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
