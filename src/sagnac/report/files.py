"""Writing a file whole or not at all."""

from pathlib import Path
from typing import Final
from urllib.parse import quote

from sagnac.formats.source import replacing

# Characters that a file system takes in a name, with room for what is put before it.
_LONGEST_NAME: Final = 180


def write_text(path: Path, text: str) -> None:
    """Write a text, whole or not at all.

    Raises
    ------
    RecordingError
        If the folder cannot be written to.
    """
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def write_bytes(path: Path, content: bytes) -> None:
    """Write bytes, whole or not at all.

    Raises
    ------
    RecordingError
        If the folder cannot be written to.
    """
    with replacing(path) as temporary:
        temporary.write_bytes(content)


def folder_name(name: str) -> str:
    """A file name for a channel, whatever its name is: it comes out of a file.

    Examples
    --------
    >>> folder_name("x"), folder_name("../../x"), folder_name("..")
    ('x', '..%2F..%2Fx', '%2E%2E')
    """
    safe = quote(name, safe=" ")[:_LONGEST_NAME]
    return safe if safe.strip(". ") else "".join(f"%{ord(mark):02X}" for mark in safe)
