"""The tasks of a campaign, a recording and its settings each, and the row that one gives.

Tasks come from files, folders or a TOML. One runs in any process; a campaign resumes from the files
of results and reports alone.
"""

import hashlib
import json
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from importlib import import_module
from itertools import product
from pathlib import Path
from typing import Any, Final, Literal

from sagnac.analysis.pipeline import analyze
from sagnac.analysis.settings import Settings
from sagnac.core.documents import ANY, NUMBER, TEXT, TEXTS, listed, read_toml, table
from sagnac.core.errors import MissingExtra, RecordingError, quoted, refusal, require_choice
from sagnac.core.overwriting import results_in
from sagnac.core.version import __version__
from sagnac.core.whole_files import made, write_text
from sagnac.fleet.study import FACTORS
from sagnac.formats import read, registry
from sagnac.formats.statement import Statement, beside_paths, from_mapping
from sagnac.recording.model import MINIMUM_SAMPLES
from sagnac.report import error_text
from sagnac.report.document import analysis_document, to_json
from sagnac.verdict.limits import specification_of

# ---- tasks -------------------------------------------------------------------------

SCHEMA: Final = "sagnac.campaign-result/1"


@dataclass(frozen=True, kw_only=True)
class Task:
    """A recording, a method, and a gyro or a pair.

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
    span
        Start and stop of the span that it is of, s; None for a whole recording, also without its
        warm-up.
    """

    path: str
    settings: Settings = field(default_factory=Settings)
    statement: Statement = field(default_factory=Statement)
    labels: Mapping[str, str] = field(default_factory=dict)
    sha256: str = ""
    span: tuple[float, float] | None = None

    @cached_property
    def key(self) -> str:
        """Digest of everything that the result depends on: file, statements, settings, version."""
        beside = next(filter(Path.is_file, beside_paths(Path(self.path))), None)
        what = {
            "schema": SCHEMA,
            "version": __version__,
            "sha256": self.sha256 or self.path,
            # The TOML beside a file states what the file does not.
            "beside": "" if beside is None else hashlib.sha256(beside.read_bytes()).hexdigest(),
            "statement": asdict(self.statement),
            "settings": asdict(self.settings),
        }
        return hashlib.sha256(json.dumps(what, sort_keys=True).encode()).hexdigest()[:32]


def with_digest(task: Task) -> Task:
    """The task with the digest of its file; unchanged if the file cannot be read.

    What is wrong with such a file is said by its row, not by the plan.
    """
    with suppress(OSError), open(task.path, "rb") as stream:
        return replace(task, sha256=hashlib.file_digest(stream, "sha256").hexdigest())
    return task


# ---- config ------------------------------------------------------------------------

_SUFFIXES: Final = frozenset(suffix for one in registry.FORMATS for suffix in one.suffixes)
_FILE: Final = {**TEXT, "description": "give file, the path of a recording"}
_RATE: Final = {**NUMBER, "description": "give deg/s as a number"}
_RECORDING: Final = table({"file": _FILE, "unit": ANY, "day": ANY, "rate": _RATE}, ("file",))
_CAMPAIGN: Final = {
    **dict.fromkeys(("files", "methods", "gyros"), TEXTS),
    **dict.fromkeys(("interval_s", "confidence"), NUMBER),
    "pattern": TEXT,
    "spec": {**TEXT, "description": 'give a limit in quotes, such as "3e-4deg/sqrt(h)"'},
    "risk": NUMBER,
    "statement": {"type": "object", "description": "it is a table, write [statement]"},
    "recording": listed(_RECORDING, "it is a list of tables, write [[recording]]"),
}
_REMEDY: Final = "see docs/campaign.md for the keys of a campaign"
# Keys of a campaign that a command or call may state as well, by what they are called there.
_RENAMED: Final = {"method": "methods", "interval": "interval_s"}
_KEYS: Final = {name: name for name in ("gyros", "confidence", "pattern")} | _RENAMED


