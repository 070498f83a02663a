"""The paper's Steps 1 and 2, and the still bench without the package for angles."""

from dataclasses import replace

import numpy as np
import pytest

from sagnac.lines.naming import taken_allan_variance
from sagnac.lines.published import (
    AS_PRINTED,
    FAIR,
    SLOWEST_CYCLES,
    PublishedSearch,
    remove_lines_as_published,
)
from sagnac.stability.curve import stability_curve
from tests.processes import PYTHON, ran

RATE = 50.0
TIME = np.arange(6000) / RATE


def angle(table=None):
    """A walk, lines on the grid of one cycle a record, and a harmonic of the table."""
    steps = 1e-8 * np.random.default_rng(0).standard_normal(TIME.size)
    total = np.cumsum(steps) + 2e-5 * np.cos(2.0 * np.pi * 3.0 * TIME + 0.4)
    return total if table is None else total + 5e-5 * np.cos(4.0 * table - 0.2)


def test_both_steps_find_their_lines():
    table = 0.7 * TIME + 0.3 * np.sin(0.5 * TIME)
    shares = []
    removal = remove_lines_as_published({"x": angle(table)}, table, RATE, progress=shares.append)
    orders = [line for line in removal.lines if line.scale == "angle"]
    tones = [line for line in removal.lines if line.scale == "time"]
    assert orders[0].frequency == 4.0
    assert orders[0].amplitude == pytest.approx(5e-5, rel=0.02)
    assert orders[0].phase == pytest.approx(-0.2, abs=0.02)
    assert tones[0].frequency == pytest.approx(3.0)
    assert tones[0].amplitude == pytest.approx(2e-5, rel=0.02)
    assert tones[0].phase == pytest.approx(0.4, abs=0.02)
    assert {line.channel for line in removal.lines} == {"x"}
    assert len(removal.masked) == len(tones)
    assert np.isnan(tones[0].amplitude_error)
    assert shares == [0.15, 0.5, 1.0]
    assert np.std(np.diff(removal.residual)) < 3e-8


def test_step_1_leaves_the_motion_and_step_3_takes_it_out():
    """Eqs. 20 and 21: e alpha stays in each gyro, and its ripple cancels where shares agree."""
    table = 0.7 * TIME + 0.3 * np.sin(0.5 * TIME)
    found = remove_lines_as_published({"x": angle(table) + 0.577 * table}, table, RATE)
    assert np.std(np.diff(found.residual)) < 3e-8  # alone, it goes with Step 1
    steps = 1e-8 * np.random.default_rng(5).standard_normal((2, TIME.size))
    walks = np.cumsum(steps, axis=1)
    angles = {"x": walks[0] + 0.577 * table, "z": walks[1] + 0.577 * table}
    for order in (FAIR, AS_PRINTED):
        pair = remove_lines_as_published(angles, table, RATE, search=replace(order, most_lines=3))
        difference = np.diff(pair.residual)
        assert np.std(difference) == pytest.approx(np.sqrt(2.0) * 1e-8, rel=0.03)


def test_a_wandering_table_cancels_in_parts_of_the_shares():
    """(e_x - e_z) alpha stays in the difference of Eq. 21, and goes if the gyros are weighed."""
    random = np.random.default_rng(9)
    wander = np.cumsum(np.cumsum(1e-6 * random.standard_normal(TIME.size)))
    table = 0.7 * TIME + wander
    encoder = table + 1e-5 * random.standard_normal(TIME.size)
    walks = np.cumsum(1e-9 * random.standard_normal((2, TIME.size)), axis=1)
    line = 3e-7 * np.cos(2.0 * np.pi * 9.3 * TIME)
    angles = {"x": walks[0] + 0.58 * table + line, "z": walks[1] + 0.57 * table}
    left = {
        order.difference_first: np.diff(
            remove_lines_as_published(angles, encoder, RATE, search=order).residual
        )
        for order in (FAIR, AS_PRINTED)
    }
    assert np.std(left[True]) == pytest.approx(np.sqrt(2.0) * 1e-9, rel=0.03)
    assert np.std(left[False]) > 100.0 * np.std(left[True])


