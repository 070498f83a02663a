"""Each pass of the search by itself, and what a state keeps."""

from dataclasses import replace

import numpy as np
import pytest

from sagnac.lines import passes, state
from sagnac.lines.candidates import new_lines
from sagnac.lines.components import components_of
from sagnac.lines.detection import peaks_in_frequency
from sagnac.lines.state import Record, first_state

RATE = 100.0
TURN = 2.0 * np.pi
SIGMA = 7e-10
SAMPLES = 12_000


def walk(seed, samples=SAMPLES):
    return SIGMA * np.cumsum(np.random.default_rng(seed).standard_normal(samples))


def tone(frequency, amplitude, samples=SAMPLES):
    return amplitude * np.cos(TURN * frequency / RATE * np.arange(samples) + 0.4)


def wandering_table(wander=0.05, samples=SAMPLES):
    t = np.arange(samples) / RATE
    rate = np.radians(90.0) * (1.0 + wander * (np.sin(t / 23.0) + 0.67 * np.cos(t / 7.0)))
    return 0.3 + np.cumsum(rate) / RATE


def at_rest(angle):
    return passes.looked(first_state(Record(angle=angle, encoder=None, sample_rate=RATE)))


def on_table(angle, table):
    return passes.looked(first_state(Record(angle=angle, encoder=table, sample_rate=RATE)))


def tones(*pairs, samples=SAMPLES):
    frequencies = np.array([pair[0] for pair in pairs]) / RATE
    phases = TURN * frequencies * (0.5 * (samples - 1)) + 0.4
    amplitudes = np.array([pair[1] for pair in pairs])
    return components_of(samples, frequencies=frequencies, phasor=amplitudes * np.exp(-1j * phases))


# --- what a state keeps ----------------------------------------------------------------------


def test_what_was_made_is_kept_until_another_source_is_asked_for():
    record, made = Record(angle=walk(0), encoder=None, sample_rate=RATE), []

    def make(source):
        return record.kept("sum", source, lambda: made.append(source) or source + 1)

    assert [make(1), make(1), make(2), make(1)] == [2, 2, 3, 2]
    assert made == [1, 2, 1]


def test_states_that_know_the_same_share_their_increments():
    first = at_rest(walk(0))
    again = replace(first, components=replace(first.components), settled=True)
    assert again.steps is first.steps
    with_line = replace(first, components=tones((7.3, 1e-8)))
    assert with_line.steps is not first.steps


def test_increments_are_those_of_the_angle_without_lines():
    angle = walk(1) + tone(7.3, 1e-6)
    without = replace(at_rest(angle), components=tones((7.3, 1e-6)))
    steps = np.diff(walk(1))
    assert without.steps == pytest.approx(steps - steps.mean(), abs=1e-14)
    assert np.diff(without.residual()) == pytest.approx(steps, abs=1e-14)


def test_a_state_takes_no_fit_of_other_components():
    fitted = passes.joined_by(at_rest(walk(2) + tone(7.3, 1e-7)), tones((7.3, 1e-7)))
    with pytest.raises(ValueError, match="fit is of 1 components; give that of the 0 known ones"):
        replace(fitted, components=components_of(SAMPLES))


def test_a_state_that_was_never_looked_at_has_no_spectrum():
    never = first_state(Record(angle=walk(0), encoder=None, sample_rate=RATE))
    with pytest.raises(ValueError, match="never looked at"):
        _ = never.floor


# --- passes ----------------------------------------------------------------------------------


def test_passes_leave_the_state_they_are_given():
    before = at_rest(walk(3) + tone(7.3, 1e-7))
    after = passes.joined_by(before, tones((7.3, 1e-7)))
    assert before.components.size == 0
    assert after.components.size == 1
    assert passes.joined_by(before, components_of(SAMPLES)) is before
    assert passes.refitted(before) is before


def test_a_new_line_is_fitted_from_the_increments_that_hold_it():
    after = passes.joined_by(at_rest(walk(4) + tone(7.3, 1e-7)), tones((7.3001, 5e-8)))
    assert after.components.amplitude == pytest.approx([1e-7], rel=0.05)
    assert not after.settled
    for _ in range(3):
        after = passes.refitted(after)
    assert after.settled
    assert after.components.frequencies * RATE == pytest.approx([7.3], abs=1e-4)


