"""How much memory what a file declares may take, known before anything of it is loaded."""

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Final

from sagnac.errors import RecordingError

GIBIBYTE: Final = 2**30
# Largest ratio that any of the compressions here reaches, twice over: a file that declares more has
# nothing behind it.
_TIGHTEST: Final = 2064
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
        raise ValueError(f"memory is {most}; give bytes, above zero")
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
        raise RecordingError(
            f"{what} takes {needed / GIBIBYTE:.3g} GiB of memory, more than the "
            f"{most / GIBIBYTE:.3g} GiB that are allowed",
            remedy="allow more with {memory}, or give a shorter file",
        )


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
    if declared > _TIGHTEST * max(stored, 1):
        raise RecordingError(
            f"{what} declares {declared} bytes, and the file has {stored}: nothing is behind it",
            remedy="get the file again from its source",
        )
