"""Compiled loops of the curve fit and of the models of bands: arrays in, arrays out."""

# Compiled loops take their arrays by position.
# ruff: noqa: PLR0917

import numpy as np

from sagnac.core.arrays import FloatArray, IntegerArray
from sagnac.core.kernels import compiled

# Lags between two breaks that are summed one by one.
_DIRECT = 64
_STEPS = np.arange(3)
# Distance of far breaks, in longer clusters.
_FARTHER = 2.0 ** np.arange(1, 8) - 1.0
# Gauss-Legendre quadrature over a span between two breaks: places and weights in it, of one panel,
# and of panels that are finer towards both breaks.
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(8)
_WHOLE, _OF_WHOLE = 0.5 * (1.0 + _NODES), 0.5 * _WEIGHTS
_CUTS = np.array([0.0, 0.02, 0.1, 0.3, 0.7, 0.9, 0.98, 1.0])
_PANELS = (_CUTS[:-1, np.newaxis] + np.diff(_CUTS)[:, np.newaxis] * _WHOLE).ravel()
_OF_PANELS = (np.diff(_CUTS)[:, np.newaxis] * _OF_WHOLE).ravel()


@compiled()
def second_difference_covariances(lag: float, first: int, second: int, out: FloatArray) -> None:
    """Covariance at `lag` of second angle differences over `first` and `second` samples.

    From the generalized autocovariance of the angle: a delta, -|t|/2, t^2 ln|t|/(2 pi) and
    |t|^3/12 for Q, N, B and K at one and a sample interval of one.
    """
    out[:4] = 0.0
    # The sum over p makes differences over the longer span of those over the shorter (the sum
    # over q).
    short, long = min(first, second), max(first, second)
    for p in range(3):
        weight = -2.0 if p == 1 else 1.0
        t = lag - p * long if first <= second else lag - 2.0 * second + p * long
        middle = abs(t + short)
        if middle < 8.0 * short:
            for q in range(3):
                place, of_both = abs(t + q * short), -2.0 * weight if q == 1 else weight
                if place == 0.0:
                    out[0] += of_both
                else:
                    out[1] -= of_both * 0.5 * place
                    out[2] += of_both * place * place * np.log(place) / (2.0 * np.pi)
                    out[3] += of_both * place * place * place / 12.0
        else:
            # In closed form, and by Taylor's series about the middle: the cube of a lag of a day at
            # 500 Hz has no digits left for a difference.
            ratio, series = (short / middle) ** 2, 0.0
            for k in range(9, 1, -1):
                series = ratio * (series + 4.0 / (2.0 * k * (2.0 * k - 1.0) * (2.0 * k - 2.0)))
            flicker = 2.0 * np.log(middle) + 3.0 - series
            out[2] += weight * short * short * flicker / (2.0 * np.pi)
            out[3] += weight * short * short * middle / 2.0


@compiled()
def add_products(
    breaks: FloatArray, first: int, second: IntegerArray, angles: int, totals: FloatArray
) -> None:
    """Add to `totals` products of the terms' covariances over every lag that the record holds.

    A pair is that of `first` and one of `second` (pairs,), with its `lag_breaks`. Up to 64 lags
    between breaks stand one by one; for more there are panels of a quadrature.
    """
    covariance = np.empty(5)
    for n in range(second.size):
        other = second[n]
        covariance[4] = 1.0 * first * first * other * other
        for b in range(breaks.shape[1]):
            lag = breaks[n, b]
            span = breaks[n, b + 1] - lag - 1.0 if b + 1 < breaks.shape[1] else 0.0
            smooth = lag >= 2.0 * other or lag < -2.0 * first
            inside, weights = (_WHOLE, _OF_WHOLE) if smooth else (_PANELS, _OF_PANELS)
            single = int(span) + 1 if span <= _DIRECT else 1
            for k in range(single if span <= _DIRECT else single + inside.size):
                if k < single:
                    place, count = lag + k, 1.0
                else:
                    place = lag + 0.5 + span * inside[k - single]
                    count = span * weights[k - single]
                # How often the record holds it.
                held = min(angles - 2.0 * first, angles - 2.0 * other + place) - max(0.0, place)
                second_difference_covariances(place, first, other, covariance)
                for c in range(5):
                    for d in range(5):
                        totals[n, c, d] += count * held * covariance[c] * covariance[d]


def lag_breaks(first: int, second: IntegerArray, angles: int) -> FloatArray:
    """(pairs, breaks) lags where covariances over `first` and each of `second` (pairs,) break.

    The covariance, and how often the record holds a lag, break at whole sums of the two clusters
    and at the ends of the record. Beyond the clusters' own span all is smooth, and breaks stand
    ever farther apart, to the last lag that counts. Ascending; one may stand more than once.
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
    return np.sort(np.clip(breaks, low, high), axis=1)


@compiled()
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
    others but the first, Q: with ``m = Q + s``, ``s = sum / (1 + c r)``, the derivative is
    ``-r s / (1 + c r)``, and ``y + c dm/dc`` takes the place of the level y. The deviance is
    ``2 sum a (y/m - 1 - ln(y/m))``, infinite if a mean is not above zero.

    Before a fit has `begun` the levels stand for the means. Q is then held at its given square, so
    that ``(y - Q) (1 + c r) = sum`` is linear in all others, and the given c weighs its residuals.
    """
    size = columns.shape[1]
    slope = np.empty(size)
    for n in range(columns.shape[0]):
        for b in range(bands[n, 0], bands[n, 1]):
            total, divisor, readout = 0.0, 1.0, 0.0
            for c in range(size):
                slope[c] = laws[b, columns[n, c]]
                if columns[n, c] == 0:
                    readout = squares[n, c] * slope[c]
                elif columns[n, c] < fall:
                    total += squares[n, c] * slope[c]
                else:
                    divisor += squares[n, c] * slope[c]
            filtered = total / divisor if begun else 1.0 - readout
            mean = readout + filtered
            if mean <= 1e-6 or divisor < 0.5:
                deviance[n] = np.inf
                break
            deviance[n] += 2.0 * shape[b] * (1.0 / mean - 1.0 + np.log(mean))
            weight = shape[b] / mean**2
            observed = 1.0 - filtered * (divisor - 1.0) / divisor
            if not begun:
                observed, weight, divisor = filtered, weight / divisor**2, 1.0
            for c in range(size):
                if columns[n, c] > 0:
                    slope[c] *= (1.0 if columns[n, c] < fall else -filtered) / divisor
                vector[n, c] += weight * slope[c] * observed
                for d in range(c + 1):
                    information[n, c, d] += weight * slope[c] * slope[d]
