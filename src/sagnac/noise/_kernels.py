"""Compiled loops of the curve fit and of the models of bands: arrays in, arrays out.

Each loop is called from one place, since it is compiled anew wherever it is called.
"""

# Compiled loops take their arrays by position.
# ruff: noqa: PLR0917

import numpy as np

from sagnac.core.arrays import FloatArray, IntegerArray
from sagnac.core.kernels import compiled

# Shares of a span between two breaks at which panels of a quadrature begin and end.
_PANELS = np.array([0.0, 0.02, 0.1, 0.3, 0.7, 0.9, 0.98, 1.0])
_WHOLE = np.array([0.0, 1.0])
# Lags between two breaks that are summed one by one.
_DIRECT = 64
_STEPS = np.arange(3)
# Distance of far breaks, in longer clusters.
_FARTHER = 2.0 ** np.arange(1, 8) - 1.0


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
def second_difference_covariances(lag: float, first: int, second: int, out: FloatArray) -> None:
    """Covariance at `lag` of second angle differences over `first` and `second` samples.

    From the generalized autocovariance of the angle: a delta, -|t|/2, t^2 ln|t|/(2 pi) and
    |t|^3/12 for Q, N, B and K at one and a sample interval of one.
    """
    for p in range(4):
        out[p] = 0.0
    for p in range(3):
        for q in range(3):
            weight = (-2.0 if p == 1 else 1.0) * (-2.0 if q == 1 else 1.0)
            t = abs(lag + p * first - q * second)
            if t == 0.0:
                out[0] += weight
            else:
                out[1] -= weight * 0.5 * t
    # The shorter of the two first: the cube of a lag of a day at 500 Hz has no digits left for it.
    short, long = min(first, second), max(first, second)
    start = lag if first <= second else lag - 2.0 * second
    for p in range(3):
        weight = -2.0 if p == 1 else 1.0
        t = start - p * long if first <= second else start + p * long
        out[2] += weight * _flicker_difference(t, short) / (2.0 * np.pi)
        out[3] += weight * _cubic_difference(t, short) / 12.0


@compiled()
def add_products(
    pairs: IntegerArray,
    lags: FloatArray,
    counts: FloatArray,
    first: int,
    second: IntegerArray,
    covariance: FloatArray,
    totals: FloatArray,
) -> None:
    """Add products of the terms' covariances at each lag, times its count, to those of its pair.

    A pair is that of `first` and one of `second`; `covariance` (5,) is room to work in.
    """
    for n in range(lags.size):
        other = second[pairs[n]]
        second_difference_covariances(lags[n], first, other, covariance)
        covariance[4] = 1.0 * first * first * other * other
        for a in range(5):
            for b in range(5):
                totals[pairs[n], a, b] += counts[n] * covariance[a] * covariance[b]