def test_earth_rate_along_a_wandering_table_goes_with_its_integrals():
    """Eq. 4 integrated step by step; Eq. 6 has it as an order, which holds on a steady table."""
    random = np.random.default_rng(10)
    rate = 0.7 + 0.01 * np.sin(0.21 * TIME) + 0.01 * np.sin(0.083 * TIME)
    table = np.cumsum(rate) / RATE
    earth = 7e-5 * np.cumsum(np.cos(table - 0.5 * rate / RATE)) / RATE
    walks = np.cumsum(1e-9 * random.standard_normal((2, TIME.size)), axis=1)
    angles = {"x": walks[0] + 0.577 * table + earth, "z": walks[1] + 0.577 * table - earth}
    few = replace(FAIR, most_lines=0)
    left = remove_lines_as_published(angles, table, RATE, search=few).residual
    assert np.std(np.diff(left)) == pytest.approx(np.sqrt(2.0) * 1e-9, rel=0.03)
    plain = remove_lines_as_published(
        angles, table, RATE, search=replace(few, difference_first=False)
    ).residual
    assert np.std(np.diff(plain)) > 10.0 * np.std(np.diff(left))


def test_without_a_lowest_frequency_the_terms_go_to_the_wander_of_the_walk():
    """The walk has most of its mean square in its first cycles; a weak line is found above them."""
    duration = TIME.size / RATE
    slowest = SLOWEST_CYCLES / duration
    for seed in range(3):
        walk = np.cumsum(1e-8 * np.random.default_rng(seed).standard_normal(TIME.size))
        line = 1.5e-9 * np.cos(2.0 * np.pi * 11.03 * TIME)
        chosen = {
            search.slowest: [
                one.frequency
                for one in remove_lines_as_published(
                    {"x": walk + line}, None, RATE, search=search
                ).lines
            ]
            for search in (FAIR, replace(FAIR, slowest=0.0))
        }
        assert sum(place < 10.0 * slowest for place in chosen[0.0]) > 50
        assert not any(abs(place - 11.03) < 0.01 for place in chosen[0.0])
        assert min(chosen[SLOWEST_CYCLES]) >= slowest
        assert any(abs(place - 11.03) < 0.01 for place in chosen[SLOWEST_CYCLES])
        assert len(chosen[SLOWEST_CYCLES]) <= 4


def test_the_lowest_frequency_is_where_a_line_is_highest_at_the_end_of_the_curve():
    """2 A sin^2(pi f tau) / tau, highest over tau at the paper's cut, N / n = 51."""
    tau = np.linspace(0.5, 1.5, 20_001) / 51.0  # of a record
    highest = tau[np.argmax(np.sin(np.pi * SLOWEST_CYCLES * tau) ** 2 / tau)]
    assert highest == pytest.approx(1.0 / 51.0, rel=1e-3)


def test_both_gyros_lose_the_same_frequencies():
    """Eq. 22 sums over the same lines: what one search takes of common motion, the other does."""
    jitter = 1e-6 * np.random.default_rng(6).standard_normal(TIME.size)
    steps = 1e-9 * np.random.default_rng(7).standard_normal((2, TIME.size))
    walks = np.cumsum(steps, axis=1)
    line = 3e-6 * np.cos(2.0 * np.pi * 7.0 * TIME)
    angles = {"x": walks[0] + jitter + line, "z": walks[1] + jitter}
    pair = remove_lines_as_published(angles, None, RATE, search=replace(AS_PRINTED, stop="none"))
    assert np.std(np.diff(pair.residual)) == pytest.approx(np.sqrt(2.0) * 1e-9, rel=0.05)


def test_a_line_off_the_fourier_grid_leaves_less_on_a_finer_one():
    record = TIME.size / RATE
    line = 2e-5 * np.cos(2.0 * np.pi * (400.5 / record) * TIME)
    noise = 1e-7 * np.random.default_rng(8).standard_normal(TIME.size)
    left = {
        cells: np.std(
            remove_lines_as_published(
                {"x": line + noise}, None, RATE, search=replace(FAIR, cells=cells, most_lines=2)
            ).residual
        )
        for cells in (1, 4)
    }
    assert left[4] == pytest.approx(1e-7, rel=0.02)
    assert left[1] > 20.0 * left[4]


