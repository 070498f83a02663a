"""What Earth rate puts into the orders of an unsteady table, against a sum at each order."""

import numpy as np
import pytest
from scipy.stats import chi2

from sagnac.core.units import EARTH_RATE
from sagnac.lines.joint_fit import earth_amplitudes
from sagnac.lines.sampling import MOST_ORDERS, Sampling
from sagnac.lines.search import remove_lines

SAMPLE_RATE = 10.0
# Below the samples that are kept at the least, so that all of them count.
TIME = np.arange(9000) / SAMPLE_RATE
TURNING = 2.0 * np.pi * TIME / 30.0


def amplitudes(table):
    return earth_amplitudes(Sampling(samples=table.size, table=table, sample_rate=SAMPLE_RATE))


def largest(table, order):
    """Amplitude of an order in Earth rate's part of the angle, for the worst direction, rad.

    Eq. 4: Earth rate across the axis is sensed as its cosine and sine over the table angle. What
    a steady table would make of it, order 1, is taken out.
    """
    steady = (table.size - 1) / SAMPLE_RATE / (table[-1] - table[0])
    if abs(table[-1] - table[0]) < 0.5 * np.abs(np.diff(table)).sum():
        steady = 0.0
    found = []
    for sensed, made, sign in ((np.cos, np.sin, 1.0), (np.sin, np.cos, -1.0)):
        steps = sensed(table[1:]) / SAMPLE_RATE - sign * steady * np.diff(made(table))
        wave = np.diff(np.exp(1j * order * table))
        found.append(2.0 * abs(np.vdot(wave, steps)) / np.vdot(wave, wave).real)
    return 2.0 * EARTH_RATE * max(found)


@pytest.mark.parametrize(
    "table",
    [
        TURNING + 0.3 * np.sin(2.0 * TURNING),
        -(TURNING + 0.3 * np.sin(2.0 * TURNING)),
        40.0 * np.sin(2.0 * np.pi * TIME / 450.0),
    ],
    ids=["rippled", "backward", "reversing"],
)
def test_amplitudes_are_those_of_a_fit_of_each_order(table):
    found = amplitudes(table)
    assert found.shape == (MOST_ORDERS,)
    assert found[0] == 0.0
    expected = [largest(table, order) for order in (2, 3, 4, 7)]
    # The power of an order is taken from speeds at some ranks, not from every sample.
    assert found[[1, 2, 3, 6]] == pytest.approx(expected, rel=0.03)


def test_a_steady_table_makes_order_one_alone():
    found = amplitudes(TURNING)
    rippled = amplitudes(TURNING + 0.3 * np.sin(2.0 * TURNING))
    assert found.max() < 0.02 * rippled.max()


def order_1(seed, wander, size):
    """The order 1 that is listed beside Earth rate, and the one put in, rad."""
    random = np.random.default_rng([31, seed])
    seconds = np.arange(30_000) / SAMPLE_RATE
    table = 0.7 * (seconds + wander * np.sin(0.11 * seconds + random.uniform(0.0, 6.0)) / 0.11)
    walk = np.cumsum(1e-8 * random.standard_normal(table.size))
    start, order = random.uniform(0.0, 6.0), size * np.exp(1j * random.uniform(0.0, 6.0))
    earth = EARTH_RATE * np.exp(1j * random.uniform(0.0, 6.0))
    sensed = (earth * np.exp(1j * table)).real / SAMPLE_RATE
    angle = np.cumsum(sensed) - 0.5 * sensed
    angle += 0.5 * table + (order * np.exp(1j * (table + start))).real + walk
    encoder = table + 1e-5 * random.standard_normal(table.size)
    (line,) = (
        one
        for one in remove_lines(angle, encoder, SAMPLE_RATE, channel="x").lines
        if (one.scale, one.frequency) == ("angle", 1.0)
    )
    return line, order * np.exp(1j * start)


@pytest.mark.parametrize("draws", [5, pytest.param(8, marks=pytest.mark.statistics)])
@pytest.mark.parametrize("wander", [1e-5, 3e-2])
def test_the_error_of_order_1_holds_what_earth_rate_trades_with_it(wander, draws):
    """The more evenly a table turns, the less tells Earth rate from order 1."""
    misses, errors = [], []
    for seed in range(draws):
        line, put_in = order_1(seed, wander, 1e-5)
        misses.append(abs(line.amplitude * np.exp(1j * line.phase) - put_in))
        errors.append(line.amplitude_error)
    off = np.square(np.array(misses) / errors)
    # Chi-square of two for each: a sum outside has a chance of 2e-4.
    assert 1e-4 < chi2.sf(off.sum(), 2 * draws) < 1.0 - 1e-4
    assert (np.median(errors) > 1e-5) == (wander < 1e-3)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(
    ("wander", "size", "name"), [(1e-5, 0.0, "not told from Earth rate"), (3e-2, 1e-4, "")]
)
def test_an_order_1_that_may_be_earth_rate_is_said_to_be_no_more(wander, size, name, seed):
    line, _ = order_1(seed, wander, size)
    assert line.name == name
    # Where a table wanders, Earth rate is known to what noise allows.
    assert (line.amplitude > 10.0 * line.amplitude_error) == (not name)
