"""Parquet: one column per channel, unit and kind in its metadata; a writer for long runs."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import Any, Final, Self

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from sagnac.arrays import BLOCK
from sagnac.formats.feather import as_numpy, column_of, is_numeric, text_of
from sagnac.formats.files import damaged, replacing
from sagnac.formats.registry import PARQUET
from sagnac.formats.source import MADE, Outgoing, Rows, Source, Stored, check_name
from sagnac.formats.statement import by_attributes
from sagnac.recording.channel import PICKOFF, Kind, field_unit, quantity_of
from sagnac.recording.columns import TEMPERATURE
from sagnac.units import Sensor, unit_of

ROWS_PER_GROUP: Final = 500_000
_BUFFER: Final = 2**20  # bytes


def open_source(path: Path) -> Source:
    """Schema of the file, with what its metadata states.

    Schema metadata may hold the keys of a `Statement`; field metadata ``unit`` and
    ``kind``.

    Raises
    ------
    RecordingError
        If the file is not Parquet or is cut off.
    """
    with damaged(PARQUET.name):
        with pq.ParquetFile(path) as file:
            schema = file.schema_arrow
            _require_sound(file.metadata, path)
        stated = text_of(schema.metadata)
        columns = tuple(column_of(item) for item in schema if is_numeric(item.type))

    def pieces(keys: Sequence[str], start: int, stop: int) -> Iterator[dict[str, NDArray[Any]]]:
        # Unless told not to, the library holds the whole of every row group that it will read.
        with (
            damaged(PARQUET.name),
            pq.ParquetFile(
                path, pre_buffer=False, buffer_size=_BUFFER, page_checksum_verification=True
            ) as file,
        ):
            yield from _pieces(file, keys, start, stop)

    def load(keys: Sequence[str]) -> Stored:
        with damaged(PARQUET.name):
            rows = pq.read_metadata(path).num_rows
        return Stored(lengths=dict.fromkeys(keys, rows), pieces=pieces)

    return Source(
        format=PARQUET.name,
        unreadable={
            item.name: f"holds {item.type} values" for item in schema if not is_numeric(item.type)
        },
        columns=columns,
        load=load,
        stated=by_attributes(stated),
    )


def _require_sound(metadata: pq.FileMetaData, path: Path) -> None:
    """Refuse a footer whose numbers of rows contradict each other.

    Raises
    ------
    ValueError
        If groups, columns and the whole do not have the same rows.
    """
    rows = 0
    for group in (metadata.row_group(place) for place in range(metadata.num_row_groups)):
        rows += group.num_rows
        for chunk in (group.column(place) for place in range(group.num_columns)):
            flat = "." not in chunk.path_in_schema
            if flat and chunk.num_values != group.num_rows:
                raise ValueError(
                    f"{chunk.path_in_schema} has {chunk.num_values} values in {group.num_rows} rows"
                )
    if rows != metadata.num_rows:
        raise ValueError(f"{metadata.num_rows} rows are claimed and {rows} are there")


def _pieces(
    file: pq.ParquetFile, keys: Sequence[str], start: int, stop: int
) -> Iterator[dict[str, NDArray[Any]]]:
    """Rows from `start` to the one before `stop`, of no more row groups than hold them."""
    sizes = [file.metadata.row_group(i).num_rows for i in range(file.num_row_groups)]
    edges = np.concatenate(([0], np.cumsum(sizes)))
    first = int(np.searchsorted(edges, start, side="right")) - 1
    last = int(np.searchsorted(edges, stop, side="left"))
    position = int(edges[first])
    for batch in file.iter_batches(
        batch_size=BLOCK, row_groups=list(range(first, last)), columns=list(keys)
    ):
        inside = slice(max(start - position, 0), stop - position)
        yield {key: as_numpy(batch.column(key))[inside] for key in keys}
        position += batch.num_rows
        if position >= stop:
            break
    # Arrow would keep what it has decoded in for the next file.
    pa.default_memory_pool().release_unused()


class Writer:
    """A Parquet recording written chunk by chunk; the file appears only when all is there.

    Parameters
    ----------
    path
        The file to write.
    kinds
        Name of a gyro or an accelerometer -> kind.
    sample_rate
        Hz.
    units
        Name -> field unit to write in (``arcsec`` for gyro angles, ``deg/h`` for rates and
        ``deg`` for the table where not given).
    table, null_pulse, times
        Which columns there will be besides the sensors.
    accelerometers
        Which of `kinds` are accelerometers.
    pickoffs
        Names of the columns of pick-offs, written as they are.

    Raises
    ------
    ValueError
        If a gyro name cannot stand in a file, or a unit is not one of its kind.

    Examples
    --------
    >>> import tempfile
    >>> import numpy as np
    >>> folder = tempfile.TemporaryDirectory()
    >>> path = Path(folder.name) / "run.parquet"
    >>> with Writer(path, kinds={"x": "angle"}, sample_rate=500.0, table=True) as out:
    ...     out.append({"x": np.zeros(1000), "table": np.zeros(1000)})  # rad
    >>> pq.read_metadata(path).num_rows
    1000
    >>> folder.cleanup()
    """

    def __init__(
        self,
        path: Path | str,
        *,
        kinds: Mapping[str, Kind],
        sample_rate: float,
        units: Mapping[str, str] | None = None,
        table: bool = False,
        null_pulse: bool = False,
        times: bool = False,
        accelerometers: Sequence[str] = (),
        pickoffs: Sequence[str] = (),
    ) -> None:
        """Lay out the schema; nothing is written before the context is entered."""
        for name in kinds:
            check_name(name)
        units = units or {}
        self._path = Path(path)
        self._scales: dict[str, float] = {}
        fields: list[pa.Field] = []
        if times:
            self._scales["time"] = 1.0
            fields.append(pa.field("time", pa.float64(), metadata={"unit": "s"}))
        all_kinds: dict[str, Kind] = {**kinds, **({"table": "angle"} if table else {})}
        for name, kind in all_kinds.items():
            stated = units.get(name)
            sensor: Sensor = "accelerometer" if name in accelerometers else "gyro"
            unit = (
                unit_of(stated, quantity_of(kind, sensor))
                if stated
                else field_unit(name, kind, sensor)
            )
            self._scales[name] = unit.size
            metadata = {"unit": unit.name, "kind": kind}
            fields.append(pa.field(name, pa.float64(), metadata=metadata))
        if null_pulse:
            fields.append(pa.field("null_pulse", pa.bool_()))
        fields += [pa.field(name, pa.float64()) for name in pickoffs]
        self._schema = pa.schema(
            fields,
            metadata={
                "gyros": ",".join(name for name in kinds if name not in accelerometers),
                **({"accelerometers": ",".join(accelerometers)} if accelerometers else {}),
                "sample_rate": repr(float(sample_rate)),
                "remark": MADE,
            },
        )
        self._pending: list[pa.Table] = []
        self._stack = ExitStack()

    def __enter__(self) -> Self:
        """Open a temporary file beside the one to write."""
        with ExitStack() as stack:
            temporary = stack.enter_context(replacing(self._path))
            self._file = stack.enter_context(
                pq.ParquetWriter(
                    temporary,
                    self._schema,
                    compression="zstd",
                    use_dictionary=False,
                    write_page_checksum=True,
                )
            )
            self._stack = stack.pop_all()
        return self

    def append(self, columns: Mapping[str, NDArray[Any]]) -> None:
        """Add rows: every column of the schema, (rows,), in SI.

        Raises
        ------
        ValueError
            If the columns are not those announced, or differ in length.
        """
        if set(columns) != set(self._schema.names):
            raise ValueError(
                f"columns {', '.join(columns)} are not those announced, "
                f"{', '.join(self._schema.names)}"
            )
        self.append_in_units(
            {
                name: values / self._scales[name] if name in self._scales else values
                for name, values in columns.items()
            }
        )

    def append_in_units(self, columns: Mapping[str, NDArray[Any]]) -> None:
        """Add rows that are in the units of the schema already."""
        arrays = [pa.array(columns[item.name], type=item.type) for item in self._schema]
        self._pending.append(pa.Table.from_arrays(arrays, schema=self._schema))
        if sum(table.num_rows for table in self._pending) >= ROWS_PER_GROUP:
            self._flush()

    def _flush(self) -> None:
        if self._pending:
            self._file.write_table(
                pa.concat_tables(self._pending).combine_chunks(), row_group_size=ROWS_PER_GROUP
            )
            self._pending.clear()

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Write what is pending and rename; after an error, leave nothing."""
        if error is not None:
            self._stack.__exit__(kind, error, trace)
            return
        with self._stack:
            self._flush()


def write(path: Path, out: Outgoing) -> None:
    """The columns with unit and kind in their metadata, the rate in the schema's."""
    with Writer(
        path,
        kinds=out.kinds,
        accelerometers=out.accelerometers,
        sample_rate=out.sample_rate,
        units=out.units,
        table="table" in out.columns,
        null_pulse="null_pulse" in out.columns,
        times="time" in out.columns,
        pickoffs=[name for name in out.columns if name.startswith(PICKOFF) or name == TEMPERATURE],
    ) as writer:

        def append(_: int, rows: Rows) -> None:
            if "null_pulse" in rows:
                rows["null_pulse"] = rows["null_pulse"].astype(np.bool_)
            writer.append_in_units(rows)

        out.write_blocks(append, length=ROWS_PER_GROUP)
