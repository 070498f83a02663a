"""HDF5: datasets in the root or in groups, attributes for unit, kind and rate."""

import math
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import h5py
import numpy as np
from numpy.typing import NDArray

from sagnac import series
from sagnac.errors import RecordingError
from sagnac.formats.files import damaged, replacing
from sagnac.formats.metadata import from_mapping
from sagnac.formats.outgoing import Outgoing, Rows
from sagnac.formats.registry import HDF5
from sagnac.formats.room import require_content
from sagnac.formats.source import Column, Source, Stored, Vector, column, vectors

_STATED: Final = frozenset(
    {"accelerometers"}
    | {
        "gyros",
        "kind",
        "unit",
        "scale",
        "sample_rate",
        "time",
        "table",
        "counter_bits",
        "null_pulse",
    }
)
# Reads the attributes of all datasets and groups, and nothing else.
_TRIAL: Final = """
import sys, h5py
with h5py.File(sys.argv[1], "r") as file:
    list(file.attrs.values())
    file.visititems(lambda name, item: list(item.attrs.values()) and None)
"""
# s after which it hangs.
_PATIENCE: Final = 30.0


@dataclass(frozen=True, slots=True, kw_only=True)
class _Found:
    """A column and where it lies."""

    column: Column
    vector: Vector


def open_source(path: Path) -> Source:
    """Datasets of the file, by their last name where it is the only one of that name.

    Attributes of the root, or of the group that holds all datasets, may hold the keys of
    a `Statement`; those of a dataset ``unit`` (``units``) and ``kind``.

    Raises
    ------
    RecordingError
        If the file is not HDF5 or is cut off.
    """
    _require_survivable(path)
    with damaged(HDF5.name), h5py.File(path, "r") as file:
        names: list[str] = []
        file.visititems(
            lambda name, item: names.append(name) if isinstance(item, h5py.Dataset) else None
        )
        stated = _stated(file, names)
        unreadable = {
            name.rpartition("/")[2]: f"holds {file[name].dtype} values"
            for name in names
            if not _is_numeric(file[name])
        }
        found = {one.column.key: one for name in names for one in _columns_of(file, name, names)}

    def pieces(keys: Sequence[str], start: int, stop: int) -> Iterator[dict[str, NDArray[Any]]]:
        with damaged(HDF5.name), h5py.File(path, "r") as file:
            for key in keys:
                vector = found[key].vector
                for values in _read(file[vector.array], vector, start, stop):
                    yield {key: values}

    def load(keys: Sequence[str]) -> Stored:
        with damaged(HDF5.name), h5py.File(path, "r") as file:
            for key in keys:
                _require_whole(file[found[key].vector.array], path)
            lengths = {key: max(file[found[key].vector.array].shape) for key in keys}
        return Stored(lengths=lengths, pieces=pieces)

    return Source(
        format=HDF5.name,
        columns=tuple(one.column for one in found.values()),
        load=load,
        stated=from_mapping(stated),
        unreadable=unreadable,
    )


def _require_survivable(path: Path) -> None:
    """Refuse a file over which the library crashes or hangs: another process tries it first.

    The library follows the addresses of texts in attributes without a check.
    """
    try:
        tried = subprocess.run(
            [sys.executable, "-I", "-c", _TRIAL, str(path.absolute())],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            timeout=_PATIENCE,
            check=False,
        )
        survived = tried.returncode >= 0
    except subprocess.TimeoutExpired:
        survived = False
    except OSError:
        # No process can be started here: the file is taken as it is.
        return
    if not survived:
        raise RecordingError(
            f"is not {HDF5.name}, or is damaged: the library ends over it",
            remedy="get the file again from its source",
        )


def _stated(file: h5py.File, names: Sequence[str]) -> dict[str, Any]:
    """What the attributes of the root, and of the only group with datasets, state."""
    parents = {name.rpartition("/")[0] for name in names}
    group = [file[parent] for parent in parents if parent and len(parents) == 1]
    return {
        key: _plain(value)
        for holder in (file, *group)
        for key, value in holder.attrs.items()
        if key in _STATED
    }


