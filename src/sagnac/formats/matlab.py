"""MATLAB files of version 5 (and 4). Those of version 7.3 are HDF5.

Where a tag of a file says what cannot be, the library reads memory that is not its own: the tags of
what it is to read are checked before. MAT-File Format (The MathWorks), "Level 5 MAT-File Format":
each element has a tag of 8 bytes, its type and its length; small ones have both in 4. A matrix
holds array flags, dimensions, name and data, each such an element.
"""

import math
import re
import zlib
from collections import Counter
from collections.abc import Collection, Iterator, Sequence
from itertools import chain, repeat
from pathlib import Path
from typing import Any, Final

import numpy as np
import scipy.io
from numpy.typing import NDArray

from sagnac.core import errors, whole_files
from sagnac.formats.files import require_room
from sagnac.formats.source import MADE, Outgoing, Source, Vector, column, vectors
from sagnac.formats.statement import ARRAYS_STATED, from_mapping

Bytes = NDArray[np.uint8]

# ---- read --------------------------------------------------------------------------

# The beginning of a table of numbers in text.
_NUMBERS: Final = re.compile(rb"[\s\d.,;+\-eE]+")


def open_source(path: Path) -> Source:
    """Variables of the file; column ``k`` of a matrix ``w`` is called ``w.k``, from 1.

    A field of a struct is called by its name if no other is called so, else ``imu.gyro``.

    Text and single numbers named like the fields of a `Statement` (``kind``,
    ``sample_rate``) state it.

    Raises
    ------
    ValueError
        If an element is not all there, or a tag says what cannot be.
    RecordingError
        If it is a table of text.
    """
    with path.open("rb") as stream:
        if _NUMBERS.fullmatch(stream.read(256)):
            fact = "is text, as MATLAB writes it with save -ascii"
            raise errors.RecordingError(fact, remedy="give it the suffix .txt")
    are_complex = require_sound(path)
    stated: list[str] = []
    structs: list[str] = []
    held: dict[str, tuple[tuple[int, ...], str]] = {}
    for place, (name, shape, kind) in enumerate(scipy.io.whosmat(path)):
        if name in ARRAYS_STATED and (kind == "char" or shape == (1, 1)):
            stated.append(name)
        elif kind == "struct" and shape == (1, 1):
            structs.append(name)
        else:
            held[name] = shape, "complex" if place in are_complex else kind
    fields = {name: (one.shape, _class_of(one)) for name, one in _values(path, structs).items()}
    # An array of nothing is no column, and nothing is wrong with it.
    held |= {name: one for name, one in fields.items() if one[0] != (0, 0)}
    problems = {name: _problem_of(kind) for name, (_, kind) in held.items()}
    last = Counter(name.split(".")[-1] for name in held)
    named: dict[str, Vector] = {}
    for name, (shape, _) in held.items():
        short = name.split(".")[-1]
        if not problems[name]:
            named.update(vectors(short if last[short] == 1 else name, name, shape))

    def load(keys: Sequence[str]) -> dict[str, NDArray[Any]]:
        arrays = {named[key].array for key in keys}
        for name in sorted(arrays):
            require_room(8 * math.prod(held[name][0]), name)
        values = _values(path, {name.split(".")[0] if name in fields else name for name in arrays})
        return {key: named[key].of(values[named[key].array]) for key in keys}

    facts = {name: (one.ravel().tolist() or [""])[0] for name, one in _values(path, stated).items()}
    unreadable = {name: problem for name, problem in problems.items() if problem}
    columns = tuple(column(key) for key in named)
    return Source(columns=columns, load=load, stated=from_mapping(facts), unreadable=unreadable)


def _values(path: Path, names: Collection[str]) -> dict[str, NDArray[Any]]:
    """Variables by name, once their tags are checked; of a struct its fields instead."""
    if not names:
        return {}
    require_sound(path, names)
    codec = {}
    if scipy.io.matlab.matfile_version(path)[0] == 1:
        codec["uint16_codec"] = "utf-16-le" if _word_of(path) == "<u4" else "utf-16-be"
    content = scipy.io.loadmat(path, variable_names=names, mat_dtype=True, **codec)
    return dict(chain.from_iterable(_fields(name, content[name]) for name in names))


def _fields(name: str, value: NDArray[Any]) -> Iterator[tuple[str, NDArray[Any]]]:
    """An array, or the fields of a struct, those of structs in it as well."""
    if _class_of(value) == "struct" and value.size == 1:
        for field in value.dtype.names or ():
            yield from _fields(f"{name}.{field}", value[field].flat[0])
    else:
        yield name, value


def _class_of(value: Any) -> str:
    """Class of an array: that of numbers as numpy calls it, and the type of what is no array."""
    if type(value) is not np.ndarray:
        return type(value).__name__
    classes = {"U": "char", "c": "complex", "O": "cell", "V": "struct"}
    return classes.get(value.dtype.kind, str(value.dtype))


