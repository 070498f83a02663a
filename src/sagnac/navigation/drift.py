"""How heading, attitude and position go off without aiding, and what makes them go.

A navigator at rest turns the errors r of its gyros into an error of heading,
``int_0^t w(s) r(s) ds``, with the weight w that the error model gives, near 1 for heading over
minutes. Before, it stood still for a time T and took the mean rate for its biases, so that every
error is ``r(s)`` less its mean over the rest: N^2/T and K^2 T/3 of it stay as an initial bias, and
of a flicker, whose level has no variance, only what differs between rest and run counts.
Accelerometers err alike: their mean over the rest is balanced by a tilt, since they levelled the
unit, and what differs from it pulls. The covariance of a flicker is
``-(B^2/pi) ln|s - u|`` then, up to a constant that drops out (the transform of B^2/(2 pi |f|)).
That of a Markov rate is ``D^2 e^(-|s - u|/T)``; of it, too, its mean over the rest is taken off.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Final

import numpy as np
from scipy.linalg import expm, matmul_toeplitz
from scipy.special import ndtri, xlogy

from sagnac.core.arrays import FloatArray
from sagnac.core.errors import quoted
from sagnac.navigation.error_model import (
    AZIMUTH,
    DRIFTS,
    POSITIONS,
    TILTS,
    VELOCITIES,
    moments_of,
    system_matrix,
)
from sagnac.navigation.noise import GyroNoise, require_not_negative

PARTS: Final = (
    "angle_random_walk",
    "bias_instability",
    "rate_random_walk",
    "markov_rate",
    "initial_bias",
    "accelerometers",
    "misalignment",
)
"""Parts of an error; the first five are of the gyros."""

_GYROS: Final = 3
_STATES: Final = DRIFTS.start  # those before the drifts of the gyros
_CELLS: Final = 240  # of the time, each of constant weight
_LONGEST_CELL: Final = 120.0  # s, a fortieth of Schuler's period
_MOST_CELLS: Final = 4000


@dataclass(frozen=True, slots=True, kw_only=True)
class Priors:
    """State of knowledge when the aiding ends.

    Attributes
    ----------
    tilt, azimuth
        Standard deviations of each tilt and of the heading then, rad.
    rest
        Time at rest before, over which the biases were taken, s.
    bias
        Standard deviation of the bias of each gyro if it is known better than the rest shows it,
        rad/s; None if it is known from the rest alone.

    Raises
    ------
    ValueError
        If one is negative or not finite, or the rest is not above zero.
    """

    tilt: float = 0.0
    azimuth: float = 0.0
    rest: float = 600.0
    bias: float | None = None

    def __post_init__(self) -> None:
        require_not_negative(self, ("tilt", "azimuth", *(() if self.bias is None else ("bias",))))
        if not (math.isfinite(self.rest) and self.rest > 0.0):
            raise ValueError(f"rest is {quoted(self.rest)}; give a time above zero")

    def bias_is_prior(self, noise: GyroNoise) -> bool:
        """Whether the bias of a gyro is known better from before than from the rest."""
        return self.bias is not None and self.bias < math.sqrt(_rest_variance(noise, self.rest))

    def initial(self, noise: GyroNoise) -> tuple[float, FloatArray]:
        """Variance of a sensor's bias at the start, SI, and (3,) its rise with squared N, B, K."""
        if self.bias is not None and self.bias_is_prior(noise):
            return self.bias**2, np.zeros(3)
        return _rest_variance(noise, self.rest), np.array([1.0 / self.rest, 0.0, self.rest / 3.0])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Growth:
    """An error against time.

    Attributes
    ----------
    times
        (times,), s since the aiding ended.
    variances
        (times, 7) of `PARTS`, which add up: rad^2 of heading and of one tilt, m^2 of position north
        and east together.
    reach
        (times,) half of the interval of the logarithm of their sum, from the errors of N, B and K.
    highest
        (times,) standard deviation without misalignment, with the upper bound of what was not
        estimated in the place of zero, the worst of `GyroNoise.bounded`.
    """

    times: FloatArray
    variances: FloatArray
    reach: FloatArray
    highest: FloatArray

    def deviation(self, *, misaligned: bool = True) -> FloatArray:
        """(times,) standard deviation, with or without the misalignment at the start."""
        count = len(PARTS) if misaligned else len(PARTS) - 1
        return np.asarray(np.sqrt(self.variances[:, :count].sum(axis=1)))

    @property
    def highest_misaligned(self) -> FloatArray:
        """(times,) `highest` with the misalignment at the start."""
        return np.hypot(self.highest, np.sqrt(self.variances[:, -1]))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Drift:
    """Heading, attitude and position against time, without aiding."""

    heading: Growth
    attitude: Growth
    position: Growth
    priors: Priors


