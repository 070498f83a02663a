"""Compiled loops of the curve fit and of the models of a spectrum: arrays in, arrays out."""

# Compiled loops take their arrays by position.
# ruff: noqa: PLR0917

import numpy as np

from sagnac.arrays import FloatArray, IntegerArray
from sagnac.kernels import compiled


@compiled()
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


@compiled()
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


@compiled()
def _cubic_difference(t: float, step: float) -> float:
    """Second difference of ``|t|^3`` at t, t + step and t + 2 step."""
    if t >= 0.0 or t + 2.0 * step <= 0.0:
        return float(6.0 * step * step * abs(t + step))
    return float(abs(t) ** 3 - 2.0 * abs(t + step) ** 3 + abs(t + 2.0 * step) ** 3)


@compiled()
def second_difference_covariances(
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
    # The shorter of the two first: the cube of a lag of a day at 500 Hz has no digits left for it.
    short, long = min(first, second), max(first, second)
    start = lag if first <= second else lag - 2.0 * second
    for p in range(3):
        weight = -2.0 if p == 1 else 1.0
        t = start - p * long if first <= second else start + p * long
        out[2] += weight * _flicker_difference(t, short) / (2.0 * np.pi)
        out[3] += weight * _cubic_difference(t, short) / 12.0


@compiled()
def lag_breaks(first: int, second: int, angles: int) -> FloatArray:
    """(27,) lags at which the covariance of two second differences, or its weight, breaks.

    Ascending, and some more than once: whole sums of the two clusters, the ends of the record,
    and beyond the clusters' own span places ever farther apart, to the last lag that counts.
    """
    first_terms, second_terms = angles - 2 * first, angles - 2 * second
    lowest, highest = -(second_terms - 1.0), first_terms - 1.0
    breaks = np.empty(27)
    for p in range(3):
        for q in range(3):
            breaks[3 * p + q] = q * second - p * first
    breaks[9], breaks[10] = 0.0, first_terms - second_terms
    breaks[11], breaks[12] = lowest, highest
    reach = 1.0 * max(first, second)
    for k in range(7):
        breaks[13 + 2 * k] = 2.0 * second + (2.0 ** (k + 1) - 1.0) * reach
        breaks[14 + 2 * k] = -2.0 * first - (2.0 ** (k + 1) - 1.0) * reach
    # 1/f dies as 1/lag^2, its square's sum as 1/lag^3: what is farther is left out.
    limit_low, limit_high = max(lowest, breaks[26]), min(highest, breaks[25])
    return np.sort(np.minimum(np.maximum(breaks, limit_low), limit_high))


@compiled()
def panel_point(
    number: int, lag: float, span: float, smooth: bool, nodes: FloatArray, weights: FloatArray
) -> tuple[float, float]:
    """Lag and weight of a Gauss-Legendre point of the `span` lags after the break at `lag`.

    Points are counted through seven panels that are finer towards the breaks at both ends, or
    through one where all is `smooth`.
    """
    if smooth:
        panels = np.array([0.0, 1.0])
    else:
        panels = np.array([0.0, 0.02, 0.1, 0.3, 0.7, 0.9, 0.98, 1.0])
    panel, place = number // nodes.size, number % nodes.size
    start, stop = panels[panel], panels[panel + 1]
    half = 0.5 * span * (stop - start)
    return lag + 0.5 + span * start + half * (1.0 + nodes[place]), half * weights[place]


@compiled()
def add_products(
    lag: float,
    weight: float,
    first: int,
    second: int,
    angles: int,
    correlation: float,
    covariance: FloatArray,
    total: FloatArray,
) -> None:
    """Products of the terms' covariances at `lag`, as often as the record holds it, to `total`.

    `covariance` (6,) holds the ramp in its last place; its others are written over.
    """
    first_terms, second_terms = angles - 2 * first, angles - 2 * second
    weight *= min(first_terms, second_terms + lag) - max(0.0, lag)
    second_difference_covariances(lag, first, second, correlation, covariance)
    for a in range(6):
        for b in range(6):
            total[a, b] += weight * covariance[a] * covariance[b]


@compiled()
def summed_products(
    first: int,
    second: int,
    angles: int,
    correlation: float,
    nodes: FloatArray,
    weights: FloatArray,
) -> FloatArray:
    """(6, 6) sum over all lags of products of the covariances of two second differences.

    The terms are Q, N, B, K, a Markov rate and the ramp. Between breaks up to 64 lags are
    summed one by one; more go by Gauss-Legendre panels (`nodes` and `weights` on [-1, 1]).
    """
    ordered = lag_breaks(first, second, angles)
    covariance = np.empty(6)
    covariance[5] = 1.0 * first * first * second * second
    total = np.zeros((6, 6))
    for k in range(ordered.size):
        lag = ordered[k]
        last = k + 1 == ordered.size
        if not last and ordered[k + 1] == lag:
            continue
        add_products(lag, 1.0, first, second, angles, correlation, covariance, total)
        span = 0.0 if last else ordered[k + 1] - lag - 1.0
        if span <= 64.0:
            for step in range(1, int(span) + 1):
                add_products(lag + step, 1.0, first, second, angles, correlation, covariance, total)
            continue
        # Beyond the clusters' own span all is smooth, and the breaks double.
        smooth = lag >= 2.0 * second or lag < -2.0 * first
        for number in range((1 if smooth else 7) * nodes.size):
            place, weight = panel_point(number, lag, span, smooth, nodes, weights)
            add_products(place, weight, first, second, angles, correlation, covariance, total)
    total[5, 5] = 0.0  # a ramp does not vary
    return total


@compiled()
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
    coefficients it is the covariance.
    """
    points = factors.size
    out = np.zeros((6, 6, points, points))
    for i in range(points):
        for j in range(i, points):
            first, second = factors[i], factors[j]
            first_terms, second_terms = angles - 2 * first, angles - 2 * second
            total = summed_products(first, second, angles, correlation, nodes, weights)
            scale = 0.5 / (1.0 * first * first * second * second * first_terms * second_terms)
            for a in range(6):
                for b in range(6):
                    out[a, b, i, j] = scale * total[a, b]
                    out[a, b, j, i] = scale * total[a, b]
    return out


# --- models of a spectrum --------------------------------------------------------------------


@compiled(error_model="numpy")
def _solved(matrix: FloatArray, vector: FloatArray, size: int) -> bool:
    """Solve a small symmetric positive system in place; False if it is singular."""
    for i in range(size):
        for j in range(i + 1):
            total = matrix[i, j]
            for k in range(j):
                total -= matrix[i, k] * matrix[j, k]
            if i == j:
                # Relative: far above a roll-off the laws are millions of times the levels.
                if total <= 1e-13 * matrix[i, i]:
                    return False
                matrix[i, i] = np.sqrt(total)
            else:
                matrix[i, j] = total / matrix[j, j]
    for i in range(size):
        total = vector[i]
        for k in range(i):
            total -= matrix[i, k] * vector[k]
        vector[i] = total / matrix[i, i]
    for i in range(size - 1, -1, -1):
        total = vector[i]
        for k in range(i + 1, size):
            total -= matrix[k, i] * vector[k]
        vector[i] = total / matrix[i, i]
    return True


@compiled(error_model="numpy")
def _gamma_deviance(
    level: FloatArray,
    shape: FloatArray,
    laws: FloatArray,
    squares: FloatArray,
    first: int,
    last: int,
    columns: IntegerArray,
    size: int,
    mean: FloatArray,
) -> float:
    """Gamma deviance, ``2 sum a (y/m - 1 - ln(y/m))``; infinite if a mean is not above zero."""
    total = 0.0
    for b in range(first, last):
        value = 0.0
        for c in range(size):
            value += laws[b, columns[c]] * squares[c]
        mean[b] = value
        if value <= 1e-6 * level[b]:
            return np.inf
        ratio = level[b] / value
        total += 2.0 * shape[b] * (ratio - 1.0 - np.log(ratio))
    return total


@compiled(error_model="numpy")
def _gamma_information(
    level: FloatArray,
    shape: FloatArray,
    laws: FloatArray,
    mean: FloatArray,
    first: int,
    last: int,
    columns: IntegerArray,
    size: int,
    matrix: FloatArray,
    vector: FloatArray,
) -> None:
    """Fisher information and what it is multiplied by the next squares to give."""
    for c in range(size):
        vector[c] = 0.0
        for d in range(c + 1):
            matrix[c, d] = 0.0
    for b in range(first, last):
        weight = shape[b] / mean[b] ** 2
        for c in range(size):
            part = weight * laws[b, columns[c]]
            vector[c] += part * level[b]
            for d in range(c + 1):
                matrix[c, d] += part * laws[b, columns[d]]


@compiled(error_model="numpy")
def _least_squares(
    level: FloatArray,
    shape: FloatArray,
    laws: FloatArray,
    first: int,
    last: int,
    columns: IntegerArray,
    size: int,
    squares: FloatArray,
    mean: FloatArray,
    matrix: FloatArray,
    target: FloatArray,
) -> float:
    """Squares by least squares on relative residuals; their deviance, infinite without any."""
    for b in range(first, last):
        mean[b] = level[b]
    _gamma_information(level, shape, laws, mean, first, last, columns, size, matrix, target)
    if not _solved(matrix, target, size):
        return np.inf
    for c in range(size):
        squares[c] = target[c]
    deviance = _gamma_deviance(level, shape, laws, squares, first, last, columns, size, mean)
    if not np.isfinite(deviance):
        # Least squares with large residuals may fall below zero: start from what is positive.
        for c in range(size):
            typical = 0.0
            for b in range(first, last):
                typical += abs(laws[b, columns[c]]) / (last - first)
            squares[c] = max(target[c], 1e-3 / typical)
        deviance = _gamma_deviance(level, shape, laws, squares, first, last, columns, size, mean)
    return float(deviance)


@compiled(error_model="numpy")
def _scoring(
    level: FloatArray,
    shape: FloatArray,
    laws: FloatArray,
    first: int,
    last: int,
    columns: IntegerArray,
    size: int,
    squares: FloatArray,
    mean: FloatArray,
    hopeless: float,
) -> float:
    """Fisher scoring from least squares on relative residuals; the deviance at its end.

    It is infinite if the deviance stays above `hopeless` after a few steps: such a model has no
    weight, and scoring takes long if a law does not describe its bins.
    """
    matrix, target, trial = np.empty((size, size)), np.empty(size), np.empty(size)
    deviance = _least_squares(
        level, shape, laws, first, last, columns, size, squares, mean, matrix, target
    )
    if not np.isfinite(deviance):
        return np.inf
    for step in range(20):
        if step == 4 and deviance > hopeless:
            return np.inf
        _gamma_information(level, shape, laws, mean, first, last, columns, size, matrix, target)
        if not _solved(matrix, target, size):
            return np.inf
        share, outcome = 1.0, np.inf
        for _ in range(8):
            for c in range(size):
                trial[c] = squares[c] + share * (target[c] - squares[c])
            outcome = _gamma_deviance(level, shape, laws, trial, first, last, columns, size, mean)
            if outcome <= deviance + 1e-9:
                break
            share *= 0.5
        fall = deviance - outcome
        if not fall >= -1e-9:
            break
        for c in range(size):
            squares[c] = trial[c]
        deviance = outcome
        if fall < 1e-3:
            break
    return float(_gamma_deviance(level, shape, laws, squares, first, last, columns, size, mean))


@compiled(error_model="numpy")
def _gamma_covariance(
    level: FloatArray,
    shape: FloatArray,
    laws: FloatArray,
    mean: FloatArray,
    first: int,
    last: int,
    columns: IntegerArray,
    size: int,
    covariance: FloatArray,
) -> bool:
    """Inverse of the Fisher information, into the rows and columns of its terms."""
    information = np.empty((size, size))
    matrix = np.empty((size, size))
    vector = np.empty(size)
    _gamma_information(level, shape, laws, mean, first, last, columns, size, information, vector)
    for c in range(size):
        for d in range(size):
            vector[d] = 1.0 if d == c else 0.0
            for e in range(d + 1):
                matrix[d, e] = information[d, e]
        if not _solved(matrix, vector, size):
            return False
        for d in range(size):
            covariance[columns[d], columns[c]] = vector[d]
    return True


@compiled(error_model="numpy")
def _ruled(
    laws: FloatArray,
    squares: FloatArray,
    mean: FloatArray,
    first: int,
    last: int,
    columns: IntegerArray,
    size: int,
    walk: int,
) -> int:
    """Bins in which the walk is half of the fitted spectrum or more, and 1.4 of it or less."""
    ruled = 0
    for c in range(size):
        if columns[c] == walk:
            for b in range(first, last):
                part = squares[c] * laws[b, walk]
                if 0.5 * mean[b] <= part <= 1.4 * mean[b]:
                    ruled += 1
    return ruled


@compiled(error_model="numpy")
def every_model(
    level: FloatArray,
    shape: FloatArray,
    laws: FloatArray,
    walk: int,
    least: int,
    needed: int,
    barred: int,
    lightest: float,
) -> tuple[
    IntegerArray,
    IntegerArray,
    IntegerArray,
    IntegerArray,
    FloatArray,
    FloatArray,
    FloatArray,
]:
    """Fit every contiguous band with every choice of terms.

    Parameters are scaled so that laws are about one. Models with a coefficient at or below zero
    are those with fewer terms and are left out. The terms of the bit mask `needed` are in every
    model, those of `barred` in none. Models that weigh nothing beside a cost of `lightest` are
    not finished.

    Returns
    -------
    first, last, mask, ruled, deviance, squares, covariance
        One row a model: band of bins, bit mask of terms, number of bins that the walk rules.
    """
    bins, terms = laws.shape
    most = (1 << terms) * bins * (bins + 1) // 2
    first_of = np.empty(most, dtype=np.int64)
    last_of = np.empty(most, dtype=np.int64)
    mask_of = np.empty(most, dtype=np.int64)
    ruled_of = np.empty(most, dtype=np.int64)
    deviance_of = np.empty(most)
    squares_of = np.zeros((most, terms))
    covariance_of = np.zeros((most, terms, terms))
    columns = np.empty(terms, dtype=np.int64)
    squares = np.empty(terms)
    mean = np.empty(bins)
    found = 0
    for mask in range(1, 1 << terms):
        if mask & needed != needed or mask & barred != 0:
            continue
        size = 0
        for c in range(terms):
            if mask >> c & 1:
                columns[size] = c
                size += 1
        for first in range(bins):
            for last in range(first + max(least, size + 1), bins + 1):
                left_out = bins - (last - first)
                hopeless = lightest + 60.0 - 2.0 * left_out
                if hopeless < 0.0:
                    continue
                deviance = _scoring(
                    level, shape, laws, first, last, columns, size, squares, mean, hopeless
                )
                positive = np.isfinite(deviance)
                for c in range(size):
                    positive = positive and squares[c] > 0.0
                if not positive:
                    continue
                lightest = min(lightest, deviance + 2.0 * (size + left_out))
                if not _gamma_covariance(
                    level, shape, laws, mean, first, last, columns, size, covariance_of[found]
                ):
                    covariance_of[found] = 0.0
                    continue
                ruled_of[found] = _ruled(laws, squares, mean, first, last, columns, size, walk)
                first_of[found] = first
                last_of[found] = last
                mask_of[found] = mask
                deviance_of[found] = deviance
                for c in range(size):
                    squares_of[found, columns[c]] = squares[c]
                found += 1
    return (
        first_of[:found],
        last_of[:found],
        mask_of[:found],
        ruled_of[:found],
        deviance_of[:found],
        squares_of[:found],
        covariance_of[:found],
    )
