"""One task done, its result and the file of it, and one long recording as several tasks.

A campaign resumes from the files of results alone. A task runs in any process.
"""

import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, Final, Literal, get_args

from sagnac.analysis.pipeline import analyze
from sagnac.errors import RecordingError
from sagnac.fleet.config import SCHEMA, Task, require_same_file
from sagnac.formats import read
from sagnac.formats.files import replacing
from sagnac.report.command_line import error_text
from sagnac.report.document import analysis_document, to_json
from sagnac.report.files import write_text
from sagnac.report.page import write_page
from sagnac.version import __version__

# ---- results -----------------------------------------------------------------------

State = Literal["done", "failed", "lost"]
_FOLDER: Final = "results"
# Keys of analysis.json that the table and the page are made of. `verdict` is there if a
# specification was given.
_KEPT: Final = (
    "input",
    "settings",
    "channel",
    "gyros_differenced",
    "angle_random_walk",
    "coefficients",
    "covariance",
    "parts",
    "per_gyro",
    "refused",
    "curve",
    "findings",
    "notes",
    "verdict",
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Result:
    """Result of one task.

    Attributes
    ----------
    key
        Of the task.
    state
        ``done``; ``failed``: the recording cannot be analyzed, which the next start does not try
        again; ``lost``: the worker died or ran out of something, which it does.
    reason
        Why it is not done, one line.
    report
        Folder of its report, relative to that of the campaign.
    analysis
        The keys of its ``analysis.json`` that tables are made of, and ``lines``, their number;
        ``gyros`` holds the same of each gyro that was taken alone.
    """

    key: str
    state: State
    reason: str = ""
    report: str = ""
    analysis: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.state not in get_args(State):
            raise ValueError(f"state is {self.state!r}; use one of {', '.join(get_args(State))}")
        if (self.state == "done") == bool(self.reason):
            raise ValueError(f"state is {self.state!r} with the reason {self.reason!r}")

    @property
    def duration_s(self) -> float:
        """Length of the recording, s; 0 if it could not be read."""
        return float(self.analysis.get("input", {}).get("duration_s", 0.0))


def done(task: Task, document: Mapping[str, Any], report: str) -> Result:
    """The result of a task from its ``analysis.json``."""
    return Result(key=task.key, state="done", report=report, analysis=_kept(document))


def _kept(document: Mapping[str, Any]) -> dict[str, Any]:
    kept = {name: document[name] for name in _KEPT if name in document}
    kept["lines"] = len(document["lines"])
    if "gyros" in document:
        kept["gyros"] = {name: _kept(one) for name, one in document["gyros"].items()}
    return kept


def result_path(folder: Path, key: str) -> Path:
    """Where the result of a key lies."""
    return folder / _FOLDER / f"{key}.json"


def write_result(folder: Path, result: Result) -> None:
    """Keep a result; its file appears only when it is whole.

    Raises
    ------
    RecordingError
        If the folder cannot be written to.
    """
    path = result_path(folder, result.key)
    path.parent.mkdir(parents=True, exist_ok=True)
    content = {"schema": SCHEMA, "version": __version__, **asdict(result)}
    with replacing(path) as temporary:
        temporary.write_text(json.dumps(content, ensure_ascii=False, indent=1), encoding="utf-8")


def read_result(folder: Path, key: str) -> Result | None:
    """A kept result; None if there is none, or its file is not one."""
    try:
        content = json.loads(result_path(folder, key).read_text(encoding="utf-8"))
        if content.pop("schema") != SCHEMA or content["key"] != key:
            return None
        content.pop("version")
        return Result(**content)
    except (OSError, ValueError, TypeError, KeyError):
        return None


# ---- spans -------------------------------------------------------------------------


def span_tasks(task: Task, result: Result, span: float) -> tuple[Task, ...]:
    """Tasks of equal spans of a recording, as many as fit.

    Parameters
    ----------
    task, result
        Of the whole recording, which says how long it is.
    span
        Length of each, s.

    Returns
    -------
    tuple of Task
        None if the recording has no result, or is shorter than two spans.

    Raises
    ------
    ValueError
        If `span` is not above zero.
    """
    if not (math.isfinite(span) and span > 0.0):
        raise ValueError(f"span is {span!r}; give seconds above zero")
    first = (task.statement.span or (0.0, None))[0] or 0.0
    count = math.floor(result.duration_s / span * (1.0 + 1e-9))
    if count < 2:
        return ()
    return tuple(
        replace(
            task,
            statement=replace(
                task.statement, span=(first + number * span, first + (number + 1) * span)
            ),
        )
        for number in range(count)
    )


def span_of(task: Task) -> tuple[float, float] | None:
    """Start and stop of the span that a task is of, s; None for a whole recording."""
    limits = task.statement.span
    if limits is None or limits[0] is None or limits[1] is None:
        return None
    return (limits[0], limits[1])


# ---- measure -----------------------------------------------------------------------

_REPORTS: Final = "reports"


def measure(task: Task, folder: Path) -> Result:
    """Analyze a recording, write its report, and then its result.

    Nothing is raised for what is wrong with the recording: that is a result, too. What is wrong
    with the machine, such as memory or disk that ran out, is a result that is not kept.

    Parameters
    ----------
    task
        What to do.
    folder
        Of the campaign, as this process sees it.
    """
    try:
        result = _measured(task, folder)
    except RecordingError as error:
        result = Result(key=task.key, state="failed", reason=error_text(error))
    except MemoryError:
        return lost(task, "memory ran out; allow fewer workers")
    except OSError as error:
        return lost(task, f"{error.filename or task.path}: {error.strerror or error}")
    except Exception as error:
        return lost(task, f"{task.path}: internal error: {type(error).__name__}: {error}")
    write_result(folder, result)
    return result


def lost(task: Task, reason: str) -> Result:
    """The result of a task that the next start tries again."""
    return Result(key=task.key, state="lost", reason=" ".join(reason.split()))


def _measured(task: Task, folder: Path) -> Result:
    recording = read(task.path, task.statement)
    if recording.provenance is not None and task.sha256:
        require_same_file(task, recording.provenance.sha256)
    analysis = analyze(recording, task.settings)
    report = Path(_REPORTS) / f"{Path(task.path).stem}-{task.key[:12]}"
    (folder / report).mkdir(parents=True, exist_ok=True)
    document = analysis_document(analysis)
    write_page(analysis, folder / report / "report.html")
    write_text(folder / report / "analysis.json", to_json(document) + "\n")
    return done(task, document, report.as_posix())
