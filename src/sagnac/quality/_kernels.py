"""Compiled loops of data quality: arrays in, arrays out; no validation, no files."""

import numpy as np

from sagnac.core.arrays import FloatArray
from sagnac.core.kernels import compiled


@compiled()
def off_neighbours(padded: FloatArray, off: FloatArray) -> None:
    """Fill `off` with each value less the median of the two before and the two after.

    `padded` holds two values more on either side.
    """
    for n in range(off.size):
        first, second, third, fourth = padded[n], padded[n + 1], padded[n + 3], padded[n + 4]
        # The middle two of four lie between the higher of the lower ones and the lower of the
        # higher.
        lower = max(min(first, second), min(third, fourth))
        higher = min(max(first, second), max(third, fourth))
        off[n] = padded[n + 2] - 0.5 * (lower + higher)


@compiled()
def off_nearer_side(values: FloatArray) -> FloatArray:
    """How far values lie from the median of the three on the nearer side.

    `values` holds three values more on either side.
    """
    off = np.empty(values.size - 6)
    for n in range(off.size):
        here = values[n + 3]
        before, behind = values[n : n + 3], values[n + 4 : n + 7]
        earlier = max(min(before[0], before[1]), min(max(before[0], before[1]), before[2]))
        later = max(min(behind[0], behind[1]), min(max(behind[0], behind[1]), behind[2]))
        off[n] = min(abs(here - earlier), abs(here - later))
    return off
