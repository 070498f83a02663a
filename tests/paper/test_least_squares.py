"""Least squares in every form, against closed forms."""

import numpy as np
import pytest

from sagnac.paper.prediction import FIGURE_3
from sagnac.paper.trials import FORMS, least_squares


@pytest.mark.parametrize("form", FORMS)
def test_least_squares_are_exact_where_the_terms_are(form):
    tau = np.arange(1.0, 60.0)
    if form.startswith("variance"):
        curve = np.sqrt(3.0 * 0.2**2 / tau**2 + 1.5**2 / tau + 0.4 + 0.01 * tau)
    else:
        curve = 0.3 / tau + 1.5 / np.sqrt(tau) + 0.4 + 0.02 * np.sqrt(tau)
    assert least_squares(tau, curve, form) == pytest.approx(1.5, rel=1e-6)


def test_least_squares_say_when_the_coefficient_is_negative():
    tau = np.arange(1.0, 60.0)
    curve = np.sqrt(9.0 / tau**2 - 1.5**2 / tau + 1.0)
    assert least_squares(tau, curve, "variance, plain") == pytest.approx(-1.5, rel=1e-6)
    assert least_squares(tau, curve, "variance, plain, none below zero") >= 0.0


def test_a_slow_line_makes_the_published_figure_3():
    """The curve of a white rate and a sinusoid, in closed form at the three intervals."""
    grown = []
    for interval in (1, 6, 12):
        angles = 7200 // interval
        factors = np.arange(1, angles // 3)
        factors = factors[2.0 * ((angles - 1) / factors - 1.0) >= 100.0]
        tau = factors * float(interval)
        line = 2.0 * 0.031 * np.sin(np.pi * tau / 25.5) ** 2 / tau
        curve = np.sqrt((2.5e-4 * 60.0) ** 2 / tau + line**2)
        grown.append(abs(least_squares(tau, curve, "deviation, plain")) / 60.0)
    np.testing.assert_allclose(grown, list(FIGURE_3.values()), rtol=0.3)
