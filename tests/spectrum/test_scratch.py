"""Scratch numbers in memory and in a file are written and read alike."""

import numpy as np
import pytest

from sagnac.core import arrays
from sagnac.spectrum.transforms import scratch


@pytest.mark.parametrize("in_file", [False, True])
@pytest.mark.parametrize("dtype", [np.float64, np.complex128])
def test_blocks_come_back_from_where_they_were_written(monkeypatch, in_file, dtype):
    monkeypatch.setattr(arrays, "IN_MEMORY", 0 if in_file else 1000)
    values = np.random.default_rng(0).standard_normal((6, 9)).astype(dtype)
    with scratch(6, 9, dtype) as table:
        assert (table.file is not None) == in_file
        for rows in (slice(0, 2), slice(2, 6)):
            for columns in (slice(0, 4), slice(4, 9)):
                table.write(rows.start, columns.start, values[rows, columns])
        for rows, columns in ((slice(1, 5), slice(3, 8)), (slice(0, 6), slice(0, 9))):
            np.testing.assert_array_equal(table.read(rows, columns), values[rows, columns])


@pytest.mark.parametrize("in_file", [False, True])
def test_rows_outlive_the_scratch_as_an_array(monkeypatch, in_file):
    monkeypatch.setattr(arrays, "IN_MEMORY", 0 if in_file else 1000)
    with scratch(2, 30, np.float64) as table:
        table.write(0, 20, np.stack([np.arange(20.0, 30.0), np.arange(50.0, 60.0)]))
        table.write(0, 0, np.stack([np.arange(20.0), np.arange(30.0, 50.0)]))
        values = table.as_array(55)
    assert arrays.is_mapped(values) == in_file
    np.testing.assert_array_equal(values, np.arange(55.0))


@pytest.mark.parametrize("in_file", [False, True])
def test_numbers_of_double_precision_fit_rows_of_single(monkeypatch, in_file):
    monkeypatch.setattr(arrays, "IN_MEMORY", 0 if in_file else 1000)
    values = np.random.default_rng(1).standard_normal((3, 10))
    with scratch(3, 5, np.complex64) as table:
        table.as_real().write(0, 0, values)
        found = table.as_real().read(slice(0, 3), slice(0, 10))
    np.testing.assert_array_equal(found, values.astype(np.float32))
