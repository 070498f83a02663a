"""Azimuth by gyrocompass: its error against time and latitude, and the floor that B sets.

A gyro whose input axis points east senses no Earth rate; if it is turned by a small angle psi, it
senses ``W cos(L) psi``. A drift of it is therefore taken for an azimuth error of the drift over
``W cos(L)``, with Earth rate W and latitude L.
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
