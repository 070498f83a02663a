"""Numbers that tables, figures and page of the reproduction share."""

import math

import numpy as np
import pytest

from sagnac.report import reproduction_values as values


def test_a_white_rate_falls_with_the_root_of_time():
    # 1 deg/sqrt(h) is 60 deg/h at one second.
    assert values.white_deviation(1.0, np.array([1.0, 4.0])) == pytest.approx([60.0, 30.0])


def test_of_nothing_there_is_no_mean_and_no_spread():
    assert math.isnan(values.mean([]))
    assert values.mean(iter([1.0, 3.0])) == 2.0
    assert values.spread([]) == "–"
    assert values.spread([2.0]) == "2.00"
    assert values.spread([3.0, 1.0, 2.0]) == "1.00 … 3.00"
