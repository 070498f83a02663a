"""Azimuth by gyrocompass, and by a triad on a table that turns: error, and the floor of B.

A gyro whose input axis points east senses no Earth rate; if it is turned by a small angle psi, it
senses ``W cos(L) psi``. A drift of it is therefore taken for an azimuth error of the drift over
``W cos(L)``, with Earth rate W and latitude L.

A triad on a table that turns all the time averages bias out, and N not. In the axes of the table
Earth rate's horizontal part goes round once a turn, while biases stand still. Turned back by the
table's angle, a horizontal bias b of the triad averages to nothing over whole turns, as does what
is slow beside a turn: of B and K their spectrum at the table's rate remains, which adds to N^2
(Levinson and Giovanni, PLANS 1980). White noise has the same spectrum everywhere, so that rotation
leaves N^2: which is why N of a rate-biased gyro has to be known.
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.special import ndtri

from sagnac.alignment.noise import GyroNoise
from sagnac.arrays import FloatArray
from sagnac.coefficients.laws import allan_variance_basis
from sagnac.errors import quoted
from sagnac.units import DEGREE, EARTH_RATE

# ---- azimuth -----------------------------------------------------------------------

# Beyond this Earth rate has next to no north component, and azimuth is not found from it.
HIGHEST_LATITUDE: Final = 89.0 * DEGREE
_OF_NAMES: Final = [1, 2, 3]  # N, B and K among the five of Eq. 3


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class AzimuthError:
    """Standard deviation of azimuth after a time, and of what it is made.

    Attributes
    ----------
    times
        (times,), s.
    deviation, low, high
        (times,), rad, and its interval from the uncertainty of N, B and K.
    parts
        (times, 3) variances that N, B and K make, rad^2.
    floor
        Deviation that B leaves however long is averaged, rad.
    confidence
        Of the interval.
    """

    times: FloatArray
    deviation: FloatArray
    low: FloatArray
    high: FloatArray
    parts: FloatArray
    floor: float
    confidence: float


def azimuth_error(
    noise: GyroNoise,
    *,
    latitude: float,
    times: FloatArray,
    positions: int = 2,
    bias: float = 0.0,
    confidence: float = 0.95,
) -> AzimuthError:
    """Error of a gyrocompass that averages the gyro's rate.

    With two positions the gyro is turned by half a turn in the middle: half of the difference of
    the two means is free of bias, and its variance is that of Allan's over half of the time, by
    two: ``sigma^2(t/2) / 2``. With one position, whose bias was known when it began to within
    `bias`, it is ``N^2/t + K^2 t/3 + bias^2`` with the flicker of B on top, which is Allan's over
    the whole time: ``sigma^2(t) + bias^2``.

    Parameters
    ----------
    noise
        Of the gyro.
    latitude
        rad.
    times
        (times,), s, above zero.
    positions
        1 or 2.
    bias
        Standard deviation of what is not known of the bias, rad/s; without effect with two
        positions.
    confidence
        Of the interval.

    Raises
    ------
    ValueError
        If the latitude is within a degree of a pole, a time is not above zero, or `positions` is
        neither 1 nor 2.
    """
    rate = north_rate(latitude)
    moments = np.atleast_1d(np.asarray(times, dtype=np.float64))
    if not np.all((moments > 0.0) & np.isfinite(moments)):
        raise ValueError("times must be finite numbers of seconds above zero")
    if positions not in (1, 2):
        raise ValueError(f"positions is {quoted(positions)}; use 1 or 2")
    basis = allan_variance_basis(moments / positions)[:, _OF_NAMES] / positions
    parts = basis * noise.values**2 / rate**2
    constant = (bias / rate) ** 2 if positions == 1 else 0.0
    variance = parts.sum(axis=1) + constant
    slope = 2.0 * basis * noise.values / rate**2
    scatter = np.sqrt(np.einsum("ti,ij,tj->t", slope, noise.covariance, slope))
    # A variance stays above zero, so the interval is taken for its logarithm.
    reach = float(ndtri(0.5 + 0.5 * confidence)) * scatter / np.maximum(variance, 1e-300)
    deviation = np.sqrt(variance)
    floor = math.sqrt(float(basis[0, 1] * noise.bias_instability**2) / rate**2 + constant)
    return AzimuthError(
        times=moments,
        deviation=deviation,
        low=deviation * np.exp(-0.5 * reach),
        high=deviation * np.exp(0.5 * reach),
        parts=parts,
        floor=floor,
        confidence=confidence,
    )


def north_rate(latitude: float) -> float:
    """North component of Earth rate, rad/s.

    Raises
    ------
    ValueError
        If the latitude is within a degree of a pole.
    """
    if not abs(latitude) <= HIGHEST_LATITUDE:
        raise ValueError(
            f"latitude is {latitude / DEGREE:g} deg; give -89 to 89, since azimuth is not found "
            "from Earth rate nearer to a pole"
        )
    return EARTH_RATE * math.cos(latitude)


# ---- rotating ----------------------------------------------------------------------


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
        Of each gyro. For gyros that differ N^2 is the sum of theirs, each times (1 - e^2)/2: a gyro
        of share e in the table's rate has sqrt(1 - e^2) of its axis in the table's plane, and half
        of that square falls on north and on east each.
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
