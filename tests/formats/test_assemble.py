"""Whole recordings, also those longer than memory should hold."""

from dataclasses import replace
from itertools import product
from pathlib import Path

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from sagnac.core import arrays
from sagnac.core.errors import RecordingError
from sagnac.formats import Statement, arrow, read, write
from sagnac.formats.assemble import check_lengths
from tests.formats.examples import (
    ARCSECOND,
    SAMPLES,
    SUFFIXES,
    example,
    refused,
    save,
    text,
    timed,
    walk,
)

LONG = 3000


STATED = {
    "whole": {"time": "time:ns"},
    "from a stamp": {"time": "time:ns", "span": (17.03, None)},
    "between stamps": {"time": "uneven:s", "span": (3.0, 41.7)},
    "uneven stamps": {"time": "uneven:s"},
    "between samples": {"time": "none", "sample_rate": 50.0, "span": (0.51, 59.0)},
}


def long_columns() -> dict[str, np.ndarray]:
    """Everything that is done to a column on reading, across any border of spans."""
    counts = np.rint(np.linspace(0.0, 5.3 * 2**16, LONG) + 10.0 * walk(1, LONG))
    return {
        "time": 1_700_000_000 * 10**9 + 20_000_000 * np.arange(LONG, dtype=np.int64),
        "uneven": 5.0 + np.arange(LONG) / 50.0 + np.random.default_rng(9).uniform(0, 0.004, LONG),
        "x": ((counts + 2**15) % 2**16 - 2**15).astype(np.int32),
        "z": 3e4 * walk(2, LONG),
        "table": (7.3 * np.arange(LONG) + walk(3, LONG)) % 360.0,
        "null": (np.arange(LONG) % 100 >= 97).astype(np.uint8),
    }


def long_file(path: Path, layout: str) -> Path:
    columns = long_columns()
    if path.suffix == ".parquet":
        rows = LONG if layout == "one piece" else 700
        pq.write_table(pa.table(columns), path, row_group_size=rows)
    elif path.suffix == ".h5":
        with h5py.File(path, "w") as file:
            matrix = np.column_stack([columns.pop("z"), columns.pop("table")])
            chunks = {} if layout == "one piece" else {"chunks": (128, 1), "compression": "gzip"}
            file.create_dataset("m", data=matrix, **chunks)
            for name, values in columns.items():
                chunks = {} if layout == "one piece" else {"chunks": (300,), "compression": "gzip"}
                file.create_dataset(name, data=values, **chunks)
    elif path.suffix == ".npz":
        np.savez(path, **columns)
    else:
        save(path, text(",".join(columns), *columns.values()))
    return path


def test_data_that_are_not_sound(tmp_path):
    values = walk()
    values[200] = np.inf
    refused(timed(tmp_path / "inf.csv", values), "x:", "1 sample", "2.000 s")
    times = np.arange(SAMPLES) / 100.0
    times[300:] -= 1.0
    refused(timed(tmp_path / "back.csv", walk(), times), "time", "backwards", "2.990 s", "--time")
    values = walk()
    values[200:400] = values[200]
    refused(timed(tmp_path / "stuck.csv", values), "x:", "stuck", "2.000 s", "--slice")
    refused(timed(tmp_path / "few.csv", walk(samples=5)), "5 samples", "too few")
    refused(save(tmp_path / "head.csv", "time[s],x[arcsec]\n"), "too few", "longer")


@pytest.mark.usefixtures("trusted_hdf5")
@pytest.mark.parametrize(
    ("suffix", "layout"),
    [
        *product(["parquet", "h5"], ["one piece", "in pieces"]),
        ("npz", "one piece"),
        ("csv", "one piece"),
    ],
)
@pytest.mark.parametrize("stated", STATED)
def test_long_recordings_are_read_span_by_span(tmp_path, monkeypatch, suffix, layout, stated):
    path = long_file(tmp_path / f"run.{suffix}", layout)
    statement = Statement(
        kind="angle",
        unit={"x": "0.5arcsec", "z": "arcsec", "table": "deg"},
        null_pulse="null",
        columns={"x": "x", "z": "m.1", "table": "m.2"} if suffix == "h5" else {"x": "x", "z": "z"},
        **STATED[stated],
    )
    rolled = replace(statement, gyros=("x",), counter_bits=16)
    once = [read(path, one) for one in (statement, rolled)]
    monkeypatch.setattr(arrays, "IN_MEMORY", 0)
    for length in (97, 700):
        monkeypatch.setattr(arrays, "BLOCK", length)
        for one, recording in zip((statement, rolled), once, strict=True):
            back = read(path, one)
            assert back.notes == recording.notes
            assert back.sample_rate == recording.sample_rate
            assert back.provenance == recording.provenance
            read_channels = (*recording.gyros, recording.table)
            for channel, other in zip((*back.gyros, back.table), read_channels, strict=True):
                assert arrays.is_mapped(channel.values)
                assert (channel.name, channel.kind, channel.shown_in) == (
                    other.name,
                    other.kind,
                    other.shown_in,
                )
                np.testing.assert_array_equal(channel.values, other.values)
            np.testing.assert_array_equal(back.null_pulse, recording.null_pulse)
            assert (back.times is None) == (recording.times is None) == ("uneven" not in str(one))
            if back.times is not None:
                np.testing.assert_array_equal(back.times, recording.times)
    # And both are right: the table and the counter without their wraps.
    columns = long_columns()
    span = slice(*(round(50.0 * edge) if edge else None for edge in (one.span or (None, None))))
    if once[0].times is None:
        table = np.unwrap(np.deg2rad(columns["table"]))[span]
        assert once[0].table.values - once[0].table.values[0] == pytest.approx(
            table - table[0], abs=1e-9
        )
        counts = np.unwrap(columns["x"], period=2**16)[span] * 0.5 * ARCSECOND
        assert once[1].gyros[0].values - once[1].gyros[0].values[0] == pytest.approx(
            counts - counts[0], abs=1e-12
        )


