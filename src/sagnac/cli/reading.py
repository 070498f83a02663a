"""Reading a file for a command, and the options of a run as a TOML that repeats it."""

import shlex
import time
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any, Final

import sagnac
from sagnac.cli.options import NO_OPTIONS, Options, Reading
from sagnac.cli.output import Progress, UsageError
from sagnac.texts import OPTION_OF, text_of, toml_table, value_of

# ---- reading -----------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class ReadFile:
    """A recording, and how long it took to read, s by stage."""

    recording: "sagnac.Recording"
    seconds: dict[str, float]


def read_file(
    file: Path,
    statement: "sagnac.Statement",
    progress: Progress,
    *,
    verify: bool = True,
    memory: int | None = None,
) -> ReadFile:
    """The recording in a file, which may declare no more than `memory` bytes.

    Raises
    ------
    RecordingError
        If the file cannot be read or, with `verify`, is not sound.
    """
    from sagnac.formats.files import USUAL, limited

    began = time.perf_counter()
    progress("read", 0.0)
    with limited(memory or USUAL):
        recording = sagnac.read(file, statement, verify=verify)
    progress("read", 1.0)
    return ReadFile(recording=recording, seconds={"read": time.perf_counter() - began})


def command_for(
    file: Path, statement: "sagnac.Statement", lacking: Mapping[str, str] | None = None
) -> str:
    """The command that would read a file, with what is stated and, as options, what is missing."""
    lacking = lacking or {}
    options = {**stated_options(statement), **lacking}
    if "columns" in lacking:
        # They name the gyros, too.
        options.pop("gyros", None)
    return _command(file, options)


def command_with_accelerometers(file: Path, statement: "sagnac.Statement") -> str | None:
    """The command that reads the accelerometers of a file, too; None if that needs no option more.

    Parameters
    ----------
    file, statement
        A file that can be read, and what is stated of it.

    Raises
    ------
    RecordingError
        If the file cannot be opened.
    """
    from sagnac.formats import accelerometers_in

    besides = accelerometers_in(file, statement)
    if not besides:
        return None
    options = stated_options(statement)
    for name, value in besides.items():
        before = options.get(name)
        if name == "unit" and before is not None and "=" not in before:
            # One unit for all gyros cannot stand beside one for the accelerometers.
            before = f"gyros={before}"
        options[name] = value if before is None else f"{before},{value}"
    return _command(file, options)


def _command(file: Path, options: Mapping[str, str]) -> str:
    table = options.get("table", "none")
    words = ["sagnac", "avar" if table == "none" else "analyze", shlex.quote(str(file))]
    for name, value in options.items():
        words += [f"--{name}", shlex.quote(value)]
    return " ".join(words)


def stated_options(statement: "sagnac.Statement") -> dict[str, str]:
    """Statements of a caller as options: name -> value."""
    # The channels first, then what they are.
    inputs = dict.fromkeys(("gyros", "accelerometers", "columns"))
    inputs |= {field.name: None for field in fields(statement)}
    stated = {name: getattr(statement, name) for name in inputs}
    return {
        OPTION_OF.get(name, name).replace("_", "-"): text_of(value)
        for name, value in stated.items()
        if value is not None and value != {}
    }


@contextmanager
def naming(file: Path, recording: "sagnac.Recording") -> Iterator[None]:
    """Put the file into a data error of a stage that knows nothing of files.

    What a fit or a factorization cannot do with numbers is a fault of the data, too; the error says
    which numbers they are.
    """
    try:
        yield
    except (sagnac.RecordingError, sagnac.MissingExtra) as error:
        raise error.at(str(file)) from error
    except (ValueError, ArithmeticError) as error:
        # numpy's LinAlgError is a ValueError.
        raise sagnac.RecordingError(
            f"the analysis fails ({error}) on {_numbers(recording)}",
            path=str(file),
            remedy="look at the data with sagnac check",
        ) from error


def _numbers(recording: "sagnac.Recording") -> str:
    """The samples of each channel in one line: how many, and between which values they lie."""
    said = []
    for channel in (*recording.gyros, *recording.accelerometers):
        unit, values = channel.plain_unit, channel.values
        ends = f"{values.min() / unit.size:.4g} to {values.max() / unit.size:.4g}"
        said.append(f"{channel.name}: {values.size} samples from {ends} {unit.name}")
    return ", ".join(said)


# ---- settings file -----------------------------------------------------------------

# What belongs to one run alone.
_LEFT_OUT: Final = ("debug", "as_json", "settings", "memory")
_NAMES: Final = tuple(field.name for field in fields(Options) if field.name not in _LEFT_OUT)


def settings_text(options: Options) -> str:
    """Options that were typed, as TOML; empty if none was."""
    stated = {name: getattr(options, name) for name in _NAMES}
    typed = {name: value for name, value in stated.items() if value != getattr(NO_OPTIONS, name)}
    if typed.get("slice"):
        typed["slice"] = text_of(typed["slice"])
    return toml_table(typed)


def with_settings(options: Options) -> Options:
    """The options with those of their settings file where nothing was typed.

    Raises
    ------
    UsageError
        If the file is no TOML, or has a key that is no option.
    OSError
        If it cannot be read.
    """
    from sagnac.documents import ANY, read_toml, table

    path = options.settings
    if path is None:
        return options
    try:
        stated = read_toml(path, table(dict.fromkeys(_NAMES, ANY)))
    except ValueError as error:
        raise UsageError(f"--settings {path}: {error}") from None
    found = {
        name: _read(name, value)
        for name, value in stated.items()
        if getattr(options, name) == getattr(NO_OPTIONS, name)
    }
    return replace(options, **found)


def _read(name: str, value: Any) -> Any:
    if isinstance(value, str):
        try:
            return value_of(name, value)
        except ValueError as error:
            raise UsageError(f"--settings: {error}") from None
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
