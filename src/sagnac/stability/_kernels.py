"""Compiled loops of the Allan family: arrays in, arrays out; no validation, no files."""

# Compiled loops take their arrays by position.
# ruff: noqa: PLR0917

import numpy as np

from sagnac.core.arrays import FloatArray, IntegerArray
from sagnac.core.kernels import compiled

# Sums may be reordered into vector lanes, but a NaN stays a NaN and no division is guessed.
_REORDER = {"reassoc", "contract"}
_BLOCK = 4096


@compiled(fastmath=_REORDER)
def sum_squared_differences(
    angle: FloatArray, lags: IntegerArray, order: int, begin: int, end: int, sums: FloatArray
) -> FloatArray:
    """`sums`, for each lag, and squared differences of `order` 2 or 3 from begin <= i < end.

    They are ``x[i + 2 lag] - 2 x[i + lag] + x[i]`` and
    ``x[i + 3 lag] - 3 x[i + 2 lag] + 3 x[i + lag] - x[i]``.

    Blocks of starts go through all lags while they are in cache, and a fresh sum for each
    block keeps the rounding error from growing with the record. `begin` is a multiple of
    a block, and so is `end` unless it is that of the record: the parts then add up to the last bit.
    """
    sums = sums.copy()
    for start in range(begin, min(end, angle.size), _BLOCK):
        for j in range(lags.size):
            lag = lags[j]
            count = min(_BLOCK, angle.size - order * lag - start)
            if count <= 0:
                continue
            # Slices counted from zero let the loop run in vector lanes.
            first = angle[start : start + count]
            second = angle[start + lag : start + lag + count]
            third = angle[start + 2 * lag : start + 2 * lag + count]
            last = angle[start + order * lag : start + order * lag + count]
            partial = 0.0
            if order == 2:
                for k in range(count):
                    difference = (last[k] - second[k]) - (second[k] - first[k])
                    partial += difference * difference
            else:
                for k in range(count):
                    difference = (last[k] - first[k]) - 3.0 * (third[k] - second[k])
                    partial += difference * difference
            sums[j] += partial
    return sums


@compiled()
def window_difference(angle: FloatArray, lag: int, start: int, stop: int, window: float) -> float:
    """`window` and ``x[i + 2 lag] - 2 x[i + lag] + x[i]``, start <= i < stop, one by one."""
    for i in range(start, stop):
        window += (angle[i + 2 * lag] - angle[i + lag]) - (angle[i + lag] - angle[i])
    return window


