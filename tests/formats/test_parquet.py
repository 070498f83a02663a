"""Parquet: metadata, and the writer for long runs."""

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from sagnac.core.units import UNITS
from sagnac.formats import Statement, arrow, read, write
from sagnac.formats.source import Outgoing
from tests.formats.examples import ARCSECOND, SAMPLES, example, refused, walk

pytestmark = pytest.mark.usefixtures("trusted_hdf5")


def test_parquet_metadata_and_hdf5_attributes_state_everything(tmp_path):
    x = walk()
    field = pa.field("x", pa.float64(), metadata={"unit": "arcsec", "kind": "increment"})
    schema = pa.schema([field], metadata={"sample_rate": "250"})
    pq.write_table(pa.table([pa.array(x)], schema=schema), tmp_path / "run.parquet")
    with h5py.File(tmp_path / "run.h5", "w") as file:
        group = file.create_group("imu")
        group.attrs["sample_rate"] = 250.0
        group.attrs["kind"] = "increment"
        group.create_dataset("x", data=x).attrs["units"] = "arcsec"
    for name in ("run.parquet", "run.h5"):
        recording = read(tmp_path / name)
        assert recording.gyros[0].kind == "increment"
        assert recording.sample_rate == 250.0
        np.testing.assert_allclose(recording.gyros[0].values, ARCSECOND * x, rtol=1e-14)


def test_parquet_time_stamps_and_missing_samples(tmp_path):
    x = walk()
    stamps = (1_700_000_000 * 10**9 + 10_000_000 * np.arange(SAMPLES)).astype("datetime64[ns]")
    table = pa.table({"time": stamps, "x[arcsec]": x})
    pq.write_table(table, tmp_path / "run.parquet")
    recording = read(tmp_path / "run.parquet", Statement(kind="angle"))
    assert recording.sample_rate == 100.0
    assert recording.times is None
    missing = table.set_column(1, "x[arcsec]", pa.array([None, *map(int, 1e3 * x[1:])]))
    pq.write_table(missing, tmp_path / "null.parquet", row_group_size=100)
    refused(tmp_path / "null.parquet", "x:", "1 sample NaN", "--slice")


def test_parquet_in_chunks_is_the_recording_written_whole(tmp_path, monkeypatch):
    monkeypatch.setattr(arrow, "ROWS_PER_GROUP", 100)
    recording = example()
    kinds = {gyro.name: gyro.kind for gyro in recording.gyros}
    path = tmp_path / "run.parquet"
    units = {**dict.fromkeys(kinds, UNITS["arcsec"]), "table": UNITS["deg"], "null_pulse": None}
    heading = Outgoing(units=units, kinds=kinds, sample_rate=50.0)
    with arrow.writer(path, heading) as append:
        for start in range(0, SAMPLES, 70):
            part = slice(start, start + 70)
            chunk = {gyro.name: gyro.values[part] for gyro in recording.gyros}
            chunk |= {
                "table": recording.table.values[part],
                "null_pulse": recording.null_pulse[part],
            }
            append(heading.in_units(chunk))
        assert not path.exists()
    assert pq.ParquetFile(path).num_row_groups > 3
    chunked, whole = read(path), read(write(recording, tmp_path / "whole.parquet"))
    for one, other in zip(
        (*chunked.gyros, chunked.table), (*whole.gyros, whole.table), strict=True
    ):
        np.testing.assert_array_equal(one.values, other.values)


def test_parquet_writer_leaves_nothing_after_an_error(tmp_path):
    heading = Outgoing(units={"x": UNITS["arcsec"]}, kinds={"x": "angle"}, sample_rate=1.0)
    writer = arrow.writer(tmp_path / "run.parquet", heading)

    def fill() -> None:
        with writer as append:
            append({"x": np.zeros(10)})
            append({"y": np.zeros(10)})

    with pytest.raises(KeyError, match="x"):
        fill()
    assert list(tmp_path.iterdir()) == []
