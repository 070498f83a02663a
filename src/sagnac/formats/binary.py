"""Binary records of a declared layout: fields, types, byte order, sync bytes and checksum.

A TOML declares the layout, or a preset knows it.
"""

import re
import zlib
from binascii import crc_hqx
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from sagnac.core.arrays import IntegerArray, blocks
from sagnac.core.documents import ANY, NUMBER, TEXT, Schema, keep, listed, one_of, read_toml, table
from sagnac.core.errors import Note, RecordingError, counted, refusal
from sagnac.core.texts import giving
from sagnac.formats.source import Column, Pieces, Source, Stored
from sagnac.formats.statement import Statement
from sagnac.recording.columns import ACCELEROMETER_NAMES

Bytes = NDArray[np.uint8]

# ---- checksums ---------------------------------------------------------------------


# Each is over what lies between sync bytes and itself; its name says how many bits it has.
CHECKSUMS: Final[Mapping[str, Callable[[Bytes], NDArray[Any]]]] = {
    "xor8": lambda rows: np.bitwise_xor.reduce(rows, axis=1),
    "sum8": lambda rows: rows.sum(axis=1, dtype=np.uint64) & 0xFF,
    "sum16": lambda rows: rows.sum(axis=1, dtype=np.uint64) & 0xFFFF,
    # CRC-16/CCITT-FALSE: polynomial 0x1021 from 0xFFFF.
    "crc16": lambda rows: np.array([crc_hqx(row.tobytes(), 0xFFFF) for row in rows], np.uint16),
    "crc32": lambda rows: np.array([zlib.crc32(row.tobytes()) for row in rows], dtype=np.uint32),
}

# ---- layout ------------------------------------------------------------------------

_ORDERS: Final = {"little": "<", "big": ">"}
_SYNC: Final = giving("bytes of sync such as aa55")(bytes.fromhex)
_BYTES: Final[Schema] = {"type": "integer", "minimum": 0, "description": "give 0 or more"}
_KNOWN_TYPES: Final = "use f4, f8, i1 to i8, u1 to u8 or pad3"
_TYPE: Final = {**TEXT, "pattern": r"^([iu][1248]|f[48]|pad\d+)\Z", "description": _KNOWN_TYPES}
_ITEMS: Final = listed([ANY, _TYPE], "give a list of name, type and, if known, unit")
_FIELD: Final = {**_ITEMS, "minItems": 2, "maxItems": 3}
_LAYOUT: Final = {
    "fields": listed(_FIELD, 'give a list such as [["time", "f8", "s"]]'),
    "byte_order": one_of(_ORDERS),
    **dict.fromkeys(("header_bytes", "record_bytes"), _BYTES),
    "sync": ANY,
    "checksum": one_of(CHECKSUMS),
    "kind": TEXT,
    "sample_rate": NUMBER,
}


def _seven_doubles(unit: str) -> dict[str, Any]:
    fields = [["time", "f8", "s"], *([axis, "f8", unit] for axis in "xyz")]
    return {"fields": [*fields, *([a, "f8", "m/s^2"] for a in ACCELEROMETER_NAMES)], "kind": "rate"}


# Name -> layout of units that are often met: time (s), gyros x, y, z, accelerometers x, y, z.
PRESETS: Final = {"imu7-deg": _seven_doubles("deg/s"), "imu7-rad": _seven_doubles("rad/s")}


@dataclass(frozen=True, slots=True, kw_only=True)
class BinaryLayout:
    """Records of one length.

    Attributes
    ----------
    columns
        Their fields; bytes that are passed over count, but are none.
    dtype
        The record as numpy reads it, its checksum under `CHECK`.
    header_bytes
        Before the first record.
    sync
        Bytes that every record begins with.
    checksum
        Name of that at the end of every record, one of `CHECKSUMS`; empty if there is none.
    stated
        Statement of the layout about the samples.
    """

    columns: tuple[Column, ...]
    dtype: np.dtype[Any]
    header_bytes: int
    sync: bytes
    checksum: str
    stated: Statement


