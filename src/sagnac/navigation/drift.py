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
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Final

import numpy as np
from scipy.linalg import expm, matmul_toeplitz
from scipy.special import xlogy

from sagnac.core.arrays import FloatArray, Operation
from sagnac.core.errors import refusal
from sagnac.navigation import error_model as model
from sagnac.navigation.noise import NAMES, GyroNoise, quantile

PARTS: Final = (*NAMES, "markov_rate", "initial_bias", "accelerometers", "misalignment")
"""Parts of an error; the first five are of the gyros."""

_GYROS: Final = 3
_STATES: Final = model.DRIFTS.start  # those before the drifts of the gyros


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
    lowest, highest
        (times,) standard deviation without misalignment, with what was not estimated at zero, and
        at its upper bound, the worst of `GyroNoise.bounded`.
    """

    times: FloatArray
    variances: FloatArray
    reach: FloatArray
    lowest: FloatArray
    highest: FloatArray

    def deviation(self, *, misaligned: bool = True) -> FloatArray:
        """(times,) standard deviation, with or without the misalignment at the start."""
        count = len(PARTS) if misaligned else len(PARTS) - 1
        return np.asarray(np.sqrt(self.variances[:, :count].sum(axis=1)))

    @property
    def interval(self) -> tuple[FloatArray, FloatArray]:
        """(times,) ends of the interval of the standard deviation without misalignment.

        Noise of which only an upper bound is known may be nothing, or up to that bound.
        """
        middle, factor = self.deviation(misaligned=False), np.exp(0.5 * self.reach)
        return np.minimum(middle, self.lowest) / factor, model.raised(middle, factor, self.highest)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Drift:
    """Heading, attitude and position against time, without aiding."""

    heading: Growth
    attitude: Growth
    position: Growth
    priors: model.Start


def drift(
    noises: Sequence[GyroNoise],
    *,
    accelerometers: Sequence[GyroNoise] = (),
    latitude: float,
    times: FloatArray,
    priors: model.Start,
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
    moments = model.moments_of(times)
    if len(noises) != 3:
        raise refusal("noises", f"are {len(noises)}; give three, about north, east and down")
    sensors = (*noises, *accelerometers)
    constants = sorted({rate.correlation_time for one in sensors for rate in one.markov})
    steps = [_at(time, latitude, priors, constants) for time in moments]
    weights = np.stack([one for one, _ in steps], axis=1)
    variances = np.zeros((len(_OUTPUTS), moments.size, len(PARTS)))
    variances[..., -1] = np.stack([misaligned for _, misaligned in steps], axis=1)
    lowest, highest, squares = np.zeros((3, *variances.shape[:2]))
    # One gyro in the place of three is wrong in all three alike.
    places: dict[tuple[GyroNoise, bool], list[int]] = {}
    for place, noise in enumerate(sensors):
        places.setdefault((noise, place < _GYROS), []).append(place)
    for (noise, is_gyro), each in places.items():
        # The prior is of gyros.
        known = priors if is_gyro else replace(priors, bias=None)
        parts, square, ends = _made_by(noise, known, weights[:, :, each], constants)
        squares += square
        lowest += ends[0]
        highest += ends[1]
        count = parts.shape[-1]
        if is_gyro:
            variances[..., :count] += parts
        else:
            variances[..., count] += parts.sum(axis=-1)
    own = np.maximum(variances[..., :-1].sum(axis=-1), 1e-300)
    reach = quantile(confidence) * np.sqrt(squares) / own
    made = zip(variances, reach, np.sqrt(lowest), np.sqrt(highest), strict=True)
    heading, attitude, position = (
        Growth(times=moments, variances=parts, reach=half, lowest=least, highest=most)
        for parts, half, least, most in made
    )
    return Drift(heading=heading, attitude=attitude, position=position, priors=priors)


def _made_by(
    noise: GyroNoise, priors: model.Start, weights: FloatArray, constants: Sequence[float]
) -> tuple[FloatArray, FloatArray, tuple[FloatArray, FloatArray]]:
    """Variances that one noise makes, by (3, times, places, terms) weights of `_at`.

    Returns
    -------
    parts
        (3, times, 5) by N, B, K, Markov rates and the initial bias.
    squares
        (3, times) squared standard error of their sum.
    ends
        (3, times) their sum without what was not estimated, and with its worst upper bound.
    """
    initial, rise = _initial(noise, priors)
    together = weights.sum(axis=2)
    own, biased, slow = together[..., :3], together[..., 3], together[..., 4:]
    rising = 2.0 * (own + biased[..., np.newaxis] * rise) * noise.values
    squares = np.einsum("oti,ij,otj->ot", rising, noise.covariance, rising)
    markov = np.zeros(squares.shape)
    for rate in noise.markov:
        made = rate.deviation**2 * slow[..., constants.index(rate.correlation_time)]
        markov += made
        squares += (rate.error * made) ** 2
    beside = np.stack([markov, biased * initial], axis=-1)
    parts = np.concatenate([own * noise.values**2, beside], axis=-1)

    def with_values(one: GyroNoise) -> FloatArray:
        made = weights[..., :3] @ one.values**2 + weights[..., 3] * _initial(one, priors)[0]
        return np.asarray(made.sum(axis=2) + markov)

    worst = np.max([with_values(one) for one in noise.bounded], axis=0)
    return parts, squares, (with_values(noise.without_likely), worst)


# Heading; the mean square of the two tilts; the sum of the squares north and east.
_OUTPUTS: Final = np.array([[1, 0, 0, 0, 0], [0, 0.5, 0.5, 0, 0], [0, 0, 0, 1, 1]])


def _at(
    time: float, latitude: float, priors: model.Start, constants: Sequence[float]
) -> tuple[FloatArray, FloatArray]:
    """Variances after a time: of heading, of one tilt, and of position north and east together.

    Returns
    -------
    terms
        (3, 5, terms) what N, B and K at one, after the rest, a bias at one, and Markov rates at one
        of some correlation times make in three gyros and two accelerometers.
    misaligned
        (3,) what the misalignment makes.
    """
    # Each cell has constant weight; 120 s are a fortieth of Schuler's period.
    cells = min(max(240, math.ceil(time / 120.0)), 4000)
    length = time / cells
    system = model.system_matrix(latitude)[:_STATES, :_STATES]
    half, whole = expm(0.5 * length * system), expm(length * system)
    north, east = range(_STATES)[model.POSITIONS]
    rows = np.eye(_STATES)[[model.AZIMUTH, 0, 1, north, east]]
    grown = np.linalg.matrix_power(whole, cells)
    start = np.zeros(_STATES)
    start[model.TILTS], start[model.AZIMUTH] = priors.tilt**2, priors.azimuth**2
    # From the last cell back to the first; a drift of a gyro turns the tilts against it.
    weights = np.empty((5, 5, cells))
    each = rows @ half
    for cell in reversed(range(cells)):
        weights[:, :_GYROS, cell] = -each[:, model.TILTS]
        weights[:, _GYROS:, cell] = each[:, model.VELOCITIES]
        each = each @ whole
    total = weights.sum(axis=2) * length
    # A random walk of the rate at one begins with the run.
    after = np.cumsum(weights[..., ::-1], axis=-1)[..., ::-1] - 0.5 * weights
    beside_rest = partial(_beside_rest, weights, total, length, priors.rest)
    terms = [
        length * (weights**2).sum(axis=2),
        -beside_rest(_of_logarithm) / math.pi,
        length**3 * (after**2).sum(axis=2),
        total**2,
        *(beside_rest(partial(_of_exponential, time=one)) for one in constants),
    ]
    made = np.tensordot(_OUTPUTS, np.stack(terms, axis=-1), axes=1)
    return made, _OUTPUTS @ (rows @ grown) ** 2 @ start


def _beside_rest(
    weights: FloatArray, total: FloatArray, length: float, rest: float, twice_integrated: Operation
) -> FloatArray:
    """(5, 5) variance of a noise less its mean over the rest.

    `twice_integrated` has the covariance over the lag as its second derivative; it and its slope
    are zero at zero.
    """
    cells = weights.shape[-1]
    edges = length * np.arange(cells + 1.0)
    within = np.diff(twice_integrated(length * np.arange(-1.0, cells + 1.0)), 2)
    mean = total / rest
    between = np.diff(twice_integrated(rest + edges) - twice_integrated(edges))
    flat = weights.reshape(-1, cells)
    square = (flat.T * matmul_toeplitz(within, flat.T)).sum(axis=0).reshape(total.shape)
    square += mean**2 * 2.0 * float(twice_integrated(np.array([rest]))[0])
    return np.asarray(square - 2.0 * mean * (weights @ between))


def _of_logarithm(lag: FloatArray) -> FloatArray:
    """``x^2 (ln|x| - 3/2)/2``, whose second derivative is ``ln|x|``."""
    size = np.abs(lag)
    return np.asarray(0.5 * (xlogy(size**2, size) - 1.5 * size**2))


def _of_exponential(lag: FloatArray, *, time: float) -> FloatArray:
    """``T^2 (e^(-|x|/T) - 1 + |x|/T)``, whose second derivative is ``e^(-|x|/T)``."""
    ratio = np.abs(lag) / time
    return np.asarray(time**2 * (np.expm1(-ratio) + ratio))


def _initial(noise: GyroNoise, priors: model.Start) -> tuple[float, FloatArray]:
    """Variance of a sensor's bias at the start, SI, and (3,) its rise with squared N, B, K.

    It is that of the mean rate of the rest about the bias at its end, without flicker, or the
    prior, if that is less.
    """
    rise = np.array([1.0 / priors.rest, 0.0, priors.rest / 3.0])
    variance = float(rise @ noise.values**2)
    if priors.bias is not None and priors.bias**2 < variance:
        return priors.bias**2, np.zeros(3)
    return variance, rise


def bias_is_prior(noise: GyroNoise, priors: model.Start) -> bool:
    """Whether the bias of a gyro is known better from before than from the rest."""
    return not _initial(noise, priors)[1].any()
