"""Writing a file whole or not at all."""

from pathlib import Path

from sagnac.formats.source import replacing


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
