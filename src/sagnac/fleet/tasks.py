"""The tasks of a campaign, a recording and its settings each, and the result of one.

Tasks come from files, folders or a TOML. One runs in any process; a campaign resumes from the files
of results alone.
"""

import hashlib
import json
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from importlib import import_module
from pathlib import Path
from typing import Any, Final, Literal, get_args

from sagnac.analysis.pipeline import analyze
from sagnac.analysis.settings import Settings
from sagnac.core.documents import ANY, NUMBER, TEXT, TEXTS, read_toml, table
from sagnac.core.errors import MissingExtra, RecordingError, quoted
from sagnac.core.version import __version__
from sagnac.core.whole_files import write_text
from sagnac.formats import read
from sagnac.formats.registry import FORMATS
from sagnac.formats.statement import Statement, beside_paths, from_mapping
from sagnac.report import error_text
from sagnac.report.document import analysis_document, to_json
from sagnac.verdict.limits import Specification, specification_of

# ---- tasks -------------------------------------------------------------------------

SCHEMA: Final = "sagnac.campaign-result/1"
LABELS: Final = ("unit", "day", "rate")


@dataclass(frozen=True, slots=True, kw_only=True)
class Task:
    """One row of a campaign: a recording, a method, and a gyro or a pair.

    Attributes
    ----------
    path
        Of the file, absolute, as workers see it.
    settings
        Method, gyros, interval and confidence.
    statement
        What is stated of the file from outside.
    labels
        ``unit``, ``day`` and ``rate`` (deg/s) as far as they are known. The result does not depend
        on them.
    sha256
        Of the file; empty if it could not be read.
    """

    path: str
    settings: Settings = field(default_factory=Settings)
    statement: Statement = field(default_factory=Statement)
    labels: Mapping[str, str] = field(default_factory=dict)
    sha256: str = ""

    @property
    def key(self) -> str:
        """Digest of everything that the result depends on: file, statements, settings, version."""
        what = {
            "schema": SCHEMA,
            "version": __version__,
            "sha256": self.sha256 or self.path,
            "beside": _beside_digest(Path(self.path)),
            "statement": asdict(self.statement),
            "settings": asdict(self.settings),
        }
        return hashlib.sha256(json.dumps(what, sort_keys=True).encode()).hexdigest()[:32]


def with_digest(task: Task) -> Task:
    """The task with the digest of its file; unchanged if the file cannot be read.

    What is wrong with such a file is said by its row, not by the plan.
    """
    try:
        with open(task.path, "rb") as stream:
            return replace(task, sha256=hashlib.file_digest(stream, "sha256").hexdigest())
    except OSError:
        return task


def require_same_file(task: Task, sha256: str) -> None:
    """Refuse a file that is not the one the task was planned for.

    Raises
    ------
    RecordingError
        If it has another digest.
    """
    if sha256 != task.sha256:
        raise RecordingError(
            "is not the file that the campaign was planned with",
            path=task.path,
            remedy="let all workers see the same files, and start the campaign again",
        )


def _beside_digest(path: Path) -> str:
    """Digest of the TOML beside a file, which states what the file does not; empty without one."""
    found = next(filter(Path.is_file, beside_paths(path)), None)
    return "" if found is None else hashlib.sha256(found.read_bytes()).hexdigest()


# ---- config ------------------------------------------------------------------------

_SUFFIXES: Final = frozenset(suffix for one in FORMATS for suffix in one.suffixes)
_CAMPAIGN: Final = table(
    {
        "files": TEXTS,
        "methods": TEXTS,
        "gyros": TEXTS,
        "interval_s": NUMBER,
        "confidence": NUMBER,
        "pattern": TEXT,
        "spec": {**TEXT, "description": 'give a limit in quotes, such as "3e-4deg/sqrt(h)"'},
        "risk": NUMBER,
        "statement": {"type": "object", "description": "it is a table, write [statement]"},
        "recording": {
            "type": "array",
            "items": table(
                {
                    "file": {**TEXT, "description": "give file, the path of a recording"},
                    **dict.fromkeys(LABELS, ANY),
                },
                needed=("file",),
            ),
            "description": "it is a list of tables, write [[recording]]",
        },
    }
)
_REMEDY: Final = "see docs/campaign.md for the keys of a campaign"


@dataclass(frozen=True, slots=True, kw_only=True)
class Choices:
    """Choices for all recordings of a campaign unless its TOML says otherwise.

    Attributes
    ----------
    settings
        Method, gyros, interval and confidence.
    statement
        What is stated of the files from outside.
    pattern
        A regular expression with the groups ``unit``, ``day`` and ``rate``, or some of them, that
        is looked for in the path of each file; empty for none.

    Raises
    ------
    ValueError
        If the pattern is no regular expression or has none of these groups.
    """

    settings: Settings = field(default_factory=Settings)
    statement: Statement = field(default_factory=Statement)
    pattern: str = ""

    def __post_init__(self) -> None:
        stated = f"pattern is {quoted(self.pattern)}"
        try:
            groups = set(re.compile(self.pattern).groupindex)
        except re.error as error:
            raise ValueError(f"{stated}; give a regular expression ({error})") from None
        if self.pattern and (not groups or groups - set(LABELS)):
            among = ", ".join(LABELS)
            raise ValueError(f"{stated}; give it groups such as (?P<unit>…), of {among}")

    def labels_of(self, path: Path) -> dict[str, str]:
        """Unit, day and rate by the path of a file."""
        found = re.search(self.pattern, path.as_posix()) if self.pattern else None
        if found is None:
            return {}
        return {name: value for name, value in found.groupdict().items() if value}


