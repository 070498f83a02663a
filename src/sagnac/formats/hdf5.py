"""HDF5, datasets in the root or in groups; NetCDF, variables. Both are scaled as attributes say.

Attributes state unit, kind and rate, too. Files over which the library ends, or that lack what they
declare, are refused before.

A file of NetCDF 4 is one of HDF5 whose datasets are the variables (CF conventions). A classic one
(NetCDF 3, or with offsets of 64 bits) is read whole; one with data of 64 bits (CDF-5) is not read.
"""

import math
import re
import subprocess
import sys
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import h5py
import numpy as np

from sagnac.core.arrays import AnyArray, blocks, reserve
from sagnac.core.errors import Note, RecordingError, one_line
from sagnac.core.whole_files import replacing
from sagnac.formats import files, registry, source
from sagnac.formats.source import Column, Source, Vector
from sagnac.formats.statement import ATTRIBUTES, by_attributes

# ---- read --------------------------------------------------------------------------

# How NetCDF marks a dimension without values of its own ("NetCDF-4 file format" in the guide).
_NO_VARIABLE: Final = "This is a netCDF dimension but not a netCDF variable"
# How the classic formats begin, before their version.
_CLASSIC: Final = b"CDF"
_DATA_OF_64_BITS: Final = b"\x05"
_MISSING: Final = ("_FillValue", "missing_value")
_OF_VARIABLE: Final = ("units", "unit", "kind", *_MISSING, "scale_factor", "add_offset")
_SINCE: Final = re.compile(r"^\s*(\w+)\s+since\s.*", re.IGNORECASE)


def open_source(path: Path) -> Source:
    """Datasets of HDF5, by their last name if no other has it; variables of NetCDF.

    Attributes of the root, or of the group that holds all datasets, may hold the keys of
    a `Statement`; those of a dataset ``unit`` (``units``) and ``kind``, and by which factor and
    offset its values are packed. Variables of NetCDF have one dimension.

    Raises
    ------
    RecordingError
        If it is NetCDF of the kind CDF-5.
    ValueError
        If the library ends over the file.
    """
    is_netcdf = path.suffix.lower() in registry.NETCDF.suffixes
    with path.open("rb") as stream:
        version = stream.read(len(_CLASSIC) + 1).removeprefix(_CLASSIC)
    if is_netcdf and version in (b"\x01", b"\x02", _DATA_OF_64_BITS):
        return _open_classic(path, version)
    require_survivable(path)
    with h5py.File(path, "r") as file:
        items: dict[str, Any] = {}
        file.visititems(items.__setitem__)
        datasets = {name: one for name, one in items.items() if isinstance(one, h5py.Dataset)}
        short = {name: name.rpartition("/")[2] for name in datasets}
        often = Counter(short.values())
        vectors: dict[str, tuple[Column, Vector]] = {}
        unreadable: dict[str, str] = {}
        for name, dataset in datasets.items():
            if _is_numeric(dataset, is_netcdf=is_netcdf):
                called = name if is_netcdf or often[short[name]] > 1 else short[name]
                for key, vector in source.vectors(called, name, dataset.shape).items():
                    vectors[key] = _column(key, dataset.attrs), vector
            elif not is_netcdf:
                unreadable[short[name]] = f"holds {dataset.dtype} values"
        stated = by_attributes(_stated(file, datasets))
        scales = {key: _scale(datasets[one.array].attrs) for key, (_, one) in vectors.items()}
    packed = [key for key, scale in scales.items() if scale != (1.0, 0.0)]
    # In NetCDF nobody expects anything else.
    fact = f"{', '.join(packed)}: taken times scale_factor, and add_offset added, as attributes say"
    notes = (Note(text=one_line(fact)),) if packed and not is_netcdf else ()

    def pieces(keys: Sequence[str], start: int, stop: int) -> source.Pieces:
        with h5py.File(path, "r") as file:
            for key in keys:
                vector = vectors[key][1]
                dataset = file[vector.array]
                for values in _read(dataset, vector, start, stop):
                    yield {key: _scaled(values, dataset.attrs)}

    def load(keys: Sequence[str]) -> source.Stored:
        with h5py.File(path, "r") as file:
            datasets = {key: file[vectors[key][1].array] for key in keys}
            for dataset in datasets.values():
                _require_own(dataset, path)
                # With a fill value, what was never written is told from what was.
                if not (is_netcdf and "_FillValue" in dataset.attrs):
                    _require_written(dataset, path)
            lengths = {key: max(dataset.shape) for key, dataset in datasets.items()}
        return source.Stored(lengths=lengths, pieces=pieces)

    columns = tuple(one for one, _ in vectors.values())
    return Source(columns=columns, load=load, stated=stated, notes=notes, unreadable=unreadable)


