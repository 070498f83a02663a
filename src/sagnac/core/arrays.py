"""Array types that every room shares, memory of long arrays, and data frames.

A long array of float64 is mapped from a scratch file without a name, which vanishes with it; it
reads and writes like any other. Scratch files lie in the folder for temporary files (``TMPDIR``).
A loop over a long array goes by `blocks`, which give the memory of what they went through back.
"""

import math
import mmap
import os
import tempfile
import weakref
from collections.abc import Callable, Iterator
from itertools import count
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from sagnac.core.errors import extra_module

FloatArray = NDArray[np.float64]
IntegerArray = NDArray[np.int64]
BooleanArray = NDArray[np.bool_]
ComplexArray = NDArray[np.complex128]
AnyArray = NDArray[Any]
# What makes an array of arrays, value by value.
Operation = Callable[..., AnyArray]

# Eight million samples are 64 MiB an array, and a search holds some ten.
IN_MEMORY: Final = 2**23
# A block of a quarter million samples is 2 MiB: it stays in cache. Blocks come one after another:
# two threads that shared them took a quarter more processor time and no less time in all
# (two-hour recordings, three presets and methods).
BLOCK: Final = 2**18


# --- memory -----------------------------------------------------------------------------------


class _Scratch(mmap.mmap):
    """A mapping made here. Releasing somebody else's private mapping would lose what it holds."""


_scratches: weakref.WeakValueDictionary[int, _Scratch] = weakref.WeakValueDictionary()


