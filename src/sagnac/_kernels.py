"""Every compiled loop: arrays in, arrays out; no validation, no files, nothing of ours imported."""

# Compiled loops take their arrays by position.
# ruff: noqa: PLR0917

import math

import numba
import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntegerArray = NDArray[np.int64]
BooleanArray = NDArray[np.bool_]
ComplexArray = NDArray[np.complex128]

# --- stability: sums of squared differences of the accumulated angle -----------------------

# Sums may be reordered into vector lanes, but a NaN stays a NaN and no division is guessed.
_REORDER = {"reassoc", "contract"}
_BLOCK = 4096


@numba.njit(cache=True)
def accumulate_deviations(
    values: FloatArray, mean: float, total: float, angle: FloatArray
) -> float:
    """Running sum of ``values - mean`` from `total` on into `angle`, (samples,); the last of it."""
    for i in range(values.size):
        total += values[i] - mean
        angle[i] = total
    return total


@numba.njit(cache=True)
def subtract_ramp(
    values: FloatArray, slope: float, offset: float, first: int, angle: FloatArray
) -> float:
    """``values[i] - slope * (first + i) - offset`` in that order into `angle`; the last of it."""
    for i in range(values.size):
        angle[i] = (values[i] - slope * (first + i)) - offset
    return float(angle[values.size - 1])


@numba.njit(cache=True, fastmath=_REORDER)
def sum_squared_second_differences(
    angle: FloatArray, lags: IntegerArray, begin: int, end: int, sums: FloatArray
) -> FloatArray:
    """`sums`, for each lag, and ``(x[i + 2 lag] - 2 x[i + lag] + x[i])**2``, begin <= i < end.

    Blocks of starts go through all lags while they are in cache, and a fresh sum for each
    block keeps the rounding error from growing with the record. `begin` and `end`, where it is
    not that of the record, are multiples of a block: then the parts add up to the last bit.
    """
    sums = sums.copy()
    for start in range(begin, min(end, angle.size), _BLOCK):
        for j in range(lags.size):
            lag = lags[j]
            count = min(_BLOCK, angle.size - 2 * lag - start)
            if count <= 0:
                continue
            # Slices counted from zero let the loop run in vector lanes.
            first = angle[start : start + count]
            middle = angle[start + lag : start + lag + count]
            last = angle[start + 2 * lag : start + 2 * lag + count]
            partial = 0.0
            for k in range(count):
                difference = (last[k] - middle[k]) - (middle[k] - first[k])
                partial += difference * difference
            sums[j] += partial
    return sums


@numba.njit(cache=True, fastmath=_REORDER)
def sum_squared_third_differences(
    angle: FloatArray, lags: IntegerArray, begin: int, end: int, sums: FloatArray
) -> FloatArray:
    """As `sum_squared_second_differences`, of ``x[i+3 lag] - 3 x[i+2 lag] + 3 x[i+lag] - x[i]``."""
    sums = sums.copy()
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
            partial = 0.0
            for k in range(count):
                difference = (fourth[k] - first[k]) - 3.0 * (third[k] - second[k])
                partial += difference * difference
            sums[j] += partial
    return sums


@numba.njit(cache=True)
def window_difference(angle: FloatArray, lag: int, start: int, stop: int, window: float) -> float:
    """`window` and ``x[i + 2 lag] - 2 x[i + lag] + x[i]``, start <= i < stop, one by one."""
    for i in range(start, stop):
        window += (angle[i + 2 * lag] - angle[i + lag]) - (angle[i + lag] - angle[i])
    return window


@numba.njit(cache=True, fastmath=_REORDER)
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


@numba.njit(cache=True)
def sum_squared_differences_in_stretches(
    angle: FloatArray, starts: IntegerArray, lengths: IntegerArray, lags: IntegerArray, order: int
) -> FloatArray:
    """Sums of squared differences of `order` 2 or 3 that lie in one stretch each, for each lag."""
    sums = np.zeros(lags.size)
    for s in range(starts.size):
        stretch = angle[starts[s] : starts[s] + lengths[s]]
        if order == 2:
            sums = sum_squared_second_differences(stretch, lags, 0, stretch.size, sums)
        else:
            sums = sum_squared_third_differences(stretch, lags, 0, stretch.size, sums)
    return sums


@numba.njit(cache=True)
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


@numba.njit(cache=True)
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


@numba.njit(cache=True, fastmath=_REORDER)
def sum_squared_arms(
    centre: FloatArray,
    ahead: FloatArray,
    behind: FloatArray,
    ends: float,
    sign_ahead: float,
    sign_behind: float,
) -> float:
    """Sum of ``(2 (ends - centre) + sign_ahead ahead + sign_behind behind)**2``.

    A second difference an arm of which lies beyond an end of the record, where the angle is its
    point reflection in that end, ``x[-k] = 2 x[0] - x[k]``; `ends` are the ends reflected in.
    """
    total = 0.0
    for k in range(centre.size):
        difference = 2.0 * (ends - centre[k]) + (sign_ahead * ahead[k] + sign_behind * behind[k])
        total += difference * difference
    return total


@numba.njit(cache=True, fastmath=_REORDER)
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


