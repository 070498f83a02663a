"""Exact degrees of freedom of a mean of squared differences of power-law noise.

References
----------
Greenhall and Riley
    Uncertainty of stability variances based on finite differences, PTTI 2003; the s_w, s_x and s_z
    are theirs.
"""

import math
from typing import Final

import numpy as np

from sagnac.arrays import FloatArray

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(8)
# Lags beside a whole cluster that are summed one by one.
_DIRECT: Final = 64
# Binomials of the covariance of differences of an order, at lags -order ... order.
_BINOMIALS: Final = {
    2: np.array([1.0, -4.0, 6.0, -4.0, 1.0]),
    3: np.array([-1.0, 6.0, -15.0, 20.0, -15.0, 6.0, -1.0]),
}


def inverse_freedom(terms: int, steps: int, filter_factor: float, alpha: int, order: int) -> float:
    """1/edf of a mean of `terms` squared differences, `steps` of them to one cluster.

    ``(1/M) (1 + 2 sum_j (1 - j/M) (s_z(j/S)/s_z(0))**2)`` over j < min(M, (d+1) S).

    Parameters
    ----------
    terms, steps
        M and S.
    filter_factor
        F, which may be infinite for alpha <= 0.
    alpha
        Power law of the rate noise, 2 to -4.
    order
        d of the differences, 2 or 3.
    """
    lags, weights = _lags(min(terms, (order + 1) * steps), steps)
    shares = difference_covariance(np.append(0.0, lags / steps), filter_factor, alpha, order)
    shares /= shares[0]
    total = float(np.sum(weights * (1.0 - lags / terms) * shares[1:] ** 2))
    return (1.0 + 2.0 * total) / terms


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
            starts = _DIRECT * 2 ** np.arange(
                max(0, math.ceil(math.log2(max(length, 1) / _DIRECT)))
            )
            stops = np.minimum(2 * starts, length)
            # The sum over whole j from a start to before a stop is the integral half a step wider.
            half = 0.5 * (stops - starts)[:, np.newaxis]
            far = 0.5 * (starts + stops)[:, np.newaxis] - 0.5 + half * _NODES
            lags += [origin + sign * near, origin + sign * far.ravel()]
            weights += [np.ones(near.size), (half * _WEIGHTS).ravel()]
    every, weight = np.concatenate(lags, dtype=np.float64), np.concatenate(weights)
    return every[every > 0.0], weight[every > 0.0]


def difference_covariance(
    t: FloatArray, filter_factor: float, alpha: int, order: int
) -> FloatArray:
    """s_z(t): covariance of the differences of an order, from binomials of s_x."""
    shifts = np.arange(-order, order + 1)[:, np.newaxis]
    return np.asarray(
        _BINOMIALS[order] @ _filtered_structure(t + shifts, 1.0 / filter_factor, alpha)
    )


def _filtered_structure(t: FloatArray, h: float, alpha: int) -> FloatArray:
    """s_x(t) = F^2 (2 s_w(t) - s_w(t - h) - s_w(t + h)), h = 1/F.

    Away from zero the second difference is written out, so that a cluster of a million samples
    costs no digits. For h = 0 it is the second derivative.
    """
    t = np.abs(t)
    near = (t < h) | (t == 0.0)
    result = np.zeros_like(t)
    beyond = _filtered_flicker if alpha % 2 else _filtered_power
    result[~near] = beyond(t[~near], h, alpha)
    if h > 0.0:
        inside = t[near]
        both = _structure(inside - h, alpha) + _structure(inside + h, alpha)
        result[near] = (2.0 * _structure(inside, alpha) - both) / (h * h)
    return result


def _structure(t: FloatArray, alpha: int) -> FloatArray:
    """s_w(t): generalized autocovariance of the continuous angle noise, up to a factor."""
    t = np.abs(t)
    power = t ** (3 - alpha)
    if alpha % 2:
        power *= np.log(np.where(t > 0.0, t, 1.0))
    return power if alpha in {1, 0, -3, -4} else -power


def _filtered_power(t: FloatArray, h: float, alpha: int) -> FloatArray:
    """s_x(t) beyond the filter, t >= h, for an even alpha: a polynomial."""
    if alpha == 2:
        return np.zeros_like(t)
    if alpha == 0:
        return -6.0 * t
    if alpha == -2:
        return 20.0 * t**3 + 10.0 * t * h * h
    return -(42.0 * t**5 + 70.0 * t**3 * h**2 + 14.0 * t * h**4)


def _filtered_flicker(t: FloatArray, h: float, alpha: int) -> FloatArray:
    """s_x(t) beyond the filter, t >= h > 0 or t > 0, for an odd alpha: powers times logarithms."""
    u = h / t
    power = 3 - alpha
    even = {1: 2.0, -1: 12.0 + 2.0 * u**2, -3: 30.0 + 30.0 * u**2 + 2.0 * u**4}[alpha]
    # Its limits stand at both ends.
    v = np.where((u < 1e-4) | (u >= 1.0), 0.5, u)
    odd = ((1.0 + v) ** power * np.log1p(v) + (1.0 - v) ** power * np.log1p(-v)) / v**2
    odd = np.where(u < 1e-4, 2.0 * power - 1.0, np.where(u < 1.0, odd, 2.0**power * math.log(2.0)))
    value = np.asarray(t ** (power - 2) * (even * np.log(t) + odd))
    return value if alpha == -1 else -value
