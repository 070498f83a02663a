"""One room per file format: path -> Recording, Recording -> path.

A room (`csv`, `parquet`, `matlab`, `npz`, `psins`, `hdf5`) opens a file as a `Source`:
its columns, what it states about them, and how to load them. `assemble` builds the
recording from that and from what the caller (`Statement`) and a TOML beside the file
state, heard in this order: caller, TOML, file.
"""

import hashlib
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Final

from sagnac.errors import RecordingError
from sagnac.formats import csv, hdf5, matlab, npz, parquet, psins
from sagnac.formats.assemble import assemble
from sagnac.formats.source import Outgoing, Source, outgoing
from sagnac.formats.statement import Statement, beside
from sagnac.recording.model import Provenance, Recording

__all__ = ["Statement", "columns", "read", "write"]

_OPENERS: Final[dict[str, Callable[[Path], Source]]] = {
    suffix: room.open_source
    for room in (csv, parquet, matlab, npz, psins, hdf5)
    for suffix in room.SUFFIXES
}
_WRITERS: Final[dict[str, Callable[[Path, Outgoing], None]]] = {
    suffix: room.write for room in (csv, parquet, matlab, npz, hdf5) for suffix in room.SUFFIXES
}
# How the formats begin, and the suffixes that go with it.
_BEGINNINGS: Final[tuple[tuple[bytes, str, tuple[str, ...]], ...]] = (
    (b"PAR1", "Parquet", parquet.SUFFIXES),
    (b"PK\x03\x04", "NumPy npz", npz.SUFFIXES),
    (b"\x89HDF\r\n\x1a\n", "HDF5", (*hdf5.SUFFIXES, *matlab.SUFFIXES)),
    (b"MATLAB 5", "MATLAB", matlab.SUFFIXES),
    (b"MATLAB 7", "MATLAB", (*matlab.SUFFIXES, *hdf5.SUFFIXES)),
)


def read(path: Path | str, statement: Statement | None = None, *, verify: bool = True) -> Recording:
    """Read a recording.

    Parameters
    ----------
    path
        The file; its suffix says the format.
    statement
        What the caller states. It is heard before a TOML beside the file, and that before
        the file.
    verify
        Refuse data that are not sound (`sagnac.recording.integrity`). Without, they come
        as they are, for `sagnac.recording.check`.

    Returns
    -------
    recording
        In SI, with the file's SHA-256 and every note.

    Raises
    ------
    RecordingError
        If the file cannot be read, or does not state what it has to, or is not sound: one
        line with the file, the channel and the remedy.
    """
    path = Path(path)
    source = _open(path)
    caller = statement or Statement()
    toml, notes = beside(path)
    with ThreadPoolExecutor(max_workers=1) as pool:
        # Hashing needs no lock of the interpreter: it runs while the columns are parsed.
        digest = pool.submit(_sha256, path)
        return assemble(
            path,
            source,
            (caller, toml, source.stated),
            lambda: Provenance(path=str(path), sha256=digest.result(), format=source.format),
            (*source.notes, *notes),
            verify=verify,
        )


def columns(path: Path | str) -> tuple[str, ...]:
    """Names of the numeric columns of a file, as it writes them.

    Raises
    ------
    RecordingError
        If the file cannot be read.
    """
    return tuple(column.key for column in _open(Path(path)).columns)


def write(recording: Recording, path: Path | str) -> Path:
    """Write a recording in the format that the suffix names; `read` needs no option for it.

    Values are in the unit they came in where that is a plain one, else in arcsec, deg/h
    and, for the table, deg. A CSV gets a TOML beside it for kind and rate.

    Returns
    -------
    path
        The file written; it appears only when it is whole.

    Raises
    ------
    RecordingError
        If the format is not known or the file cannot be written.
    """
    path = Path(path)
    room = _WRITERS.get(path.suffix.lower())
    if room is None:
        raise RecordingError(
            f"{path}: no format to write has this suffix; use one of {', '.join(_WRITERS)}"
        )
    room(path, outgoing(recording))
    return path


def _open(path: Path) -> Source:
    try:
        with path.open("rb") as stream:
            beginning = stream.read(16)
    except FileNotFoundError:
        raise RecordingError(f"{path}: no such file; check the path") from None
    except OSError as error:
        raise RecordingError(
            f"{path}: cannot be opened ({error.strerror}); check the path and its permissions"
        ) from None
    opener = _OPENERS.get(path.suffix.lower())
    if opener is None:
        raise RecordingError(
            f"{path}: no format has this suffix; convert the file to one of {', '.join(_OPENERS)}"
        )
    if not beginning:
        raise RecordingError(f"{path}: is empty; get the file again from its source")
    for magic, name, suffixes in _BEGINNINGS:
        if beginning.startswith(magic) and path.suffix.lower() not in suffixes:
            raise RecordingError(
                f"{path}: is {name}, not what its suffix claims; rename it to end in {suffixes[0]}"
            )
    return opener(path)


def _sha256(path: Path) -> str:
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()