@numba.njit(cache=True, fastmath=_REORDER)
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


@numba.njit(cache=True)
def lag_one_order(
    angle: FloatArray, starts: IntegerArray, counts: IntegerArray, cluster: int, maximum_order: int
) -> float:
    """Differences needed plus fractional order, from pooled lag-1 autocorrelation.

    Stretches begin at `starts` and hold `counts` samples `cluster` apart. Each loses its own
    parabola; the whole is differenced until ``r1 / (1 + r1) < 1/4``. NaN for a constant.
    """
    longest = 0
    for b in range(starts.size):
        longest = max(longest, counts[b])
    stretches = np.empty((starts.size, longest))
    for b in range(starts.size):
        n = counts[b]
        row = stretches[b]
        centre = 0.5 * (n - 1)
        curvature_centre = (n * n - 1.0) / 12.0
        for k in range(n):
            row[k] = angle[starts[b] + k * cluster] - angle[starts[b]]
        constant, ramp, parabola, ramp_norm, parabola_norm = 0.0, 0.0, 0.0, 0.0, 0.0
        for k in range(n):
            t = k - centre
            q = t * t - curvature_centre
            constant += row[k]
            ramp += t * row[k]
            parabola += q * row[k]
            ramp_norm += t * t
            parabola_norm += q * q
        constant /= n
        ramp /= ramp_norm
        parabola /= parabola_norm
        for k in range(n):
            t = k - centre
            row[k] -= constant + ramp * t + parabola * (t * t - curvature_centre)
    mean_count = float(counts.mean())
    for order in range(maximum_order + 1):
        product = 0.0
        square = 0.0
        for b in range(starts.size):
            n = counts[b] - order
            row = stretches[b]
            mean = 0.0
            for k in range(n):
                mean += row[k]
            mean /= n
            for k in range(n - 1):
                product += (row[k] - mean) * (row[k + 1] - mean)
                square += (row[k] - mean) ** 2
            square += (row[n - 1] - mean) ** 2
        if square == 0.0:
            return np.nan
        # What is left of the parabola's three parameters pulls the correlation down.
        correlation = product / square + max(3 - order, 1) / mean_count
        fraction = correlation / (1.0 + correlation)
        if fraction < 0.25 or order == maximum_order:
            return order + fraction
        for b in range(starts.size):
            row = stretches[b]
            for k in range(counts[b] - order - 1):
                row[k] = row[k + 1] - row[k]
    return np.nan


# --- stability: Greenhall-Riley equivalent degrees of freedom ------------------------------


@numba.njit(cache=True)
def _power_law_structure(t: float, alpha: int) -> float:
    """s_w(t): generalized autocovariance of the continuous angle noise, up to a factor."""
    t = abs(t)
    if t == 0.0:
        return 0.0
    power = t ** (3 - alpha)
    if alpha in (2, 0, -2, -4):
        return -power if alpha in (2, -2) else power
    return power * math.log(t) if alpha in (1, -3) else -power * math.log(t)


@numba.njit(cache=True)
def _filtered_structure(t: float, filter_factor: float, alpha: int) -> float:
    """s_x(t) = F^2 (2 s_w(t) - s_w(t - 1/F) - s_w(t + 1/F)).

    Away from zero the second difference is written out, so that a cluster of a million
    samples costs no digits. F may be infinite for alpha <= 0: the second derivative.
    """
    t = abs(t)
    h = 1.0 / filter_factor
    if t == 0.0 and h == 0.0:
        return 0.0
    if t < h:
        return (
            2.0 * _power_law_structure(t, alpha)
            - _power_law_structure(t - h, alpha)
            - _power_law_structure(t + h, alpha)
        ) / (h * h)
    if alpha == 2:
        return 0.0
    if alpha == 0:
        return -6.0 * t
    if alpha == -2:
        return 20.0 * t**3 + 10.0 * t * h * h
    if alpha == -4:
        return -(42.0 * t**5 + 70.0 * t**3 * h**2 + 14.0 * t * h**4)
    u = h / t
    power = 3 - alpha
    if alpha == 1:
        even = 2.0
    elif alpha == -1:
        even = 12.0 + 2.0 * u**2
    else:
        even = 30.0 + 30.0 * u**2 + 2.0 * u**4
    if u < 1e-4:
        odd = 2.0 * power - 1.0
    elif u < 1.0:
        odd = (1.0 + u) ** power * math.log1p(u) + (1.0 - u) ** power * math.log1p(-u)
        odd /= u * u
    else:
        odd = 2.0**power * math.log(2.0)
    value = t ** (power - 2) * (even * math.log(t) + odd)
    return value if alpha == -1 else -value