def _open_classic(path: Path, version: bytes) -> Source:
    """Variables of numbers of a classic file."""
    if version == _DATA_OF_64_BITS:
        remedy = f"make it NetCDF 4: nccopy -k nc4 {path.name} {path.stem}-4.nc"
        raise RecordingError("is NetCDF of the kind CDF-5, which is not read", remedy=remedy)
    # Another file needs none of that package.
    from scipy.io import netcdf_file  # noqa: PLC0415

    with netcdf_file(path, "r", mmap=False) as file:
        attributes = {
            name: {key: getattr(one, key) for key in _OF_VARIABLE if hasattr(one, key)}
            for name, one in file.variables.items()
            if len(one.shape) == 1 and one.data.dtype.kind in "biuf"
        }
        stated = {key: _plain(getattr(file, key)) for key in ATTRIBUTES if hasattr(file, key)}

    def load(keys: Sequence[str]) -> dict[str, AnyArray]:
        with netcdf_file(path, "r", mmap=False) as file:
            # They are stored with the highest byte first.
            values = {key: file.variables[key].data for key in keys}
            native = {key: one.astype(one.dtype.newbyteorder("=")) for key, one in values.items()}
        return {key: _scaled(one, attributes[key]) for key, one in native.items()}

    columns = tuple(_column(name, own) for name, own in attributes.items())
    return Source(columns=columns, load=load, stated=by_attributes(stated))


def _is_numeric(dataset: h5py.Dataset, *, is_netcdf: bool) -> bool:
    """Whether it holds real numbers, as a variable if it is one of NetCDF."""
    if dataset.dtype.kind not in "biuf" or dataset.shape is None:
        return False
    if is_netcdf:
        name = str(_plain(dataset.attrs.get("NAME", "")))
        return dataset.ndim == 1 and not name.startswith(_NO_VARIABLE)
    return bool(dataset.attrs.get("MATLAB_class", b"") != b"char")


def _stated(file: h5py.File, names: Iterable[str]) -> dict[str, Any]:
    """Statements of the attributes of the root, and of the only group with datasets."""
    parents = {name.rpartition("/")[0] for name in names}
    group = [file[parent] for parent in parents if parent and len(parents) == 1]
    held = (item for holder in (file, *group) for item in holder.attrs.items())
    return {key: _plain(value) for key, value in held if key in ATTRIBUTES}


def _column(name: str, attributes: Mapping[str, Any]) -> Column:
    stated = {key: str(_plain(attributes[key])) for key in attributes if key in _OF_VARIABLE}
    unit = stated.get("units", stated.get("unit"))
    return source.column(name, unit=unit and _SINCE.sub(r"\1", unit), kind=stated.get("kind"))


def _read(dataset: h5py.Dataset, vector: Vector, start: int, stop: int) -> Iterator[AnyArray]:
    """One column from sample `start` to the one before `stop`, in pieces of whole chunks."""
    axis = int(np.argmax(dataset.shape))
    # A compressed chunk is unpacked as often as it is touched.
    chunk = dataset.chunks[axis] if dataset.chunks else 1
    inside = slice(None) if vector.index is None else vector.index - 1
    place: list[slice | int] = [inside] * dataset.ndim
    for block in blocks(stop, start=start - start % chunk, multiple=chunk):
        place[axis] = slice(max(block.start, start), block.stop)
        yield dataset[tuple(place)].reshape(-1)


def _plain(value: Any) -> Any:
    """An attribute as text, a number, or a list of them."""
    plain = value.tolist() if isinstance(value, np.ndarray | np.generic) else value
    if isinstance(plain, list):
        return _plain(plain[0]) if len(plain) == 1 else [_plain(item) for item in plain]
    return plain.decode(errors="replace") if isinstance(plain, bytes) else plain


def _number(attributes: Mapping[str, Any], key: str, default: float) -> float:
    """A number among attributes; another attribute of that name says nothing."""
    value = _plain(attributes.get(key, default))
    return value if isinstance(value, int | float) else default


def _scale(attributes: Mapping[str, Any]) -> tuple[float, float]:
    """Factor and offset of packed values (CF conventions, "Packed Data")."""
    return _number(attributes, "scale_factor", 1.0), _number(attributes, "add_offset", 0.0)


def _scaled(raw: AnyArray, attributes: Mapping[str, Any]) -> AnyArray:
    """Values as the attributes say: missing ones NaN, scaled, offset."""
    missing = np.zeros(raw.shape, dtype=np.bool_)
    for key in _MISSING:
        if key in attributes:
            missing |= raw == _number(attributes, key, math.nan)
    scale, offset = _scale(attributes)
    if scale == 1.0 and offset == 0.0 and not missing.any():
        return raw
    values = raw.astype(np.float64) * scale + offset
    values[missing] = np.nan
    return values


