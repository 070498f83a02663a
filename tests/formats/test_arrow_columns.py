"""Columns of Arrow as numpy arrays."""

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from sagnac.formats import read
from sagnac.formats.arrow import as_numpy


@pytest.mark.parametrize(("first", "count"), [(0, 1000), (3, 41), (8, 8), (999, 1), (5, 0)])
def test_booleans_are_the_bits_that_were_put_in_wherever_a_slice_begins(first, count):
    values = np.random.default_rng(1).random(1000) < 0.3
    found = as_numpy(pa.array(values).slice(first, count))
    assert found.tolist() == values[first : first + count].astype(int).tolist()


def test_times_since_a_start_are_stamps_in_their_unit(tmp_path):
    values = np.random.default_rng(2).standard_normal(200)
    since = pa.array(np.arange(200) * 5_000, pa.int64()).cast(pa.duration("us"))
    pq.write_table(pa.table({"t": since, "x": values}), tmp_path / "run.parquet")
    recording = read(tmp_path / "run.parquet", kind="rate", unit="deg/s", time="t")
    assert recording.sample_rate == 200.0


def test_missing_booleans_are_not_a_number():
    found = as_numpy(pa.array([True, None, False]))
    assert np.isnan(found).tolist() == [False, True, False]
    assert found[[0, 2]].tolist() == [1.0, 0.0]
