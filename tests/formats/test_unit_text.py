"""Units as people write them, counts among them."""

import pytest

from sagnac.formats.statement import UnitText, parsed_unit


@pytest.mark.parametrize(
    ("unit", "factor", "name"),
    [("0.1arcsec", 0.1, "arcsec"), ("5e-3 deg/s", 5e-3, "deg/s"), ("″", 1.0, "arcsec")],
)
def test_factors(unit, factor, name):
    assert parsed_unit(unit) == UnitText(factor=factor, name=name)


@pytest.mark.parametrize(
    ("text", "known", "counts", "angle"),
    [
        ("arcsec", True, False, True),
        ("0.1arcsec", True, False, True),
        ("0arcsec", False, False, False),
        ("deg/s", True, False, False),
        ("ms", True, False, False),
        ("counts", True, True, False),
        ("LSB", True, True, False),
        ("2counts", False, True, False),
        ("furlong", False, False, False),
    ],
)
def test_what_a_unit_is_one_of(text, known, counts, angle):
    unit = parsed_unit(text)
    assert (unit.is_known, unit.is_counts, unit.is_angle) == (known, counts, angle)
