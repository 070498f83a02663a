"""No coefficient asks for more than the curve shows, and slow noise that no term has is said."""

import math

import numpy as np
import pytest

from sagnac.noise.bounds import highest_terms, slow_noise, within_curve
from sagnac.noise.estimates import Estimate
from sagnac.stability.curve import stability_curve

SAMPLES = 20_000
HOW = {"confidence": 0.95, "shortest": 0.0, "flicker_end": math.inf}


def curve_of(rates):
    return stability_curve(rates, kind="rate", sample_rate=1.0)


def white():
    return np.random.default_rng(12).standard_normal(SAMPLES)


def estimate(name, value, low, high, status="estimated"):
    return Estimate(name=name, value=value, low=low, high=high, confidence=0.95, status=status)


def test_what_a_curve_allows_is_its_lowest_point_over_the_law():
    curve = curve_of(white())
    highest = highest_terms(curve, **HOW)
    flicker = math.sqrt(2.0 * math.log(2.0) / math.pi)
    # All points share the chance, and long ones have few degrees of freedom: of the order of the
    # lowest of their own limits.
    lowest = float(np.min(curve.high)) / flicker
    assert 0.5 * lowest < highest["bias_instability"] < 10.0 * lowest
    walk = float(np.min(curve.high / np.sqrt(curve.tau / 3.0)))
    assert 0.5 * walk < highest["rate_random_walk"] < 10.0 * walk


@pytest.mark.parametrize(
    ("name", "truth"), [("quantization", 3.0), ("rate_random_walk", 0.01), ("rate_ramp", 1e-3)]
)
def test_a_truth_is_allowed(name, truth):
    # Beside white noise of 1: of 40 curves all may allow it, at 95 % each.
    shapes = {
        "quantization": lambda generator: np.diff(generator.standard_normal(4001)),
        "rate_random_walk": lambda generator: np.cumsum(generator.standard_normal(4000)),
        "rate_ramp": lambda generator: np.arange(4000.0),
    }
    held = 0
    for seed in range(40):
        generator = np.random.default_rng(seed)
        rates = truth * shapes[name](generator) + generator.standard_normal(4000)
        held += highest_terms(curve_of(rates), **HOW)[name] >= truth
    assert held >= 38


def test_an_estimate_that_contradicts_the_curve_is_a_bound_and_one_that_does_not_stays():
    highest = {"bias_instability": 1.0}
    found = within_curve(
        {
            "bias_instability": estimate("bias_instability", 15.0, 9.0, 18.0),
            "angle_random_walk": estimate("angle_random_walk", 15.0, 9.0, 18.0),
        },
        highest,
    )
    bound = found["bias_instability"]
    assert (bound.status, bound.low, bound.value, bound.high) == ("upper bound", 0.0, 1.0, 1.0)
    assert found["angle_random_walk"].status == "estimated"
    below = estimate("bias_instability", 0.5, 0.4, 0.6)
    across = estimate("bias_instability", 0.9, 0.8, 1.5)
    loose = estimate("bias_instability", 3.0, 0.0, 3.0, "upper bound")
    assert within_curve({"bias_instability": below}, highest)["bias_instability"] == below
    shortened = within_curve({"bias_instability": across}, highest)["bias_instability"]
    assert (shortened.value, shortened.low, shortened.high) == (0.9, 0.8, 1.0)
    assert within_curve({"bias_instability": loose}, highest)["bias_instability"].high == 1.0


def test_a_rise_that_no_term_has_is_said_and_white_noise_is_not():
    walk = estimate("angle_random_walk", 1.0, 0.98, 1.02)
    rates = white()
    assert slow_noise(curve_of(rates), {"angle_random_walk": walk}) is None
    slow = rates + 0.02 * np.cumsum(np.random.default_rng(13).standard_normal(SAMPLES))
    found = slow_noise(curve_of(slow), {"angle_random_walk": walk})
    assert found is not None
    assert found[1] > 1.2
    term = estimate("rate_random_walk", 0.02, 0.015, 0.03)
    told = {"angle_random_walk": walk, "rate_random_walk": term}
    assert slow_noise(curve_of(slow), told) is None


@pytest.mark.parametrize("seed", range(20))
def test_white_noise_rises_by_chance_alone(seed):
    walk = estimate("angle_random_walk", 1.0, 0.98, 1.02)
    rates = np.random.default_rng(1000 + seed).standard_normal(2000)
    assert slow_noise(curve_of(rates), {"angle_random_walk": walk}) is None


def test_a_rise_is_said_if_the_curve_falls_again_by_chance_at_its_end():
    """Of few clusters the end may lie lowest of all: a quarter of these rises was not said."""
    walk, found = estimate("angle_random_walk", 1.0, 0.98, 1.02), []
    for seed in range(20):
        white, steps = np.random.default_rng(2000 + seed).standard_normal((2, 2000))
        curve = curve_of(white + 2.0 * np.pi * 12.0 / 2000.0 * np.cumsum(steps))
        found.append(slow_noise(curve, {"angle_random_walk": walk}))
    assert None not in found