# ---- sound files -------------------------------------------------------------------

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
_ENDS: Final = "the library ends over it"
PATIENCE: Final = 30.0
"""Seconds after which a library that has not read the attributes of a file hangs."""


def require_survivable(path: Path) -> None:
    """Refuse a file over which the library crashes or hangs: another process tries it first.

    The library follows the addresses of texts in attributes without a check. If no process can be
    started, the file is taken as it is.

    Raises
    ------
    ValueError
        If it is such a file.
    """
    trial = [sys.executable, "-I", "-c", _TRIAL, str(path.absolute()), str(2.0 * PATIENCE)]
    silent: dict[str, Any] = dict.fromkeys(("stdin", "stdout", "stderr"), subprocess.DEVNULL)
    try:
        tried = subprocess.run(trial, timeout=PATIENCE, check=False, **silent)
    except OSError:
        return
    except subprocess.TimeoutExpired:
        raise ValueError(_ENDS) from None
    if tried.returncode < 0:
        raise ValueError(_ENDS)


def _require_own(dataset: h5py.Dataset, path: Path) -> None:
    """Refuse a dataset whose values lie in files elsewhere, whatever file the writer has named.

    Raises
    ------
    RecordingError
        If they lie in a file of raw bytes, or parts of them out of the folder or nowhere.
    """
    name = dataset.name.lstrip("/")
    if dataset.external:
        fact = f"its values lie in another file, {one_line(str(dataset.external[0][0]))}"
        remedy = "put them into this file: h5repack -l CONTI"
        raise RecordingError(fact, channel=name, remedy=remedy)
    for part in dataset.virtual_sources() if dataset.is_virtual else ():
        file = path if part.file_name == "." else path.parent / part.file_name
        if problem := one_line(_problem_of_part(file, part.dset_name, path.parent)):
            raise RecordingError(problem, channel=name, remedy=files.AGAIN)


def _problem_of_part(file: Path, name: str, folder: Path) -> str:
    """Why a part of a virtual dataset cannot be taken; empty if it can."""
    if not file.resolve().is_relative_to(folder.resolve()):
        return f"a part of it lies outside the folder of the file, in {file}"
    if not file.is_file():
        return f"the file of a part of it, {file.name}, is not there"
    with h5py.File(file, "r") as origin:
        part = origin.get(name)
        if not isinstance(part, h5py.Dataset):
            return f"{file.name} has no dataset {name}"
        # A part that is made of parts, or linked, would lead out of the folder by a second step.
        is_own = not part.is_virtual and part.file.filename == origin.filename
        if part.external or not is_own:
            return f"{file.name} takes {name} from elsewhere in turn"
    return ""


def _require_written(dataset: h5py.Dataset, path: Path) -> None:
    """Refuse a dataset with parts that were never written, which would be read as zeros.

    Raises
    ------
    RecordingError
        If parts of it are missing.
    """
    name, missing = dataset.name.lstrip("/"), ""
    if dataset.chunks and not dataset.is_virtual:
        sides = zip(dataset.shape, dataset.chunks, strict=True)
        chunks = math.prod(-(-length // chunk) for length, chunk in sides)
        written = dataset.id.get_num_chunks()
        missing = f"{chunks - written} of {chunks} chunks were never written" * (written < chunks)
        files.require_content(dataset.nbytes, path.stat().st_size, name)
    elif not dataset.is_virtual and dataset.id.get_storage_size() < dataset.nbytes:
        missing = "its values were never written"
    if missing:
        raise RecordingError(missing, channel=name, remedy=files.AGAIN)


# ---- write -------------------------------------------------------------------------


def write(path: Path, out: source.Outgoing) -> None:
    """One dataset per column with unit and kind, and the rate in the root's attributes."""
    with replacing(path) as temporary:
        # The library takes the process with it when a disk fills up.
        with temporary.open("wb") as room:
            reserve(room.fileno(), 2**14 + 8 * out.samples * len(out.units))
        with h5py.File(temporary, "w") as file:
            facts = {"remark": np.bytes_(source.MADE), "sample_rate": out.sample_rate}
            file.attrs.update({**facts, **out.sensors})
            for name, values in out.rows(slice(0)).items():
                dataset = file.create_dataset(name, (out.samples,), values.dtype)
                if (unit := out.units[name]) is not None:
                    dataset.attrs["unit"] = unit.name
                if name in out.kinds:
                    dataset.attrs["kind"] = out.kinds[name]
            for block in blocks(out.samples):
                for name, values in out.rows(block).items():
                    file[name][block] = values
