"""Parquet and Feather, files of Arrow: one column per channel, unit and kind in its metadata."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Final

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from sagnac.core.arrays import AnyArray, blocks
from sagnac.core.whole_files import replacing
from sagnac.formats import registry, statement
from sagnac.formats.source import MADE, Column, Outgoing, Pieces, Rows, Source, Stored, column
from sagnac.recording.columns import NULL_PULSE_NAME

ROWS_PER_GROUP: Final = 500_000

# ---- arrow columns -----------------------------------------------------------------


def _text_of(metadata: Mapping[bytes, bytes] | None) -> dict[str, str]:
    pairs = (metadata or {}).items()
    return {key.decode(errors="replace"): value.decode(errors="replace") for key, value in pairs}


def _is_numeric(kind: pa.DataType) -> bool:
    """Whether columns of that type hold numbers, times among them."""
    known = (pa.types.is_integer, pa.types.is_floating, pa.types.is_boolean, _is_time)
    return any(is_one(kind) for is_one in known)


def _is_time(kind: pa.DataType) -> bool:
    """Whether columns of that type hold stamps, or times since some start."""
    return bool(pa.types.is_timestamp(kind) or pa.types.is_duration(kind))


def as_numpy(values: pa.Array) -> AnyArray:
    """Numbers of an array; times as integers in their unit."""
    if _is_time(values.type):
        values = values.cast(pa.int64())
    if pa.types.is_boolean(values.type) and not values.null_count:
        # Not by a cast, which imports what takes as long as all numbers of two hours.
        bits = np.unpackbits(np.frombuffer(values.buffers()[1], dtype=np.uint8), bitorder="little")
        return bits[values.offset : values.offset + len(values)]
    if values.null_count:
        values = values.cast(pa.float64(), safe=False).fill_null(np.nan)
    # Not by `to_numpy`, which imports pandas where it is installed: half a second.
    return np.from_dlpack(values)


def _schema(heading: Outgoing) -> pa.Schema:
    """Columns with unit and kind in their metadata; what holds for all in that of the whole."""
    fields = []
    for name, unit in heading.units.items():
        metadata = {} if unit is None else {"unit": unit.name}
        if name in heading.kinds or name == "table":
            metadata["kind"] = heading.kinds.get(name, "angle")
        kind = pa.bool_() if name == NULL_PULSE_NAME else pa.float64()
        fields.append(pa.field(name, kind, metadata=metadata or None))
    stated = {"sample_rate": repr(float(heading.sample_rate)), "remark": MADE}
    return pa.schema(fields, metadata={**heading.sensors, **stated})


# ---- read --------------------------------------------------------------------------


def open_source(path: Path) -> Source:
    """Schema of the file, with what its metadata states.

    Schema metadata may hold the keys of a `Statement`; field metadata ``unit`` and
    ``kind``.

    Raises
    ------
    ValueError
        If the rows of a Parquet contradict each other.
    """
    is_feather = path.suffix.lower() in registry.FEATHER.suffixes
    if is_feather:
        with pa.memory_map(str(path)) as mapped:
            file = pa.ipc.open_file(mapped)
            schema = file.schema
            sizes = [file.get_batch(i).num_rows for i in range(file.num_record_batches)]
    else:
        with pq.ParquetFile(path) as file:
            schema = file.schema_arrow
            sizes = [file.metadata.row_group(i).num_rows for i in range(file.num_row_groups)]
            _require_sound(file.metadata, sum(sizes))

    def pieces(keys: Sequence[str], start: int, stop: int) -> Pieces:
        edges = np.concatenate(([0], np.cumsum(sizes, dtype=np.int64)))
        first = int(np.searchsorted(edges, start, side="right")) - 1
        last = int(np.searchsorted(edges, stop, side="left"))
        position = int(edges[first])
        batches = _feather_batches if is_feather else _parquet_batches
        for batch in batches(path, list(keys), range(first, last)):
            inside = slice(max(start - position, 0), max(stop - position, 0))
            yield {key: as_numpy(batch.column(key))[inside] for key in keys}
            position += batch.num_rows

    columns: list[Column] = []
    unreadable: dict[str, str] = {}
    for item in schema:
        metadata = _text_of(item.metadata)
        unit = item.type.unit if _is_time(item.type) else metadata.get("unit")
        if _is_numeric(item.type):
            columns.append(column(item.name, unit=unit, kind=metadata.get("kind")))
        else:
            unreadable[item.name] = f"holds {item.type} values"

    def load(keys: Sequence[str]) -> Stored:
        return Stored(lengths=dict.fromkeys(keys, sum(sizes)), pieces=pieces)

    stated = statement.by_attributes(_text_of(schema.metadata))
    return Source(columns=tuple(columns), load=load, stated=stated, unreadable=unreadable)


def _feather_batches(path: Path, keys: list[str], wanted: range) -> Iterator[pa.RecordBatch]:
    """Columns of those batches of a Feather."""
    with pa.memory_map(str(path)) as mapped:
        schema = pa.ipc.open_file(mapped).schema
        fields = [schema.get_field_index(key) for key in keys]
        file = pa.ipc.open_file(mapped, options=pa.ipc.IpcReadOptions(included_fields=fields))
        yield from map(file.get_batch, wanted)


def _parquet_batches(path: Path, keys: list[str], wanted: range) -> Iterator[pa.RecordBatch]:
    """Columns of those row groups of a Parquet.

    Unless told not to, the library holds the whole of every row group that it will read. Its
    threads take a third more processor time than one, and hardly less in all.
    """
    with pq.ParquetFile(
        path, pre_buffer=False, buffer_size=2**20, page_checksum_verification=True
    ) as file:
        # Rows decoded at once: half a mebibyte a column stays in cache.
        yield from file.iter_batches(2**16, row_groups=wanted, columns=keys, use_threads=False)
    # Arrow would keep what it has decoded in for the next file.
    pa.default_memory_pool().release_unused()


def _require_sound(metadata: pq.FileMetaData, rows: int) -> None:
    """Refuse a footer whose groups, columns and whole do not have the same rows.

    Raises
    ------
    ValueError
        If they have not.
    """
    for group in (metadata.row_group(place) for place in range(metadata.num_row_groups)):
        for chunk in (group.column(place) for place in range(group.num_columns)):
            name = chunk.path_in_schema
            if "." not in name and chunk.num_values != group.num_rows:
                raise ValueError(f"{name} has {chunk.num_values} values in {group.num_rows} rows")
    if rows != metadata.num_rows:
        raise ValueError(f"{metadata.num_rows} rows are claimed and {rows} are there")


# ---- write -------------------------------------------------------------------------


@contextmanager
def writer(path: Path | str, heading: Outgoing) -> Iterator[Callable[[Rows], None]]:
    """A Parquet recording written chunk by chunk; the file appears only when all is there.

    Parameters
    ----------
    path
        The file to write.
    heading
        Columns with their units and kinds, and the sample rate.

    Yields
    ------
    callable
        Adds rows: every column, (rows,), in its unit (see `Outgoing.in_units`).

    Examples
    --------
    >>> import tempfile
    >>> import numpy as np
    >>> from sagnac.core.units import UNITS
    >>> folder = tempfile.TemporaryDirectory()
    >>> path = Path(folder.name) / "run.parquet"
    >>> units = {"x": UNITS["arcsec"], "table": UNITS["deg"]}
    >>> with writer(path, Outgoing(units=units, kinds={"x": "angle"}, sample_rate=500.0)) as append:
    ...     append({"x": np.zeros(1000), "table": np.zeros(1000)})
    >>> pq.read_metadata(path).num_rows
    1000
    >>> folder.cleanup()
    """
    schema = _schema(heading)
    pending: list[pa.Table] = []

    def flush() -> None:
        if pending:
            whole = pa.concat_tables(pending).combine_chunks()
            file.write_table(whole, row_group_size=ROWS_PER_GROUP)
            pending.clear()

    def append(rows: Rows) -> None:
        pending.append(pa.table(rows).select(schema.names).cast(schema))
        if sum(table.num_rows for table in pending) >= ROWS_PER_GROUP:
            flush()

    packing = {"compression": "zstd", "use_dictionary": False, "write_page_checksum": True}
    with replacing(Path(path)) as temporary, pq.ParquetWriter(temporary, schema, **packing) as file:
        yield append
        flush()


def write(path: Path, out: Outgoing) -> None:
    """The columns with unit and kind in their metadata, the rate in the schema's."""
    if path.suffix.lower() not in registry.FEATHER.suffixes:
        with writer(path, out) as append:
            for block in blocks(out.samples, ROWS_PER_GROUP):
                append(out.rows(block))
        return
    schema = _schema(out)
    with (
        replacing(path) as temporary,
        pa.OSFile(str(temporary), "wb") as stream,
        pa.ipc.new_file(stream, schema) as file,
    ):
        for block in blocks(out.samples):
            file.write_table(pa.table(out.rows(block)).cast(schema))
