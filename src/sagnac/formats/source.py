"""Columns with their statements, as readers give and writers take them, and how to load them."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final

import numpy as np

from sagnac.core.arrays import AnyArray, FloatArray, IntegerArray, empty, is_mapped, release
from sagnac.core.errors import Note, RecordingError, one_line
from sagnac.core.texts import text_of
from sagnac.core.units import UNITS, Unit, sensor_of, split_header
from sagnac.formats.files import damaged
from sagnac.formats.statement import ROLES, VOCABULARY, Statement
from sagnac.recording.channel import PICKOFF
from sagnac.recording.columns import NULL_PULSE_NAME, TEMPERATURE
from sagnac.recording.model import Kind, Recording

# ---- source ------------------------------------------------------------------------

# Pieces of columns that follow one another, each with values of one key or more.
Pieces = Iterator[dict[str, AnyArray]]
# Columns of numbers by their keys.
Values = dict[str, FloatArray]
# Kinds of numpy types that are read; dates and durations as whole nanoseconds.
NUMBERS: Final = "biufMm"
# A matrix of more columns than this is no recording.
MOST_COLUMNS: Final = 4096


@dataclass(frozen=True, slots=True, kw_only=True)
class Column:
    """A numeric column of a file.

    Attributes
    ----------
    key
        What the reader loads it by, and its full name in the file: ``x[arcsec]``.
    name
        Its name without the unit: ``x``.
    unit, kind
        What the file says of this column, or None.
    number
        Its place among the columns of the file, from 1, if they have places; else 0.
    """

    key: str
    name: str
    unit: str | None = None
    kind: str | None = None
    number: int = 0


Columns = Sequence[Column]


@dataclass(frozen=True, slots=True, kw_only=True)
class Stored:
    """Columns that are read when they are asked for.

    Attributes
    ----------
    lengths
        Key -> samples.
    pieces
        Keys, first sample and the one after the last -> their `Pieces`: arrays of one dimension,
        any numeric type; missing samples are NaN. A key is asked for once.
    format
        That of the file, for messages.
    """

    lengths: Mapping[str, int]
    pieces: Callable[[Sequence[str], int, int], Pieces]
    format: str = ""

    def read(self, keys: Sequence[str], first: int, stop: int, *, by_first: bool = False) -> Values:
        """Samples of columns as float64; no column is in memory twice.

        Parameters
        ----------
        keys
            Those of the columns.
        first, stop
            First sample, and the one after the last.
        by_first
            Whether the first sample, if it is finite, is taken off all before they become float64:
            stamps lose nothing by the size of their epoch.

        Raises
        ------
        RecordingError
            If the file is damaged, or numbers would lose digits as float64.
        """
        columns = {key: empty(stop - first) for key in keys}
        sizes = dict.fromkeys(keys, 0)
        origins: dict[str, AnyArray] = {}
        with damaged(self.format):
            for piece in self.pieces(keys, first, stop):
                for key, raw in piece.items():
                    values = raw
                    if by_first:
                        values = raw.astype(np.int64) if raw.dtype.kind in "ub" else raw
                        origin = np.where(np.isfinite(values[:1]), values[:1], 0)
                        values = values - origins.setdefault(key, origin)
                    else:
                        _require_exact(key, raw)
                    if _may_be_kept(values, columns[key]):
                        columns[key] = values
                    else:
                        columns[key][sizes[key] : sizes[key] + values.size] = values
                        release()
                    sizes[key] += values.size
            for key, size in sizes.items():
                if size != stop - first:
                    raise ValueError(f"{key} has {size} of {stop - first} samples")
        return columns


# Whole numbers up to this are exact as float64.
_EXACT: Final = 2**53


def _require_exact(key: str, values: AnyArray) -> None:
    """Refuse numbers that lose digits, or a part of them, as float64."""
    if values.dtype.kind == "c":
        remedy = "store real and imaginary parts apart"
        raise RecordingError("holds complex values", channel=key, remedy=remedy)
    large = values.dtype.kind in "iu" and values.dtype.itemsize == 8 and values.size
    if not large or (values.max() <= _EXACT and values.min() >= -_EXACT):
        return
    with np.errstate(invalid="ignore"):
        back = values.astype(np.float64).astype(values.dtype)
    if (back != values).any():
        problem = "holds integers beyond 2^53, whose last digits would be lost"
        remedy = "take a constant off them and store the rest"
        raise RecordingError(problem, channel=key, remedy=remedy)


def _may_be_kept(values: AnyArray, column: FloatArray) -> bool:
    """Whether a piece is a whole column already, as it is to be."""
    is_plain = values.dtype == np.float64 and values.flags.writeable and values.flags.c_contiguous
    return is_plain and values.size == column.size and not is_mapped(column)


def in_memory(arrays: dict[str, AnyArray]) -> Stored:
    """Columns of a format that is read whole; each is let go as it is taken over."""

    def pieces(keys: Sequence[str], start: int, stop: int) -> Pieces:
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
    columns
        The numeric columns.
    load
        Keys -> their columns, stored or whole in memory.
    stated
        What the file states for all of them.
    notes
        What was noticed on opening.
    unreadable
        Columns that hold no real numbers, by name, and why: ``holds text``.
    format
        Name of the format, for provenance and messages; that of its `Format` unless stated.
    """

    columns: tuple[Column, ...]
    load: Callable[[Sequence[str]], "Stored | dict[str, AnyArray]"]
    stated: Statement = field(default_factory=Statement)
    notes: tuple[Note, ...] = ()
    unreadable: Mapping[str, str] = field(default_factory=dict)
    format: str = ""

    def opened(self, keys: Sequence[str]) -> Stored:
        """Columns, ready to be read.

        Raises
        ------
        RecordingError
            If the file is damaged.
        """
        with damaged(self.format):
            loaded = self.load(keys)
            stored = loaded if isinstance(loaded, Stored) else in_memory(loaded)
            return replace(stored, format=self.format)

    def stamps(self, key: str, first: int = 0, stop: int | None = None) -> FloatArray:
        """Samples `first` to `stop` of one column, each less the first of them.

        No sample is given if the column ends before `stop`.

        Raises
        ------
        RecordingError
            If the file is damaged.
        """
        stored = self.opened([key])
        samples = stored.lengths[key]
        last = samples if stop is None else stop
        return stored.read([key], first, last if last <= samples else first, by_first=True)[key]


