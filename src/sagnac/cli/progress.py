"""Progress on standard error: bars on a terminal, else a line a stage once it takes long."""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Final, TextIO

if TYPE_CHECKING:
    from rich.progress import TaskID

Progress = Callable[[str, float], None]

# What takes less than this needs no progress.
PATIENCE_S: Final = 1.0


@contextmanager
def shown(prefix: str = "") -> Iterator[Progress]:
    """A function to be called with a stage and the fraction of it done.

    Parameters
    ----------
    prefix
        Goes before each stage, such as the file it is of.
    """
    if not sys.stderr.isatty():
        yield prefixed(stage_lines(sys.stderr), prefix)
        return
    from rich.console import Console
    from rich.progress import BarColumn, TextColumn, TimeElapsedColumn
    from rich.progress import Progress as Bars

    bars = Bars(
        TextColumn("{task.description:<24}"),
        BarColumn(bar_width=36),
        TimeElapsedColumn(),
        console=Console(stderr=True),
        transient=True,
    )
    tasks: dict[str, TaskID] = {}

    def show(stage: str, fraction: float) -> None:
        if stage not in tasks:
            for task in tasks.values():
                bars.update(task, completed=1.0)
            tasks[stage] = bars.add_task(stage, total=1.0)
        bars.update(tasks[stage], completed=fraction)

    with bars:
        yield prefixed(show, prefix)


def stage_lines(stream: TextIO) -> Progress:
    """A line for each stage that begins after `PATIENCE_S`, with the time it began at."""
    began = time.perf_counter()
    told: set[str] = set()

    def show(stage: str, fraction: float) -> None:
        spent = time.perf_counter() - began
        if stage in told or spent < PATIENCE_S or fraction >= 1.0:
            return
        told.add(stage)
        print(f"[{spent:6.1f} s] {stage}", file=stream, flush=True)

    return show


def prefixed(progress: Progress, prefix: str) -> Progress:
    """The same with `prefix` before each stage."""
    if not prefix:
        return progress
    return lambda stage, fraction: progress(f"{prefix}: {stage}", fraction)
