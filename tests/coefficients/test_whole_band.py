"""When the fit of the whole band may be the answer."""

from dataclasses import replace

import numpy as np
import pytest

from sagnac.coefficients.band_models import band_models
from sagnac.coefficients.estimates import Estimate
from sagnac.coefficients.laws import COEFFICIENT_NAMES, rate_density_basis
from sagnac.coefficients.spectrum_fit import likelihood_fit
from sagnac.coefficients.whole_band import WholeBand, borne_out, levels_bear_out
from sagnac.spectrum.levels import robust_levels
from sagnac.spectrum.tapered import tapered_spectrum


def estimate(value, low, high, name="angle_random_walk"):
    return Estimate(name=name, status="estimated", value=value, low=low, high=high, confidence=0.95)


@pytest.mark.parametrize(
    ("value", "found"),
    [(1.0, True), (1.5, True), (0.97, True), (0.9, False), (0.5, None), (3.5, False)],
)
def test_a_fit_is_compared_with_the_side_of_a_lopsided_interval_where_it_lies(value, found):
    noise = np.random.default_rng(3).standard_normal(20_000)
    levels = robust_levels(tapered_spectrum(noise, sample_rate=1.0))
    laws = levels.law(lambda frequency: rate_density_basis(frequency, 1.0))
    # One standard error is 5 % below and a factor of 1.76 above.
    walk = estimate(1.0, np.exp(-0.05 * 1.96), np.exp(0.567 * 1.96))
    fit = WholeBand(
        coefficients={
            name: estimate(value, 0.99 * value, 1.01 * value, name) for name in COEFFICIENT_NAMES
        },
        band_hz=(0.0, 0.5),
        describes=True,
    )
    result = borne_out(levels, laws, band_models(levels), fit, walk)
    assert (None if result is None else result.surely) is found


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
