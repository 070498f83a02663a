import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sagnac.core.units import EARTH_RATE
from sagnac.table.frames import earth_rate, shares_from_deviations, table_to_gyro_matrix

deviation = st.floats(-0.01, 0.01)


@given(deviation, deviation, deviation)
def test_matrix_is_a_rotation_with_the_shares_along_the_shaft(dx, dy, dz):
    shares = shares_from_deviations((dx, dy, dz))
    matrix = table_to_gyro_matrix(*shares)
    np.testing.assert_allclose(matrix @ matrix.T, np.eye(3), atol=1e-14)
    assert np.linalg.det(matrix) == pytest.approx(1.0, abs=1e-14)
    np.testing.assert_allclose(matrix @ [0.0, 0.0, 1.0], shares, atol=1e-15)
    # x_b lies along the projection of x_s on the table, so x_s has no y_b component.
    assert matrix[0, 1] == 0.0
    assert matrix[0, 0] > 0.0


def test_matrix_at_the_nominal_shares_is_the_known_one():
    third, half, sixth = math.sqrt(1 / 3), math.sqrt(1 / 2), math.sqrt(1 / 6)
    np.testing.assert_allclose(
        table_to_gyro_matrix(third, third, third),
        [[math.sqrt(2 / 3), 0.0, third], [-sixth, half, third], [-sixth, -half, third]],
        atol=1e-15,
    )


@given(deviation, deviation, deviation)
def test_shares_have_unit_length_and_keep_their_order(dx, dy, dz):
    deviations = np.array([dx, dy, dz])
    shares = shares_from_deviations(deviations)
    assert np.linalg.norm(shares) == pytest.approx(1.0, abs=1e-15)
    assert list(np.argsort(shares, kind="stable")) == list(
        np.argsort(math.sqrt(1 / 3) + deviations, kind="stable")
    )


def test_shares_that_are_no_direction_are_refused():
    with pytest.raises(ValueError, match=r"not 1, so Eq\. 1 is no rotation.*unit length"):
        table_to_gyro_matrix(0.578, 0.578, 0.578)
    with pytest.raises(ValueError, match="no projection"):
        table_to_gyro_matrix(1.0, 0.0, 0.0)
    with pytest.raises(ValueError, match=r"three numbers below 0\.1"):
        shares_from_deviations((0.001, 0.001))
    with pytest.raises(ValueError, match=r"three numbers below 0\.1"):
        shares_from_deviations((0.001, math.nan, 0.0))


@given(st.floats(-math.pi / 2, math.pi / 2), st.floats(-math.pi, math.pi))
def test_earth_rate_keeps_its_size_and_vertical_part(latitude, heading):
    eta = earth_rate(latitude, heading)
    assert np.linalg.norm(eta) == pytest.approx(EARTH_RATE, rel=1e-14, abs=0.0)
    assert eta[2] == pytest.approx(-EARTH_RATE * math.sin(latitude), abs=1e-19)


def test_earth_rate_points_to_the_pole():
    np.testing.assert_allclose(earth_rate(0.0, 0.0), [EARTH_RATE, 0, 0], atol=1e-20)
    # Null pulse to the east: north lies to the left, along -y (z is down).
    np.testing.assert_allclose(earth_rate(0.0, math.pi / 2), [0, -EARTH_RATE, 0], atol=1e-20)
    np.testing.assert_allclose(earth_rate(math.pi / 2, 0.3), [0, 0, -EARTH_RATE], atol=1e-20)
    # One turn in a sidereal day, 86164.1 s.
    assert 2 * math.pi / EARTH_RATE == pytest.approx(86164.1, abs=0.1)
    with pytest.raises(ValueError, match="beyond a pole"):
        earth_rate(2.0, 0.0)
