"""MATLAB files of version 5 (and 4). Those of version 7.3 are HDF5."""

from collections.abc import Sequence
from pathlib import Path
from typing import Final, Literal

import scipy.io

from sagnac.formats.files import damaged, replacing
from sagnac.formats.metadata import from_mapping
from sagnac.formats.outgoing import Outgoing
from sagnac.formats.registry import MATLAB
from sagnac.formats.source import Source, Stored, Vector, column, in_memory, vectors

_NUMERIC: Final = frozenset(
    {"double", "single", "logical"}
    | {f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)}
)
_STATED: Final = frozenset(
    {"gyros", "accelerometers", "kind", "unit", "scale", "sample_rate", "counter_bits"}
)


def open_source(path: Path) -> Source:
    """Variables of the file; column ``k`` of a matrix ``w`` is called ``w.k``, from 1.

    Text and single numbers named like the fields of a `Statement` (``kind``,
    ``sample_rate``) state it.

    Raises
    ------
    RecordingError
        If the file is not MATLAB or is cut off.
    """
    with damaged(MATLAB.name):
        check_whole(path)
        listing = scipy.io.whosmat(path)
        stated_names = [
            name
            for name, shape, kind in listing
            if name in _STATED and (kind == "char" or shape == (1, 1))
        ]
        content = scipy.io.loadmat(path, variable_names=stated_names) if stated_names else {}
        stated = {name: content[name].reshape(-1)[0].item() for name in stated_names}
    found: dict[str, Vector] = {}
    for name, shape, kind in listing:
        if kind in _NUMERIC and name not in stated_names:
            found.update(vectors(name, name, shape))

    def load(keys: Sequence[str]) -> Stored:
        with damaged(MATLAB.name):
            names = list({found[key].array for key in keys})
            content = scipy.io.loadmat(path, variable_names=names)
            return in_memory({key: found[key].of(content[found[key].array]) for key in keys})

    return Source(
        format=MATLAB.name,
        columns=tuple(column(key) for key in found),
        load=load,
        stated=from_mapping(stated),
    )


def check_whole(path: Path) -> None:
    """Refuse a version 5 file that ends inside an element; pass over one of version 4.

    The file has no index: cut off, it reads as one with fewer variables. Each element says
    its length in 8 bytes before it (MAT-File Format, "Data Element Format").

    Raises
    ------
    ValueError
        If the last element is not all there.
    """
    size = path.stat().st_size
    with path.open("rb") as stream:
        if stream.read(len(MATLAB.beginning)) != MATLAB.beginning:
            return
        stream.seek(126)
        order: Literal["little", "big"] = "little" if stream.read(2) == b"IM" else "big"
        position = 128
        while position < size:
            stream.seek(position + 4)
            position += 8 + int.from_bytes(stream.read(4), order)
    if position != size:
        raise ValueError(f"{position - size} bytes are missing")


def write(path: Path, out: Outgoing) -> None:
    """A MATLAB 5 file: one variable per column and the statement as text and numbers."""
    with replacing(path) as temporary, temporary.open("wb") as stream:
        columns = {name: values[:, None] for name, values in out.rows(slice(None)).items()}
        scipy.io.savemat(stream, {**columns, **out.statement()})
