"""HDF5, datasets in the root or in groups; NetCDF, variables scaled as their attributes say.

Attributes state unit, kind and rate. Files over which the library ends, or that lack what they
declare, are refused before.

A file of NetCDF 4 is one of HDF5 whose datasets are the variables (CF conventions). A classic one
(NetCDF 3, or with offsets of 64 bits) is read whole; one with data of 64 bits (CDF-5) is not read.
"""

import math
import re
import subprocess
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Final

import h5py
import numpy as np
from numpy.typing import NDArray
from scipy.io import netcdf_file

from sagnac.core.arrays import blocks
from sagnac.core.errors import RecordingError, one_line
from sagnac.core.whole_files import replacing
from sagnac.formats.files import damaged, require_content
from sagnac.formats.registry import HDF5, NETCDF
from sagnac.formats.source import (
    MADE,
    Column,
    Outgoing,
    Source,
    Stored,
    Vector,
    column,
    in_memory,
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


def _require_own(dataset: h5py.Dataset, path: Path) -> None:
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


def _require_whole(dataset: h5py.Dataset, path: Path) -> None:
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
    _require_own(dataset, path)
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

    Those of NetCDF are the variables of numbers, scaled as their attributes say.

    Raises
    ------
    RecordingError
        If the file is not HDF5 or, by its suffix, NetCDF, or is cut off.
    """
    if path.suffix.lower() in NETCDF.suffixes:
        return _open_netcdf(path)
    require_survivable(path, HDF5.name)
    with damaged(HDF5.name), h5py.File(path, "r") as file:
        names = _dataset_names(file)
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
                _require_whole(dataset, path)
            lengths = {key: max(dataset.shape) for key, dataset in datasets.items()}
        return Stored(lengths=lengths, pieces=pieces)

    return Source(
        format=HDF5.name,
        columns=tuple(one for one, _ in found.values()),
        load=load,
        stated=by_attributes(stated),
        unreadable=unreadable,
    )


def _dataset_names(file: h5py.File) -> list[str]:
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
        key: _plain(value)
        for holder in (file, *group)
        for key, value in holder.attrs.items()
        if key in ATTRIBUTES
    }


def _columns_of(file: h5py.File, name: str, names: Sequence[str]) -> list[tuple[Column, Vector]]:
    """The columns in one dataset and where each lies; none in one of text."""
    dataset = file[name]
    if not _is_numeric(dataset):
        return []
    attributes = {key: str(_plain(value)) for key, value in dataset.attrs.items()}
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


def _plain(value: Any) -> Any:
    """An attribute as text, a number, or a list of them."""
    if isinstance(value, bytes):
        return value.decode(errors="replace")
    if isinstance(value, np.ndarray):
        return (
            [_plain(item) for item in value.tolist()] if value.size != 1 else _plain(value.item())
        )
    return value.item() if isinstance(value, np.generic) else value


# ---- netcdf ------------------------------------------------------------------------

# How the format marks a dimension without values of its own ("NetCDF-4 file format" in the guide).
_NO_VARIABLE: Final = "This is a netCDF dimension but not a netCDF variable"
# How the classic formats begin, and their versions.
_CLASSIC: Final = b"CDF"
_VERSIONS: Final = (b"\x01", b"\x02")
_DATA_OF_64_BITS: Final = b"\x05"
_OF_VARIABLE: Final = (
    "units", "unit", "kind", "_FillValue", "missing_value", "scale_factor", "add_offset",
)  # fmt: skip
_SINCE: Final = re.compile(r"^\s*(\w+)\s+since\s", re.I)


def _open_netcdf(path: Path) -> Source:
    """Variables of numbers, of NetCDF 4 in groups too."""
    with path.open("rb") as stream:
        version = stream.read(len(_CLASSIC) + 1).removeprefix(_CLASSIC)
    if version in _VERSIONS:
        return _classic(path)
    if version == _DATA_OF_64_BITS:
        raise RecordingError(
            "is NetCDF of the kind CDF-5, which is not read",
            remedy=f"make it NetCDF 4: nccopy -k nc4 {path.name} {path.stem}-4.nc",
        )
    require_survivable(path, NETCDF.name)
    with damaged(NETCDF.name), h5py.File(path, "r") as file:
        found = dict(_variables(file))
        columns = tuple(_column(name, file[name].attrs) for name in found)
        stated = {key: _plain(file.attrs[key]) for key in file.attrs if key in ATTRIBUTES}

    def pieces(keys: Sequence[str], start: int, stop: int) -> Iterator[dict[str, NDArray[Any]]]:
        with damaged(NETCDF.name), h5py.File(path, "r") as file:
            for key in keys:
                variable = file[key]
                for block in blocks(stop, start=start):
                    yield {key: _scaled(np.asarray(variable[block]), variable.attrs)}

    def load(keys: Sequence[str]) -> Stored:
        with damaged(NETCDF.name), h5py.File(path, "r") as file:
            for key in keys:
                # Without a fill value nothing tells what was never written from what was.
                require = _require_own if "_FillValue" in file[key].attrs else _require_whole
                require(file[key], path)
        return Stored(lengths={key: found[key] for key in keys}, pieces=pieces)

    return Source(format=NETCDF.name, columns=columns, load=load, stated=by_attributes(stated))


def _classic(path: Path) -> Source:
    """Variables of numbers of a classic file."""
    with damaged(NETCDF.name), netcdf_file(path, "r", mmap=False) as file:
        attributes = {
            name: {key: getattr(one, key) for key in _OF_VARIABLE if hasattr(one, key)}
            for name, one in file.variables.items()
            if len(one.shape) == 1 and one.data.dtype.kind in "biuf"
        }
        columns = tuple(_column(name, own) for name, own in attributes.items())
        stated = {key: _plain(getattr(file, key)) for key in ATTRIBUTES if hasattr(file, key)}

    def load(keys: Sequence[str]) -> Stored:
        with damaged(NETCDF.name), netcdf_file(path, "r", mmap=False) as file:
            values = {key: np.array(file.variables[key].data) for key in keys}
        # They are stored with the highest byte first.
        native = {key: one.astype(one.dtype.newbyteorder("=")) for key, one in values.items()}
        return in_memory({key: _scaled(one, attributes[key]) for key, one in native.items()})

    return Source(format=NETCDF.name, columns=columns, load=load, stated=by_attributes(stated))


def _variables(file: h5py.File) -> Iterator[tuple[str, int]]:
    """Name and length of every variable of numbers with one dimension."""
    for name in _dataset_names(file):
        item = file[name]
        is_variable = not str(_plain(item.attrs.get("NAME", ""))).startswith(_NO_VARIABLE)
        if is_variable and len(item.shape) == 1 and item.dtype.kind in "biuf":
            yield name, int(item.shape[0])


def _column(name: str, attributes: Any) -> Column:
    unit = next(
        (str(_plain(attributes[key])) for key in ("units", "unit") if key in attributes), None
    )
    since = _SINCE.match(unit) if unit else None
    kind = str(_plain(attributes["kind"])) if "kind" in attributes else None
    return column(name, unit=since[1] if since else unit, kind=kind)


def _scaled(raw: NDArray[Any], attributes: Any) -> NDArray[Any]:
    """Values as the attributes say: missing ones NaN, scaled, offset."""
    missing = np.zeros(raw.shape, dtype=np.bool_)
    for key in ("_FillValue", "missing_value"):
        if key in attributes:
            missing |= raw == _plain(attributes[key])
    scale = float(_plain(attributes["scale_factor"])) if "scale_factor" in attributes else 1.0
    offset = float(_plain(attributes["add_offset"])) if "add_offset" in attributes else 0.0
    if scale == 1.0 and offset == 0.0 and not missing.any():
        return raw
    values = raw.astype(np.float64) * scale + offset
    values[missing] = np.nan
    return values


# ---- write -------------------------------------------------------------------------


def write(path: Path, out: Outgoing) -> None:
    """One dataset per column with unit and kind, and the rate in the root's attributes."""
    with replacing(path) as temporary, h5py.File(temporary, "w") as file:
        file.attrs["remark"] = np.bytes_(MADE)
        file.attrs["sample_rate"] = out.sample_rate
        for sensor, names in out.sensors.items():
            file.attrs[sensor] = names
        for name, values in out.rows(slice(0)).items():
            dataset = file.create_dataset(name, (out.samples,), values.dtype)
            if (unit := out.units[name]) is not None:
                dataset.attrs["unit"] = unit.name
            if name in out.kinds:
                dataset.attrs["kind"] = out.kinds[name]
        for first, rows in out.parts():
            for name, values in rows.items():
                file[name][first : first + values.size] = values
