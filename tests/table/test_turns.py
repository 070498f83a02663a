"""Turns of the table, and the angle once a turn."""

import tracemalloc

import numpy as np
import pytest

from sagnac.core import arrays
from sagnac.core.errors import RecordingError
from sagnac.table.kinematics import kinematics
from sagnac.table.turns import (
    full_rotation_samples,
    full_turn_times,
    full_turns,
    function_of_angle,
    is_turning,
    mean_rate,
)

TURN = 2.0 * np.pi


@pytest.fixture(autouse=True)
def several_spans(monkeypatch):
    monkeypatch.setattr(arrays, "BLOCK", 5000)


@pytest.mark.parametrize("start", [0.0, 0.3, -1.7, 40.2])
@pytest.mark.parametrize("rate", [0.013, -0.013, 0.31])
def test_full_turn_times_of_a_constant_rate(start, rate):
    table = TURN * (start + rate * np.arange(2000))
    times = full_turn_times(table)
    low, high = sorted((start, start + rate * 1999))
    whole = np.arange(np.ceil(low), np.floor(high) + 1.0)
    assert times == pytest.approx(np.sort((whole - start) / rate), abs=1e-8)


def test_full_turn_times_of_a_changing_rate():
    # Turns grow as the square of time: crossings at square roots.
    number = np.arange(20_000)
    table = TURN * 30.5 * (number / number[-1]) ** 2
    expected = np.sqrt(np.arange(0.0, 31.0) / 30.5) * number[-1]
    # Straight lines between samples: the bend of one step is half of 3e-7 turns.
    assert full_turn_times(table)[1:] == pytest.approx(expected[1:], abs=1e-3)


def test_a_null_angle_shifts_the_turns():
    table = TURN * 0.01 * np.arange(1000)
    times = full_turn_times(table, null_angle=TURN * 0.25)
    assert times == pytest.approx(25.0 + 100.0 * np.arange(10), abs=1e-9)


def test_a_reversing_table_crosses_each_new_turn_once():
    # Forward 3.5 turns, back 1.2, forward again to 6.3: turns 3 and then 4, 5, 6 are new once.
    legs = [np.linspace(0.0, 3.5, 351), np.linspace(3.49, 2.3, 120), np.linspace(2.31, 6.3, 400)]
    turns = np.concatenate(legs)
    times = full_turn_times(TURN * turns)
    first = [0.0, *(np.argmax(turns >= whole - 1e-12) for whole in range(1, 7))]
    assert times == pytest.approx(first, abs=1e-6)
    assert np.all(np.diff(times) > 0.0)


def test_a_table_that_mostly_turns_back_counts_in_its_net_direction():
    turns = np.concatenate([np.linspace(0.0, 1.5, 151), np.linspace(1.49, -3.2, 470)])
    times = full_turn_times(TURN * turns)
    expected = [0.0, *(np.argmax(turns <= whole + 1e-12) for whole in (-1, -2, -3))]
    assert times == pytest.approx(expected, abs=1e-6)


def test_fris_reads_the_angle_at_each_full_turn():
    number = np.arange(30_000)
    table = TURN * (0.37 + 0.0011 * number + 0.05 * np.sin(number / 900.0))
    angle = 1e-6 * number + 1e-3 * np.sin(number / 300.0) + 0.2 * (np.cos(table) - 1.0)
    times, values = full_rotation_samples(angle, table)
    assert np.interp(times, number, table) / TURN == pytest.approx(
        np.arange(1.0, times.size + 1.0), abs=1e-9
    )
    assert values == pytest.approx(np.interp(times, number, angle), abs=1e-12)
    # What is periodic in table angle is gone.
    without = 1e-6 * times + 1e-3 * np.sin(times / 300.0)
    assert values == pytest.approx(without, abs=1e-5)


