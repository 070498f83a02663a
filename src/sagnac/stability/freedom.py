"""Published degrees of freedom of stability variances: one function for each family.

Each law takes the power law of the rate noise, the cluster in samples, the number of accumulated
angles, and the number of outer windows averaged.

References
----------
Greenhall and Riley
    Uncertainty of stability variances based on finite differences, PTTI 2003; the s_w, s_x and s_z
    are theirs.
SP1065
    W. J. Riley, Handbook of Frequency Stability Analysis, NIST SP 1065, 2008, section 5.4.
"""

import math
from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Final

import numpy as np
from scipy.special import comb

from sagnac.core.arrays import FloatArray

# ---- laws --------------------------------------------------------------------------

# Given noise type, cluster, angles and windows.
FreedomLaw = Callable[[int, int, int, int], float]

# Effective cluster time of Theo1 as a share of its span.
THEO1_EFFECTIVE: Final = 0.75
# edf = b T / tau - c: SP1065 Tables 7 and 8.
Table = Mapping[int, tuple[float, float]]
_TOTAL: Final = {0: (1.5, 0.0), -1: (1.17, 0.22), -2: (0.93, 0.36)}


@lru_cache(maxsize=4096)
def greenhall_riley_freedom(
    noise_type: int,
    cluster: int,
    angles: int,
    windows: int,
    *,
    order: int = 2,
    overlapping: bool = True,
    modified: bool = False,
) -> float:
    """Exact degrees of freedom of M = `windows` squared differences in a row, S to a cluster.

    ``1/edf = (1/M) (1 + 2 sum_j (1 - j/M) (s_z(j/S)/s_z(0))**2)`` over j < min(M, (d+1) S), d being
    the order.

    The filter factor F is 1 for modified variances, m for plain ones, and infinite for long
    clusters of rate noise, as in the paper.

    Windows on both sides of a gap are taken as if they stood in one row. That is the safe side:
    apart they are less correlated.

    Parameters
    ----------
    noise_type
        Power law of the rate noise, 2 to -4.
    cluster
        m: tau = m tau0.
    angles
        In the record, which make no difference beside the windows.
    windows
        Squared differences averaged.
    order
        Of the differences, 2 or 3.
    overlapping
        Whether differences start at every sample, or at every m-th.
    modified
        Whether angles are averaged over a cluster first.
    """
    is_long = noise_type <= 0 and cluster * (order + 1) > 100
    filter_factor = 1.0 if modified else math.inf if is_long else float(cluster)
    steps = cluster if overlapping else 1
    lags, weights = _lags(min(windows, (order + 1) * steps), steps)
    shares = difference_covariance(np.append(0.0, lags / steps), filter_factor, noise_type, order)
    shares /= shares[0]
    total = float(np.sum(weights * (1.0 - lags / windows) * shares[1:] ** 2))
    return 1.0 / ((1.0 + 2.0 * total) / windows)


def total_freedom(noise_type: int, cluster: int, angles: int, windows: int) -> float:
    """Total variance: SP1065 Table 7, and by counting for angle noise, which it leaves out."""
    if noise_type > 0:
        # White angle noise: (tr Q)^2 / tr Q^2 of the total variance, to leading order. Each
        # reflected difference holds an end of the record twice, and that one angle, met in every
        # reflected difference, is what rules long clusters.
        n, m = float(angles), float(cluster)
        if 2 * cluster < angles:
            inner = n - 2.0 * m
            return (6.0 * inner + 20.0 * m) ** 2 / (70.0 * inner + 32.0 * m * m + 340.0 * m)
        one, both = n - m, 2.0 * m - n  # differences that hold one end, and both
        return (20.0 * one + 14.0 * both) ** 2 / (32.0 * (one + both) ** 2 + 32.0 * both**2)
    # The table is for long clusters; Stein's factor for white rate leads up to them.
    led_up = 4.0 * cluster**2 / (4.0 * cluster**2 + 5.0) if noise_type == 0 else 1.0
    return _tabled(_TOTAL, noise_type, cluster, angles, led_up)


def modified_total_freedom(noise_type: int, cluster: int, angles: int, windows: int) -> float:
    """Modified total variance: SP1065 Table 8."""
    table = {2: (1.9, 2.1), 1: (1.2, 1.4), 0: (1.1, 1.2), -1: (0.85, 0.5), -2: (0.75, 0.31)}
    return _tabled(table, noise_type, cluster, angles)


def _tabled(table: Table, noise_type: int, cluster: int, angles: int, factor: float = 1.0) -> float:
    """By slope and offset of a noise type, and no more than at one sample.

    There these fits for long clusters run past.
    """
    alpha = max(noise_type, -2)
    slope, offset = table[alpha]
    largest = greenhall_riley_freedom(alpha, 1, angles, angles - 2)
    return min(max(factor * (slope * ((angles - 1) / cluster) - offset), 0.5), largest)


def theo1_freedom(noise_type: int, span: int, angles: int, windows: int) -> float:
    """Theo1: SP1065 Table 9, at its effective cluster time."""
    return max(_theo1_table(max(noise_type, -2), THEO1_EFFECTIVE * span, angles), 1.0)


