"""From files, folders or a TOML to the tasks of a campaign: a recording and its settings each."""

import hashlib
import json
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, Final

from sagnac.analysis.settings import Settings
from sagnac.documents import ANY, NUMBER, TEXT, TEXTS, read_toml, table
from sagnac.errors import RecordingError, quoted
from sagnac.formats.registry import FORMATS
from sagnac.formats.statement import Statement, beside_paths, from_mapping
from sagnac.specification.limits import Specification, specification_of
from sagnac.version import __version__

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

    Raises
    ------
    ValueError
        If a label is not known.
    """

    path: str
    settings: Settings = field(default_factory=Settings)
    statement: Statement = field(default_factory=Statement)
    labels: Mapping[str, str] = field(default_factory=dict)
    sha256: str = ""

    def __post_init__(self) -> None:
        for name in self.labels:
            if name not in LABELS:
                raise ValueError(f"labels: {quoted(name)} is no label; use {', '.join(LABELS)}")

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

    @property
    def gyros(self) -> str:
        """Gyros as they are typed: ``x,z``; ``all`` if none is named."""
        return ",".join(self.settings.gyros) or "all"


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
        try:
            groups = set(re.compile(self.pattern).groupindex)
        except re.error as error:
            raise ValueError(f"pattern is {quoted(self.pattern)}; {error}") from None
        if self.pattern and (not groups or groups - set(LABELS)):
            raise ValueError(
                f"pattern is {quoted(self.pattern)}; give it groups such as (?P<unit>…), of "
                f"{', '.join(LABELS)}"
            )

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
    if source.is_dir():
        files = sorted(
            path
            for path in source.rglob("*")
            if path.suffix.lower() in _SUFFIXES and path.is_file()
        )
        if not files:
            raise RecordingError(
                "holds no recording",
                path=str(source),
                remedy=f"name files that end in one of {', '.join(sorted(_SUFFIXES))}",
            )
        return files
    # A file that does not exist is a row that says so, unless there is no other.
    return [source]


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
