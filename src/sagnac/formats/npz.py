"""NumPy archives, and arrays by themselves (``.npy``), which say nothing of their columns."""

import math
import zipfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from sagnac.core import errors, whole_files
from sagnac.core.arrays import AnyArray, blocks
from sagnac.formats import files, source
from sagnac.formats.registry import NPY
from sagnac.formats.source import MOST_COLUMNS, Column, Source
from sagnac.formats.statement import ARRAYS_STATED, from_mapping


def open_source(path: Path) -> Source:
    """Arrays of an archive, or the columns of an array by itself (``.npy``).

    Raises
    ------
    RecordingError
        If the file is neither, is cut off, or holds no real numbers.
    """
    return _open_array(path) if path.suffix.lower() in NPY.suffixes else _open_archive(path)


def _open_array(path: Path) -> Source:
    """Columns of an array by itself by their numbers, from 1, along the short side.

    Those of records go by their names.

    Raises
    ------
    RecordingError
        If the file is no array of real numbers in one or two dimensions, or is cut off.
    """
    array = np.load(path, mmap_mode="r", allow_pickle=False)
    files.require_content(array.nbytes, path.stat().st_size, path.name)
    columns: dict[str, AnyArray] = {}
    if array.dtype.names is not None and array.ndim == 1:
        columns = {name: array[name] for name in array.dtype.names}
    elif array.ndim in (1, 2):
        table = np.atleast_2d(array)
        rows = table if table.shape[0] < table.shape[1] else table.T
        columns = {str(number): row for number, row in enumerate(rows[: MOST_COLUMNS + 1], 1)}
    columns = {name: one for name, one in columns.items() if one.dtype.kind in source.NUMBERS}
    if not 0 < len(columns) <= MOST_COLUMNS:
        problem = f"holds {array.dtype} of shape {array.shape}, no table of real numbers"
        remedy = "store an array of shape (samples,) or (samples, channels)"
        raise errors.RecordingError(problem, remedy=remedy)

    def pieces(keys: Sequence[str], start: int, stop: int) -> source.Pieces:
        for block in blocks(stop, start=start):
            yield {key: source.as_numbers(np.array(columns[key][block])) for key in keys}

    def load(keys: Sequence[str]) -> source.Stored:
        return source.Stored(lengths={key: columns[key].shape[0] for key in keys}, pieces=pieces)

    numbered = (
        Column(key=key, name=key, number=at, unit=source.unit_of(one.dtype))
        for at, (key, one) in enumerate(columns.items(), start=1)
    )
    return Source(columns=tuple(numbered), load=load)


def _open_archive(path: Path) -> Source:
    """Arrays of the archive; column ``k`` of a matrix ``w`` is called ``w.k``, from 1.

    Text and single numbers named like the fields of a `Statement` state it.

    Raises
    ------
    RecordingError
        If the file is not an archive of arrays or is cut off.
    """
    vectors: dict[str, source.Vector] = {}
    unreadable: dict[str, str] = {}
    stated: dict[str, Any] = {}
    heads = _heads(path)
    with np.load(path, allow_pickle=False) as archive:
        for name, (shape, kind) in heads.items():
            size = _bytes(shape, kind)
            # No text that states something is as long.
            if name in ARRAYS_STATED and shape in ((), (1,)) and size > 2**16:
                raise ValueError(f"{name} has {size} bytes")
            if kind.kind in source.NUMBERS and shape not in ((), (1,)):
                vectors.update(source.vectors(name, name, shape))
            elif name in ARRAYS_STATED:
                value = archive[name]
                stated[name] = value.item() if value.size == 1 else value.tolist()
            elif kind.kind not in source.NUMBERS:
                unreadable[name] = f"holds values of kind {kind.kind!r}"

    def load(keys: Sequence[str]) -> dict[str, AnyArray]:
        for name in {vectors[key].array for key in keys}:
            size = _bytes(*heads[name])
            files.require_room(size, name)
            files.require_content(size, path.stat().st_size, name)
        with np.load(path, allow_pickle=False) as archive:
            arrays = {key: vectors[key].of(archive[vectors[key].array]) for key in keys}
        return {key: source.as_numbers(one) for key, one in arrays.items()}

    units = {key: source.unit_of(heads[one.array][1]) for key, one in vectors.items()}
    columns = tuple(source.column(key, unit=unit) for key, unit in units.items())
    return Source(columns=columns, load=load, stated=from_mapping(stated), unreadable=unreadable)


def _bytes(shape: tuple[int, ...], kind: np.dtype[Any]) -> int:
    return kind.itemsize * math.prod(shape)


def _heads(path: Path) -> dict[str, tuple[tuple[int, ...], np.dtype[Any]]]:
    """Shape and type of all arrays, without the arrays."""
    heads = {}
    with zipfile.ZipFile(path) as archive:
        for member in archive.namelist():
            # Opened whatever it is called: that compares the name with the one beside its data.
            with archive.open(member) as stream:
                if not member.endswith(".npy"):
                    continue
                is_first = np.lib.format.read_magic(stream) == (1, 0)
                form = np.lib.format
                read = form.read_array_header_1_0 if is_first else form.read_array_header_2_0
                shape, _, dtype = read(stream)
            heads[member.removesuffix(".npy")] = (shape, dtype)
    return heads


def write(path: Path, out: source.Outgoing) -> None:
    """One array per column and the statement as text and numbers."""
    arrays: dict[str, Any] = {**out.rows(slice(None)), **out.statement()}
    # Not by np.savez: a gyro that is called as one of its arguments is none to it.
    with whole_files.replacing(path) as temporary, zipfile.ZipFile(temporary, "w") as archive:
        archive.comment = source.MADE.encode()
        for name, values in arrays.items():
            with archive.open(f"{name}.npy", "w", force_zip64=True) as stream:
                np.lib.format.write_array(stream, np.asanyarray(values), allow_pickle=False)
