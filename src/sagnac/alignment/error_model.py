"""Errors of a navigator at rest, as a linear system: tilts, azimuth, velocity, position, biases.

In north-east-down axes with the tilts phi, ``phi' = -w x phi + dw - e`` and ``dv' = f x phi``
(the phi-angle model; Titterton and Weston, *Strapdown Inertial Navigation Technology*, 12.3),
with Earth rate and that of the velocity over the Earth in w, the drifts e of the gyros, and the
specific force f, which is gravity alone. Coriolis terms of the velocity error are left out: they
turn the Schuler oscillation slowly and leave its size.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.linalg import expm

from sagnac.alignment.azimuth import north_rate
from sagnac.alignment.noise import GyroNoise
from sagnac.arrays import FloatArray
from sagnac.errors import quoted
from sagnac.units import EARTH_RATE

STATES: Final = (
    "tilt_north",
    "tilt_east",
    "azimuth",
    "velocity_north",
    "velocity_east",
    "position_north",
    "position_east",
    "drift_north",
    "drift_east",
    "drift_down",
)
TILTS: Final = slice(0, 3)
AZIMUTH: Final = 2
VELOCITIES: Final = slice(3, 5)
POSITIONS: Final = slice(5, 7)
DRIFTS: Final = slice(7, 10)
GRAVITY: Final = 9.80665  # m/s^2, standard
EARTH_RADIUS: Final = 6_371_000.0  # m, mean


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Step:
    """One step of a fixed length.

    Attributes
    ----------
    transition, noise
        (10, 10) ``x -> transition x``, to which noise of this covariance is added.
    """

    transition: FloatArray
    noise: FloatArray


def system_matrix(latitude: float) -> FloatArray:
    """(10, 10) derivative of `STATES` by themselves, SI.

    Parameters
    ----------
    latitude
        rad.

    Raises
    ------
    ValueError
        If the latitude is within a degree of a pole.
    """
    north = north_rate(latitude)
    down = -EARTH_RATE * np.sin(latitude)
    system = np.zeros((len(STATES), len(STATES)))
    system[TILTS, TILTS] = [[0.0, down, 0.0], [-down, 0.0, north], [0.0, -north, 0.0]]
    system[TILTS, VELOCITIES] = [
        [0.0, 1.0 / EARTH_RADIUS],
        [-1.0 / EARTH_RADIUS, 0.0],
        [0.0, -np.tan(latitude) / EARTH_RADIUS],
    ]
    # A wrong latitude is a wrong Earth rate.
    system[TILTS, 5] = [down / EARTH_RADIUS, 0.0, -north / EARTH_RADIUS]
    system[TILTS, DRIFTS] = -np.eye(3)
    system[VELOCITIES, TILTS] = [[0.0, GRAVITY, 0.0], [-GRAVITY, 0.0, 0.0]]
    system[POSITIONS, VELOCITIES] = np.eye(2)
    return system


def step_of(noise: GyroNoise, latitude: float, seconds: float) -> Step:
    """One step by Van Loan's exponential (*IEEE Trans. Automat. Control* 23, 395, 1978).

    Parameters
    ----------
    noise
        Of each of the three gyros: N drives the tilts, K the drifts.
    latitude
        rad.
    seconds
        Length of the step.

    Raises
    ------
    ValueError
        If the step is not above zero, or the latitude is within a degree of a pole.
    """
    if not seconds > 0.0:
        raise ValueError(f"seconds is {quoted(seconds)}; give a time above zero")
    system = system_matrix(latitude)
    count = len(STATES)
    driven = np.zeros((count, count))
    driven[TILTS, TILTS] = noise.angle_random_walk**2 * np.eye(3)
    driven[DRIFTS, DRIFTS] = noise.rate_random_walk**2 * np.eye(3)
    block = np.zeros((2 * count, 2 * count))
    block[:count, :count] = -system
    block[:count, count:] = driven
    block[count:, count:] = system.T
    grown = expm(block * seconds)
    transition = grown[count:, count:].T
    return Step(transition=transition, noise=transition @ grown[:count, count:])
