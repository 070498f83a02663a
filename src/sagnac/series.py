"""Series longer than memory should hold: kept in scratch files, worked through block by block.

A series is a float64 array. Up to `IN_MEMORY` samples it is an ordinary array; a longer one is
mapped from a scratch file without a name, which vanishes with it. Both are read and written alike.
Scratch files lie in the folder for temporary files (``TMPDIR``).

Only this module cuts a series into blocks and gives its memory back. The rest of the package says
what to do with one block, and asks for the results (`map`), their sum (`total`), a state carried
from block to block (`reduce`), a new series (`made`), or the first place where a test holds
(`first_where`); a reader of a file fills a series piece by piece (`Filling`), and a compiled loop
that goes through whole series says so (`gone_through`).
"""

import mmap
import os
import tempfile
from collections.abc import Callable, Generator, Iterator
from contextlib import closing, contextmanager
from typing import IO, Any, Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from sagnac.arrays import BooleanArray, ComplexArray, FloatArray, IntegerArray

# Eight million samples are 64 MiB a series, and a search holds some ten.
IN_MEMORY: Final = 2**23
# A block of a quarter million samples is 2 MiB: it stays in cache. Blocks come one after another:
# two threads that shared them took a quarter more processor time and no less time in all
# (two-hour recordings, three presets and methods).
SPAN: Final = 2**18
# Blocks read or written before their memory is given back.
_RELEASE_EVERY: Final = 4

_Result = TypeVar("_Result")
_Sum = TypeVar("_Sum", float, FloatArray, ComplexArray)


# --- storage ----------------------------------------------------------------------------------


def empty(size: int) -> FloatArray:
    """A series of `size` samples to be filled, in memory or mapped.

    Raises
    ------
    OSError
        If the disk that holds scratch files is full.

    Examples
    --------
    >>> empty(3).shape
    (3,)
    """
    if size <= IN_MEMORY:
        return np.empty(size)
    with tempfile.TemporaryFile(prefix="sagnac-") as file:
        if hasattr(os, "posix_fallocate"):
            # A full disk is an error here and now, not a signal at the first write.
            os.posix_fallocate(file.fileno(), 0, 8 * size)
        else:
            file.truncate(8 * size)
        return mapped(file, size)


class _Scratch(mmap.mmap):
    """A mapping made here. Releasing somebody else's private mapping would lose what it holds."""


def mapped(file: IO[bytes], size: int) -> FloatArray:
    """The first `size` samples of a scratch file, which may then be closed, as a series."""
    return np.frombuffer(_Scratch(file.fileno(), 8 * size), dtype=np.float64)


def is_mapped(series: FloatArray) -> bool:
    """Whether `series`, or the array that it is a view of, lies in a file."""
    return _mapping(series) is not None


def _release(*several: NDArray[Any]) -> None:
    """Give back the memory of mapped series; their values stay."""
    for series in several:
        mapping = _mapping(series)
        # Not every system takes advice; there the pages go when memory is short.
        if mapping is not None and hasattr(mmap, "MADV_DONTNEED"):
            mapping.madvise(mmap.MADV_DONTNEED)


def _mapping(series: NDArray[Any]) -> mmap.mmap | None:
    owner: object = series
    while isinstance(owner, np.ndarray):
        owner = owner.base
    if isinstance(owner, memoryview):
        owner = owner.obj
    return owner if isinstance(owner, _Scratch) else None


class Filling:
    """A series that is filled from its first sample on, piece by piece.

    The memory of what was filled is given back after each piece.

    Parameters
    ----------
    size
        Samples that the series has room for.

    Examples
    --------
    >>> import numpy as np
    >>> filling = Filling(5)
    >>> filling.append(np.array([1, 2]))
    >>> filling.append(np.array([3, 4]))
    >>> filling.filled
    array([1., 2., 3., 4.])
    """

    def __init__(self, size: int) -> None:
        self._size = size
        self._samples = 0
        self._series: FloatArray | None = None

    def append(self, values: NDArray[Any]) -> None:
        """Add (samples,) values of any numeric type.

        An array that fills the whole series by itself is taken over, not copied, if it is one of
        float64 that may be written to and the series is short enough to lie in memory.

        Raises
        ------
        ValueError
            If there is no room for them.
        """
        if values.size > self._size - self._samples:
            raise ValueError(
                f"{values.size} values follow {self._samples}; there is room for {self._size}"
            )
        if self._is_whole(values):
            self._series = values
        else:
            series = self._room()
            series[self._samples : self._samples + values.size] = values
            _release(series)
        self._samples += values.size

    @property
    def filled(self) -> FloatArray:
        """The values so far, a view of the series."""
        return self._room()[: self._samples]

    def _is_whole(self, values: NDArray[Any]) -> bool:
        return (
            values.size == self._size <= IN_MEMORY
            and values.dtype == np.float64
            and values.flags.writeable
            and values.flags.c_contiguous
        )

    def _room(self) -> FloatArray:
        if self._series is None:
            self._series = empty(self._size)
        return self._series


