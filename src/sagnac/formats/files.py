"""Files that are damaged, and files that appear only when they are whole."""

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from sagnac.errors import RecordingError


@contextmanager
def damaged(format_name: str) -> Iterator[None]:
    """Turn whatever a library raises over a file into one line.

    Libraries raise from a wide choice over a cut or corrupt file (zlib, struct, type,
    index, overflow errors), so everything that is an `Exception` is taken.

    Raises
    ------
    RecordingError
        For every other exception inside.
    """
    try:
        yield
    except RecordingError:
        raise
    except Exception as error:
        # NumPy ends its message with advice on its own arguments.
        why = " ".join(str(error).split()).split("; use `")[0][:160] or type(error).__name__
        raise RecordingError(
            f"is not {format_name}, or is damaged or cut off ({why})",
            remedy="get the file again from its source",
        ) from error


@contextmanager
def about(path: Path) -> Iterator[None]:
    """Put the file to what is wrong with it.

    Raises
    ------
    RecordingError
        The one raised inside, with the file where it named none.
    """
    try:
        yield
    except RecordingError as error:
        raise error.at(str(path)) from error.__cause__


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A temporary path in the same folder that becomes `path` if all goes well.

    Raises
    ------
    RecordingError
        If the folder cannot be written to.
    """
    try:
        handle, name = tempfile.mkstemp(prefix=f".{path.name}.", suffix=".part", dir=path.parent)
    except OSError as error:
        raise RecordingError(
            f"cannot be written ({error.strerror})",
            path=str(path),
            remedy="choose another output",
        ) from None
    os.close(handle)
    temporary = Path(name)
    try:
        yield temporary
        mask = os.umask(0)
        os.umask(mask)
        temporary.chmod(0o666 & ~mask)
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)
