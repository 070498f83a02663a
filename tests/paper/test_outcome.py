"""N of a curve by the forms of least squares, with the paper's cut."""

import numpy as np
import pytest

from sagnac.core.units import DEGREE_PER_ROOT_HOUR
from sagnac.paper.reproduce import least_squares_of
from sagnac.paper.trials import FORMS, least_squares
from sagnac.stability.curve import stability_curve


def walk(samples):
    return 1e-7 * np.cumsum(np.random.default_rng(3).standard_normal(samples))


def test_points_worse_than_a_tenth_are_left_out():
    curve = stability_curve(walk(3600), kind="angle", sample_rate=1.0)
    # IEEE Std 952: an error of 1/sqrt(2 (N/n - 1)) at n of N increments.
    kept = 1.0 / np.sqrt(2.0 * (3599 / curve.tau - 1.0)) <= 0.1
    assert 5 < np.count_nonzero(kept) < curve.tau.size
    found = least_squares_of(curve)
    assert list(found) == list(FORMS)
    for form, value in found.items():
        plain = least_squares(curve.tau[kept], curve.deviation[kept], form)
        assert value == pytest.approx(plain / DEGREE_PER_ROOT_HOUR)


def test_a_curve_of_fewer_than_five_points_gives_nothing():
    assert least_squares_of(stability_curve(walk(200), kind="angle", sample_rate=1.0)) == {}
