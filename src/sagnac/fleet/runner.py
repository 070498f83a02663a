"""A campaign run: what is kept is taken, the rest is done and kept.

It is done by processes of this machine, or by the workers of a Dask scheduler, to which paths
travel and no arrays.
"""

import asyncio
import importlib
import logging
import time
import uuid
from asyncio import CancelledError
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Final

from sagnac.core import processes
from sagnac.core.errors import RecordingError, extra_module
from sagnac.core.processes import GIBIBYTE, Means, Standing, means_of, nobody
from sagnac.core.version import __version__
from sagnac.core.whole_files import made
from sagnac.fleet.tasks import Result, Task, lost, measure, read_result, span_tasks, with_digest

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


# ---- cluster -----------------------------------------------------------------------

# Time that a scheduler has to answer, and after which one that is silent is lost, s.
_PATIENCE: Final = 20.0
_MOST_SILENT: Final = 10.0
# Between two looks at what has ended, and for a client to close, s.
_BETWEEN: Final = 0.2
_TO_CLOSE: Final = 5.0
_GOES_ON: Final = "start the same campaign again, and it goes on"


def completed_there(
    tasks: Sequence[Task], folder: Path, scheduler: str
) -> Iterator[tuple[Task, Result]]:
    """Tasks with their results, in the order in which they end.

    Parameters
    ----------
    tasks
        What to do; their paths are those that the workers see.
    folder
        Of the campaign, which all workers have to see under this path.
    scheduler
        Its address: ``tcp://host:8786``.

    Raises
    ------
    MissingExtra
        If Dask is not installed.
    RecordingError
        If there is no such scheduler, it has no workers, or one of these has another version of
        the package or does not see the folder.
    """
    client = _connected(_distributed(), scheduler)
    try:
        _check_workers(client, folder)
        waiting = {
            client.submit(measure, task, folder, pure=False, retries=0): task for task in tasks
        }
        yield from _ended(client, waiting)
    except OSError as error:
        raise RecordingError(
            f"the scheduler at {scheduler} was lost ({_in_short(error)})", remedy=_GOES_ON
        ) from None
    finally:
        # What it still waits for is given up; one that has lost its scheduler would wait for it.
        client.close(timeout=_TO_CLOSE)


def _connected(distributed: Any, scheduler: str) -> Any:
    """A client of a scheduler.

    Raises
    ------
    RecordingError
        If none answers.
    """
    # It tells on the terminal what is told here.
    for name in ("distributed", "distributed.client", "distributed.comm", "tornado.application"):
        logging.getLogger(name).setLevel(logging.CRITICAL)
    try:
        # A client waits for ever for one that takes the call and says nothing.
        with ThreadPoolExecutor(max_workers=1) as pool:
            pool.submit(asyncio.run, _greeted(scheduler)).result()
        return distributed.Client(scheduler, timeout=_PATIENCE)
    except (OSError, ValueError, TypeError, MemoryError) as error:
        # Another program's answer is taken for the length of what follows, which may be anything.
        raise RecordingError(
            f"no scheduler answers at {scheduler} ({_in_short(error)})",
            remedy="start one with dask scheduler, and give the address that it prints",
        ) from None


async def _greeted(scheduler: str) -> None:
    """Return once a scheduler has answered.

    Raises
    ------
    OSError
        If none does in time.
    """
    connect = importlib.import_module("distributed.comm").connect
    comm = await asyncio.wait_for(connect(scheduler, timeout=_PATIENCE), _PATIENCE)
    comm.abort()


def _ended(client: Any, waiting: dict[Any, Task]) -> Iterator[tuple[Task, Result]]:
    """Tasks with their results as they end; all that wait are lost if the scheduler is."""
    silent = 0.0
    while waiting:
        ended = [future for future in waiting if future.done()]
        for future in ended:
            task = waiting.pop(future)
            yield task, _result_of(future, task)
        if ended:
            continue
        time.sleep(_BETWEEN)
        silent = silent + _BETWEEN if client.status != "running" else 0.0
        if silent > _MOST_SILENT:
            for task in waiting.values():
                yield task, lost(task, f"the scheduler was lost; {_GOES_ON}")
            return


def _result_of(future: Any, task: Task) -> Result:
    try:
        result: Result = future.result()
    except (Exception, CancelledError) as error:
        name = type(error).__name__
        if isinstance(error, OSError) or name.endswith("CancelledError"):
            return lost(task, f"the scheduler was lost; {_GOES_ON}")
        if name == "KilledWorker":
            return lost(task, "the worker died; it was killed, or memory ran out")
        return lost(task, f"{name}: {error}")
    return result


def _in_short(error: Exception) -> str:
    return " ".join(str(error).split()) or type(error).__name__


def _check_workers(client: Any, folder: Path) -> None:
    """Every worker has this version and sees this folder."""
    token = folder / f".seen-{uuid.uuid4().hex}"
    token.write_text(token.name, encoding="ascii")
    try:
        found = client.run(_facts, token)
    finally:
        token.unlink()
    if not found:
        raise RecordingError(
            "the scheduler has no workers", remedy="start some with dask worker ADDRESS"
        )
    for address, (version, seen) in found.items():
        if version != __version__:
            raise RecordingError(
                f"worker {address} has sagnac {version}, this is {__version__}",
                remedy="install the same version everywhere",
            )
        if not seen:
            raise RecordingError(
                f"worker {address} does not see this folder",
                path=str(folder),
                remedy="choose an output that all workers share under one path",
            )


def _facts(token: Path) -> tuple[str, bool]:
    """On a worker: its version of the package, and whether it sees a file."""
    try:
        return __version__, token.read_text(encoding="ascii") == token.name
    except OSError:
        return __version__, False


def _distributed() -> Any:
    return extra_module("distributed", "dask", "a campaign on a cluster")


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
        How many results were not kept from before; equal files have one.
    """

    rows: tuple[Row, ...]
    computed: int

    @property
    def kept(self) -> int:
        """How many results were kept from before."""
        return len({row.result.key for row in self.rows}) - self.computed

    @property
    def each(self) -> tuple[Row, ...]:
        """Rows of every gyro: see `by_gyro`."""
        return tuple(one for row in self.rows for one in by_gyro(row))

    @property
    def failed(self) -> tuple[Row, ...]:
        """Rows without an answer."""
        return tuple(row for row in self.rows if row.result.state != "done")


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
    made(folder)
    work = completed or (lambda todo, place: completed_here(todo, place, means_of()))
    planned = [with_digest(task) for task in tasks]
    told = told or nobody
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
            # Of equal files the first has the report.
            todo.setdefault(key, task)
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
