"""Binary records of a declared layout: fields, types, byte order, sync bytes and checksum."""

import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from sagnac import series
from sagnac.errors import Note, RecordingError, counted
from sagnac.formats.binary_layout import BinaryLayout, declared
from sagnac.formats.files import damaged
from sagnac.formats.registry import BINARY
from sagnac.formats.source import Column, Source, Stored
from sagnac.formats.statement import Statement
from sagnac.recording.frames import ACCELEROMETER_NAMES

Bytes = NDArray[np.uint8]
_LOOKED_THROUGH: Final = 1 << 24


def open_source(path: Path) -> Source:
    """Refuse a file whose layout nobody states.

    Raises
    ------
    RecordingError
        Always: see `open_declared`.
    """
    raise RecordingError(
        "is binary and its layout is not declared",
        remedy="state {layout NAME}, a preset or a TOML that lists the fields",
    )


def open_declared(path: Path, layout: str | Mapping[str, Any]) -> Source:
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
        If the layout cannot be, or the file holds no record of it.
    """
    laid_out = declared(layout)
    with damaged(BINARY.name):
        size = path.stat().st_size - laid_out.header_bytes
        records, rest = divmod(max(size, 0), laid_out.size)
    if records == 0:
        raise RecordingError(
            f"is shorter than one record of {laid_out.size} bytes",
            remedy="state the right {layout}",
        )
    starts: NDArray[np.int64] | None = None
    notes: tuple[Note, ...] = ()
    if laid_out.sync or laid_out.checksum:
        with damaged(BINARY.name):
            starts, notes = _found(path, laid_out)
        records = starts.size
        if records == 0:
            raise RecordingError(
                "holds no record with these sync bytes and this checksum",
                remedy="state the right {layout}",
            )
    elif rest:
        text = f"{counted(rest, 'byte')} behind the last record: it may be cut off"
        notes = (Note(text=text, level="warning"),)

    def pieces(keys: Sequence[str], start: int, stop: int) -> Iterator[dict[str, NDArray[Any]]]:
        with damaged(BINARY.name):
            for first in range(start, stop, series.SPAN):
                last = min(first + series.SPAN, stop)
                rows = _records(path, laid_out, starts, first, last)
                yield {key: np.ascontiguousarray(rows[key]) for key in keys}

    names = {one.name for one in laid_out.fields}
    return Source(
        format=BINARY.name,
        columns=tuple(
            Column(key=one.name, name=one.name, unit=one.unit, number=number)
            for number, one in enumerate(laid_out.fields, start=1)
            if one.name
        ),
        load=lambda keys: Stored(lengths=dict.fromkeys(keys, records), pieces=pieces),
        stated=Statement(
            kind=laid_out.kind,
            sample_rate=laid_out.sample_rate,
            accelerometers=ACCELEROMETER_NAMES if set(ACCELEROMETER_NAMES) <= names else None,
        ),
        notes=notes,
    )


def _bytes(path: Path) -> Bytes:
    return np.memmap(path, dtype=np.uint8, mode="r")


def _records(
    path: Path, laid_out: BinaryLayout, starts: NDArray[np.int64] | None, first: int, last: int
) -> NDArray[Any]:
    """Records `first` to the one before `last`."""
    content = _bytes(path)
    if starts is None:
        begin = laid_out.header_bytes + first * laid_out.size
        return content[begin : begin + (last - first) * laid_out.size].view(laid_out.dtype)
    rows = content[starts[first:last, None] + np.arange(laid_out.size)]
    return np.ascontiguousarray(rows).view(laid_out.dtype)[:, 0]


def _found(path: Path, laid_out: BinaryLayout) -> tuple[NDArray[np.int64], tuple[Note, ...]]:
    """Where the records with right sync bytes and checksums start, and what lies between them."""
    content = _bytes(path)
    found: list[NDArray[np.int64]] = []
    wrong = 0
    # Looked through in parts; a record that begins in one may end in the next.
    last = content.size - laid_out.size
    for begin in range(laid_out.header_bytes, last + 1, _LOOKED_THROUGH):
        places = _places(content, laid_out, begin, min(begin + _LOOKED_THROUGH, last + 1))
        for rows in np.array_split(places, max(1, places.size // series.SPAN)):
            is_right = _are_right(content, laid_out, rows)
            wrong += int(np.count_nonzero(~is_right)) if laid_out.checksum else 0
            found.append(rows[is_right])
    starts = _apart(np.concatenate(found) if found else np.empty(0, np.int64), laid_out.size)
    between = content.size - laid_out.header_bytes - starts.size * laid_out.size
    if between == 0:
        return starts, ()
    text = f"{counted(between, 'byte')} belong to no record and are left out"
    if wrong:
        text += f"; {counted(wrong, 'checksum')} did not match"
    return starts, (Note(text=text, level="warning"),)


def _places(content: Bytes, laid_out: BinaryLayout, begin: int, stop: int) -> NDArray[np.int64]:
    """Places from `begin` to before `stop` where the sync bytes stand, or a record could."""
    if not laid_out.sync:
        offset = (begin - laid_out.header_bytes) % laid_out.size
        return np.arange(begin + (laid_out.size - offset) % laid_out.size, stop, laid_out.size)
    is_sync = np.ones(stop - begin, dtype=np.bool_)
    for place, value in enumerate(laid_out.sync):
        is_sync &= content[begin + place : stop + place] == value
    return np.flatnonzero(is_sync) + begin


def _are_right(content: Bytes, laid_out: BinaryLayout, starts: NDArray[np.int64]) -> Any:
    """Whether the checksums of records match, (records,) bool."""
    if not laid_out.checksum or not starts.size:
        return np.ones(starts.size, dtype=np.bool_)
    rows = np.asarray(content[starts[:, None] + np.arange(laid_out.size)])
    at, width = laid_out.size - laid_out.checksum_bytes, laid_out.checksum_bytes
    stored = rows[:, at:].copy().view(f"{laid_out.dtype_order}u{width}")[:, 0]
    return CHECKSUMS[laid_out.checksum](rows[:, len(laid_out.sync) : at]) == stored


def _apart(starts: NDArray[np.int64], size: int) -> NDArray[np.int64]:
    """The starts that lie in no record before them: sync bytes may stand within one by chance."""
    if starts.size < 2 or (np.diff(starts) >= size).all():
        return starts
    kept, end = [], -1
    for start in starts.tolist():
        if start >= end:
            kept.append(start)
            end = start + size
    return np.array(kept, dtype=np.int64)


def _crc16(rows: Bytes) -> NDArray[Any]:
    """CRC-16/CCITT-FALSE: polynomial 0x1021 from 0xFFFF."""
    crc: NDArray[Any] = np.full(rows.shape[0], 0xFFFF, dtype=np.int64)
    for column in rows.T:
        crc ^= column.astype(np.int64) << 8
        for _ in range(8):
            crc = ((crc << 1) ^ np.where(crc & 0x8000, 0x1021, 0)) & 0xFFFF
    return crc


CHECKSUMS: Final[Mapping[str, Callable[[Bytes], NDArray[Any]]]] = {
    "xor8": lambda rows: np.bitwise_xor.reduce(rows, axis=1),
    "sum8": lambda rows: rows.sum(axis=1, dtype=np.uint64) & 0xFF,
    "sum16": lambda rows: rows.sum(axis=1, dtype=np.uint64) & 0xFFFF,
    "crc16": _crc16,
    "crc32": lambda rows: np.array([zlib.crc32(row.tobytes()) for row in rows], dtype=np.uint32),
}