def test_only_what_a_slice_needs_is_read(tmp_path):
    columns = long_columns()
    taken = slice(1500, 1600)
    pq.write_table(pa.table(columns), tmp_path / "run.parquet", row_group_size=500)
    metadata = pq.read_metadata(tmp_path / "run.parquet")
    spoilt = bytearray((tmp_path / "run.parquet").read_bytes())
    for group in range(metadata.num_row_groups):
        for number in range(metadata.num_columns):
            chunk = metadata.row_group(group).column(number)
            if (group, chunk.path_in_schema) != (3, "z"):
                first = chunk.dictionary_page_offset or chunk.data_page_offset
                spoilt[first : first + chunk.total_compressed_size] = bytes(
                    chunk.total_compressed_size
                )
    (tmp_path / "run.parquet").write_bytes(spoilt)
    with h5py.File(tmp_path / "run.h5", "w") as file:
        file.create_dataset("z", data=columns["z"], chunks=(500,), compression="gzip")
        file.create_dataset("x", data=columns["x"], chunks=(500,), compression="gzip")
        chunks = [
            (name, file[name].id.get_chunk_info(number))
            for name in ("x", "z")
            for number in range(6)
        ]
    spoilt = bytearray((tmp_path / "run.h5").read_bytes())
    for name, chunk in chunks:
        if (name, chunk.chunk_offset) != ("z", (1500,)):
            spoilt[chunk.byte_offset : chunk.byte_offset + chunk.size] = bytes(chunk.size)
    (tmp_path / "run.h5").write_bytes(spoilt)
    stated = Statement(kind="angle", unit="arcsec", sample_rate=50.0, gyros=("z",))
    for name in ("run.parquet", "run.h5"):
        sliced = replace(stated, span=(30.0, 32.0), time="none", table="none")
        values = read(tmp_path / name, sliced).gyros[0].values
        np.testing.assert_allclose(values, columns["z"][taken] * ARCSECOND, rtol=1e-15)
        assert values.base is None or values.base.size == 100
        refused(tmp_path / name, "damaged", statement=replace(sliced, span=None))


def test_missing_samples_and_integers_in_different_pieces(tmp_path, monkeypatch):
    big = 2**53 + 2 * np.arange(LONG)
    table = pa.table({"x": pa.array([None if i == 900 else int(v) for i, v in enumerate(big)])})
    pq.write_table(table, tmp_path / "run.parquet", row_group_size=700)
    stated = Statement(kind="angle", unit="rad", sample_rate=1.0)
    monkeypatch.setattr(arrays, "IN_MEMORY", 0)
    monkeypatch.setattr(arrays, "BLOCK", 100)
    values = read(tmp_path / "run.parquet", stated, verify=False).gyros[0].values
    expected = big.astype(float)
    expected[900] = np.nan
    np.testing.assert_array_equal(values, expected)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_long_recordings_are_written_span_by_span(tmp_path, monkeypatch, suffix):
    recording = example(times=True)
    whole = read(write(recording, tmp_path / f"whole.{suffix}"))
    monkeypatch.setattr(arrays, "IN_MEMORY", 0)
    monkeypatch.setattr(arrays, "BLOCK", 97)
    monkeypatch.setattr(arrow, "ROWS_PER_GROUP", 97)
    back = read(write(whole, tmp_path / f"spans.{suffix}"))
    assert back.sample_rate == whole.sample_rate
    np.testing.assert_array_equal(back.times, whole.times)
    np.testing.assert_array_equal(back.null_pulse, whole.null_pulse)
    for gyro, other in zip((*back.gyros, back.table), (*whole.gyros, whole.table), strict=True):
        np.testing.assert_allclose(gyro.values, other.values, rtol=1e-15, atol=1e-24)


def test_columns_have_one_length():
    check_lengths({"x": 5, "z": 5})
    with pytest.raises(RecordingError, match="z: has 4 samples but x has 5"):
        check_lengths({"x": 5, "z": 4})
