"""Units as people write them, counts among them."""

import pytest

from sagnac.core.units import split_factor
from sagnac.formats.statement import is_counts, is_known, is_size


@pytest.mark.parametrize(
    ("unit", "factor", "name"),
    [("0.1arcsec", 0.1, "arcsec"), ("5e-3 deg/s", 5e-3, "deg/s"), ("″", 1.0, "arcsec")],
)
def test_factors(unit, factor, name):
    assert split_factor(unit) == (factor, name)


@pytest.mark.parametrize(
    ("text", "known", "counts"),
    [
        ("arcsec", True, False),
        ("0.1arcsec", True, False),
        ("0arcsec", False, False),
        ("deg/s", True, False),
        ("ms", True, False),
        ("counts", True, True),
        ("LSB", True, True),
        ("2counts", False, False),
        ("furlong", False, False),
    ],
)
def test_what_a_unit_is_one_of(text, known, counts):
    assert (is_known(text), is_counts(text), is_size(text)) == (known, counts, known and not counts)
