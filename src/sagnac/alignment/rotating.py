"""Azimuth by a triad on a table that turns all the time: bias is averaged out, N is not.

In the axes of the table Earth rate's horizontal part goes round once a turn, while biases stand
still. Turned back by the table's angle, a horizontal bias b of the triad averages to nothing over
whole turns, as does what is slow beside a turn: of B and K their spectrum at the table's rate
remains, which adds to N^2 (Levinson and Giovanni, PLANS 1980). White noise has the same spectrum
everywhere, so that rotation leaves N^2: which is why N of a rate-biased gyro has to be known.
"""

import math
from collections.abc import Sequence

import numpy as np
from scipy.special import ndtri

from sagnac.alignment.azimuth import AzimuthError, north_rate
from sagnac.alignment.noise import GyroNoise
from sagnac.arrays import FloatArray

_EQUAL = (1.0 / math.sqrt(3.0),) * 3


def horizontal_weights(shares: Sequence[float] = _EQUAL) -> FloatArray:
    """(3,) parts of each gyro's N^2 in that of a horizontal axis, averaged over a turn.

    A gyro of share e in the table's rate has sqrt(1 - e^2) of its axis in the table's plane, and
    half of that square falls on north and on east each.

    Raises
    ------
    ValueError
        If the squares of the shares do not add up to 1: the triad is orthogonal.
    """
    squares = np.square(np.asarray(shares, dtype=np.float64))
    if squares.shape != (3,) or not abs(float(squares.sum()) - 1.0) < 1e-6:
        raise ValueError(f"shares are {list(shares)}; give three whose squares add up to 1")
    return np.asarray(0.5 * (1.0 - squares))


def rotating_azimuth_error(
    noise: GyroNoise,
    *,
    latitude: float,
    times: FloatArray,
    table_rate: float,
    bias: float = 0.0,
    confidence: float = 0.95,
) -> AzimuthError:
    """Error of a gyrocompass that averages an orthogonal triad turning at a constant rate.

    With equal gyros the variance is ``(N^2 + B^2/W + 2 K^2/W^2) / t`` over the square of Earth
    rate's north component, W being the table's rate: the spectra B^2/(2 pi f) and K^2/(2 pi f)^2 at
    the frequency of the turns, the second of which leaks as much again from below over whole
    turns (and the first 2 % of it over twenty turns, 15 % over one, which is left out). A part of a
    turn leaves at most 2/(W t) of a bias.

    Parameters
    ----------
    noise
        Of each gyro; for gyros that differ, with N^2 as `horizontal_weights` mix it.
    latitude
        rad.
    times
        (times,), s, of one turn and more.
    table_rate
        rad/s.
    bias
        Standard deviation of what is not known of each gyro's bias, rad/s.
    confidence
        Of the interval.

    Raises
    ------
    ValueError
        If the latitude is within a degree of a pole, the table stands still, or a time is shorter
        than a turn.
    """
    north = north_rate(latitude)
    if not (math.isfinite(table_rate) and table_rate != 0.0):
        raise ValueError(f"table_rate is {table_rate!r}; give the rate of a turning table, rad/s")
    speed = abs(table_rate)
    moments = np.atleast_1d(np.asarray(times, dtype=np.float64))
    if not np.all(np.isfinite(moments) & (moments * speed >= 2.0 * math.pi * (1.0 - 1e-9))):
        raise ValueError(f"times must be of a turn, {2.0 * math.pi / speed:.4g} s, and longer")
    weights = np.array([1.0, 1.0 / speed, 2.0 / speed**2])
    parts = weights * noise.values**2 / north**2 / moments[:, np.newaxis]
    # Half of a bias' square falls on each axis of the plane, and the mean of exp(i W t) is a sinc.
    turned = speed * moments
    left = 2.0 * (1.0 - np.cos(turned)) / turned**2 * (bias / north) ** 2
    variance = parts.sum(axis=1) + left
    slope = 2.0 * weights * noise.values / north**2 / moments[:, np.newaxis]
    scatter = np.sqrt(np.einsum("ti,ij,tj->t", slope, noise.covariance, slope))
    reach = float(ndtri(0.5 + 0.5 * confidence)) * scatter / np.maximum(variance, 1e-300)
    deviation = np.sqrt(variance)
    return AzimuthError(
        times=moments,
        deviation=deviation,
        low=deviation * np.exp(-0.5 * reach),
        high=deviation * np.exp(0.5 * reach),
        parts=parts,
        floor=0.0,
        confidence=confidence,
    )
