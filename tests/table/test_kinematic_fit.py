"""Steps of the regression on the table's kinematics, each by itself."""

import numpy as np
import pytest

from sagnac.table import motion as room
from sagnac.table.kinematics import averaged, kinematics
from tests.table.turning import DRIFT, EARTH_TERMS, RATE, SHARE, motion, sensed, wandering


@pytest.fixture(scope="module")
def case():
    """Averages with a little white noise in their increments, and the kinematics."""
    fine, table = motion(wandering(300.0))
    kinematic = kinematics(table, RATE)
    averages = averaged(sensed(fine) + 1e-7 * np.cos(3.0 * table), kinematic.block)
    generator = np.random.default_rng(3)
    return averages + np.cumsum(1e-9 * generator.standard_normal(averages.size)), kinematic


def columns_of(case):
    return room.Design(kinematic=case[1], orders=np.array([1.0, 3.5]), with_drift=True)


def test_increments_are_those_of_the_columns_written_out(case):
    _, kinematic = case
    columns = columns_of(case)
    written = [
        kinematic.angle,
        np.arange(kinematic.angle.size) * 0.1,
        kinematic.cosine,
        kinematic.sine,
    ]
    for order in (1.0, 3.5):
        written += [np.cos(order * kinematic.angle), np.sin(order * kinematic.angle)]
    assert columns.size == 8
    block = slice(100, 400)
    assert columns.increments(block.start, block.stop) == pytest.approx(
        np.diff(np.array(written)[:, 100:401], axis=1), abs=1e-12
    )


def test_the_triangle_is_that_of_all_rows_at_once(case, monkeypatch):
    averages, _ = case
    columns, target = columns_of(case), np.diff(averages)
    monkeypatch.setattr(room, "_AT_ONCE", 37)
    found = room.triangle(columns, target[np.newaxis])
    rows = np.vstack([columns.increments(0, target.size), target]).T
    assert found.shape == (9, 9)
    assert np.tril(found, -1) == pytest.approx(np.zeros((9, 9)))
    scale = np.linalg.norm(rows, axis=0)
    assert found.T @ found / np.outer(scale, scale) == pytest.approx(
        rows.T @ rows / np.outer(scale, scale), abs=1e-12
    )
    reduced = room.Triangle.of(found, columns.size)
    free = reduced.solution(np.zeros(8))
    expected = np.linalg.lstsq(rows[:, :-1] / scale[:-1], target, rcond=None)[0] / scale[:-1]
    assert free == pytest.approx(expected, rel=1e-6, abs=1e-14)
    left = room.leftover(columns, target, free)
    assert left == pytest.approx(target - rows[:, :-1] @ expected, abs=1e-14)
    assert reduced.deviation(free, target.size) == pytest.approx(
        np.sqrt(np.mean(left**2)), rel=1e-9, abs=0.0
    )
    # A penalty large enough leaves nothing of its coefficient.
    held = reduced.solution(np.array([0.0, 0.0, 1e9, 1e9, 0.0, 0.0, 0.0, 0.0]))
    assert np.abs(held[2:4]).max() < 1e-12


def test_noise_is_robust_to_lines():
    left = np.random.default_rng(0).standard_normal(4000)
    with_line = left + 3.0 * np.cos(np.arange(4000) * 0.3)
    assert room.noise_beside_lines(left) == pytest.approx(1.0, rel=0.05)
    assert room.noise_beside_lines(with_line) == pytest.approx(1.0, rel=0.05)


def test_gyros_fitted_together_are_as_each_alone(case):
    averages, kinematic = case
    other = 0.3 * averages + 1e-8 * np.random.default_rng(5).standard_normal(averages.size)
    for harmonics in (None, np.array([1.0, 3.0, 4.5])):
        both = room.follow_table_together(np.stack([averages, other]), kinematic, harmonics)
        for own, found in zip((averages, other), both, strict=True):
            (alone,) = room.follow_table_together(own[np.newaxis], kinematic, harmonics)
            assert (found.share, found.drift) == pytest.approx(
                (alone.share, alone.drift), rel=1e-9, abs=0.0
            )
            assert found.earth == pytest.approx(alone.earth, rel=1e-6)
            assert found.phasor == pytest.approx(alone.phasor, rel=1e-6, abs=1e-14)


def test_the_fit_finds_what_was_put_in(case):
    averages, kinematic = case
    found = room.follow_table(averages, kinematic, harmonics=np.array([3.0, 999.0]))
    assert found.share == pytest.approx(SHARE, abs=2e-8)
    assert found.drift == pytest.approx(DRIFT, abs=1e-8)
    assert found.earth == pytest.approx(EARTH_TERMS, abs=3e-8)
    # 999 is beyond what averages show.
    assert found.orders.tolist() == [3.0]
    assert found.phasor.real == pytest.approx([1e-7], rel=0.05)