@numba.njit(cache=True)
def difference_covariance(t: float, filter_factor: float, alpha: int, order: int) -> float:
    """s_z(t): covariance of the order-th differences, from binomials of s_x."""
    if order == 2:
        return (
            6.0 * _filtered_structure(t, filter_factor, alpha)
            - 4.0
            * (
                _filtered_structure(t - 1.0, filter_factor, alpha)
                + _filtered_structure(t + 1.0, filter_factor, alpha)
            )
            + _filtered_structure(t - 2.0, filter_factor, alpha)
            + _filtered_structure(t + 2.0, filter_factor, alpha)
        )
    return (
        20.0 * _filtered_structure(t, filter_factor, alpha)
        - 15.0
        * (
            _filtered_structure(t - 1.0, filter_factor, alpha)
            + _filtered_structure(t + 1.0, filter_factor, alpha)
        )
        + 6.0
        * (
            _filtered_structure(t - 2.0, filter_factor, alpha)
            + _filtered_structure(t + 2.0, filter_factor, alpha)
        )
        - _filtered_structure(t - 3.0, filter_factor, alpha)
        - _filtered_structure(t + 3.0, filter_factor, alpha)
    )


@numba.njit(cache=True)
def inverse_degrees_of_freedom(
    terms: int,
    steps: int,
    filter_factor: float,
    alpha: int,
    order: int,
    nodes: FloatArray,
    weights: FloatArray,
) -> float:
    """1/edf of a mean of `terms` squared differences, `steps` of them to one cluster.

    ``(1/M) (1 + 2 sum_j (1 - j/M) (s_z(j/S)/s_z(0))**2)`` over j < min(M, (d+1) S). Between
    whole clusters, where s_z is smooth, far lags are summed by Gauss-Legendre panels (`nodes`
    and `weights` on [-1, 1]) that double in width away from each whole cluster.
    """
    direct = 64
    lags = min(terms, (order + 1) * steps)
    total = 0.0
    for knot in range(0, lags, steps):
        left = knot
        right = min(knot + steps, lags)  # summed over left <= j < right
        middle = (left + right) // 2
        for side in range(2):
            origin = left if side == 0 else right - 1
            length = middle - left if side == 0 else right - middle
            sign = 1 if side == 0 else -1
            near = min(direct, length)
            for k in range(near):
                j = origin + sign * k
                if j > 0:
                    share = difference_covariance(j / steps, filter_factor, alpha, order)
                    total += (1.0 - j / terms) * share * share
            begin = near
            while begin < length:
                end = min(2 * begin, length)
                # The sum over whole j from begin to end - 1 is the integral half a step wider.
                half_width = 0.5 * (end - begin)
                centre = 0.5 * (begin + end) - 0.5
                for node in range(nodes.size):
                    j = origin + sign * (centre + half_width * nodes[node])
                    share = difference_covariance(j / steps, filter_factor, alpha, order)
                    total += weights[node] * half_width * (1.0 - j / terms) * share * share
                begin = end
    variance = difference_covariance(0.0, filter_factor, alpha, order)
    return (1.0 + 2.0 * total / (variance * variance)) / terms


# --- tones and harmonics -------------------------------------------------------------------


@numba.njit(cache=True, nogil=True, fastmath=True)
def paired_sums(
    rates: FloatArray,
    in_angle: BooleanArray,
    first: IntegerArray,
    second: IntegerArray,
    angle: FloatArray,
    step: FloatArray,
    lag: FloatArray,
    count: FloatArray,
    middle: float,
    span: float,
    turn: float,
) -> tuple[ComplexArray, ComplexArray]:
    """Sums over blocks of the increments of two phasors and of their derivatives.

    The phase of component j is ``rates[j]`` times the table angle where ``in_angle[j]``, else
    times the sample number from mid-record (`lag`). It is taken to be straight over a block of
    `count` steps, which then sum to ``sin(count x / 2) / sin(x / 2)``, x the difference of both
    phases a step. A derivative is the phasor times ``(angle - middle) / span``, or times
    ``turn * lag``.

    Returns
    -------
    straight, mirrored
        (pairs, 4): `first` with the conjugate of `second`, and `first` with `second`: both plain,
        the first's derivative, the second's derivative, both derivatives.
    """
    straight = np.zeros((first.size, 4), dtype=np.complex128)
    mirrored = np.zeros((first.size, 4), dtype=np.complex128)
    phases = np.empty(2)
    steps = np.empty(2)
    lags = np.empty(2)
    sizes = np.empty(2)
    slopes = np.empty(2)
    for pair in range(first.size):
        members = (first[pair], second[pair])
        for b in range(angle.size):
            for side in range(2):
                rate = rates[members[side]]
                if in_angle[members[side]]:
                    phases[side] = rate * angle[b]
                    steps[side] = rate * step[b]
                    lags[side] = (angle[b] - middle) / span
                    slope = step[b] / span
                else:
                    phases[side] = rate * lag[b]
                    steps[side] = rate
                    lags[side] = turn * lag[b]
                    slope = turn
                sizes[side] = 2.0 * np.sin(0.5 * steps[side])
                slopes[side] = slope * np.cos(0.5 * steps[side])
            product = sizes[0] * sizes[1]
            for sign in (-1.0, 1.0):
                half = 0.5 * (steps[0] + sign * steps[1])
                if abs(np.sin(half)) < 1e-9:
                    weight = count[b] * np.cos(count[b] * half) / np.cos(half)
                else:
                    weight = np.sin(count[b] * half) / np.sin(half)
                phasor = weight * np.exp(1j * (phases[0] + sign * phases[1]))
                # (1j size lag + slope) of the first times that of the second, or its conjugate.
                target = straight if sign < 0.0 else mirrored
                target[pair, 0] -= sign * product * phasor
                target[pair, 1] += phasor * (
                    -sign * product * lags[0] + sign * 1j * slopes[0] * sizes[1]
                )
                target[pair, 2] += phasor * (-sign * product * lags[1] + 1j * sizes[0] * slopes[1])
                target[pair, 3] += phasor * (
                    -sign * product * lags[0] * lags[1]
                    + slopes[0] * slopes[1]
                    + 1j * (lags[0] * sizes[0] * slopes[1] + sign * lags[1] * sizes[1] * slopes[0])
                )
    return straight, mirrored


