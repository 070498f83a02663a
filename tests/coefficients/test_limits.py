"""Root finding of profiles."""

import math

import pytest

from sagnac.coefficients.limits import crossing, likelihood_drop


@pytest.mark.parametrize("root", [0.3, 1.0, 5.7, 4000.0])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_crossing_is_where_the_rise_is_zero(root, sign):
    found = crossing(lambda x: math.sqrt(abs(x)) - math.sqrt(root), 0.0, sign)
    assert found == pytest.approx(sign * root, rel=2e-3 / math.sqrt(root) + 1e-6)


def test_a_crossing_stops_at_its_limit_or_never():
    assert crossing(lambda x: -1.0, 1.0, -0.3, 0.0) == 0.0
    assert crossing(lambda x: -1.0, 1.0, -0.3) == -math.inf
    assert crossing(lambda x: -1.0, 1.0, 0.3) == math.inf


def test_a_rise_that_is_not_negative_inside_crosses_there():
    assert crossing(lambda x: 0.5 + x, 2.0, 1.0) == 2.0


def test_the_drop_of_a_likelihood_is_the_square_of_standard_deviations():
    assert likelihood_drop(0.9973) == pytest.approx(9.0, rel=1e-3)
    assert likelihood_drop(-0.5) == pytest.approx(0.0, abs=1e-9)
