"""Feather, the file of Arrow: one column per channel, unit and kind in its metadata."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from sagnac.formats.arrow_columns import as_numpy, column_of, is_numeric, text_of
from sagnac.formats.files import damaged, replacing
from sagnac.formats.metadata import from_mapping
from sagnac.formats.outgoing import MADE, Outgoing, Rows
from sagnac.formats.registry import FEATHER
from sagnac.formats.source import Source, Stored
from sagnac.formats.statement import vocabulary
from sagnac.recording.frames import NULL_PULSE_NAME


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
        stated=from_mapping({k: v for k, v in stated.items() if k in vocabulary()}),
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
