"""From files, folders or a TOML to the tasks of a campaign."""

import re
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final

from sagnac.analysis.settings import Settings
from sagnac.errors import RecordingError, quoted
from sagnac.fleet.tasks import LABELS, Task
from sagnac.formats.metadata import from_mapping
from sagnac.formats.registry import FORMATS
from sagnac.formats.statement import Statement
from sagnac.specification.limits import Specification, specification_of

_SUFFIXES: Final = frozenset(suffix for one in FORMATS for suffix in one.suffixes)
_KEYS: Final = frozenset(
    {
        "files",
        "methods",
        "gyros",
        "interval_s",
        "confidence",
        "pattern",
        "spec",
        "risk",
        "statement",
        "recording",
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
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise RecordingError(
            f"cannot be read ({error.strerror})", path=str(path), remedy="check the path"
        ) from None
    except ValueError as error:
        raise RecordingError(f"not TOML: {error}", path=str(path), remedy="correct it") from None
    try:
        return _planned(content, path.parent, choices)
    except RecordingError as error:
        raise error.at(str(path)) from None
    except (ValueError, TypeError) as error:
        raise RecordingError(str(error), path=str(path), remedy=_REMEDY) from None


def _planned(content: Mapping[str, Any], folder: Path, choices: Choices) -> tuple[Task, ...]:
    unknown = sorted(set(content) - _KEYS)
    if unknown:
        raise ValueError(f"{unknown[0]!r} is no key of a campaign; use {', '.join(sorted(_KEYS))}")
    common = _common(content, folder, choices)
    listed: list[tuple[Path, dict[str, str]]] = [
        (file, {}) for pattern in _texts(content, "files") for file in _matching(folder, pattern)
    ]
    for entry in content.get("recording", []):
        labels = {name: _label(entry[name]) for name in LABELS if name in entry}
        if "file" not in entry or set(entry) - {"file", *LABELS}:
            raise ValueError(f"recording {entry!r}; give file, and {', '.join(LABELS)} if known")
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
    if not isinstance(text, str):
        raise ValueError(f'spec is {text!r}; give a limit in quotes, such as "3e-4deg/sqrt(h)"')
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
    values = [value] if isinstance(value, str) else list(value)
    if not all(isinstance(one, str) for one in values):
        raise ValueError(f"{name} is {quoted(value)}; give text, or a list of it")
    return values


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