def column(key: str, *, unit: str | None = None, kind: str | None = None) -> Column:
    """A `Column` from the file's own name for it, ``x`` or ``x[arcsec]``.

    Examples
    --------
    >>> column("x[arcsec]", kind="angle").unit
    'arcsec'
    """
    name, in_header = split_header(key)
    return Column(key=key, name=one_line(name), unit=unit or in_header, kind=kind)


def unit_of(kind: np.dtype[Any]) -> str | None:
    """Unit of `as_numbers` of values of a type, None for all but dates and durations."""
    return "ns" if kind.kind in "Mm" else None


def as_numbers(values: AnyArray) -> AnyArray:
    """Values of a kind in `NUMBERS`: dates and durations as whole nanoseconds, others as are."""
    kind = values.dtype.kind
    return values.astype(f"{kind}8[ns]").astype(np.int64) if kind in "Mm" else values


@dataclass(frozen=True, slots=True, kw_only=True)
class Vector:
    """Where a column lies: in an array of the file, and in which column of it.

    Attributes
    ----------
    array
        Name of the array.
    index
        1-based column along the short side of a matrix; None for an array that is a vector.
    """

    array: str
    index: int | None

    def of(self, array: AnyArray) -> AnyArray:
        """Its values, (samples,)."""
        if self.index is None:
            return array.reshape(-1)
        columns = array if array.shape[0] >= array.shape[1] else array.T
        return np.asarray(columns[:, self.index - 1])


def vectors(key: str, array: str, shape: tuple[int, ...]) -> dict[str, Vector]:
    """Columns of an array of that shape by their keys.

    ``w`` for a vector, ``w.1``, ``w.2``, ``w.3`` for (samples, 3) or (3, samples); none for arrays
    that are neither vector nor matrix, and none for a matrix of over 4096 columns.

    Parameters
    ----------
    key
        Name that the columns get.
    array
        Name of the array in the file.
    shape
        Of the array.
    """
    long = [size for size in shape if size > 1]
    if len(long) == 1 and len(shape) <= 2:
        return {key: Vector(array=array, index=None)}
    if len(shape) == 2 and len(long) == 2 and min(shape) <= MOST_COLUMNS:
        numbers = range(1, min(shape) + 1)
        return {f"{key}.{number}": Vector(array=array, index=number) for number in numbers}
    return {}


# ---- outgoing ----------------------------------------------------------------------

Rows = dict[str, AnyArray]

# Each recording that is written says so, in whatever its format has for remarks.
MADE: Final = "recording made by sagnac"


