"""What every room hands over: the columns a file has, what it states, how to load them.

Also what rooms share: a library's error made one line, files written beside and renamed.
"""

import os
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sagnac import series
from sagnac.errors import RecordingError
from sagnac.formats.statement import Statement, split_factor, split_header
from sagnac.recording.model import Kind, Recording
from sagnac.units import ANGLE_UNITS, RATE_UNITS, angle_scale, rate_scale


@dataclass(frozen=True, slots=True, kw_only=True)
class Column:
    """A numeric column of a file.

    Attributes
    ----------
    key
        What the room loads it by, and its full name in the file: ``x[arcsec]``.
    name
        Its name without the unit: ``x``.
    unit, kind
        What the file says of this column, or None.
    """

    key: str
    name: str
    unit: str | None = None
    kind: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Stored:
    """Columns that are read when they are asked for.

    Attributes
    ----------
    lengths
        Key -> samples.
    pieces
        Keys, first sample and the one after the last -> pieces that follow one another, each
        with values of one key or more: arrays of one dimension, any numeric type; missing
        samples are NaN. A key is asked for once.
    """

    lengths: Mapping[str, int]
    pieces: Callable[[Sequence[str], int, int], Iterator[dict[str, NDArray[Any]]]]


def in_memory(arrays: dict[str, NDArray[Any]]) -> Stored:
    """Columns of a format that is read whole; each is let go as it is taken over."""

    def pieces(keys: Sequence[str], start: int, stop: int) -> Iterator[dict[str, NDArray[Any]]]:
        for key in keys:
            whole = arrays.pop(key)
            # A view would keep what lies outside the slice.
            yield {key: whole if stop - start == whole.size else whole[start:stop].copy()}

    return Stored(lengths={key: array.size for key, array in arrays.items()}, pieces=pieces)


@dataclass(frozen=True, slots=True, kw_only=True)
class Source:
    """An opened file: what it holds and how to get it.

    Attributes
    ----------
    format
        Name of the format, for provenance and messages.
    columns
        The numeric columns.
    stated
        What the file states for all of them.
    load
        Keys -> their columns.
    notes
        What was noticed on opening.
    """

    format: str
    columns: tuple[Column, ...]
    load: Callable[[Sequence[str]], Stored]
    stated: Statement = field(default_factory=Statement)
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Outgoing:
    """A recording in field units, ready for any room to write.

    Attributes
    ----------
    columns
        Name -> (samples,) values in SI: ``time`` where sampling is not uniform, the gyros,
        ``table``, ``null_pulse`` (bool).
    units
        Name -> unit to write in; ``null_pulse`` has none.
    sizes
        Name -> SI size of that unit.
    kinds
        Gyro name -> kind.
    sample_rate
        Hz.
    """

    columns: Mapping[str, NDArray[Any]]
    units: Mapping[str, str]
    sizes: Mapping[str, float]
    kinds: Mapping[str, Kind]
    sample_rate: float

    @property
    def samples(self) -> int:
        """Number of samples."""
        return next(iter(self.columns.values())).size

    def rows(self, span: slice) -> dict[str, NDArray[Any]]:
        """Name -> values of a span in `units`; the null pulse is 0 or 1."""
        return {
            name: values[span] / self.sizes[name]
            if name in self.sizes
            else values[span].astype(np.uint8)
            for name, values in self.columns.items()
        }

    def spans(self, length: int) -> Iterator[dict[str, NDArray[Any]]]:
        """`rows` of one span of that length after the other, for formats that grow."""
        for span in series.spans(self.samples, length):
            yield self.rows(span)
            series.release(*self.columns.values())

    def statement(self) -> dict[str, str | float]:
        """All of it in flat text, for formats that carry attributes beside the numbers."""
        return {
            "gyros": ",".join(self.kinds),
            "kind": ",".join(f"{name}={kind}" for name, kind in self.kinds.items()),
            "unit": ",".join(f"{name}={unit}" for name, unit in self.units.items()),
            "sample_rate": self.sample_rate,
        }


def column(key: str, *, unit: str | None = None, kind: str | None = None) -> Column:
    """A `Column` from the file's own name for it, ``x`` or ``x[arcsec]``."""
    name, in_header = split_header(key)
    return Column(key=key, name=name, unit=unit or in_header, kind=kind)


