"""Statements in text: a TOML beside the file, attributes within it; which files go with which."""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from sagnac.errors import Note, RecordingError
from sagnac.formats.registry import CSV
from sagnac.formats.statement import Statement, vocabulary
from sagnac.overwriting import Outputs


@dataclass(frozen=True, slots=True, kw_only=True)
class Beside:
    """The statement beside a file, empty where there is none, and what was noticed of it."""

    statement: Statement = field(default_factory=Statement)
    notes: tuple[Note, ...] = ()


def beside(path: Path) -> Beside:
    """The statement in ``FILE.toml`` (``run.csv.toml``, else ``run.toml``).

    ``run.toml`` may be something else altogether, for example the simulation that made the file:
    it counts only if all its keys are those of a statement, and a note says so if not.

    Raises
    ------
    RecordingError
        If the TOML cannot be read or states what cannot be; its path is that of the TOML.
    """
    for candidate in (path.with_name(path.name + ".toml"), path.with_suffix(".toml")):
        if candidate == path or not candidate.is_file():
            continue
        content = _toml(candidate)
        unknown = sorted(set(content) - vocabulary())
        if unknown and candidate.name != path.name + ".toml":
            text = f"{candidate.name} is not about this file ({unknown[0]}): ignored"
            return Beside(notes=(Note(text=text),))
        try:
            return Beside(statement=from_mapping(content))
        except RecordingError as error:
            raise error.at(str(candidate)) from None
    return Beside()


def require_no_other(path: Path) -> None:
    """Refuse to write a recording that states all itself beside a TOML that would be heard first.

    Raises
    ------
    RecordingError
        If there is one.
    """
    if beside(path).statement != Statement():
        raise RecordingError(
            "a TOML beside it states how a file of this name is to be read, and would be believed",
            path=str(path),
            remedy="remove the TOML, or choose another output",
        )


def _toml(path: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        why = " ".join(str(error).split())
        raise RecordingError(
            f"not TOML: {why}", path=str(path), remedy="correct or remove it"
        ) from None


def from_mapping(content: Mapping[str, Any]) -> Statement:
    """A statement from TOML keys or file attributes.

    Attributes are flat: ``x,z`` stands for a list and ``x=arcsec,table=deg`` for a mapping.

    Raises
    ------
    RecordingError
        If a key is not of the vocabulary or a value cannot be.
    """
    unknown = sorted(set(content) - vocabulary())
    if unknown:
        known = ", ".join(sorted(vocabulary()))
        raise RecordingError(f"{unknown[0]!r} is not known", remedy=f"use {known}")
    try:
        return Statement(**{key: _value(key, value) for key, value in content.items()})
    except (TypeError, ValueError) as error:
        why = " ".join(str(error).split())
        raise RecordingError(why, remedy="correct it there or state the option") from None


def _value(key: str, stated: Any) -> Any:
    """The value of a field of `Statement` from what stands in a TOML or an attribute."""
    if key in ("kind", "unit", "columns") and isinstance(stated, str) and "=" in stated:
        return dict(_pair(item) for item in stated.split(","))
    named = key in ("gyros", "accelerometers")
    if named and not isinstance(stated, str | list | tuple):
        raise ValueError(f"{key} is {stated!r}; give names")
    if named:
        return tuple(
            [name.strip() for name in stated.split(",")] if isinstance(stated, str) else stated
        )
    if key in ("sample_rate", "counter_period") and isinstance(stated, str):
        return float(stated)
    if key == "counter_bits" and isinstance(stated, str):
        return int(stated)
    if key == "counter_bits" and isinstance(stated, float) and stated.is_integer():
        return int(stated)
    return stated


def _pair(item: str) -> tuple[str, str]:
    name, equals, value = item.partition("=")
    if not equals:
        raise ValueError(f"{item.strip()!r} is not NAME=VALUE")
    return name.strip(), value.strip()


def of_simulation(path: Path) -> Outputs:
    """A simulated recording, its truth, and the TOML that a text needs."""
    truth = path.with_name(path.name + ".truth.json")
    return Outputs(paths=(path, truth, *_toml_of(path)), mark=truth, kind="truth")


def of_conversion(path: Path) -> Outputs:
    """A recording in another format, and the TOML that a text needs."""
    truth, beside = path.with_name(path.name + ".truth.json"), _toml_of(path)
    # One that a simulation made has its truth beside it, which would be of another recording.
    mark = truth if truth.exists() else (*beside, path)[0]
    return Outputs(paths=(path, *beside), mark=mark, kind="recording")


def _toml_of(path: Path) -> tuple[Path, ...]:
    """The TOML that says of a text what its columns are."""
    is_text = path.suffix.lower() in CSV.suffixes
    return (path.with_name(path.name + ".toml"),) if is_text else ()
