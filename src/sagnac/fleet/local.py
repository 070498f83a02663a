"""Tasks done by processes of this machine, one recording each at a time."""

from collections.abc import Iterator, Sequence
from concurrent.futures.process import BrokenProcessPool
from functools import partial
from pathlib import Path
from typing import Final

from sagnac import processes
from sagnac.fleet.measure import lost, measure
from sagnac.fleet.results import Result
from sagnac.fleet.tasks import Task
from sagnac.processes import GIBIBYTE, Means

# An analysis works by blocks, with what is too long in scratch files.
_ANALYSIS: Final = 1.0 * GIBIBYTE
# Formats that are read column by column and block by block; others are loaded whole.
_BY_BLOCKS: Final = frozenset({".parquet", ".pq", ".h5", ".hdf5", ".he5", ".nc"})
# Memory for each byte of such a file: its text, its numbers, and those of each stage.
_WHOLE: Final = 4.0


def needed_memory(path: str) -> float:
    """Bytes that the analysis of a file may take."""
    try:
        size = Path(path).stat().st_size
    except OSError:
        size = 0
    whole = Path(path).suffix.lower() not in _BY_BLOCKS
    return _ANALYSIS + (_WHOLE * size if whole else 0.0)


def completed(tasks: Sequence[Task], folder: Path, means: Means) -> Iterator[tuple[Task, Result]]:
    """Tasks with their results, in the order in which they end.

    The result of a task whose worker dies says so.

    Parameters
    ----------
    tasks
        What to do.
    folder
        Of the campaign.
    means
        Workers and memory.
    """
    work = partial(measure, folder=folder)
    ended = processes.completed(tasks, work, means, lambda task: needed_memory(task.path))
    for task, future in ended:
        try:
            yield task, future.result()
        except BrokenProcessPool:
            yield task, lost(task, "the worker died; it was killed, or memory ran out")
