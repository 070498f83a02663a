"""Inner products against increments written out, and the blocks that they rest on."""

from dataclasses import replace

import numpy as np
import pytest

from sagnac.core import arrays
from sagnac.lines.components import components_of
from sagnac.lines.joint_fit import inner_products
from sagnac.lines.sampling import Sampling
from tests.lines.test_joint_fit import MIXED, SAMPLES, wandering_table


def sampling(samples, table):
    return Sampling(samples=samples, table=table, sample_rate=100.0)


def test_inner_products_are_those_of_the_increments(monkeypatch):
    monkeypatch.setattr(arrays, "BLOCK", 8192)
    table = wandering_table()
    number = np.arange(SAMPLES) - 0.5 * (SAMPLES - 1)
    middle, width = 0.5 * (table.min() + table.max()), np.ptp(table)
    phasors = [np.exp(1j * order * table) for order in MIXED.orders]
    phasors += [np.exp(2j * np.pi * one * number) for one in MIXED.frequencies]
    lags = [(table - middle) / width] * MIXED.orders.size
    lags += [2.0 * np.pi * number / SAMPLES] * MIXED.frequencies.size
    slopes = [lag * phasor for lag, phasor in zip(lags, phasors, strict=True)]
    steps = np.diff(np.array(phasors + slopes), axis=1)
    found = inner_products(sampling(SAMPLES, table), MIXED)
    size = np.sqrt(np.einsum("ij,ij->i", steps, steps.conj()).real)
    scale = np.outer(size, size)
    # Derivatives of whole orders that are not tuned are not needed, and not made.
    made = np.abs(found).max(axis=0) > 0.0
    assert np.count_nonzero(made) > 100
    for own, sums in zip(found, (steps @ steps.conj().T, steps @ steps.T), strict=True):
        assert np.abs((own - sums) / scale)[made].max() < 1e-3


def test_blocks_are_long_where_the_table_turns_evenly():
    even = np.linspace(0.0, 20.0, 5001)
    blocks = sampling(5001, even).blocks
    assert blocks.length[:-1].tolist() == [256.0] * (blocks.length.size - 1)
    assert blocks.length.sum() == 5000
    assert blocks.step == pytest.approx(np.full(blocks.length.size, 20.0 / 5000))
    assert blocks.lag @ blocks.length == pytest.approx(0.0, abs=1e-6)
    rough = even + 0.05 * np.random.default_rng(0).standard_normal(even.size)
    assert sampling(5001, rough).blocks.length.max() == 1.0


def test_what_does_not_go_together_is_refused():
    with pytest.raises(ValueError, match=r"free has shape \(0,\); give \(1,\)"):
        replace(components_of(5), orders=np.ones(1))
    with pytest.raises(ValueError, match=r"phasor has shape \(0,\); give \(3,\)"):
        replace(components_of(5), frequencies=np.full(3, 0.1))
