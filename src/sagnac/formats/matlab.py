"""MATLAB files of version 5 (and 4). Those of version 7.3 are HDF5.

The elements of a file are checked before a library that trusts them reads them. MAT-File Format
(The MathWorks), "Level 5 MAT-File Format": each element has a tag of 8 bytes, its type and its
length; small ones have both in 4. A matrix holds array flags, dimensions, name and data, each such
an element.
"""

import math
import zlib
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, BinaryIO, Final, Literal

import numpy as np
import scipy.io
from numpy.typing import NDArray

from sagnac.core.whole_files import replacing
from sagnac.formats.files import require_room
from sagnac.formats.registry import MATLAB
from sagnac.formats.source import MADE, Outgoing, Source, Stored, Vector, column, in_memory, vectors
from sagnac.formats.statement import ARRAYS_STATED, from_mapping

# ---- matlab elements ---------------------------------------------------------------

Order = Literal["little", "big"]

_MATRIX: Final = 14
_COMPRESSED: Final = 15
# One number by data type, as NumPy writes it.
_NUMBERS: Final = {
    1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8",
}  # fmt: skip
_SIZES: Final = {kind: int(word[1]) for kind, word in _NUMBERS.items()}
_TEXT: Final = frozenset({1, 2, 3, 4, 16, 17, 18})
_CELL_CLASS: Final = 1
_STRUCT_CLASS: Final = 2
_CHAR_CLASS: Final = 4
_WORDS: Final = {_CELL_CLASS: "cell values", _STRUCT_CLASS: "a struct array", _CHAR_CLASS: "text"}
_NUMERIC_CLASSES: Final = range(6, 16)
_OPAQUE_CLASS: Final = 17
_COMPLEX: Final = 0x08
# Bytes in which the head of a matrix ends: names are no longer than 63, dimensions few.
_HEAD: Final = 2**16
# Structs in structs, as deep as anybody makes them.
_DEEPEST: Final = 16


@dataclass(frozen=True, slots=True, kw_only=True)
class Place:
    """Where the numbers of a field lie: in the content of which variable, from where on."""

    variable: int
    start: int
    length: int
    number: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Element:
    """A variable.

    Attributes
    ----------
    name
        Of the variable.
    shape
        Of its array.
    bytes
        That its numbers take as float64.
    is_complex
        Whether it has imaginary parts.
    holds
        What it holds if that is no numbers; of a field.
    place
        Of the numbers of a field; None of a variable.
    """

    name: str
    shape: tuple[int, ...]
    bytes: int
    is_complex: bool
    holds: str = ""
    place: Place | None = None


def elements_of(path: Path) -> Iterator[Element]:
    """The variables of a file of version 5, their tags checked; of a struct its fields, too.

    A field is called ``imu.gyro``, as in MATLAB; of an array of structs there are none.

    Raises
    ------
    ValueError
        If an element is not all there, or a tag says what cannot be.
    """
    size = path.stat().st_size
    with path.open("rb") as stream:
        order, position = _order(stream), 128
        while position < size:
            stream.seek(position)
            head = stream.read(8)
            kind, length = int.from_bytes(head[:4], order), int.from_bytes(head[4:], order)
            begin, position = position, position + 8 + length
            if position > size or len(head) < 8:
                raise ValueError(f"{position - size} bytes are missing")
            content = stream.read(min(length, _HEAD))
            if kind == _COMPRESSED:
                content = zlib.decompressobj().decompress(content, _HEAD)
                kind = int.from_bytes(content[:4], order)
                length = int.from_bytes(content[4:8], order)
                content = content[8:]
            if kind != _MATRIX:
                raise ValueError(f"an element is of type {kind}, not a matrix")
            if length:
                yield _matrix(content, length, order)
                if _class(content, order) == _STRUCT_CLASS:
                    whole = _content(stream, begin, order)
                    yield from _fields(_Whole(content=whole, order=order, variable=begin), 0, "")


def field_values(path: Path, element: Element) -> NDArray[Any]:
    """The numbers of a field, in its shape.

    Raises
    ------
    ValueError
        If it is no field, or the file has changed.
    """
    place = element.place
    if place is None:
        raise ValueError(f"{element.name} is no field of a struct")
    with path.open("rb") as stream:
        order = _order(stream)
        content = _content(stream, place.variable, order)
    values = np.frombuffer(
        content[place.start : place.start + place.length],
        dtype=("<" if order == "little" else ">") + place.number,
    )
    return values.reshape(element.shape, order="F")


def _order(stream: BinaryIO) -> Order:
    stream.seek(126)
    return "little" if stream.read(2) == b"IM" else "big"


def _content(stream: BinaryIO, begin: int, order: Order) -> bytes:
    """All of a variable, without its tag and unpacked."""
    stream.seek(begin)
    head = stream.read(8)
    kind, length = int.from_bytes(head[:4], order), int.from_bytes(head[4:], order)
    require_room(length, "a struct")
    packed = stream.read(length)
    if kind != _COMPRESSED:
        return packed
    unpacking = zlib.decompressobj()
    tag = unpacking.decompress(packed, 8)
    length = int.from_bytes(tag[4:8], order)
    require_room(length, "a struct")
    return unpacking.decompress(unpacking.unconsumed_tail, max(length, 1))


@dataclass(frozen=True, slots=True, kw_only=True)
class _Whole:
    """All of a variable: its bytes, their order, and where in the file it begins."""

    content: bytes
    order: Order
    variable: int

    def tags(self, start: int, count: int) -> "list[_Tag]":
        """Tags one after another."""
        found = [_tag(self.content, start, self.order)]
        while len(found) < count:
            found.append(_tag(self.content, found[-1].after, self.order))
        return found


