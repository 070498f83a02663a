"""Tasks done by processes of this machine, one recording each at a time."""

import contextlib
import multiprocessing
import os
import signal
import threading
from collections import deque
from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from sagnac.campaign.measure import lost, measure
from sagnac.campaign.results import Result
from sagnac.campaign.tasks import Task

GIBIBYTE: Final = 2**30
# An analysis works by blocks, with what is too long in scratch files.
_ANALYSIS: Final = 1.0 * GIBIBYTE
# Formats that are read column by column and block by block; others are loaded whole.
_BY_BLOCKS: Final = frozenset({".parquet", ".pq", ".h5", ".hdf5", ".he5", ".nc"})
# Memory for each byte of such a file: its text, its numbers, and those of each stage.
_WHOLE: Final = 4.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Means:
    """What a campaign may take of this machine.

    Attributes
    ----------
    workers
        Processes, one thread of work each.
    memory
        For all of them, bytes. A task that needs more than is left waits; one that needs more
        than all of it runs alone.

    Raises
    ------
    ValueError
        If there is no worker or no memory.
    """

    workers: int
    memory: float

    def __post_init__(self) -> None:
        if self.workers < 1:
            raise ValueError(f"workers is {self.workers}; give one or more")
        if not self.memory > 0.0:
            raise ValueError(f"memory is {self.memory!r}; give bytes above zero")


def means_of(workers: int | None = None, memory: float | None = None) -> Means:
    """What is stated; else a worker for each core, and the memory that is free now."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    return Means(
        workers=workers if workers is not None else (cores or 1),
        memory=memory if memory is not None else _free_memory(),
    )


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

    Each worker is a pool of its own, so that a worker that dies takes one task with it and the
    result says which.

    Parameters
    ----------
    tasks
        What to do.
    folder
        Of the campaign.
    means
        Workers and memory.
    """
    waiting = deque(tasks)
    idle = [_Worker() for _ in range(min(means.workers, len(tasks)))]
    running: dict[Future[Result], _Running] = {}
    try:
        while waiting or running:
            taken = sum(one.memory for one in running.values())
            while waiting and idle:
                needed = needed_memory(waiting[0].path)
                if running and taken + needed > means.memory:
                    break
                worker, task = idle.pop(), waiting.popleft()
                future = worker.submit(task, folder)
                running[future] = _Running(worker=worker, task=task, memory=needed)
                taken += needed
            for future in wait(running, return_when=FIRST_COMPLETED).done:
                one = running.pop(future)
                try:
                    result = future.result()
                except BrokenProcessPool:
                    one.worker.renew()
                    result = lost(one.task, "the worker died; it was killed, or memory ran out")
                idle.append(one.worker)
                yield one.task, result
    finally:
        for worker in (*idle, *(one.worker for one in running.values())):
            worker.stop()


@dataclass(slots=True)
class _Worker:
    """One process that does one task at a time, and takes the next when it is done."""

    pool: ProcessPoolExecutor | None = None
    process: int = 0

    def submit(self, task: Task, folder: Path) -> Future[Result]:
        if self.pool is None:
            # Spawned, not forked: a fork would copy threads of the libraries in mid-step.
            self.pool = ProcessPoolExecutor(
                max_workers=1,
                mp_context=multiprocessing.get_context("spawn"),
                initializer=_prepare,
            )
            started = self.pool.submit(os.getpid)
            try:
                self.process = started.result()
            except BrokenProcessPool:
                return started  # type: ignore[return-value]  # fails in the same way as the task
        return self.pool.submit(measure, task, folder)

    def renew(self) -> None:
        """Forget a process that died; the next task starts another."""
        if self.pool is not None:
            self.pool.shutdown(wait=False)
        self.pool, self.process = None, 0

    def stop(self) -> None:
        """End the process, in the middle of a task if need be: results appear whole or not."""
        if self.pool is None:
            return
        if self.process:
            with contextlib.suppress(ProcessLookupError):
                os.kill(self.process, signal.SIGTERM)
        self.pool.shutdown(wait=True, cancel_futures=True)
        self.renew()


@dataclass(frozen=True, slots=True, kw_only=True)
class _Running:
    worker: _Worker
    task: Task
    memory: float = field(default=0.0)


def _prepare() -> None:
    """In a worker: leave an interrupt to the parent, and end with it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()

    def watch() -> None:
        if parent is not None:
            parent.join()
            os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def _free_memory() -> float:
    """Bytes that can be taken without swapping; two analyses' worth if nobody says."""
    try:
        for line in Path("/proc/meminfo").read_text(encoding="ascii").splitlines():
            name, _, rest = line.partition(":")
            if name == "MemAvailable":
                return float(rest.split()[0]) * 1024.0
    except (OSError, ValueError, IndexError):
        pass
    return 2.0 * _ANALYSIS
