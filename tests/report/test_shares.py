"""Scale factor and axes as terminal and page say them."""

from dataclasses import replace

import numpy as np
import pytest

from sagnac.analysis.json_data import triad_data
from sagnac.analysis.table_shares import Share, Triad
from sagnac.noise.estimates import Interval
from sagnac.report import text
from sagnac.report.page import page
from sagnac.report.sections import share_remarks, share_rows, with_interval
from tests.handmade import analysis
from tests.report.examples import checked


def interval(value, width):
    return Interval(value=value, low=value - width, high=value + width)


def share(value, **others):
    told = {"bias": None, "asymmetry": None, **others}
    return Share(share=interval(value, 2e-6), confidence=0.95, **told)


def triad():
    return replace(
        analysis(gyros=("x", "y", "z")),
        shares={
            name: share(value) for name, value in zip("xyz", (0.577, 0.578, 0.579), strict=True)
        },
        triad=Triad(
            scale=interval(1.0001, 2e-6),
            angles={name: interval(np.radians(54.7), 1e-5) for name in "xyz"},
        ),
    )


def test_a_value_has_the_digits_of_its_interval():
    assert with_interval(interval(-1.00612, 0.00031)) == "-1.00612 [-1.00643, -1.00581]"
    assert with_interval(interval(2e-6, 1e-6), 1e-6) == "2.0 [1.0, 3.0]"
    assert with_interval(None) == ""


@pytest.mark.usefixtures("blank_figures")
def test_terminal_and_page_show_a_triad():
    of = triad()
    shown = text.shares(of)
    assert "0.5770000 [0.5769980, 0.5770020]" in shown
    assert "54.70000 [54.69943, 54.70057]" in shown
    assert "asymmetry" not in shown.splitlines()[0]
    assert "Common scale factor 1.0001000 [1.0000980, 1.0001020]" in shown
    assert "holds the gyro's bias and the Earth's rate" in " ".join(shown.split())
    said = " ".join(checked(page(of)).text)
    assert "Scale factor and axes" in said
    assert "54.70000 [54.69943, 54.70057]" in said
    assert triad_data(of)["angles_deg"]["x"]["value"] == pytest.approx(54.7)


def test_one_axis_has_an_angle_only_if_its_scale_factor_could_be_one():
    one = replace(analysis(gyros=("z",)), shares={"z": share(-0.999)})
    (row,) = share_rows(one)
    # arccos(-0.999) is 177.4374 deg.
    assert row[2].startswith("177.43")
    assert share_remarks(one)[0] == "Angle to the table's axis if the scale factor is exactly 1."
    more = replace(one, shares={"z": share(-1.006)})
    assert share_rows(more)[0][2] == ""


def test_both_ways_at_two_speeds_everything_is_told():
    hour = np.radians(1.0) / 3600.0
    told = share(1.0, bias=interval(0.5 * hour, 0.01 * hour), asymmetry=interval(3e-6, 1e-6))
    (row,) = share_rows(replace(analysis(gyros=("z",)), shares={"z": told}))
    assert row[3:] == ("3.00 [2.00, 4.00]", "0.5000 [0.4900, 0.5100]")


def test_a_table_that_turns_one_way_at_several_rates_is_not_said_to_turn_both():
    one = {"z": share(1.0, bias=interval(2e-5, 1e-6))}
    said = share_remarks(replace(analysis(gyros=("z",)), shares=one))[1]
    assert said == "An asymmetry is told on a table that turns both ways at several speeds alone."


@pytest.mark.usefixtures("blank_figures")
def test_at_rest_nothing_is_said():
    at_rest = analysis(table_rate=None)
    assert text.shares(at_rest) == ""
    assert "Scale factor and axes" not in page(at_rest)
    assert triad_data(at_rest) is None