MIX_BLOCK = 50


@numba.njit(cache=True, nogil=True, fastmath=True)
def spread(
    table: FloatArray, steps: FloatArray, low: float, scale: float, grid: FloatArray
) -> None:
    """Add each step times the table's own to `grid`, over even angles about the middle of both.

    Point j of the grid is the angle ``low + (j - 1) / scale``. A cubic B-spline shares a product
    out: at x cycles a point its transform is ``sinc(x)^4``.
    """
    for n in range(steps.size):
        weight = steps[n] * (table[n + 1] - table[n]) / 6.0
        place = (0.5 * (table[n] + table[n + 1]) - low) * scale
        at = int(place)
        t = place - at
        u = 1.0 - t
        grid[at] += weight * u * u * u
        grid[at + 1] += weight * (4.0 - 3.0 * t * t * (1.0 + u))
        grid[at + 2] += weight * (4.0 - 3.0 * u * u * (1.0 + t))
        grid[at + 3] += weight * t * t * t


@numba.njit(cache=True, nogil=True, fastmath=True)
def mixed_down(values: FloatArray, frequency: float, center: float) -> ComplexArray:
    """Means over blocks of ``values * exp(-2j pi frequency (n - center))``."""
    blocks = values.size // MIX_BLOCK
    mixed = np.empty(blocks, dtype=np.complex128)
    fine_cos = np.empty(MIX_BLOCK)
    fine_sin = np.empty(MIX_BLOCK)
    for b in range(MIX_BLOCK):
        fine_cos[b] = np.cos(2.0 * np.pi * frequency * b)
        fine_sin[b] = np.sin(2.0 * np.pi * frequency * b)
    for a in range(blocks):
        real = 0.0
        imaginary = 0.0
        for b in range(MIX_BLOCK):
            value = values[a * MIX_BLOCK + b]
            real += value * fine_cos[b]
            imaginary -= value * fine_sin[b]
        turns = frequency * (a * MIX_BLOCK - center)
        turns -= np.floor(turns)
        mixed[a] = (real + 1j * imaginary) * np.exp(-2j * np.pi * turns) / MIX_BLOCK
    return mixed


@numba.njit(cache=True, nogil=True)
def spline_normal(block: IntegerArray, rows: ComplexArray, blocks: int) -> ComplexArray:
    """Normal matrix of cubic splines, (4, blocks + 3) upper bands; the last is the diagonal.

    Value n is a sum of ``rows[n, p]`` times coefficient ``block[n] + p``, p = 0 ... 3.
    """
    band = np.zeros((4, blocks + 3), dtype=np.complex128)
    for n in range(block.size):
        for p in range(4):
            for q in range(p, 4):
                band[3 + p - q, block[n] + q] += np.conj(rows[n, p]) * rows[n, q]
    return band


@numba.njit(cache=True, nogil=True)
def spline_products(
    block: IntegerArray, rows: ComplexArray, weights: ComplexArray, blocks: int
) -> ComplexArray:
    """(blocks + 3,) inner products of each column of those rows with `weights`."""
    products = np.zeros(blocks + 3, dtype=np.complex128)
    for n in range(block.size):
        for p in range(4):
            products[block[n] + p] += np.conj(rows[n, p]) * weights[n]
    return products


@numba.njit(cache=True, fastmath=True, nogil=True)
def drifting_tone(
    start: int,
    frequency: float,
    center: float,
    scale: float,
    envelope: ComplexArray,
    phase: FloatArray,
    out: FloatArray,
) -> None:
    """Fill `out` with ``Re[a(n) exp(i phi(n)) exp(2j pi frequency (n - center))]`` from `start`.

    `envelope` and `phase` are (4, blocks) polynomials of a and phi, highest power first, in
    blocks from the start of each; there are `scale` blocks a sample.
    """
    blocks = envelope.shape[1]
    for n in range(out.size):
        place = (start + n) * scale
        k = min(int(place), blocks - 1)
        x = place - k
        a = envelope[3, k] + x * (envelope[2, k] + x * (envelope[1, k] + x * envelope[0, k]))
        phi = phase[3, k] + x * (phase[2, k] + x * (phase[1, k] + x * phase[0, k]))
        turns = frequency * (start + n - center)
        turns -= np.floor(turns)
        phi += 2.0 * np.pi * turns
        out[n] = a.real * np.cos(phi) - a.imag * np.sin(phi)


# --- simulated rig ---------------------------------------------------------------------------


