"""N over parts of a record."""

import numpy as np

from sagnac.analysis.parts import over_parts
from sagnac.coefficients.mixture import Interval

RATE = 100.0


def deviation(part):
    size = float(part.std())
    return Interval(value=size, low=0.97 * size, high=1.03 * size)


def parts_of(values, whole=None):
    return over_parts(values, sample_rate=RATE, walk_of=deviation, whole=whole or deviation(values))


def test_parts_that_disagree_are_told():
    rng = np.random.default_rng(14)
    values = np.concatenate([rng.standard_normal(4000), 2.0 * rng.standard_normal(4000)])
    parts = parts_of(values)
    assert not parts.agree
    assert parts.smallest < 1.1
    assert parts.largest > 1.9
    assert [part.stop_s for part in parts.parts] == [20.0, 40.0, 60.0, 80.0]


def test_parts_of_still_noise_agree():
    assert parts_of(np.random.default_rng(14).standard_normal(8000)).agree


def test_parts_that_agree_with_each_other_and_not_with_the_whole_disagree():
    values = np.random.default_rng(14).standard_normal(8000)
    assert not parts_of(values, Interval(value=1.3, low=1.27, high=1.33)).agree
