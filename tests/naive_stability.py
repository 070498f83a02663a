"""The Allan family as SP1065 writes it: loops, lists and materialized extensions.

Slow, readable, and importing nothing of the package: `x` is the accumulated angle one
sample apart, `m` the cluster in samples, and every function returns the variance in angle
per sample interval squared. NaN in `x` is a missing angle; `broken[i]` marks a break of the
sum between x[i] and x[i + 1].
"""

import math

import numpy as np


def angle(rates):
    return np.concatenate(([0.0], np.cumsum(rates)))


def _whole(x, indices, broken):
    low, high = min(indices), max(indices)
    return not any(math.isnan(x[i]) for i in indices) and not any(broken[low:high])


def _difference_variance(x, m, weights, *, divisor, stride, broken):
    broken = np.zeros(len(x), dtype=bool) if broken is None else broken
    reach = (len(weights) - 1) * m
    squares = []
    for i in range(0, len(x) - reach, stride):
        indices = [i + k * m for k in range(len(weights))]
        if _whole(x, indices, broken):
            squares.append(sum(w * x[k] for w, k in zip(weights, indices, strict=True)) ** 2)
    return math.fsum(squares) / (divisor * m * m * len(squares)), len(squares)


def adev(x, m, broken=None):
    return _difference_variance(x, m, (1, -2, 1), divisor=2, stride=m, broken=broken)


def oadev(x, m, broken=None):
    return _difference_variance(x, m, (1, -2, 1), divisor=2, stride=1, broken=broken)


def haar(x, m, broken=None):
    """Half the squared difference of neighbouring averages, halved again."""
    return _difference_variance(x, m, (1, -2, 1), divisor=4, stride=1, broken=broken)


def hdev(x, m, broken=None):
    return _difference_variance(x, m, (-1, 3, -3, 1), divisor=6, stride=m, broken=broken)


def ohdev(x, m, broken=None):
    return _difference_variance(x, m, (-1, 3, -3, 1), divisor=6, stride=1, broken=broken)


def mdev(x, m, broken=None):
    broken = np.zeros(len(x), dtype=bool) if broken is None else broken
    squares = []
    for j in range(len(x) - 3 * m + 1):
        if _whole(x, range(j, j + 3 * m), broken):
            inner = sum(x[i + 2 * m] - 2 * x[i + m] + x[i] for i in range(j, j + m))
            squares.append((inner / m) ** 2)
    return math.fsum(squares) / (2 * m * m * len(squares)), len(squares)


def tdev(x, m, broken=None):
    variance, terms = mdev(x, m, broken)
    return variance * m * m / 3.0, terms


def totdev(x, m):
    n = len(x)
    left = [2 * x[0] - x[k] for k in range(n - 1, 0, -1)]
    right = [2 * x[-1] - x[-1 - k] for k in range(1, n)]
    extended = [*left, *x, *right]
    squares = [
        (extended[n - 1 + i - m] - 2 * extended[n - 1 + i] + extended[n - 1 + i + m]) ** 2
        for i in range(1, n - 1)
    ]
    return math.fsum(squares) / (2 * m * m * (n - 2)), n - 2


def mtotdev(x, m):
    outer = []
    for start in range(len(x) - 3 * m + 1):
        part = np.array(x[start : start + 3 * m])
        half = (3 * m) // 2
        distance = 3 * m - half  # between the middles of the two halves
        slope = (part[-half:].mean() - part[:half].mean()) / distance
        part = part - slope * np.arange(3 * m)
        extended = np.concatenate((part[::-1], part, part[::-1]))
        squares = []
        for i in range(6 * m):
            averages = [extended[i + k * m : i + (k + 1) * m].mean() for k in range(3)]
            squares.append((averages[0] - 2 * averages[1] + averages[2]) ** 2)
        outer.append(sum(squares) / (6 * m))
    return math.fsum(outer) / (2 * m * m * len(outer)), 6 * m * len(outer)


def theo1(x, m):
    total = 0.0
    for i in range(len(x) - m):
        for delta in range(m // 2):
            first = x[i] - x[i - delta + m // 2]
            second = x[i + m] - x[i + delta + m // 2]
            total += (first + second) ** 2 / (m // 2 - delta)
    return total / (0.75 * (len(x) - m) * m * m), (len(x) - m) * (m // 2)


def theo1_bias_removed(x, m):
    n = math.floor(0.1 * len(x) / 3 - 3)
    ratios = [oadev(x, 9 + 3 * i)[0] / theo1(x, 12 + 4 * i)[0] for i in range(n + 1)]
    return theo1(x, m)[0] * sum(ratios) / len(ratios)


def greenhall_riley(alpha, order, m, samples, *, modified, overlapping, long_filter=False):
    """Degrees of freedom by the plain sums of the 2003 paper, term by term."""

    def s_w(t):
        t = abs(t)
        power = {2: -1, 1: 1, 0: 1, -1: -1, -2: -1, -3: 1, -4: 1}[alpha] * t ** (3 - alpha)
        if alpha % 2:
            return power * math.log(t) if t > 0 else 0.0
        return power

    factor = 1 if modified else m
    steps = m if overlapping else 1

    def s_x(t):
        if long_filter:  # the second derivative, for rate noise and F without limit
            k, t = 3 - alpha, abs(t)
            sign = {0: -1, -2: 1, -4: -1, -1: 1, -3: -1}[alpha]
            if alpha % 2:
                log = math.log(t) if t > 0 else 0.0
                return sign * t ** (k - 2) * (k * (k - 1) * log + 2 * k - 1)
            return sign * k * (k - 1) * t ** (k - 2)
        return factor**2 * (2 * s_w(t) - s_w(t - 1 / factor) - s_w(t + 1 / factor))

    def s_z(t):
        binomials = {2: (6, -4, 1), 3: (20, -15, 6, -1)}[order]
        return binomials[0] * s_x(t) + sum(
            b * (s_x(t - k) + s_x(t + k)) for k, b in enumerate(binomials[1:], start=1)
        )

    reach = m / factor + m * order
    terms = 1 + math.floor(steps * (samples - reach) / m)
    lags = min(terms, (order + 1) * steps)
    total = 1 + 2 * sum((1 - j / terms) * (s_z(j / steps) / s_z(0)) ** 2 for j in range(1, lags))
    return terms / total


def filter_degrees_of_freedom(weights, terms):
    """Exact degrees of freedom of `terms` filtered values of white noise in a row."""
    weights = np.asarray(weights, dtype=float)
    covariance = np.correlate(weights, weights, "full")[len(weights) - 1 :]
    rho = covariance[: min(terms, len(covariance))] / covariance[0]
    lags = np.arange(rho.size)
    return terms / (1 + 2 * np.sum((1 - lags[1:] / terms) * rho[1:] ** 2))


def power_law_rates(generator, samples, alpha):
    """Rates of spectrum f^alpha by fractional differencing of white noise (Kasdin 1995).

    The first half of what is made is let go, so that the filter does not start from rest.
    """
    made = 2 * samples
    response = np.ones(made)
    k = np.arange(1, made)
    response[1:] = np.cumprod((k - 1 - alpha / 2) / k)
    white = generator.standard_normal(made)
    rates = np.fft.irfft(np.fft.rfft(white, 2 * made) * np.fft.rfft(response, 2 * made), 2 * made)
    return rates[samples:made]
