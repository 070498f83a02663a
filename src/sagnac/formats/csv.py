"""Comma, tab and semicolon separated text with ``name[unit]`` headers."""

import csv as standard_csv
import json
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
import pyarrow as pa
import pyarrow.csv as arrow_csv
from numpy.typing import NDArray

from sagnac import series
from sagnac.errors import RecordingError
from sagnac.formats.source import Outgoing, Source, Stored, column, damaged, in_memory, replacing

FORMAT: Final = "CSV"
SUFFIXES: Final = (".csv", ".tsv", ".txt")

_DELIMITERS: Final = (",", "\t", ";", " ")
_HEAD_BYTES: Final = 1 << 16


def open_source(path: Path) -> Source:
    """Header of the file; columns of a file without one are called ``1``, ``2``, ...

    Lines before the header that start with ``#`` or ``%`` are passed over.

    Raises
    ------
    RecordingError
        If the file is not text or has no lines.
    """
    with path.open("rb") as stream:
        head = stream.read(_HEAD_BYTES)
        stream.seek(-1, 2)
        ends_in_newline = stream.read(1) in (b"\n", b"\r")
    if b"\0" in head:
        raise RecordingError(
            f"{path}: holds binary data, not text; give it the suffix of its own format"
        )
    lines = head.decode("utf-8-sig", errors="replace").splitlines()
    first = next(
        (i for i, line in enumerate(lines) if line.strip() and line.lstrip()[0] not in "#%"), None
    )
    if first is None:
        raise RecordingError(f"{path}: has no header line; it must start with one like x[arcsec]")
    header = lines[first]
    second = next((line for line in lines[first + 1 :] if line.strip()), "")
    delimiter = "\t" if path.suffix.lower() == ".tsv" else max(_DELIMITERS, key=header.count)
    fields = [item.strip() for item in next(standard_csv.reader([header], delimiter=delimiter))]
    headless = all(_is_number(item) for item in fields)
    if headless:
        second = header
    names = [str(index) for index in range(1, len(fields) + 1)] if headless else fields
    repeated = next((name for name in names if name and names.count(name) > 1), None)
    if repeated is not None:
        raise RecordingError(f"{path}: {repeated}: two columns have this name; rename one")
    decimal_comma = delimiter == ";" and "," in second

    def load(keys: Sequence[str]) -> Stored:
        if not second:
            return in_memory({key: np.empty(0) for key in keys})
        with damaged(path, FORMAT):
            # Streamed: parsing the file whole takes twice the memory and saves no time.
            reader = arrow_csv.open_csv(
                path,
                read_options=arrow_csv.ReadOptions(
                    column_names=[name or f"unnamed {i}" for i, name in enumerate(names)],
                    skip_rows=first + (0 if headless else 1),
                    block_size=1 << 20,
                ),
                parse_options=arrow_csv.ParseOptions(delimiter=delimiter),
                convert_options=arrow_csv.ConvertOptions(
                    include_columns=list(keys),
                    column_types={key: pa.float64() for key in keys},
                    decimal_point="," if decimal_comma else ".",
                    true_values=[],
                    false_values=[],
                ),
            )
            arrays = _filled(reader, list(keys), path.stat().st_size // max(1, len(second)))
        if not ends_in_newline and names[-1] in arrays:
            _check_last(path, names[-1], arrays[names[-1]])
        return in_memory(arrays)

    return Source(
        format=FORMAT,
        columns=tuple(column(name) for name in names if name),
        load=load,
        notes=() if ends_in_newline else ("the last line has no line end: it may be cut off",),
    )


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


def _check_last(path: Path, name: str, values: NDArray[Any]) -> None:
    """Refuse a last number that is cut short: it leaps twice as far as any shortly before.

    Raises
    ------
    RecordingError
        If it does.
    """
    steps = np.abs(np.diff(values[-1000:]))
    if steps.size > 1 and steps[-1] > 2.0 * steps[:-1].max():
        raise RecordingError(
            f"{path}: {name}: the last line is cut off; remove it, or get the file again from its "
            "source"
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
            for columns in out.spans(series.SPAN):
                arrow_csv.write_csv(pa.table(columns), stream, options)
