"""Exit status, and the one line on standard error that goes with it."""

import sys
from typing import Final

from sagnac.errors import visible

DONE: Final = 0
DATA_ERROR: Final = 1
USAGE_ERROR: Final = 2
FAILED: Final = 3
UNDECIDED: Final = 4
INTERRUPTED: Final = 130

# Characters of a message.
_LONGEST: Final = 780


class UsageError(Exception):
    """Wrong usage that the argument parser cannot see."""


def explain(error: Exception) -> int:
    """Say in one line on standard error what went wrong.

    Returns
    -------
    int
        The exit status it means.
    """
    # Not before something has gone wrong: --help and a wrong option need none of it.
    from sagnac.errors import MissingExtra, RecordingError, WouldOverwrite
    from sagnac.report.command_line import as_typed, error_text

    status = DATA_ERROR
    if isinstance(error, RecordingError):
        said = error_text(error)
        status = USAGE_ERROR if isinstance(error, WouldOverwrite) else DATA_ERROR
    elif isinstance(error, UsageError) or type(error) is ValueError:
        said, status = as_typed(str(error)), USAGE_ERROR
    elif isinstance(error, MissingExtra):
        said = str(error)
    elif isinstance(error, OSError):
        where = f"{error.filename}: " if error.filename else ""
        said = f"{where}{error.strerror or error}; check the path and its rights"
    elif isinstance(error, MemoryError):
        said = "out of memory; take a part of the recording with --slice START:STOP"
    else:
        said = (
            f"internal error: {type(error).__name__}: {error}; "
            "run again with --debug for the traceback, and report it"
        )
    complain(said)
    return status


def complain(message: str) -> None:
    """One line on standard error, of which a screen shows no more than ten."""
    line = visible(" ".join(message.split()))
    if len(line) > _LONGEST:
        # What is wrong stands at the beginning, what to do at the end.
        half = _LONGEST // 2
        line = f"{line[:half]} ... {line[-half:]}"
    print(f"sagnac: {line}", file=sys.stderr)
