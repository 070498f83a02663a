"""What stands above the floor, against the definitions."""

import numpy as np
import pytest

from sagnac.lines.components import components_of
from sagnac.lines.detection import (
    LOWEST_CYCLES,
    detection_threshold,
    floor_of_orders,
    floors,
    significances,
    significant,
    spectrum,
)
from sagnac.lines.joint_fit import ComponentFit
from sagnac.lines.sampling import Sampling
from sagnac.spectrum.power_laws import floor_scatter

BINS = 501
SAMPLES = 2 * (BINS - 1) + 1


def components(orders=(), frequencies=(), amplitudes=None):
    size = len(orders) + len(frequencies)
    return components_of(
        SAMPLES,
        orders=np.array(orders, dtype=float),
        frequencies=np.array(frequencies, dtype=float),
        phasor=np.array(np.ones(size) if amplitudes is None else amplitudes, dtype=complex),
    )


def table_of(step):
    """How a table that turns evenly was sampled, or one at rest."""
    table = step * np.arange(SAMPLES) if step else None
    return Sampling(samples=SAMPLES, table=table, sample_rate=10.0)


def fitted(found, variance=1.0):
    covariance = np.tile(variance * np.eye(3), (found.size, 1, 1))
    return ComponentFit(components=found, covariance=covariance, collinear=0)


def kept(found, threshold=1.0, step=0.0):
    floor = np.full(BINS, 0.01)
    return significant(fitted(found), table_of(step), floor, threshold)


def test_the_floor_is_that_of_the_whole_bins():
    steps = np.random.default_rng(0).standard_normal(2000)
    found = spectrum(steps)
    power = np.abs(np.fft.rfft(steps)) ** 2 / steps.size
    assert found.power[::2][1:-1] == pytest.approx(power[1:-1])
    assert found.power.size == 2 * found.floor.size - 1
    assert found.floor == pytest.approx(np.ones(found.floor.size), rel=0.3)


@pytest.mark.parametrize("bins", [1000, 100_000])
@pytest.mark.parametrize("false_alarm", [0.05, 1e-3])
def test_the_threshold_solves_rices_formula(bins, false_alarm):
    p = detection_threshold(bins, false_alarm)
    crossings = bins * np.sqrt(np.pi * p / 3.0) * np.exp(-p + 0.5 * (floor_scatter(bins) * p) ** 2)
    assert crossings == pytest.approx(false_alarm)


@pytest.mark.parametrize("false_alarm", [0.0, -1.0, np.nan, 1.0, 2.0])
def test_a_false_alarm_is_a_probability(false_alarm):
    with pytest.raises(ValueError, match="give a number between 0 and 1"):
        detection_threshold(1000, false_alarm)


def test_the_floor_of_an_order_is_a_mean_by_power_over_the_frequencies_it_sweeps():
    floor = np.linspace(1.0, 3.0, BINS)
    speed = np.array([0.01, 0.02, 0.05])
    orders = np.array([1.0, 7.0])
    for order, level in zip(orders, floor_of_orders(orders, speed, floor), strict=True):
        weights, weighed = 0.0, 0.0
        for one in speed:
            frequency = order * one / (2.0 * np.pi)
            weight = np.sin(np.pi * frequency) ** 2
            weights += weight
            weighed += weight * floor[int(frequency * 2 * (BINS - 1))]
        assert level == pytest.approx(weighed / weights)


def test_a_table_at_rest_sweeps_nothing():
    assert floor_of_orders(np.array([1.0]), np.zeros(3), np.ones(BINS)) == 0.0


def test_floors_are_those_of_orders_then_of_the_nearest_bins():
    floor = np.linspace(1.0, 3.0, BINS)
    turns = table_of(0.02)
    found = components(orders=(1.0, 2.0), frequencies=(0.1, 0.4999))
    levels = floors(found, turns, floor)
    assert levels[:2] == pytest.approx(floor_of_orders(found.orders, turns.speeds, floor))
    assert levels[2:] == pytest.approx([floor[100], floor[500]])
    assert floors(components(frequencies=(0.1,)), table_of(0.0), floor) == pytest.approx(
        [floor[100]]
    )


def test_significance_is_the_wald_statistic():
    found = components(frequencies=(0.1, 0.2), amplitudes=(3.0, 1.0))
    covariance = np.zeros((2, 3, 3))
    covariance[0] = [[2.0, 0.5, 0.3], [0.5, 1.0, 0.1], [0.3, 0.1, 9.0]]
    # Nothing tells sine from cosine: one direction counts.
    covariance[1, :2, :2] = 1.0
    fit = ComponentFit(components=found, covariance=covariance, collinear=0)
    pair = np.array([3.0, 0.0])
    expected = pair @ np.linalg.solve(covariance[0, :2, :2], pair) / 0.5
    assert significances(fit, np.array([0.5, 1.0])) == pytest.approx([expected, 0.25])


def test_what_stands_is_above_twice_the_threshold():
    # A floor of 0.01 and unit variance: 100 times the square of the amplitude.
    found = components(frequencies=(0.1, 0.2, 0.3), amplitudes=(0.9, 1.1, 2.0))
    assert kept(found, threshold=50.0).frequencies.tolist() == [0.2, 0.3]


def test_what_stands_lies_where_lines_are_looked_for():
    lowest = LOWEST_CYCLES / SAMPLES
    found = components(frequencies=(0.7 * lowest, 0.8 * lowest, 0.499, 0.5))
    assert kept(found).frequencies.tolist() == pytest.approx([0.8 * lowest, 0.499])


def test_of_two_in_one_place_the_stronger_stays():
    cell = 1.0 / (SAMPLES - 1)
    found = components(frequencies=(0.2, 0.2 + 0.4 * cell, 0.3, 0.3 + 0.6 * cell))
    found.phasor[:] = (2.0, 1.0, 1.0, 2.0)
    assert kept(found).phasor.real.tolist() == [2.0, 1.0, 2.0]
    apart = 0.4 / table_of(0.02).turns
    found = components(orders=(3.0, 3.0 + apart, 4.0), amplitudes=(1.0, 2.0, 1.0))
    assert kept(found, step=0.02).orders.tolist() == [3.0 + apart, 4.0]
