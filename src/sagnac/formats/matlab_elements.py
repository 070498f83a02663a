"""The elements of a MATLAB 5 file, checked before a library that trusts them reads them.

MAT-File Format (The MathWorks), "Level 5 MAT-File Format": each element has a tag of 8 bytes, its
type and its length; small ones have both in 4. A matrix holds array flags, dimensions, name and
data, each such an element.
"""

import math
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal

Order = Literal["little", "big"]

_MATRIX: Final = 14
_COMPRESSED: Final = 15
# Bytes of one number by data type.
_SIZES: Final = {1: 1, 2: 1, 3: 2, 4: 2, 5: 4, 6: 4, 7: 4, 9: 8, 12: 8, 13: 8}
_TEXT: Final = frozenset({1, 2, 3, 4, 16, 17, 18})
_CHAR_CLASS: Final = 4
_NUMERIC_CLASSES: Final = range(6, 16)
_OPAQUE_CLASS: Final = 17
_COMPLEX: Final = 0x08
# Bytes in which the head of a matrix ends: names are no longer than 63, dimensions few.
_HEAD: Final = 2**16


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
    """

    name: str
    shape: tuple[int, ...]
    bytes: int
    is_complex: bool


def elements_of(path: Path) -> Iterator[Element]:
    """The variables of a file of version 5, their tags checked.

    Raises
    ------
    ValueError
        If an element is not all there, or a tag says what cannot be.
    """
    size = path.stat().st_size
    with path.open("rb") as stream:
        stream.seek(126)
        order: Order = "little" if stream.read(2) == b"IM" else "big"
        position = 128
        while position < size:
            stream.seek(position)
            head = stream.read(8)
            kind, length = int.from_bytes(head[:4], order), int.from_bytes(head[4:], order)
            position += 8 + length
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
