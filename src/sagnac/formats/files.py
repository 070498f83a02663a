"""Files that are damaged, or declare more than memory or their bytes hold."""

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import Final

from sagnac.core.errors import MissingExtra, RecordingError, refusal

# ---- room --------------------------------------------------------------------------

GIBIBYTE: Final = 2**30
# What to do about a damaged file.
AGAIN: Final = "get the file again from its source"
# What may be loaded unless the caller says otherwise, bytes.
USUAL: Final = 4 * GIBIBYTE
_limit: ContextVar[int] = ContextVar("memory limit", default=USUAL)


@contextmanager
def limited(most: int) -> Iterator[None]:
    """Inside, files may declare no more than `most` bytes.

    Raises
    ------
    ValueError
        If that is not above zero.
    """
    if most <= 0:
        raise refusal("memory", f"is {most}; give bytes, above zero")
    before = _limit.set(most)
    try:
        yield
    finally:
        _limit.reset(before)


def require_room(needed: int, what: str) -> None:
    """Refuse what would take more memory than is allowed.

    Parameters
    ----------
    needed
        Bytes.
    what
        What takes them, a noun that starts the sentence: ``array x``.

    Raises
    ------
    RecordingError
        If there is no room.
    """
    most = _limit.get()
    if needed > most:
        allowed = f"the {most / GIBIBYTE:.3g} GiB that are allowed"
        problem = f"{what} takes {needed / GIBIBYTE:.3g} GiB of memory, more than {allowed}"
        raise RecordingError(problem, remedy="allow more with {memory}, or give a shorter file")


def require_content(declared: int, stored: int, what: str) -> None:
    """Refuse a file that declares more than its bytes can hold, however it is compressed.

    Parameters
    ----------
    declared, stored
        Bytes that it says to hold, and bytes that it has.
    what
        What declares them.

    Raises
    ------
    RecordingError
        If it cannot be.
    """
    # Largest ratio that any of the compressions here reaches, twice over: a file that declares more
    # has nothing behind it.
    if declared > 2064 * max(stored, 1):
        fact = f"{what} declares {declared} bytes, and the file has {stored}: nothing is behind it"
        raise RecordingError(fact, remedy=AGAIN)


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
        problem = f"is not {format_name}, or is damaged or cut off ({why})"
        raise RecordingError(problem, remedy=AGAIN) from error


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
    except (RecordingError, MissingExtra) as error:
        raise error.at(str(path)) from error.__cause__
