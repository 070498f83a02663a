"""Compiled loops of the curve fit and of the models of bands: arrays in, arrays out."""

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


@compiled(error_model="numpy")
def score_bands(
    shape: FloatArray,
    laws: FloatArray,
    fall: int,
    bands: IntegerArray,
    columns: IntegerArray,
    squares: FloatArray,
    begun: bool,
    deviance: FloatArray,
    information: FloatArray,
    vector: FloatArray,
) -> None:
    """Add gamma deviance of each model, Fisher information, and its product with the next squares.

    The information is filled up to its diagonal.

    Levels are one. A model (row) is that of bins ``bands[n, 0]`` to before ``bands[n, 1]`` and of
    `columns` of the laws. Those from `fall` on are no laws but r of the divisor ``1 + c r`` of all
    others: with ``m = sum / (1 + c r)`` the derivative is ``-r m / (1 + c r)``, and ``y + c dm/dc``
    takes the place of the level y. Before a fit has `begun` the levels stand for the means, and c
    is zero: the residuals are those of ``y (1 + c r) = sum``, which is linear. The deviance is
    ``2 sum a (y/m - 1 - ln(y/m))``, infinite if a mean is not above zero.
    """
    size = columns.shape[1]
    slope = np.empty(size)
    for n in range(columns.shape[0]):
        for b in range(bands[n, 0], bands[n, 1]):
            total, divisor = 0.0, 1.0
            for c in range(size):
                slope[c] = laws[b, columns[n, c]]
                if columns[n, c] < fall:
                    total += squares[n, c] * slope[c]
                else:
                    divisor += squares[n, c] * slope[c]
            mean = total / divisor if begun else 1.0
            if mean <= 1e-6 or divisor < 0.5:
                deviance[n] = np.inf
                break
            deviance[n] += 2.0 * shape[b] * (1.0 / mean - 1.0 + np.log(mean))
            observed = 1.0 - mean * (divisor - 1.0) / divisor
            weight = shape[b] / mean**2
            for c in range(size):
                slope[c] *= (1.0 if columns[n, c] < fall else -mean) / divisor
                vector[n, c] += weight * slope[c] * observed
                for d in range(c + 1):
                    information[n, c, d] += weight * slope[c] * slope[d]