def counted_lags(
    first: int, second: IntegerArray, angles: int, nodes: FloatArray, weights: FloatArray
) -> tuple[IntegerArray, FloatArray, FloatArray]:
    """Lags of second differences over `first` and each of `second` (pairs,), and their counts.

    The covariance, and how often the record holds a lag, break at whole sums of the two clusters
    and at the ends of the record. Up to 64 lags between breaks stand one by one; for more there
    are Gauss-Legendre panels (`nodes` and `weights` on [-1, 1]), finer towards the breaks at both
    ends. Beyond the clusters' own span all is smooth, and breaks stand ever farther apart, to the
    last lag that counts.

    Returns
    -------
    pairs, lags, counts
        Sums over the counts are those over every lag that the record holds.
    """
    first_terms, second_terms = angles - 2 * first, (angles - 2 * second)[:, np.newaxis]
    others, ones = second[:, np.newaxis].astype(np.float64), np.ones((second.size, 1))
    farther = np.maximum(others, first) * _FARTHER
    sums = others[:, np.newaxis] * _STEPS - _STEPS[:, np.newaxis] * first
    breaks = np.concatenate([
        sums.reshape(second.size, 9), 0.0 * ones, first_terms - second_terms,
        2.0 * others + farther, -2.0 * first - farther,
    ], axis=1)  # fmt: skip
    # 1/f dies as 1/lag^2, its square's sum as 1/lag^3: what is farther is left out.
    low = np.maximum(1.0 - second_terms, breaks.min(axis=1, keepdims=True))
    high = np.minimum(first_terms - 1.0, breaks.max(axis=1, keepdims=True))
    breaks = np.sort(np.clip(breaks, low, high), axis=1)
    spans = np.diff(breaks, axis=1, append=np.inf * ones) - 1.0
    pair, place = np.nonzero(spans >= 0.0)
    lag, span = breaks[pair, place], spans[pair, place]
    span[np.isinf(span)] = 0.0
    single = np.where(span <= _DIRECT, span, 0.0).astype(np.int64) + 1
    begin = np.repeat(np.arange(lag.size), single)
    steps = np.arange(begin.size) - np.repeat(np.cumsum(single) - single, single)
    pairs, counts = [np.asarray(pair[begin])], [np.ones(begin.size)]
    lags = [np.asarray(lag[begin] + steps, dtype=np.float64)]
    smooth = (lag >= 2.0 * second[pair]) | (lag < -2.0 * first)
    for cuts, some in ((_PANELS, ~smooth), (_WHOLE, smooth)):
        half = 0.5 * np.diff(cuts)[:, np.newaxis]
        inside = (cuts[:-1, np.newaxis] + half * (1.0 + nodes)).ravel()
        many = np.flatnonzero(some & (span > _DIRECT))
        pairs.append(np.repeat(pair[many], inside.size))
        lags.append((lag[many, np.newaxis] + 0.5 + span[many, np.newaxis] * inside).ravel())
        counts.append((span[many, np.newaxis] * (half * weights).ravel()).ravel())
    each, every = np.concatenate(pairs), np.concatenate(lags)
    held = np.minimum(first_terms, second_terms[each, 0] + every) - np.maximum(0.0, every)
    return each, every, np.concatenate(counts) * held


def overlapped_covariances(
    factors: IntegerArray, angles: int, nodes: FloatArray, weights: FloatArray
) -> FloatArray:
    """Covariance of overlapped Allan variances by pairs of terms, for a sample interval of one.

    ``(terms, terms, points, points)`` with the terms Q, N, B, K and the ramp R: contracted twice
    with the squared coefficients it is the covariance.
    """
    out = np.zeros((5, 5, factors.size, factors.size))
    for i in range(factors.size):
        first, second = int(factors[i]), factors[i:]
        totals = np.zeros((second.size, 5, 5))
        points = counted_lags(first, second, angles, nodes, weights)
        add_products(*points, first, second, np.empty(5), totals)
        totals[:, 4, 4] = 0.0  # a ramp does not vary
        squares = 1.0 * first * first * second * second
        totals *= (0.5 / (squares * (angles - 2 * first) * (angles - 2 * second)))[:, None, None]
        out[:, :, i, i:] = out[:, :, i:, i] = np.moveaxis(totals, 0, -1)
    return out


# Divisors of N: the largest at which a bin shows it, and at the upper edge of a band.
_LOWERED = 1.4
_DEEPEST = 1.5
# Steps of a fit, the first of which is least squares on relative residuals.
_MOST_STEPS = 21
# Steps after which a model that is hopeless is given up.
_HOPING = 5


def every_model(
    level: FloatArray,
    shape: FloatArray,
    laws: FloatArray,
    walk: int,
    least: int,
    needed: int,
    barred: int,
    falls: bool,
    lightest: float,
) -> tuple[IntegerArray, FloatArray, FloatArray, FloatArray]:
    """Fit every contiguous band with every choice of terms.

    Parameters are scaled so that laws are about one. Models with a coefficient at or below zero
    are those with fewer terms and are left out. The terms of the bit mask `needed` are in every
    model, those of `barred` in none. If the model `falls`, its last column is no law but r of the
    divisor ``1 + c r`` of all others; it has to be needed then, and bands that reach below
    1/2.5 are left out. Models that weigh nothing beside a cost of `lightest` are not finished.

    Returns
    -------
    places, deviance, squares, covariance
        One column (places) or row a model. Its places are the first bin of its band, the one
        behind the last, its bit mask of terms, and the number of bins that the walk rules.
    """
    bins, terms = laws.shape
    most = bins * (bins + 1) // 2
    places, deviances = [np.empty((4, 0), dtype=np.int64)], [np.empty(0)]
    squares, covariances = [np.empty((0, terms))], [np.empty((0, terms, terms))]
    for mask in range(1, 1 << terms):
        if mask & needed != needed or mask & barred:
            continue
        columns = np.flatnonzero(mask >> np.arange(terms) & 1)
        size = columns.size
        # Arrays are made and placed here, which costs seconds of compilation in a loop.
        bands, cost = np.empty((3, most), dtype=np.int64), np.empty(most)
        fits, spreads = np.empty((most, size)), np.empty((most, size, size))
        found, lightest = _fit_every_band(
            level, shape, np.ascontiguousarray(laws[:, columns]),
            int(np.searchsorted(columns, walk)) if mask >> walk & 1 else -1,
            max(least, size + 1), falls, float(lightest), bands, cost, fits, spreads,
            np.empty(size), np.empty(size),
        )  # fmt: skip
        placed, spread = np.zeros((found, terms)), np.zeros((found, terms, terms))
        placed[:, columns] = fits[:found]
        spread[:, columns[:, np.newaxis], columns] = spreads[:found]
        first, last, ruled = bands[:, :found]
        places.append(np.array([first, last, np.full(found, mask), ruled]))
        deviances.append(cost[:found])
        squares.append(placed)
        covariances.append(spread)
    return (
        np.concatenate(places, axis=1),
        np.concatenate(deviances),
        np.concatenate(squares),
        np.concatenate(covariances),
    )