@numba.njit(cache=True)
def rig_earth_in_table(
    alpha: float,
    earth: FloatArray,
    order: FloatArray,
    amplitude: FloatArray,
    phase: FloatArray,
) -> tuple[float, float, float]:
    """Earth rate along b when the shaft is tilted by the wobble at this angle."""
    tilt_x = 0.0
    tilt_y = 0.0
    for j in range(order.size):
        tilt_x += amplitude[j] * np.cos(order[j] * alpha + phase[j])
        tilt_y += amplitude[j] * np.sin(order[j] * alpha + phase[j])
    first = earth[0] - tilt_y * earth[2]
    second = earth[1] + tilt_x * earth[2]
    third = earth[2] - tilt_x * earth[1] + tilt_y * earth[0]
    cosine = np.cos(alpha)
    sine = np.sin(alpha)
    return cosine * first + sine * second, cosine * second - sine * first, third


@numba.njit(cache=True)
def rig_table_angle(
    drive: float,
    order: FloatArray,
    fraction: FloatArray,
    phase: FloatArray,
) -> float:
    """Table angle at a drive angle: ripple of the rate at orders of the drive."""
    angle = drive
    for j in range(order.size):
        angle += fraction[j] / order[j] * np.sin(order[j] * drive + phase[j])
    return angle


@numba.njit(cache=True)
def rig_motion(
    drive: FloatArray,
    rate: FloatArray,
    step: float,
    substeps: int,
    ripple_order: FloatArray,
    ripple_fraction: FloatArray,
    ripple_phase: FloatArray,
    earth: FloatArray,
    wobble_order: FloatArray,
    wobble_amplitude: FloatArray,
    wobble_phase: FloatArray,
    state: FloatArray,
    alpha: FloatArray,
    turned: FloatArray,
) -> None:
    """Integrate the rate along b over the nodes; keep every `substeps`-th.

    `drive` and `rate` are node values after each step; between nodes the drive is the
    cubic through both ends' angles and rates, and each integral is Simpson's. `state`
    carries drive, rate and integrand of the last node and the three integrals.
    `turned[k]` is the Earth's part of the angle along b, with the wobble's in 0 and 1.
    """
    for n in range(drive.size):
        middle_drive = 0.5 * (state[0] + drive[n]) + 0.125 * step * (state[1] - rate[n])
        middle = rig_table_angle(middle_drive, ripple_order, ripple_fraction, ripple_phase)
        end = rig_table_angle(drive[n], ripple_order, ripple_fraction, ripple_phase)
        middle_1, middle_2, middle_3 = rig_earth_in_table(
            middle, earth, wobble_order, wobble_amplitude, wobble_phase
        )
        end_1, end_2, end_3 = rig_earth_in_table(
            end, earth, wobble_order, wobble_amplitude, wobble_phase
        )
        state[5] += step / 6.0 * (state[2] + 4.0 * middle_1 + end_1)
        state[6] += step / 6.0 * (state[3] + 4.0 * middle_2 + end_2)
        state[7] += step / 6.0 * (state[4] + 4.0 * middle_3 + end_3)
        state[0] = drive[n]
        state[1] = rate[n]
        state[2] = end_1
        state[3] = end_2
        state[4] = end_3
        if (n + 1) % substeps == 0:
            k = n // substeps
            alpha[k] = end
            turned[0, k] = state[5]
            turned[1, k] = state[6]
            turned[2, k] = state[7]
            # The shaft's own tilting rate seen from the turning table, in closed form:
            # the integral of i m a exp(i((m - 1) alpha + p)) over alpha.
            for j in range(wobble_order.size):
                relative = wobble_order[j] - 1.0
                scale = wobble_order[j] * wobble_amplitude[j]
                if relative == 0.0:
                    turned[0, k] -= scale * end * np.sin(wobble_phase[j])
                    turned[1, k] += scale * end * np.cos(wobble_phase[j])
                else:
                    argument = relative * end + wobble_phase[j]
                    turned[0, k] += scale / relative * np.cos(argument)
                    turned[1, k] += scale / relative * np.sin(argument)


@numba.njit(cache=True)
def rig_jitter(
    normals: FloatArray,
    transition: FloatArray,
    spread: FloatArray,
    state: FloatArray,
    angle: FloatArray,
    rate: FloatArray,
) -> None:
    """Position-servo jitter: a damped oscillator driven by white noise, stepped exactly."""
    for n in range(normals.shape[0]):
        x = transition[0, 0] * state[0] + transition[0, 1] * state[1]
        v = transition[1, 0] * state[0] + transition[1, 1] * state[1]
        state[0] = x + spread[0, 0] * normals[n, 0]
        state[1] = v + spread[1, 0] * normals[n, 0] + spread[1, 1] * normals[n, 1]
        angle[n] += state[0]
        rate[n] += state[1]


@numba.njit(cache=True)
def rig_wander(
    normals: FloatArray,
    decay: float,
    spread: float,
    scale: FloatArray,
    step: float,
    state: FloatArray,
    angle: FloatArray,
    rate: FloatArray,
) -> None:
    """Slow relative wander of the rate: first-order Markov, integrated by trapezoids."""
    for n in range(normals.size):
        state[0] = decay * state[0] + spread * normals[n]
        now = scale[n] * state[0]
        state[2] += 0.5 * step * (state[1] + now)
        state[1] = now
        angle[n] += state[2]
        rate[n] += now


