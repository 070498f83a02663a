"""Exit status, errors in one line, progress, and the files that a run writes.

One analysis shows bars on a terminal, else a line a stage once it takes long. Many pieces of work
show one line that is written over on a terminal, else a line a minute.
"""

import errno
import importlib
import os
import sys
import time
from collections.abc import Callable, Container, Iterable, Iterator, Mapping, Sequence
from contextlib import chdir, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, TextIO

import sagnac
from sagnac.core import errors, overwriting
from sagnac.core.texts import OPTION_OF
from sagnac.report import as_typed, error_text, wrapped

if TYPE_CHECKING:
    from sagnac import Analysis
    from sagnac.core.processes import Standing


# ---- errors ------------------------------------------------------------------------

DONE: Final = 0
DATA_ERROR: Final = 1
USAGE_ERROR: Final = 2
INTERRUPTED: Final = 130
# Of a decision.
STATUS: Final[Mapping[str, int]] = {"pass": DONE, "fail": 3, "undecided": 4}

# Characters of a message.
_LONGEST: Final = 780


class UsageError(Exception):
    """Wrong usage that the argument parser cannot see."""


def explain(error: Exception, options: Container[str] = ()) -> int:
    """Say in one line on standard error what went wrong.

    Parameters
    ----------
    error
        What was raised.
    options
        Those of the command: one is named if the library says something of its argument.

    Returns
    -------
    int
        The exit status it means.
    """
    is_usage = isinstance(error, errors.WouldOverwrite | UsageError)
    is_usage |= type(error) in (ValueError, errors.ArgumentError)
    status = USAGE_ERROR if is_usage else DATA_ERROR
    if isinstance(error, errors.RecordingError):
        line = error_text(error)
    elif isinstance(error, errors.ArgumentError):
        option = f"--{OPTION_OF.get(error.argument, error.argument).replace('_', '-')}"
        named = option if option in options else error.argument
        line = f"{error.where}{named} {as_typed(error.problem)}"
    elif is_usage:
        line = as_typed(str(error))
    elif isinstance(error.__cause__, KeyboardInterrupt):
        # An interrupt inside a compiled loop is said to be a failure of that loop.
        line, status = "interrupted", INTERRUPTED
    elif isinstance(error, errors.MissingExtra):
        line = str(error)
    elif isinstance(error, OSError):
        where = f"{error.filename}: " if error.filename else ""
        remedy = "check the path and its rights"
        if error.errno in (errno.EMFILE, errno.ENFILE):
            remedy = "allow more of them (ulimit -n)"
        line = f"{where}{error.strerror or error}; {remedy}"
    elif isinstance(error, MemoryError):
        line = "out of memory; take a part of it (--slice START:STOP), or simulate a shorter one"
    else:
        line = f"internal error: {type(error).__name__}: {error}"
        line += "; run again with --debug for the traceback, and report it"
    complain(line)
    return status


def complain(message: str) -> None:
    """One line on standard error, of which a screen shows no more than ten."""
    line = errors.visible(" ".join(message.split()))
    if len(line) > _LONGEST:
        # What is wrong stands at the beginning, what to do at the end.
        half = _LONGEST // 2
        line = f"{line[:half]} ... {line[-half:]}"
    print(f"sagnac: {line}", file=sys.stderr)


# ---- progress ----------------------------------------------------------------------

Progress = Callable[[str, float], None]

# What takes less than this needs no progress.
PATIENCE_S: Final = 1.0
# Between two lines on how far many pieces are.
BETWEEN_LINES_S: Final = 60.0


# What signals have raised since the command began.
asked: Final[list[KeyboardInterrupt]] = []


def stop(number: int, _frame: object) -> None:
    """Raise what a signal asks for, and keep it: some libraries swallow what is raised in them."""
    asked.append(KeyboardInterrupt(number))
    raise asked[-1]


def go_on() -> None:
    """Raise what a signal has asked for, if that was swallowed."""
    if asked:
        raise asked[0]


