"""Compiled loops of data quality: arrays in, arrays out; no validation, no files."""

import numpy as np
from numpy.typing import NDArray

from sagnac.core.arrays import FloatArray, IntegerArray
from sagnac.core.kernels import compiled

# Bits of a float: places of its mantissa, exponent of 1, the mantissa, and that of sqrt(2).
_MANTISSA, _NO_EXPONENT = 52, 1023
_MANTISSA_BITS, _ROOT_OF_TWO = (1 << 52) - 1, 0x6A09E667F3BCD
_FIRST_TURN, _LAST_TURN = np.uint64(29), np.uint64(32)


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
def off_nearer_side(values: FloatArray, off: FloatArray) -> None:
    """Fill `off` with how far values lie from the median of the three on the nearer side.

    `values` holds three values more on either side.
    """
    for n in range(off.size):
        here = values[n + 3]
        before, behind = values[n : n + 3], values[n + 4 : n + 7]
        earlier = max(min(before[0], before[1]), min(max(before[0], before[1]), before[2]))
        later = max(min(behind[0], behind[1]), min(max(behind[0], behind[1]), behind[2]))
        off[n] = min(abs(here - earlier), abs(here - later))


@compiled()
def count_sizes(
    sizes: FloatArray, rounding: float, lowest: int, counts: IntegerArray, smallest: FloatArray
) -> int:
    """Count sizes in half octaves, the first of which begins at the power of two `lowest`.

    `counts` and the `smallest` size of each class are brought up to date; the sizes up to
    `rounding` are in none, and their number is returned.
    """
    nothing = 0
    bits = sizes.view(np.int64)
    for n in range(sizes.size):
        if sizes[n] <= rounding:
            nothing += 1
        if not rounding < sizes[n] < np.inf:
            continue
        octave = (bits[n] >> _MANTISSA) - _NO_EXPONENT - lowest
        number = 2 * octave + ((bits[n] & _MANTISSA_BITS) >= _ROOT_OF_TWO)
        if 0 <= number < counts.size:
            counts[number] += 1
            smallest[number] = min(smallest[number], sizes[n])
    return nothing


@compiled()
def survey(before: FloatArray, here: FloatArray) -> tuple[float, float, float, float, float, float]:
    """Smallest and largest value, smallest and largest step, and how many of each are nothing.

    `before` holds the value before each of `here`.
    """
    lowest, highest = before[0], before[0]
    fall, rise = here[0] - before[0], here[0] - before[0]
    zeros, repeats = 0, 0
    for n in range(here.size):
        value, step = here[n], here[n] - before[n]
        lowest, highest = min(lowest, value), max(highest, value)
        fall, rise = min(fall, step), max(rise, step)
        zeros += value == 0.0
        repeats += step == 0.0
    return lowest, highest, fall, rise, zeros, repeats


@compiled()
def leaps(
    values: FloatArray, limits: tuple[float, float, float, float], is_leap: NDArray[np.bool_]
) -> None:
    """Say of each step but the outer two whether it is longer than those around by whole steps.

    `limits` are the least of a usual step, the part of it that its two sides differ by at most, and
    the part of a step, and of their number, to which the number of steps is whole.
    """
    least, unlike, whole, of_number = limits
    for n in range(is_leap.size):
        earlier = 0.5 * (values[n + 2] - values[n])
        later = 0.5 * (values[n + 5] - values[n + 3])
        usual = 0.5 * (earlier + later)
        ratio = (values[n + 3] - values[n + 2]) / usual - 1.0 if usual != 0.0 else 0.0
        number = np.rint(ratio)
        steady = abs(usual) > least and abs(earlier - later) < unlike * abs(usual)
        is_met = abs(ratio - number) < whole + of_number * number
        is_leap[n] = steady and is_met and number >= 1.0


@compiled()
def kept_windows(
    bits: NDArray[np.uint64],
    factor: np.uint64,
    window: int,
    places: IntegerArray,
    mixed: NDArray[np.uint64],
) -> int:
    """Fill `places` with windows of values that are kept, `mixed` with their mixed bits.

    Kept are those whose first two values mix to four leading zeros, one in sixteen, as long as
    there is room; their number is returned. Products wrap around, which is what mixes.
    """
    number = 0
    for n in range(bits.size - window + 1):
        state = (bits[n] ^ (bits[n] >> _LAST_TURN)) * factor + bits[n + 1]
        if ((state ^ (state >> _FIRST_TURN)) * factor) >> np.uint64(60) != np.uint64(0):
            continue
        for value in bits[n + 2 : n + window]:
            state = (state ^ (state >> _FIRST_TURN)) * factor + value
        places[number] = n
        mixed[number] = (state ^ (state >> _LAST_TURN)) * factor
        number += 1
        if number == places.size:
            break
    return number