# Field of a record that holds its checksum; a column of that name would not be one.
CHECK: Final = "\0checksum"


def declared(layout: str | Mapping[str, Any]) -> BinaryLayout:
    """The layout that is meant.

    Parameters
    ----------
    layout
        Name of a preset, path of a TOML, or its table.

    Raises
    ------
    RecordingError
        If there is no such preset or file, or it declares what cannot be.

    Examples
    --------
    >>> declared({"fields": [["x", "i4", "0.1arcsec"]], "byte_order": "big"}).dtype["x"]
    dtype('>i4')
    >>> declared("imu7-deg").dtype.itemsize
    56
    """
    where = layout if isinstance(layout, str) else ""
    content = PRESETS.get(where, layout)
    try:
        return _of_table(read_toml(Path(content)) if isinstance(content, str) else content)
    except OSError:
        remedy = f"use one of {', '.join(PRESETS)}, or a TOML that lists the fields"
        raise RecordingError(f"layout {where!r} is not known", remedy=remedy) from None
    except ValueError as error:
        problem = f"the layout of the records: {error}"
        raise RecordingError(problem, path=where, remedy="correct it there") from None


def _of_table(content: Mapping[str, Any]) -> BinaryLayout:
    stated = content.get("layout", content)
    keep(table(_LAYOUT, needed=("fields",)), stated)
    order = _ORDERS[stated.get("byte_order", "little")]
    sync, checksum = _SYNC(str(stated.get("sync", ""))), stated.get("checksum", "")
    columns, offsets, end = [], {}, len(sync)
    for number, (word, kind, *units) in enumerate(stated["fields"], start=1):
        name, unit = str(word), str(units[0]) if units else None
        if name:
            columns.append(Column(key=name, name=name, unit=unit, number=number))
            offsets[name] = (np.dtype(f"{order}{kind}"), end)
        end += _number_in(kind)
    if len(offsets) < len(columns) or not columns:
        named = ", ".join(one.name for one in columns) or "none"
        raise refusal("fields", f"are {named}; give each a name of its own")
    check = _number_in(checksum) // 8 if checksum else 0
    size = stated.get("record_bytes", end + check)
    if size < end + check:
        raise refusal("record_bytes", f"is {size}; sync, fields and checksum take {end + check}")
    if checksum:
        offsets[CHECK] = (np.dtype(f"{order}u{check}"), size - check)
    types, places = zip(*offsets.values(), strict=True)
    record: Any = {"names": list(offsets), "formats": types, "offsets": places, "itemsize": size}
    forces = ACCELEROMETER_NAMES if set(ACCELEROMETER_NAMES) <= set(offsets) else None
    kind, rate = stated.get("kind"), stated.get("sample_rate")
    return BinaryLayout(
        columns=tuple(columns),
        dtype=np.dtype(record),
        header_bytes=stated.get("header_bytes", 0),
        sync=sync,
        checksum=checksum,
        stated=Statement(kind=kind, sample_rate=rate, accelerometers=forces),
    )


def _number_in(word: str) -> int:
    return int(re.sub(r"\D", "", word))


# ---- read --------------------------------------------------------------------------