@pytest.mark.parametrize("length", [1, 7, 100, 870, 871])
def test_turns_are_the_same_by_spans_of_any_length(monkeypatch, length):
    # A crossing on the border of two spans, and one passed again going back, count once.
    legs = [np.linspace(0.0, 3.5, 351), np.linspace(3.49, 2.3, 120), np.linspace(2.31, 6.3, 400)]
    table = TURN * np.concatenate(legs)
    angle = np.random.default_rng(0).standard_normal(table.size)
    whole = [*full_rotation_samples(angle, table), mean_rate(table, 100.0)]
    whole += [full_turns(table), full_turn_times(-table, null_angle=0.3)]
    monkeypatch.setattr(arrays, "IN_MEMORY", 0)
    monkeypatch.setattr(arrays, "BLOCK", length)
    spans = [*full_rotation_samples(angle, table), mean_rate(table, 100.0)]
    spans += [full_turns(table), full_turn_times(-table, null_angle=0.3)]
    for one, other in zip(whole, spans, strict=True):
        np.testing.assert_array_equal(one, other)
    assert whole[0].size == 7


@pytest.mark.parametrize("rate", [0.0113, -0.0113])
def test_fris_counts_its_turns_from_the_null_pulse(rate):
    # Full turns where the pulse comes, not where the encoder happens to read zero.
    number = np.arange(30_000)
    table = TURN * (0.1 + rate * number + 0.05 * np.sin(number / 900.0))
    null = 0.731
    passed = np.floor(table / TURN - null)
    pulse = np.append(False, passed[1:] != passed[:-1])
    angle = 1e-3 * np.cos(table) + 1e-8 * number
    times, values = full_rotation_samples(angle, table, pulse)
    turns = np.interp(times, number, table) / TURN
    assert np.abs(np.diff(turns)) == pytest.approx(np.ones(times.size - 1), abs=1e-9)
    # Some 330 pulses, each good to a step of 0.0113 turns: 0.0113 / sqrt(12 * 330).
    assert np.mean(turns - np.floor(turns)) == pytest.approx(null, abs=4 * 0.0113 / np.sqrt(3960))
    # Without an encoder each is good to a step, and the angle to what it turns meanwhile.
    alone, coarse = full_rotation_samples(angle, None, pulse)
    assert alone == pytest.approx(times, abs=0.7)
    assert coarse == pytest.approx(values, abs=1e-3 * TURN * 0.0113)


@pytest.mark.parametrize("turns", [0.0, 0.4, 1.9, -1.9])
def test_fris_refuses_fewer_than_two_turns(turns):
    table = TURN * np.linspace(0.05 * np.sign(turns), turns, 500)
    with pytest.raises(RecordingError, match="never completes two full turns") as caught:
        full_rotation_samples(np.zeros(500), table)
    assert "\n" not in str(caught.value)
    assert caught.value.channel == "table"
    assert caught.value.remedy == "use {method fos}"


def test_rates_and_turns():
    table = TURN * np.linspace(0.5, -4.5, 5001)
    assert full_turns(table) == pytest.approx(5.0)
    assert mean_rate(table, 100.0) == pytest.approx(-TURN * 5.0 / 50.0)
    there_and_back = TURN * np.concatenate([np.linspace(0, 3, 3001), np.linspace(3, 0, 3001)[1:]])
    assert mean_rate(there_and_back, 100.0) == pytest.approx(TURN * 0.1, rel=1e-3)
    # However many samples are left over after the last whole tenth of a second.
    for samples in range(101, 112):
        steady = TURN * np.arange(samples) / 1000.0
        assert mean_rate(steady, 100.0) == pytest.approx(TURN * 0.1, rel=1e-12)
    assert is_turning(table)
    assert not is_turning(None)
    assert not is_turning(np.full(10, 3.0) + 1e-3 * np.arange(10) / 10)


def test_a_pulse_without_an_encoder_says_nothing_of_degrees():
    pulse = np.zeros(10, dtype=bool)
    pulse[[3, 6]] = True
    with pytest.raises(RecordingError, match=r"two full turns, so") as caught:
        full_rotation_samples(np.zeros(10), None, pulse)
    assert caught.value.path == ""


