"""Limits as a person states them."""

from math import pi

import pytest

from sagnac.core.errors import RecordingError
from sagnac.core.units import field_unit
from sagnac.verdict.limits import Limit, Specification, specification_of

WALK = pi / 180.0 / 60.0  # 1 deg/sqrt(h) in rad/sqrt(s)
PER_HOUR = pi / 180.0 / 3600.0


@pytest.mark.parametrize(
    ("text", "letter", "value"),
    [
        ("3e-4deg/sqrt(h)", "N", 3e-4 * WALK),
        ("3e-4", "N", 3e-4 * WALK),
        ("0.0003 °/√h", "N", 3e-4 * WALK),
        ("0.018deg/h/sqrt(Hz)", "N", 3e-4 * WALK),
        ("0.018 deg/hr/rtHz", "N", 3e-4 * WALK),
        ("0.005 mdps/√Hz", "N", 3e-4 * WALK),
        ("0.000005dps/rtHz", "N", 3e-4 * WALK),
        ("3e-4 deg/rt-hr", "N", 3e-4 * WALK),
        ("B=0.01deg/h", "B", 0.01 * PER_HOUR),
        ("K=0.02", "K", 0.02 * PER_HOUR / 60.0),
        ("Q=.5arcsec", "Q", 0.5 * pi / 648_000.0),
        ("rate_ramp=2deg/h/h", "R", 2.0 * PER_HOUR / 3600.0),
    ],
)
def test_a_limit_has_a_coefficient_a_number_and_a_unit(text, letter, value):
    (limit,) = specification_of(text).limits
    assert limit.letter == letter
    assert limit.value == pytest.approx(value, rel=1e-12)


def test_several_limits_and_the_risk():
    found = specification_of("N=3e-4, B=0.01deg/h", risk=0.01)
    assert [limit.letter for limit in found.limits] == ["N", "B"]
    assert found.risk == 0.01


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "empty"),
        ("deg/sqrt(h)", "no number"),
        ("-1deg/sqrt(h)", "specification '-1deg/sqrt"),
        ("0", "above zero"),
        ("nan", "above zero"),
        ("3e-4deg/h", "not a unit of angle random walk"),
        ("X=3e-4", "no coefficient"),
        ("N=1,N=2", "one for each coefficient"),
    ],
)
def test_what_is_no_limit_is_refused(text, words):
    with pytest.raises(ValueError, match=words):
        specification_of(text)


def test_a_product_states_its_limits_in_a_file(tmp_path):
    path = tmp_path / "product.toml"
    path.write_text('product = "RLG 7"\nrisk = 0.01\n[limits]\nN = "3e-4 deg/sqrt(h)"\nB = 0.01\n')
    found = specification_of(str(path))
    assert (found.product, found.risk) == ("RLG 7", 0.01)
    assert [limit.in_unit for limit in found.limits] == pytest.approx([3e-4, 0.01])
    assert specification_of(str(path), risk=0.05).risk == 0.05


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("N = ", "no TOML"),
        ('M = "3"', "'M' is not known"),
        ("risk = 0.01", "one limit or more"),
        ("risk = 2.0\nN = 1.0", "risk is 2.0"),
        ('risk = "low"\nN = 1.0', "risk is 'low'"),
        ("limits = 3", "limits is 3; write"),
    ],
)
def test_an_error_of_a_file_names_the_file(tmp_path, content, words):
    path = tmp_path / "product.toml"
    path.write_text(content)
    with pytest.raises(ValueError, match=words) as caught:
        specification_of(str(path))
    assert str(path) in str(caught.value)


def test_a_specification_stands_as_it_is_and_has_its_own_risk(tmp_path):
    limits = specification_of("1", risk=0.1)
    assert specification_of(limits) is limits
    with pytest.raises(ValueError, match=r"risk is 0\.01, and the specification has its own"):
        specification_of(limits, risk=0.01)
    path = tmp_path / "limits.toml"
    with pytest.raises(RecordingError, match=r"limits\.toml: cannot be read .*; check the path"):
        specification_of(str(path))


def test_a_limit_checks_what_it_is_given():
    unit = field_unit("angle_random_walk")
    with pytest.raises(ValueError, match="not a unit of"):
        Limit(coefficient="bias_instability", value=1.0, unit=unit)
    with pytest.raises(ValueError, match="above zero"):
        Limit(coefficient="angle_random_walk", value=-1.0, unit=unit)
    with pytest.raises(ValueError, match="one limit or more"):
        Specification(limits=())


def test_a_decimal_comma_is_named():
    for text in ("0,105deg/sqrt(h)", "N=0,105deg/sqrt(h)"):
        with pytest.raises(ValueError, match="has a decimal comma; give a decimal point"):
            specification_of(text)