def test_a_line_in_the_noise_is_pruned():
    after = passes.joined_by(at_rest(walk(5) + tone(7.3, 1e-7)), tones((7.3, 1e-7), (31.0, 1e-13)))
    kept = passes.pruned(after)
    assert kept.components.frequencies * RATE == pytest.approx([7.3], abs=1e-3)
    assert kept.fit is None
    assert passes.pruned_all(after).fit is not None
    assert passes.pruned(passes.pruned_all(after)).components.size == 1


def test_orders_no_larger_than_earth_rate_makes_them_wait():
    table = wandering_table()
    start = on_table(walk(6) + 0.5 * table, table)
    reach = np.zeros(128)
    reach[4] = 1e-7
    phasor = np.full(2, 9e-8 + 0j)
    orders = components_of(SAMPLES, orders=np.array([5.0, 6.0]), phasor=phasor)
    known = replace(start, components=orders, earth_reach=reach)
    assert passes.without_earth_orders(known).components.orders.tolist() == [6.0]
    settled = replace(known, earth_settled=True)
    assert passes.without_earth_orders(settled) is settled


def test_table_motion_is_fitted_again_beside_the_orders_known():
    table = wandering_table()
    angle = walk(7) + 0.5 * table + 1e-6 * np.cos(3.0 * table)
    start = on_table(angle, table)
    tones = peaks_in_frequency(start.look(), start.record.threshold)
    found = new_lines(start, tones).lines
    after = passes.followed(passes.joined_by(start, found))
    assert after.fit is None
    assert after.motion.share == pytest.approx(0.5, abs=2e-8)
    place = after.components.orders.tolist().index(3.0)
    assert after.components.amplitude[place] == pytest.approx(1e-6, rel=1e-3)
    assert passes.followed(at_rest(walk(7))).motion is None


def test_a_tone_that_follows_the_table_moves_to_its_scale():
    table = wandering_table(wander=1e-3)
    start = on_table(walk(8) + 0.5 * table + 1e-7 * np.cos(30.0 * table), table)
    rate = (table[-1] - table[0]) / (SAMPLES - 1) / TURN
    as_tone = passes.looked(passes.joined_by(start, tones((30.0 * rate * RATE, 1e-7))))
    after = passes.rescaled(as_tone)
    assert after is not as_tone
    assert after.components.frequencies.size == 0
    assert after.components.orders == pytest.approx([30.0], abs=0.05)


def test_a_tone_of_its_own_stays_in_time():
    table = wandering_table()
    start = on_table(walk(9) + 0.5 * table + tone(7.3, 1e-7), table)
    known = passes.joined_by(start, tones((7.3, 1e-7)))
    assert passes.rescaled(known) is known


def test_tones_that_one_drifting_line_describes_are_gathered():
    number = np.arange(40_000)
    swing = 1.0 + 0.3 * np.cos(4.0 * (number / 40_000) ** 2)
    start = at_rest(walk(15, 40_000) + tone(20.0, 1e-7, 40_000) * swing)
    known = passes.refitted(passes.joined_by(start, tones((20.0, 1e-7), samples=40_000)))
    after = passes.gathered(passes.looked(known), known.components.frequencies)
    assert len(after.drifting) == 1
    assert after.components.size == 0
    steady = at_rest(walk(15, 40_000) + tone(20.0, 1e-7, 40_000))
    known = passes.refitted(passes.joined_by(steady, tones((20.0, 1e-7), samples=40_000)))
    after = passes.gathered(passes.looked(known), known.components.frequencies)
    assert after.drifting == ()
    assert len(after.steady) == 1


def test_sums_at_orders_are_made_once_for_the_same_lines(monkeypatch):
    made = []
    sums = state.order_sums
    monkeypatch.setattr(state, "order_sums", lambda *given: made.append(1) or sums(*given))
    table = wandering_table()
    start = on_table(walk(10) + 0.5 * table, table)
    assert start.order_sums is replace(start, settled=True).order_sums
    assert made == [1]
