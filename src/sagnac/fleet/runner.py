"""A campaign run: what is kept is taken, the rest is done by processes of this machine and kept."""

import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Final

from sagnac import processes
from sagnac.fleet.config import Task, with_digest
from sagnac.fleet.measure import Result, lost, measure, read_result, span_tasks
from sagnac.processes import GIBIBYTE, Means, Standing, means_of

# ---- local -------------------------------------------------------------------------

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


def completed_here(
    tasks: Sequence[Task], folder: Path, means: Means
) -> Iterator[tuple[Task, Result]]:
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


# ---- runner ------------------------------------------------------------------------

Completed = Callable[[Sequence[Task], Path], Iterator[tuple[Task, Result]]]


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """One task and what it gave."""

    task: Task
    result: Result


def by_gyro(row: Row) -> tuple[Row, ...]:
    """A row for each gyro that has its own N; the row itself if there is but one.

    Gyros that were taken alone have a row each, also those that were refused. A triad on a turning
    table keeps its row, which is of the difference, before those of its gyros.
    """
    analysis = row.result.analysis
    alone, refused = analysis.get("gyros", {}), analysis.get("refused", {})
    if alone:
        return tuple(
            replace(row, result=replace(row.result, analysis=alone[name]))
            if name in alone
            else replace(row, result=_refused(row, name, refused[name]))
            for name in analysis["input"]["gyros"]
        )
    return (row, *(_of_hat(row, name) for name in analysis.get("per_gyro", {})))


def _refused(row: Row, name: str, reason: str) -> Result:
    of_one = {"input": {**row.result.analysis["input"], "gyros": [name]}}
    return replace(row.result, state="failed", reason=reason, analysis=of_one)


def _of_hat(row: Row, name: str) -> Row:
    """One gyro of a triad: its own N, and what was decided of it."""
    analysis = row.result.analysis
    names = ("settings", "findings", "notes", "lines")
    kept = {key: analysis[key] for key in names if key in analysis}
    kept["input"] = {**analysis["input"], "gyros": [name]}
    kept["angle_random_walk"] = analysis["per_gyro"][name]
    if "verdict" in analysis:
        verdict = analysis["verdict"]
        own = [one for one in verdict["limits"] if one["gyro"] == name]
        kept["verdict"] = {"overall": verdict["gyros"].get(name, ""), "limits": own}
    return replace(row, result=replace(row.result, analysis=kept))


@dataclass(frozen=True, slots=True, kw_only=True)
class Campaign:
    """All rows, in the order of the plan.

    Attributes
    ----------
    rows
        Of whole recordings, and of their spans after them.
    computed
        How many of them were not kept from before.
    """

    rows: tuple[Row, ...]
    computed: int

    @property
    def each(self) -> tuple[Row, ...]:
        """Rows of every gyro: see `by_gyro`."""
        return tuple(one for row in self.rows for one in by_gyro(row))

    @property
    def failed(self) -> tuple[Row, ...]:
        """Rows without an answer."""
        return tuple(row for row in self.rows if row.result.state != "done")


def _nobody(_: Standing) -> None:
    """Nobody is told."""


def run(
    tasks: Sequence[Task],
    folder: Path,
    completed: Completed | None = None,
    *,
    span: float | None = None,
    told: Callable[[Standing], None] | None = None,
) -> Campaign:
    """Do every task whose result the folder does not hold.

    Parameters
    ----------
    tasks
        The plan.
    folder
        Of the campaign; made if it is not there. Its results are what the next start goes on
        from, however this one ends.
    completed
        Does tasks and gives their results as they come; by default processes here.
    span
        Also cut each recording into spans of this length, s, each a row of its own.
    told
        Called after each task.

    Raises
    ------
    RecordingError
        If the folder cannot be written to, or there are no workers.
    """
    folder.mkdir(parents=True, exist_ok=True)
    work = completed or (lambda todo, place: completed_here(todo, place, means_of()))
    planned = [with_digest(task) for task in tasks]
    told = told or _nobody
    rows, computed = _rows(planned, folder, work, told)
    if span is not None:
        spans = [one for row in rows for one in span_tasks(row.task, row.result, span)]
        further, more = _rows(spans, folder, work, told)
        rows, computed = rows + further, computed + more
    return Campaign(rows=tuple(rows), computed=computed)


def _kept(folder: Path, key: str) -> Result | None:
    """The result that the folder holds, with its report; None if it has to be made."""
    result = read_result(folder, key)
    if result is None or result.state == "lost":
        return None
    files = ("analysis.json", "report.html") if result.report else ()
    whole = all((folder / result.report / name).is_file() for name in files)
    return result if whole else None


def _rows(
    tasks: Sequence[Task], folder: Path, work: Completed, told: Callable[[Standing], None]
) -> tuple[list[Row], int]:
    """Rows of the tasks in their order, and how many were computed."""
    keys = [task.key for task in tasks]
    results: dict[str, Result] = {}
    todo: dict[str, Task] = {}
    for key, task in zip(keys, tasks, strict=True):
        if kept := _kept(folder, key):
            results[key] = kept
        else:
            todo[key] = task
    began = time.perf_counter()

    def standing() -> Standing:
        return Standing(
            done=len(results),
            total=len(results) + len(todo),
            failed=sum(result.state != "done" for result in results.values()),
            elapsed_s=time.perf_counter() - began,
            computed=computed,
        )

    computed = 0
    if todo:
        told(standing())
        for _task, result in work(tuple(todo.values()), folder):
            # A worker may have kept what it could no longer tell: its scheduler was lost before.
            told_lost = result.state == "lost"
            results[result.key] = (_kept(folder, result.key) or result) if told_lost else result
            todo.pop(result.key, None)
            computed += 1
            told(standing())
    rows = [Row(task=task, result=results[key]) for key, task in zip(keys, tasks, strict=True)]
    return rows, computed