def _columns_of(file: h5py.File, name: str, names: Sequence[str]) -> list[_Found]:
    """The columns in one dataset; none in one of text."""
    dataset = file[name]
    if not _is_numeric(dataset):
        return []
    attributes = {key: str(_plain(value)) for key, value in dataset.attrs.items()}
    unit = attributes.get("unit", attributes.get("units"))
    short = name.rpartition("/")[2]
    is_only_one = [other.rpartition("/")[2] for other in names].count(short) == 1
    return [
        _Found(column=column(key, unit=unit, kind=attributes.get("kind")), vector=vector)
        for key, vector in vectors(short if is_only_one else name, name, dataset.shape).items()
    ]


def _is_numeric(dataset: h5py.Dataset) -> bool:
    """Whether it holds real numbers."""
    is_text = dataset.attrs.get("MATLAB_class", b"") == b"char"
    return dataset.dtype.kind in "biuf" and not is_text and dataset.shape is not None


def _require_whole(dataset: h5py.Dataset, path: Path) -> None:
    """Refuse a dataset with parts that were never written: they would be read as zeros."""
    size = path.stat().st_size
    missing = ""
    if dataset.is_virtual:
        for source in dataset.virtual_sources():
            file = path if source.file_name == "." else path.parent / source.file_name
            missing = missing or _missing_source(file, source.dset_name)
    elif dataset.chunks:
        chunks = math.prod(
            -(-length // chunk) for length, chunk in zip(dataset.shape, dataset.chunks, strict=True)
        )
        written = dataset.id.get_num_chunks()
        missing = f"{chunks - written} of {chunks} chunks were never written" * (written < chunks)
        require_content(dataset.nbytes, size, dataset.name.lstrip("/"))
    elif not dataset.external and dataset.id.get_storage_size() < dataset.nbytes:
        missing = "its values were never written"
    if missing:
        raise RecordingError(
            missing, channel=dataset.name.lstrip("/"), remedy="get the file again from its source"
        )


def _missing_source(file: Path, name: str) -> str:
    """Why a part of a virtual dataset is not there; empty if it is."""
    if not file.is_file():
        return f"the file of a part of it, {file.name}, is not there"
    with h5py.File(file, "r") as source:
        return "" if name in source else f"{file.name} has no dataset {name}"


def _read(dataset: h5py.Dataset, vector: Vector, start: int, stop: int) -> Iterator[NDArray[Any]]:
    """One column from sample `start` to the one before `stop`, in pieces of whole chunks."""
    axis = int(np.argmax(dataset.shape))
    # A compressed chunk is unpacked as often as it is touched.
    chunk = dataset.chunks[axis] if dataset.chunks else 1
    length = -(-series.SPAN // chunk) * chunk
    place: list[slice | int] = [
        slice(None) if vector.index is None else vector.index - 1
    ] * dataset.ndim
    for first in range(start - start % length, stop, length):
        place[axis] = slice(max(first, start), min(first + length, stop))
        yield dataset[tuple(place)].reshape(-1)


def _plain(value: Any) -> Any:
    if isinstance(value, bytes):
        return value.decode(errors="replace")
    if isinstance(value, np.ndarray):
        return (
            [_plain(item) for item in value.tolist()] if value.size != 1 else _plain(value.item())
        )
    return value.item() if isinstance(value, np.generic) else value


def write(path: Path, out: Outgoing) -> None:
    """One dataset per column with unit and kind, and the rate in the root's attributes."""
    with replacing(path) as temporary, h5py.File(temporary, "w") as file:
        file.attrs["sample_rate"] = out.sample_rate
        for sensor, names in out.sensors.items():
            file.attrs[sensor] = names
        for name, values in out.rows(slice(0)).items():
            dataset = file.create_dataset(name, (out.samples,), values.dtype)
            if name in out.units:
                dataset.attrs["unit"] = out.units[name]
            if name in out.kinds:
                dataset.attrs["kind"] = out.kinds[name]

        def store(first: int, rows: Rows) -> None:
            for name, values in rows.items():
                file[name][first : first + values.size] = values

        out.write_blocks(store)
