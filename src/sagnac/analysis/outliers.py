"""What is in a record besides its noise: spikes, and the bias that settles after power-on."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtri

from sagnac import series
from sagnac.arrays import FloatArray, IntegerArray

# Chance that noise without spikes shows one.
_SPIKE_CHANCE: Final = 1e-3
# More of the samples than this are no spikes, but the noise.
_MANY: Final = 0.01
# Samples looked at around each for its neighbourhood.
_AROUND: Final = 2
# Samples whose median is the level that a spike stands on, and share of it that has to stay.
_WIDE: Final = 8
_KEPT: Final = 0.5
_BLOCK: Final = 2**16
# Fewest samples in which spikes are looked for.
LEAST_FOR_SPIKES: Final = 16
# Means that the warm-up is sought in, and the square of its significance.
_MEANS: Final = 200
_WARM: Final = 30.0
# Fewest samples in which a warm-up is looked for.
LEAST_FOR_WARM_UP: Final = 4 * _MEANS


@dataclass(frozen=True, slots=True, kw_only=True)
class Spikes:
    """Samples far off their neighbours.

    Attributes
    ----------
    index
        (count,) where.
    height
        (count,) how far each lies from its neighbours, rad.
    added_walk
        What they add to N, rad/sqrt(s): ``N^2`` grows by its square, the sum of the squared
        heights over the duration.
    """

    index: IntegerArray
    height: FloatArray
    added_walk: float


def find_spikes(increments: ArrayLike, *, sample_rate: float) -> Spikes:
    """Find single samples that lie farther from their neighbours than chance puts them.

    Each sample less the median of the four around it, against the scatter of such differences
    in its block of 65,536 samples (by their quartiles).

    Parameters
    ----------
    increments
        (samples,), rad.
    sample_rate
        Samples per second.

    Returns
    -------
    Spikes
        None if one in a hundred samples or more were one: that is the noise.
    """
    values = np.asarray(increments, dtype=np.float64)
    if values.ndim != 1 or values.size < LEAST_FOR_SPIKES:
        raise ValueError(f"increments has shape {values.shape}; give {LEAST_FOR_SPIKES} or more")
    # Beyond this many scatters lies one sample in a record by chance.
    limit = -float(ndtri(0.5 * _SPIKE_CHANCE / values.size))
    blocks = series.map(
        lambda block: _spikes_in(values, block, limit), values.size, values, length=_BLOCK
    )
    index = np.concatenate([block.index for block in blocks])
    height = np.concatenate([block.height for block in blocks])
    if index.size > _MANY * values.size:
        index, height = index[:0], height[:0]
    added = math.sqrt(float(height @ height) * sample_rate / values.size)
    return Spikes(index=index, height=height, added_walk=added)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Far:
    """Samples of one block that lie far off their neighbours."""

    index: IntegerArray
    height: FloatArray


def _spikes_in(values: FloatArray, block: slice, limit: float) -> _Far:
    first, last = max(0, block.start - _AROUND), min(values.size, block.stop + _AROUND)
    off = _off_neighbours(values[first:last])[block.start - first :][: block.stop - block.start]
    low, high = np.quantile(off, [0.25, 0.75])
    # Coarse steps have quartiles of a step or none: the root mean square of the inner part.
    inner = off[np.abs(off) <= np.quantile(np.abs(off), 0.95)]
    scale = max((high - low) / 1.349, 1.3 * float(np.sqrt(np.mean(inner**2))))
    found = np.flatnonzero((np.abs(off) > 1.15 * limit * scale) & (scale > 0.0))
    stays = [
        place for place in found.tolist() if _stays(values, place + block.start, float(off[place]))
    ]
    index = np.array(stays, dtype=np.int64)
    return _Far(index=index + block.start, height=off[index])


def _stays(values: FloatArray, place: int, height: float) -> bool:
    """Whether the angle keeps what a sample adds.

    If its neighbours take it back, the angle alone was off for a moment: that adds nothing to N,
    and to replace one of them would.
    """
    if not _AROUND <= place < values.size - _AROUND:
        return False
    typical = np.median(values[max(0, place - _WIDE) : place + _WIDE + 1])
    net = float((values[place - _AROUND : place + _AROUND + 1] - typical).sum())
    return net / height > _KEPT


def _off_neighbours(values: FloatArray) -> FloatArray:
    """Each sample less the median of the two before and the two after."""
    padded = np.pad(values, _AROUND, mode="reflect")
    first, second, third, fourth = padded[:-4], padded[1:-3], padded[3:-1], padded[4:]
    # The middle two of four lie between the higher of the lower ones and the lower of the higher.
    lower = np.maximum(np.minimum(first, second), np.minimum(third, fourth))
    higher = np.minimum(np.maximum(first, second), np.maximum(third, fourth))
    return np.asarray(values - 0.5 * (lower + higher))


def without_spikes(increments: ArrayLike, spikes: Spikes) -> FloatArray:
    """Increments with each spike replaced by the median of its neighbours.

    Parameters
    ----------
    increments
        (samples,), rad.
    spikes
        Of `find_spikes`.
    """
    values = np.asarray(increments, dtype=np.float64)

    def cleaned(block: slice) -> FloatArray:
        part = values[block].copy()
        first, last = np.searchsorted(spikes.index, [block.start, block.stop])
        part[spikes.index[first:last] - block.start] -= spikes.height[first:last]
        return part

    return series.made(cleaned, values.size, values)


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
    significance
        In standard errors.
    """

    rate: float
    time: float
    until_s: float
    significance: float


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
        significance=math.sqrt(best.statistic),
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
