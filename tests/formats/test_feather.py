"""Feather."""

import numpy as np
import pyarrow as pa
import pyarrow.feather

from sagnac.formats import read, write
from tests.formats.examples import example, refused


def test_what_pandas_would_write(tmp_path):
    x = np.random.default_rng(1).normal(size=300)
    stamps = pa.array(np.arange(300) * 10_000, pa.timestamp("us"))
    path = tmp_path / "run.feather"
    pyarrow.feather.write_feather(pa.table({"time": stamps, "x": x}), path)
    recording = read(path, kind="rate", unit="rad/s")
    np.testing.assert_array_equal(recording.gyros[0].values, x)
    assert recording.sample_rate == 100.0


def test_a_slice_over_several_batches(tmp_path):
    values = np.arange(1000.0)
    path = tmp_path / "run.arrow"
    table = pa.table({"x": values, "other": values})
    with pa.OSFile(str(path), "wb") as stream, pa.ipc.new_file(stream, table.schema) as writer:
        writer.write_table(table, max_chunksize=64)
    part = read(path, kind="angle", unit="rad", sample_rate=10.0, span=(5.0, 30.0))
    np.testing.assert_array_equal(part.gyros[0].values, values[50:300])


def test_cut_off(tmp_path):
    whole = write(example(), tmp_path / "run.feather").read_bytes()
    path = tmp_path / "cut.feather"
    path.write_bytes(whole[: len(whole) // 2])
    refused(path, "is not Feather, or is damaged")
