"""Exit status, errors in one line, progress, and the files that a run writes and reads.

One analysis shows bars on a terminal, else a line a stage once it takes long. Many pieces of work
show one line that is written over on a terminal, else a line a minute.
"""

import importlib
import os
import shlex
import sys
import textwrap
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import chdir, contextmanager
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Final, TextIO

import sagnac
from sagnac.core.errors import one_line, visible
from sagnac.core.texts import OPTION_OF, text_of

if TYPE_CHECKING:
    from rich.progress import TaskID

    from sagnac.core.processes import Standing
    from sagnac.verdict.judgement import Decision


# ---- errors ------------------------------------------------------------------------

DONE: Final = 0
DATA_ERROR: Final = 1
USAGE_ERROR: Final = 2
FAILED: Final = 3
UNDECIDED: Final = 4
INTERRUPTED: Final = 130

# Characters of a message.
_LONGEST: Final = 780


class UsageError(Exception):
    """Wrong usage that the argument parser cannot see."""


@contextmanager
def as_usage() -> Iterator[None]:
    """What the library says of an argument is wrong usage of the option of that name."""
    try:
        yield
    except ValueError as error:
        if type(error) is not ValueError:
            raise
        raise UsageError(f"--{error}") from error


def explain(error: Exception) -> int:
    """Say in one line on standard error what went wrong.

    Returns
    -------
    int
        The exit status it means.
    """
    # Not before something has gone wrong: --help and a wrong option need none of it.
    from sagnac.core.errors import MissingExtra, RecordingError, WouldOverwrite
    from sagnac.report import as_typed, error_text

    status = DATA_ERROR
    if isinstance(error, RecordingError):
        said = error_text(error)
        status = USAGE_ERROR if isinstance(error, WouldOverwrite) else DATA_ERROR
    elif isinstance(error, UsageError) or type(error) is ValueError:
        said, status = as_typed(str(error)), USAGE_ERROR
    elif isinstance(error, MissingExtra):
        said = str(error)
    elif isinstance(error, OSError):
        where = f"{error.filename}: " if error.filename else ""
        said = f"{where}{error.strerror or error}; check the path and its rights"
    elif isinstance(error, MemoryError):
        said = "out of memory; take a part of the recording with --slice START:STOP"
    else:
        said = (
            f"internal error: {type(error).__name__}: {error}; "
            "run again with --debug for the traceback, and report it"
        )
    complain(said)
    return status


def complain(message: str) -> None:
    """One line on standard error, of which a screen shows no more than ten."""
    line = visible(" ".join(message.split()))
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
# Takes away what a longer line left behind this one on a terminal.
_CLEAR: Final = "\x1b[K"


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


# ---- output ------------------------------------------------------------------------


def folders_of(files: Sequence[Path], output: Path | None, *, as_json: bool) -> list[Path | None]:
    """The folder for the results of each file; None for nowhere."""
    if output is None and as_json:
        return [None] * len(files)
    if len(files) == 1 and output is not None:
        return [output]
    taken: set[Path] = set()
    folders: list[Path | None] = []
    for file in files:
        folder = output / file.stem if output else Path(f"{file.stem}-report")
        if folder in taken:
            folder = folder.with_name(f"{folder.name}-{len(taken) + 1}")
        taken.add(folder)
        folders.append(folder)
    return folders


def require_writable(folder: Path | None) -> None:
    """Refuse a folder that cannot be written to before the work, and make nothing yet.

    Raises
    ------
    RecordingError
        If it, or the first folder above it that exists, is no folder or may not be written to.
    """
    from sagnac.core.errors import RecordingError

    if folder is None:
        return
    there = next(place for place in (folder, *folder.absolute().parents) if place.exists())
    if not there.is_dir() or not os.access(there, os.W_OK | os.X_OK):
        why = "is no folder" if not there.is_dir() else "may not be written to"
        raise RecordingError(
            f"{there} {why}", path=str(folder), remedy="choose another folder (-o)"
        )


def ready_to_draw() -> None:
    """Load what draws, from where no stray ``matplotlibrc`` lies, which would be believed."""
    with chdir(Path(__file__).parent):
        importlib.import_module("matplotlib")


def verdict_status(analyses: "Sequence[sagnac.Analysis]") -> int:
    """Exit status that the verdicts on some analyses mean; 0 without a specification."""
    from sagnac.report.sections import overall_decision

    return status_of(overall_decision(list(analyses)))


def status_of(decision: "Decision | None") -> int:
    """Exit status that a decision means."""
    return {None: DONE, "pass": DONE, "fail": FAILED, "undecided": UNDECIDED}[decision]


def print_documents(
    analyses: "Sequence[sagnac.Analysis]",
    *,
    single: bool,
    unit: "sagnac.Analysis | None" = None,
    beside: Mapping[str, object] | None = None,
) -> None:
    """JSON on standard output: one document, or one of several, the gyros of a unit if it is one.

    See `sagnac.report.document.many_document`; `beside` stands under its keys.
    """
    from sagnac.report.document import analysis_document, many_document, to_json

    made = analysis_document(analyses[0]) if single else many_document(analyses, unit)
    print(to_json({**made, **(beside or {})}))


