"""MATLAB files of version 5 (and 4). Those of version 7.3 are HDF5.

Numbers are read where the tags of a file say, which are checked: a library that trusts them reads
memory that is not its own. MAT-File Format (The MathWorks), "Level 5 MAT-File Format": each element
has a tag of 8 bytes, its type and its length; small ones have both in 4. A matrix holds array
flags, dimensions, name and data, each such an element.
"""

import math
import zlib
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO, Final

import numpy as np
import scipy.io
from numpy.typing import NDArray

from sagnac.core.whole_files import replacing
from sagnac.formats.files import require_room
from sagnac.formats.registry import MATLAB
from sagnac.formats.source import MADE, Outgoing, Source, Vector, column, vectors
from sagnac.formats.statement import ARRAYS_STATED, from_mapping

# ---- read --------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class Element:
    """A variable, or a field of a struct.

    Attributes
    ----------
    name
        As in MATLAB: that of a field is ``imu.gyro``.
    shape
        Of its array.
    kind
        Class of the array.
    is_complex
        Whether it has imaginary parts.
    begin
        Where in the file the variable begins.
    data
        Where in that the numbers or characters lie; None if there are none.
    """

    name: str
    shape: tuple[int, ...]
    kind: str
    is_complex: bool = False
    begin: int = 0
    data: "Tag | None" = None

    @property
    def is_struct(self) -> bool:
        """Whether it is one struct."""
        return self.kind == "struct" and math.prod(self.shape) == 1

    @property
    def problem(self) -> str:
        """Why it is no column; empty if it may be one or more."""
        if self.kind not in _NUMERIC:
            return f"holds {'text' if self.kind == 'char' else f'{self.kind} values'}"
        return "holds complex values" if self.is_complex else ""


def open_source(path: Path) -> Source:
    """Variables of the file; column ``k`` of a matrix ``w`` is called ``w.k``, from 1.

    A field of a struct is called by its name if no other is called so, else ``imu.gyro``.

    Text and single numbers named like the fields of a `Statement` (``kind``,
    ``sample_rate``) state it.

    Raises
    ------
    ValueError
        If an element is not all there, or a tag says what cannot be.
    """
    with path.open("rb") as stream:
        is_5 = stream.read(len(MATLAB.beginning)) == MATLAB.beginning
    every = elements_of(path) if is_5 else _elements_of_4(path)
    values_of = _values_of_5 if is_5 else _values_of_4
    stated: dict[str, Element] = {}
    elements: dict[str, Element] = {}
    for one in every:
        is_one = one.kind == "char" or one.shape == (1, 1)
        (stated if is_one and one.name in ARRAYS_STATED else elements)[one.name] = one
    problems = {name: one.problem for name, one in elements.items()}
    last = Counter(name.split(".")[-1] for name in elements)
    found: dict[str, Vector] = {}
    for name, one in elements.items():
        short = name.split(".")[-1]
        if not problems[name]:
            found.update(vectors(short if last[short] == 1 else name, name, one.shape))

    def load(keys: Sequence[str]) -> dict[str, NDArray[Any]]:
        arrays = {name: elements[name] for name in sorted({found[key].array for key in keys})}
        for name, one in arrays.items():
            require_room(8 * math.prod(one.shape), name)
        values = values_of(path, arrays)
        return {key: found[key].of(values[found[key].array]) for key in keys}

    facts = {name: one.reshape(-1)[0].item() for name, one in values_of(path, stated).items()}
    unreadable = {name: problem for name, problem in problems.items() if problem}
    columns = tuple(column(key) for key in found)
    return Source(columns=columns, load=load, stated=from_mapping(facts), unreadable=unreadable)


def _elements_of_4(path: Path) -> Iterator[Element]:
    for name, shape, kind in scipy.io.whosmat(path):
        yield Element(name=name, shape=shape, kind=kind)


def _values_of_4(path: Path, elements: Mapping[str, Element]) -> Mapping[str, NDArray[Any]]:
    content = scipy.io.loadmat(path, variable_names=list(elements)) if elements else {}
    return {name: content[name] for name in elements}


# ---- version 5 ---------------------------------------------------------------------

