"""Series longer than memory should hold: mapped from scratch files, worked through by spans.

A series is a float64 array. Up to `IN_MEMORY` samples it is an ordinary one; beyond, it is mapped
from a scratch file that has no name and is gone with it. Both are read and written alike; code that
goes through them by `spans` and calls `release` on the way holds a few spans in memory at a time.
Scratch files lie where temporary files do (``TMPDIR``).
"""

import mmap
import os
import tempfile
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import IO, Any, Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from sagnac.arrays import ComplexArray, FloatArray

# Eight million samples are 64 MiB a series, and a search holds some ten.
IN_MEMORY: Final = 2**23
# A span of a quarter million samples is 2 MiB: it stays in cache, and a record has enough of them
# to share out.
SPAN: Final = 2**18
# Spans worked on at once. Their sums are added in the order of the spans, so that the number
# changes no result.
THREADS: Final = 2
# Spans read or written before their memory is given back.
_RELEASE_EVERY: Final = 4

_Result = TypeVar("_Result")
_Sum = TypeVar("_Sum", float, FloatArray, ComplexArray)


def empty(size: int) -> FloatArray:
    """A series of `size` samples to be filled, in memory or mapped."""
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
    """A mapping made here. What is released of another's, written privately, would be lost."""


def mapped(file: IO[bytes], size: int) -> FloatArray:
    """The first `size` samples of a scratch file, which may then be closed, as a series."""
    return np.frombuffer(_Scratch(file.fileno(), 8 * size), dtype=np.float64)


def is_mapped(series: FloatArray) -> bool:
    """Whether `series`, or what it is a view of, lies in a file."""
    return _mapping(series) is not None


def release(*several: NDArray[Any]) -> None:
    """Give back the memory of what was read and written of mapped series; their values stay."""
    for series in several:
        mapping = _mapping(series)
        # Not every system takes advice; there the pages go when memory is short.
        if mapping is not None and hasattr(mmap, "MADV_DONTNEED"):
            mapping.madvise(mmap.MADV_DONTNEED)


def spans(size: int, length: int | None = None) -> Iterator[slice]:
    """Slices that together cover `size` samples, each of `length` (`SPAN`) but the last."""
    length = length or SPAN
    for start in range(0, size, length):
        yield slice(start, min(start + length, size))


def through(size: int, *several: FloatArray) -> Iterator[slice]:
    """`spans` one by one, the memory of `several` mapped series given back on the way."""
    try:
        for number, span in enumerate(spans(size), start=1):
            yield span
            if number % _RELEASE_EVERY == 0:
                release(*several)
    finally:
        release(*several)


def each(
    work: Callable[[slice], _Result],
    size: int,
    length: int | None = None,
    *,
    release_of: tuple[FloatArray, ...] = (),
) -> Iterator[_Result]:
    """Results of `work` on every one of `spans`, in their order, some worked on at once.

    `release_of` names mapped series whose pages are given back on the way.
    """
    pieces = list(spans(size, length))
    if len(pieces) <= 1:
        yield from (work(piece) for piece in pieces)
        return
    with ThreadPoolExecutor(THREADS) as pool:
        for first in range(0, len(pieces), 2 * THREADS):
            yield from pool.map(work, pieces[first : first + 2 * THREADS])
            release(*release_of)


def map(
    work: Callable[[slice], _Result],
    size: int,
    *touched: FloatArray,
    length: int | None = None,
) -> list[_Result]:
    """Results of `work` on every block of `size` samples, in their order, some worked on at once.

    Parameters
    ----------
    work
        Given the slice of one block. It may read and write what it likes of the block.
    size
        Samples in all.
    touched
        Series that `work` reads or writes, whose memory is given back on the way.
    length
        Samples in a block, `SPAN` unless stated; the last one may be shorter.
    """
    return list(each(work, size, length, release_of=touched))


def total(
    work: Callable[[slice], _Sum],
    size: int,
    *touched: FloatArray,
    length: int | None = None,
) -> _Sum:
    """Sum of the results of `work` on every block, added in the order of the blocks; see `map`.

    Raises
    ------
    ValueError
        If there is no block.
    """
    parts = iter(each(work, size, length, release_of=touched))
    result = next(parts, None)
    if result is None:
        raise ValueError("there is nothing to sum: size is 0")
    for part in parts:
        result = result + part
    return result


def reduce(
    step: Callable[[_Result, slice], _Result],
    start: _Result,
    size: int,
    *touched: FloatArray,
    length: int | None = None,
) -> _Result:
    """What `step` makes of `start` and every block in turn, one after another; see `map`."""
    state = start
    for number, block in enumerate(spans(size, length), start=1):
        state = step(state, block)
        if number % _RELEASE_EVERY == 0:
            release(*touched)
    release(*touched)
    return state


def made(
    work: Callable[[slice], FloatArray],
    size: int,
    *touched: FloatArray,
    length: int | None = None,
) -> FloatArray:
    """A new series, each block of it what `work` returns for it; see `map`."""
    result = empty(size)

    def fill(block: slice) -> None:
        result[block] = work(block)

    map(fill, size, result, *touched, length=length)
    return result


def extent(values: FloatArray) -> tuple[float, float]:
    """Smallest and largest value; NaN where there is one among them."""
    ends = [(values[span].min(), values[span].max()) for span in through(values.size, values)]
    return float(np.min([low for low, _ in ends])), float(np.max([high for _, high in ends]))


def mean(values: FloatArray) -> float:
    """Mean value."""
    return sum(float(values[span].sum()) for span in through(values.size, values)) / values.size


def differences(values: FloatArray) -> FloatArray:
    """Each value less the one before, a new series one shorter."""
    result = empty(max(values.size - 1, 0))
    for span in through(result.size, values, result):
        later = values[span.start + 1 : span.stop + 1]
        np.subtract(later, values[span], out=result[span])
    return result


def less(values: FloatArray, taken: FloatArray | float) -> FloatArray:
    """Values less a number, or less others one by one, a new series."""
    result = empty(values.size)
    others = () if isinstance(taken, float) else (taken,)
    for span in through(values.size, values, result, *others):
        number = taken if isinstance(taken, float) else taken[span]
        np.subtract(values[span], number, out=result[span])
    return result


def every(values: FloatArray, step: int) -> FloatArray:
    """Copy of every `step`-th value, from the first."""
    result = empty(-(-values.size // step))
    filled = 0
    for span in through(values.size, values, result):
        chosen = values[span][-span.start % step :: step]
        result[filled : filled + chosen.size] = chosen
        filled += chosen.size
    return result


def at(values: FloatArray, places: NDArray[np.int64]) -> FloatArray:
    """Values at `places`, which ascend, in memory."""
    result = np.empty(places.size)
    for span in through(values.size, values):
        first, last = np.searchsorted(places, (span.start, span.stop))
        result[first:last] = values[places[first:last]]
    return result


def _mapping(series: NDArray[Any]) -> mmap.mmap | None:
    owner: object = series
    while isinstance(owner, np.ndarray):
        owner = owner.base
    if isinstance(owner, memoryview):
        owner = owner.obj
    return owner if isinstance(owner, _Scratch) else None
