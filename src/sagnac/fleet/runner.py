"""A campaign run: what is kept is taken, the rest is done and kept.

It is done by processes of this machine, or by the workers of a Dask scheduler, to which paths
travel and no arrays. Either gives futures, and the row of a future says so if its worker died.
"""

import asyncio
import logging
import time
import uuid
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Final

from sagnac.core import processes, whole_files
from sagnac.core.errors import RecordingError, extra_module
from sagnac.core.processes import GIBIBYTE, Means, Standing, Told, nobody
from sagnac.core.version import __version__
from sagnac.fleet.tasks import Row, Task, lost, measure, read_row, span_tasks, with_digest
from sagnac.verdict.limits import Limit

_GOES_ON: Final = "start the same campaign again, and it goes on"
Tasks = Sequence[Task]
Completed = Callable[[Tasks, Path], Iterator[Row]]


def _row_of(task: Task, future: Any) -> Row:
    """The row of a future of a pool or of Dask, which is done."""
    try:
        row: Row = future.result()
    except RecordingError:
        raise
    except (Exception, asyncio.CancelledError) as error:
        name = type(error).__name__
        if name in ("BrokenProcessPool", "KilledWorker"):
            return lost(task, "the worker died; it was killed, or memory ran out")
        if isinstance(error, OSError) or name.endswith("CancelledError"):
            return lost(task, f"the scheduler was lost; {_GOES_ON}")
        return lost(task, f"{name}: {error}")
    return row


# ---- local -------------------------------------------------------------------------

# An analysis works by blocks, with what is too long in scratch files.
_ANALYSIS: Final = 1.0 * GIBIBYTE


def needed_memory(task: Task) -> float:
    """Bytes that a task may take."""
    path = Path(task.path)
    # These are read column by column and block by block; other formats are loaded whole.
    by_blocks = path.suffix.lower() in (".parquet", ".pq", ".h5", ".hdf5", ".he5", ".nc")
    loaded = 0 if by_blocks or not path.is_file() else path.stat().st_size
    # For each byte of such a file: its text, its numbers, and those of each stage.
    return _ANALYSIS + 4.0 * loaded


def completed_here(tasks: Tasks, folder: Path, means: Means) -> Iterator[Row]:
    """Rows of tasks, in the order in which they end.

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
    for task, future in processes.completed(tasks, work, means, needed_memory):
        yield _row_of(task, future)


# ---- cluster -----------------------------------------------------------------------

# Time that a scheduler has to answer, and between two looks at what has ended, s.
_PATIENCE: Final = 20.0
_BETWEEN: Final = 0.2


def completed_there(tasks: Tasks, folder: Path, scheduler: str) -> Iterator[Row]:
    """Rows of tasks, in the order in which they end; all that wait are lost if the scheduler is.

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
    client = _connected(scheduler)
    try:
        _check_workers(client, folder)
        waiting = {client.submit(measure, one, folder, pure=False, retries=0): one for one in tasks}
        silent = 0.0
        # A scheduler that is silent for ten seconds is lost.
        while waiting and silent <= 10.0:
            ended = [future for future in waiting if future.done()]
            for future in ended:
                yield _row_of(waiting.pop(future), future)
            if not ended:
                time.sleep(_BETWEEN)
                silent = silent + _BETWEEN if client.status != "running" else 0.0
        for task in waiting.values():
            yield lost(task, f"the scheduler was lost; {_GOES_ON}")
    except OSError as error:
        problem = f"the scheduler at {scheduler} was lost ({_in_short(error)})"
        raise RecordingError(problem, remedy=_GOES_ON) from None
    finally:
        # What it still waits for is given up; one that has lost its scheduler would wait for it.
        client.close(timeout=5.0)


def _connected(scheduler: str) -> Any:
    """A client of a scheduler.

    Raises
    ------
    MissingExtra
        If Dask is not installed.
    RecordingError
        If none answers.
    """
    distributed = extra_module("distributed", "dask", "a campaign on a cluster")
    # It tells on the terminal what is told here.
    for name in ("distributed", "distributed.client", "distributed.comm", "tornado.application"):
        logging.getLogger(name).setLevel(logging.CRITICAL)

    async def greet() -> None:
        connect = distributed.comm.connect(scheduler, timeout=_PATIENCE)
        (await asyncio.wait_for(connect, _PATIENCE)).abort()

    try:
        # A client waits for ever for one that takes the call and says nothing.
        with ThreadPoolExecutor(max_workers=1) as pool:
            pool.submit(asyncio.run, greet()).result()
        return distributed.Client(scheduler, timeout=_PATIENCE)
    except (OSError, ValueError, TypeError, MemoryError) as error:
        # Another program's answer is taken for the length of what follows, which may be anything.
        problem = f"no scheduler answers at {scheduler} ({_in_short(error)})"
        remedy = "start one with dask scheduler, and give the address that it prints"
        raise RecordingError(problem, remedy=remedy) from None


def _in_short(error: Exception) -> str:
    return " ".join(str(error).split()) or type(error).__name__