def empty(size: int) -> FloatArray:
    """An array of `size` samples to be filled, in memory or mapped.

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
        reserve(file.fileno(), 8 * size)
        scratch = _Scratch(file.fileno(), 8 * size)
    _scratches[id(scratch)] = scratch
    return np.frombuffer(scratch, dtype=np.float64)


def reserve(file: int, size: int) -> None:
    """Room for `size` bytes in an open file: a full disk is an error now, not at a later write.

    Raises
    ------
    OSError
        If the disk is full.
    """
    # Not every system can promise room.
    promise = getattr(os, "posix_fallocate", lambda file, _, size: os.truncate(file, size))
    promise(file, 0, size)


def is_mapped(values: NDArray[Any]) -> bool:
    """Whether an array, or the one that it is a view of, was mapped here."""
    owner: object = values
    while isinstance(owner, np.ndarray):
        owner = owner.base
    return isinstance(owner, memoryview) and isinstance(owner.obj, _Scratch)


def release() -> None:
    """Give back the memory of all mapped arrays; their values stay in their files."""
    # Not every system takes advice; there the pages go when memory is short.
    if hasattr(mmap, "MADV_DONTNEED"):
        # A list: another thread may map more meanwhile.
        for reference in _scratches.valuerefs():
            if (scratch := reference()) is not None:
                scratch.madvise(mmap.MADV_DONTNEED)


def block_length(multiple: int = 1) -> int:
    """Samples in a block that is a multiple of this."""
    return multiple * max(1, BLOCK // multiple)


def blocks(
    stop: int, length: int | None = None, *, start: int = 0, multiple: int = 1
) -> Iterator[slice]:
    """Slices from `start` to `stop`; memory is given back on the way and at the end.

    Parameters
    ----------
    stop
        Samples in all.
    length
        Samples in a slice, `BLOCK` unless stated; the last is the rest.
    start
        First sample.
    multiple
        Unless the length is stated, it is a multiple of this.

    Examples
    --------
    >>> list(blocks(5, 2))
    [slice(0, 2, None), slice(2, 4, None), slice(4, 5, None)]
    """
    length = length or block_length(multiple)
    try:
        for number, first in enumerate(range(start, stop, length), start=1):
            yield slice(first, min(first + length, stop))
            # Not after every one: giving back takes a call of the system.
            if number % 4 == 0:
                release()
    finally:
        release()


# --- whole arrays -----------------------------------------------------------------------------


def extent(values: FloatArray) -> tuple[float, float]:
    """Smallest and largest value; NaN where there is one among them.

    Raises
    ------
    ValueError
        If there is no value.

    Examples
    --------
    >>> extent(np.array([1.0, 6.0, 2.0]))
    (1.0, 6.0)
    """
    ends = [(values[block].min(), values[block].max()) for block in blocks(values.size)]
    return float(np.min(ends)), float(np.max(ends))


def mean(values: FloatArray) -> float:
    """Mean value.

    Raises
    ------
    ZeroDivisionError
        If there is no value.

    Examples
    --------
    >>> mean(np.array([1.0, 2.0, 6.0]))
    3.0
    """
    return sum(float(values[block].sum()) for block in blocks(values.size)) / values.size


def square(values: FloatArray) -> float:
    """Sum of the squared values.

    Examples
    --------
    >>> square(np.array([1.0, 2.0, 6.0]))
    41.0
    """
    return sum(float(values[block] @ values[block]) for block in blocks(values.size))


def all_finite(values: FloatArray) -> bool:
    """Whether every value is a number, none of them infinite.

    Examples
    --------
    >>> all_finite(np.array([1.0, np.nan]))
    False
    """
    return all(np.isfinite(values[block]).all() for block in blocks(values.size))


def median(values: FloatArray) -> float:
    """Median of one value or more, none of them NaN.

    `np.median` asks partition for three places where one tells, and takes four to five times as
    long for 1,000 to 500,000 values.

    Examples
    --------
    >>> median(np.array([4.0, 1.0, 3.0])), median(np.array([4.0, 1.0, 3.0, 2.0]))
    (3.0, 2.5)
    """
    half = values.size // 2
    parted = np.partition(values, half)
    upper = float(parted[half])
    return upper if values.size % 2 else 0.5 * (float(parted[:half].max()) + upper)


def differences(values: FloatArray) -> FloatArray:
    """Each value less the one before, one fewer.

    Examples
    --------
    >>> differences(np.array([1.0, 2.0, 6.0]))
    array([1., 4.])
    """
    result = empty(max(values.size - 1, 0))
    for block in blocks(result.size):
        np.subtract(values[block.start + 1 : block.stop + 1], values[block], out=result[block])
    return result


def elementwise(
    operation: Operation, values: AnyArray, *others: AnyArray | float, out: FloatArray | None = None
) -> FloatArray:
    """An operation on values and numbers, or on values and others, one by one.

    Parameters
    ----------
    operation
        A ufunc, or what acts on arrays alike.
    values
        (samples,)
    others
        (samples,) or a number, each.
    out
        (samples,) that the results go to, which may be one of the arrays; a new array unless given.

    Examples
    --------
    >>> elementwise(np.subtract, np.array([1, 2, 6]), 1.0)
    array([0., 1., 5.])
    """
    result = empty(values.size) if out is None else out
    for block in blocks(values.size):
        here = (other[block] if isinstance(other, np.ndarray) else other for other in others)
        # Single precision times a number would stay single.
        result[block] = operation(np.asarray(values[block], dtype=np.float64), *here)
    return result


def less(values: FloatArray, taken: Callable[[FloatArray], FloatArray]) -> FloatArray:
    """Values less what a function makes of the numbers of the samples, block by block.

    Examples
    --------
    >>> less(np.array([1.0, 2.0, 6.0]), lambda number: 0.5 * number)
    array([1. , 1.5, 5. ])
    """
    left = empty(values.size)
    for block in blocks(values.size):
        number = np.arange(block.start, block.stop, dtype=np.float64)
        np.subtract(values[block], taken(number), out=left[block])
    return left


def by_blocks(function: Callable[..., Any], values: AnyArray, *others: AnyArray) -> AnyArray:
    """Results of a function for blocks of long arrays, (blocks, ...): to be summed, or the like.

    Parameters
    ----------
    function
        Given the same block of each array, (some,) each.
    values, others
        (samples,) each.
    """
    several = (values, *others)
    return np.array([function(*(one[some] for one in several)) for some in blocks(values.size)])


def every(values: FloatArray, step: int) -> FloatArray:
    """Copy of every `step`-th value, from the first.

    Examples
    --------
    >>> every(np.arange(7.0), 3)
    array([0., 3., 6.])
    """
    result = empty(-(-values.size // step))
    for block in blocks(result.size, -(-BLOCK // step)):
        result[block] = values[block.start * step : block.stop * step : step]
    return result


def distance_between(most: int, size: int) -> int:
    """Distance at which about `most` of `size` samples show all that recurs; 1 if few are more.

    Every eighth would show one phase alone of a line at a quarter of the sample rate: no distance
    has a divisor from 2 to 10.

    Examples
    --------
    >>> distance_between(1000, 8000), distance_between(1000, 3000)
    (11, 1)
    """
    apart = size // most
    # It has no prime below eleven in it.
    whole = (one for one in count(apart) if math.gcd(one, 2 * 3 * 5 * 7) == 1)
    return next(whole) if apart > 7 else 1


def some_steps(values: FloatArray, most: int) -> FloatArray:
    """Steps from a sample to the next at even distances, about `most` of them."""
    apart = distance_between(most, values.size - 1)
    return every(values[1:], apart) - every(values[:-1], apart)


def values_at(values: FloatArray, places: IntegerArray) -> FloatArray:
    """Copies of the values at places, (places, ...), which may lie all over a long array.

    A page that is read may bring two megabytes around it with it into memory.

    Examples
    --------
    >>> values_at(np.array([1.0, 2.0, 6.0]), np.array([[0, 1], [1, 2]]))
    array([[1., 2.],
           [2., 6.]])
    """
    if not is_mapped(values):
        return values[places]
    result = np.empty(places.shape)
    # Eight places are read at once.
    for some in blocks(places.shape[0], 8):
        result[some] = values[places[some]]
    return result


# --- data frames ------------------------------------------------------------------------------


def pandas_for(purpose: str) -> Any:
    """The pandas module, imported where it is needed for a purpose: ``a curve as a data frame``.

    Raises
    ------
    MissingExtra
        If pandas is not installed.
    """
    return extra_module("pandas", "frames", purpose)
