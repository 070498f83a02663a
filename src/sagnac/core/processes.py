"""Jobs done by processes of this machine, each process one job at a time."""

import contextlib
import multiprocessing
import os
import signal
import sys
import threading
from collections import deque
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Final, TypeVar

from sagnac.core.errors import is_finite, quoted, refusal, require_count

Job = TypeVar("Job")
Made = TypeVar("Made")

GIBIBYTE: Final = 2**30


@dataclass(frozen=True, slots=True, kw_only=True)
class Means:
    """Share of this machine that jobs may take.

    Attributes
    ----------
    workers
        Processes, one thread of work each.
    memory
        For all of them, bytes. A job that needs more than is left waits; one that needs more
        than all of it runs alone.

    Raises
    ------
    ValueError
        If there is no worker or no memory.
    """

    workers: int
    memory: float

    def __post_init__(self) -> None:
        require_count("workers", self.workers, 1)
        if not (is_finite(self.memory) and self.memory > 0.0):
            raise refusal("memory", f"is {quoted(self.memory)}; give bytes above zero")


@dataclass(frozen=True, slots=True, kw_only=True)
class Standing:
    """How far the work is.

    Attributes
    ----------
    done, total
        Pieces that have a result now, and all of them.
    failed
        How many of those done have failed.
    elapsed_s
        Since the start.
    computed
        Pieces done since the start; the others were kept.
    """

    done: int
    total: int
    failed: int = 0
    elapsed_s: float
    computed: int

    @property
    def per_hour(self) -> float:
        """Pieces done in an hour at the rate so far; 0 before the first."""
        return 3600.0 * self.computed / self.elapsed_s if self.elapsed_s > 0.0 else 0.0

    @property
    def left_s(self) -> float | None:
        """Time left at this rate, s; None before the first."""
        left = self.total - self.done
        return left * self.elapsed_s / self.computed if self.computed else None


Told = Callable[[Standing], None]


def nobody(_: Standing) -> None:
    """Nobody is told."""


def means_of(workers: int | None = None, memory: float | None = None) -> Means:
    """The share that is stated; else a worker for each core, and the memory that is free now."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    number = (cores or 1) if workers is None else workers
    return Means(workers=number, memory=free_memory() if memory is None else memory)


def completed(
    jobs: Sequence[Job], work: Callable[[Job], Made], means: Means, needed: Callable[[Job], float]
) -> Generator[tuple[Job, Future[Made]], None, None]:
    """Jobs with their futures, which are done, in the order in which they end.

    Each worker is a pool of its own, so that a worker that dies takes one job with it: the future
    of that job raises `BrokenProcessPool`, and the others go on.

    Parameters
    ----------
    jobs
        What to do. They are pickled, and so is `work`; a worker does not import the program.
    work
        Does one of them, in a worker.
    means
        Workers and memory.
    needed
        Bytes that a job may take.
    """
    waiting = deque(jobs)
    idle = [_Worker() for _ in range(min(means.workers, len(jobs)))]
    running: dict[Future[Made], tuple[_Worker, Job, float]] = {}
    try:
        while waiting or running:
            taken = sum(memory for _, _, memory in running.values())
            while waiting and idle:
                memory = needed(waiting[0])
                if running and taken + memory > means.memory:
                    break
                worker, job = idle.pop(), waiting.popleft()
                future = worker.submit(work, job)
                running[future] = worker, job, memory
                taken += memory
            for future in wait(running, return_when=FIRST_COMPLETED).done:
                worker, job, _ = running.pop(future)
                if isinstance(future.exception(), BrokenProcessPool):
                    worker.renew()
                idle.append(worker)
                yield job, future
    finally:
        for worker in (*idle, *(one for one, _, _ in running.values())):
            worker.stop()


@dataclass(slots=True)
class _Worker:
    """One process that does one job at a time, and takes the next when it is done."""

    pool: ProcessPoolExecutor | None = None
    process: int = 0

    def submit(self, work: Callable[[Job], Made], job: Job) -> Future[Made]:
        if self.pool is not None:
            try:
                return self.pool.submit(work, job)
            except BrokenProcessPool:
                # It died between two jobs, which costs neither.
                self.renew()
        try:
            return self._started().submit(work, job)
        except BrokenProcessPool as error:
            failed: Future[Made] = Future()
            failed.set_exception(error)
            return failed

    def _started(self) -> ProcessPoolExecutor:
        # Spawned, not forked: a fork would copy threads of the libraries in mid-step.
        context = multiprocessing.get_context("spawn")
        self.pool = ProcessPoolExecutor(max_workers=1, mp_context=context, initializer=_prepare)
        with _program_hidden():
            self.process = self.pool.submit(os.getpid).result()
        return self.pool

    def renew(self) -> None:
        """Forget a process that died; the next job starts another."""
        if self.pool is not None:
            self.pool.shutdown(wait=False)
        self.pool, self.process = None, 0

    def stop(self) -> None:
        """End the process, in the middle of a job if need be: results appear whole or not."""
        if self.pool is None:
            return
        if self.process:
            with contextlib.suppress(ProcessLookupError):
                os.kill(self.process, signal.SIGTERM)
        self.pool.shutdown(wait=True, cancel_futures=True)
        self.renew()


@contextlib.contextmanager
def _program_hidden() -> Iterator[None]:
    """While a process is spawned it does not see the program, which it would run once more.

    Nor does it see an interrupt, which the parent takes afterwards.
    """
    program = sys.modules["__main__"]
    sys.modules["__main__"] = ModuleType("__main__")
    has_masks = hasattr(signal, "pthread_sigmask")
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT}) if has_masks else set()
    try:
        yield
    finally:
        sys.modules["__main__"] = program
        if has_masks:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _prepare() -> None:
    """In a worker: leave an interrupt to the parent, and end with it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()

    def watch() -> None:
        if parent is not None:
            parent.join()
            os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def free_memory() -> float:
    """Bytes that can be taken without swapping; two gibibytes if nobody says."""
    with contextlib.suppress(OSError, ValueError, IndexError):
        for line in Path("/proc/meminfo").read_text(encoding="ascii").splitlines():
            name, _, rest = line.partition(":")
            if name == "MemAvailable":
                return float(rest.split()[0]) * 1024.0
    return 2.0 * GIBIBYTE