def _check_workers(client: Any, folder: Path) -> None:
    """Every worker has this version and sees this folder."""
    token = folder / f".seen-{uuid.uuid4().hex}"
    token.touch()
    try:
        workers = client.run(_facts, token)
    finally:
        token.unlink()
    if not workers:
        remedy = "start some with dask worker ADDRESS"
        raise RecordingError("the scheduler has no workers", remedy=remedy)
    for address, (version, seen) in workers.items():
        if version != __version__:
            problem = f"worker {address} has sagnac {version}, this is {__version__}"
            raise RecordingError(problem, remedy="install the same version everywhere")
        if not seen:
            problem = f"worker {address} does not see this folder"
            remedy = "choose an output that all workers share under one path"
            raise RecordingError(problem, path=str(folder), remedy=remedy)


def _facts(token: Path) -> tuple[str, bool]:
    """On a worker: its version of the package, and whether it sees a file."""
    return __version__, token.exists()


# ---- runner ------------------------------------------------------------------------


def by_gyro(row: Row) -> tuple[Row, ...]:
    """A row for each gyro that has its own N; the row itself if there is but one.

    Gyros that were taken alone have a row each, also those that were refused. A triad on a turning
    table keeps its row, which is of the difference, before those of its gyros.
    """
    alone, refused = row.analysis.get("gyros", {}), row.analysis.get("refused", {})
    if not alone:
        return (row, *(_of_hat(row, name) for name in row.analysis.get("per_gyro", {})))
    return tuple(
        replace(row, analysis=alone[name])
        if name in alone
        else replace(row, state="failed", reason=refused[name], analysis=_of_one(row, name))
        for name in row.analysis["input"]["gyros"]
    )


def _of_hat(row: Row, name: str) -> Row:
    """One gyro of a triad: its own N, and what was decided of it."""
    whole = row.analysis
    kept = {key: whole[key] for key in ("settings", "findings", "notes", "lines") if key in whole}
    kept |= {"angle_random_walk": whole["per_gyro"][name], **_of_one(row, name)}
    if "verdict" in whole:
        own = [one for one in whole["verdict"]["limits"] if one["gyro"] == name]
        kept["verdict"] = {"overall": whole["verdict"]["gyros"].get(name, ""), "limits": own}
    return replace(row, analysis=kept)


def _of_one(row: Row, name: str) -> Mapping[str, Any]:
    return {"input": {**row.analysis["input"], "gyros": [name]}}


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
        return len({row.task.key for row in self.rows}) - self.computed

    @property
    def each(self) -> tuple[Row, ...]:
        """Rows of every gyro: see `by_gyro`."""
        return tuple(one for row in self.rows for one in by_gyro(row))

    @property
    def limits(self) -> tuple[Limit, ...]:
        """Limits that were stated, each once."""
        stated = dict.fromkeys(row.task.settings.specification for row in self.rows)
        return tuple(limit for one in stated if one is not None for limit in one.limits)

    @property
    def failed(self) -> tuple[Row, ...]:
        """Rows without an answer."""
        return tuple(row for row in self.rows if row.state != "done")


def run(
    tasks: Tasks, folder: Path, completed: Completed, span: float | None = None, told: Told = nobody
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
        Does tasks and gives their rows as they come.
    span
        Also cut each recording into spans of this length, s, each a row of its own.
    told
        Called after each task.

    Raises
    ------
    RecordingError
        If the folder cannot be written to, or there are no workers.
    """
    whole_files.made(folder)
    campaign = _rows([with_digest(task) for task in tasks], folder, completed, told)
    if span is None:
        return campaign
    spans = [one for row in campaign.rows for one in span_tasks(row, span)]
    more = _rows(spans, folder, completed, told)
    return Campaign(rows=campaign.rows + more.rows, computed=campaign.computed + more.computed)


def _rows(tasks: Tasks, folder: Path, completed: Completed, told: Told) -> Campaign:
    """Rows of the tasks in their order."""
    rows: dict[str, Row] = {}
    todo: dict[str, Task] = {}
    for task in tasks:
        if row := rows.get(task.key) or read_row(folder, task):
            rows[task.key] = row
        else:
            # Of equal files the first has the report.
            todo.setdefault(task.key, task)
    before, total, began = len(rows), len(rows) + len(todo), time.perf_counter()

    def tell() -> None:
        done, failed = len(rows), sum(row.state != "done" for row in rows.values())
        spent, computed = time.perf_counter() - began, len(rows) - before
        told(Standing(done=done, total=total, failed=failed, elapsed_s=spent, computed=computed))

    if todo:
        tell()
        for row in completed(tuple(todo.values()), folder):
            # A worker may have kept what it could no longer tell: its scheduler was lost before.
            left = read_row(folder, row.task) if row.state == "lost" else None
            rows[row.task.key] = left or row
            tell()
    each = tuple(replace(rows[task.key], task=task) for task in tasks)
    return Campaign(rows=each, computed=len(rows) - before)
