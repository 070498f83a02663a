"""Reading a file for a command, and naming it in what goes wrong afterwards."""

import shlex
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sagnac.cli.progress import Progress

if TYPE_CHECKING:
    from sagnac.formats import Statement
    from sagnac.recording.model import Recording


@dataclass(frozen=True, slots=True, kw_only=True)
class ReadFile:
    """A recording, and how long it took to read, s by stage."""

    recording: "Recording"
    seconds: dict[str, float]


def read_file(
    file: Path,
    statement: "Statement",
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
    from sagnac.formats import read
    from sagnac.formats.room import USUAL, limited

    began = time.perf_counter()
    progress("read", 0.0)
    with limited(memory or USUAL):
        recording = read(file, statement, verify=verify)
    progress("read", 1.0)
    return ReadFile(recording=recording, seconds={"read": time.perf_counter() - began})


def command_for(
    file: Path, statement: "Statement", lacking: Mapping[str, str] | None = None
) -> str:
    """The command that would read a file, with what is stated and, as options, what is missing."""
    lacking = lacking or {}
    options = {**stated_options(statement), **lacking}
    if "columns" in lacking:
        # They name the gyros, too.
        options.pop("gyros", None)
    return _command(file, options)


def command_with_accelerometers(file: Path, statement: "Statement") -> str | None:
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


def stated_options(statement: "Statement") -> dict[str, str]:
    """Statements of a caller as options: name -> value."""
    start, stop = statement.span or (None, None)
    values: dict[str, Any] = {
        "gyros": ",".join(statement.gyros) if statement.gyros else None,
        "accelerometers": ",".join(statement.accelerometers) if statement.accelerometers else None,
        "columns": statement.columns or None,
        "kind": statement.kind,
        "unit": statement.unit,
        "scale": statement.scale,
        "rate": None if statement.sample_rate is None else f"{statement.sample_rate:g}",
        "time": statement.time,
        "table": statement.table,
        "slice": f"{start or ''}:{stop or ''}" if statement.span else None,
        "counter-bits": statement.counter_bits,
        "counter-period": (
            None if statement.counter_period is None else f"{statement.counter_period:.12g}"
        ),
        "null-pulse": statement.null_pulse,
        "layout": statement.layout,
    }
    return {name: _listed(value) for name, value in values.items() if value is not None}


def _listed(value: Any) -> str:
    """A value as it is typed: a mapping as ``x=A,z=B``."""
    if isinstance(value, Mapping):
        return ",".join(f"{name}={one}" for name, one in value.items())
    return str(value)


@contextmanager
def naming(file: Path, recording: "Recording") -> Iterator[None]:
    """Put the file into a data error of a stage that knows nothing of files.

    What a fit or a factorization cannot do with numbers is a fault of the data, too; the error says
    which numbers they are.
    """
    from sagnac.errors import RecordingError

    try:
        yield
    except RecordingError as error:
        raise error.at(str(file)) from error
    except (ValueError, ArithmeticError) as error:
        # numpy's LinAlgError is a ValueError.
        raise RecordingError(
            f"the analysis fails ({error}) on {_numbers(recording)}",
            path=str(file),
            remedy="look at the data with sagnac check",
        ) from error


def _numbers(recording: "Recording") -> str:
    """The samples of each channel in one line: how many, and between which values they lie."""
    said = []
    for channel in (*recording.gyros, *recording.accelerometers):
        unit, values = channel.plain_unit, channel.values
        ends = f"{values.min() / unit.size:.4g} to {values.max() / unit.size:.4g}"
        said.append(f"{channel.name}: {values.size} samples from {ends} {unit.name}")
    return ", ".join(said)
