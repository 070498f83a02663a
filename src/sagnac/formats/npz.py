"""NumPy archives."""

import zipfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from sagnac.formats.source import (
    Outgoing,
    Source,
    Stored,
    column,
    damaged,
    in_memory,
    replacing,
    split_matrix,
    take_column,
)
from sagnac.formats.statement import from_mapping

FORMAT: Final = "NumPy npz"
SUFFIXES: Final = (".npz",)

_STATED: Final = frozenset(
    {"gyros", "kind", "unit", "scale", "sample_rate", "counter_bits", "null_pulse"}
)


def open_source(path: Path) -> Source:
    """Arrays of the archive; column ``k`` of a matrix ``w`` is called ``w.k``, from 1.

    Text and single numbers named like the fields of a `Statement` state it.

    Raises
    ------
    RecordingError
        If the file is not an archive of arrays or is cut off.
    """
    owner: dict[str, tuple[str, int | None]] = {}
    stated: dict[str, Any] = {}
    with damaged(path, FORMAT):
        shapes = _shapes(path)
        with np.load(path, allow_pickle=False) as archive:
            for name, (shape, kind) in shapes.items():
                if kind in "biuf" and shape not in ((), (1,)):
                    keys = split_matrix(name, shape)
                    for index, key in enumerate(keys, start=1):
                        owner[key] = (name, None if keys == (name,) else index)
                elif name in _STATED:
                    value = archive[name]
                    stated[name] = value.item() if value.size == 1 else value.tolist()

    def load(keys: Sequence[str]) -> Stored:
        with damaged(path, FORMAT), np.load(path, allow_pickle=False) as archive:
            return in_memory(
                {key: take_column(archive[owner[key][0]], owner[key][1]) for key in keys}
            )

    return Source(
        format=FORMAT,
        columns=tuple(column(key) for key in owner),
        load=load,
        stated=from_mapping(stated, str(path)),
    )


def _shapes(path: Path) -> dict[str, tuple[tuple[int, ...], str]]:
    """Shape and kind of every array, from the heads of the members alone."""
    shapes: dict[str, tuple[tuple[int, ...], str]] = {}
    with zipfile.ZipFile(path) as archive:
        for member in archive.namelist():
            if not member.endswith(".npy"):
                continue
            with archive.open(member) as stream:
                version = np.lib.format.read_magic(stream)
                read = (
                    np.lib.format.read_array_header_1_0
                    if version == (1, 0)
                    else np.lib.format.read_array_header_2_0
                )
                shape, _, dtype = read(stream)
            shapes[member.removesuffix(".npy")] = (shape, dtype.kind)
    return shapes


def write(path: Path, out: Outgoing) -> None:
    """One array per column and the statement as text and numbers."""
    arrays: dict[str, Any] = {**out.rows(slice(None)), **out.statement()}
    with replacing(path) as temporary, temporary.open("wb") as stream:
        np.savez(stream, allow_pickle=False, **arrays)