def open_source(path: Path, layout: str | Mapping[str, Any] | None = None) -> Source:
    """Columns by the fields of the layout.

    Parameters
    ----------
    path
        Of the file.
    layout
        Name of a preset, path of a TOML, or its table.

    Raises
    ------
    RecordingError
        If no layout is declared, it cannot be, or the file holds no record of it.
    """
    if layout is None:
        remedy = "state {layout NAME}, a preset or a TOML that lists the fields"
        raise RecordingError("is binary and its layout is not declared", remedy=remedy)
    laid_out = declared(layout)
    length = laid_out.dtype.itemsize
    content: Bytes = np.memmap(path, dtype=np.uint8, mode="r")[laid_out.header_bytes :]
    records, rest = divmod(content.size, length)
    if records == 0:
        remedy = "state the right {layout}"
        raise RecordingError(f"is shorter than one record of {length} bytes", remedy=remedy)
    starts: IntegerArray | None = None
    problem = f"{counted(rest, 'byte')} behind the last record: it may be cut off" if rest else ""
    if laid_out.sync or laid_out.checksum:
        starts, problem = _found(content, laid_out)
        records = starts.size
        if records == 0:
            problem = "holds no record with these sync bytes and this checksum"
            raise RecordingError(problem, remedy="state the right {layout}")

    def pieces(keys: Sequence[str], start: int, stop: int) -> Pieces:
        for block in blocks(stop, start=start):
            if starts is None:
                rows = content[block.start * length : block.stop * length].view(laid_out.dtype)
            else:
                rows = _records(content, starts[block], laid_out.dtype)
            yield {key: np.ascontiguousarray(rows[key]) for key in keys}

    def load(keys: Sequence[str]) -> Stored:
        return Stored(lengths=dict.fromkeys(keys, records), pieces=pieces)

    notes = (Note(text=problem, level="warning"),) if problem else ()
    return Source(columns=laid_out.columns, load=load, stated=laid_out.stated, notes=notes)


def _records(content: Bytes, starts: IntegerArray, dtype: np.dtype[Any]) -> NDArray[Any]:
    """Records that start there, (records,)."""
    rows = np.ascontiguousarray(content[starts[:, np.newaxis] + np.arange(dtype.itemsize)])
    return rows.view(dtype)[:, 0]


def _found(content: Bytes, laid_out: BinaryLayout) -> tuple[IntegerArray, str]:
    """Where the records with right sync bytes and checksums start, and what lies between them."""
    length, found, wrong = laid_out.dtype.itemsize, [np.empty(0, np.int64)], 0
    # Looked through in parts of 16 MiB; a record that begins in one may end in the next.
    for part in blocks(content.size - length + 1, 1 << 24):
        places = _places(content, laid_out, part)
        for some in blocks(places.size):
            is_right = _are_right(_records(content, places[some], laid_out.dtype), laid_out)
            wrong += int(np.count_nonzero(~is_right))
            found.append(places[some][is_right])
    starts = _apart(np.concatenate(found), length)
    between = content.size - starts.size * length
    problem = f"{counted(between, 'byte')} belong to no record and are left out"
    problem += f"; {counted(wrong, 'checksum')} did not match" if wrong else ""
    return starts, problem if between else ""


def _places(content: Bytes, laid_out: BinaryLayout, part: slice) -> IntegerArray:
    """Places in a part where the sync bytes stand, or a record could."""
    if not laid_out.sync:
        length = laid_out.dtype.itemsize
        return np.arange(part.start + -part.start % length, part.stop, length)
    is_sync = np.ones(part.stop - part.start, dtype=np.bool_)
    for place, value in enumerate(laid_out.sync):
        is_sync &= content[part.start + place : part.stop + place] == value
    return np.asarray(np.flatnonzero(is_sync) + part.start)


def _are_right(records: NDArray[Any], laid_out: BinaryLayout) -> Any:
    """Whether the checksums of records match, (records,) bool."""
    if not laid_out.checksum or not records.size:
        return np.ones(records.size, dtype=np.bool_)
    rows = records.view(np.uint8).reshape(records.size, -1)
    at = rows.shape[1] - records.dtype[CHECK].itemsize
    return CHECKSUMS[laid_out.checksum](rows[:, len(laid_out.sync) : at]) == records[CHECK]


def _apart(starts: IntegerArray, size: int) -> IntegerArray:
    """The starts that lie in no record before them: sync bytes may stand within one by chance."""
    if (np.diff(starts) >= size).all():
        return starts
    kept, end = [], -1
    for start in starts.tolist():
        if start >= end:
            kept.append(start)
            end = start + size
    return np.array(kept, dtype=np.int64)
