"""Passes of the search whose work its end does not show."""

from dataclasses import replace

import numpy as np

from sagnac.lines import passes
from sagnac.lines.components import components_of
from sagnac.lines.state import Record, first_state

RATE, SAMPLES = 100.0, 12_000
TURN = 2.0 * np.pi


def state_of(angle, table=None):
    walk = np.cumsum(7e-10 * np.random.default_rng(5).standard_normal(SAMPLES))
    record = Record(angle=walk + angle, encoder=table, sample_rate=RATE)
    return passes.looked(first_state(record))


def test_a_line_in_the_noise_is_pruned():
    tone = 1e-7 * np.cos(TURN * 7.3 / RATE * np.arange(SAMPLES) + 0.4)
    frequencies = np.array([7.3, 31.0]) / RATE
    phases = TURN * frequencies * (0.5 * (SAMPLES - 1)) + 0.4
    phasor = np.array([1e-7, 1e-13]) * np.exp(-1j * phases)
    both = components_of(SAMPLES, frequencies=frequencies, phasor=phasor)
    after = passes.joined_by(state_of(tone), both)
    for kept in (passes.pruned(after), passes.pruned_all(after)):
        np.testing.assert_allclose(kept.components.frequencies * RATE, [7.3], atol=1e-3)


def test_orders_no_larger_than_earth_rate_makes_them_wait():
    time = np.arange(SAMPLES) / RATE
    table = np.radians(90.0) * time + 0.9 * np.sin(time / 7.0)
    reach = np.zeros(128)
    reach[4] = 1e-7
    phasor = np.full(2, 9e-8 + 0j)
    orders = components_of(SAMPLES, orders=np.array([5.0, 6.0]), phasor=phasor)
    known = replace(state_of(0.5 * table, table), components=orders, earth_reach=reach)
    assert passes.without_earth_orders(known).components.orders.tolist() == [6.0]
    settled = replace(known, earth_settled=True)
    assert passes.without_earth_orders(settled) is settled