def drift(
    noises: Sequence[GyroNoise],
    *,
    accelerometers: Sequence[GyroNoise] = (),
    latitude: float,
    times: FloatArray,
    priors: Priors | None = None,
    confidence: float = 0.95,
) -> Drift:
    """Errors of a navigator at rest whose aiding ends at time zero.

    Parameters
    ----------
    noises
        Of the gyros about north, east and down; the same object thrice if only one is known, whose
        errors then go together.
    accelerometers
        Along north and east, m for rad; ideal unless given.
    latitude
        rad.
    times
        (times,), s, above zero.
    priors
        What is known at time zero.
    confidence
        Of the interval.

    Raises
    ------
    ValueError
        If there are not three gyros, a time is not above zero, or the latitude is within a
        degree of a pole.
    """
    moments = moments_of(times)
    if len(noises) != 3:
        raise ValueError(f"noises are {len(noises)}; give three, about north, east and down")
    known, sensors = priors or Priors(), (*noises, *accelerometers)
    constants = tuple(dict.fromkeys(rate.time for one in sensors for rate in one.markov))
    weights = [_at(time, latitude, known, constants) for time in moments]
    grown = _growths(sensors, moments, weights, known, confidence)
    return Drift(heading=grown[0], attitude=grown[1], position=grown[2], priors=known)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Weights:
    """Heading, one tilt, and position north and east together, at one time.

    Sensors are three gyros and two accelerometers.

    Attributes
    ----------
    terms
        (3, 5, 3) variance that N, B and K at one make after the rest.
    markov
        (3, 5) the same of a Markov rate at one, by its correlation time.
    total
        (3, 5) variance that a bias at one makes.
    misaligned
        (3,) variance that the misalignment makes.
    """

    terms: FloatArray
    markov: Mapping[float, FloatArray]
    total: FloatArray
    misaligned: FloatArray


def _at(time: float, latitude: float, priors: Priors, constants: Sequence[float]) -> _Weights:
    """The weights after a time, and those of Markov rates of some correlation times."""
    cells = min(max(_CELLS, math.ceil(time / _LONGEST_CELL)), _MOST_CELLS)
    length = time / cells
    system = system_matrix(latitude)[:_STATES, :_STATES]
    half, whole = expm(0.5 * length * system), expm(length * system)
    rows = np.zeros((5, _STATES))
    rows[0, AZIMUTH] = rows[1, 0] = rows[2, 1] = 1.0
    rows[3, POSITIONS.start] = rows[4, POSITIONS.start + 1] = 1.0
    grown = np.linalg.matrix_power(whole, cells)
    start = np.zeros(_STATES)
    start[TILTS], start[AZIMUTH] = priors.tilt**2, priors.azimuth**2
    # From the last cell back to the first; a drift of a gyro turns the tilts against it.
    weights = np.empty((5, 5, cells))
    each = rows @ half
    for cell in reversed(range(cells)):
        weights[:, :_GYROS, cell] = -each[:, TILTS]
        weights[:, _GYROS:, cell] = each[:, VELOCITIES]
        each = each @ whole
    total = weights.sum(axis=2) * length
    beside_rest = partial(_beside_rest, weights, total, length, priors.rest)
    white = length * (weights**2).sum(axis=2)
    flicker = -beside_rest(_of_logarithm) / math.pi
    terms = np.stack([white, flicker, _walked(weights, length)], axis=-1)

    def outputs(variance: FloatArray) -> FloatArray:
        """Heading; the mean square of the two tilts; the sum of the squares north and east."""
        return np.array([variance[0], 0.5 * (variance[1] + variance[2]), variance[3] + variance[4]])

    return _Weights(
        terms=outputs(terms),
        markov={one: outputs(beside_rest(partial(_of_exponential, time=one))) for one in constants},
        total=outputs(total**2),
        misaligned=outputs((rows @ grown) ** 2 @ start),
    )


def _walked(weights: FloatArray, length: float) -> FloatArray:
    """(5, 5) variance of a random walk of the rate at one that begins with the run."""
    after = np.cumsum(weights[..., ::-1], axis=-1)[..., ::-1] - 0.5 * weights
    return np.asarray(length**3 * (after**2).sum(axis=-1))


