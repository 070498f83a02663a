"""Progress on standard error.

One analysis shows bars on a terminal, else a line a stage once it takes long. Many pieces of work
show one line that is written over on a terminal, else a line a minute.
"""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Final, TextIO

from sagnac.errors import one_line

if TYPE_CHECKING:
    from rich.progress import TaskID

    from sagnac.processes import Standing

Progress = Callable[[str, float], None]

# What takes less than this needs no progress.
PATIENCE_S: Final = 1.0
# Between two lines on how far many pieces are.
BETWEEN_LINES_S: Final = 60.0
# Takes away what a longer line left behind this one on a terminal.
_CLEAR: Final = "\x1b[K"


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
    before = one_line(prefix)
    return lambda stage, fraction: progress(f"{before}: {stage}", fraction)


def standings() -> "Callable[[Standing], None]":
    """A function to be called as pieces of work are done."""
    latest = -BETWEEN_LINES_S
    over = sys.stderr.isatty()

    def tell(standing: "Standing") -> None:
        nonlocal latest
        last = standing.done == standing.total
        now = time.monotonic()
        if not (over or last or standing.done == 0 or now - latest >= BETWEEN_LINES_S):
            return
        latest = now
        before, after = ("\r", _CLEAR) if over else ("", "")
        end = "\n" if last or not over else ""
        print(f"{before}{standing_text(standing)}{after}", file=sys.stderr, end=end, flush=True)

    return tell


def standing_text(standing: "Standing") -> str:
    """How far the work is, in one line."""
    parts = [f"{standing.done} of {standing.total} done"]
    if standing.failed:
        parts.append(f"{standing.failed} failed")
    if standing.left_s is not None and standing.done < standing.total:
        minutes = standing.left_s / 60.0
        left = f"{minutes:.0f} min" if minutes < 120.0 else f"{minutes / 60.0:.1f} h"
        parts += [f"{standing.per_hour:.3g} an hour", f"{left} left"]
    return ", ".join(parts)