@numba.njit(cache=True)
def rig_markov(
    normals: FloatArray,
    decay: FloatArray,
    spread: FloatArray,
    weight: float,
    state: FloatArray,
    out: FloatArray,
) -> None:
    """Sum of independent first-order Markov processes plus a random walk (the last column)."""
    terms = decay.size
    for n in range(out.size):
        total = 0.0
        for j in range(terms):
            state[j] = decay[j] * state[j] + spread[j] * normals[n, j]
            total += state[j]
        state[terms] += weight * normals[n, terms]
        out[n] += total + state[terms]


@numba.njit(cache=True)
def rig_harmonics(
    alpha: FloatArray,
    orders: FloatArray,
    in_phase: FloatArray,
    quadrature: FloatArray,
    out: FloatArray,
) -> None:
    """Add ``in_phase * cos(k alpha) + quadrature * sin(k alpha)`` per channel, ascending k."""
    length = 1024
    cosine = np.empty(length)
    sine = np.empty(length)
    real = np.empty(length)
    imaginary = np.empty(length)
    for start in range(0, alpha.size, length):
        count = min(length, alpha.size - start)
        for n in range(count):
            cosine[n] = np.cos(alpha[start + n])
            sine[n] = np.sin(alpha[start + n])
            real[n] = 1.0
            imaginary[n] = 0.0
        power = 0
        for j in range(orders.size):
            whole = orders[j] == np.floor(orders[j])
            if whole:
                while power < orders[j]:
                    power += 1
                    for n in range(count):
                        product = real[n] * cosine[n] - imaginary[n] * sine[n]
                        imaginary[n] = real[n] * sine[n] + imaginary[n] * cosine[n]
                        real[n] = product
            for c in range(out.shape[0]):
                a = in_phase[c, j]
                b = quadrature[c, j]
                if whole:
                    for n in range(count):
                        out[c, start + n] += a * real[n] + b * imaginary[n]
                else:
                    for n in range(count):
                        argument = orders[j] * alpha[start + n]
                        out[c, start + n] += a * np.cos(argument) + b * np.sin(argument)


@numba.njit(cache=True)
def rig_time_lines(
    first: int,
    cycles_per_sample: FloatArray,
    in_phase: FloatArray,
    quadrature: FloatArray,
    out: FloatArray,
) -> None:
    """Add ``in_phase * cos(2 pi f n) + quadrature * sin(2 pi f n)`` per channel."""
    length = 256
    for j in range(cycles_per_sample.size):
        rotate_real = np.cos(2.0 * np.pi * cycles_per_sample[j])
        rotate_imaginary = np.sin(2.0 * np.pi * cycles_per_sample[j])
        for start in range(0, out.shape[1], length):
            cycles = cycles_per_sample[j] * (first + start)
            cycles -= np.floor(cycles)
            real = np.cos(2.0 * np.pi * cycles)
            imaginary = np.sin(2.0 * np.pi * cycles)
            for n in range(start, min(start + length, out.shape[1])):
                for c in range(out.shape[0]):
                    out[c, n] += in_phase[c, j] * real + quadrature[c, j] * imaginary
                product = real * rotate_real - imaginary * rotate_imaginary
                imaginary = real * rotate_imaginary + imaginary * rotate_real
                real = product


@numba.njit(cache=True)
def rig_null_pulse(
    alpha: FloatArray,
    errors: FloatArray,
    margin: float,
    state: FloatArray,
    pulse: BooleanArray,
) -> None:
    """Mark the first sample past each null, each passage with its own error.

    `state`: turns completed, passages so far (both whole numbers), the null just passed
    (NaN once the table is `margin` away from it, so that jitter fires no null twice).
    """
    turn = 2.0 * np.pi
    for n in range(alpha.size):
        pulse[n] = False
        if abs(alpha[n] - state[2]) <= margin:
            continue
        error = errors[int(state[1]) % errors.size]
        if alpha[n] >= turn * (state[0] + 1.0) + error:
            state[0] += 1.0
            state[1] += 1.0
            state[2] = turn * state[0]
            pulse[n] = True
        elif alpha[n] < turn * state[0] + error:
            state[2] = turn * state[0]
            state[0] -= 1.0
            state[1] += 1.0
            pulse[n] = True
        else:
            state[2] = np.nan


@numba.njit(cache=True)
def rig_readout(
    true: FloatArray,
    noise: FloatArray,
    drift: FloatArray,
    step: float,
    quantum: float,
    state: FloatArray,
    out: FloatArray,
) -> None:
    """Add true angle and walk to the disturbances in `out`, and round to the readout step.

    `noise` and `drift` are a sample's random angle and its slow rate; `state` the walk.
    """
    for n in range(true.size):
        state[0] += noise[n] + drift[n] * step
        angle = true[n] + state[0] + out[n]
        if quantum > 0.0:
            angle = np.rint(angle / quantum) * quantum
        out[n] = angle


# --- ring laser ------------------------------------------------------------------------------


