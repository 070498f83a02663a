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
    angle: FloatArray,
    stretches: IntegerArray,
    lags: IntegerArray,
    order: int,
    begin: int,
    end: int,
    sums: FloatArray,
) -> None:
    """Add to `sums`, for each lag, squared differences of `order` 2 or 3 from begin <= i < end.

    They are ``(x[i + 2 lag] - x[i + lag]) - (x[i + lag] - x[i])`` and
    ``(x[i + 3 lag] - x[i]) - 3 (x[i + 2 lag] - x[i + lag])``, each of angles of one stretch;
    `stretches` (stretches, 2) are the first angle of each and the first behind it.

    Blocks of starts go through all lags while they are in cache, and a fresh sum for each
    block keeps the rounding error from growing with the record.
    """
    for s in range(stretches.shape[0]):
        stop = min(end, stretches[s, 1])
        for start in range(max(begin, stretches[s, 0]), stop, _BLOCK):
            for j in range(lags.size):
                lag = lags[j]
                count = min(_BLOCK, stop - start, stretches[s, 1] - order * lag - start)
                if count <= 0:
                    continue
                # Slices counted from zero let the loop run in vector lanes.
                last = angle[start + order * lag : start + order * lag + count]
                behind = angle[start + (3 - order) * lag : start + (3 - order) * lag + count]
                inner = angle[start + (order - 1) * lag : start + (order - 1) * lag + count]
                first = angle[start + (order - 2) * lag : start + (order - 2) * lag + count]
                partial = 0.0
                if order == 2:
                    # Reading takes the time, and here are three angles to read instead of four.
                    for k in range(count):
                        difference = (last[k] - inner[k]) - (inner[k] - first[k])
                        partial += difference * difference
                else:
                    for k in range(count):
                        difference = (last[k] - behind[k]) - 3.0 * (inner[k] - first[k])
                        partial += difference * difference
                sums[j] += partial


@compiled(fastmath=_REORDER)
def sum_squared_window_differences(
    angle: FloatArray,
    stretches: IntegerArray,
    lags: IntegerArray,
    begin: int,
    end: int,
    sums: FloatArray,
    windows: FloatArray,
) -> None:
    """Add to `sums` the squares of ``sum_{i=j}^{j+lag-1} (x[i+2lag] - 2 x[i+lag] + x[i])``.

    As in `sum_squared_differences`. The inner sum moves along by one third difference a step;
    `windows` holds it for each lag at j = begin, and at j = end when all is done.

    A step waits for the one before it. So each block is run as four chains side by side from zero,
    and what the window holds at the head of a chain is put in afterwards:
    ``sum (w + s_k)^2 = n w^2 + 2 w sum s_k + sum s_k^2``.
    """
    steps = np.empty(_BLOCK)
    for s in range(stretches.shape[0]):
        opened, closed = stretches[s]
        for start in range(max(begin, opened), min(end, closed), _BLOCK):
            for j in range(lags.size):
                lag = lags[j]
                count = min(_BLOCK, end - start, closed - 3 * lag - start)
                window, partial = windows[j], 0.0
                if start == opened:
                    window = 0.0
                    for i in range(opened, opened + lag if count >= 0 else opened):
                        middle = angle[i + lag]
                        window += (angle[i + 2 * lag] - middle) - (middle - angle[i])
                    partial = window * window
                count = max(count, 0)
                # Slices counted from zero let the loop run in vector lanes.
                first, second = angle[start : start + count], angle[start + lag :]
                third, fourth = angle[start + 2 * lag :], angle[start + 3 * lag :]
                for k in range(count):
                    steps[k] = (fourth[k] - first[k]) - 3.0 * (third[k] - second[k])
                length = count // 4
                steps_1, steps_2, steps_3 = steps[length:], steps[2 * length :], steps[3 * length :]
                chain_0 = chain_1 = chain_2 = chain_3 = 0.0
                line_0 = line_1 = line_2 = line_3 = 0.0
                square_0 = square_1 = square_2 = square_3 = 0.0
                for k in range(length):
                    chain_0 += steps[k]
                    chain_1 += steps_1[k]
                    chain_2 += steps_2[k]
                    chain_3 += steps_3[k]
                    line_0 += chain_0
                    line_1 += chain_1
                    line_2 += chain_2
                    line_3 += chain_3
                    square_0 += chain_0 * chain_0
                    square_1 += chain_1 * chain_1
                    square_2 += chain_2 * chain_2
                    square_3 += chain_3 * chain_3
                partial += square_0 + square_1 + square_2 + square_3
                totals = (chain_0, line_0), (chain_1, line_1), (chain_2, line_2), (chain_3, line_3)
                for total, line in totals:
                    partial += window * (length * window + 2.0 * line)
                    window += total
                for k in range(4 * length, count):
                    window += steps[k]
                    partial += window * window
                windows[j] = window
                sums[j] += partial


@compiled(fastmath=_REORDER)
def sum_modified_total_terms(angle: FloatArray, lag: int, stride: int) -> float:
    """Sum over windows of 3 lag samples of the mean square of the modified total term.

    Each window loses its half-average slope, is extended on both sides by its mirror image, and
    gives 6 lag squared second differences of lag-averages: third differences of the running sum P
    from a zero mean, which is odd about both ends of the window.
    """
    width = 3 * lag
    half, slope_span = width // 2, 0.5 * (width + width % 2)
    running = np.empty(3 * width + 1)  # P at -width .. 2 width
    inside = running[width : 2 * width + 1]
    second, third, fourth = running[lag:], running[2 * lag :], running[3 * lag :]
    total = 0.0
    for start in range(0, angle.size - width + 1, stride):
        window = angle[start : start + width]
        origin = window[half]
        rise = mean = summed = squares = 0.0
        for i in range(half):
            rise += window[width - 1 - i] - window[i]
        slope = rise / (half * slope_span)
        for i in range(width):
            mean += (window[i] - origin - slope * i) / width
        inside[0] = 0.0
        for i in range(width):
            summed += window[i] - origin - slope * i - mean
            inside[i + 1] = summed
        for k in range(1, width + 1):
            running[width - k] = -inside[k]
            running[2 * width + k] = -inside[width - k]
        for j in range(2 * width):
            difference = (fourth[j] - running[j]) - 3.0 * (third[j] - second[j])
            squares += difference * difference
        total += squares / (2.0 * width)
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
