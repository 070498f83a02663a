"""Means of a residual against what was put in."""

import numpy as np
import pytest

from sagnac.analysis.measurement import Remainder
from sagnac.analysis.spectra import multitaper_density, residual_of
from sagnac.core import arrays
from sagnac.lines.model import Removal

RATE = 100.0
SAMPLES = 200_001


def left_of(angle, **changes):
    removal = Removal(residual=angle, lines=(), masked=(), taken=np.empty((3, 0)), notes=())
    return Remainder(removal=removal, rate=RATE, **changes)


def turning():
    """Twenty turns, an order 7 of 3e-6 rad in the angle before, a drift of 1e-8 rad/s^2 after."""
    time = np.arange(SAMPLES) / RATE
    table = 2.0 * np.pi * time / 100.0
    return time, table, 3e-6 * np.sin(7.0 * table), 0.5e-8 * time**2


def test_the_rate_against_time():
    time, _, _, after = turning()
    found = residual_of(after, left_of(after), None)
    assert found.by_angle is None
    assert found.rate == pytest.approx(1e-8 * (found.time - time.mean()), abs=1e-10)


def test_an_order_stands_where_it_was_put(monkeypatch):
    _, table, before, after = turning()
    # Blocks much shorter than the record, so that steps between them count too.
    monkeypatch.setattr(arrays, "BLOCK", 777)
    turn = residual_of(before, left_of(after), table).by_angle
    # Rate amplitude: that of the angle times 7 and the rate of the table, less what a sector of
    # the turn averages out.
    width = 2.0 * np.pi / 256
    rate = 3e-6 * 7.0 * 2.0 * np.pi / 100.0 * np.sinc(7.0 * width / (2.0 * np.pi))
    assert turn.order[6] == 7.0
    assert turn.amplitude_before[6] == pytest.approx(rate, rel=1e-3)
    assert np.delete(turn.amplitude_before, 6).max() < 1e-3 * rate
    # A drift of 1e-6 rad/s a turn is a saw of that height: 1e-6/(pi m) in order m.
    assert turn.amplitude_after[:3] == pytest.approx(1e-6 / np.pi / np.arange(1.0, 4.0), rel=0.01)
    assert np.ptp(turn.before) == pytest.approx(2.0 * rate, rel=0.01)


def test_too_few_turns_or_one_angle_a_turn_have_no_mean():
    _, table, before, after = turning()
    few = table[:20_000]
    assert residual_of(before[:20_000], left_of(after[:20_000]), few).by_angle is None
    once = left_of(after, once_a_turn=True)
    assert residual_of(before, once, table).by_angle is None


def test_a_strong_line_does_not_lift_the_floor_of_the_figures_spectrum():
    random, rate, line = np.random.default_rng(3), 100.0, 0.1234
    noise = random.standard_normal(120_000)
    time = np.arange(noise.size) / rate
    strong = 1e4 * np.cos(2.0 * np.pi * line * time)
    shown = multitaper_density(noise + strong, rate, tapers=1)
    far = shown.frequency > 10.0 * line
    # One-sided density of white increments of variance one, as a rate: 2 * rate.
    assert np.mean(shown.density[far]) == pytest.approx(2.0 * rate, rel=0.1)