_MATRIX: Final = 14
_COMPRESSED: Final = 15
# One number by data type, as NumPy writes it.
_NUMBERS: Final = {
    1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8",
}  # fmt: skip
# Codec of text by data type; byte order is that of the file.
_TEXT: Final = {
    1: "latin-1", 2: "latin-1", 3: "utf-16", 4: "utf-16", 16: "utf-8", 17: "utf-16", 18: "utf-32",
}  # fmt: skip
_CLASSES: Final = {
    1: "cell", 2: "struct", 3: "object", 4: "char", 5: "sparse", 6: "double", 7: "single",
    8: "int8", 9: "uint8", 10: "int16", 11: "uint16", 12: "int32", 13: "uint32", 14: "int64",
    15: "uint64", 16: "function", 17: "opaque",
}  # fmt: skip
_NUMERIC: Final = frozenset(_CLASSES[code] for code in range(6, 16)) | {"logical"}
_COMPLEX: Final = 0x08
# Bytes in which the head of a matrix ends: names are no longer than 63, dimensions few.
_HEAD: Final = 2**16
# Structs in structs, as deep as anybody makes them.
_DEEPEST: Final = 16


@dataclass(frozen=True, slots=True, kw_only=True)
class Tag:
    """Type and length of an element, where its content starts, and where the next one does."""

    kind: int
    length: int
    start: int
    after: int


