"""Result of every reader: the columns a file has, its statements, how to load them."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from sagnac.errors import Note, one_line
from sagnac.formats.files import replacing
from sagnac.formats.statement import Statement
from sagnac.units import split_header

# `replacing` has its home in `files`; it stands here until no other room imports it from here.
__all__ = ["Column", "Source", "Stored", "Vector", "column", "in_memory", "replacing", "vectors"]

# A matrix of more columns than this is no recording.
_MOST_COLUMNS: Final = 4096


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
        Name of the format, for provenance.
    columns
        The numeric columns.
    stated
        What the file states for all of them.
    load
        Keys -> their columns.
    notes
        What was noticed on opening.
    unreadable
        Columns that hold no real numbers, by name, and why: ``holds text``.
    """

    format: str
    columns: tuple[Column, ...]
    load: Callable[[Sequence[str]], Stored]
    stated: Statement = field(default_factory=Statement)
    notes: tuple[Note, ...] = ()
    unreadable: Mapping[str, str] = field(default_factory=dict)


def column(key: str, *, unit: str | None = None, kind: str | None = None) -> Column:
    """A `Column` from the file's own name for it, ``x`` or ``x[arcsec]``.

    Examples
    --------
    >>> column("x[arcsec]", kind="angle").unit
    'arcsec'
    """
    name, in_header = split_header(key)
    return Column(key=key, name=one_line(name), unit=unit or in_header, kind=kind)


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

    def of(self, array: NDArray[Any]) -> NDArray[Any]:
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
    if len(shape) == 2 and len(long) == 2 and min(shape) <= _MOST_COLUMNS:
        numbers = range(1, min(shape) + 1)
        return {f"{key}.{number}": Vector(array=array, index=number) for number in numbers}
    return {}