@compiled(error_model="numpy")
def _information(
    level: FloatArray,
    shape: FloatArray,
    laws: FloatArray,
    first: int,
    last: int,
    falls: bool,
    walk: int,
    begun: bool,
    squares: FloatArray,
    row: FloatArray,
    matrix: FloatArray,
    vector: FloatArray,
) -> int:
    """Fisher information and what its inverse is multiplied by to give the next squares.

    With c the last square of a model ``m = sum / (1 + c r)`` that falls, the last column is the
    derivative ``-r m / (1 + c r)``, and ``y + c dm/dc`` takes the place of y. Before a fit has
    `begun` the levels stand for the means, and c is zero: the residuals are those of
    ``y (1 + c r) = sum``, which is linear.

    Returns
    -------
    int
        Bins in which the walk, column `walk`, is half of the sum or more, and falls by 0.3 or less.
    """
    size = squares.size
    ruled = 0
    for c in range(size):
        vector[c] = 0.0
        for d in range(size):
            matrix[c, d] = 0.0
    for b in range(first, last):
        total = 0.0
        for c in range(size):
            row[c] = laws[b, c]
            total += squares[c] * row[c]
        divisor = 1.0
        if falls and begun:
            total -= squares[size - 1] * row[size - 1]
            divisor += squares[size - 1] * row[size - 1]
        if walk >= 0 and divisor <= _LOWERED and squares[walk] * row[walk] >= 0.5 * total:
            ruled += 1
        mean = total / divisor if begun else level[b]
        observed = level[b]
        if falls:
            for c in range(size):
                row[c] /= divisor
            row[size - 1] *= -mean
            if begun:
                observed += squares[size - 1] * row[size - 1]
        for c in range(size):
            part = shape[b] / mean**2 * row[c]
            vector[c] += part * observed
            for d in range(size):
                matrix[c, d] += part * row[d]
    return ruled


@compiled(error_model="numpy")
def _inverted(matrix: FloatArray, diagonal: FloatArray) -> bool:
    """Invert a small symmetric positive matrix in place (Gauss-Jordan); False if it is singular.

    `diagonal` (size,) is room to work in.
    """
    size = diagonal.size
    for i in range(size):
        diagonal[i] = matrix[i, i]
    for i in range(size):
        pivot = matrix[i, i]
        # Relative: far above a roll-off the laws are millions of times the levels.
        if not pivot > 1e-13 * diagonal[i]:
            return False
        matrix[i, i] = 1.0
        for j in range(size):
            matrix[i, j] /= pivot
        for k in range(size):
            if k != i:
                factor = matrix[k, i]
                matrix[k, i] = 0.0
                for j in range(size):
                    matrix[k, j] -= factor * matrix[i, j]
    return True


@compiled(error_model="numpy")
def _gamma_deviance(
    level: FloatArray,
    shape: FloatArray,
    laws: FloatArray,
    first: int,
    last: int,
    falls: bool,
    squares: FloatArray,
) -> float:
    """Gamma deviance, ``2 sum a (y/m - 1 - ln(y/m))``; infinite if a mean is not above zero."""
    total = 0.0
    linear = squares.size - 1 if falls else squares.size
    for b in range(first, last):
        mean = 0.0
        for c in range(linear):
            mean += laws[b, c] * squares[c]
        if falls:
            divisor = 1.0 + squares[linear] * laws[b, linear]
            if divisor < 0.5:
                return np.inf
            mean /= divisor
        if mean <= 1e-6 * level[b]:
            return np.inf
        ratio = level[b] / mean
        total += 2.0 * shape[b] * (ratio - 1.0 - np.log(ratio))
    return total