@contextmanager
def progress_shown(prefix: str = "") -> Iterator[Progress]:
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

    columns = (TextColumn("{task.description:<24}"), BarColumn(bar_width=36), TimeElapsedColumn())
    bars = Bars(*columns, console=Console(stderr=True), transient=True)
    tasks: dict[str, Any] = {}

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
    """The same with `prefix` before each stage, unless a signal asks to stop."""
    before = f"{errors.one_line(prefix)}: " if prefix else ""

    def show(stage: str, fraction: float) -> None:
        go_on()
        progress(before + stage, fraction)

    return show


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
        # On a terminal the last mark takes away what a longer line left behind this one.
        before, after = ("\r", "\x1b[K") if over else ("", "")
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


# ---- output ------------------------------------------------------------------------


def folders_of(files: Sequence[Path], output: Path | None, *, as_json: bool) -> list[Path | None]:
    """The folder for the results of each file; None for nowhere."""
    if output is None and as_json:
        return [None] * len(files)
    if len(files) == 1 and output is not None:
        return [output]
    folders: list[Path | None] = []
    for file in files:
        # Of ``.`` the name is that of the folder.
        name = Path(os.path.abspath(file)).stem
        folder = output / name if output else Path(f"{name}-report")
        if folder in folders:
            folder = folder.with_name(f"{folder.name}-{len(folders) + 1}")
        folders.append(folder)
    return folders


def require_place(
    folder: Path | None, what: str, reads: Iterable[Path] = (), *, force: bool = False
) -> None:
    """Refuse a folder before the work, make nothing yet, and load what draws into it.

    Parameters
    ----------
    folder
        Folder of the results; None for nowhere.
    what
        Kind of results (`sagnac.core.overwriting.outputs_in`).
    reads
        Files that the run reads.
    force
        Whether other files there may be lost.

    Raises
    ------
    RecordingError
        If it, or the first folder above it that exists, is no folder or may not be written to.
    WouldOverwrite
        If a file is there that would be lost.
    """
    if folder is None:
        return
    there = next(place for place in (folder, *folder.absolute().parents) if place.exists())
    if not there.is_dir() or not os.access(there, os.W_OK | os.X_OK):
        why = "is no folder" if not there.is_dir() else "may not be written to"
        remedy = "choose another folder (-o)"
        problem = why if there == folder else f"{there} {why}"
        raise errors.RecordingError(problem, path=str(folder), remedy=remedy)
    overwriting.require_free(overwriting.outputs_in(folder, what), reads, force=force)
    ready_to_draw()


@contextmanager
def resumable(folder: Path) -> Iterator[None]:
    """Say of work that is interrupted inside that it goes on where it stopped."""
    try:
        yield
    except KeyboardInterrupt:
        complain(f"stopped; start it again with the same folder, and it goes on ({folder})")
        raise


def ready_to_draw() -> None:
    """Load what draws, from where no stray ``matplotlibrc`` lies, which would be believed."""
    with chdir(Path(__file__).parent):
        importlib.import_module("matplotlib")


def verdict_status(analyses: "Sequence[Analysis]") -> int:
    """Exit status that the verdicts on some analyses mean; 0 without a specification."""
    from sagnac.report.sections import overall_decision

    decision = overall_decision(list(analyses))
    return DONE if decision is None else STATUS[decision]


def reported(analysis: "Analysis", folder: Path, **how: Any) -> "tuple[Analysis, tuple[Path, ...]]":
    """The analysis with the time of its report, and the files of that (`sagnac.write_report`)."""
    with progress_shown() as progress:
        progress("report", 0.0)
        report = sagnac.write_report(analysis, folder, **how)
    return report.analysis, report.paths


def show(*texts: str, end: str = "\n\n") -> None:
    """Print each text that says something."""
    for text in filter(None, texts):
        print(text, end=end)


def print_paths(paths: Sequence[Path]) -> None:
    """A line for each file written."""
    if len(paths) == 1:
        print(f"wrote {errors.one_line(str(paths[0]))}")
        return
    for folder in dict.fromkeys(path.parent for path in paths):
        names = [path.name for path in paths if path.parent == folder]
        print(wrapped(f"wrote {errors.one_line(str(folder))}/: {', '.join(names)}"))
