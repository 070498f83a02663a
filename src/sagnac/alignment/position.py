"""How the position of a navigator at rest goes off after its alignment."""

import math
from dataclasses import dataclass

import numpy as np

from sagnac.alignment.error_model import POSITIONS, step_of
from sagnac.alignment.noise import GyroNoise
from sagnac.arrays import FloatArray
from sagnac.errors import quoted


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PositionError:
    """Standard deviation of horizontal position against time.

    Attributes
    ----------
    times
        (steps,) since the end of the alignment, s.
    deviation
        (steps,) root of the sum of the variances north and east, m.
    """

    times: FloatArray
    deviation: FloatArray


def position_error(
    noise: GyroNoise,
    *,
    latitude: float,
    covariance: FloatArray,
    seconds: float,
    steps: int = 240,
) -> PositionError:
    """Position error that gyros and alignment make without any further measurement.

    Parameters
    ----------
    noise
        Of each gyro.
    latitude
        rad.
    covariance
        (10, 10) at the end of the alignment, as `initial.aligned` gives it. An azimuth error and
        the drift that caused it cancel in it: what is left grows much more slowly than either.
    seconds
        How long.
    steps
        How many times are given.

    Raises
    ------
    ValueError
        If the time is not above zero, or the latitude is within a degree of a pole.
    """
    if not (seconds > 0.0 and math.isfinite(seconds)):
        raise ValueError(f"seconds is {quoted(seconds)}; give a time above zero")
    step = step_of(noise, latitude, seconds / steps)
    deviation = np.empty(steps)
    for number in range(steps):
        covariance = step.transition @ covariance @ step.transition.T + step.noise
        deviation[number] = math.sqrt(float(np.trace(covariance[POSITIONS, POSITIONS])))
    return PositionError(times=seconds / steps * np.arange(1.0, steps + 1.0), deviation=deviation)