def _theo1_table(alpha: int, tau: float, angles: int) -> float:
    """SP1065 Table 9, `tau` in samples."""
    n = float(angles)
    if alpha == 2:
        return (0.86 * (n + 1.0) * (n - 4.0 / 3.0 * tau) / (n - tau)) * (tau / (tau + 1.14))
    if alpha == 1:
        squares = 4.798 * n * n - 6.374 * n * tau + 12.387 * tau
        return squares / (math.sqrt(tau + 36.6) * (n - tau)) * (tau / (tau + 0.3))
    if alpha == 0:
        rise = tau * math.sqrt(tau)
        return ((4.1 * n + 0.8) / tau - (3.1 * n + 6.5) / n) * (rise / (rise + 5.2))
    if alpha == -1:
        return (2.0 * n * n - 1.3 * n * tau - 3.5 * tau) / (n * tau) * (tau**3 / (tau**3 + 2.3))
    scaled = 4.4 * n - 1.0
    squares = scaled**2 - 8.6 * tau * scaled + 11.4 * tau**2
    return (4.4 * n - 2.0) / (2.9 * tau) * squares / (4.4 * n - 3.0) ** 2


# ---- finite differences ------------------------------------------------------------

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(8)
# Lags beside a whole cluster that are summed one by one.
_DIRECT: Final = 64


@lru_cache(maxsize=1024)
def _lags(stop: int, steps: int) -> tuple[FloatArray, FloatArray]:
    """Lags and weights whose sum is that over j = 1 ... stop - 1.

    Between whole clusters, where s_z is smooth, far lags go by Gauss-Legendre panels that double in
    width away from each whole cluster.
    """
    lags, weights = [], []
    for knot in range(0, stop, steps):
        end = min(knot + steps, stop)
        middle = (knot + end) // 2
        for origin, length, sign in ((knot, middle - knot, 1), (end - 1, end - middle, -1)):
            near = np.arange(min(_DIRECT, length))
            octaves = max(0, math.ceil(math.log2(max(length, 1) / _DIRECT)))
            starts = _DIRECT * 2 ** np.arange(octaves)
            stops = np.minimum(2 * starts, length)
            # The sum over whole j from a start to before a stop is the integral half a step wider.
            half = 0.5 * (stops - starts)[:, np.newaxis]
            far = 0.5 * (starts + stops)[:, np.newaxis] - 0.5 + half * _NODES
            lags += [origin + sign * near, origin + sign * far.ravel()]
            weights += [np.ones(near.size), (half * _WEIGHTS).ravel()]
    every, weight = np.concatenate(lags, dtype=np.float64), np.concatenate(weights)
    return every[every > 0.0], weight[every > 0.0]


def difference_covariance(t: FloatArray, factor: float, alpha: int, order: int) -> FloatArray:
    """s_z(t): covariance of the differences of an order, from binomials of s_x."""
    shifts = np.arange(-order, order + 1)
    binomials = (-1.0) ** shifts * comb(2 * order, order + shifts)
    structure = _filtered_structure(t + shifts[:, np.newaxis], 1.0 / factor, alpha)
    return np.asarray(binomials @ structure)


def _filtered_structure(t: FloatArray, h: float, alpha: int) -> FloatArray:
    """s_x(t) = F^2 (2 s_w(t) - s_w(t - h) - s_w(t + h)), h = 1/F.

    s_w is the generalized autocovariance of the continuous angle noise up to a factor: a power of
    t, times its logarithm for odd alpha. Away from zero the second difference is written out, so
    that a cluster of a million samples costs no digits. For h = 0 it is the second derivative.
    """
    t, power = np.abs(t), 3 - alpha
    near, result = (t < h) | (t == 0.0), np.zeros_like(t)
    far = t[~near]
    result[~near] = _far_flicker(far, h, power) if alpha % 2 else _far_power(far, h, power)
    if h > 0.0:
        places = np.abs(t[near] + h * np.array([[-1.0], [0.0], [1.0]]))
        structure = places**power
        if alpha % 2:
            structure *= np.log(np.where(places > 0.0, places, 1.0))
        result[near] = np.array([1.0, -2.0, 1.0]) @ structure / (h * h)
    return -result if alpha in {1, 0, -3, -4} else result


def _far_power(t: FloatArray, h: float | FloatArray, power: int) -> FloatArray:
    """((t - h)^p - 2 t^p + (t + h)^p) / h^2 of an integer power, t >= h, without cancellation."""
    total = np.zeros_like(t)
    for k in range(2, power + 1, 2):
        total += 2.0 * math.comb(power, k) * t ** (power - k) * h ** (k - 2)
    return total


def _far_flicker(t: FloatArray, h: float, power: int) -> FloatArray:
    """The same of t^p ln t, an even power, t >= h > 0 or t > 0."""
    u = h / t
    # Its limits stand at both ends.
    v = np.where((u < 1e-4) | (u >= 1.0), 0.5, u)
    odd = ((1.0 + v) ** power * np.log1p(v) + (1.0 - v) ** power * np.log1p(-v)) / v**2
    odd = np.where(u < 1e-4, 2.0 * power - 1.0, np.where(u < 1.0, odd, 2.0**power * math.log(2.0)))
    return np.asarray(t ** (power - 2) * (_far_power(np.ones_like(t), u, power) * np.log(t) + odd))
