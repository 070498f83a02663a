"""When the fit of the whole band may be the answer."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad

from sagnac.noise.estimates import Estimate, Fit, FitBand
from sagnac.noise.fit import likelihood_fit
from sagnac.noise.laws import COEFFICIENT_NAMES
from sagnac.noise.model_average import average
from sagnac.noise.slow_laws import PLAIN, SlowLaw, SlowLaws
from sagnac.noise.whole_band import levels_bear_out, with_slow_laws, with_whole_band
from sagnac.spectrum.levels import robust_levels
from sagnac.spectrum.tapered import tapered_spectrum


def estimate(value, low, high, name="angle_random_walk"):
    return Estimate(name=name, status="estimated", value=value, low=low, high=high, confidence=0.95)


@pytest.mark.parametrize(
    ("value", "found"),
    [
        (1.0, "whole band"),
        (1.5, "whole band"),
        (0.97, "whole band"),
        (0.9, "both"),
        (0.5, "average"),
        (3.5, "both"),
    ],
)
def test_a_fit_is_compared_with_the_side_of_a_lopsided_interval_where_it_lies(value, found):
    noise = np.random.default_rng(3).standard_normal(20_000)
    levels = robust_levels(tapered_spectrum(noise, sample_rate=1.0))
    # One standard error is 5 % below and a factor of 1.76 above.
    walk = estimate(1.0, np.exp(-0.05 * 1.96), np.exp(0.567 * 1.96))
    alone = average(levels)
    alone = alone.with_coefficients({**alone.coefficients, "angle_random_walk": walk})
    fit = Fit(
        method="likelihood",
        coefficients={
            name: estimate(value, 0.99 * value, 1.01 * value, name) for name in COEFFICIENT_NAMES
        },
        band=FitBand(low=0.0, high=0.5, interval=1.0),
    )
    assert with_whole_band(levels, alone, fit).rests_on.member == found


def test_levels_bear_out_a_fit_that_describes_them():
    noise = np.random.default_rng(4).standard_normal(20_000)
    levels = robust_levels(tapered_spectrum(noise, sample_rate=1.0))
    walk = estimate(1.0, 0.98, 1.02)
    fit = likelihood_fit(noise, kind="increment", sample_rate=1.0, band=(0.0, 0.1))
    assert levels_bear_out(levels, fit, walk)
    assert not levels_bear_out(levels, fit, estimate(1.2, 1.15, 1.25))
    steep = {**fit.squares, "rate_random_walk": 1e-2}
    assert not levels_bear_out(levels, replace(fit, squares=steep), walk)
    assert not levels_bear_out(levels, replace(fit, departure=0.1), walk)


def test_a_law_that_does_not_need_a_walk_leaves_its_interval_an_end():
    """K of a Markov bias: a law that had next to none let it be fifteen million deg/h/sqrt(h).

    What that law allows of K is what chance hides: two errors or so, not many orders of magnitude.
    """
    error = 0.15
    slow = SlowLaws(
        laws=(PLAIN, SlowLaw(end=0.003)),
        prior=np.array([0.75, 0.25]),
        squares=np.array([[0.0, 1.0, 0.1, 1.0], [0.0, 1.0, 0.5, 0.1 * error]]),
        errors=np.full((2, 4), error),
        deviance=np.zeros(2),
    )
    coefficients = {name: estimate(1.0, 0.85, 1.2, name) for name in COEFFICIENT_NAMES}
    fit = Fit(method="likelihood", coefficients=coefficients, slow=slow)
    found = with_slow_laws(fit).coefficients["rate_random_walk"]
    assert found.status == "estimated"
    assert found.low < 0.5 < found.value < 1.0 < found.high < 1.25


def test_a_walk_that_half_of_the_laws_do_not_need_is_bounded_where_its_interval_would_end():
    """Of 25 bounds of a true K, 7 lay below it, as far down as 0.92 of it.

    K is doubted where chance made it low: there a bound has to reach as far up as an interval, and
    three errors above what was not three errors above zero.
    """
    slow = SlowLaws(
        laws=(PLAIN, SlowLaw(corner=0.003)),
        prior=np.array([0.4, 0.6]),
        squares=np.ones((2, 4)),
        errors=np.full((2, 4), 0.2),
        deviance=np.zeros(2),
    )
    coefficients = {name: estimate(1.0, 0.8, 1.25, name) for name in COEFFICIENT_NAMES}
    fit = Fit(method="likelihood", coefficients=coefficients, slow=slow)
    found = with_slow_laws(fit).coefficients["rate_random_walk"]
    assert found.status == "upper bound"
    assert found.high == pytest.approx(math.sqrt(1.0 + 3.0 * 0.2), rel=0.02)


@pytest.mark.parametrize("errors", [0.0, 1.0, 2.0, 3.5, 5.0, 20.0])
def test_a_law_is_likelier_by_what_its_q_may_be(errors):
    """None, or any of four decades evenly: beside a law whose Q is four errors above zero."""

    def likelihood(fitted):
        decades = (1e-2, 1e2)

        def evenly(logarithm):
            return math.exp(-0.5 * (math.exp(logarithm) - fitted) ** 2)

        some = quad(evenly, *np.log(decades), limit=400, points=[math.log(max(fitted, 1.0))])[0]
        return math.exp(-0.5 * fitted**2) + some / math.log(decades[1] / decades[0])

    slow = SlowLaws(
        laws=(PLAIN, SlowLaw(end=0.003)),
        prior=np.array([0.5, 0.5]),
        squares=np.array([[0.1 * errors, 1.0, 0.1, 0.2], [0.4, 1.0, 0.1, 0.2]]),
        errors=np.full((2, 4), 0.1),
        deviance=np.zeros(2),
    )
    ratio = float(slow.weight[0] / slow.weight[1])
    assert ratio == pytest.approx(likelihood(errors) / likelihood(4.0), rel=0.3)


def test_a_bound_is_as_many_times_smaller_as_the_noise():
    """In SI units squares are of 1e-16: bounds of them were of ten errors instead of two."""
    error, unit = np.array([[0.1, 0.02, 0.2, 0.3], [0.15, 0.02, 0.3, 0.5]]), 1e-8
    square = np.array([[0.4, 1.0, 0.1, 0.2], [0.6, 1.0, 0.3, 0.4]])

    def bounds(size):
        slow = SlowLaws(
            laws=(PLAIN, SlowLaw(end=0.003)),
            prior=np.array([0.75, 0.25]),
            squares=square * size**2,
            errors=error * size**2,
            deviance=np.zeros(2),
        )
        one = estimate(size, 0.0, size)
        bounded = {name: replace(one, name=name).bounded(0.1 * size) for name in COEFFICIENT_NAMES}
        fit = with_slow_laws(Fit(method="likelihood", coefficients=bounded, slow=slow))
        return [fit.coefficients[name].high / size for name in ("quantization", "bias_instability")]

    assert bounds(unit) == pytest.approx(bounds(1.0), rel=1e-6)
    rng = np.random.default_rng(3)
    drawn = np.where(rng.random(10**6) < 0.75, *rng.normal(square[:, :1], error[:, :1], (2, 10**6)))
    assert bounds(unit)[0] == pytest.approx(math.sqrt(np.quantile(drawn, 0.95)), rel=0.01)
