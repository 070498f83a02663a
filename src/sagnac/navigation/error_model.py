"""Errors of a navigator at rest, and of azimuth found by a gyrocompass or a triad that turns.

The navigator is a linear system of tilts, azimuth, velocity, position and biases.

In north-east-down axes with the tilts phi, ``phi' = -w x phi + dw - e`` and ``dv' = f x phi``
(the phi-angle model; Titterton and Weston, *Strapdown Inertial Navigation Technology*, 12.3),
with Earth rate and that of the velocity over the Earth in w, the drifts e of the gyros, and the
specific force f, which is gravity alone. Coriolis terms of the velocity error are left out: they
turn the Schuler oscillation slowly and leave its size.

A Kalman filter aligns at rest: what it starts from, what it comes to, and how the position goes off
afterwards.

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
from dataclasses import dataclass, field, replace
from numbers import Real
from typing import Final, NamedTuple

import numpy as np
from scipy.linalg import expm

from sagnac.core.arrays import FloatArray
from sagnac.core.errors import is_finite, quoted, refusal
from sagnac.core.units import DEGREE, EARTH_RATE, STANDARD_GRAVITY
from sagnac.navigation.models import require_numbers
from sagnac.navigation.noise import GyroNoise, quantile
from sagnac.noise.laws import allan_variance_basis, markov_allan_variance


def _angle(value: object) -> str:
    """An angle in both units: programs state rad, the command line deg."""
    return f"{value / DEGREE:g} deg, {value:g} rad" if isinstance(value, Real) else quoted(value)


def north_rate(latitude: float) -> float:
    """North component of Earth rate, rad/s.

    Raises
    ------
    ValueError
        If the latitude is within a degree of a pole.
    """
    # Nearer to a pole Earth rate has next to no north component.
    if not (is_finite(latitude) and abs(latitude) <= 89.0 * DEGREE):
        why = "since azimuth is not found from Earth rate nearer to a pole"
        raise refusal("latitude", f"is {_angle(latitude)}; give -89 to 89 deg, {why}")
    return EARTH_RATE * math.cos(latitude)


# ---- error model -------------------------------------------------------------------

# States: tilts north and east and azimuth, velocity and position north and east, and drifts of the
# gyros about north, east and down.
TILTS: Final = slice(0, 3)
AZIMUTH: Final = 2
VELOCITIES: Final = slice(3, 5)
POSITIONS: Final = slice(5, 7)
DRIFTS: Final = slice(7, 10)
STATES: Final = 10
EARTH_RADIUS: Final = 6_371_000.0  # m, mean


class Step(NamedTuple):
    """One step of a fixed length: (10, 10) transition, and covariance of the noise it adds."""

    transition: FloatArray
    noise: FloatArray

    def of(self, covariance: FloatArray) -> FloatArray:
        """(10, 10) covariance of `STATES` after the step."""
        return np.asarray(self.transition @ covariance @ self.transition.T + self.noise)


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
    system = np.zeros((STATES, STATES))
    system[TILTS, TILTS] = [[0.0, down, 0.0], [-down, 0.0, north], [0.0, -north, 0.0]]
    system[TILTS, VELOCITIES] = [
        [0.0, 1.0 / EARTH_RADIUS],
        [-1.0 / EARTH_RADIUS, 0.0],
        [0.0, -np.tan(latitude) / EARTH_RADIUS],
    ]
    # A wrong latitude is a wrong Earth rate.
    system[TILTS, 5] = [down / EARTH_RADIUS, 0.0, -north / EARTH_RADIUS]
    system[TILTS, DRIFTS] = -np.eye(3)
    system[VELOCITIES, TILTS] = [[0.0, STANDARD_GRAVITY, 0.0], [-STANDARD_GRAVITY, 0.0, 0.0]]
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
        If the latitude is within a degree of a pole.
    """
    system = system_matrix(latitude)
    driven = np.zeros(STATES)
    driven[TILTS], driven[DRIFTS] = noise.angle_random_walk**2, noise.rate_random_walk**2
    block = np.block([[-system, np.diag(driven)], [np.zeros((STATES, STATES)), system.T]])
    grown = expm(block * seconds)
    transition = grown[STATES:, STATES:].T
    return Step(transition=transition, noise=transition @ grown[:STATES, STATES:])


