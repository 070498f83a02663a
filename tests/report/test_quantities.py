"""Titles, units and digits."""

import dataclasses
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sagnac.noise.laws import COEFFICIENT_NAMES
from sagnac.report import quantities
from tests.handmade import N, estimate, line


@given(
    st.floats(1e-12, 1e9),
    st.floats(1e-4, 1.0),
)
def test_a_number_keeps_what_its_interval_allows_and_no_more(value, relative):
    width = relative * value
    text = quantities.number(value, width, plain=True)
    assert abs(float(text) - value) <= 0.06 * width
    mantissa = text.partition("e")[0].replace(".", "").lstrip("0")
    assert len(mantissa) <= max(3 - math.floor(math.log10(relative)), 6)


@given(st.floats(1e-12, 1e9), st.floats(1e-4, 0.9))
def test_a_number_for_people_says_the_same_as_one_for_programs(value, relative):
    superscripts = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")
    shown = quantities.number(value, relative * value)
    mantissa, _, power = shown.partition(" × 10")
    figure = float(mantissa) * 10.0 ** int(power.translate(superscripts) or 0)
    assert figure == pytest.approx(float(quantities.number(value, relative * value, plain=True)))


def test_a_number_by_example():
    assert quantities.number(2.5134e-5, 4e-7) == "2.513 × 10⁻⁵"
    assert quantities.number(2.5134e-5, 4e-7, plain=True) == "2.513e-05"
    assert quantities.number(0.012345, 0.001) == "0.0123"
    assert quantities.number(1234.5, 30.0) == "1234"
    assert quantities.number(0.0) == "0"
    assert quantities.number(math.nan) == "–"


def test_interval_of_a_person_has_one_power_of_ten():
    value = dataclasses.replace(estimate(1.24e-4), low=0.804e-4, high=1.67e-4)
    assert quantities.figures(value) == ("1.24 × 10⁻⁴", "0.80 … 1.67 × 10⁻⁴")


@pytest.mark.parametrize(
    ("status", "said"),
    [
        ("estimated", "2.500e-05 °/√h  [2.450e-05, 2.550e-05] 95 %"),
        ("upper bound", "< 2.50e-05 °/√h  (upper bound, 95 %)"),
        ("not observable", "not observable"),
    ],
)
def test_what_each_status_says(status, said):
    assert quantities.sentence(estimate(N, status=status), plain=True) == said


def test_zero_is_never_said_of_what_was_not_seen():
    for name in COEFFICIENT_NAMES:
        said = quantities.sentence(estimate(0.0, status="not observable", name=name))
        assert "0" not in said


def test_filter_figures_are_one_density_in_three_units():
    (root_hour, _), (root_hertz, _), (si, _) = quantities.kalman_figures(estimate(N))
    assert float(root_hour) == pytest.approx(2.5e-5, rel=1e-3)
    # deg/sqrt(h) to deg/h/sqrt(Hz) is 60, to rad/sqrt(s) is pi/180/60.
    assert float(root_hertz) == pytest.approx(60.0 * 2.5e-5, rel=1e-3)
    assert float(si) == pytest.approx(2.5e-5 * math.pi / 180.0 / 60.0, rel=1e-3)
    assert quantities.kalman_figures(estimate(0.0, status="not observable")) == ()


def test_curves_are_shown_in_deg_per_hour_and_tdev_in_arcsec():
    assert quantities.curve_unit("oadev").name == "deg/h"
    assert quantities.curve_unit("tdev").symbol == "″"


@pytest.mark.parametrize(
    ("amplitude", "error", "said"),
    [
        (0.0501, 2.2e-4, ("0.05010", "0.00022")),
        (0.3053, 43.0, ("0.31", "43.00")),
        (0.0, 43.0, ("0", "43")),
    ],
)
def test_an_amplitude_below_its_error_is_not_written_as_none(amplitude, error, said):
    found = dataclasses.replace(
        line("time", 7.3, amplitude), amplitude_error=error * quantities.ARCSECOND
    )
    assert quantities.line_amplitude(found) == said
