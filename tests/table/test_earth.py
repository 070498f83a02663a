"""Earth rate, and its bound."""

import math

import numpy as np
import pytest

from sagnac.table.frames import earth_rate
from sagnac.table.kinematics import LARGEST_EARTH_RATE, bounded_by_earth


def ridge(free):
    """A solution that shrinks as its penalty grows, as that of one column each does."""
    return lambda penalty: free / (1.0 + penalty**2)


def test_a_solution_within_the_bound_stays():
    free = np.array([3.0, 1e-5, -1.4e-4])
    solve = ridge(free)
    penalty = np.array([0.0, 0.01, 0.01])
    assert bounded_by_earth(solve, penalty, slice(1, 3)).tolist() == solve(penalty).tolist()
    assert penalty.tolist() == [0.0, 0.01, 0.01]


def test_a_solution_beyond_the_bound_is_held_just_within_and_the_rest_is_free():
    free = np.array([3.0, 1e-5, -1e-2])
    found = bounded_by_earth(ridge(free), np.array([0.0, 0.1, 0.1]), slice(1, 3))
    assert found[0] == 3.0
    assert abs(found[2]) <= LARGEST_EARTH_RATE
    # One step of the prior before, it was beyond.
    assert abs(found[2]) > LARGEST_EARTH_RATE / 1.3**2 * 0.99


def test_without_noise_there_is_no_prior_to_hold_it():
    free = np.array([1.0])
    assert bounded_by_earth(ridge(free), np.zeros(1), slice(0, 1)).tolist() == [1.0]


def test_a_heading_that_is_none_is_refused():
    with pytest.raises(ValueError, match="heading is nan"):
        earth_rate(0.5, math.nan)
