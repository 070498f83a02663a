"""NetCDF: variables of one dimension, scaled as their attributes say (CF conventions).

A file of NetCDF 4 is one of HDF5 whose datasets are the variables. A classic one (NetCDF 3, or with
offsets of 64 bits) is read whole; one with data of 64 bits (CDF-5) is not read.
"""

import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Final

import h5py
import numpy as np
from numpy.typing import NDArray
from scipy.io import netcdf_file

from sagnac.arrays import blocks
from sagnac.errors import RecordingError
from sagnac.formats.files import damaged
from sagnac.formats.hdf5 import (
    dataset_names,
    plain,
    require_own,
    require_survivable,
    require_whole,
)
from sagnac.formats.registry import NETCDF
from sagnac.formats.source import Column, Source, Stored, column, in_memory
from sagnac.formats.statement import ATTRIBUTES, by_attributes

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


def open_source(path: Path) -> Source:
    """Variables of numbers, of NetCDF 4 in groups too.

    Attributes of the file may hold the keys of a `Statement`; those of a variable ``units`` and
    ``kind``.

    Raises
    ------
    RecordingError
        If the file is not NetCDF or is cut off.
    """
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
        stated = {key: plain(file.attrs[key]) for key in file.attrs if key in ATTRIBUTES}

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
                require = require_own if "_FillValue" in file[key].attrs else require_whole
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
        stated = {key: plain(getattr(file, key)) for key in ATTRIBUTES if hasattr(file, key)}

    def load(keys: Sequence[str]) -> Stored:
        with damaged(NETCDF.name), netcdf_file(path, "r", mmap=False) as file:
            values = {key: np.array(file.variables[key].data) for key in keys}
        # They are stored with the highest byte first.
        native = {key: one.astype(one.dtype.newbyteorder("=")) for key, one in values.items()}
        return in_memory({key: _scaled(one, attributes[key]) for key, one in native.items()})

    return Source(format=NETCDF.name, columns=columns, load=load, stated=by_attributes(stated))


def _variables(file: h5py.File) -> Iterator[tuple[str, int]]:
    """Name and length of every variable of numbers with one dimension."""
    for name in dataset_names(file):
        item = file[name]
        is_variable = not str(plain(item.attrs.get("NAME", ""))).startswith(_NO_VARIABLE)
        if is_variable and len(item.shape) == 1 and item.dtype.kind in "biuf":
            yield name, int(item.shape[0])


def _column(name: str, attributes: Any) -> Column:
    unit = next(
        (str(plain(attributes[key])) for key in ("units", "unit") if key in attributes), None
    )
    since = _SINCE.match(unit) if unit else None
    kind = str(plain(attributes["kind"])) if "kind" in attributes else None
    return column(name, unit=since[1] if since else unit, kind=kind)


def _scaled(raw: NDArray[Any], attributes: Any) -> NDArray[Any]:
    """Values as the attributes say: missing ones NaN, scaled, offset."""
    missing = np.zeros(raw.shape, dtype=np.bool_)
    for key in ("_FillValue", "missing_value"):
        if key in attributes:
            missing |= raw == plain(attributes[key])
    scale = float(plain(attributes["scale_factor"])) if "scale_factor" in attributes else 1.0
    offset = float(plain(attributes["add_offset"])) if "add_offset" in attributes else 0.0
    if scale == 1.0 and offset == 0.0 and not missing.any():
        return raw
    values = raw.astype(np.float64) * scale + offset
    values[missing] = np.nan
    return values