# ---- initial -----------------------------------------------------------------------


_STEP: Final = 1.0  # s, between zero-velocity measurements
_LONGEST: Final = 604_800.0  # s, of an alignment
_FASTEST: Final = 1e10  # rad/s, of a table; no square of it overflows


@dataclass(frozen=True, slots=True, kw_only=True)
class Start:
    """Standard deviations before an alignment, or when the aiding ends after one.

    Attributes
    ----------
    tilt, azimuth
        Of each tilt and of the azimuth, rad.
    bias
        What is not known of the bias of a gyro beside its flicker, rad/s; None if it is known from
        the rest alone, which the alignment takes for exactly.
    rest
        Time at rest, over which the biases were taken, s.
    velocity_noise
        Of each zero-velocity measurement of the alignment, m/s.

    Raises
    ------
    ValueError
        If one is negative or not finite, the rest or the velocity noise is not above zero, a tilt
        is above 90 deg, the azimuth above 180 deg or the bias above 1000 deg/s.
    """

    tilt: float = 0.5 * DEGREE
    azimuth: float = 2.0 * DEGREE
    bias: float | None = None
    rest: float = 600.0
    velocity_noise: float = 1e-4

    def __post_init__(self) -> None:
        require_numbers(self, ("tilt", "azimuth", *(() if self.bias is None else ("bias",))))
        require_numbers(self, ("rest", "velocity_noise"), above_zero=True)
        for name, value, most in (("tilt", self.tilt, 90), ("azimuth", self.azimuth, 180)):
            if value > most * DEGREE:
                raise refusal(name, f"is {_angle(value)}; give {most} deg at most")
        if (self.bias or 0.0) > 1000.0 * DEGREE:
            problem = f"is {(self.bias or 0.0) / DEGREE:.6g} deg/s; give 1000 deg/s at most"
            raise refusal("bias", problem)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Course:
    """A standard deviation against time.

    Attributes
    ----------
    times
        (steps,), s.
    deviation
        (steps,) of azimuth, rad; or the root of the sum of the variances of position north and
        east, m.
    covariance
        (10, 10) of `STATES` at the end, SI.
    """

    times: FloatArray
    deviation: FloatArray
    covariance: FloatArray = field(repr=False)


def drift_deviation(noise: GyroNoise, start: Start) -> float:
    """Standard deviation of the drift before an alignment, rad/s: of the bias and of a flicker.

    A flicker has no variance of its own; over some decades of time its mean wanders by the floor
    of the Allan deviation, ``B sqrt(2 ln 2 / pi)``, which a filter takes as a constant.
    """
    flicker = noise.bias_instability * math.sqrt(2.0 * math.log(2.0) / math.pi)
    return math.hypot(start.bias or 0.0, flicker)


def initial_covariance(noise: GyroNoise, start: Start) -> FloatArray:
    """(10, 10) a priori covariance of `STATES`, SI.

    Raises
    ------
    ValueError
        If the tilt or the azimuth is known exactly.
    """
    require_numbers(start, ("tilt", "azimuth"), above_zero=True)
    deviations = np.zeros(STATES)
    deviations[TILTS], deviations[AZIMUTH] = start.tilt, start.azimuth
    deviations[VELOCITIES] = start.velocity_noise
    deviations[DRIFTS] = drift_deviation(noise, start)
    return np.diag(deviations**2)


def updated(covariance: FloatArray, velocity_noise: float) -> tuple[FloatArray, FloatArray]:
    """(10, 10) covariance after a zero-velocity measurement, in Joseph's form; (10, 2) its gain."""
    seen = covariance[VELOCITIES, VELOCITIES] + velocity_noise**2 * np.eye(2)
    gain = np.asarray(np.linalg.solve(seen, covariance[VELOCITIES, :]).T, dtype=np.float64)
    left = np.eye(STATES)
    left[:, VELOCITIES] -= gain
    return left @ covariance @ left.T + velocity_noise**2 * (gain @ gain.T), gain


