"""Readings that start over at a period, made continuous."""

import numpy as np

from sagnac import series
from sagnac.arrays import FloatArray


def unwrapped(values: FloatArray, period: float) -> tuple[FloatArray, int]:
    """A reading that starts over at `period`, made continuous.

    If two samples differ by more than half a period, the shorter way round is taken, so the
    direction may be either and may change.

    Parameters
    ----------
    values
        (samples,) readings; samples that are not finite are passed over.
    period
        Reading at which the counter starts over, in the unit of `values`.

    Returns
    -------
    values
        (samples,), a new array if anything was unwrapped, else the one given.
    wraps
        How often the reading started over.
    """

    def periods(block: slice) -> FloatArray:
        """Whole periods between each sample of a block and the next."""
        result = np.diff(values[block.start : block.stop + 1])
        result /= period
        np.rint(result, out=result)
        result[~np.isfinite(result)] = 0.0
        return result

    steps = values.size - 1
    wraps = sum(series.map(lambda block: int(np.count_nonzero(periods(block))), steps, values))
    if wraps == 0:
        return values, 0
    result = series.empty(values.size)
    result[0] = values[0]

    def take_off(before: float, block: slice) -> float:
        """Periods passed in one block taken off, on top of those passed before it."""
        over = periods(block)
        # Sums of integers, so nothing is lost.
        over[0] += before
        np.cumsum(over, out=over)
        before = float(over[-1])
        over *= period
        later = slice(block.start + 1, block.stop + 1)
        np.subtract(values[later], over, out=result[later])
        return before

    series.reduce(take_off, 0.0, steps, values, result)
    return result, wraps