@dataclass(frozen=True, slots=True, kw_only=True)
class Outgoing:
    """A recording in field units, ready for any format.

    Attributes
    ----------
    columns
        Name -> (samples,) values in SI: ``time`` where sampling is not uniform, the gyros, the
        accelerometers, ``table``, ``null_pulse`` (bool), and the pick-offs as they are. None of a
        recording that is written piece by piece.
    units
        Name of each column, in their order -> unit to write in; None for ``null_pulse``, the
        temperature and pick-offs, which are written as they are.
    kinds
        Name of a gyro or an accelerometer -> kind.
    sample_rate
        Hz.
    """

    units: Mapping[str, Unit | None]
    kinds: Mapping[str, Kind]
    sample_rate: float
    columns: Mapping[str, AnyArray] = field(default_factory=dict)

    @property
    def accelerometers(self) -> tuple[str, ...]:
        """Which of `kinds` are accelerometers, by their units."""
        sensors = {name: sensor_of(str(self.units[name])) for name in self.kinds}
        return tuple(name for name, sensor in sensors.items() if sensor == "accelerometer")

    @property
    def gyros(self) -> tuple[str, ...]:
        """Which of `kinds` are gyros."""
        return tuple(name for name in self.kinds if name not in self.accelerometers)

    @property
    def sensors(self) -> dict[str, str]:
        """``gyros`` and, if there are any, ``accelerometers``: names with commas between."""
        forces = {"accelerometers": ",".join(self.accelerometers)} if self.accelerometers else {}
        return {"gyros": ",".join(self.gyros), **forces}

    def statement(self) -> dict[str, str | float]:
        """All of it in flat text, for formats that carry attributes beside the numbers."""
        units = {name: unit for name, unit in self.units.items() if unit is not None}
        stated = {"kind": text_of(self.kinds), "unit": text_of(units)}
        return {**self.sensors, **stated, "sample_rate": self.sample_rate}

    def in_units(self, columns: Mapping[str, AnyArray]) -> Rows:
        """Columns in SI as they are written: in their units, the null pulse as 0 or 1."""
        return {
            name: values / unit.size
            if (unit := self.units[name]) is not None
            else values.astype(np.uint8 if name == NULL_PULSE_NAME else np.float64)
            for name, values in columns.items()
        }

    @property
    def samples(self) -> int:
        """Number of samples."""
        return next(iter(self.columns.values())).size

    def stamps(self, block: slice) -> IntegerArray:
        """Times of the samples of a block, ns; the first sample is at 1 s, since 0 is no stamp."""
        times, numbers = self.columns.get("time"), np.arange(*block.indices(self.samples))
        seconds = numbers / self.sample_rate if times is None else times[block]
        return np.asarray(10**9 + np.rint(seconds * 1e9).astype(np.int64))

    def rows(self, block: slice) -> Rows:
        """Name -> values of a block in `units`; the null pulse is 0 or 1."""
        return self.in_units({name: values[block] for name, values in self.columns.items()})


def outgoing(recording: Recording) -> Outgoing:
    """`recording` in the units its channels came in, or the field's.

    Raises
    ------
    ValueError
        If a gyro carries a name that a file needs for something else.
    """
    sensors, table = (*recording.gyros, *recording.accelerometers), recording.table
    for channel in sensors:
        check_name(channel.name)
    known = {"time": UNITS["s"], **{one.name: one.plain_unit for one in sensors}}
    columns: dict[str, AnyArray | None] = {"time": recording.times}
    columns |= {one.name: one.values for one in sensors}
    if table is not None:
        columns["table"], known["table"] = table.values, table.plain_unit
    columns[NULL_PULSE_NAME] = recording.null_pulse
    columns |= {one.column: one.values for one in recording.pickoffs}
    columns[TEMPERATURE] = recording.temperature
    held = {name: values for name, values in columns.items() if values is not None}
    units = {name: known.get(name) for name in held}
    kinds = {channel.name: channel.kind for channel in sensors}
    return Outgoing(columns=held, units=units, kinds=kinds, sample_rate=recording.sample_rate)


def check_name(name: str) -> None:
    """Refuse a gyro name that cannot stand in a file.

    Raises
    ------
    ValueError
        If it is empty, reserved, or holds a mark that files use.
    """
    reserved = name in (*ROLES, *VOCABULARY, TEMPERATURE)
    odd = set(name) & set(",;=[]:\"'#%") or not name.isprintable() or name != name.strip()
    # A spreadsheet computes what begins with one of the last three.
    if not name or reserved or odd or name.startswith((PICKOFF, "_", "+", "-", "@")):
        without = "quotes, brackets, separators or a leading underscore, sign or @"
        why = "none that a file states something by, such as time, kind or unit"
        remedy = f"choose another without {without}, and {why}"
        raise ValueError(f"gyro name is {name!r}, which cannot stand in a file; {remedy}")
