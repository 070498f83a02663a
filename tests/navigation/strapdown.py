"""A strapdown navigator at rest that aligns itself in a closed loop, many runs at once.

Attitudes are whole rotation matrices and the corrections are fed back at every step, so that
nothing of the linear error model is used but the filter's own matrices.
"""

from dataclasses import replace

import numpy as np

from sagnac.core.units import EARTH_RATE, STANDARD_GRAVITY
from sagnac.navigation.error_model import (
    DRIFTS,
    EARTH_RADIUS,
    POSITIONS,
    STATES,
    TILTS,
    VELOCITIES,
    Start,
    initial_covariance,
    step_of,
    updated,
)
from sagnac.navigation.noise import GyroNoise
from sagnac.rig.config import RigConfig
from sagnac.rig.gyro import Gyro
from sagnac.rig.sections import GyroConfig, TableConfig
from sagnac.rig.table import Motion, RandomStreams, Table


def rig_noise(config: GyroConfig, *, runs: int, steps: int, seed: int) -> np.ndarray:
    """(runs, steps, 3) angle errors of the rig's gyros in each second, rad."""
    still = Motion(
        angle=np.zeros(steps), turned=np.zeros((3, steps)), moving=np.zeros(steps, dtype=bool)
    )
    config = replace(config, quantization_step_arcsec=0.0)
    rig = RigConfig(
        duration_s=float(steps),
        sample_rate_hz=1.0,
        table=TableConfig(rate_deg_per_s=0.0),
        gyro=config,
    )
    streams = RandomStreams(seed)
    table = Table(rig, streams)
    noise = np.empty((runs, steps, 3))
    for run in range(runs):
        for axis in range(3):
            gyro = Gyro(rig, "gyro", axis, streams, table)
            angles = np.zeros(steps)
            gyro.advance(0, still, angles)
            noise[run, :, axis] = np.diff(angles, prepend=0.0)
    return noise


def rotation(vectors: np.ndarray) -> np.ndarray:
    """(runs, 3, 3) rotation by each of (runs, 3) small vectors, to the third order."""
    cross = np.zeros((vectors.shape[0], 3, 3))
    cross[:, 0, 1], cross[:, 0, 2] = -vectors[:, 2], vectors[:, 1]
    cross[:, 1, 0], cross[:, 1, 2] = vectors[:, 2], -vectors[:, 0]
    cross[:, 2, 0], cross[:, 2, 1] = -vectors[:, 1], vectors[:, 0]
    square = cross @ cross
    return np.eye(3) + cross + square / 2.0 + square @ cross / 6.0


def azimuth_errors(
    noise: GyroNoise, angles: np.ndarray, *, latitude: float, start: Start, seed: int
) -> np.ndarray:
    """(runs,) azimuth error at the end, rad; `angles` are the gyros' errors in each second."""
    random = np.random.default_rng(seed)
    runs, steps, _ = angles.shape
    earth = EARTH_RATE * np.array([np.cos(latitude), 0.0, -np.sin(latitude)])
    heading = random.uniform(-np.pi, np.pi, runs)
    true = np.zeros((runs, 3, 3))
    true[:, 0, 0], true[:, 0, 1] = np.cos(heading), -np.sin(heading)
    true[:, 1, 0], true[:, 1, 1] = np.sin(heading), np.cos(heading)
    true[:, 2, 2] = 1.0
    sensed = np.einsum("rji,j->ri", true, earth)
    force = np.einsum("rji,j->ri", true, np.array([0.0, 0.0, -STANDARD_GRAVITY]))
    covariance = initial_covariance(noise, start)
    step = step_of(noise, latitude, 1.0)
    first = random.standard_normal((runs, 10)) * np.sqrt(np.diag(covariance))
    attitude = rotation(-first[:, TILTS]) @ true
    velocity, position = first[:, VELOCITIES].copy(), np.zeros((runs, 2))
    drift = np.einsum("rji,rj->ri", true, first[:, DRIFTS])
    removed = np.zeros((runs, 3))
    for number in range(steps):
        around = latitude + position[:, 0] / EARTH_RADIUS
        turning = np.stack(
            [
                EARTH_RATE * np.cos(around) + velocity[:, 1] / EARTH_RADIUS,
                -velocity[:, 0] / EARTH_RADIUS,
                -EARTH_RATE * np.sin(around) - velocity[:, 1] * np.tan(around) / EARTH_RADIUS,
            ],
            axis=1,
        )
        measured = sensed + drift - removed + angles[:, number]
        turned = rotation(-turning) @ attitude @ rotation(measured)
        felt = np.einsum("rij,rj->ri", 0.5 * (attitude + turned), force)
        position += velocity + 0.5 * felt[:, :2]
        velocity += felt[:, :2]
        attitude = turned
        covariance = step.transition @ covariance @ step.transition.T + step.noise
        covariance, gain = updated(covariance, start.velocity_noise)
        seen = velocity + start.velocity_noise * random.standard_normal((runs, 2))
        found = seen @ gain.T
        attitude = rotation(found[:, TILTS]) @ attitude
        velocity -= found[:, VELOCITIES]
        position -= found[:, POSITIONS]
        removed += np.einsum("rji,rj->ri", true, found[:, DRIFTS])
    assert found.shape == (runs, STATES)
    left = true @ np.swapaxes(attitude, 1, 2)
    return np.asarray(0.5 * (left[:, 1, 0] - left[:, 0, 1]))


