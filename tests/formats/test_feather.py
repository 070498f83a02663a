"""Feather."""

import numpy as np
import pyarrow as pa
import pyarrow.feather

from sagnac.formats import read


def test_a_slice_over_several_batches(tmp_path):
    values = np.arange(1000.0)
    path = tmp_path / "run.arrow"
    table = pa.table({"x": values, "other": values})
    with pa.OSFile(str(path), "wb") as stream, pa.ipc.new_file(stream, table.schema) as writer:
        writer.write_table(table, max_chunksize=64)
    part = read(path, kind="angle", unit="rad", sample_rate=10.0, span=(5.0, 30.0))
    np.testing.assert_array_equal(part.gyros[0].values, values[50:300])
