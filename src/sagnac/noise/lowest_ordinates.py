"""Largest N that the lowest frequencies of an angle allow beside white noise of its readings.

Noise of the readings of an angle rises as f^2 in the spectrum of its rate: it hides N least at the
lowest frequencies. There it is no small matter what a window does: in the cosine transform of the
increments the readings at both ends stand at every frequency. The sine transform (DST-I) has
neither end. In it the increments of means of white noise and of a walk are exactly uncorrelated at
every length, since the covariance of both is tridiagonal and the same along its diagonals:

    m_k = N^2 T (2 + cos w_k) / 3 + q 4 sin^2 (w_k / 2),   w_k = pi k / averages.

What else moves the angle slowly (a constant rate, the table's own motion by an error of the share
or by a delay) is given to it as columns whose factors are integrated out (restricted likelihood).
Every N^2 and q that the ordinates allow keeps its weight, N^2 as evenly as q in its logarithm, and
the bound is the quantile of N. Any other noise only raises it.
"""

import math
from collections.abc import Sequence
from typing import Final

import numpy as np
from scipy.fft import dst

from sagnac.core.arrays import FloatArray
from sagnac.core.errors import require_confidence

# Ordinates looked at, and the fewest beside those of lines.
_LOWEST: Final = 64
_LEAST: Final = 16
# Parts of the mean ordinate between which N^2 T is looked for, and of the readings' law those of q.
_WALKS: Final = (1e-4, 1e1, 200)
_READINGS: Final = (1e-6, 1e2, 80)
# Part of its size below which a column is rounding.
_ROUNDING: Final = 1e-9

LEAST_AVERAGES: Final = 8 * _LOWEST
"""Fewest averages of an angle whose lowest ordinates are looked at."""


def highest_walk(
    averages: FloatArray,
    motions: FloatArray,
    *,
    interval: float,
    masked: Sequence[tuple[float, float]] = (),
    confidence: float = 0.95,
) -> float:
    """Largest N that the lowest ordinates of an angle allow.

    Parameters
    ----------
    averages
        (averages,) of an angle over stretches of equal length, one after another, rad.
    motions
        (columns, averages), angles of any unit that it may hold besides, each with a factor of its
        own; a straight line is allowed for without being asked.
    interval
        Length of a stretch, s.
    masked
        (low, high) bands of lines, Hz, to leave out.
    confidence
        That N lies below.

    Returns
    -------
    float
        rad/sqrt(s); infinite if too few ordinates are left.

    Raises
    ------
    ValueError
        If there are too few averages, or an argument makes no sense.
    """
    require_confidence(confidence)
    size = averages.size
    if size < LEAST_AVERAGES or motions.shape[1:] != (size,):
        raise ValueError(
            f"averages has shape {averages.shape} and motions {motions.shape}; give "
            f"{LEAST_AVERAGES} averages or more, and as many of each motion"
        )
    if not interval > 0.0:
        raise ValueError(f"interval is {interval}; give s above zero")
    index = np.arange(1, size)[:_LOWEST]
    frequency, cell = index / (2.0 * size * interval), 1.0 / (size * interval)
    kept = np.ones(index.size, dtype=np.bool_)
    for low, high in masked:
        kept &= (frequency < low - cell) | (frequency > high + cell)
    columns = _columns(motions)[:, index - 1][:, kept]
    angle = 0.5 * np.pi * index[kept] / size
    laws = np.stack([(2.0 + np.cos(2.0 * angle)) / 3.0, 4.0 * np.sin(angle) ** 2])
    power = _ordinates(averages)[index - 1][kept]
    if power.size < _LEAST or not np.any(power):
        return math.inf
    square = _quantile(power, columns, laws, confidence)
    return math.sqrt(square / interval)


def _ordinates(averages: FloatArray) -> FloatArray:
    """(averages - 1,) orthonormal sine transform of the increments."""
    return np.asarray(dst(np.diff(averages), type=1, norm="ortho"))


def _columns(motions: FloatArray) -> FloatArray:
    """(columns, averages - 1) transforms of a straight line and of motions beside it."""
    size = motions.shape[1]
    beside = [each - np.linspace(each[0], each[-1], size) for each in motions]
    moving = [
        one
        for one, each in zip(beside, motions, strict=True)
        if np.abs(one).max() > _ROUNDING * np.abs(each).max()
    ]
    return np.stack([_ordinates(each) for each in (np.arange(float(size)), *moving)])


def _quantile(power: FloatArray, columns: FloatArray, laws: FloatArray, confidence: float) -> float:
    """Quantile of N^2 T over all N^2 T and q, factors of the columns integrated out."""
    # Columns that are nearly one another stay apart from rounding.
    columns = np.linalg.qr(columns.T)[0].T
    products = columns[:, np.newaxis] * columns
    rest = power - columns.T @ (columns @ power)
    walks = np.geomspace(*_WALKS) * float(np.mean(rest**2))
    readings = np.geomspace(*_READINGS) * float(np.median(rest**2 / laws[1]))
    logarithm = np.empty((walks.size, readings.size))
    for row, walk in enumerate(walks):
        mean = walk * laws[0] + readings[:, np.newaxis] * laws[1]
        weight = 1.0 / mean
        normal = np.einsum("qk,ijk->qij", weight, products)
        right = (weight * rest) @ columns.T
        fitted = np.linalg.solve(normal, right[..., np.newaxis])[..., 0]
        square = weight @ rest**2 - np.sum(right * fitted, axis=1)
        logarithm[row] = -0.5 * (np.log(mean).sum(axis=1) + np.linalg.slogdet(normal)[1] + square)
    # Both grids are even in the logarithm.
    density = np.exp(logarithm - logarithm.max()).sum(axis=1) * np.sqrt(walks)
    below = (np.cumsum(density) - 0.5 * density) / density.sum()
    return float(np.interp(confidence, below, walks))