def test_two_hours_of_a_slow_table_take_little_memory():
    rate, count = 50.0, 360_000
    table = np.deg2rad(0.1) * np.arange(count) / rate
    walk = np.cumsum(3e-7 * np.random.default_rng(8).standard_normal(count))
    bump = 1e-3 * np.exp(-0.5 * ((table % TURN - 2.0) / 0.05) ** 2)
    tracemalloc.start()
    found = function_of_angle(1.001 * table + walk + bump, kinematics(table, rate))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    # It was 22 GB: 3600 orders of 72,000 averages.
    assert peak < 200e6
    # Over half a minute, in which the noise of low orders hardly moves.
    left, were = (one[1500:] - one[:-1500] for one in (found.less(bump, table), bump))
    assert np.std(left) < 0.2 * np.std(were)


@pytest.mark.parametrize("motion", ["swings", "steps", "turns evenly"])
def test_orders_that_are_not_whole_go_with_the_angle_over_a_few_turns(motion):
    rate = 20.0
    seconds = np.arange(18_000) / rate
    # Three turns to and fro; a quarter of a turn a minute, in 3 s; or at an even rate.
    moved = np.clip(seconds % 60.0 / 3.0, 0.0, 1.0)
    moved -= np.sin(TURN * moved) / TURN
    table = {
        "swings": 1.5 * TURN * np.sin(TURN * seconds / 100.0),
        "steps": 0.25 * TURN * (seconds // 60.0 + moved),
        "turns evenly": 3.7 * TURN * seconds / 900.0,
    }[motion]
    random = np.random.default_rng(4)
    walk = np.cumsum(3e-8 * random.standard_normal(seconds.size))
    bearing = 1e-6 * (np.cos(7.31 * table + 0.7) + 2.0 * np.cos(0.43 * table) + np.cos(3.0 * table))
    found = function_of_angle(0.577 * table + walk + bearing, kinematics(table, rate))
    assert found is not None
    # At an even rate the others are lines in time, and are left for the search to find.
    even = motion == "turns evenly"
    assert np.all(found.orders == np.rint(found.orders)) == even
    # The steps of what is left beside the table's own motion, which goes with its angle, too.
    left, step = np.diff(found.less(walk + bearing, table)), np.diff(table)
    left -= step * (step @ left) / (step @ step)
    assert (np.std(left) < 1.05 * np.std(np.diff(walk))) == (not even)


@pytest.mark.parametrize(
    ("fastest", "order"),  # deg/s
    [(20.0, 25), (20.0, 50), (46.0, 13), (46.0, 50), (80.0, 62), (120.0, 13), (120.0, 62)],
)
def test_an_order_of_a_sweep_is_taken_at_every_speed(order, fastest):
    """Averages of a tenth of a second hold less of it where the table is fast, or nothing."""
    rate, seconds = 200.0, np.arange(60_000) / 200.0
    table = 0.75 * TURN * np.sin(np.deg2rad(fastest) / (0.75 * TURN) * seconds)
    walk = np.cumsum(1e-8 * np.random.default_rng(5).standard_normal(seconds.size))
    shown = 5e-7 * np.cos(order * table + 0.7)
    found = function_of_angle(0.577 * table + walk + shown, kinematics(table, rate))
    assert found is not None
    # Its steps, in which the noise of low orders hardly shows.
    left = np.diff(found.less(shown, table))
    assert np.std(left) < 0.03 * np.std(np.diff(shown))


@pytest.mark.parametrize("seconds", [40.0, 60.0])
@pytest.mark.parametrize("highest", [1, 50])
def test_a_short_record_shows_as_many_orders_as_a_long_one(highest, seconds):
    """Averages of a tenth of a second were too few for more than 20 or 30."""
    rate = 200.0
    time = np.arange(round(seconds * rate)) / rate
    table = 0.6 * TURN * time / seconds
    walk = np.cumsum(1e-8 * np.random.default_rng(5).standard_normal(time.size))
    shown = 5e-6 * (np.cos(table + 0.7) + np.cos(highest * table + 1.9))
    found = function_of_angle(0.577 * table + walk + shown, kinematics(table, rate))
    if highest == 1:
        assert found is None or found.orders.size <= 8
        return
    assert found is not None
    # Within the record, since neither ends of the function nor the table's own motion are told.
    wave = np.hanning(time.size) * np.exp(-1j * highest * table)
    assert abs(wave @ found.less(walk + shown, table)) < 0.1 * abs(wave @ shown)


def stepped(duration, rate, *, step, move, dwell, steps=1000):
    """(samples,) angle of a table that moves by a step, rad, and dwells, to and fro."""
    time = np.arange(round(duration * rate)) / rate
    moved = np.clip(time % (move + dwell) / move, 0.0, 1.0)
    moved += time // (move + dwell) - np.sin(TURN * moved) / TURN
    return step * np.abs((moved + steps) % (2 * steps) - steps)


@pytest.mark.parametrize("dwell", [0.5, 8.0, 15.0])
def test_orders_of_a_table_that_stops_are_taken_however_long_it_stops(dwell):
    """Where it moves in a twentieth of the time, its speed was taken for that of the rest."""
    rate = 200.0
    table = stepped(200.0, rate, step=np.radians(10.0), move=0.5, dwell=dwell)
    walk = np.cumsum(1e-8 * np.random.default_rng(5).standard_normal(table.size))
    shown = 1e-6 * (np.cos(3.0 * table + 0.7) + np.cos(25.0 * table))
    found = function_of_angle(0.577 * table + walk + shown, kinematics(table, rate))
    assert found is not None
    left, step = np.diff(found.less(walk + shown, table)), np.diff(table)
    left -= step * (step @ left) / (step @ step)
    assert np.std(left) < 1.02 * np.std(np.diff(walk))


@pytest.mark.parametrize("duration", [500.0, 900.0])
def test_a_band_of_which_a_tenth_went_with_the_angle_is_masked(duration):
    rate, random = 50.0, np.random.default_rng(5)
    table = stepped(duration, rate, step=np.radians(30.0), move=10.9, dwell=9.8, steps=12)
    walk = np.cumsum(1e-8 * random.standard_normal(table.size))
    orders, phases = random.uniform(1.0, 60.0, 8), random.uniform(0.0, 6.0, 8)
    shown = 2e-7 * np.cos(np.outer(orders, table) + phases[:, np.newaxis]).sum(axis=0)
    found = function_of_angle(0.577 * table + walk + shown, kinematics(table, rate))
    assert found is not None
    left, step = np.diff(found.less(walk + shown, table)), np.diff(table)
    left -= step * (step @ left) / (step @ step)
    band = np.fft.rfftfreq(left.size, 1.0 / rate) < found.taken[0].max()
    own, after = (np.sum(np.abs(np.fft.rfft(one)[band]) ** 2) for one in (np.diff(walk), left))
    assert (len(found.masked) > 0) == (1.0 - after / own > 0.1) == (duration < 600.0)


@pytest.mark.parametrize("turns", [0.4, pytest.param(0.83, marks=pytest.mark.statistics), 1.0])
def test_over_a_turn_or_less_a_walk_goes_with_no_angle(turns):
    """As many orders as ordinates would take all noise below their frequencies."""
    rate, seconds = 20.0, np.arange(12_000) / 20.0
    table = turns * TURN * seconds / 600.0
    walk = np.cumsum(6e-9 * np.random.default_rng(6).standard_normal(seconds.size))
    shown = 1e-6 * (3.0 * np.cos(table + 0.7) + np.cos(2.0 * table))
    found = function_of_angle(2e-3 * table + walk + shown, kinematics(table, rate))
    assert found is None or found.orders.size <= 8