def tasks_of(sources: Sequence[Path], choices: Choices) -> tuple[Task, ...]:
    """The rows of a campaign, in the order of its sources.

    Parameters
    ----------
    sources
        One TOML of a campaign, or recordings and folders of recordings.
    choices
        What holds for all of them.

    Raises
    ------
    RecordingError
        If a source does not exist, a folder holds no recording, or the TOML is wrong.
    """
    if len(sources) == 1 and sources[0].suffix.lower() == ".toml":
        return _of_toml(sources[0], choices)
    files = [file for source in sources for file in _files_of(source)]
    return tuple(_task(file, choices, {}) for file in dict.fromkeys(files))


def _task(path: Path, choices: Choices, labels: Mapping[str, str]) -> Task:
    return Task(
        path=str(path.absolute()),
        settings=choices.settings,
        statement=choices.statement,
        labels={**choices.labels_of(path), **labels},
    )


def _files_of(source: Path) -> list[Path]:
    if not source.is_dir():
        # A file that does not exist is a row that says so.
        return [source]
    inside = sorted(source.rglob("*"))
    files = [one for one in inside if one.suffix.lower() in _SUFFIXES and one.is_file()]
    if not files:
        remedy = f"name files that end in one of {', '.join(sorted(_SUFFIXES))}"
        raise RecordingError("holds no recording", path=str(source), remedy=remedy)
    return files


def _of_toml(path: Path, choices: Choices) -> tuple[Task, ...]:
    try:
        return _planned(read_toml(path, _CAMPAIGN), path.parent, choices)
    except OSError as error:
        raise RecordingError(
            f"cannot be read ({error.strerror})", path=str(path), remedy="check the path"
        ) from None
    except RecordingError as error:
        raise error.at(str(path)) from None
    except (ValueError, TypeError) as error:
        raise RecordingError(str(error), path=str(path), remedy=_REMEDY) from None


def _planned(content: Mapping[str, Any], folder: Path, choices: Choices) -> tuple[Task, ...]:
    common = _common(content, folder, choices)
    listed: list[tuple[Path, dict[str, str]]] = [
        (file, {}) for pattern in _texts(content, "files") for file in _matching(folder, pattern)
    ]
    for entry in content.get("recording", []):
        labels = {name: _label(entry[name]) for name in LABELS if name in entry}
        listed += [(file, labels) for file in _matching(folder, entry["file"])]
    if not listed:
        raise ValueError("names no recording; give files = […] or [[recording]] with a file")
    return tuple(
        _task(file, replace(common, settings=settings), labels)
        for file, labels in listed
        for settings in _all_settings(content, common.settings)
    )


def _common(content: Mapping[str, Any], folder: Path, choices: Choices) -> Choices:
    specification = _specification(content, folder) or choices.settings.specification
    confidence = choices.settings.confidence
    if "spec" in content and specification is not None and specification.risk is not None:
        confidence = 1.0 - specification.risk
    settings = replace(
        choices.settings,
        interval=content.get("interval_s", choices.settings.interval),
        confidence=content.get("confidence", confidence),
        specification=specification,
    )
    stated = content.get("statement")
    return Choices(
        settings=settings,
        statement=choices.statement if stated is None else from_mapping(stated),
        pattern=content.get("pattern", choices.pattern),
    )


def _specification(content: Mapping[str, Any], folder: Path) -> Specification | None:
    """Limits of ``spec`` and ``risk``; a TOML of limits is looked for beside the campaign's."""
    if "spec" not in content:
        if "risk" in content:
            raise ValueError("risk is stated without spec; state the limit that it is of")
        return None
    text, risk = content["spec"], content.get("risk")
    if text.strip().endswith(".toml"):
        text = str(folder / text.strip())
    try:
        return specification_of(text, risk=risk)
    except OSError as error:
        raise ValueError(f"spec {text} cannot be read ({error.strerror})") from None


def _all_settings(content: Mapping[str, Any], settings: Settings) -> list[Settings]:
    """One for each method and each gyro or pair."""
    methods = _texts(content, "methods") or [settings.method]
    gyros = [tuple(name.strip() for name in text.split(",")) for text in _texts(content, "gyros")]
    return [
        replace(settings, method=method, gyros=names)
        for method in methods
        for names in gyros or [settings.gyros]
    ]


def _texts(content: Mapping[str, Any], name: str) -> list[Any]:
    value = content.get(name, [])
    return [value] if isinstance(value, str) else value


def _label(value: object) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)


def _matching(folder: Path, pattern: str) -> Iterable[Path]:
    """Files that a pattern matches; the path itself if it is no pattern."""
    if not any(sign in pattern for sign in "*?["):
        return [folder / pattern]
    if Path(pattern).is_absolute():
        raise ValueError(f"{pattern!r} is a pattern; give it relative to this file")
    found = sorted(folder.glob(pattern))
    if not found:
        raise ValueError(f"{pattern!r} matches no file")
    return found


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
    write_text(path, json.dumps(content, ensure_ascii=False, indent=1))


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
    spans = [(first + number * span, first + (number + 1) * span) for number in range(count)]
    return tuple(replace(task, statement=replace(task.statement, span=one)) for one in spans)


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
    except MissingExtra as error:
        return lost(task, str(error))
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
    # A table of results needs no plots, which are slow to load: only who measures draws.
    import_module("sagnac.report.page").write_page(analysis, folder / report / "report.html")
    write_text(folder / report / "analysis.json", to_json(document) + "\n")
    return Result(key=task.key, state="done", report=report.as_posix(), analysis=_kept(document))
