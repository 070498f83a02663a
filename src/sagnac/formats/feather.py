"""Feather, the file of Arrow: one column per channel, unit and kind in its metadata.

Parquet shares the columns of an Arrow schema.
"""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from sagnac.formats.files import damaged, replacing
from sagnac.formats.registry import FEATHER
from sagnac.formats.source import MADE, Column, Outgoing, Rows, Source, Stored, column
from sagnac.formats.statement import by_attributes
from sagnac.recording.columns import NULL_PULSE_NAME

# ---- arrow columns -----------------------------------------------------------------


def text_of(metadata: Mapping[bytes, bytes] | None) -> dict[str, str]:
    """Metadata as text."""
    return {
        key.decode(errors="replace"): value.decode(errors="replace")
        for key, value in (metadata or {}).items()
    }


def is_numeric(kind: pa.DataType) -> bool:
    """Whether columns of that type hold numbers, times among them."""
    return bool(
        pa.types.is_integer(kind)
        or pa.types.is_floating(kind)
        or pa.types.is_boolean(kind)
        or pa.types.is_timestamp(kind)
    )


def column_of(item: pa.Field) -> Column:
    """A field with the unit and kind that its metadata states."""
    metadata = text_of(item.metadata)
    unit = item.type.unit if pa.types.is_timestamp(item.type) else metadata.get("unit")
    return column(item.name, unit=unit, kind=metadata.get("kind"))


def as_numpy(values: pa.Array) -> NDArray[Any]:
    """Numbers of an array; times as integers in their unit."""
    if pa.types.is_timestamp(values.type):
        values = values.cast(pa.int64())
    if pa.types.is_boolean(values.type) and not values.null_count:
        # A bit each. A cast would import what computes on arrays: a twentieth of a second.
        bits = np.frombuffer(values.buffers()[1], dtype=np.uint8)
        ones = np.unpackbits(bits, bitorder="little")
        return ones[values.offset : values.offset + len(values)]
    if pa.types.is_boolean(values.type):
        values = values.cast(pa.uint8())
    if values.null_count:
        values = values.cast(pa.float64(), safe=False).fill_null(np.nan)
    # Not by `to_numpy`, which imports pandas where it is installed: half a second.
    return np.from_dlpack(values)


# ---- feather -----------------------------------------------------------------------


def open_source(path: Path) -> Source:
    """Schema of the file, with what its metadata states, as in Parquet.

    Raises
    ------
    RecordingError
        If the file is not Feather (version 2) or is cut off.
    """
    with damaged(FEATHER.name), pa.memory_map(str(path)) as mapped:
        file = pa.ipc.open_file(mapped)
        schema = file.schema
        sizes = [file.get_batch(i).num_rows for i in range(file.num_record_batches)]
        stated = text_of(schema.metadata)
        columns = tuple(column_of(item) for item in schema if is_numeric(item.type))
    edges = np.concatenate(([0], np.cumsum(sizes, dtype=np.int64)))

    def pieces(keys: Sequence[str], start: int, stop: int) -> Iterator[dict[str, NDArray[Any]]]:
        with damaged(FEATHER.name), pa.memory_map(str(path)) as mapped:
            file = pa.ipc.open_file(
                mapped,
                options=pa.ipc.IpcReadOptions(
                    included_fields=[schema.get_field_index(key) for key in keys]
                ),
            )
            for number, begin in enumerate(edges[:-1].tolist()):
                if begin >= stop or edges[number + 1] <= start:
                    continue
                batch = file.get_batch(number)
                inside = slice(max(start - begin, 0), stop - begin)
                yield {key: as_numpy(batch.column(key))[inside] for key in keys}

    def load(keys: Sequence[str]) -> Stored:
        return Stored(lengths=dict.fromkeys(keys, int(edges[-1])), pieces=pieces)

    return Source(
        format=FEATHER.name,
        columns=columns,
        load=load,
        stated=by_attributes(stated),
    )


def write(path: Path, out: Outgoing) -> None:
    """The columns with unit and kind in their metadata, the rate in the schema's."""
    fields = []
    for name in out.columns:
        kind = pa.uint8() if name == NULL_PULSE_NAME else pa.float64()
        metadata = {"unit": out.units[name]} if name in out.units else {}
        if name in out.kinds:
            metadata["kind"] = out.kinds[name]
        fields.append(pa.field(name, kind, metadata=metadata or None))
    schema = pa.schema(
        fields, metadata={**out.sensors, "sample_rate": repr(out.sample_rate), "remark": MADE}
    )
    with (
        replacing(path) as temporary,
        pa.OSFile(str(temporary), "wb") as stream,
        pa.ipc.new_file(stream, schema) as writer,
    ):

        def append(_: int, rows: Rows) -> None:
            arrays = [pa.array(rows[item.name], type=item.type) for item in schema]
            writer.write_batch(pa.RecordBatch.from_arrays(arrays, schema=schema))

        out.write_blocks(append)