@numba.njit(cache=True)
def lock_in_steps(
    lock_in: float,
    rate: float,
    peaks: FloatArray,
    steps: int,
    halves: int,
    step: float,
    strength: FloatArray,
    normals: FloatArray,
    state: FloatArray,
    excess: FloatArray,
) -> None:
    """Runge-Kutta steps of the lock-in equation for the phase in excess of the input's.

    Each entry of `peaks` is one half cycle of dither (or, at zero, just a stretch) of
    `steps` steps; `excess` is kept every `halves` of them. `state`: excess, input phase at
    the start of the stretch, backscatter phase.
    """
    bend = np.pi / (steps * step)
    for k in range(peaks.size):
        swing = peaks[k] / bend
        for n in range(steps):
            time = n * step
            start = state[1] + state[2] + rate * time + swing * (1.0 - np.cos(bend * time))
            time += 0.5 * step
            middle = state[1] + state[2] + rate * time + swing * (1.0 - np.cos(bend * time))
            time += 0.5 * step
            end = state[1] + state[2] + rate * time + swing * (1.0 - np.cos(bend * time))
            slope_1 = -lock_in * np.sin(start + state[0])
            slope_2 = -lock_in * np.sin(middle + state[0] + 0.5 * step * slope_1)
            slope_3 = -lock_in * np.sin(middle + state[0] + 0.5 * step * slope_2)
            slope_4 = -lock_in * np.sin(end + state[0] + step * slope_3)
            state[0] += step / 6.0 * (slope_1 + 2.0 * slope_2 + 2.0 * slope_3 + slope_4)
            if normals.shape[0] > 0:
                state[0] += strength[0] * normals[k * steps + n, 0]
                state[2] += strength[1] * normals[k * steps + n, 1]
        # Whole turns of the input are left out: the sine keeps its digits.
        state[1] += rate * steps * step + 2.0 * swing
        state[1] -= 2.0 * np.pi * np.floor(state[1] / (2.0 * np.pi))
        if (k + 1) % halves == 0:
            excess[k // halves] = state[0]


# --- orthogonal search -------------------------------------------------------------------


@numba.njit(cache=True)
def orthogonal_products(
    sampling: ComplexArray,
    tilted: ComplexArray,
    chosen: IntegerArray,
    row: FloatArray,
    candidates: int,
) -> ComplexArray:
    """Inner products of exp(i k phase), k = 1 ... candidates, with one function.

    `sampling[k]` is the mean of exp(i k phase), `tilted[k]` of ramp * exp(i k phase), and `row`
    holds the function's coefficients on 1, ramp and the cosine and sine of each chosen k - 1.
    """
    products = np.empty(candidates, dtype=np.complex128)
    for m in range(candidates):
        products[m] = row[0] * sampling[m + 1] + row[1] * tilted[m + 1]
    for term in range(chosen.size):
        other = chosen[term]
        up = 0.5 * (row[2 + 2 * term] - 1j * row[3 + 2 * term])
        down = 0.5 * (row[2 + 2 * term] + 1j * row[3 + 2 * term])
        if up == 0.0:
            continue
        for m in range(candidates):
            products[m] += up * sampling[m + other + 2]
        for m in range(min(other, candidates)):
            products[m] += down * np.conj(sampling[other - m])
        for m in range(other, candidates):
            products[m] += down * sampling[m - other]
    return products


# --- noise: covariance of overlapped Allan variances ---------------------------------------


@numba.njit(cache=True)
def _markov_structure(t: float, correlation: float, near: bool) -> float:
    """Generalized autocovariance of the angle for a Markov rate of q_c = 1.

    -(T^3/2) (e^-x + x - 1), x = t/T; `near` takes off a parabola, which no second difference
    sees and which would cost the digits where all of x is small.
    """
    x = t / correlation
    if not near:
        return float(-0.5 * correlation**3 * (np.expm1(-x) + x))
    series = 1.0
    for k in range(18, 3, -1):
        series = 1.0 - series * x / k
    return correlation**3 * series * x * x * x / 12.0


@numba.njit(cache=True)
def _flicker_difference(t: float, step: float) -> float:
    """Second difference of ``t^2 ln|t|`` at t, t + step and t + 2 step."""
    middle = abs(t + step)
    if middle < 8.0 * step:
        total = 0.0
        for k in range(3):
            place = abs(t + k * step)
            if place > 0.0:
                total += (-2.0 if k == 1 else 1.0) * place * place * np.log(place)
        return float(total)
    # Taylor's series about the middle, which loses no digits far from zero.
    ratio = (step / middle) ** 2
    series = 0.0
    for k in range(9, 1, -1):
        series = ratio * (series + 4.0 / (2.0 * k * (2.0 * k - 1.0) * (2.0 * k - 2.0)))
    return float(step * step * (2.0 * np.log(middle) + 3.0 - series))


@numba.njit(cache=True)
def _cubic_difference(t: float, step: float) -> float:
    """Second difference of ``|t|^3`` at t, t + step and t + 2 step."""
    if t >= 0.0 or t + 2.0 * step <= 0.0:
        return float(6.0 * step * step * abs(t + step))
    return float(abs(t) ** 3 - 2.0 * abs(t + step) ** 3 + abs(t + 2.0 * step) ** 3)


@numba.njit(cache=True)
def _second_difference_covariances(
    lag: float, first: int, second: int, correlation: float, out: FloatArray
) -> None:
    """Covariance at `lag` of second angle differences over `first` and `second` samples.

    From the generalized autocovariance of the angle: a delta, -|t|/2, t^2 ln|t|/(2 pi) and
    |t|^3/12 for Q, N, B and K at one and a sample interval of one; then a Markov rate.
    """
    out[:5] = 0.0
    near = abs(lag) + 2.0 * (first + second) < correlation
    for p in range(3):
        for q in range(3):
            weight = (-2.0 if p == 1 else 1.0) * (-2.0 if q == 1 else 1.0)
            t = abs(lag + p * first - q * second)
            if t == 0.0:
                out[0] += weight
            else:
                out[1] -= weight * 0.5 * t
                if correlation > 0.0:
                    out[4] += weight * _markov_structure(t, correlation, near)
    # The shorter of the two first: of a day at 500 Hz the cube of a lag has no digits left for it.
    short, long = min(first, second), max(first, second)
    start = lag if first <= second else lag - 2.0 * second
    for p in range(3):
        weight = -2.0 if p == 1 else 1.0
        t = start - p * long if first <= second else start + p * long
        out[2] += weight * _flicker_difference(t, short) / (2.0 * np.pi)
        out[3] += weight * _cubic_difference(t, short) / 12.0


@numba.njit(cache=True)
def overlapped_covariances(
    factors: IntegerArray,
    angles: int,
    correlation: float,
    nodes: FloatArray,
    weights: FloatArray,
) -> FloatArray:
    """Covariance of overlapped Allan variances by pairs of terms, for a sample interval of one.

    ``(terms, terms, points, points)`` with the terms Q, N, B, K, a Markov rate of time
    `correlation` in samples (0: none) and the ramp R: contracted twice with the squared
    coefficients it is the covariance. All lags between two second
    differences are summed, weighted by how often the record holds them; between the lags
    where a law breaks (whole sums of the two clusters) far ones go by Gauss-Legendre panels
    (`nodes` and `weights` on [-1, 1]) that are finer towards the breaks.
    """
    points = factors.size
    out = np.zeros((6, 6, points, points))
    breaks = np.empty(27)
    panels = np.array([0.0, 0.02, 0.1, 0.3, 0.7, 0.9, 0.98, 1.0])
    covariance = np.empty(6)
    total = np.empty((6, 6))
    for i in range(points):
        for j in range(i, points):
            first, second = factors[i], factors[j]
            first_terms, second_terms = angles - 2 * first, angles - 2 * second
            lowest, highest = -(second_terms - 1.0), first_terms - 1.0
            for p in range(3):
                for q in range(3):
                    breaks[3 * p + q] = q * second - p * first
            breaks[9], breaks[10] = 0.0, first_terms - second_terms
            breaks[11], breaks[12] = lowest, highest
            count = 13
            reach = 1.0 * max(first, second)
            for k in range(7):
                breaks[count] = 2.0 * second + (2.0 ** (k + 1) - 1.0) * reach
                breaks[count + 1] = -2.0 * first - (2.0 ** (k + 1) - 1.0) * reach
                count += 2
            # 1/f dies as 1/lag^2, its square's sum as 1/lag^3: what is farther is left out.
            limit_low, limit_high = max(lowest, breaks[26]), min(highest, breaks[25])
            ordered = np.sort(np.minimum(np.maximum(breaks[:count], limit_low), limit_high))
            covariance[5] = 1.0 * first * first * second * second
            total[:] = 0.0
            for k in range(count):
                lag = ordered[k]
                if k + 1 < count and ordered[k + 1] == lag:
                    continue
                span = (ordered[k + 1] - lag - 1.0) if k + 1 < count else 0.0
                exact = span <= 64.0
                # Beyond the clusters' own span all is smooth, and the breaks double.
                tail = lag >= 2.0 * second or lag < -2.0 * first
                inner = int(span) if exact else (1 if tail else 7) * nodes.size
                for node in range(inner + 1):
                    weight = 1.0
                    if node == 0:
                        at = lag
                    elif exact:
                        at = lag + node
                    else:
                        panel, place = (node - 1) // nodes.size, (node - 1) % nodes.size
                        start, stop = panels[panel], panels[panel + 1]
                        if tail:
                            start, stop = 0.0, 1.0
                        half = 0.5 * span * (stop - start)
                        at = lag + 0.5 + span * start + half * (1.0 + nodes[place])
                        weight = half * weights[place]
                    weight *= min(first_terms, second_terms + at) - max(0.0, at)
                    _second_difference_covariances(at, first, second, correlation, covariance)
                    for a in range(6):
                        for b in range(6):
                            total[a, b] += weight * covariance[a] * covariance[b]
            total[5, 5] = 0.0  # a ramp does not vary
            scale = 0.5 / (1.0 * first * first * second * second * first_terms * second_terms)
            for a in range(6):
                for b in range(6):
                    out[a, b, i, j] = scale * total[a, b]
                    out[a, b, j, i] = scale * total[a, b]
    return out