def coloured(rng, runs: int, steps: int, *, white: float, flicker: float, walk: float):
    """(runs, steps, 3) mean rates of a second of three gyros, rad/s.

    The flicker is made of its spectrum, B^2/(2 pi f) two-sided, eight times as long as it is used.
    """
    rates = white * rng.standard_normal((runs, steps, 3))
    if walk:
        rates += walk * np.cumsum(rng.standard_normal((runs, steps, 3)), axis=1)
    if flicker:
        length = 8 * steps
        frequency = np.fft.rfftfreq(length)
        root = np.zeros(frequency.size)
        root[1:] = flicker / np.sqrt(2.0 * np.pi * frequency[1:])
        for run in range(runs):
            noise = np.fft.rfft(rng.standard_normal((length, 3)), axis=0)
            rates[run] += np.fft.irfft(noise * root[:, np.newaxis], length, axis=0)[:steps]
    return rates


def unaided(
    rates: np.ndarray,
    *,
    rest: int,
    latitude: float,
    tilt: float,
    azimuth: float,
    seed: int,
    forces: np.ndarray | None = None,
) -> dict[str, np.ndarray]:
    """Errors in each second of navigators at rest whose aiding has ended.

    Parameters
    ----------
    rates
        (runs, rest + steps, 3) errors of the gyros, mean rates of a second, rad/s; the mean over
        the first `rest` of them is taken for the bias.
    rest, latitude, tilt, azimuth, seed
        s, rad, and rad 1 sigma of the attitude at which the run begins.
    forces
        (runs, rest + steps, 2) errors of the accelerometers along north and east, m/s^2, by which
        the unit was levelled over the rest; ideal without.

    Returns
    -------
    dict
        (runs, steps) ``heading`` and ``north`` and ``east`` tilt, rad, ``x`` and ``y`` in m.
    """
    random = np.random.default_rng(seed)
    runs, steps = rates.shape[0], rates.shape[1] - rest
    left = rates[:, rest:] - rates[:, :rest].mean(axis=1, keepdims=True)
    pulled = np.zeros((runs, steps, 2))
    if forces is not None:
        pulled = forces[:, rest:] - forces[:, :rest].mean(axis=1, keepdims=True)
    earth = EARTH_RATE * np.array([np.cos(latitude), 0.0, -np.sin(latitude)])
    force = np.array([0.0, 0.0, -STANDARD_GRAVITY])
    attitude = rotation(random.standard_normal((runs, 3)) * [tilt, tilt, azimuth])
    velocity, position = np.zeros((runs, 2)), np.zeros((runs, 2))
    found = {name: np.empty((runs, steps)) for name in ("heading", "north", "east", "x", "y")}
    for number in range(steps):
        around = latitude + position[:, 0] / EARTH_RADIUS
        turning = np.stack(
            [
                EARTH_RATE * np.cos(around) + velocity[:, 1] / EARTH_RADIUS,
                -velocity[:, 0] / EARTH_RADIUS,
                -EARTH_RATE * np.sin(around) - velocity[:, 1] * np.tan(around) / EARTH_RADIUS,
            ],
            axis=1,
        )
        turned = rotation(-turning) @ attitude @ rotation(earth + left[:, number])
        felt = ((0.5 * (attitude + turned)) @ force)[:, :2] + pulled[:, number]
        position += velocity + 0.5 * felt
        velocity += felt
        attitude = turned
        found["heading"][:, number] = np.arctan2(attitude[:, 1, 0], attitude[:, 0, 0])
        found["north"][:, number] = attitude[:, 2, 1]
        found["east"][:, number] = -attitude[:, 2, 0]
        found["x"][:, number], found["y"][:, number] = position.T
    return found
