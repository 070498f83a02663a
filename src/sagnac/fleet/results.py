"""Result of one task, and its file: the one thing that a campaign resumes from."""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Final, Literal, get_args

from sagnac.fleet.tasks import SCHEMA, Task
from sagnac.formats.files import replacing
from sagnac.version import __version__

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
