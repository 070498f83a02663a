"""HDF5: datasets in the root or in groups, attributes for unit, kind and rate."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import h5py
import numpy as np
from numpy.typing import NDArray

from sagnac import series
from sagnac.formats.files import damaged, replacing
from sagnac.formats.hdf5_soundness import require_survivable, require_whole
from sagnac.formats.metadata import from_mapping
from sagnac.formats.outgoing import MADE, Outgoing, Rows
from sagnac.formats.registry import HDF5
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
        "counter_period",
        "null_pulse",
    }
)


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
    require_survivable(path, HDF5.name)
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
                require_whole(file[found[key].vector.array], path)
            lengths = {key: max(file[found[key].vector.array].shape) for key in keys}
        return Stored(lengths=lengths, pieces=pieces)

    return Source(
        format=HDF5.name,
        columns=tuple(one.column for one in found.values()),
        load=load,
        stated=from_mapping(stated),
        unreadable=unreadable,
    )


def _stated(file: h5py.File, names: Sequence[str]) -> dict[str, Any]:
    """Statements of the attributes of the root, and of the only group with datasets."""
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
        file.attrs["remark"] = np.bytes_(MADE)
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
