"""Estimates: units, checks and how they print."""

import math
from dataclasses import replace

import pytest

from sagnac.noise.estimates import Estimate, Fit, rooted


def estimate(**change):
    given = {
        "name": "angle_random_walk",
        "value": 2e-3 * math.pi / 10800.0,
        "low": 1e-3 * math.pi / 10800.0,
        "high": 4e-3 * math.pi / 10800.0,
        "confidence": 0.95,
        "status": "estimated",
    }
    return Estimate(**(given | change))


def test_an_estimate_in_any_unit_of_its_coefficient():
    one = estimate().to("deg/sqrt(h)")
    assert (one.value, one.low, one.high) == pytest.approx((2e-3, 1e-3, 4e-3))
    assert float(estimate().to("deg/h/sqrt(Hz)")) == pytest.approx(0.12)
    assert estimate().to("°/√h") == one
    walk = estimate(name="rate_random_walk")
    assert walk.to("rad/s^2/sqrt(Hz)").value == walk.value
    assert float(walk.to("deg/s/sqrt(s)")) == pytest.approx(math.degrees(walk.value))
    bias = estimate(name="bias_instability")
    assert float(bias.to("deg/s")) == pytest.approx(math.degrees(bias.value))
    with pytest.raises(ValueError, match="unit 'deg/h' is not one of angle_random_walk; use one"):
        estimate().to("deg/h")
    with pytest.raises(ValueError, match="is that of a share"):
        format(one, ".1%")
    with pytest.raises(ValueError, match="has no name"):
        estimate(name=None).to("deg/sqrt(h)")


def test_estimates_print_in_the_unit_of_the_field():
    assert repr(estimate()) == "<angle_random_walk 0.002 (0.001 to 0.004) deg/sqrt(h), 95 %>"
    bound = estimate(value=4e-3 * math.pi / 10800.0, low=0.0, status="upper bound")
    assert repr(bound) == "<angle_random_walk below 0.004 deg/sqrt(h), 95 %>"
    unseen = estimate(value=math.nan, low=math.nan, high=math.nan, status="not observable")
    assert repr(unseen) == "<angle_random_walk not observable>"
    assert unseen == replace(unseen, value=-math.nan)
    assert hash(unseen) == hash(replace(unseen, low=float("nan")))
    assert unseen != bound != estimate()
    unnamed = estimate(name=None, value=1.0, low=0.5, high=2.0)
    assert repr(unnamed) == "<estimate 1 (0.5 to 2) SI, 95 %>"
    assert "<b>angle random walk</b> 0.002" in estimate()._repr_html_()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"status": "guessed"}, "status is 'guessed'; use one of estimated, upper bound"),
        ({"confidence": 95.0}, "confidence is 95.0; give a number between 0 and 1"),
        ({"low": 1.0}, "give low <= value <= high"),
        ({"low": -1.0}, "low is -1; give zero or more"),
        ({"value": "1"}, "value is '1'; give a number"),
        ({"value": math.nan}, "give low <= value <= high"),
        ({"status": "not observable"}, "has NaN for all three"),
        ({"name": "drift"}, "name is 'drift'; use one of quantization"),
    ],
)
def test_an_estimate_checks_what_it_is_given(change, words):
    with pytest.raises((ValueError, TypeError), match=words):
        estimate(**change)


def test_a_fit_checks_its_names():
    with pytest.raises(ValueError, match="method is 'least'; use one of paper"):
        Fit(method="least", coefficients={})
    with pytest.raises(ValueError, match="coefficients: name is 'drift'"):
        Fit(method="paper", coefficients={"drift": estimate()})


def test_the_root_of_a_square_has_the_roots_of_its_ends():
    one = rooted("rate_random_walk", 0.95, 4.0, 1.0, 9.0)
    assert (one.status, one.value, one.low, one.high) == ("estimated", 2.0, 1.0, 3.0)
    bound = one.bounded(2.0)
    assert (bound.value, bound.low, bound.high, bound.status) == (2.0, 0.0, 2.0, "upper bound")


def test_an_interval_that_begins_at_zero_is_a_bound():
    found = rooted("bias_instability", 0.95, 4.0, 0.0, 9.0)
    assert (found.status, found.value, found.low, found.high) == ("upper bound", 3.0, 0.0, 3.0)
