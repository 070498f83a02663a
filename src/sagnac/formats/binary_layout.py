"""How the records of a binary file are laid out, as a TOML declares it or a preset knows it."""

import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from sagnac.errors import RecordingError
from sagnac.recording.frames import ACCELEROMETER_NAMES

_ORDERS: Final = {"little": "<", "big": ">"}
# Name -> bytes at the end of a record; each is over what lies between sync bytes and itself.
_CHECKSUM_BYTES: Final = {"xor8": 1, "sum8": 1, "sum16": 2, "crc16": 2, "crc32": 4}
_TYPE: Final = re.compile(r"(?:[fiu][1248]|pad\d+)\Z")
_KEYS: Final = frozenset(
    {"fields", "byte_order", "header_bytes", "record_bytes", "sync", "checksum", "kind"}
    | {"sample_rate"}
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

    Raises
    ------
    ValueError
        If there is no such type.
    """

    name: str
    type: str
    unit: str | None = None

    def __post_init__(self) -> None:
        if not _TYPE.match(self.type) or self.type in ("f1", "f2"):
            raise ValueError(f"type is {self.type!r}; use f4, f8, i1 to i8, u1 to u8 or pad3")


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
        If there is no field, two have one name, or a value cannot be.
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
        if self.byte_order not in _ORDERS:
            raise ValueError(f"byte_order is {self.byte_order!r}; use little or big")
        if self.checksum and self.checksum not in _CHECKSUM_BYTES:
            known = ", ".join(_CHECKSUM_BYTES)
            raise ValueError(f"checksum is {self.checksum!r}; use one of {known}")
        if self.header_bytes < 0:
            raise ValueError(f"header_bytes is {self.header_bytes}; give 0 or more")
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
    remedy = f"use one of {', '.join(PRESETS)}, or a TOML that lists the fields"
    where = ""
    if isinstance(layout, str):
        where = layout
        try:
            layout = tomllib.loads(Path(layout).read_text(encoding="utf-8"))
        except OSError:
            raise RecordingError(f"layout {where!r} is not known", remedy=remedy) from None
        except ValueError as error:
            why = " ".join(str(error).split())
            raise RecordingError(f"not TOML: {why}", path=where, remedy="correct it") from None
    try:
        return _of_table(layout)
    except (TypeError, ValueError, KeyError) as error:
        why = " ".join(str(error).split())
        raise RecordingError(
            f"the layout of the records: {why}", path=where, remedy="correct it there"
        ) from None


def _of_table(table: Mapping[str, Any]) -> BinaryLayout:
    table = table.get("layout", table)
    unknown = sorted(set(table) - _KEYS)
    if unknown:
        raise ValueError(f"{unknown[0]!r} is not known; use {', '.join(sorted(_KEYS))}")
    if not isinstance(table.get("fields"), list):
        raise ValueError('fields is not stated; give a list such as [["time", "f8", "s"]]')
    fields = []
    for entry in table["fields"]:
        if not isinstance(entry, list) or not 2 <= len(entry) <= 3:
            raise ValueError(f"field {entry!r}; give a list of name, type and, if known, unit")
        name, kind, *unit = (str(part) for part in entry)
        fields.append(BinaryField(name=name, type=kind, unit=unit[0] if unit else None))
    others = {key: value for key, value in table.items() if key not in ("fields", "sync")}
    sync = bytes.fromhex(str(table.get("sync", "")))
    return BinaryLayout(fields=tuple(fields), sync=sync, **others)
