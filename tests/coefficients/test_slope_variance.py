"""The variance of a rate ramp against its sums."""

import numpy as np
import pytest

from sagnac.coefficients.laws import slope_variance_basis


def test_ramp_variance_is_that_of_the_sum():
    samples, interval = 2000, 0.5
    laws = slope_variance_basis(samples * interval, interval)
    weights = np.arange(samples) - 0.5 * (samples - 1)
    weights /= weights @ weights * interval
    white = float(weights @ weights) / interval
    walk = float(np.sum(np.cumsum(weights[::-1]) ** 2)) * interval
    assert laws[1] == pytest.approx(white, rel=0.02)
    assert laws[3] == pytest.approx(walk, rel=0.02)
