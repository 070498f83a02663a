"""HDF5: datasets in the root or in groups, attributes for unit, kind and rate."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Final

import h5py
import numpy as np
from numpy.typing import NDArray

from sagnac import series
from sagnac.formats.source import (
    Column,
    Outgoing,
    Source,
    Stored,
    column,
    damaged,
    replacing,
    split_matrix,
)
from sagnac.formats.statement import from_mapping

FORMAT: Final = "HDF5"
SUFFIXES: Final = (".h5", ".hdf5", ".he5", ".nc")

_STATED: Final = frozenset(
    {"gyros", "kind", "unit", "scale", "sample_rate", "time", "table", "counter_bits", "null_pulse"}
)


def open_source(path: Path) -> Source:
    """Datasets of the file, by their last name where it is the only one of that name.

    Attributes of the root, or of the group that holds all datasets, may hold the keys of
    a `Statement`; those of a dataset ``unit`` (``units``) and ``kind``.

    Raises
    ------
    RecordingError
        If the file is not HDF5 or is cut off.
    """
    found: dict[str, tuple[str, int | None, Column]] = {}
    stated: dict[str, Any] = {}
    with damaged(path, FORMAT), h5py.File(path, "r") as file:
        datasets: list[str] = []
        file.visititems(
            lambda name, item: datasets.append(name) if isinstance(item, h5py.Dataset) else None
        )
        last = [name.rsplit("/", 1)[-1] for name in datasets]
        parents = {name.rpartition("/")[0] for name in datasets}
        for holder in [file, *(file[parent] for parent in parents if parent and len(parents) == 1)]:
            stated.update({k: _plain(v) for k, v in holder.attrs.items() if k in _STATED})
        for name, short in zip(datasets, last, strict=True):
            dataset = file[name]
            is_text = dataset.attrs.get("MATLAB_class", b"") == b"char"
            if dataset.dtype.kind not in "biuf" or is_text:
                continue
            attributes = {k: str(_plain(v)) for k, v in dataset.attrs.items()}
            unit = attributes.get("unit", attributes.get("units"))
            keys = split_matrix(short if last.count(short) == 1 else name, dataset.shape)
            for index, key in enumerate(keys, start=1):
                described = column(key, unit=unit, kind=attributes.get("kind"))
                found[key] = (name, index if len(keys) > 1 else None, described)

    def pieces(keys: Sequence[str], start: int, stop: int) -> Iterator[dict[str, NDArray[Any]]]:
        with damaged(path, FORMAT), h5py.File(path, "r") as file:
            for key in keys:
                name, index, _ = found[key]
                dataset = file[name]
                axis = int(np.argmax(dataset.shape))
                # Whole chunks: one that is compressed is unpacked as often as it is touched.
                chunk = dataset.chunks[axis] if dataset.chunks else 1
                length = -(-series.SPAN // chunk) * chunk
                for first in range(start - start % length, stop, length):
                    rows = slice(max(first, start), min(first + length, stop))
                    place: list[slice | int] = [slice(None)] * dataset.ndim
                    if index is not None:
                        place = [index - 1] * dataset.ndim
                    place[axis] = rows
                    yield {key: dataset[tuple(place)].reshape(-1)}

    def load(keys: Sequence[str]) -> Stored:
        with damaged(path, FORMAT), h5py.File(path, "r") as file:
            lengths = {key: max(file[found[key][0]].shape) for key in keys}
        return Stored(lengths=lengths, pieces=pieces)

    return Source(
        format=FORMAT,
        columns=tuple(described for _, _, described in found.values()),
        load=load,
        stated=from_mapping(stated, str(path)),
    )


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
        file.attrs["gyros"] = ",".join(out.kinds)
        for name, values in out.rows(slice(0)).items():
            dataset = file.create_dataset(name, (out.samples,), values.dtype)
            if name in out.units:
                dataset.attrs["unit"] = out.units[name]
            if name in out.kinds:
                dataset.attrs["kind"] = out.kinds[name]
        start = 0
        for columns in out.spans(series.SPAN):
            for name, values in columns.items():
                file[name][start : start + values.size] = values
            start += values.size