def _fields(whole: _Whole, start: int, above: str, depth: int = 0) -> Iterator[Element]:
    """The fields of a struct whose matrix begins at `start`, those of structs in it as well."""
    content, order = whole.content, whole.order
    if depth >= _DEEPEST:
        raise ValueError(f"{above} holds structs {depth} deep")
    own = _matrix(content[start : start + _HEAD], len(content) - start, order)
    if math.prod(own.shape) != 1:
        return
    # Flags, dimensions, name, bytes of each field's name, and these names.
    *_, longest, listed = whole.tags(start, 5)
    length = int.from_bytes(content[longest.start : longest.start + 4], order, signed=True)
    if not 0 < length <= _HEAD or listed.length % length:
        raise ValueError(f"the fields of {own.name or above} are damaged")
    at = listed.after
    for place in range(listed.start, listed.start + listed.length, length):
        word = content[place : place + length].split(b"\0")[0].decode("latin-1")
        name = f"{above or own.name}.{word}"
        tag = _tag(content, at, order)
        at = tag.start + tag.length
        if tag.kind != _MATRIX or at > len(content):
            raise ValueError(f"{name} is cut off")
        if tag.length:
            yield from _field(whole, tag, name, depth)


def _field(whole: _Whole, tag: "_Tag", name: str, depth: int) -> Iterator[Element]:
    head = whole.content[tag.start : min(tag.start + tag.length, tag.start + _HEAD)]
    found = replace(_matrix(head, tag.length, whole.order), name=name)
    kind = _class(head, whole.order)
    if kind == _STRUCT_CLASS and math.prod(found.shape) == 1:
        yield from _fields(whole, tag.start, name, depth + 1)
    elif kind not in _NUMERIC_CLASSES:
        yield replace(found, holds=_WORDS.get(kind, "no numbers"))
    elif math.prod(found.shape):
        data = whole.tags(tag.start, 4)[-1]
        if data.start + data.length > tag.start + tag.length:
            raise ValueError(f"{name} is cut off")
        place = Place(
            variable=whole.variable,
            start=data.start,
            length=data.length,
            number=_NUMBERS[data.kind],
        )
        yield replace(found, place=place)


def _class(content: bytes, order: Order) -> int:
    """The class of the array of a matrix."""
    flags = _tag(content, 0, order)
    return int.from_bytes(content[flags.start : flags.start + 4], order) & 0xFF


@dataclass(frozen=True, slots=True, kw_only=True)
class _Tag:
    kind: int
    length: int
    start: int
    after: int


def _tag(content: bytes, at: int, order: Order) -> _Tag:
    """The tag at a place, and where its content lies."""
    word = int.from_bytes(content[at : at + 4], order)
    if len(content) < at + 8:
        raise ValueError("the head of a matrix is cut off")
    if word >> 16:
        small = word >> 16
        if small > 4:
            raise ValueError(f"a small element claims {small} bytes")
        return _Tag(kind=word & 0xFFFF, length=small, start=at + 4, after=at + 8)
    length = int.from_bytes(content[at + 4 : at + 8], order)
    return _Tag(kind=word, length=length, start=at + 8, after=at + 8 + -(-length // 8) * 8)


def _matrix(content: bytes, length: int, order: Order) -> Element:
    flags = _tag(content, 0, order)
    if (flags.kind, flags.length) != (6, 8):
        raise ValueError("a matrix does not begin with its flags")
    word = int.from_bytes(content[flags.start : flags.start + 4], order)
    kind, is_complex = word & 0xFF, bool(word >> 8 & _COMPLEX)
    if kind == _OPAQUE_CLASS:
        return Element(name="", shape=(), bytes=0, is_complex=False)
    dimensions = _tag(content, flags.after, order)
    if dimensions.kind not in (5, 6) or dimensions.length % 4 or not 8 <= dimensions.length <= 256:
        raise ValueError("the dimensions of a matrix are damaged")
    shape = tuple(
        int.from_bytes(content[at : at + 4], order, signed=True)
        for at in range(dimensions.start, dimensions.start + dimensions.length, 4)
    )
    title = _tag(content, dimensions.after, order)
    if title.kind not in (1, 2, 16) or title.length > 1024 or min(shape) < 0:
        raise ValueError("the name or the shape of a matrix is damaged")
    name = content[title.start : title.start + title.length].decode("latin-1")
    numbers = math.prod(shape)
    if numbers and (kind in _NUMERIC_CLASSES or kind == _CHAR_CLASS):
        _check_data(_tag(content, title.after, order), kind, numbers, length, name)
    return Element(name=name, shape=shape, bytes=8 * numbers, is_complex=is_complex)


def _check_data(data: _Tag, kind: int, numbers: int, length: int, name: str) -> None:
    """Refuse a type that the numbers cannot have, or as many as do not fit in."""
    if kind == _CHAR_CLASS:
        if data.kind not in _TEXT:
            raise ValueError(f"{name} holds text of type {data.kind}")
        return
    if data.kind not in _SIZES:
        raise ValueError(f"{name} holds numbers of type {data.kind}")
    if data.length != numbers * _SIZES[data.kind] or data.length > length:
        raise ValueError(f"{name} has {numbers} numbers in {data.length} bytes of type {data.kind}")


# ---- matlab ------------------------------------------------------------------------

_NUMERIC: Final = frozenset(
    {"double", "single", "logical"}
    | {f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)}
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
    # The library trusts tags, and reads memory that is not its own where they lie.
    elements = _elements(path)
    listing = scipy.io.whosmat(path)
    stated_names = [
        name
        for name, shape, kind in listing
        if name in ARRAYS_STATED and (kind == "char" or shape == (1, 1))
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
