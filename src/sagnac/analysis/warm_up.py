"""The bias that settles after power-on."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from sagnac import series
from sagnac.arrays import FloatArray

# Means that the warm-up is sought in, and the square of its significance.
_MEANS: Final = 200
_WARM: Final = 30.0
# Fewest samples in which a warm-up is looked for.
LEAST_FOR_WARM_UP: Final = 4 * _MEANS


@dataclass(frozen=True, slots=True, kw_only=True)
class WarmUp:
    """A bias that settles exponentially.

    Attributes
    ----------
    rate
        At the start, rad/s.
    time
        Constant of the settling, s.
    until_s
        When it has fallen to a hundredth, s, at most the length of the record.
    """

    rate: float
    time: float
    until_s: float


def find_warm_up(increments: ArrayLike, *, sample_rate: float) -> WarmUp | None:
    """Fit ``rate exp(-t/time)`` besides a straight line, and keep it if chance does not make it.

    The fit is by generalized least squares to 200 block means of the rate, in white noise and a
    random walk whose sizes come from the steps between the means that the fit leaves. So the
    wandering of a rate random walk is not taken for a warm-up.

    Parameters
    ----------
    increments
        (samples,), rad.
    sample_rate
        Samples per second.

    Returns
    -------
    WarmUp or None
        None if nothing settles, or the time is longer than a third of the record.
    """
    values = np.asarray(increments, dtype=np.float64)
    if values.ndim != 1 or values.size < LEAST_FOR_WARM_UP:
        raise ValueError(f"increments has shape {values.shape}; give {LEAST_FOR_WARM_UP} or more")
    size = values.size // _MEANS
    sums = series.map(lambda block: float(values[block].mean()), size * _MEANS, values, length=size)
    means = np.array(sums) * sample_rate
    width = size / sample_rate
    time: FloatArray = (np.arange(_MEANS, dtype=np.float64) + 0.5) * width
    constants = np.geomspace(2.0 * width, _MEANS * width / 3.0, 40)
    # First in the differences alone, which a walk leaves white.
    best = _settling(means, time, constants, _walk_precision(0.0, 1.0))
    for _ in range(2):
        rest = np.diff(means - best.rate * np.exp(-time / best.constant))
        rest -= rest.mean()
        variance, beside = float(rest @ rest) / rest.size, float(rest[1:] @ rest[:-1]) / rest.size
        white = max(-beside, 0.0)
        walk = max(variance - 2.0 * white, 0.02 * variance / _MEANS)
        best = _settling(means, time, constants, _walk_precision(white, walk))
    if best.statistic < _WARM:
        return None
    return WarmUp(
        rate=best.rate,
        time=best.constant,
        until_s=min(math.log(100.0) * best.constant, values.size / sample_rate),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Settling:
    """An exponential beside a line: squared significance, constant (s) and rate (rad/s)."""

    statistic: float
    constant: float
    rate: float


def _walk_precision(white: float, walk: float) -> FloatArray:
    """Inverse covariance of means in white noise and a random walk that starts anywhere."""
    place = np.arange(_MEANS, dtype=np.float64)
    wandering = np.minimum(place, place[:, np.newaxis]) + 1.0
    return np.asarray(np.linalg.inv(white * np.eye(_MEANS) + walk * wandering), dtype=np.float64)


def _settling(
    means: FloatArray, time: FloatArray, constants: FloatArray, precision: FloatArray
) -> _Settling:
    """The best exponential beside a line."""
    best = _Settling(statistic=0.0, constant=float(constants[0]), rate=0.0)
    for constant in constants:
        basis = np.stack(
            [np.exp(-time / constant), np.ones(time.size), time / time[-1] - 0.5], axis=1
        )
        information = np.linalg.inv(basis.T @ precision @ basis)
        answer = information @ (basis.T @ precision @ means)
        rest = means - basis @ answer
        scatter = float(rest @ precision @ rest) / (time.size - 4)
        statistic = float(answer[0]) ** 2 / (scatter * float(information[0, 0]))
        if statistic > best.statistic:
            best = _Settling(statistic=statistic, constant=float(constant), rate=float(answer[0]))
    return best


def without_warm_up(increments: ArrayLike, warm_up: WarmUp, *, sample_rate: float) -> FloatArray:
    """Increments with the settling taken off.

    Parameters
    ----------
    increments
        (samples,), rad.
    warm_up
        Of `find_warm_up`.
    sample_rate
        Samples per second.
    """
    values = np.asarray(increments, dtype=np.float64)

    def settled(block: slice) -> FloatArray:
        time = (np.arange(block.start, block.stop) + 0.5) / sample_rate
        settling = warm_up.rate / sample_rate * np.exp(-time / warm_up.time)
        return np.asarray(values[block] - settling)

    return series.made(settled, values.size, values)
