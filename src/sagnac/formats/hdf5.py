"""HDF5: datasets in the root or in groups, attributes for unit, kind and rate.

Files over which the library ends, or that lack what they declare, are refused before.
"""

import math
import subprocess
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Final

import h5py
import numpy as np
from numpy.typing import NDArray

from sagnac.arrays import blocks
from sagnac.errors import RecordingError, one_line
from sagnac.formats.files import damaged, replacing, require_content
from sagnac.formats.registry import HDF5
from sagnac.formats.source import (
    MADE,
    Column,
    Outgoing,
    Rows,
    Source,
    Stored,
    Vector,
    column,
    vectors,
)
from sagnac.formats.statement import ATTRIBUTES, by_attributes

# ---- hdf5 soundness ----------------------------------------------------------------

# Reads the attributes of all datasets and groups, and nothing else. It ends by itself if nobody is
# left to end it.
_TRIAL: Final = """
import faulthandler, sys
faulthandler.dump_traceback_later(float(sys.argv[2]), exit=True)
import h5py
with h5py.File(sys.argv[1], "r") as file:
    list(file.attrs.values())
    file.visititems(lambda name, item: list(item.attrs.values()) and None)
"""
PATIENCE: Final = 30.0
"""Seconds after which a library that has not read the attributes of a file hangs."""


def require_survivable(path: Path, name: str) -> None:
    """Refuse a file over which the library crashes or hangs: another process tries it first.

    The library follows the addresses of texts in attributes without a check.

    Parameters
    ----------
    path
        Of the file.
    name
        Of its format.

    Raises
    ------
    RecordingError
        If it is such a file.
    """
    try:
        tried = subprocess.run(
            [sys.executable, "-I", "-c", _TRIAL, str(path.absolute()), str(2.0 * PATIENCE)],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            timeout=PATIENCE,
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
            f"is not {name}, or is damaged: the library ends over it",
            remedy="get the file again from its source",
        )


def require_own(dataset: h5py.Dataset, path: Path) -> None:
    """Refuse a dataset whose values lie in files elsewhere.

    They would be those of whatever file of this machine the writer has named.

    Parameters
    ----------
    dataset
        Of an open file.
    path
        Of that file.

    Raises
    ------
    RecordingError
        If they lie in a file of raw bytes, or parts of them out of the folder or nowhere.
    """
    name = dataset.name.lstrip("/")
    if dataset.external:
        raise RecordingError(
            f"its values lie in another file, {one_line(str(dataset.external[0][0]))}",
            channel=name,
            remedy="put them into this file: h5repack -l CONTI",
        )
    for source in dataset.virtual_sources() if dataset.is_virtual else ():
        file = path if source.file_name == "." else path.parent / source.file_name
        problem = _problem_of_part(file, source.dset_name, path.parent)
        if problem:
            raise RecordingError(problem, channel=name, remedy="get the file again from its source")


