"""HDF5 files over which the library ends, or that lack what they declare: refused before."""

import math
import subprocess
import sys
from pathlib import Path
from typing import Final

import h5py

from sagnac.errors import RecordingError, one_line
from sagnac.formats.room import require_content

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
