"""Estimates: units, checks and how they print."""

import math

import pytest

from sagnac.coefficients.estimates import in_units
from tests.coefficients.examples import NAMES


def test_units_of_every_coefficient():
    walk = in_units("angle_random_walk", math.pi / 180.0 / 60.0)
    assert walk["deg/sqrt(h)"] == pytest.approx(1.0)
    assert walk["deg/h/sqrt(Hz)"] == pytest.approx(60.0)
    assert walk["rad/s/sqrt(Hz)"] == walk["rad/sqrt(s)"] == math.pi / 10800.0
    assert in_units("quantization", 1.0)["arcsec"] == pytest.approx(206264.806, rel=1e-8)
    assert in_units("bias_instability", math.pi / 180.0)["deg/h"] == pytest.approx(3600.0)
    assert in_units("rate_random_walk", math.pi / 180.0)["deg/h/sqrt(h)"] == pytest.approx(
        3600.0 * 60.0
    )
    assert in_units("rate_ramp", math.pi / 180.0)["deg/h/h"] == pytest.approx(3600.0**2)
    assert [next(iter(in_units(name, 1.0))) for name in NAMES] == [
        "arcsec",
        "deg/sqrt(h)",
        "deg/h",
        "deg/h/sqrt(h)",
        "deg/h/h",
    ]
