"""Tones beside the orders of a table that turns and stands by turns, or goes back and forth."""

import numpy as np
import pytest
from scipy.signal import lfilter

from sagnac.lines.search import remove_lines

RATE = 200.0


@pytest.mark.parametrize(
    ("seconds", "half", "seed", "size"),
    [
        (900.0, 50.0, 1, 1.5e-7),
        pytest.param(1800.0, 100.0, 4, 1.5e-7, marks=pytest.mark.statistics),
        (900.0, 50.0, 1, 1.5e-6),
    ],
)
def test_mains_that_wander_are_no_order_and_cost_none(seconds, half, seed, size):
    """The table angle holds a part of the mains, as an angle that the gyros lead does."""
    random = np.random.default_rng(seed)
    time = np.arange(round(RATE * seconds)) / RATE
    phase = time % (2.0 * half)
    speed = np.clip(np.minimum(phase, half - phase) / 4.0, 0.0, 1.0)
    table = np.cumsum(np.radians(20.0) * speed) / RATE
    # Frequency that wanders by 4 mHz rms with a memory of 80 s.
    kept = np.exp(-1.0 / (80.0 * RATE))
    moved = lfilter([1.0], [1.0, -kept], random.standard_normal(time.size))
    wander = np.cumsum(0.004 * np.sqrt(1.0 - kept**2) * moved) / RATE
    angle = np.cumsum(6e-10 * random.standard_normal(time.size))
    angle += 4.8e-9 * random.standard_normal(time.size)
    angle += 2e-6 * np.cos(table) + 1.6e-7 * np.cos(24.0 * table)
    mains = size * np.cos(2.0 * np.pi * (50.0 * time + wander))
    removal = remove_lines(angle + mains, table + mains, RATE, channel="x")
    # At 20 deg/s the mains turn as order 900.
    orders = {line.frequency: line.amplitude for line in removal.lines if line.scale == "angle"}
    assert removal.unfinished is None
    assert orders == {24.0: pytest.approx(1.6e-7, rel=0.01), 1.0: pytest.approx(2e-6, rel=0.01)}


@pytest.mark.parametrize("tone", [0.0, 1.5e-7])
@pytest.mark.parametrize("corner", [np.inf, 4.0])
def test_a_tone_among_the_orders_of_a_sweep_leaves_the_noise(tone, corner):
    """A function of the angle took a part of the tone for orders, and left a comb beside it."""
    random, time = np.random.default_rng(11), np.arange(80_000) / RATE
    # 20 deg/s over 1.5 turns as a sine, or 2.2 straight with round corners: order 60 at 3.3 Hz.
    swing = np.sin(np.radians(20.0) / (1.5 * np.pi) * time)
    speed = swing if np.isinf(corner) else np.clip(corner * swing, -1.0, 1.0)
    table = np.radians(20.0) * np.cumsum(speed) / RATE
    walk = np.cumsum(1.4e-8 * random.standard_normal(time.size))
    orders = np.array([2.0, 3.0, 5.0, 12.0, 24.0, 36.0, 60.0])
    phases = random.uniform(0.0, 2.0 * np.pi, orders.size)
    shown = 1.5e-5 * np.cos(np.outer(table, orders) + phases) @ orders**-0.5
    angle = walk + shown + tone * np.cos(2.0 * np.pi * 3.7 * time)
    removal = remove_lines(angle, table, RATE, channel="x")
    found = {(one.scale, round(one.frequency, 2)): one.amplitude for one in removal.lines}
    expected = {("time", 3.7): tone} if tone else {}
    if not np.isinf(corner):
        # From two turns on orders are told apart.
        expected |= {("angle", order): 1.5e-5 * order**-0.5 for order in orders.tolist()}
    assert found == pytest.approx(expected, rel=0.01)
    # What is left has the power of the noise where the orders and the tone were.
    power, own = (
        np.abs(np.fft.rfft(np.diff(one) * np.hanning(time.size - 1))) ** 2
        for one in (removal.residual, walk)
    )
    near = slice(round(2.5 * 400.0), round(4.5 * 400.0))
    assert power[near].mean() == pytest.approx(own[near].mean(), rel=0.05)