# --- block by block ---------------------------------------------------------------------------


def _spans(size: int, length: int | None = None) -> Iterator[slice]:
    """Blocks that together cover `size` samples, each of `length` (`SPAN`); the last is the rest.

    Examples
    --------
    >>> list(_spans(5, 2))
    [slice(0, 2, None), slice(2, 4, None), slice(4, 5, None)]
    """
    length = length or SPAN
    for start in range(0, size, length):
        yield slice(start, min(start + length, size))


def _through(
    size: int, *several: FloatArray, length: int | None = None
) -> Generator[slice, None, None]:
    """`_spans` one by one, the memory of `several` mapped series given back on the way."""
    try:
        for number, span in enumerate(_spans(size, length), start=1):
            yield span
            if number % _RELEASE_EVERY == 0:
                _release(*several)
    finally:
        _release(*several)


def map(
    work: Callable[[slice], _Result],
    size: int,
    *touched: FloatArray,
    length: int | None = None,
) -> list[_Result]:
    """Results of `work` on every block of `size` samples, in the order of the blocks.

    Parameters
    ----------
    work
        Called with the slice of one block. It may read and write anything.
    size
        Samples in all.
    touched
        Series that `work` reads or writes, whose memory is given back on the way.
    length
        Samples in a block, `SPAN` unless stated; the last block may be shorter.

    Raises
    ------
    Exception
        What `work` raises, that of the first block that fails.

    Examples
    --------
    >>> import numpy as np
    >>> values = np.arange(7.0)
    >>> map(lambda block: float(values[block].max()), values.size, values, length=3)
    [2.0, 5.0, 6.0]
    """
    with closing(_through(size, *touched, length=length)) as blocks:
        return [work(block) for block in blocks]


def total(
    work: Callable[[slice], _Sum],
    size: int,
    *touched: FloatArray,
    length: int | None = None,
) -> _Sum:
    """Sum of the results of `work` on every block, added in the order of the blocks.

    The parameters are those of `map`.

    Raises
    ------
    ValueError
        If `size` is 0: no block says what nothing is.

    Examples
    --------
    >>> import numpy as np
    >>> values = np.arange(7.0)
    >>> total(lambda block: float(values[block].sum()), values.size, values, length=3)
    21.0
    """
    if size == 0:
        raise ValueError("there is nothing to sum: size is 0")
    with closing(_through(size, *touched, length=length)) as blocks:
        result = work(next(blocks))
        for block in blocks:
            result = result + work(block)
    return result


def reduce(
    step: Callable[[_Result, slice], _Result],
    start: _Result,
    size: int,
    *touched: FloatArray,
    length: int | None = None,
) -> _Result:
    """State after `step` took every block in turn, one after the other.

    Parameters
    ----------
    step
        Called with the state so far and the slice of one block; returns the new state.
    start
        State before the first block.
    size, touched, length
        As for `map`.

    Examples
    --------
    >>> import numpy as np
    >>> values = np.array([3.0, 5.0, 4.0, 9.0])
    >>> def higher(highest, block):
    ...     return max(highest, float(values[block].max()))
    >>> reduce(higher, 0.0, values.size, values, length=2)
    9.0
    """
    state = start
    for block in _through(size, *touched, length=length):
        state = step(state, block)
    return state


def made(
    work: Callable[[slice], FloatArray],
    size: int,
    *touched: FloatArray,
    length: int | None = None,
) -> FloatArray:
    """A new series; `work` returns each block of it.

    The parameters are those of `map`.

    Examples
    --------
    >>> import numpy as np
    >>> values = np.arange(4.0)
    >>> made(lambda block: 2.0 * values[block], values.size, values, length=3)
    array([0., 2., 4., 6.])
    """
    result = empty(size)

    def fill(block: slice) -> None:
        result[block] = work(block)

    map(fill, size, result, *touched, length=length)
    return result


