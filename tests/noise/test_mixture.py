"""Quantiles of a mixture against those of one law."""

import numpy as np
import pytest
from scipy.stats import gamma

from sagnac.noise.estimates import Interval
from sagnac.noise.model_average import mixture_quantile


def test_quantiles_of_a_mixture_of_one():
    level, shape = 3.0, 7.5
    low = mixture_quantile(0.025, np.array([level]), np.array([shape]), np.array([1.0]))
    assert level / low == pytest.approx(gamma.ppf(0.975, shape) / shape, rel=1e-6)


def test_a_fit_whose_error_is_larger_than_its_value_has_an_upper_end():
    # A variance of 12 squares of the value: taken as a law it reached 10^18 times as high.
    high = mixture_quantile(0.975, np.array([1.0]), np.array([1.0 / 12.0]), np.array([1.0]))
    assert high == pytest.approx(1.0 / gamma.ppf(0.025, 1.0), rel=1e-6)


def test_an_interval_holds_its_value():
    with pytest.raises(ValueError, match="lies outside"):
        Interval(value=1.0, low=2.0, high=3.0)
