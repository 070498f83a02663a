"""Documents against their schema: the TOML of a user, and JSON that this package wrote."""

import json
import math
import tomllib
from collections.abc import Callable, Iterable, Mapping
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any, Final, Protocol, runtime_checkable

import fastjsonschema

from sagnac.core.errors import RecordingError, quoted, require_type

ANALYSIS: Final = "sagnac.analysis/1"
ANALYSES: Final = "sagnac.analyses/1"
Schema = Mapping[str, Any]

# Values of a key of a TOML: JSON schema, with what to do about a wrong one for description.
ANY: Final[Schema] = {}
NUMBER: Final[Schema] = {"type": "number", "description": "give a number"}
TEXT: Final[Schema] = {"type": "string", "description": "give text"}
TEXTS: Final[Schema] = {
    "anyOf": [{"type": "string"}, {"type": "array", "items": {"type": "string"}}],
    "description": "give text, or a list of it",
}
AS_WRITTEN: Final = "give the analysis.json that an analysis wrote, as it wrote it"


def table(keys: Mapping[str, Schema], needed: Iterable[str] = ()) -> Schema:
    """Schema of a table of a TOML that has these keys and no others; some may be `needed`."""
    return {
        "type": "object",
        "properties": dict(keys),
        "additionalProperties": False,
        "required": list(needed),
        "description": "give a table",
    }


def listed(items: Schema | list[Schema], description: str) -> Schema:
    """Schema of a list, of items that are alike or each of its own."""
    return {"type": "array", "items": items, "description": description}


def one_of(choices: Iterable[str]) -> Schema:
    """Schema of a text that is one of a few."""
    known = list(choices)
    return {"enum": known, "description": f"use one of {', '.join(known)}"}


def read_toml(path: Path, schema: Schema = ANY) -> dict[str, Any]:
    """Content of a TOML that keeps its schema.

    Raises
    ------
    ValueError
        If it is no TOML or breaks the schema: which key, what is wrong, and what to do. The message
        does not name the file.
    OSError
        If it cannot be read.
    """
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise ValueError(f"is no TOML: {_reason(error)}") from None
    keep(schema, content)
    return content


def keep(schema: Schema, content: Any) -> None:
    """Hold the content of a table against its schema.

    Raises
    ------
    ValueError
        If it breaks it: which key, what is wrong, and what to do.

    Examples
    --------
    >>> keep(table({"risk": NUMBER}), {"risk": "low"})
    Traceback (most recent call last):
        ...
    ValueError: risk is 'low'; give a number
    """
    try:
        fastjsonschema.compile(dict(schema), use_default=False)(content)
    except fastjsonschema.JsonSchemaValueException as error:
        rule, value = error.definition, error.value
        known = rule.get("properties", {})
        # A key that is misspelt is better named than missed.
        unknown = sorted(set(value) - set(known)) if known and isinstance(value, dict) else []
        if unknown:
            problem = f"{unknown[0]!r} is not known; use {', '.join(known)}"
        elif error.rule == "required":
            lacking = next(key for key in rule["required"] if key not in value)
            problem = f"{lacking} is not stated; {known[lacking]['description']}"
        else:
            problem = f"{'.'.join(error.path[1:])} is {quoted(value)}; {rule['description']}"
        raise ValueError(problem) from None