def first_where(
    test: Callable[[slice], BooleanArray],
    size: int,
    *touched: FloatArray,
    length: int | None = None,
) -> int:
    """First place at which `test` holds, or `size` if it holds nowhere.

    Parameters
    ----------
    test
        Called with the slice of one block; returns (samples in the block,) answers. Blocks after
        the first place are not tested.
    size, touched, length
        As for `map`.

    Examples
    --------
    >>> import numpy as np
    >>> values = np.arange(7.0)
    >>> first_where(lambda block: values[block] > 3.5, values.size, values, length=3)
    4
    """
    for block in _through(size, *touched, length=length):
        answers = test(block)
        if answers.any():
            return int(block.start + np.argmax(answers))
    return size


@contextmanager
def gone_through(*touched: FloatArray) -> Iterator[None]:
    """For a loop that goes through whole series: gives their memory back at the end.

    Examples
    --------
    >>> import numpy as np
    >>> values = np.arange(4.0)
    >>> with gone_through(values):
    ...     highest = float(values.max())
    """
    try:
        yield
    finally:
        _release(*touched)


# --- whole series -----------------------------------------------------------------------------


def extent(values: FloatArray) -> tuple[float, float]:
    """Smallest and largest value; NaN where there is one among them.

    Raises
    ------
    IndexError
        If there is no value.

    Examples
    --------
    >>> import numpy as np
    >>> extent(np.array([1.0, 6.0, 2.0]))
    (1.0, 6.0)
    """

    def of_block(block: slice) -> tuple[float, float]:
        return float(values[block].min()), float(values[block].max())

    ends = np.array(map(of_block, values.size, values))
    return float(ends[:, 0].min()), float(ends[:, 1].max())


def mean(values: FloatArray) -> float:
    """Mean value.

    Raises
    ------
    ValueError
        If there is no value.

    Examples
    --------
    >>> import numpy as np
    >>> mean(np.array([1.0, 2.0, 6.0]))
    3.0
    """
    return total(lambda block: float(values[block].sum()), values.size, values) / values.size


def differences(values: FloatArray) -> FloatArray:
    """Each value less the one before, a new series one shorter.

    Examples
    --------
    >>> import numpy as np
    >>> differences(np.array([1.0, 2.0, 6.0]))
    array([1., 4.])
    """
    result = empty(max(values.size - 1, 0))

    def fill(block: slice) -> None:
        later = values[block.start + 1 : block.stop + 1]
        np.subtract(later, values[block], out=result[block])

    map(fill, result.size, values, result)
    return result


def less(values: FloatArray, taken: FloatArray | float) -> FloatArray:
    """Values less a number, or less others one by one, a new series.

    Examples
    --------
    >>> import numpy as np
    >>> less(np.array([1.0, 2.0, 6.0]), 1.0)
    array([0., 1., 5.])
    """
    result = empty(values.size)
    others = (taken,) if isinstance(taken, np.ndarray) and taken.ndim else ()

    def fill(block: slice) -> None:
        number = others[0][block] if others else taken
        np.subtract(values[block], number, out=result[block])

    map(fill, values.size, values, result, *others)
    return result


def scale(values: FloatArray, factor: float) -> FloatArray:
    """Values times a factor, in place; returns them.

    Examples
    --------
    >>> import numpy as np
    >>> scale(np.array([1.0, 2.0, 6.0]), 0.5)
    array([0.5, 1. , 3. ])
    """
    if factor != 1.0:

        def multiply(block: slice) -> None:
            values[block] *= factor

        map(multiply, values.size, values)
    return values


def shift(values: FloatArray, by: float) -> FloatArray:
    """Values plus a number, in place; returns them.

    Examples
    --------
    >>> import numpy as np
    >>> shift(np.array([1.0, 2.0, 6.0]), -1.0)
    array([0., 1., 5.])
    """

    def add(block: slice) -> None:
        values[block] += by

    map(add, values.size, values)
    return values


def every(values: FloatArray, step: int) -> FloatArray:
    """Copy of every `step`-th value, from the first.

    Examples
    --------
    >>> import numpy as np
    >>> every(np.arange(7.0), 3)
    array([0., 3., 6.])
    """
    result = empty(-(-values.size // step))

    def fill(block: slice) -> None:
        chosen = values[block][-block.start % step :: step]
        first = -(-block.start // step)
        result[first : first + chosen.size] = chosen

    map(fill, values.size, values, result)
    return result


def at(values: FloatArray, places: IntegerArray) -> FloatArray:
    """Values at `places`, which ascend, in memory.

    Examples
    --------
    >>> import numpy as np
    >>> at(np.arange(0.0, 70.0, 10.0), np.array([1, 1, 5]))
    array([10., 10., 50.])
    """
    result = np.empty(places.size)

    def fill(block: slice) -> None:
        first, last = np.searchsorted(places, (block.start, block.stop))
        result[first:last] = values[places[first:last]]

    map(fill, values.size, values)
    return result