@compiled(error_model="numpy")
def _propose(
    laws: FloatArray,
    first: int,
    last: int,
    positive: bool,
    share: float,
    squares: FloatArray,
    inverse: FloatArray,
    vector: FloatArray,
    trial: FloatArray,
) -> None:
    """Fill `trial` with squares a `share` of the way to the next, or `positive` ones to begin with.

    Least squares with large residuals may fall below zero.
    """
    for c in range(squares.size):
        target = 0.0
        for d in range(squares.size):
            target += inverse[c, d] * vector[d]
        trial[c] = squares[c] + share * (target - squares[c])
        if positive:
            typical = 0.0
            for b in range(first, last):
                typical += abs(laws[b, c]) / (last - first)
            trial[c] = max(target, 1e-3 / typical)


@compiled(error_model="numpy")
def _fitted(
    level: FloatArray,
    shape: FloatArray,
    laws: FloatArray,
    walk: int,
    first: int,
    last: int,
    falls: bool,
    hopeless: float,
    squares: FloatArray,
    matrix: FloatArray,
    vector: FloatArray,
    trial: FloatArray,
) -> tuple[float, int]:
    """Fisher scoring from least squares on relative residuals: squares and their covariance.

    It is given up if the deviance stays above `hopeless` after a few steps: such a model has no
    weight, and scoring takes long if a law does not describe its bins.

    Returns
    -------
    deviance, ruled
        The deviance, infinite if there is no fit, and the bins that the walk rules.
    """
    size = squares.size
    deviance = np.inf
    settled = False
    for c in range(size):
        squares[c] = 0.0
    for step in range(_MOST_STEPS + 1):
        ruled = _information(
            level, shape, laws, first, last, falls, walk, step > 0, squares, trial, matrix, vector
        )
        if not _inverted(matrix, trial):
            break
        if settled or step == _MOST_STEPS:
            return deviance, ruled
        if step == _HOPING and deviance > hopeless:
            break
        share, outcome = 1.0, np.inf
        for attempt in range(8):
            _propose(
                laws, first, last, step == 0 and attempt > 0, share, squares, matrix, vector, trial
            )
            outcome = _gamma_deviance(level, shape, laws, first, last, falls, trial)
            if outcome <= deviance + 1e-9 and outcome < np.inf:
                break
            share *= 0.5
        if step == 0 and outcome == np.inf:
            break
        lowered = deviance - outcome
        settled = not lowered >= 1e-3
        if lowered >= -1e-9:
            deviance = outcome
            for c in range(size):
                squares[c] = trial[c]
    return np.inf, 0


@compiled(error_model="numpy")
def _fit_every_band(
    level: FloatArray,
    shape: FloatArray,
    laws: FloatArray,
    walk: int,
    least: int,
    falls: bool,
    lightest: float,
    places: IntegerArray,
    deviances: FloatArray,
    squares: FloatArray,
    covariances: FloatArray,
    vector: FloatArray,
    trial: FloatArray,
) -> tuple[int, float]:
    """Fits into the arrays that `every_model` returns, their number, and the lightest cost.

    The walk is column `walk` of the laws, or -1; `vector` and `trial` (terms,) are room to work in.
    """
    bins, size = laws.shape
    found = 0
    for first in range(bins):
        for last in range(first + least, bins + 1):
            left_out = bins - (last - first)
            hopeless = lightest + 60.0 - 2.0 * left_out
            if hopeless < 0.0:
                continue
            deviance, ruled = _fitted(
                level, shape, laws, walk, first, last, falls, hopeless, squares[found],
                covariances[found], vector, trial,
            )  # fmt: skip
            stands = deviance < np.inf
            for c in range(size):
                stands = stands and squares[found, c] > 0.0
            if falls and squares[found, size - 1] * laws[last - 1, size - 1] > _DEEPEST:
                stands = False
            if stands:
                lightest = min(lightest, deviance + 2.0 * (size + left_out))
                places[0, found], places[1, found], places[2, found] = first, last, ruled
                deviances[found] = deviance
                found += 1
    return found, lightest