@compiled(fastmath=_REORDER)
def sum_squared_window_differences(
    angle: FloatArray,
    lags: IntegerArray,
    begin: int,
    end: int,
    sums: FloatArray,
    windows: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Sum over j of the square of ``sum_{i=j}^{j+lag-1} (x[i+2lag] - 2 x[i+lag] + x[i])``.

    `windows` are the inner sums at j = begin, and `sums` hold their squares already; what is
    returned are both at j = end.

    The inner sum moves along by one third difference a step. A step waits for the one before
    it, so each block is run as four chains side by side from zero; what the window held at
    the head of a chain is put in afterwards: sum (w + s_k)^2 = n w^2 + 2 w sum s_k + sum s_k^2.
    """
    sums, windows = sums.copy(), windows.copy()
    steps = np.empty(_BLOCK)
    for start in range(begin, min(end, angle.size), _BLOCK):
        for j in range(lags.size):
            lag = lags[j]
            count = min(_BLOCK, angle.size - 3 * lag - start)
            if count <= 0:
                continue
            first = angle[start : start + count]
            second = angle[start + lag : start + lag + count]
            third = angle[start + 2 * lag : start + 2 * lag + count]
            fourth = angle[start + 3 * lag : start + 3 * lag + count]
            for k in range(count):
                steps[k] = (fourth[k] - first[k]) - 3.0 * (third[k] - second[k])
            length = count // 4
            steps_1, steps_2, steps_3 = steps[length:], steps[2 * length :], steps[3 * length :]
            s_0, s_1, s_2, s_3 = 0.0, 0.0, 0.0, 0.0
            line_0, line_1, line_2, line_3 = 0.0, 0.0, 0.0, 0.0
            square_0, square_1, square_2, square_3 = 0.0, 0.0, 0.0, 0.0
            for k in range(length):
                s_0 += steps[k]
                s_1 += steps_1[k]
                s_2 += steps_2[k]
                s_3 += steps_3[k]
                line_0 += s_0
                line_1 += s_1
                line_2 += s_2
                line_3 += s_3
                square_0 += s_0 * s_0
                square_1 += s_1 * s_1
                square_2 += s_2 * s_2
                square_3 += s_3 * s_3
            window = windows[j]
            partial = square_0 + square_1 + square_2 + square_3
            for total, line in ((s_0, line_0), (s_1, line_1), (s_2, line_2), (s_3, line_3)):
                partial += window * (length * window + 2.0 * line)
                window += total
            for k in range(4 * length, count):
                window += steps[k]
                partial += window * window
            windows[j] = window
            sums[j] += partial
    return sums, windows


@compiled()
def sum_squared_differences_in_stretches(
    angle: FloatArray, starts: IntegerArray, lengths: IntegerArray, lags: IntegerArray, order: int
) -> FloatArray:
    """Sums of squared differences of `order` 2 or 3 that lie in one stretch each, for each lag."""
    sums = np.zeros(lags.size)
    for s in range(starts.size):
        stretch = angle[starts[s] : starts[s] + lengths[s]]
        sums = sum_squared_differences(stretch, lags, order, 0, stretch.size, sums)
    return sums


@compiled()
def sum_squared_window_differences_in_stretches(
    angle: FloatArray, starts: IntegerArray, lengths: IntegerArray, lags: IntegerArray
) -> FloatArray:
    """Sums as of `sum_squared_window_differences` over windows that lie in one stretch each."""
    total = np.zeros(lags.size)
    windows = np.zeros(lags.size)
    for s in range(starts.size):
        stretch = angle[starts[s] : starts[s] + lengths[s]]
        for j in range(lags.size):
            windows[j] = 0.0
            if 3 * lags[j] <= stretch.size:
                windows[j] = window_difference(stretch, lags[j], 0, lags[j], 0.0)
        sums, _ = sum_squared_window_differences(
            stretch, lags, 0, stretch.size, windows * windows, windows
        )
        total += sums
    return total


@compiled()
def sum_squared_differences_with_gaps(
    angle: FloatArray, lag: int, order: int, begin: int, end: int
) -> tuple[float, int]:
    """Sum and number of squared differences, begin <= i < end, that touch no missing angle (NaN).

    `order` is 2 or 3.
    """
    total = 0.0
    terms = 0
    for i in range(begin, min(end, angle.size - order * lag)):
        last = i + order * lag
        if order == 2:
            difference = (angle[last] - angle[i + lag]) - (angle[i + lag] - angle[i])
        else:
            difference = (angle[last] - angle[i]) - 3.0 * (angle[i + 2 * lag] - angle[i + lag])
        if not np.isnan(difference):
            total += difference * difference
            terms += 1
    return total, terms


@compiled(fastmath=_REORDER)
def sum_squared_arms(
    centre: FloatArray,
    ahead: FloatArray,
    behind: FloatArray,
    ends: float,
    sign_ahead: float,
    sign_behind: float,
) -> float:
    """Sum of ``(2 (ends - centre) + sign_ahead ahead + sign_behind behind)**2``.

    These are second differences with an arm beyond an end of the record. There the angle is its
    point reflection in that end, ``x[-k] = 2 x[0] - x[k]``; `ends` is the sum of those ends.
    """
    total = 0.0
    for k in range(centre.size):
        difference = 2.0 * (ends - centre[k]) + (sign_ahead * ahead[k] + sign_behind * behind[k])
        total += difference * difference
    return total


@compiled(fastmath=_REORDER)
def sum_modified_total_terms(angle: FloatArray, lag: int, stride: int) -> float:
    """Sum over windows of 3 lag samples of the mean square of the modified total term.

    Each window loses its half-average slope, is extended on both sides by its mirror image,
    and gives 6 lag squared second differences of lag-averages. The extension repeats every
    6 lag samples, so its running sum P from a zero mean is odd about both window ends, the
    summed second difference is a third difference of P, and it is symmetric about two points
    half a period apart: half a period is enough.
    """
    width = 3 * lag
    half = width // 2
    reach = width // 2  # j runs over -reach..reach
    slope_span = 0.5 * (width + width % 2)
    running = np.empty(2 * width + 1)  # P at -reach .. width + reach
    total = 0.0
    for start in range(0, angle.size - width + 1, stride):
        window = angle[start : start + width]
        origin = window[half]
        first_mean = 0.0
        for i in range(half):
            first_mean += window[i] - origin
        last_mean = 0.0
        for i in range(width - half, width):
            last_mean += window[i] - origin
        slope = (last_mean - first_mean) / (half * slope_span)
        mean = 0.0
        for i in range(width):
            mean += (window[i] - origin) - slope * i
        mean /= width
        inside = running[reach : reach + width + 1]
        summed = 0.0
        inside[0] = 0.0
        for i in range(width):
            summed += (window[i] - origin) - slope * i - mean
            inside[i + 1] = summed
        for k in range(1, reach + 1):
            running[reach - k] = -inside[k]
            running[reach + width + k] = -inside[width - k]
        squares = 0.0
        second, third, fourth = running[lag:], running[2 * lag :], running[3 * lag :]
        for j in range(2 * reach + 1):
            difference = (fourth[j] - running[j]) - 3.0 * (third[j] - second[j])
            squares += difference * difference
        if width % 2 == 0:
            # The two points of symmetry themselves occur once in the period, the rest twice.
            for j in (0, 2 * reach):
                difference = (fourth[j] - running[j]) - 3.0 * (third[j] - second[j])
                squares -= 0.5 * difference * difference
        total += squares / width
    return total


@compiled(fastmath=_REORDER)
def sum_theo1_terms(angle: FloatArray, mirrored: FloatArray, span: int, stride: int) -> float:
    """Sum over starts i of ``sum_v ((x[i] - x[i+v]) + (x[i+span] - x[i+span-v]))**2 / v``.

    v runs from 1 to span/2 and is m/2 - delta of the definition. `mirrored` is the angle from the
    last to the first: read forwards, the loop runs in vector lanes.
    """
    half = span // 2
    weights = np.empty(half)
    for v in range(half):
        weights[v] = 1.0 / (v + 1)
    total = 0.0
    for i in range(0, angle.size - span, stride):
        ends = angle[i] + angle[i + span]
        rising = angle[i + 1 : i + 1 + half]
        begin = angle.size - i - span
        falling = mirrored[begin : begin + half]
        partial = 0.0
        for v in range(half):
            difference = ends - (rising[v] + falling[v])
            partial += weights[v] * difference * difference
        total += partial
    return total
