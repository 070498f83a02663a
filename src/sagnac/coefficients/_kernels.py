"""Compiled loops of the curve fit: arrays in, arrays out."""

# Compiled loops take their arrays by position.
# ruff: noqa: PLR0917

import numpy as np

from sagnac.arrays import FloatArray, IntegerArray
from sagnac.kernels import compiled

# Shares of a span between two breaks at which panels of a quadrature begin and end.
PANELS = np.array([0.0, 0.02, 0.1, 0.3, 0.7, 0.9, 0.98, 1.0])
WHOLE = np.array([0.0, 1.0])


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
    for p in range(5):
        out[p] = 0.0
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
def lag_breaks(first: int, second: int, angles: int, breaks: FloatArray) -> None:
    """Lags at which the covariance of two second differences, or its weight, breaks, to (27,).

    Ascending, and some more than once: whole sums of the two clusters, the ends of the record,
    and beyond the clusters' own span places ever farther apart, to the last lag that counts.
    """
    first_terms, second_terms = angles - 2 * first, angles - 2 * second
    lowest, highest = -(second_terms - 1.0), first_terms - 1.0
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
    limit_low = lowest if lowest > breaks[26] else breaks[26]
    limit_high = highest if highest < breaks[25] else breaks[25]
    # Insertion by hand: a sort of numpy takes two seconds to compile.
    for k in range(27):
        value = breaks[k]
        value = max(value, limit_low)
        value = min(value, limit_high)
        place = k
        while place > 0 and breaks[place - 1] > value:
            breaks[place] = breaks[place - 1]
            place -= 1
        breaks[place] = value


@compiled()
def panel_point(
    number: int, lag: float, span: float, panels: FloatArray, nodes: FloatArray, weights: FloatArray
) -> tuple[float, float]:
    """Lag and weight of a Gauss-Legendre point of the `span` lags after the break at `lag`.

    Points are counted through panels between the `panels`, shares of the span.
    """
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
    panels: FloatArray,
    whole: FloatArray,
    nodes: FloatArray,
    weights: FloatArray,
    ordered: FloatArray,
    covariance: FloatArray,
    total: FloatArray,
) -> None:
    """Sum over all lags of products of the covariances of two second differences, to (6, 6).

    The terms are Q, N, B, K, a Markov rate and the ramp. Between breaks up to 64 lags are
    summed one by one; more go by Gauss-Legendre panels (`nodes` and `weights` on [-1, 1]), finer
    towards the breaks at both ends, or the `whole` where all is smooth. `ordered` (27,) and
    `covariance` (6,) are room to work in.
    """
    lag_breaks(first, second, angles, ordered)
    covariance[5] = 1.0 * first * first * second * second
    for a in range(6):
        for b in range(6):
            total[a, b] = 0.0
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
        cuts = whole if smooth else panels
        for number in range((cuts.size - 1) * nodes.size):
            place, weight = panel_point(number, lag, span, cuts, nodes, weights)
            add_products(place, weight, first, second, angles, correlation, covariance, total)
    total[5, 5] = 0.0  # a ramp does not vary


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
    out = np.zeros((6, 6, factors.size, factors.size))
    _overlapped_covariances(
        factors, int(angles), float(correlation), PANELS, WHOLE, nodes, weights, np.empty(27),
        np.empty(6), np.empty((6, 6)), out,
    )  # fmt: skip
    return out


@compiled()
def _overlapped_covariances(
    factors: IntegerArray,
    angles: int,
    correlation: float,
    panels: FloatArray,
    whole: FloatArray,
    nodes: FloatArray,
    weights: FloatArray,
    ordered: FloatArray,
    covariance: FloatArray,
    total: FloatArray,
    out: FloatArray,
) -> None:
    """The same into `out`; see `summed_products` for what is before it."""
    points = factors.size
    for i in range(points):
        for j in range(i, points):
            first, second = factors[i], factors[j]
            first_terms, second_terms = angles - 2 * first, angles - 2 * second
            summed_products(
                first, second, angles, correlation, panels, whole, nodes, weights, ordered,
                covariance, total,
            )  # fmt: skip
            scale = 0.5 / (1.0 * first * first * second * second * first_terms * second_terms)
            for a in range(6):
                for b in range(6):
                    out[a, b, i, j] = scale * total[a, b]
                    out[a, b, j, i] = scale * total[a, b]