def field_unit(kind: Kind, unit: str, *, is_table: bool = False) -> str:
    """Unit to write a channel in: its own where it has a plain one, else the field's."""
    factor, name = split_factor(unit)
    table = RATE_UNITS if kind == "rate" else ANGLE_UNITS
    if factor == 1.0 and name in table:
        return name
    if kind == "rate":
        return "deg/h"
    return "deg" if is_table else "arcsec"


def unit_size(kind: Kind, unit: str) -> float:
    """SI size of one plain `unit` for a channel of `kind`."""
    return rate_scale(unit) if kind == "rate" else angle_scale(unit)


def outgoing(recording: Recording) -> Outgoing:
    """`recording` in the units its channels came in, or the field's.

    Raises
    ------
    ValueError
        If a gyro carries a name that a file needs for something else.
    """
    columns: dict[str, NDArray[Any]] = {}
    units: dict[str, str] = {}
    sizes: dict[str, float] = {}
    if recording.times is not None:
        columns["time"], units["time"], sizes["time"] = recording.times, "s", 1.0
    for gyro in recording.gyros:
        check_name(gyro.name)
        columns[gyro.name], units[gyro.name] = gyro.values, field_unit(gyro.kind, gyro.shown_in)
        sizes[gyro.name] = unit_size(gyro.kind, units[gyro.name])
    if recording.table is not None:
        columns["table"] = recording.table.values
        units["table"] = field_unit("angle", recording.table.shown_in, is_table=True)
        sizes["table"] = unit_size("angle", units["table"])
    if recording.null_pulse is not None:
        columns["null_pulse"] = recording.null_pulse
    return Outgoing(
        columns=columns,
        units=units,
        sizes=sizes,
        kinds={gyro.name: gyro.kind for gyro in recording.gyros},
        sample_rate=recording.sample_rate,
    )


def check_name(name: str) -> None:
    """Refuse a gyro name that cannot stand in a file.

    Raises
    ------
    ValueError
        If it is empty, reserved, or holds a mark that files use.
    """
    if not name or name in ("time", "table", "null_pulse") or set(name) & set(",;=[]:\"'\n\t"):
        raise ValueError(f"gyro name {name!r} cannot stand in a file; choose another (--columns)")


def split_matrix(key: str, shape: tuple[int, ...]) -> tuple[str, ...]:
    """Column keys for an array of that shape: ``w`` for a vector, ``w.1 w.2 w.3`` for (n, 3).

    Arrays that are neither give none.
    """
    long = [size for size in shape if size > 1]
    if len(long) == 1 and len(shape) <= 2:
        return (key,)
    if len(shape) == 2 and len(long) == 2:
        return tuple(f"{key}.{index}" for index in range(1, min(shape) + 1))
    return ()


def take_column(array: NDArray[Any], index: int | None) -> NDArray[Any]:
    """The vector, or the 1-based column `index` along the short side of a matrix."""
    if index is None:
        return array.reshape(-1)
    return array[:, index - 1] if array.shape[0] >= array.shape[1] else array[index - 1]


@contextmanager
def damaged(path: Path, format_name: str) -> Iterator[None]:
    """Turn whatever a library raises over a file into one line.

    Libraries raise from a wide choice over a cut or corrupt file (zlib, struct, type,
    index, overflow errors), so everything that is an `Exception` is taken.

    Raises
    ------
    RecordingError
        For every other exception inside.
    """
    try:
        yield
    except RecordingError:
        raise
    except Exception as error:
        # NumPy ends its message with advice on its own arguments.
        why = " ".join(str(error).split()).split("; use `")[0][:160] or type(error).__name__
        raise RecordingError(
            f"{path}: is not {format_name}, or is damaged or cut off ({why}); "
            "get the file again from its source"
        ) from error


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A temporary path in the same folder that becomes `path` if all goes well.

    Raises
    ------
    RecordingError
        If the folder cannot be written to.
    """
    try:
        handle, name = tempfile.mkstemp(prefix=f".{path.name}.", suffix=".part", dir=path.parent)
    except OSError as error:
        raise RecordingError(
            f"{path}: cannot be written ({error.strerror}); choose another output"
        ) from None
    os.close(handle)
    temporary = Path(name)
    try:
        yield temporary
        mask = os.umask(0)
        os.umask(mask)
        temporary.chmod(0o666 & ~mask)
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)