@dataclass(frozen=True, slots=True, kw_only=True)
class _Variable:
    """Content of a variable, unpacked: all of it or its head, and how long the whole is."""

    content: bytes
    length: int
    order: str
    begin: int

    def numbers(self, at: int, count: int, kind: str = "u4") -> list[int]:
        """Integers that stand at a place."""
        found: list[int] = np.frombuffer(self.content, self.order + kind, count, at).tolist()
        return found

    def tag(self, at: int) -> Tag:
        """The tag at a place."""
        word, length = self.numbers(at, 2)
        if small := word >> 16:
            if small > 4:
                raise ValueError(f"a small element claims {small} bytes")
            return Tag(kind=word & 0xFFFF, length=small, start=at + 4, after=at + 8)
        return Tag(kind=word, length=length, start=at + 8, after=at + 8 + -(-length // 8) * 8)

    def tags(self, at: int, count: int) -> list[Tag]:
        """Tags one after another."""
        found = [self.tag(at)]
        while len(found) < count:
            found.append(self.tag(found[-1].after))
        return found

    def of(self, tag: Tag) -> bytes:
        """Content of the element of a tag."""
        return self.content[tag.start : tag.start + tag.length]


def elements_of(path: Path) -> Iterator[Element]:
    """The variables of a file of version 5, their tags checked; of a struct its fields instead.

    Of an array of structs there are no fields.

    Raises
    ------
    ValueError
        If an element is not all there, or a tag says what cannot be.
    """
    size, begin = path.stat().st_size, 128
    with path.open("rb") as stream:
        while begin < size:
            variable, after = _variable(stream, begin, most=_HEAD)
            if after > size:
                raise ValueError(f"{after - size} bytes are missing")
            if variable.length:
                found = _element(variable, 0, variable.length)
                if found.is_struct:
                    variable, _ = _variable(stream, begin)
                    yield from _fields(variable, 0, found.name)
                else:
                    yield found
            begin = after


def _variable(stream: BinaryIO, begin: int, *, most: int | None = None) -> tuple[_Variable, int]:
    """A variable, or its head of that many bytes, and where the next one begins."""
    stream.seek(126)
    order = "<" if stream.read(2) == b"IM" else ">"
    stream.seek(begin)
    head = stream.read(8)
    if len(head) < 8:
        raise ValueError(f"{8 - len(head)} bytes are missing")

    def tag(head: bytes) -> tuple[int, int]:
        kind, length = np.frombuffer(head, f"{order}u4", 2).tolist()
        if most is None:
            require_room(length, "a variable")
        return kind, length

    kind, length = tag(head)
    after = begin + 8 + length
    content = stream.read(length if most is None else min(length, most))
    if kind == _COMPRESSED:
        unpacking = zlib.decompressobj()
        kind, length = tag(unpacking.decompress(content, 8))
        content = unpacking.decompress(unpacking.unconsumed_tail, max(most or length, 1))
    if kind != _MATRIX:
        raise ValueError(f"an element is of type {kind}, not a matrix")
    return _Variable(content=content, length=length, order=order, begin=begin), after


def _element(variable: _Variable, at: int, stop: int, name: str = "") -> Element:
    """The matrix whose flags are at a place, and which ends before `stop`."""
    flags = variable.tag(at)
    if (flags.kind, flags.length) != (6, 8):
        raise ValueError("a matrix does not begin with its flags")
    (word,) = variable.numbers(flags.start, 1)
    kind = _CLASSES.get(word & 0xFF, "unknown")
    if kind == "opaque":
        return Element(name=name, shape=(), kind=kind)
    dimensions, title = variable.tags(flags.after, 2)
    if dimensions.kind not in (5, 6) or dimensions.length % 4 or not 8 <= dimensions.length <= 256:
        raise ValueError("the dimensions of a matrix are damaged")
    shape = tuple(variable.numbers(dimensions.start, dimensions.length // 4, "i4"))
    if title.kind not in (1, 2, 16) or title.length > 1024 or min(shape) < 0:
        raise ValueError("the name or the shape of a matrix is damaged")
    name, numbers, data = name or variable.of(title).decode("latin-1"), math.prod(shape), None
    if numbers and (kind in _NUMERIC or kind == "char"):
        data = variable.tag(title.after)
        if data.kind not in (_TEXT if kind == "char" else _NUMBERS):
            raise ValueError(f"{name} holds {kind} of type {data.kind}")
        size = data.length if kind == "char" else numbers * int(_NUMBERS[data.kind][1])
        if data.start + data.length > stop or data.length != size:
            said = f"{name} has {numbers} numbers in {data.length} bytes of type {data.kind}"
            raise ValueError(said)
    is_complex = bool(word >> 8 & _COMPLEX)
    return Element(
        name=name, shape=shape, kind=kind, is_complex=is_complex, begin=variable.begin, data=data
    )


def _fields(variable: _Variable, at: int, above: str, depth: int = 0) -> Iterator[Element]:
    """The fields of a struct whose matrix begins there, those of structs in it as well."""
    if depth >= _DEEPEST:
        raise ValueError(f"{above} holds structs {depth} deep")
    # Flags, dimensions, name, bytes of each field's name, and these names.
    *_, longest, listed = variable.tags(at, 5)
    (length,) = variable.numbers(longest.start, 1, "i4")
    if not 0 < length <= _HEAD or listed.length % length:
        raise ValueError(f"the fields of {above} are damaged")
    words, at = variable.of(listed).decode("latin-1"), listed.after
    for place in range(0, listed.length, length):
        name = f"{above}.{words[place : place + length].partition(chr(0))[0]}"
        tag = variable.tag(at)
        at = tag.start + tag.length
        if tag.kind != _MATRIX or at > len(variable.content):
            raise ValueError(f"{name} is cut off")
        found = _element(variable, tag.start, at, name) if tag.length else None
        if found is not None and found.is_struct:
            yield from _fields(variable, tag.start, name, depth + 1)
        elif found is not None and (found.data or found.problem):
            yield found


def _values_of_5(path: Path, elements: Mapping[str, Element]) -> Mapping[str, NDArray[Any]]:
    """Numbers in their shape; of text the first row."""
    values: dict[str, NDArray[Any]] = {}
    variable = None
    with path.open("rb") as stream:
        for name, one in sorted(elements.items(), key=lambda item: item[1].begin):
            if variable is None or variable.begin != one.begin:
                variable, _ = _variable(stream, one.begin)
            if one.data is None:
                values[name] = np.zeros(one.shape)
                continue
            data = variable.of(one.data)
            if one.kind == "char":
                codec, end = _TEXT[one.data.kind], "-le" if variable.order == "<" else "-be"
                letters = data.decode(codec + end * codec.startswith(("utf-16", "utf-32")))
                values[name] = np.array([letters[:: one.shape[0]]])
            else:
                numbers = np.frombuffer(data, variable.order + _NUMBERS[one.data.kind])
                # Whole numbers are packed as such, whatever they are.
                is_float = one.name in ARRAYS_STATED and one.kind in ("double", "single")
                numbers = numbers.astype(np.float64) if is_float else numbers
                values[name] = numbers.reshape(one.shape, order="F")
    return values


# ---- write -------------------------------------------------------------------------

# Bytes of a file that say in words what it is.
_DESCRIPTION: Final = 116


def write(path: Path, out: Outgoing) -> None:
    """A MATLAB 5 file: one variable per column and the statement as text and numbers."""
    with replacing(path) as temporary, temporary.open("wb") as stream:
        columns = {name: values[:, None] for name, values in out.rows(slice(None)).items()}
        scipy.io.savemat(stream, {**columns, **out.statement()})
        stream.seek(0)
        stream.write(f"MATLAB 5.0 MAT-file, {MADE}".ljust(_DESCRIPTION).encode())
