"""Binary records of a declared layout: fields, types, byte order, sync bytes and checksum.

A TOML declares the layout, or a preset knows it.
"""

import re
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from sagnac.core.arrays import blocks
from sagnac.core.documents import ANY, NUMBER, TEXT, Schema, keep, one_of, read_toml, table
from sagnac.core.errors import Note, RecordingError, counted
from sagnac.core.texts import giving
from sagnac.formats.files import damaged
from sagnac.formats.registry import BINARY
from sagnac.formats.source import Column, Source, Stored
from sagnac.formats.statement import Statement
from sagnac.recording.columns import ACCELEROMETER_NAMES

# ---- binary layout -----------------------------------------------------------------

_ORDERS: Final = {"little": "<", "big": ">"}
# Name -> bytes at the end of a record; each is over what lies between sync bytes and itself.
_CHECKSUM_BYTES: Final = {"xor8": 1, "sum8": 1, "sum16": 2, "crc16": 2, "crc32": 4}
_SYNC: Final = giving("bytes of sync such as aa55")(bytes.fromhex)
_BYTES: Final[Schema] = {"type": "integer", "minimum": 0, "description": "give 0 or more"}
_FIELD: Final[Schema] = {
    "type": "array",
    "minItems": 2,
    "maxItems": 3,
    "items": [
        ANY,
        {
            "type": "string",
            "pattern": r"^([iu][1248]|f[48]|pad\d+)\Z",
            "description": "use f4, f8, i1 to i8, u1 to u8 or pad3",
        },
    ],
    "description": "give a list of name, type and, if known, unit",
}
_LAYOUT: Final = table(
    {
        "fields": {
            "type": "array",
            "items": _FIELD,
            "description": 'give a list such as [["time", "f8", "s"]]',
        },
        "byte_order": one_of(_ORDERS),
        "header_bytes": _BYTES,
        "record_bytes": _BYTES,
        "sync": ANY,
        "checksum": one_of(_CHECKSUM_BYTES),
        "kind": TEXT,
        "sample_rate": NUMBER,
    },
    needed=("fields",),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class BinaryField:
    """One field of a record.

    Attributes
    ----------
    name
        Empty for bytes that are passed over.
    type
        ``f8``, ``i4``, ``u2`` or ``pad3``.
    unit
        Or None.

    """

    name: str
    type: str
    unit: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class BinaryLayout:
    """Records of one length.

    Attributes
    ----------
    fields
        In their order.
    byte_order
        ``little`` or ``big``.
    header_bytes
        Before the first record.
    record_bytes
        Length of a record; None for sync bytes, fields and checksum one behind the other.
    sync
        Bytes that every record begins with.
    checksum
        ``xor8``, ``sum8``, ``sum16``, ``crc16`` or ``crc32`` at the end of every record, over what
        lies between sync bytes and it; empty if there is none.
    kind, sample_rate
        What the samples are, and Hz; None if the file's user states it.

    Raises
    ------
    ValueError
        If there is no field, two have one name, or they take more than a record has.
    """

    fields: tuple[BinaryField, ...]
    byte_order: str = "little"
    header_bytes: int = 0
    record_bytes: int | None = None
    sync: bytes = b""
    checksum: str = ""
    kind: str | None = None
    sample_rate: float | None = None

    def __post_init__(self) -> None:
        names = [field.name for field in self.fields if field.name]
        if not names or len(set(names)) < len(names):
            raise ValueError(
                f"fields are {', '.join(names) or 'none'}; give each a name of its own"
            )
        if self.record_bytes is not None and self.record_bytes < self._used:
            raise ValueError(
                f"record_bytes is {self.record_bytes}; sync, fields and checksum take {self._used}"
            )

    @property
    def dtype_order(self) -> str:
        """Byte order as numpy writes it."""
        return _ORDERS[self.byte_order]

    @property
    def checksum_bytes(self) -> int:
        """Length of the checksum."""
        return _CHECKSUM_BYTES.get(self.checksum, 0)

    @property
    def _used(self) -> int:
        width = sum(int(re.sub(r"\D", "", field.type)) for field in self.fields)
        return len(self.sync) + width + self.checksum_bytes

    @property
    def size(self) -> int:
        """Bytes in a record."""
        return self.record_bytes or self._used

    @property
    def dtype(self) -> np.dtype[Any]:
        """The record as numpy reads it."""
        names, kinds, offsets = [], [], []
        offset = len(self.sync)
        for field in self.fields:
            width = int(re.sub(r"\D", "", field.type))
            if field.name:
                names.append(field.name)
                kinds.append(f"{self.dtype_order}{field.type}")
                offsets.append(offset)
            offset += width
        return np.dtype(
            {"names": names, "formats": kinds, "offsets": offsets, "itemsize": self.size}
        )


def _seven_doubles(name: str) -> BinaryLayout:
    fields = [BinaryField(name="time", type="f8", unit="s")]
    fields += [BinaryField(name=axis, type="f8", unit=name) for axis in "xyz"]
    fields += [BinaryField(name=axis, type="f8", unit="m/s^2") for axis in ACCELEROMETER_NAMES]
    return BinaryLayout(fields=tuple(fields), kind="rate")


# Name -> layout of units that are often met: time (s), gyros x, y, z, accelerometers x, y, z.
PRESETS: Final[Mapping[str, BinaryLayout]] = {
    "imu7-deg": _seven_doubles("deg/s"),
    "imu7-rad": _seven_doubles("rad/s"),
}


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
    >>> declared("imu7-deg").size
    56
    """
    if isinstance(layout, str) and layout in PRESETS:
        return PRESETS[layout]
    where = layout if isinstance(layout, str) else ""
    try:
        return _of_table(read_toml(Path(layout)) if isinstance(layout, str) else layout)
    except OSError:
        raise RecordingError(
            f"layout {where!r} is not known",
            remedy=f"use one of {', '.join(PRESETS)}, or a TOML that lists the fields",
        ) from None
    except ValueError as error:
        raise RecordingError(
            f"the layout of the records: {error}", path=where, remedy="correct it there"
        ) from None


def _of_table(content: Mapping[str, Any]) -> BinaryLayout:
    stated = content.get("layout", content)
    keep(_LAYOUT, stated)
    fields = tuple(
        BinaryField(name=str(name), type=kind, unit=str(unit[0]) if unit else None)
        for name, kind, *unit in stated["fields"]
    )
    others = {key: value for key, value in stated.items() if key not in ("fields", "sync")}
    sync = _SYNC(str(stated.get("sync", "")))
    return BinaryLayout(fields=fields, sync=sync, **others)


# ---- binary ------------------------------------------------------------------------

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
            for block in blocks(stop, start=start):
                rows = _records(path, laid_out, starts, block)
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
    path: Path, laid_out: BinaryLayout, starts: NDArray[np.int64] | None, some: slice
) -> NDArray[Any]:
    """Some of the records."""
    content = _bytes(path)
    if starts is None:
        begin = laid_out.header_bytes
        rows = content[begin + some.start * laid_out.size : begin + some.stop * laid_out.size]
        return rows.view(laid_out.dtype)
    rows = content[starts[some, None] + np.arange(laid_out.size)]
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
        for some in blocks(places.size):
            rows = places[some]
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
