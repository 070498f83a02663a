"""Columns of Arrow as numpy arrays."""

import numpy as np
import pyarrow as pa
import pytest

from sagnac.formats.arrow import as_numpy


@pytest.mark.parametrize(("first", "count"), [(0, 1000), (3, 41), (8, 8), (999, 1), (5, 0)])
def test_booleans_are_the_bits_that_were_put_in_wherever_a_slice_begins(first, count):
    values = np.random.default_rng(1).random(1000) < 0.3
    found = as_numpy(pa.array(values).slice(first, count))
    assert found.tolist() == values[first : first + count].astype(int).tolist()


def test_missing_booleans_are_not_a_number():
    found = as_numpy(pa.array([True, None, False]))
    assert np.isnan(found).tolist() == [False, True, False]
    assert found[[0, 2]].tolist() == [1.0, 0.0]
