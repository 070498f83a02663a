"""Documents in JSON that this package writes and reads again, checked against their schema."""

import json
from collections.abc import Callable, Mapping
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any, Final, Protocol

import fastjsonschema

from sagnac.errors import RecordingError

ANALYSIS: Final = "sagnac.analysis/1"
ANALYSES: Final = "sagnac.analyses/1"
_REMEDY: Final = "give the analysis.json that an analysis wrote, as it wrote it"


class Documented(Protocol):
    """Anything with a document of schema ``sagnac.analysis/1``: an analysis."""

    def to_json(self) -> str:
        """The document."""
        ...


def read_analyses(path: Path) -> tuple[Mapping[str, Any], ...]:
    """The analyses in an ``analysis.json``, in a document of several, or in a folder of such files.

    Returns
    -------
    tuple of Mapping
        Each of schema ``sagnac.analysis/1`` (``analysis-1.schema.json`` of this package). The
        accelerometers that stand beside several go with the first.

    Raises
    ------
    RecordingError
        If the file cannot be read, is no JSON, or breaks the schema: where, and what is expected.
    """
    if path.is_dir():
        return tuple(one for file in documents_of(path) for one in read_analyses(file))
    content = _json(path)
    schema = content.get("schema") if isinstance(content, dict) else None
    if schema == ANALYSES:
        several = content.get("analyses")
        if not isinstance(several, list) or not several:
            raise RecordingError("holds no analyses", path=str(path), remedy=_REMEDY)
        beside = {key: content[key] for key in ("accelerometers",) if key in content}
        if beside and isinstance(several[0], dict):
            several = [{**several[0], **beside}, *several[1:]]
        return tuple(_checked(one, path) for one in several)
    if schema != ANALYSIS:
        raise RecordingError(f"is no document of schema {ANALYSIS}", path=str(path), remedy=_REMEDY)
    return (_checked(content, path),)


def documents_of(path: Path) -> tuple[Path, ...]:
    """A file itself; of a folder its ``analysis.json``, else those of its gyros or recordings.

    Raises
    ------
    RecordingError
        If a folder holds none.
    """
    if not path.is_dir():
        return (path,)
    for pattern in ("analysis.json", "*/analysis.json", "reports/*/analysis.json"):
        found = tuple(sorted(path.glob(pattern)))
        if found:
            return found
    raise RecordingError(
        "holds no analysis.json",
        path=str(path),
        remedy="give the folder that an analysis wrote, or that of a campaign",
    )


def check_analysis(document: object) -> None:
    """Hold a document against the schema ``sagnac.analysis/1``.

    Raises
    ------
    ValueError
        If it breaks it: where, and what is expected.
    """
    try:
        _validator()(document)
    except fastjsonschema.JsonSchemaValueException as error:
        said = error.message.removeprefix("data.").split(" definition", 1)[0]
        raise ValueError(said) from None


def _json(path: Path) -> Any:
    try:
        return json.loads(path.read_text(encoding="utf-8"), parse_constant=_refused)
    except OSError as error:
        raise RecordingError(
            f"cannot be read ({error.strerror})", path=str(path), remedy="check the path"
        ) from None
    except (ValueError, RecursionError) as error:
        raise RecordingError(f"is no JSON: {error}", path=str(path), remedy=_REMEDY) from None


def _refused(name: str) -> float:
    raise ValueError(f"{name} is no number of JSON")


def _checked(document: Any, path: Path) -> Mapping[str, Any]:
    try:
        check_analysis(document)
    except ValueError as error:
        raise RecordingError(
            f"breaks its schema {ANALYSIS}: {error}", path=str(path), remedy=_REMEDY
        ) from None
    found: Mapping[str, Any] = document
    return found


@cache
def _validator() -> Callable[[object], object]:
    schema = json.loads(files("sagnac").joinpath("analysis-1.schema.json").read_text("utf-8"))
    compiled: Callable[[object], object] = fastjsonschema.compile(schema, use_default=False)
    return compiled
