"""Root finding of profiles."""

import math

import numpy as np
import pytest

from sagnac.noise.likelihood import crossing, detected, interval_ends, low_end


@pytest.mark.parametrize("root", [0.3, 1.0, 5.7, 4000.0])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_crossing_is_where_the_rise_is_zero(root, sign):
    found = crossing(lambda x: math.sqrt(abs(x)) - math.sqrt(root), 0.0, sign)
    assert found == pytest.approx(sign * root, rel=1e-8)


@pytest.mark.parametrize("rounding", [-1e-15, 0.0, 1e-15])
def test_a_crossing_at_the_first_step_does_not_hang_on_a_rounding_error(rounding):
    assert crossing(lambda x: x - 1.0 + rounding, 0.0, 1.0) == pytest.approx(1.0, rel=1e-9)


def test_a_rise_may_be_infinite():
    assert crossing(lambda x: -math.inf if x < 3.0 else math.inf, 0.0, 1.0) == pytest.approx(3.0)


def test_a_crossing_stops_at_its_limit_or_never():
    assert crossing(lambda x: -1.0, 1.0, -0.3, 0.0) == 0.0
    assert crossing(lambda x: -1.0, 1.0, -0.3) == -math.inf
    assert crossing(lambda x: -1.0, 1.0, 0.3) == math.inf


def test_a_rise_that_is_not_negative_inside_crosses_there():
    assert crossing(lambda x: 0.5 + x, 2.0, 1.0) == 2.0


def test_the_ends_of_an_interval_are_standard_deviations():
    assert interval_ends(0.9973)[0] == pytest.approx(3.0, rel=1e-3)
    assert interval_ends(0.95)[1] == pytest.approx(1.6449, rel=1e-4)
    assert interval_ends(0.25)[1] == 0.0


def normal_estimates(truth):
    return truth + np.random.default_rng(9).standard_normal(400_000)


@pytest.mark.parametrize("truth", [2.5, 3.0, 4.0, 6.0, 10.0])
def test_intervals_hold_of_those_that_are_called_estimated(truth):
    # Unit errors: of terms that are hardly seen those that came out large are picked.
    seen = np.round(normal_estimates(truth), 2)
    ends = {value: low_end(value, 0.95) for value in np.unique(seen[seen > 3.0])}
    low = np.array([value - ends.get(value, np.inf) for value in seen])
    estimated = low > 0.0
    held = (low <= truth) & (truth <= seen + 1.96)
    assert np.mean(held[estimated]) >= 0.9


@pytest.mark.parametrize("truth", [1.0, 3.0, 4.0, 5.0, 5.2])
def test_bounds_hold_of_those_that_are_given_as_bounds(truth):
    seen = normal_estimates(truth)
    bounded = seen[seen < detected(0.95) - 1.645]
    held = np.maximum(bounded + 1.645, detected(0.95)) >= truth
    assert np.mean(held) >= 0.95
    if truth > 3.0:
        assert np.mean(bounded + 1.645 >= truth) < 0.95


def test_far_above_zero_the_interval_is_the_plain_one():
    assert low_end(20.0, 0.95) == pytest.approx(1.96, abs=0.002)
    assert low_end(3.2, 0.95) == np.inf
    # A term without which a spectrum is impossible has a plain interval.
    assert low_end(1e15, 0.95) == pytest.approx(1.96, abs=0.001)
    assert low_end(np.inf, 0.95) == pytest.approx(1.96, abs=0.001)
