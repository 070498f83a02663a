"""The table's rotation against closed forms and against motion integrated here."""

import numpy as np
import pytest
from scipy.integrate import cumulative_simpson

from sagnac import series
from sagnac.errors import RecordingError
from sagnac.table.kinematics import averaged, kinematics
from sagnac.table.motion import follow_table
from sagnac.table.turns import (
    full_rotation_samples,
    full_turn_times,
    full_turns,
    is_turning,
    mean_rate,
)

ARCSECOND = np.pi / 648_000
EARTH = 7.292115e-5
TURN = 2.0 * np.pi


# --- turns and their times -----------------------------------------------------------------


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
    monkeypatch.setattr(series, "IN_MEMORY", 0)
    monkeypatch.setattr(series, "SPAN", length)
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


# --- table motion and Earth rate -------------------------------------------------------------

RATE = 100.0
SHARE, DRIFT, EARTH_TERMS = 2.1e-3, 2.5e-6, (3.1e-5, -2.2e-5)


def motion(speed):
    """Table angle (fine and at the samples) from a speed on a grid eight times as fine."""
    fine = np.concatenate([[0.0], cumulative_simpson(speed, dx=1.0 / (8.0 * RATE))]) + 0.7
    return fine, fine[::8]


def sensed(fine, *, share=SHARE, drift=DRIFT, earth=EARTH_TERMS):
    """Gyro angle along a motion: the rates integrated by Simpson's rule."""
    rate = drift + earth[0] * np.cos(fine) + earth[1] * np.sin(fine)
    integral = np.concatenate([[0.0], cumulative_simpson(rate, dx=1.0 / (8.0 * RATE))])
    return share * (fine - fine[0])[::8] + integral[::8]


def followed(angle, encoder, harmonics):
    """Motion fitted to a whole record, and the angle less it."""
    kinematic = kinematics(encoder, RATE)
    averages = averaged(angle, kinematic.block)
    motion = follow_table(averages, encoder, kinematic, harmonics=harmonics)
    pieces = series.spans(encoder.size, motion.kinematics.length)
    return motion, angle - np.concatenate([motion.over(span) for span in pieces])


@pytest.fixture(autouse=True)
def several_spans(monkeypatch):
    monkeypatch.setattr(series, "SPAN", 5000)


def time(seconds):
    return np.arange(round(seconds * RATE * 8) + 1) / (8.0 * RATE)


def wandering(seconds):
    t = time(seconds)
    return np.radians(40.0) * (1.0 + 0.1 * np.sin(t / 37.0) + 0.05 * np.cos(t / 11.0))


def reversing(seconds, period=60.0):
    # Full speed either way, a second to turn round.
    return np.radians(40.0) * np.clip(15.0 * np.sin(TURN * time(seconds) / period), -1.0, 1.0)


@pytest.mark.parametrize("speed", [wandering(600.0), reversing(600.0)], ids=["wander", "reverse"])
@pytest.mark.parametrize("harmonics", [None, np.array([1.0, 3.0])], ids=["unknown", "known"])
def test_motion_is_recovered_and_taken_off(speed, harmonics):
    fine, table = motion(speed)
    generator = np.random.default_rng(0)
    walk = 7e-9 / np.sqrt(RATE) * np.cumsum(generator.standard_normal(table.size))
    order_three = 1e-7 * np.cos(3.0 * table + 1.0)
    found, left = followed(sensed(fine) + order_three + walk, table, harmonics)
    # A random walk of 7e-9 rad over 600 s makes a rate uncertain by 3e-10 rad/s, the same
    # as a share by 1e-9 or so; Earth terms by more where the table only swings.
    assert found.share == pytest.approx(SHARE, abs=2e-8)
    assert found.drift == pytest.approx(DRIFT, abs=1e-8)
    assert found.earth == pytest.approx(EARTH_TERMS, abs=3e-8)
    # The harmonic is left in; the walk is left in but for a few degrees of freedom.
    left = left - order_three - walk
    left -= np.polyval(np.polyfit(np.arange(left.size), left, 1), np.arange(left.size))
    assert np.std(left) < np.std(walk)
    assert np.std(np.diff(left)) < 0.1 * np.std(np.diff(walk))


@pytest.mark.parametrize("lag", [0.0, 0.0042, -0.013])
def test_a_lag_of_the_encoder_is_found_where_the_rate_varies(lag):
    fine, table = motion(reversing(600.0))
    grid = np.arange(fine.size) / (8.0 * RATE)
    encoder = np.interp(grid[::8] + lag, grid, fine)
    angle = sensed(fine, share=0.577)
    angle += 7e-9 / np.sqrt(RATE) * np.cumsum(np.random.default_rng(1).standard_normal(angle.size))
    found, _ = followed(angle, encoder, np.empty(0))
    assert found.kinematics.lag == pytest.approx(lag, abs=1e-4)
    assert found.share == pytest.approx(0.577, abs=1e-5)
    inner = slice(100, -100)
    assert found.kinematics.table[inner] == pytest.approx(table[inner], abs=2e-4)


@pytest.mark.parametrize("direction", [1.0, -1.0])
@pytest.mark.parametrize("harmonics", [None, np.array([1.0, 2.0])], ids=["unknown", "known"])
def test_a_noisy_encoder_at_constant_rate_puts_no_noise_in(direction, harmonics):
    # There the Earth terms coincide with sin and cos of table angle, and t with alpha; free
    # least squares would fit encoder error in what is left of them.
    fine, table = motion(np.full(time(900.0).size, direction * np.radians(40.0)))
    generator = np.random.default_rng(2)
    encoder = table + ARCSECOND * np.sin(table + 0.5)
    encoder = 0.18 * ARCSECOND * np.round(encoder / (0.18 * ARCSECOND))
    steps = 7e-9 / np.sqrt(RATE) * generator.standard_normal(table.size)
    angle = sensed(fine, drift=0.0) + np.cumsum(steps)
    found, left = followed(angle, encoder, harmonics)
    assert found.drift == pytest.approx(0.0, abs=1e-12)  # it is in the share
    assert max(np.abs(found.earth)) < 2.0 * EARTH
    # The angle random walk from increments over 1 s, where it is what rules; order 1, which is
    # Earth rate as much as a harmonic, is the removal's business and fitted away here.
    left = left[:: round(RATE)]
    alpha = table[:: round(RATE)]
    design = np.diff(
        [np.cos(alpha), np.sin(alpha), np.cos(2 * alpha), np.sin(2 * alpha), alpha], axis=1
    ).T
    increments = np.diff(left)
    increments = increments - design @ np.linalg.lstsq(design, increments, rcond=None)[0]
    noise = np.sqrt(np.sum(increments**2) / (increments.size - 5))
    true = np.diff(np.cumsum(steps)[:: round(RATE)])
    true = true - design @ np.linalg.lstsq(design, true, rcond=None)[0]
    assert noise == pytest.approx(np.sqrt(np.sum(true**2) / (true.size - 5)), rel=0.03)