def _problem_of(kind: str) -> str:
    """Why an array of a class is no column; empty if it may be one or more."""
    # Classes of arrays of numbers as MATLAB and as numpy call them.
    if re.fullmatch(r"double|single|logical|bool|float\d+|u?int\d+", kind):
        return ""
    return "holds text" if kind == "char" else f"holds {kind} values"


# ---- tags --------------------------------------------------------------------------

_MATRIX: Final = 14
_COMPRESSED: Final = 15
# Bytes of a matrix up to its flags, and these.
_HEAD: Final = 24


def require_sound(path: Path, names: Collection[str] = ()) -> set[int]:
    """Refuse a file that is cut off, and variables of those names whose tags say what cannot be.

    Returns
    -------
    set of int
        Places of the variables that are complex.

    Raises
    ------
    ValueError
        If it is such a file.
    """
    if scipy.io.matlab.matfile_version(path)[0] != 1:
        return set()
    content, word, found = np.memmap(path, np.uint8, "r"), _word_of(path), set()
    listed = [name in names for name, _, _ in scipy.io.whosmat(path)] if names else repeat(False)
    pairs = zip(_elements(content[128:], word), listed, strict=False)
    for place, ((kind, packed), is_wanted) in enumerate(pairs):
        part = packed
        if kind == _COMPRESSED:
            # The head of a matrix, or all of it.
            part = _unpacked(packed, _HEAD)
            if is_wanted:
                length = _HEAD + int(part[4:8].view(word)[0])
                require_room(length, "a variable")
                part = _unpacked(packed, length)
            part = part[8:] if part[:4].view(word)[0] == _MATRIX else part[:0]
        if not part.size or kind not in (_MATRIX, _COMPRESSED):
            raise ValueError(f"an element of type {kind} holds no matrix")
        if is_wanted:
            _require_matrix(part, word)
        # The flag of complex numbers.
        if int(part[8:12].view(word)[0]) & 0x800:
            found.add(place)
    return found


def _word_of(path: Path) -> np.dtype[Any]:
    """Whole numbers of a file as numpy reads them, by the order of their bytes."""
    return np.dtype("<u4" if np.memmap(path, np.uint8, "r")[126] == ord("I") else ">u4")


def _unpacked(packed: Bytes, most: int) -> Bytes:
    return np.frombuffer(zlib.decompressobj().decompress(packed.data, most), np.uint8)


def _require_matrix(content: Bytes, word: np.dtype[Any]) -> None:
    """Refuse a matrix with an element of a type that is none, or that its class cannot have."""
    # Types of data: numbers of 1 to 8 bytes, and text of UTF-8, -16 and -32.
    known = {1, 2, 3, 4, 5, 6, 7, 9, 12, 13, 16, 17, 18}
    for number, (kind, part) in enumerate(_elements(content, word)):
        if number == 0:
            if (kind, part.size) != (6, 8):
                raise ValueError("a matrix does not begin with its flags")
            # Cells, structs, objects, functions and opaque arrays hold others.
            known |= {_MATRIX} if part[:4].view(word)[0] & 0xFF in (1, 2, 3, 16, 17) else set()
        if kind not in known:
            raise ValueError(f"an element of a matrix is of type {kind}")
        if kind == _MATRIX:
            _require_matrix(part, word)


def _elements(content: Bytes, word: np.dtype[Any]) -> Iterator[tuple[int, Bytes]]:
    """Type and content of elements that follow one another.

    Raises
    ------
    ValueError
        If one is not all there.
    """
    at = 0
    while at < content.size:
        if at + 8 > content.size:
            raise ValueError(f"{at + 8 - content.size} bytes are missing")
        kind, length = content[at : at + 8].view(word).tolist()
        start, after = at + 8, at + 8 + length
        if small := kind >> 16:
            if small > 4:
                raise ValueError(f"a small element claims {small} bytes")
            kind, length, start, after = kind & 0xFFFF, small, at + 4, at + 8
        elif kind not in (_MATRIX, _COMPRESSED):
            after = start + -(-length // 8) * 8
        if start + length > content.size:
            raise ValueError(f"{start + length - content.size} bytes are missing")
        yield kind, content[start : start + length]
        at = after


# ---- write -------------------------------------------------------------------------


def write(path: Path, out: Outgoing) -> None:
    """A MATLAB 5 file: one variable per column and the statement as text and numbers."""
    with whole_files.replacing(path) as temporary, temporary.open("wb") as stream:
        columns = {name: values[:, None] for name, values in out.rows(slice(None)).items()}
        scipy.io.savemat(stream, {**columns, **out.statement()})
        stream.seek(0)
        # The first 116 bytes of a file say in words what it is.
        stream.write(f"MATLAB 5.0 MAT-file, {MADE}".ljust(116).encode())
