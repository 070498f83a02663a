"""MATLAB files of version 5 (and 4). Those of version 7.3 are HDF5."""

import math
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import scipy.io

from sagnac.formats.files import damaged, replacing
from sagnac.formats.matlab_elements import Element, elements_of, field_values
from sagnac.formats.metadata import from_mapping
from sagnac.formats.outgoing import MADE, Outgoing
from sagnac.formats.registry import MATLAB
from sagnac.formats.room import require_room
from sagnac.formats.source import Source, Stored, Vector, column, in_memory, vectors

_NUMERIC: Final = frozenset(
    {"double", "single", "logical"}
    | {f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)}
)
_STATED: Final = frozenset(
    {
        "gyros",
        "accelerometers",
        "kind",
        "unit",
        "scale",
        "sample_rate",
        "counter_bits",
        "counter_period",
    }
)

# Bytes of a file that say in words what it is.
_DESCRIPTION: Final = 116


def open_source(path: Path) -> Source:
    """Variables of the file; column ``k`` of a matrix ``w`` is called ``w.k``, from 1.

    A field of a struct is called by its name if no other is called so, else ``imu.gyro``.

    Text and single numbers named like the fields of a `Statement` (``kind``,
    ``sample_rate``) state it.

    Raises
    ------
    RecordingError
        If the file is not MATLAB or is cut off.
    """
    with damaged(MATLAB.name):
        # The library trusts tags, and reads memory that is not its own where they lie.
        elements = _elements(path)
        listing = scipy.io.whosmat(path)
        stated_names = [
            name
            for name, shape, kind in listing
            if name in _STATED and (kind == "char" or shape == (1, 1))
        ]
        content = scipy.io.loadmat(path, variable_names=stated_names) if stated_names else {}
        stated = {name: content[name].reshape(-1)[0].item() for name in stated_names}
    found: dict[str, Vector] = {}
    unreadable: dict[str, str] = {}
    fields = {name: one for name, one in elements.items() if one.place or one.holds}
    structs = {name.split(".")[0] for name in fields}
    for name, shape, kind in listing:
        if name in stated_names or name in structs:
            continue
        if kind not in _NUMERIC:
            unreadable[name] = f"holds {kind} values"
        elif name in elements and elements[name].is_complex:
            unreadable[name] = "holds complex values"
        else:
            found.update(vectors(name, name, shape))

    last = Counter(name.split(".")[-1] for name in [*fields, *found, *unreadable])
    for name, one in fields.items():
        short = name.split(".")[-1]
        if one.holds or one.is_complex:
            unreadable[name] = f"holds {one.holds or 'complex values'}"
        else:
            found.update(vectors(short if last[short] == 1 else name, name, one.shape))

    def load(keys: Sequence[str]) -> Stored:
        with damaged(MATLAB.name):
            arrays = list({found[key].array for key in keys})
            names = [name for name in arrays if name not in fields]
            for name, shape, _ in listing:
                if name in names:
                    require_room(8 * math.prod(shape), name)
            content = scipy.io.loadmat(path, variable_names=names) if names else {}
            for name in arrays:
                if name in fields:
                    content[name] = field_values(path, fields[name])
            return in_memory({key: found[key].of(content[found[key].array]) for key in keys})

    return Source(
        format=MATLAB.name,
        columns=tuple(column(key) for key in found),
        load=load,
        stated=from_mapping(stated),
        unreadable=unreadable,
    )


def _elements(path: Path) -> dict[str, Element]:
    """The variables of a version 5 file, checked; none of one of version 4."""
    with path.open("rb") as stream:
        if stream.read(len(MATLAB.beginning)) != MATLAB.beginning:
            return {}
    return {element.name: element for element in elements_of(path)}


def write(path: Path, out: Outgoing) -> None:
    """A MATLAB 5 file: one variable per column and the statement as text and numbers."""
    with replacing(path) as temporary, temporary.open("wb") as stream:
        columns = {name: values[:, None] for name, values in out.rows(slice(None)).items()}
        scipy.io.savemat(stream, {**columns, **out.statement()})
        stream.seek(0)
        stream.write(f"MATLAB 5.0 MAT-file, {MADE}".ljust(_DESCRIPTION).encode())
