"""One recording with the settings it is analyzed by, and the key that its result is kept under."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Final

from sagnac.analysis.settings import Settings
from sagnac.errors import RecordingError, quoted
from sagnac.formats.statement import Statement
from sagnac.version import __version__

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
    for candidate in (path.with_name(path.name + ".toml"), path.with_suffix(".toml")):
        if candidate.is_file():
            return hashlib.sha256(candidate.read_bytes()).hexdigest()
    return ""
