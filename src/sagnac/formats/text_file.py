"""Bytes of a text file: their encoding, lines to judge it by, and blocks of plain text."""

import codecs
import io
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from sagnac.errors import RecordingError

_HEAD_BYTES: Final = 1 << 16
_PART_BYTES: Final = 1 << 14
_LONGEST_LINE: Final = 1 << 20


def encoding_of(head: bytes) -> str:
    """Codec of a text by its first bytes: UTF-8, UTF-16 or, if it is neither, cp1252.

    Raises
    ------
    RecordingError
        If this is no text.

    Examples
    --------
    >>> encoding_of("Zähler".encode("cp1252")), encoding_of("x;y".encode("utf-16"))
    ('cp1252', 'utf-16-le')
    """
    if head.startswith(codecs.BOM_UTF16_LE):
        return "utf-16-le"
    if head.startswith(codecs.BOM_UTF16_BE):
        return "utf-16-be"
    if b"\0" in head:
        # Digits and marks of a text without a mark of its order have a zero beside each.
        half = max(1, len(head) // 2)
        for name, first in (("utf-16-le", 1), ("utf-16-be", 0)):
            zeros = head[first::2].count(0)
            if len(head) >= 4 and zeros > 0.9 * half and not head[1 - first :: 2].count(0):
                return name
        raise RecordingError(
            "holds binary data, not text", remedy="give it the suffix of its own format"
        )
    try:
        codecs.getincrementaldecoder("utf-8")().decode(head)
    except UnicodeDecodeError:
        return "cp1252"
    return "utf-8"


@dataclass(frozen=True, slots=True, kw_only=True)
class Sample:
    """First lines of a text file, which its layout is judged by.

    Attributes
    ----------
    encoding
        See `encoding_of`.
    head
        Its first lines, whole.
    later
        Whole lines from its middle and its end.
    """

    encoding: str
    head: tuple[str, ...]
    later: tuple[str, ...]


def sample_of(path: Path) -> Sample:
    """Lines of a file.

    Raises
    ------
    RecordingError
        If this is no text, or a line is longer than any table's.
    """
    size = path.stat().st_size
    with path.open("rb") as stream:
        head = stream.read(_HEAD_BYTES)
        encoding = encoding_of(head)
        first = _lines(head, encoding, is_whole=size <= len(head))
        if not first and size > len(head):
            raise RecordingError(
                f"has no line end in its first {_HEAD_BYTES // 1024} KiB",
                remedy="give a table with a line for each sample",
            )
        later: list[str] = []
        if size > 4 * _HEAD_BYTES:
            for place in (size // 2, size - _PART_BYTES):
                stream.seek(place - place % 2)
                later += _lines(stream.read(_PART_BYTES), encoding)[1:]
    return Sample(encoding=encoding, head=tuple(first), later=tuple(later))


def _lines(part: bytes, encoding: str, *, is_whole: bool = False) -> list[str]:
    """Lines of a part of a file, without the last one if that may be cut."""
    text = part.decode(encoding, errors="replace").lstrip("\ufeff")
    lines = re.split(r"\r\n|\n|\r", text)
    return lines if is_whole else lines[:-1]


def ends_in_newline(path: Path, encoding: str) -> bool:
    """Whether the last line of a file has its end."""
    width = 2 if encoding.startswith("utf-16") else 1
    with path.open("rb") as stream:
        stream.seek(-min(width, path.stat().st_size), io.SEEK_END)
        return stream.read().decode(encoding, errors="replace") in ("\n", "\r")


def lines_of(path: Path, encoding: str) -> Iterator[str]:
    """All lines, one after the other, without their ends."""
    with path.open(encoding=encoding, errors="replace", newline=None) as stream:
        for number, line in enumerate(stream):
            yield (line.lstrip("\ufeff") if number == 0 else line).rstrip("\n")


def blocks_of(path: Path, *, encoding: str, blanks: bool) -> Iterator[bytes]:
    """Blocks of whole lines, about 1 MiB each, as UTF-8 unless the codec is of single bytes.

    Parameters
    ----------
    path
        Of the file.
    encoding
        Its codec.
    blanks
        Whether runs of blanks and tabs become one blank and those at the ends of lines go.

    Raises
    ------
    ValueError
        If a line is longer than any table's.
    """
    decoder = (
        codecs.getincrementaldecoder(encoding)("replace") if encoding.startswith("utf-16") else None
    )
    pending = b""
    with path.open("rb") as stream:
        while part := stream.read(_LONGEST_LINE):
            block = pending + (part if decoder is None else decoder.decode(part).encode())
            # A carriage return at the very end may be half of a line end.
            end = 1 + max(block.rfind(b"\n"), block.rfind(b"\r", 0, -1))
            pending = block[end:]
            if len(pending) > _LONGEST_LINE:
                raise ValueError("a line is longer than 1 MiB")
            if end:
                yield _single(block[:end]) if blanks else block[:end]
    if pending:
        yield _single(pending) if blanks else pending


def _single(lines: bytes) -> bytes:
    """Lines with one blank between two fields and none at their ends."""
    tidy = lines.replace(b"\t", b" ").replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    while b"  " in tidy:
        tidy = tidy.replace(b"  ", b" ")
    return tidy.replace(b"\n ", b"\n").replace(b" \n", b"\n").strip(b" ")
