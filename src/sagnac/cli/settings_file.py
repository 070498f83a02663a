"""The options of a run as a TOML that repeats it, and the files that it reads."""

import json
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import fields, replace
from pathlib import Path
from typing import Any, Final

from sagnac.cli.errors import UsageError
from sagnac.cli.options import NO_OPTIONS, Options, Reading, span

# What belongs to one run alone.
_LEFT_OUT: Final = ("debug", "as_json", "settings", "memory")
_NAMES: Final = tuple(field.name for field in fields(Options) if field.name not in _LEFT_OUT)


def settings_text(options: Options) -> str:
    """Options that were typed, as TOML; empty if none was."""
    stated = {name: getattr(options, name) for name in _NAMES}
    typed = {name: value for name, value in stated.items() if value != getattr(NO_OPTIONS, name)}
    return "".join(f"{name} = {_written(name, value)}\n" for name, value in typed.items())


def _written(name: str, value: Any) -> str:
    if name == "slice":
        return json.dumps(":".join("" if end is None else f"{end:.17g}" for end in value))
    if isinstance(value, Mapping):
        inside = (f"{json.dumps(key)} = {json.dumps(item)}" for key, item in value.items())
        return "{" + ", ".join(inside) + "}"
    return json.dumps(list(value) if isinstance(value, tuple) else value, ensure_ascii=False)


def with_settings(options: Options) -> Options:
    """The options with those of their settings file where nothing was typed.

    Raises
    ------
    UsageError
        If the file is no TOML, or has a key that is no option.
    OSError
        If it cannot be read.
    """
    path = options.settings
    if path is None:
        return options
    try:
        stated = tomllib.loads(path.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise UsageError(f"--settings {path} is no TOML: {error}") from None
    found = {}
    for name, value in stated.items():
        if name not in _NAMES:
            raise UsageError(f"--settings {path}: {name!r} is no option; use {', '.join(_NAMES)}")
        if getattr(options, name) == getattr(NO_OPTIONS, name):
            found[name] = _read(name, value)
    return replace(options, **found)


def _read(name: str, value: Any) -> Any:
    if name == "slice":
        try:
            return span(str(value))
        except ValueError as error:
            raise UsageError(f"--settings: slice is {error}") from None
    return tuple(value) if isinstance(value, list) else value


def inputs(files: Iterable[Path], options: Reading, *more: Path | None) -> list[Path]:
    """Files that a run reads: recordings, the TOML beside each, and what its options name."""
    stated = [getattr(options, name, None) for name in ("settings", "spec", "layout")]
    named = [Path(one) for one in (*stated, *more) if one is not None]
    beside = [
        place
        for file in files
        for place in (file, file.with_name(f"{file.name}.toml"), file.with_suffix(".toml"))
    ]
    return [*beside, *named]