def aligned(
    noise: GyroNoise, *, latitude: float, rest: float, start: Start | None = None
) -> Course:
    """Azimuth in the course of an alignment at rest that measures zero velocity.

    Accelerometers are taken as free of bias: a bias tilts the level by itself over gravity, and
    shifts azimuth by that of the east accelerometer times the tangent of latitude.

    Parameters
    ----------
    noise
        Of each gyro.
    latitude
        rad.
    rest
        Length of the alignment, s.
    start
        What it starts from.

    Raises
    ------
    ValueError
        If it is shorter than one step or longer than a week, or the latitude is within a degree of
        a pole.
    """
    if not 0.5 * _STEP < rest <= _LONGEST:
        raise refusal("rest", f"is {quoted(rest)}; give {_STEP:g} to {_LONGEST:g}, a week")
    step, start = step_of(noise, latitude, _STEP), start or Start()
    covariance = initial_covariance(noise, start)
    times = _STEP * np.arange(1.0, round(rest / _STEP) + 1.0)
    azimuth = np.empty(times.size)
    for number in range(times.size):
        covariance, _ = updated(step.of(covariance), start.velocity_noise)
        azimuth[number] = math.sqrt(covariance[AZIMUTH, AZIMUTH])
    return Course(times=times, deviation=azimuth, covariance=covariance)


_POSITIONS: Final = 240  # times at which a position error is given


def position_error(
    noise: GyroNoise, *, latitude: float, covariance: FloatArray, seconds: float
) -> Course:
    """Position error that gyros and alignment make without any further measurement.

    Parameters
    ----------
    noise
        Of each gyro.
    latitude
        rad.
    covariance
        (10, 10) at the end of the alignment, as `aligned` gives it. An azimuth error and
        the drift that caused it cancel in it: what is left grows much more slowly than either.
    seconds
        How long.

    Raises
    ------
    ValueError
        If the time is not above zero, or the latitude is within a degree of a pole.
    """
    (length,) = moments_of(np.array(seconds)) / _POSITIONS
    step = step_of(noise, latitude, float(length))
    deviation = np.empty(_POSITIONS)
    for number in range(_POSITIONS):
        covariance = step.of(covariance)
        deviation[number] = math.sqrt(float(np.trace(covariance[POSITIONS, POSITIONS])))
    times = length * np.arange(1.0, _POSITIONS + 1.0)
    return Course(times=times, deviation=deviation, covariance=covariance)


# ---- azimuth -----------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class AzimuthError:
    """Standard deviation of azimuth after a time, and of what it is made.

    Attributes
    ----------
    times
        (times,), s.
    deviation, low, high
        (times,), rad, and its interval from the uncertainty of N, B and K, and from the upper
        bounds of those that were not estimated.
    parts
        (times, 3) variances that N, B and K make, rad^2.
    confidence
        Of the interval.
    floor
        Deviation that B leaves however long is averaged, rad.
    """

    times: FloatArray
    deviation: FloatArray
    low: FloatArray
    high: FloatArray
    parts: FloatArray
    confidence: float
    floor: float = 0.0


def azimuth_error(
    noise: GyroNoise, *, latitude: float, times: FloatArray, confidence: float = 0.95
) -> AzimuthError:
    """Error of a gyrocompass that averages the gyro's rate in two positions.

    The gyro is turned by half a turn in the middle: half of the difference of the two means is free
    of bias, and its variance is that of Allan's over half of the time, by two:
    ``sigma^2(t/2) / 2``.

    Parameters
    ----------
    noise
        Of the gyro.
    latitude
        rad.
    times
        (times,), s, above zero.
    confidence
        Of the interval.

    Raises
    ------
    ValueError
        If the latitude is within a degree of a pole, or a time is not above zero.
    """
    moments, north = moments_of(times), north_rate(latitude)
    # N, B and K are 1 to 3 of the five of Eq. 3.
    weights = 0.5 * allan_variance_basis(0.5 * moments)[:, [1, 2, 3]] / north**2
    floor = math.sqrt(float(weights[0, 1])) * noise.bias_instability
    left, unsure = np.zeros((2, moments.size))
    for rate in noise.markov:
        law = markov_allan_variance(0.5 * moments, rate.driving_noise, rate.correlation_time)
        left += 0.5 * law / north**2
        unsure += (rate.error * 0.5 * law / north**2) ** 2
    azimuth = _of_weights(noise, moments, weights, confidence, left=left, unsure=unsure)
    return replace(azimuth, floor=floor)