@dataclass(frozen=True, slots=True, kw_only=True)
class Choices:
    """Choices for all recordings of a campaign unless its TOML says otherwise.

    What they state goes over it: of the files over its statement, as over the TOML beside a file,
    and of the settings those that are stated or are not as by default.

    Attributes
    ----------
    settings
        Method, gyros, interval and confidence.
    stated
        Names of those settings that are stated, though they may be as by default.
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
    stated: Iterable[str] = ()
    statement: Statement = field(default_factory=Statement)
    pattern: str = ""

    def __post_init__(self) -> None:
        stated = f"is {quoted(self.pattern)}"
        try:
            groups = set(re.compile(self.pattern).groupindex)
        except re.error as error:
            raise refusal("pattern", f"{stated}; give a regular expression ({error})") from None
        if self.pattern and (not groups or groups - set(FACTORS)):
            among = ", ".join(FACTORS)
            raise refusal("pattern", f"{stated}; give it groups such as (?P<unit>…), of {among}")

    def task(self, path: Path, labels: Mapping[str, str]) -> Task:
        """The task of a file; labels that are not stated are those of its path."""
        match = re.search(self.pattern, path.as_posix()) if self.pattern else None
        in_path = {} if match is None else match.groupdict()
        where, own = str(path.absolute()), {name: one for name, one in in_path.items() if one}
        known = {**own, **labels}
        return Task(path=where, settings=self.settings, statement=self.statement, labels=known)


def tasks_of(sources: Sequence[Path], choices: Choices) -> tuple[Task, ...]:
    """The tasks of a campaign, in the order of its sources.

    Parameters
    ----------
    sources
        One TOML of a campaign, or recordings and folders of recordings.
    choices
        What holds for all of them.

    Raises
    ------
    RecordingError
        If no source exists, a folder holds no recording, or the TOML is wrong.
    """
    if len(sources) == 1 and sources[0].suffix.lower() == ".toml":
        return _of_toml(sources[0], choices)
    # Nothing but rows that say so would take the place of an earlier table.
    if not any(source.exists() for source in sources):
        raise RecordingError("no such file", path=str(sources[0]), remedy="check the path")
    files = [file for source in sources for file in _files_of(source)]
    return tuple(choices.task(file, {}) for file in dict.fromkeys(files))


def _files_of(source: Path) -> list[Path]:
    if not source.is_dir():
        # A file that does not exist is a row that says so.
        return [source]
    inside = sorted(source.rglob("*"))
    files = [one for one in inside if one.suffix.lower() in _SUFFIXES and one.is_file()]
    # The table of an earlier campaign or report in there is no recording, and so of no unit.
    results = set[Path]().union(*map(results_in, {one.parent for one in files}))
    files = [one for one in files if one not in results]
    if not files:
        remedy = f"name files that end in one of {', '.join(sorted(_SUFFIXES))}"
        raise RecordingError("holds no recording", path=str(source), remedy=remedy)
    return files


def _of_toml(path: Path, choices: Choices) -> tuple[Task, ...]:
    """A task for each file, method, and gyro or pair."""
    try:
        content = _left_open(read_toml(path, table(_CAMPAIGN)), choices)
        common = _common(content, path.parent, choices)
        patterns = [{"file": pattern} for pattern in _texts(content, "files")]
        tasks = [
            common.task(file, {name: _label(one[name]) for name in FACTORS if name in one})
            for one in (*patterns, *content.get("recording", []))
            for file in _matching(path.parent, one["file"])
        ]
        if not tasks:
            raise ValueError("names no recording; give files = […] or [[recording]] with a file")
        own, methods = common.settings, _texts(content, "methods")
        pairs = [tuple(map(str.strip, pair.split(","))) for pair in _texts(content, "gyros")]
        choices_made = product(methods or [own.method], pairs or [own.gyros])
        all_settings = [replace(own, method=one, gyros=gyros) for one, gyros in choices_made]
        return tuple(replace(task, settings=one) for task in tasks for one in all_settings)
    except OSError as error:
        problem = f"cannot be read ({error.strerror})"
        raise RecordingError(problem, path=str(path), remedy="check the path") from None
    except RecordingError as error:
        raise error.at(str(path)) from None
    except (ValueError, TypeError) as error:
        raise RecordingError(str(error), path=str(path), remedy=_REMEDY) from None


def _left_open(content: Mapping[str, Any], choices: Choices) -> dict[str, Any]:
    """A TOML without the keys that the command or call states."""
    own, usual = choices.settings, Settings()
    stated = {*choices.stated, *(["pattern"] if choices.pattern else [])}
    stated |= {one for one in _KEYS if getattr(own, one, None) != getattr(usual, one, None)}
    return {key: content[key] for key in content.keys() - {_KEYS.get(one) for one in stated}}


def _common(content: Mapping[str, Any], folder: Path, choices: Choices) -> Choices:
    """The choices with what a TOML states; limits in a TOML are looked for beside it."""
    own, risk = choices.settings, content.get("risk")
    specification, confidence = own.specification, own.confidence
    if specification is not None and not content.keys().isdisjoint({"spec", "risk"}):
        raise ValueError("states a limit, and so does the command or call; leave one of them out")
    if "spec" in content:
        text = content["spec"]
        if text.strip().endswith(".toml"):
            text = str(folder / text.strip())
        specification = specification_of(text, risk=risk)
        if specification.risk is not None:
            confidence = 1.0 - specification.risk
    elif risk is not None:
        raise refusal("risk", "is stated without spec; state the limit that it is of")
    interval = content.get("interval_s", own.interval)
    confidence = content.get("confidence", confidence)
    settings = replace(own, interval=interval, confidence=confidence, specification=specification)
    stated, pattern = choices.statement, content.get("pattern", choices.pattern)
    if "statement" in content:
        typed = {name: value for name, value in asdict(stated).items() if value}
        stated = replace(from_mapping(content["statement"]), **typed)
    return Choices(settings=settings, statement=stated, pattern=pattern)


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
    files = sorted(folder.glob(pattern))
    if not files:
        raise ValueError(f"{pattern!r} matches no file")
    return files


# ---- rows --------------------------------------------------------------------------

State = Literal["done", "failed", "lost"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """A task, and what it gave.

    Attributes
    ----------
    task
        What was to do.
    state
        ``done``; ``failed``: the recording cannot be analyzed, which the next start does not try
        again; ``lost``: the worker died or ran out of something, which it does.
    reason
        Why it is not done, one line.
    report
        Folder of its report, relative to that of the campaign.
    analysis
        Its ``analysis.json``; empty unless it is done.
    """

    task: Task
    state: State
    reason: str = ""
    report: str = ""
    analysis: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        require_choice("state", self.state, State)
        if (self.state == "done") == bool(self.reason):
            raise refusal("state", f"is {self.state!r} with the reason {self.reason!r}")


def result_path(folder: Path, key: str) -> Path:
    """Where the result of a key lies: its state, the reason, and where its report is."""
    return folder / "results" / f"{key}.json"


def read_row(folder: Path, task: Task) -> Row | None:
    """The row of a task that a folder holds with its report; None if it has to be made."""
    try:
        content = json.loads(result_path(folder, task.key).read_text(encoding="utf-8"))
        if content["schema"] != SCHEMA or content["key"] != task.key:
            return None
        row = Row(task=task, **{name: content[name] for name in ("state", "reason", "report")})
        if not row.report:
            return row
        report = folder / row.report
        analysis = json.loads((report / "analysis.json").read_text(encoding="utf-8"))
        return replace(row, analysis=analysis) if (report / "report.html").is_file() else None
    except (OSError, ValueError, TypeError, KeyError):
        return None


def span_tasks(row: Row, span: float) -> tuple[Task, ...]:
    """Tasks of equal spans of a recording, as many as fit.

    Parameters
    ----------
    row
        Of the whole recording, which says how long it is.
    span
        Length of each, s, above zero.

    Returns
    -------
    tuple of Task
        None if the recording could not be analyzed, or is shorter than two spans.

    Raises
    ------
    ValueError
        If a span would hold fewer samples than are analyzed.
    """
    own = row.task.statement
    first = (own.span or (0.0, None))[0] or 0.0
    count = math.floor(row.analysis.get("input", {}).get("duration_s", 0.0) / span * (1.0 + 1e-9))
    if count < 2:
        return ()
    if span * row.analysis["input"].get("sample_rate_hz", math.inf) < MINIMUM_SAMPLES:
        problem = f"spans of {span:g} s hold less than {MINIMUM_SAMPLES} samples of {row.task.path}"
        raise ValueError(f"{problem}; give a longer time")
    spans = [(first + number * span, first + (number + 1) * span) for number in range(count)]
    return tuple(replace(row.task, span=one, statement=replace(own, span=one)) for one in spans)


# ---- measure -----------------------------------------------------------------------


def measure(task: Task, folder: Path) -> Row:
    """Analyze a recording, write its report, and then its result.

    Nothing is raised for what is wrong with the recording: that is a row, too. What is wrong with
    the machine, such as memory or disk that ran out, is a row that is not kept.

    Parameters
    ----------
    task
        What to do.
    folder
        Of the campaign, as this process sees it.
    """
    try:
        row = _measured(task, folder)
    except RecordingError as error:
        row = Row(task=task, state="failed", reason=error_text(error))
    except MissingExtra as error:
        return lost(task, str(error))
    except MemoryError:
        return lost(task, "memory ran out; allow fewer workers")
    except OSError as error:
        return lost(task, f"{error.filename or task.path}: {error.strerror or error}")
    except Exception as error:
        return lost(task, f"{task.path}: internal error: {type(error).__name__}: {error}")
    stated = {"state": row.state, "reason": row.reason, "report": row.report}
    content = {"schema": SCHEMA, "version": __version__, "key": task.key, **stated}
    path = result_path(folder, task.key)
    made(path.parent)
    write_text(path, json.dumps(content, ensure_ascii=False, indent=1))
    return row


def lost(task: Task, reason: str) -> Row:
    """The row of a task that the next start tries again."""
    return Row(task=task, state="lost", reason=" ".join(reason.split()))


def _measured(task: Task, folder: Path) -> Row:
    recording = read(task.path, task.statement)
    origin = recording.provenance
    if origin is not None and task.sha256 not in ("", origin.sha256):
        problem = "is not the file that the campaign was planned with"
        remedy = "let all workers see the same files, and start the campaign again"
        raise RecordingError(problem, path=task.path, remedy=remedy)
    analysis = analyze(recording, task.settings)
    document = analysis_document(analysis)
    # A page links to it, and a name that is none in the system's encoding has no link.
    name = Path(task.path).stem.encode(errors="backslashreplace").decode()
    report = Path("reports", f"{name}-{task.key[:12]}")
    made(folder / report)
    # A table of results needs no plots, which are slow to load: only who measures draws.
    import_module("sagnac.report.page").write_page(analysis, folder / report / "report.html")
    write_text(folder / report / "analysis.json", to_json(document) + "\n")
    return Row(task=task, state="done", report=report.as_posix(), analysis=document)