def _beside_rest(
    weights: FloatArray,
    total: FloatArray,
    length: float,
    rest: float,
    twice_integrated: Callable[[FloatArray], FloatArray],
) -> FloatArray:
    """(5, 5) variance of a noise less its mean over the rest.

    `twice_integrated` has the covariance over the lag as its second derivative; it and its slope
    are zero at zero.
    """
    cells = weights.shape[-1]
    edges = length * np.arange(cells + 1.0)
    lags = length * np.arange(-1.0, cells + 1.0)
    within = np.diff(twice_integrated(lags), 2)
    mean = total / rest
    between = np.diff(twice_integrated(rest + edges) - twice_integrated(edges))
    flat = weights.reshape(-1, cells)
    square = (flat.T * matmul_toeplitz(within, flat.T)).sum(axis=0).reshape(total.shape)
    square += mean**2 * 2.0 * float(twice_integrated(np.array([rest]))[0])
    square -= 2.0 * mean * (weights @ between)
    return np.asarray(square)


def _of_logarithm(lag: FloatArray) -> FloatArray:
    """``x^2 (ln|x| - 3/2)/2``, whose second derivative is ``ln|x|``."""
    size = np.abs(lag)
    return np.asarray(0.5 * (xlogy(size**2, size) - 1.5 * size**2))


def _of_exponential(lag: FloatArray, *, time: float) -> FloatArray:
    """``T^2 (e^(-|x|/T) - 1 + |x|/T)``, whose second derivative is ``e^(-|x|/T)``."""
    ratio = np.abs(lag) / time
    return np.asarray(time**2 * (np.expm1(-ratio) + ratio))


def _rest_variance(noise: GyroNoise, rest: float) -> float:
    """Variance of the mean rate of a rest about the bias at its end, no flicker, (rad/s)^2."""
    return noise.angle_random_walk**2 / rest + noise.rate_random_walk**2 * rest / 3.0


def _growths(
    sensors: Sequence[GyroNoise],
    times: FloatArray,
    weights: Sequence[_Weights],
    priors: Priors,
    confidence: float,
) -> list[Growth]:
    """Growth of heading, attitude and position."""
    terms = np.array([one.terms for one in weights])
    total = np.array([one.total for one in weights])
    variances = np.zeros((*total.shape[:2], len(PARTS)))
    variances[..., -1] = [one.misaligned for one in weights]
    highest = np.zeros(total.shape[:2])
    # One gyro in the place of three is wrong in all three alike.
    slopes: dict[int, FloatArray] = {}
    errors: dict[tuple[int, float], FloatArray] = {}
    for place, noise in enumerate(sensors):
        # The prior is of gyros.
        known = priors if place < _GYROS else replace(priors, bias=None)
        own, biased = terms[:, :, place], total[:, :, place]
        initial, slope = known.initial(noise)
        markov = np.zeros(highest.shape)
        for rate in noise.markov:
            made = rate.deviation**2 * np.array(
                [one.markov[rate.time][:, place] for one in weights]
            )
            markov += made
            key = (id(noise), rate.time)
            errors[key] = errors.get(key, 0.0) + rate.error * made
        parts = [*np.moveaxis(own * noise.values**2, -1, 0), markov, biased * initial]
        if place < _GYROS:
            variances[..., : len(parts)] += np.stack(parts, axis=-1)
        else:
            variances[..., len(parts)] += sum(parts)
        worst = [own @ one.values**2 + biased * known.initial(one)[0] for one in noise.bounded]
        highest += np.max(worst, axis=0) + markov
        rising = 2.0 * (own + biased[..., np.newaxis] * slope) * noise.values
        slopes[id(noise)] = slopes.get(id(noise), 0.0) + rising
    covariances = {id(noise): noise.covariance for noise in sensors}
    squares = sum(
        np.einsum("...i,ij,...j", slope, covariances[one], slope) for one, slope in slopes.items()
    )
    squares = squares + sum(error**2 for error in errors.values())
    own_variance = np.maximum(variances[..., :-1].sum(axis=-1), 1e-300)
    reach = float(ndtri(0.5 + 0.5 * confidence)) * np.sqrt(squares) / own_variance
    return [
        Growth(
            times=times,
            variances=variances[:, output],
            reach=reach[:, output],
            highest=np.sqrt(highest[:, output]),
        )
        for output in range(len(weights[0].misaligned))
    ]
