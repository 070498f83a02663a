"""Passes of the search whose work its end does not show."""

from dataclasses import replace

import numpy as np
import pytest

from sagnac.core import arrays
from sagnac.lines import passes
from sagnac.lines.components import components_of
from sagnac.lines.search import remove_lines
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


@pytest.mark.parametrize("rate", [10.0, 100.0])
def test_the_averages_of_a_record_of_several_pieces_are_those_of_the_whole(monkeypatch, rate):
    monkeypatch.setattr(arrays, "BLOCK", 2_000)  # at 10 Hz an average is of one sample
    time = np.arange(SAMPLES) / rate
    state = first_state(Record(angle=np.sin(time), encoder=0.3 * time, sample_rate=rate))
    assert state.motion is not None
    block = state.motion.kinematics.block
    averages = state.residual()[: SAMPLES // block * block].reshape(-1, block).mean(axis=1)
    np.testing.assert_allclose(state.averages(block), averages, rtol=0.0, atol=1e-12)
    known = passes.followed(state)
    assert known.motion is not None


SECONDS = np.arange(2 * SAMPLES) / RATE
TONE = 1e-3 * np.cos(TURN * 0.37 * SECONDS + 1.0)


def unsteady_table(random):
    """Table angle at 10 deg/s: a servo jitters by 0.03 deg/s, which it keeps for half a second."""
    pushes = np.convolve(random.standard_normal(SECONDS.size), np.exp(-np.arange(300) / 50.0))
    rate = 10.0 + 0.03 * pushes[: SECONDS.size] / pushes.std()
    return np.cumsum(np.radians(rate)) / RATE


@pytest.mark.parametrize("share", [2e-3, 0.0])
def test_a_tone_in_the_angle_that_gyros_tell_is_no_share_of_the_table(share):
    random = np.random.default_rng(11)
    turned, steps = unsteady_table(random), 5e-9 * random.standard_normal(SECONDS.size)
    angle = share * turned + TONE + np.cumsum(steps)
    removal = remove_lines(angle, turned + 0.5 * TONE, RATE, channel="x-z")
    assert np.std(np.diff(removal.residual)) == pytest.approx(np.std(steps), rel=0.02)
    strongest = max(removal.lines, key=lambda line: line.amplitude)
    assert strongest.scale == "time"
    assert strongest.frequency == pytest.approx(0.37, abs=1e-6)
    assert strongest.amplitude == pytest.approx((1.0 - 0.5 * share) * 1e-3, rel=1e-5)


@pytest.mark.parametrize("hunts", [0.0, 1.0])
def test_what_a_table_turns_goes_with_its_share_and_is_no_tone(hunts):
    random = np.random.default_rng(12)
    turned, steps = unsteady_table(random), 5e-9 * random.standard_normal(SECONDS.size)
    turned += hunts * TONE
    removal = remove_lines(2e-3 * turned + np.cumsum(steps), turned, RATE, channel="x-z")
    assert np.std(np.diff(removal.residual)) == pytest.approx(np.std(steps), rel=0.02)
    assert not [line for line in removal.lines if line.scale == "time"]
