"""Samples for which a test holds: marks, an array of booleans beside the values."""

import numpy as np

from sagnac.core.arrays import BooleanArray, FloatArray, IntegerArray, Operation, blocks


def marked(test: Operation, values: FloatArray, *others: FloatArray) -> BooleanArray:
    """Samples for which a test holds, as booleans, (samples,).

    Parameters
    ----------
    test
        Given the same samples of each array, says of each whether it holds.
    values, others
        (samples,) each.
    """
    marks = np.empty(values.size, dtype=np.bool_)
    for block in blocks(values.size):
        marks[block] = test(*(one[block] for one in (values, *others)))
    return marks


def marked_steps(values: FloatArray, test: Operation) -> BooleanArray:
    """Samples (samples,) for which a test holds of the step that leads to them; never the first."""
    marks = np.zeros(values.size, dtype=np.bool_)
    marks[1:] = marked(lambda before, here: test(here - before), values[:-1], values[1:])
    return marks


def number_of(marks: BooleanArray) -> int:
    """How many are true."""
    return int(np.count_nonzero(marks))


def first_of(marks: BooleanArray) -> int:
    """The first that is true, if any is."""
    return int(np.argmax(marks))


def is_missing(values: FloatArray) -> BooleanArray:
    """Samples that are NaN or infinite, as booleans."""
    return marked(lambda some: ~np.isfinite(some), values)


def stretches(marks: BooleanArray) -> tuple[IntegerArray, IntegerArray]:
    """First sample of each stretch of marks, and the first one behind it, (stretches,) each."""
    edges = np.diff(marks.view(np.int8), prepend=np.int8(0), append=np.int8(0))
    return np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)


def longest_unmarked(marks: BooleanArray) -> slice:
    """The longest stretch without a mark, the first if two are as long; empty if there is none."""
    firsts, afters = stretches(~marks)
    if firsts.size == 0:
        return slice(0, 0)
    at = int(np.argmax(afters - firsts))
    return slice(int(firsts[at]), int(afters[at]))
