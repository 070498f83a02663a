"""The maximum of a likelihood in its steps."""

import math
from dataclasses import replace

import numpy as np
import pytest

from sagnac.noise.fit import with_departure
from sagnac.noise.likelihood import Ordinates, scaled_covariance, scoring_move


def spectrum(power, count=50.0):
    index = np.arange(1.0, power.size + 1.0)
    basis = np.stack([np.ones(power.size), 1.0 / index], axis=1)
    counts = np.full(power.size, count)
    return Ordinates(basis=basis, power=power, count=counts, weight=counts, frequency=index)


def exact(*squares, bins=80):
    ordinates = spectrum(np.ones(bins))
    return spectrum(ordinates.basis @ np.array(squares))


def test_a_square_that_is_held_stays():
    best = exact(2.0, 5.0).maximum(start=np.array([0.0, 3.0]), held=1)
    assert best.squares[1] == 3.0
    assert best.squares[0] > 2.0
    assert best.deviance > exact(2.0, 5.0).best.deviance


def test_squares_may_be_negative():
    assert exact(2.0, -1.0).best.squares[1] == pytest.approx(-1.0, rel=1e-2)


def test_normal_equations_leave_what_they_cannot_see_at_zero():
    matrix = np.array([[1.0, 1.0], [1.0, 1.0]])
    start = np.array([3.0, 0.0])
    assert start + scoring_move(matrix, np.array([1.0, 1.0]), start) == pytest.approx([1.0, 1.0])
    assert scaled_covariance(np.diag([4.0, 25.0]))[0] == pytest.approx([0.5, 0.2])


def test_bins_that_stand_out_are_left_out_and_the_rest_departs():
    power = exact(2.0, 0.0).power.copy()
    power[40:44] *= 9.0
    weighed = with_departure(spectrum(power))
    assert weighed.departure == pytest.approx(1.0)
    assert np.flatnonzero(weighed.weight == 0.0).tolist() == [40, 41, 42, 43]
    assert [note.level for note in weighed.notes] == ["warning"]
    assert with_departure(exact(2.0, 5.0)).departure == 0.0
    rough = exact(2.0, 0.0, bins=400).power * np.where(np.arange(400) % 2, 0.6, 1.4)
    assert with_departure(spectrum(rough)).departure == pytest.approx(0.4, rel=0.3)


def test_a_departure_too_small_to_weigh_is_the_least():
    """With 1e10 ordinates in a bin, a departure of 5e-5 is more than chance."""
    ordinates = spectrum(np.ones(80))
    power = exact(2.0, 0.0).power * np.where(np.arange(80) % 2, 1.0 - 5e-5, 1.0 + 5e-5)
    many = np.full(80, 1e10)
    weighed = with_departure(replace(ordinates, power=power, count=many, weight=many))
    assert weighed.departure == 1e-4


def test_intervals_are_of_the_profile():
    ordinates = exact(2.0, 5.0)
    best = ordinates.best
    found = ordinates.estimate(best, 0, "angle_random_walk", 0.95)
    assert found.status == "estimated"
    alone, covariance = scaled_covariance(ordinates.fisher(best))
    half = 1.96 * alone[0] * math.sqrt(covariance[0, 0])
    assert found.low**2 == pytest.approx(2.0 - half, abs=0.2 * half)
    assert found.high**2 == pytest.approx(2.0 + half, abs=0.2 * half)
    flat = exact(2.0, 0.0)
    assert flat.estimate(flat.best, 1, "bias_instability", 0.95).status == "upper bound"