def require_whole(dataset: h5py.Dataset, path: Path) -> None:
    """Refuse a dataset with parts that lie elsewhere, or that were never written.

    The latter would be read as zeros.

    Parameters
    ----------
    dataset
        Of an open file.
    path
        Of that file.

    Raises
    ------
    RecordingError
        If parts of it are missing or elsewhere.
    """
    require_own(dataset, path)
    missing = ""
    if dataset.is_virtual:
        return
    if dataset.chunks:
        chunks = math.prod(
            -(-length // chunk) for length, chunk in zip(dataset.shape, dataset.chunks, strict=True)
        )
        written = dataset.id.get_num_chunks()
        missing = f"{chunks - written} of {chunks} chunks were never written" * (written < chunks)
        require_content(dataset.nbytes, path.stat().st_size, dataset.name.lstrip("/"))
    elif dataset.id.get_storage_size() < dataset.nbytes:
        missing = "its values were never written"
    if missing:
        raise RecordingError(
            missing, channel=dataset.name.lstrip("/"), remedy="get the file again from its source"
        )


def _problem_of_part(file: Path, name: str, folder: Path) -> str:
    """Why a part of a virtual dataset cannot be taken; empty if it can."""
    if not file.resolve().is_relative_to(folder.resolve()):
        return f"a part of it lies outside the folder of the file, in {one_line(str(file))}"
    if not file.is_file():
        return f"the file of a part of it, {one_line(file.name)}, is not there"
    with h5py.File(file, "r") as source:
        part = source.get(name)
        if not isinstance(part, h5py.Dataset):
            return one_line(f"{file.name} has no dataset {name}")
        # A part that is made of parts, or linked, would lead out of the folder by a second step.
        if part.external or part.is_virtual or part.file.filename != source.filename:
            return one_line(f"{file.name} takes {name} from elsewhere in turn")
    return ""


# ---- hdf5 --------------------------------------------------------------------------


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
        names = dataset_names(file)
        stated = _stated(file, names)
        unreadable = {
            name.rpartition("/")[2]: f"holds {file[name].dtype} values"
            for name in names
            if not _is_numeric(file[name])
        }
        found = {
            one.key: (one, vector)
            for name in names
            for one, vector in _columns_of(file, name, names)
        }

    def pieces(keys: Sequence[str], start: int, stop: int) -> Iterator[dict[str, NDArray[Any]]]:
        with damaged(HDF5.name), h5py.File(path, "r") as file:
            for key in keys:
                _, vector = found[key]
                for values in _read(file[vector.array], vector, start, stop):
                    yield {key: values}

    def load(keys: Sequence[str]) -> Stored:
        with damaged(HDF5.name), h5py.File(path, "r") as file:
            datasets = {key: file[found[key][1].array] for key in keys}
            for dataset in datasets.values():
                require_whole(dataset, path)
            lengths = {key: max(dataset.shape) for key, dataset in datasets.items()}
        return Stored(lengths=lengths, pieces=pieces)

    return Source(
        format=HDF5.name,
        columns=tuple(one for one, _ in found.values()),
        load=load,
        stated=by_attributes(stated),
        unreadable=unreadable,
    )


def dataset_names(file: h5py.File) -> list[str]:
    """Names of the datasets, those in groups too."""
    names: list[str] = []
    file.visititems(
        lambda name, item: names.append(name) if isinstance(item, h5py.Dataset) else None
    )
    return names


def _stated(file: h5py.File, names: Sequence[str]) -> dict[str, Any]:
    """Statements of the attributes of the root, and of the only group with datasets."""
    parents = {name.rpartition("/")[0] for name in names}
    group = [file[parent] for parent in parents if parent and len(parents) == 1]
    return {
        key: plain(value)
        for holder in (file, *group)
        for key, value in holder.attrs.items()
        if key in ATTRIBUTES
    }


def _columns_of(file: h5py.File, name: str, names: Sequence[str]) -> list[tuple[Column, Vector]]:
    """The columns in one dataset and where each lies; none in one of text."""
    dataset = file[name]
    if not _is_numeric(dataset):
        return []
    attributes = {key: str(plain(value)) for key, value in dataset.attrs.items()}
    unit = attributes.get("unit", attributes.get("units"))
    short = name.rpartition("/")[2]
    is_only_one = [other.rpartition("/")[2] for other in names].count(short) == 1
    return [
        (column(key, unit=unit, kind=attributes.get("kind")), vector)
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
    place: list[slice | int] = [
        slice(None) if vector.index is None else vector.index - 1
    ] * dataset.ndim
    for block in blocks(stop, start=start - start % chunk, multiple=chunk):
        place[axis] = slice(max(block.start, start), block.stop)
        yield dataset[tuple(place)].reshape(-1)


def plain(value: Any) -> Any:
    """An attribute as text, a number, or a list of them."""
    if isinstance(value, bytes):
        return value.decode(errors="replace")
    if isinstance(value, np.ndarray):
        return [plain(item) for item in value.tolist()] if value.size != 1 else plain(value.item())
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
