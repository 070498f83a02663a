"""The table's rotation against closed forms and against motion integrated here."""

from dataclasses import replace

import numpy as np
import pytest

from sagnac.core import arrays
from sagnac.table.kinematics import averaged, kinematics, sine_cosine_integrals
from sagnac.table.motion import follow_table, follow_table_together
from tests.table.turning import (
    ARCSECOND,
    DRIFT,
    EARTH,
    EARTH_TERMS,
    RATE,
    SHARE,
    motion,
    reversing,
    sensed,
    time,
    wandering,
)


@pytest.fixture(autouse=True)
def several_spans(monkeypatch):
    monkeypatch.setattr(arrays, "BLOCK", 5000)


def followed(angle, encoder, harmonics):
    """Motion fitted to a whole record, and the angle less it."""
    kinematic = kinematics(encoder, RATE)
    averages = averaged(angle, kinematic.block)
    motion = follow_table(averages, kinematic, harmonics=harmonics)
    return motion, angle - whole(motion)


def whole(motion):
    """Motion of every sample, rad, block by block."""
    table, length = motion.kinematics.table, motion.kinematics.length
    parts = arrays.blocks(table.size, length)
    return np.concatenate([motion.over(part.start, part.stop) for part in parts])


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
    # The harmonic is left in; the walk is left in, less a few degrees of freedom.
    left = left - order_three - walk
    left -= np.polyval(np.polyfit(np.arange(left.size), left, 1), np.arange(left.size))
    assert np.std(left) < np.std(walk)
    assert np.std(np.diff(left)) < 0.1 * np.std(np.diff(walk))


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


def test_harmonics_given_as_taken_out_are_said_with_what_is_left_of_them():
    fine, table = motion(wandering(600.0))
    kinematic = kinematics(table, RATE)
    left = 2e-7 * np.cos(3.0 * table) - 1e-7 * np.sin(3.0 * table)
    averages = averaged(sensed(fine) + left, kinematic.block)
    found = follow_table(
        averages,
        kinematic,
        harmonics=np.array([3.0]),
        phasor=np.array([5e-7 + 4e-7j]),
    )
    assert found.phasor.real == pytest.approx([7e-7], rel=1e-3)
    assert found.phasor.imag == pytest.approx([3e-7], rel=1e-3)
    assert found.share == pytest.approx(SHARE, abs=1e-9)


@pytest.mark.parametrize("speed", [wandering(600.0), reversing(600.0)], ids=["wander", "reverse"])
def test_gyros_that_follow_one_table_together_do_as_each_by_itself(speed):
    fine, table = motion(speed)
    kinematic = kinematics(table, RATE)
    walk = np.cumsum(1e-9 * np.random.default_rng(4).standard_normal(kinematic.angle.size))
    own = averaged(sensed(fine), kinematic.block) + walk
    averages = np.stack([own, 0.5 * own + 1e-7 * np.cos(2.0 * kinematic.angle)])
    for harmonics in (None, np.array([2.0, 4.5, 999.0])):
        together = follow_table_together(averages, kinematic, harmonics)
        for found, one in zip(together, averages, strict=True):
            alone = follow_table(one, kinematic, harmonics=harmonics)
            assert found.share == pytest.approx(alone.share, rel=1e-9)
            assert found.earth == pytest.approx(alone.earth, rel=1e-6)
            assert found.averages == pytest.approx(alone.averages, abs=1e-12)
            # 999 is beyond what averages show.
            assert found.orders.tolist() == alone.orders.tolist()
            assert 999.0 not in found.orders


def test_averages_are_those_of_the_motion():
    _, table = motion(wandering(100.0))
    kinematic = kinematics(table, RATE)
    found = follow_table(averaged(SHARE * table, kinematic.block), kinematic)
    difference = found.averages - averaged(whole(found), kinematic.block)
    assert np.ptp(difference) < 1e-12


def test_the_motion_of_a_block_is_the_model_written_out():
    _, table = motion(wandering(100.0))
    kinematic = kinematics(table, RATE)
    found = follow_table(averaged(SHARE * table + 1e-5 * np.sin(table), kinematic.block), kinematic)
    found = replace(found, drift=3e-6, earth=(2e-5, -7e-5))
    cosine, sine = sine_cosine_integrals(table, 1.0 / RATE)
    expected = found.share * table + 3e-6 * np.arange(table.size) / RATE
    expected += 2e-5 * cosine - 7e-5 * sine
    length = kinematic.length
    assert table.size > 2 * length
    for start in range(0, table.size, length):
        block = slice(start, min(start + length, table.size))
        assert found.over(block.start, block.stop) == pytest.approx(expected[block], abs=1e-13)