def test_noise_taken_is_what_the_curve_lost():
    """Lines on the lowest forty bins of a white rate: what is left and what is taken add up."""
    tau = np.array([10.0, 20.0, 30.0])
    expected = 1e-16 * RATE / tau
    search = replace(FAIR, cells=1, most_lines=40, slowest=0.0)
    turns = 2.0 * np.pi * np.arange(20_000) / 20_000
    left, taken = np.zeros((2, 12, 3))
    for seed in range(12):
        rng = np.random.default_rng(seed)
        walk = np.cumsum(1e-8 * rng.standard_normal(20_000))
        lines = sum(1e-4 * np.cos(k * turns + rng.uniform(0.0, 6.0)) for k in range(1, 41))
        removal = remove_lines_as_published({"x": walk + lines}, None, RATE, search=search)
        assert len(removal.lines) == 40
        taken[seed] = taken_allan_variance(tau, removal.taken, interval=1.0 / RATE)
        curve = stability_curve(removal.residual, kind="angle", sample_rate=RATE, taus=tau)
        left[seed] = curve.deviation**2
    # Fits of a walk's angle reach beyond their bins, so that a fifth of a crowd's noise stays lost.
    assert np.all(left.mean(axis=0) < 0.65 * expected)
    np.testing.assert_allclose((left + taken).mean(axis=0), expected, rtol=0.22)


def test_at_rest_there_is_the_second_step_alone():
    for table in (None, np.full(TIME.size, 0.3)):
        removal = remove_lines_as_published({"x": angle()}, table, RATE)
        assert {line.scale for line in removal.lines} == {"time"}


def test_a_search_that_takes_all_its_terms_says_so():
    removal = remove_lines_as_published(
        {"x": angle()}, None, RATE, search=replace(FAIR, most_lines=2, stop="none")
    )
    assert "ended at its 2 terms" in removal.notes[0].text


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"cells": 0}, "cells is 0"),
        ({"slowest": -1.0}, "slowest is -1.0"),
        ({"stop": "never"}, "stop is 'never'"),
        ({"most_lines": -1}, "most_terms is -1"),
    ],
)
def test_a_search_that_cannot_be_is_refused(change, message):
    with pytest.raises(ValueError, match=message):
        PublishedSearch(**change)


WITHOUT = """
import sys
sys.modules["finufft"] = None
import numpy as np
import sagnac
from sagnac.core.errors import MissingExtra
from sagnac.lines.published import remove_lines_as_published
from sagnac.lines.search import remove_lines
from sagnac.spectrum.sums import angle_sums

time = np.arange(20_000) / 100.0
walk = np.cumsum(1e-8 * np.random.default_rng(0).standard_normal(time.size))
angle = walk + 1e-6 * np.cos(2.0 * np.pi * 17.1234 * time)
removal = remove_lines(angle, None, 100.0, channel="x")
print([round(line.frequency, 3) for line in removal.lines])
remove_lines_as_published({"x": angle}, None, 100.0)
turning = remove_lines(angle, 0.7 * time, 100.0, channel="x")
print(turning.residual.size)
still = {"kind": "angle", "unit": "rad", "sample_rate": 100.0}
print(sagnac.analyze(sagnac.Recording.from_arrays(x=walk[:3000], **still)).angle_random_walk.status)
try:
    angle_sums(time, time, 1000)
except MissingExtra as error:
    print(error.package, error.extra)
    print(error)
"""


def test_neither_bench_nor_table_needs_a_non_uniform_transform():
    done = ran(PYTHON, "-c", WITHOUT)
    assert done.returncode == 0, done.stderr
    found, samples, status, names, line = done.stdout.splitlines()
    assert status == "estimated"
    assert found == "[17.123]"
    assert samples == "20000"
    assert names == "finufft nufft"
    assert line.endswith(
        "needs finufft, which is not installed; "
        "install it with pip install '.[nufft]' in the folder of sagnac's source"
    )