def finite(value: Any) -> Any:
    """The same tree with None for every NaN and infinity (JSON has neither)."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {key: finite(item) for key, item in value.items()}
    return [finite(item) for item in value] if isinstance(value, list) else value


@runtime_checkable
class Documented(Protocol):
    """Anything with a document of schema ``sagnac.analysis/1``: an analysis."""

    def to_json(self) -> str:
        """The document."""


def require_source(value: object) -> None:
    """Refuse what is neither an analysis nor the path of one.

    Raises
    ------
    TypeError
        With what makes one.
    """
    remedy = "give what analyze(recording) returns, or the path of its analysis.json"
    require_type("source", value, (Documented, str, Path), remedy)


def read_analyses(source: Path | str) -> tuple[Mapping[str, Any], ...]:
    """The analyses in an ``analysis.json``, in a document of several, or in a folder of such files.

    Parameters
    ----------
    source
        A path, or the text of a document.

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
    if isinstance(source, Path) and source.is_dir():
        return tuple(one for file in documents_of(source) for one in read_analyses(file))
    path = source if isinstance(source, Path) else Path("text")
    content = _json(path, None if isinstance(source, Path) else source)
    schema = content.get("schema") if isinstance(content, dict) else None
    if schema == ANALYSES:
        several = content.get("analyses")
        if not isinstance(several, list) or not several:
            raise RecordingError("holds no analyses", path=str(path), remedy=AS_WRITTEN)
        if "accelerometers" in content and isinstance(several[0], dict):
            several = [{**several[0], "accelerometers": content["accelerometers"]}, *several[1:]]
    elif schema == ANALYSIS:
        several = [content]
    else:
        problem = f"is no document of schema {ANALYSIS}"
        raise RecordingError(problem, path=str(path), remedy=AS_WRITTEN)
    for one in several:
        try:
            check_analysis(one)
        except ValueError as error:
            problem = f"breaks its schema {ANALYSIS}: {error}"
            raise RecordingError(problem, path=str(path), remedy=AS_WRITTEN) from None
    return tuple(several)


def read_one_analysis(source: Path | str) -> Mapping[str, Any]:
    """The document of a source that holds one analysis alone: see `read_analyses`.

    Raises
    ------
    RecordingError
        As `read_analyses`, or if there are several.
    """
    documents = read_analyses(source)
    if len(documents) > 1:
        where = str(source) if isinstance(source, Path) else "text"
        problem = f"holds {len(documents)} analyses"
        raise RecordingError(problem, path=where, remedy="give the analysis.json of one recording")
    return documents[0]


def documents_of(path: Path) -> tuple[Path, ...]:
    """A file itself; of a folder its ``analysis.json``, else those of its gyros or recordings.

    Raises
    ------
    RecordingError
        If a folder holds none.
    """
    if not path.is_dir():
        return (path,)
    # Reports of recordings that are no longer of a campaign lie in its folder, too.
    table = "".join(one.read_text(encoding="utf-8") for one in path.glob("campaign.csv"))
    for pattern in ("analysis.json", "*/analysis.json", "reports/*/analysis.json"):
        found = sorted(path.glob(pattern))
        if table and pattern.startswith("reports"):
            found = [one for one in found if one.parent.name in table]
        if found:
            return tuple(found)
    remedy = "give the folder that an analysis wrote, or that of a campaign"
    raise RecordingError("holds no analysis.json", path=str(path), remedy=remedy)


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
        fact = error.message.removeprefix("data.").split(" definition", 1)[0]
        if error.rule == "anyOf":
            fact = f"{'.'.join(error.path[1:])} is {quoted(error.value)}, which it does not allow"
        raise ValueError(fact) from None


def _json(path: Path, text: str | None) -> Any:
    try:
        text = path.read_text(encoding="utf-8") if text is None else text
        return json.loads(text, parse_constant=_refused)
    except OSError as error:
        problem = f"cannot be read ({error.strerror})"
        raise RecordingError(problem, path=str(path), remedy="check the path") from None
    except (ValueError, RecursionError) as error:
        problem = f"is no JSON: {_reason(error)}"
        raise RecordingError(problem, path=str(path), remedy=AS_WRITTEN) from None


def _reason(error: Exception) -> str:
    """Why a text cannot be parsed, in one line; in words of our own if Python's are not plain."""
    if isinstance(error, UnicodeDecodeError):
        return f"byte {error.start + 1} is none of UTF-8"
    if isinstance(error, RecursionError):
        return "it is nested too deep"
    return " ".join(str(error).split())


def _refused(name: str) -> float:
    raise ValueError(f"{name} is no number of JSON")


@cache
def _validator() -> Callable[[object], object]:
    schema = json.loads(files("sagnac").joinpath("analysis-1.schema.json").read_text("utf-8"))
    compiled: Callable[[object], object] = fastjsonschema.compile(schema, use_default=False)
    return compiled
