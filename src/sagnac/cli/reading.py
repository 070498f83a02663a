"""Reading a file for a command, and naming it in what goes wrong afterwards."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from sagnac.cli.progress import Progress

if TYPE_CHECKING:
    from sagnac.formats import Statement
    from sagnac.recording.model import Recording


@dataclass(frozen=True, slots=True, kw_only=True)
class ReadFile:
    """A recording, and how long it took to read, s by stage."""

    recording: "Recording"
    seconds: dict[str, float]


def read_file(
    file: Path,
    statement: "Statement",
    progress: Progress,
    *,
    verify: bool = True,
    memory: int | None = None,
) -> ReadFile:
    """The recording in a file, which may declare no more than `memory` bytes.

    Raises
    ------
    RecordingError
        If the file cannot be read or, with `verify`, is not sound.
    """
    from sagnac.formats import read
    from sagnac.formats.room import USUAL, limited

    began = time.perf_counter()
    progress("read", 0.0)
    with limited(memory or USUAL):
        recording = read(file, statement, verify=verify)
    progress("read", 1.0)
    return ReadFile(recording=recording, seconds={"read": time.perf_counter() - began})


@contextmanager
def naming(file: Path) -> Iterator[None]:
    """Put the file into a data error of a stage that knows nothing of files.

    What a fit or a factorization cannot do with numbers is a fault of the data, too.
    """
    from sagnac.errors import RecordingError

    try:
        yield
    except RecordingError as error:
        raise error.at(str(file)) from error
    except (ValueError, ArithmeticError) as error:
        # numpy's LinAlgError is a ValueError.
        raise RecordingError(
            f"the analysis fails on these numbers ({error})",
            path=str(file),
            remedy="look at the data with sagnac check",
        ) from error
