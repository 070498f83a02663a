"""Units against numbers from elsewhere: definitions, and tables of conversion worked by hand."""

import math

import pytest

from sagnac.core import units
from sagnac.core.units import (
    COEFFICIENT_UNITS,
    UNITS,
    Unit,
    canonical,
    field_unit,
    sizes,
    split_factor,
    split_header,
    unit_of,
)


@pytest.mark.parametrize(
    ("unit", "radians"),
    [
        ("rad", 1.0),
        ("mrad", 0.001),
        ("urad", 1e-6),
        ("deg", 0.017453292519943295),
        ("arcmin", 2.908882086657216e-4),
        ("arcsec", 4.84813681109536e-6),
        ("mas", 4.84813681109536e-9),
        ("rev", 6.283185307179586),
        ("gon", 0.015707963267948967),
        ("°", 0.017453292519943295),
        ("″", 4.84813681109536e-6),
        ('"', 4.84813681109536e-6),
        ("Degrees", 0.017453292519943295),
    ],
)
def test_angles(unit, radians):
    assert unit_of(unit, "angle").size == pytest.approx(radians, rel=1e-15)


@pytest.mark.parametrize(
    ("unit", "radians_per_second"),
    [
        ("rad/s", 1.0),
        ("deg/s", 0.017453292519943295),
        ("deg/h", 4.84813681109536e-6),  # one degree an hour is one arc second a second
        ("arcsec/s", 4.84813681109536e-6),
        ("mrad/s", 1e-3),
        ("urad/s", 1e-6),
        ("dps", 0.017453292519943295),
        (" °/h ", 4.84813681109536e-6),
    ],
)
def test_rates(unit, radians_per_second):
    assert unit_of(unit, "rate").size == pytest.approx(radians_per_second, rel=1e-15)


@pytest.mark.parametrize(
    ("unit", "seconds"),
    [
        *(("s", 1.0), ("ms", 1e-3), ("us", 1e-6), ("ns", 1e-9)),
        *(("min", 60.0), ("h", 3600.0), ("d", 86400.0)),
    ],
)
def test_times(unit, seconds):
    assert unit_of(unit, "time").size == seconds


@pytest.mark.parametrize(
    ("coefficient", "unit", "size"),
    [
        ("quantization", "arcsec", 4.84813681109536e-6),
        # 1 deg/sqrt(h) is 60 deg/h/sqrt(Hz): an hour has 3600 s, and its root is 60.
        ("angle_random_walk", "deg/sqrt(h)", 2.908882086657216e-4),
        ("angle_random_walk", "deg/h/sqrt(Hz)", 2.908882086657216e-4 / 60.0),
        ("angle_random_walk", "rad/s/sqrt(Hz)", 1.0),
        ("bias_instability", "deg/h", 4.84813681109536e-6),
        ("rate_random_walk", "deg/h/sqrt(h)", 4.84813681109536e-6 / 60.0),
        ("rate_ramp", "deg/h/h", 4.84813681109536e-6 / 3600.0),
    ],
)
def test_coefficients(coefficient, unit, size):
    assert COEFFICIENT_UNITS[coefficient][unit] == pytest.approx(size, rel=1e-15)


def test_the_unit_of_the_field_stands_first():
    said = {name: field_unit(name).symbol for name in COEFFICIENT_UNITS}
    assert said == {
        "quantization": "″",
        "angle_random_walk": "°/√h",
        "bias_instability": "°/h",
        "rate_random_walk": "°/h/√h",
        "rate_ramp": "°/h/h",
    }
    with pytest.raises(ValueError, match="coefficient is 'drift'; use one of quantization"):
        field_unit("drift")


def test_constants_are_those_of_the_table():
    for name, constant in (
        ("arcsec", units.ARCSECOND),
        ("deg", units.DEGREE),
        ("h", units.HOUR),
        ("deg/h", units.DEGREE_PER_HOUR),
        ("deg/sqrt(h)", units.DEGREE_PER_ROOT_HOUR),
        ("deg/h/sqrt(Hz)", units.DEGREE_PER_HOUR_PER_ROOT_HERTZ),
        ("deg/h/sqrt(h)", units.DEGREE_PER_HOUR_PER_ROOT_HOUR),
        ("deg/h/h", units.DEGREE_PER_HOUR_PER_HOUR),
    ):
        assert UNITS[name].size == constant


