"""NumPy archives."""

import math
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from sagnac.formats.files import damaged, replacing, require_content, require_room
from sagnac.formats.registry import NPZ
from sagnac.formats.source import MADE, Outgoing, Source, Stored, Vector, column, in_memory, vectors
from sagnac.formats.statement import ARRAYS_STATED, from_mapping

# Bytes of a text that states something.
_MOST_STATED: Final = 2**16


def open_source(path: Path) -> Source:
    """Arrays of the archive; column ``k`` of a matrix ``w`` is called ``w.k``, from 1.

    Text and single numbers named like the fields of a `Statement` state it.

    Raises
    ------
    RecordingError
        If the file is not an archive of arrays or is cut off.
    """
    found: dict[str, Vector] = {}
    unreadable: dict[str, str] = {}
    stated: dict[str, Any] = {}
    with damaged(NPZ.name):
        heads = _heads(path)
        with np.load(path, allow_pickle=False) as archive:
            for name, head in heads.items():
                if name in ARRAYS_STATED and head.shape in ((), (1,)) and head.bytes > _MOST_STATED:
                    raise ValueError(f"{name} has {head.bytes} bytes")
                if head.kind in "biuf" and head.shape not in ((), (1,)):
                    found.update(vectors(name, name, head.shape))
                elif name in ARRAYS_STATED:
                    value = archive[name]
                    stated[name] = value.item() if value.size == 1 else value.tolist()
                elif head.kind not in "biuf":
                    unreadable[name] = f"holds values of kind {head.kind!r}"

    def load(keys: Sequence[str]) -> Stored:
        for name in {found[key].array for key in keys}:
            require_room(heads[name].bytes, name)
            require_content(heads[name].bytes, path.stat().st_size, name)
        with damaged(NPZ.name), np.load(path, allow_pickle=False) as archive:
            return in_memory({key: found[key].of(archive[found[key].array]) for key in keys})

    return Source(
        format=NPZ.name,
        columns=tuple(column(key) for key in found),
        load=load,
        stated=from_mapping(stated),
        unreadable=unreadable,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Head:
    """Shape of an array, kind of its numbers (`numpy.dtype.kind`), and the bytes that it takes."""

    shape: tuple[int, ...]
    kind: str
    bytes: int


def _heads(path: Path) -> dict[str, _Head]:
    """The heads of all arrays, without the arrays."""
    heads: dict[str, _Head] = {}
    with zipfile.ZipFile(path) as archive:
        for member in archive.namelist():
            # Opened whatever it is called: that compares the name with the one beside its data.
            with archive.open(member) as stream:
                if not member.endswith(".npy"):
                    continue
                version = np.lib.format.read_magic(stream)
                read = (
                    np.lib.format.read_array_header_1_0
                    if version == (1, 0)
                    else np.lib.format.read_array_header_2_0
                )
                shape, _, dtype = read(stream)
            heads[member.removesuffix(".npy")] = _Head(
                shape=shape, kind=dtype.kind, bytes=dtype.itemsize * math.prod(shape)
            )
    return heads


def write(path: Path, out: Outgoing) -> None:
    """One array per column and the statement as text and numbers."""
    arrays: dict[str, Any] = {**out.rows(slice(None)), **out.statement()}
    # Not by np.savez: a gyro that is called as one of its arguments is none to it.
    with replacing(path) as temporary, zipfile.ZipFile(temporary, "w") as archive:
        archive.comment = MADE.encode()
        for name, values in arrays.items():
            with archive.open(f"{name}.npy", "w", force_zip64=True) as stream:
                np.lib.format.write_array(stream, np.asanyarray(values), allow_pickle=False)