def moments_of(times: FloatArray) -> FloatArray:
    """(times,) numbers of seconds.

    Raises
    ------
    ValueError
        If one is not finite and above zero.
    """
    moments = np.atleast_1d(np.asarray(times, dtype=np.float64))
    if not np.all((moments > 0.0) & np.isfinite(moments)):
        raise refusal("times", "must be finite numbers of seconds above zero")
    return moments


def raised(deviation: FloatArray, factor: FloatArray, highest: FloatArray) -> FloatArray:
    """(times,) upper end of the interval of a standard deviation.

    Parameters
    ----------
    deviation
        (times,) with what was not estimated at zero or at the most likely.
    factor
        (times,) by which the errors of what was estimated raise it.
    highest
        (times,) with the worst upper bound of what was not estimated.
    """
    # The variance of what was estimated at its upper end, and what the bound adds to it.
    added = np.maximum(highest**2 - deviation**2, 0.0)
    return np.asarray(np.sqrt((deviation * factor) ** 2 + added))


def _of_weights(
    noise: GyroNoise,
    moments: FloatArray,
    weights: FloatArray,
    confidence: float,
    *,
    left: FloatArray,
    unsure: FloatArray | float = 0.0,
) -> AzimuthError:
    """The error by (times, 3) weights of N, B and K squared.

    `left` is what a bias or Markov rates add, rad^2, and `unsure` the square of its standard error.
    """
    parts = weights * noise.values**2
    variance = parts.sum(axis=1) + left
    slope = 2.0 * weights * noise.values
    scatter = np.sqrt(np.einsum("ti,ij,tj->t", slope, noise.covariance, slope) + unsure)
    # A variance stays above zero, so the interval is taken for its logarithm.
    reach = quantile(confidence) * scatter / np.maximum(variance, 1e-300)
    deviation, factor = np.sqrt(variance), np.exp(0.5 * reach)

    def deviation_with(one: GyroNoise) -> FloatArray:
        return np.asarray(np.sqrt(weights @ one.values**2 + left))

    highest = np.max([deviation_with(one) for one in noise.bounded], axis=0)
    return AzimuthError(
        times=moments,
        deviation=deviation,
        low=np.minimum(deviation, deviation_with(noise.without_likely)) / factor,
        high=raised(deviation, factor, highest),
        parts=parts,
        confidence=confidence,
    )


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
    if not (is_finite(table_rate) and 0.0 < abs(table_rate) <= _FASTEST):
        remedy = f"give the rate of a turning table, rad/s, {_FASTEST:g} at most"
        raise refusal("table_rate", f"is {quoted(table_rate)}; {remedy}")
    speed = abs(table_rate)
    moments = moments_of(times)
    if not np.all(moments * speed >= 2.0 * math.pi * (1.0 - 1e-9)):
        raise refusal("times", f"must be of a turn, {2.0 * math.pi / speed:.4g} s, and longer")
    weights = np.array([1.0, 1.0 / speed, 2.0 / speed**2]) / (north**2 * moments[:, np.newaxis])
    # Half of a bias' square falls on each axis of the plane, and the mean of exp(i W t) is a sinc.
    turned = speed * moments
    left = 2.0 * (1.0 - np.cos(turned)) / turned**2 * (bias / north) ** 2
    return _of_weights(noise, moments, weights, confidence, left=left)