SPELLINGS = {
    "deg/s": "Deg/s DEG/S dps DPS º/s °/sec degree/s degrees/second deg.s-1 °s⁻¹ degs/s",
    "deg/h": "°/hr deg/hour dph DEG/HR",
    "rad/s": "RAD/S rad/sec rad*s^-1 rad.s-1",
    "urad/s": "µrad/s μrad/s",
    # As the makers of units write it.
    "deg/sqrt(h)": "°/√hr °/√h º/√h °/√(hr) deg/rt-hr deg/root-hour deg/hr^0.5 deg/h^1/2",
    "deg/s/sqrt(Hz)": "°/s/√Hz (°/sec)/√Hz dps/√Hz dps/rtHz deg/√s deg/sqrt(s)",
    "mdeg/s/sqrt(Hz)": "mdps/√Hz mdeg/s/√Hz m°/s/√Hz mdps/rt(Hz)",
    "deg/h/sqrt(Hz)": "°/h/√Hz (deg/h)/sqrt(Hz) dph/rtHz (°/hr)/√Hz",
    "ug/sqrt(Hz)": "µg/√Hz μg/√Hz ug/rt-Hz",
    "m/s/sqrt(h)": "m/s/√hr (m/s)/√h m/s/rt-hr",
}


@pytest.mark.parametrize(
    ("name", "spelling"),
    [(name, one) for name, all_of in SPELLINGS.items() for one in all_of.split()],
)
def test_units_are_known_as_data_sheets_and_loggers_write_them(name, spelling):
    assert canonical(spelling) == name


@pytest.mark.parametrize(
    "text", ["x", "Min", "deg/", "sqrt", "root", "d/s", "deg/s/s", "rt", "m/h"]
)
def test_no_other_text_becomes_a_unit_of_rates_or_noise(text):
    known = UNITS.get(canonical(text))
    assert known is None or known.quantity == "time"


def test_every_unit_is_found_by_name_and_by_symbol():
    for name, unit in UNITS.items():
        assert canonical(name) == canonical(unit.symbol) == unit.name == str(unit) == name
        assert unit_of(name, unit.quantity) is unit


@pytest.mark.parametrize(
    ("text", "factor", "name"),
    [
        ("0.1arcsec", 0.1, "arcsec"),
        ("2.5e-3 °/s", 2.5e-3, "deg/s"),
        (".5deg", 0.5, "deg"),
        ("deg", 1.0, "deg"),
    ],
)
def test_a_number_may_stand_before_a_unit(text, factor, name):
    assert split_factor(text) == (factor, name)
    quantity = UNITS[name].quantity
    assert unit_of(text, quantity).size == factor * UNITS[name].size


@pytest.mark.parametrize(
    ("header", "name", "unit"),
    [
        ("x[arcsec]", "x", "arcsec"),
        (" rate [ deg/s ]", "rate", "deg/s"),
        ("x", "x", None),
        ("x[]", "x", None),
        ("[deg]", "[deg]", None),
    ],
)
def test_headers_state_units_in_brackets(header, name, unit):
    assert split_header(header) == (name, unit)


@pytest.mark.parametrize("text", ["deg/s", "furlong", "", "0deg"])
def test_what_is_no_unit_of_a_quantity_is_refused_with_those_that_are(text):
    with pytest.raises(ValueError, match=r"is not a unit of angle; use one of rad, mrad, urad"):
        unit_of(text, "angle")
    with pytest.raises(ValueError, match=r"is not a unit of time; use one of s, ms, us"):
        unit_of(text, "time")


def test_units_check_what_they_are_given():
    with pytest.raises(ValueError, match="quantity is 'mass'; use one of angle, rate"):
        Unit(name="kg", symbol="kg", quantity="mass", size=1.0)
    with pytest.raises(ValueError, match="quantity is 'mass'"):
        sizes("mass")
    for size in (0.0, math.inf, math.nan):
        with pytest.raises(ValueError, match="size is"):
            Unit(name="a", symbol="a", quantity="angle", size=size)