def print_beside(analysis: "sagnac.Analysis") -> None:
    """The accelerometers of an analysis, and the channels that were not analyzed."""
    from sagnac.report import text

    for shown in (text.accelerometers(analysis), text.refused(analysis)):
        if shown:
            print(shown, end="\n\n")


def print_closing(named: "Sequence[tuple[str, sagnac.Analysis]]", end: str = "\n") -> None:
    """A row for each gyro of several, by the names of their files."""
    from sagnac.report import text

    shown = text.closing(named)
    if shown:
        print(shown, end=end)


def print_paths(paths: Sequence[Path]) -> None:
    """A line for each file written."""
    if len(paths) == 1:
        print(f"wrote {one_line(str(paths[0]))}")
        return
    folders = dict.fromkeys(path.parent for path in paths)
    for folder in folders:
        names = [path.name for path in paths if path.parent == folder]
        line = textwrap.fill(
            f"wrote {one_line(str(folder))}/: {', '.join(names)}",
            80,
            subsequent_indent="  ",
            break_long_words=False,
            break_on_hyphens=False,
        )
        print(line)


# ---- reading -----------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class ReadFile:
    """A recording, and how long it took to read, s by stage."""

    recording: "sagnac.Recording"
    seconds: dict[str, float]


def read_file(
    file: Path,
    statement: "sagnac.Statement",
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
    from sagnac.formats.files import USUAL, limited

    began = time.perf_counter()
    progress("read", 0.0)
    with limited(memory or USUAL):
        recording = sagnac.read(file, statement, verify=verify)
    progress("read", 1.0)
    return ReadFile(recording=recording, seconds={"read": time.perf_counter() - began})


def command_for(
    file: Path, statement: "sagnac.Statement", lacking: Mapping[str, str] | None = None
) -> str:
    """The command that would read a file, with what is stated and, as options, what is missing."""
    lacking = lacking or {}
    options = {**stated_options(statement), **lacking}
    if "columns" in lacking:
        # They name the gyros, too.
        options.pop("gyros", None)
    return _command(file, options)


def command_with_accelerometers(file: Path, statement: "sagnac.Statement") -> str | None:
    """The command that reads the accelerometers of a file, too; None if that needs no option more.

    Parameters
    ----------
    file, statement
        A file that can be read, and what is stated of it.

    Raises
    ------
    RecordingError
        If the file cannot be opened.
    """
    from sagnac.formats import accelerometers_in

    besides = accelerometers_in(file, statement)
    if not besides:
        return None
    options = stated_options(statement)
    for name, value in besides.items():
        before = options.get(name)
        if name == "unit" and before is not None and "=" not in before:
            # One unit for all gyros cannot stand beside one for the accelerometers.
            before = f"gyros={before}"
        options[name] = value if before is None else f"{before},{value}"
    return _command(file, options)


def _command(file: Path, options: Mapping[str, str]) -> str:
    table = options.get("table", "none")
    words = ["sagnac", "avar" if table == "none" else "analyze", shlex.quote(str(file))]
    for name, value in options.items():
        words += [f"--{name}", shlex.quote(value)]
    return " ".join(words)


def stated_options(statement: "sagnac.Statement") -> dict[str, str]:
    """Statements of a caller as options: name -> value."""
    # The channels first, then what they are.
    inputs = dict.fromkeys(("gyros", "accelerometers", "columns"))
    inputs |= {field.name: None for field in fields(statement)}
    stated = {name: getattr(statement, name) for name in inputs}
    return {
        OPTION_OF.get(name, name).replace("_", "-"): text_of(value)
        for name, value in stated.items()
        if value is not None and value != {}
    }


@contextmanager
def naming(file: Path, recording: "sagnac.Recording") -> Iterator[None]:
    """Put the file into a data error of a stage that knows nothing of files.

    What a fit or a factorization cannot do with numbers is a fault of the data, too; the error says
    which numbers they are.
    """
    try:
        yield
    except (sagnac.RecordingError, sagnac.MissingExtra) as error:
        raise error.at(str(file)) from error
    except (ValueError, ArithmeticError) as error:
        # numpy's LinAlgError is a ValueError.
        raise sagnac.RecordingError(
            f"the analysis fails ({error}) on {_numbers(recording)}",
            path=str(file),
            remedy="look at the data with sagnac check",
        ) from error


def _numbers(recording: "sagnac.Recording") -> str:
    """The samples of each channel in one line: how many, and between which values they lie."""
    said = []
    for channel in (*recording.gyros, *recording.accelerometers):
        unit, values = channel.plain_unit, channel.values
        ends = f"{values.min() / unit.size:.4g} to {values.max() / unit.size:.4g}"
        said.append(f"{channel.name}: {values.size} samples from {ends} {unit.name}")
    return ", ".join(said)
