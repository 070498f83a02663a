"""Lines of the gyros get into the table angle that these lead: what that does to lines and N.

By the second simulator, whose table angle is its own.
"""

from typing import Any

import numpy as np
import pytest

from sagnac.analysis import measurement
from sagnac.analysis.pipeline import analyze
from sagnac.analysis.result import Analysis
from sagnac.analysis.settings import Settings
from tests import second_rig
from tests.analysis.recorded import recorded

SECONDS, RATE = 300.0, 50.0
WALK = 4e-5  # deg/sqrt(h), of every gyro
# From strong to weak by fives, so that many products of two lines are too weak to be found.
SIZES = [2.0 ** -(5 * place % 6) for place in range(12)]  # arcsec
ORDERS = (5, 11, 17, 23, 29, 34, 37, 41, 46, 53, 58, 61)
TONES = (0.37, 1.3, 2.9, 5.3, 11.7, 23.0, 31.0, 50.0)


def turned(seed: int, size: float = 1.0, **bench: Any) -> second_rig.Simulated:
    """Five minutes of an even table, of gyros with twenty lines."""
    lines: dict[str, Any] = {
        "orders": [(order, size * own) for order, own in zip(ORDERS, SIZES, strict=True)],
        "tones": [(tone, size * own) for tone, own in zip(TONES, SIZES, strict=False)],
    }
    given = {"jitter": 5e-6, "periodic": (), "walks": (WALK, WALK, WALK), **lines, **bench}
    steady = second_rig.Bench(seconds=SECONDS, sample_rate=200.0, rate=RATE, seed=seed, **given)
    return second_rig.simulate(steady)


def off(analysis: Analysis) -> float:
    """Error of N in half intervals, by which it strays by a half."""
    n = analysis.angle_random_walk.to("deg/sqrt(h)")
    assert n.status == "estimated"
    return (n.value - WALK) / (0.5 * (n.high - n.low))


def found(analysis: Analysis) -> tuple[int, int]:
    """How many of the lines that were put in are listed, and how many others."""
    turns = RATE / 360.0
    listed = np.array([line.hertz(turns) for line in analysis.lines])
    put_in = np.array([*(order * turns for order in ORDERS), *TONES])
    beside = np.abs(np.subtract.outer(put_in, listed)).min(axis=1) < 1.5 / SECONDS
    return int(beside.sum()), listed.size - int(beside.sum())


def test_strong_lines_of_the_gyros_make_no_products_and_do_not_raise_n():
    every = [analyze(recorded(turned(seed)), Settings(gyros=("x", "z"))) for seed in range(8)]
    listed = [found(one) for one in every]
    errors = np.array([off(one) for one in every])
    print(errors.round(2), listed)
    assert [known for known, _ in listed] == [20] * 8
    # Earth rate makes one of order 1. There were 16 to 43, most of them products.
    assert np.mean([others for _, others in listed]) < 3.0
    # Chance moves the mean by 0.18; it was 0.66.
    assert abs(errors.mean()) < 0.36


def test_errors_of_the_encoder_at_orders_of_the_gyros_do_no_harm():
    # Larger than the lines of the gyros, so that readings are the worse guide at these orders.
    worse = ((1.0, 0.8), (11.0, 2.0), (23.0, 2.0), (41.0, 2.0))
    every = [
        analyze(recorded(turned(seed, periodic=worse)), Settings(gyros=("x", "z")))
        for seed in range(4)
    ]
    print([(round(off(one), 2), found(one)) for one in every])
    assert all(found(one)[0] == 20 for one in every)
    # As many as beside the angle that the gyros lead: sidebands by these errors are true ones.
    assert np.mean([found(one)[1] for one in every]) < 34.0
    assert np.mean([off(one) for one in every]) < 0.8


@pytest.mark.parametrize(
    ("size", "gyros"), [pytest.param(0.03, ("x", "z"), id="weak"), (1.0, ("x",))]
)
def test_without_products_or_a_second_gyro_lines_are_searched_once(monkeypatch, size, gyros):
    search, tables = measurement.remove_lines, []

    def counted(angle, table, *rest, **named):
        tables.append(table)
        return search(angle, table, *rest, **named)

    monkeypatch.setattr(measurement, "remove_lines", counted)
    analysis = analyze(recorded(turned(1, size), gyros), Settings(gyros=gyros))
    assert len(tables) == 1
    assert analysis.channel == "-".join(gyros)
