"""Numbers that tables, figures and page of the reproduction share."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from sagnac.paper import tables as values
from sagnac.paper.prediction import TABLE_1
from sagnac.paper.reproduce import Cell


def test_a_white_rate_falls_with_the_root_of_time():
    # 1 deg/sqrt(h) is 60 deg/h at one second.
    assert values.white_deviation(1.0, np.array([1.0, 4.0])) == pytest.approx([60.0, 30.0])


def test_of_nothing_there_is_no_mean_and_no_spread():
    assert math.isnan(values.mean([]))
    assert values.mean(iter([1.0, 3.0])) == 2.0
    assert values.spread([]) == "–"
    assert values.spread([2.0]) == "2.00"
    assert values.spread([3.0, 1.0, 2.0]) == "1.00 … 3.00"


def cells(by_paper, as_printed):
    """Cells of Table 1 whose truth is 2, with N by plain squares in both orders."""

    def outcome(value):
        return SimpleNamespace(truth_deg_per_sqrt_h=2.0, readings={"plain": value})

    return [
        Cell(rate, day, published, outcome(2.0), outcome(by_paper), outcome(as_printed))
        for rate, days in TABLE_1.items()
        for day, published in enumerate(days, start=1)
    ]


def test_the_papers_check_of_validity_is_that_of_its_table():
    """Mean of its twelve cells on the turning table over that of the three at rest: 1.07."""
    found = cells(2.0, 2.0)
    assert values.turning_over_rest(found, lambda one: one.published) == pytest.approx(
        1.071, abs=5e-4
    )
    known = values.turning_over_rest(found, lambda one: one.rate or math.nan)
    assert math.isnan(known)


def test_errors_of_a_reading_are_of_the_turning_cells():
    found = cells(2.2, math.nan)
    errors = values.errors_of_reading(found, "by_paper", "plain")
    assert (errors.mean, errors.rms) == pytest.approx((0.1, 0.1))
    assert (errors.shown, errors.cells) == (12, 12)
    lacking = values.errors_of_reading(found, "as_printed", "plain")
    assert math.isnan(lacking.mean)
    assert (lacking.shown, lacking.cells) == (0, 12)
