"""Initial alignment at rest by a Kalman filter: what it starts from, and what it comes to."""

import math
from dataclasses import dataclass, field

import numpy as np

from sagnac.alignment.error_model import (
    AZIMUTH,
    DRIFTS,
    POSITIONS,
    STATES,
    TILTS,
    VELOCITIES,
    step_of,
)
from sagnac.alignment.noise import GyroNoise
from sagnac.arrays import FloatArray
from sagnac.errors import quoted
from sagnac.units import DEGREE


@dataclass(frozen=True, slots=True, kw_only=True)
class Start:
    """Standard deviations before the alignment, and what it measures.

    Attributes
    ----------
    tilt, azimuth
        After the coarse alignment, rad.
    drift
        What is not known of the bias of a gyro beside its flicker, rad/s.
    velocity_noise
        Of each zero-velocity measurement, m/s.
    step_s
        Time between measurements, s.
    """

    tilt: float = 0.5 * DEGREE
    azimuth: float = 2.0 * DEGREE
    drift: float = 0.0
    velocity_noise: float = 1e-4
    step_s: float = 1.0

    def __post_init__(self) -> None:
        for name in ("tilt", "azimuth", "velocity_noise", "step_s"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                raise ValueError(f"{name} is {quoted(value)}; give a finite number above zero")
        if not self.drift >= 0.0:
            raise ValueError(f"drift is {quoted(self.drift)}; give zero or more")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Alignment:
    """Covariance against time.

    Attributes
    ----------
    times
        (steps,), s.
    azimuth
        (steps,) its standard deviation, rad.
    covariance
        (10, 10) of `error_model.STATES` at the end, SI.
    """

    times: FloatArray
    azimuth: FloatArray
    covariance: FloatArray = field(repr=False)


def flicker_deviation(noise: GyroNoise) -> float:
    """Standard deviation of the drift that B leaves for an alignment: the floor of Allan's, rad/s.

    A flicker has no variance of its own; over some decades of time its mean wanders by the floor
    of the Allan deviation, ``B sqrt(2 ln 2 / pi)``, which a filter takes as a constant.
    """
    return noise.bias_instability * math.sqrt(2.0 * math.log(2.0) / math.pi)


def initial_covariance(noise: GyroNoise, start: Start | None = None) -> FloatArray:
    """(10, 10) a priori covariance of `error_model.STATES`, SI."""
    begun = start or Start()
    variances = np.zeros(len(STATES))
    variances[TILTS] = begun.tilt**2
    variances[AZIMUTH] = begun.azimuth**2
    variances[VELOCITIES] = begun.velocity_noise**2
    variances[POSITIONS] = 0.0
    variances[DRIFTS] = begun.drift**2 + flicker_deviation(noise) ** 2
    return np.diag(variances)


def gain_of(covariance: FloatArray, velocity_noise: float) -> FloatArray:
    """(10, 2) Kalman gain of a zero-velocity measurement."""
    seen = covariance[VELOCITIES, VELOCITIES] + velocity_noise**2 * np.eye(2)
    return np.asarray(np.linalg.solve(seen, covariance[VELOCITIES, :]).T)


def updated(covariance: FloatArray, gain: FloatArray, velocity_noise: float) -> FloatArray:
    """(10, 10) covariance after a zero-velocity measurement, in Joseph's form."""
    left = np.eye(len(STATES))
    left[:, VELOCITIES] -= gain
    return np.asarray(left @ covariance @ left.T + velocity_noise**2 * (gain @ gain.T))


def aligned(
    noise: GyroNoise, *, latitude: float, seconds: float, start: Start | None = None
) -> Alignment:
    """Covariance of an alignment at rest that measures zero velocity.

    Accelerometers are taken as free of bias: a bias tilts the level by itself over gravity, and
    shifts azimuth by that of the east accelerometer times the tangent of latitude.

    Parameters
    ----------
    noise
        Of each gyro.
    latitude
        rad.
    seconds
        Length of the alignment.
    start
        What it starts from.

    Raises
    ------
    ValueError
        If it is shorter than one step, or the latitude is within a degree of a pole.
    """
    begun = start or Start()
    steps = round(seconds / begun.step_s) if math.isfinite(seconds) else 0
    if steps < 1:
        raise ValueError(f"seconds is {quoted(seconds)}; give {begun.step_s:g} or more")
    step = step_of(noise, latitude, begun.step_s)
    covariance = initial_covariance(noise, begun)
    azimuth = np.empty(steps)
    for number in range(steps):
        covariance = step.transition @ covariance @ step.transition.T + step.noise
        gain = gain_of(covariance, begun.velocity_noise)
        covariance = updated(covariance, gain, begun.velocity_noise)
        azimuth[number] = math.sqrt(covariance[AZIMUTH, AZIMUTH])
    return Alignment(
        times=begun.step_s * np.arange(1.0, steps + 1.0), azimuth=azimuth, covariance=covariance
    )
