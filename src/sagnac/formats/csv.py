"""Comma, tab and semicolon separated text with ``name[unit]`` headers."""

import csv as standard_csv
import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
import pyarrow as pa
import pyarrow.csv as arrow_csv
from numpy.typing import NDArray

from sagnac.errors import Note, RecordingError
from sagnac.formats.files import damaged, replacing
from sagnac.formats.outgoing import Outgoing
from sagnac.formats.registry import CSV
from sagnac.formats.source import Source, Stored, column, in_memory

_DELIMITERS: Final = (",", "\t", ";", " ")
_HEAD_BYTES: Final = 1 << 16


@dataclass(frozen=True, slots=True, kw_only=True)
class Layout:
    """How a text file is laid out.

    Attributes
    ----------
    names
        Of the columns; one without a name has an empty one. Those of a file without a header are
        ``1``, ``2``, ....
    delimiter
        Between two fields.
    skip
        Lines before the first row of numbers.
    first_row
        That row, empty where there is none.
    """

    names: tuple[str, ...]
    delimiter: str
    skip: int
    first_row: str

    @property
    def decimal_point(self) -> str:
        """A comma where fields are set apart by semicolons and hold commas."""
        return "," if self.delimiter == ";" and "," in self.first_row else "."


def layout(head: bytes, *, tabs: bool) -> Layout:
    """The layout of a file from its beginning.

    Lines before the header that start with ``#`` or ``%`` are passed over.

    Parameters
    ----------
    head
        The first lines of the file, whole.
    tabs
        Whether tabs are known to set fields apart; else the likeliest mark is found.

    Raises
    ------
    RecordingError
        If this is not text, has no lines, or two columns of one name.
    """
    if b"\0" in head:
        raise RecordingError(
            "holds binary data, not text", remedy="give it the suffix of its own format"
        )
    lines = head.decode("utf-8-sig", errors="replace").splitlines()
    first = next(
        (i for i, line in enumerate(lines) if line.strip() and line.lstrip()[0] not in "#%"), None
    )
    if first is None:
        raise RecordingError("has no header line", remedy="it must start with one like x[arcsec]")
    header = lines[first]
    delimiter = "\t" if tabs else max(_DELIMITERS, key=header.count)
    fields = [item.strip() for item in next(standard_csv.reader([header], delimiter=delimiter))]
    if all(_is_number(item) for item in fields):
        names = tuple(str(number) for number in range(1, len(fields) + 1))
        return Layout(names=names, delimiter=delimiter, skip=first, first_row=header)
    repeated = next((name for name in fields if name and fields.count(name) > 1), None)
    if repeated is not None:
        raise RecordingError("two columns have this name", channel=repeated, remedy="rename one")
    return Layout(
        names=tuple(fields),
        delimiter=delimiter,
        skip=first + 1,
        first_row=next((line for line in lines[first + 1 :] if line.strip()), ""),
    )


def open_source(path: Path) -> Source:
    """Columns by the header of the file.

    Raises
    ------
    RecordingError
        If the file is not text or has no lines.
    """
    with path.open("rb") as stream:
        head = stream.read(_HEAD_BYTES)
        stream.seek(-1, 2)
        ends_in_newline = stream.read(1) in (b"\n", b"\r")
    laid_out = layout(head, tabs=path.suffix.lower() == ".tsv")

    def load(keys: Sequence[str]) -> Stored:
        if not laid_out.first_row:
            return in_memory({key: np.empty(0) for key in keys})
        arrays = _parsed(path, laid_out, keys)
        last = laid_out.names[-1]
        if not ends_in_newline and last in arrays:
            check_last(last, arrays[last])
        return in_memory(arrays)

    unended = Note(text="the last line has no line end: it may be cut off", level="warning")
    return Source(
        format=CSV.name,
        columns=tuple(column(name) for name in laid_out.names if name),
        load=load,
        notes=() if ends_in_newline else (unended,),
    )


def _parsed(path: Path, laid_out: Layout, keys: Sequence[str]) -> dict[str, NDArray[Any]]:
    with damaged(CSV.name):
        # Streamed: parsing the file whole takes twice the memory and saves no time.
        reader = arrow_csv.open_csv(
            path,
            read_options=arrow_csv.ReadOptions(
                column_names=[name or f"unnamed {i}" for i, name in enumerate(laid_out.names)],
                skip_rows=laid_out.skip,
                block_size=1 << 20,
            ),
            parse_options=arrow_csv.ParseOptions(delimiter=laid_out.delimiter),
            convert_options=arrow_csv.ConvertOptions(
                include_columns=list(keys),
                column_types={key: pa.float64() for key in keys},
                decimal_point=laid_out.decimal_point,
                true_values=[],
                false_values=[],
            ),
        )
        expected = path.stat().st_size // max(1, len(laid_out.first_row))
        return _filled(reader, list(keys), expected)


def _filled(
    batches: Iterable[pa.RecordBatch], keys: Sequence[str], expected: int
) -> dict[str, NDArray[Any]]:
    """The batches one after the other in place, so that no column is in memory twice."""
    arrays = {key: np.empty(max(expected, 1)) for key in keys}
    rows = 0
    for batch in batches:
        for key in keys:
            if rows + batch.num_rows > arrays[key].size:
                arrays[key].resize((rows + batch.num_rows) * 5 // 4, refcheck=False)
            values = batch.column(key).to_numpy(zero_copy_only=False)
            arrays[key][rows : rows + batch.num_rows] = values
        rows += batch.num_rows
    for array in arrays.values():
        array.resize(rows, refcheck=False)
    return arrays


def check_last(name: str, values: NDArray[Any]) -> None:
    """Refuse a last number that is cut short: it leaps twice as far as any shortly before.

    Raises
    ------
    RecordingError
        If it does.
    """
    steps = np.abs(np.diff(values[-1000:]))
    if steps.size > 1 and steps[-1] > 2.0 * steps[:-1].max():
        raise RecordingError(
            "the last line is cut off",
            channel=name,
            remedy="remove it, or get the file again from its source",
        )


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def write(path: Path, out: Outgoing) -> None:
    """The columns with ``name[unit]`` headers, and ``FILE.toml`` stating kind and rate."""
    delimiter = "\t" if path.suffix.lower() == ".tsv" else ","
    headers = [f"{name}[{out.units[name]}]" if name in out.units else name for name in out.columns]
    statement = path.with_name(path.name + ".toml")
    with replacing(path) as temporary, replacing(statement) as temporary_statement:
        kinds = ", ".join(f"{json.dumps(name)} = {json.dumps(k)}" for name, k in out.kinds.items())
        temporary_statement.write_text(
            f"gyros = {json.dumps(list(out.kinds))}\n"
            f"kind = {{ {kinds} }}\n"
            f"sample_rate = {out.sample_rate!r}\n",
            encoding="utf-8",
        )
        with temporary.open("wb") as stream:
            stream.write((delimiter.join(headers) + "\n").encode())
            options = arrow_csv.WriteOptions(
                include_header=False, delimiter=delimiter, quoting_style="none"
            )
            out.write_blocks(lambda _, rows: arrow_csv.write_csv(pa.table(rows), stream, options))
