"""Compiled loops of data quality: arrays in, arrays out; no validation, no files."""

from sagnac.arrays import FloatArray
from sagnac.kernels import compiled


@compiled(nogil=True)
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
