"""Which power law rules at a cluster time."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from sagnac import series
from sagnac.arrays import FloatArray
from sagnac.errors import Note
from sagnac.stability import _kernels
from sagnac.stability.accumulate import Track
from sagnac.stability.estimators import Properties

_FEWEST_FOR_NOISE: Final = 30  # Riley and Greenhall
_SURE_OF_NOISE: Final = 200  # angles that leave no doubt between one type and the next
_NOISE_BOUNDS: Final = (1.5, 0.5, -0.5, -1.5, -2.5, -3.5)
# Angles taken a cluster apart stay correlated after differencing if they are integrals of
# a random walk: the method reads -2.4, -3.9 and -4.6 for -2, -3 and -4.
_NOISE_BOUNDS_APART: Final = (1.5, 0.5, -0.5, -1.5, -3.1, -4.25)


@dataclass(frozen=True, slots=True, kw_only=True)
class NoiseTypes:
    """Power law of the rate noise at each cluster, (points,), and what was noticed."""

    exponents: NDArray[np.int64]
    notes: tuple[Note, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class _Reading:
    """Exponent as read, not rounded, and about its standard deviation times 1.3."""

    exponent: float
    scatter: float


def identified_noise_types(
    track: Track, clusters: NDArray[np.int64], estimator: Properties
) -> NoiseTypes:
    """Power law of the rate noise at each cluster, by lag-1 autocorrelation.

    Angles a cluster apart lose a parabola and are differenced until they are stationary.
    From short clusters to long, on octaves at least, the type found before stands as long as
    the reading is within its scatter of it, or less red. Beyond the longest cluster that leaves
    30 angles, the last type stands.

    Parameters
    ----------
    track
        The record.
    clusters
        (points,) in samples, ascending.
    estimator
        Its row of the table.

    References
    ----------
    Riley and Greenhall, Power law noise identification using the lag 1 autocorrelation,
    EFTF 2004.
    """
    longest = int(track.lengths.max(initial=1)) - 1
    usable = longest // (_FEWEST_FOR_NOISE - 1)
    ladder = _ladder(clusters, longest)
    ladder = ladder[ladder <= usable]
    found: list[int] = []
    for m in map(int, ladder):
        reading = _read_noise(track, m, estimator.order)
        if math.isnan(reading.exponent):
            break
        found.append(
            _standing_type(reading, m, found[-1] if found else None, estimator.lowest_exponent)
        )
    if not found:
        note = Note(
            text="noise type taken as 0 (angle random walk) for the intervals: "
            f"under {_FEWEST_FOR_NOISE} angles, or no noise, to tell it from",
        )
        return NoiseTypes(exponents=np.zeros(clusters.size, dtype=np.int64), notes=(note,))
    ladder = ladder[: len(found)]
    carried = int((clusters > usable).sum())
    notes: tuple[Note, ...] = ()
    if carried:
        notes = (
            Note(
                text=f"the intervals of the {carried} longest cluster times take the noise to be "
                f"what it is at {ladder[-1]} samples"
            ),
        )
    place = np.maximum(np.searchsorted(ladder, clusters, side="right") - 1, 0)
    return NoiseTypes(exponents=np.array(found, dtype=np.int64)[place], notes=notes)


def _ladder(clusters: NDArray[np.int64], longest: int) -> NDArray[np.int64]:
    """Clusters to read the noise at: those asked for, and octaves from a sure one up."""
    anchor = max(1, min(int(clusters[0]), longest // _SURE_OF_NOISE))
    octaves = anchor * 2 ** np.arange(int(clusters[-1]).bit_length(), dtype=np.int64)
    return np.unique(np.concatenate((octaves[octaves <= clusters[-1]], clusters)))


def _standing_type(reading: _Reading, cluster: int, previous: int | None, lowest: int) -> int:
    """Noise type of a reading, after that of the shorter clusters."""
    nearest = max(_nearest_type(reading.exponent, cluster), lowest)
    if previous is None:
        return nearest
    above = max(_nearest_type(reading.exponent + reading.scatter, cluster), lowest)
    below = max(_nearest_type(reading.exponent - reading.scatter, cluster), lowest)
    # Noise only gets redder with the cluster time: in a sum of power laws the redder rules
    # the longer, and a reading that says otherwise is scatter, or a line.
    return previous if below <= previous <= above or nearest > previous else nearest


def _read_noise(track: Track, cluster: int, order: int) -> _Reading:
    counts = (track.lengths - 1) // cluster + 1
    enough = counts >= _FEWEST_FOR_NOISE
    first, count = _sample_stretches(track.starts[enough], track.lengths[enough], cluster)
    level = _lag_one_order(track.angle, first, count, cluster, order)
    fewest = min(int(counts[enough].sum()), int(count.sum()))
    return _Reading(exponent=2.0 - 2.0 * level, scatter=2.0 / math.sqrt(fewest))


def _lag_one_order(
    angle: FloatArray,
    first: NDArray[np.int64],
    count: NDArray[np.int64],
    cluster: int,
    order: int,
) -> float:
    """Integrations of white noise that angles a cluster apart amount to; NaN for a constant."""
    if not series.is_mapped(angle):
        return float(_kernels.lag_one_order(angle, first, count, cluster, order))
    # Reading here and there would bring in all of the record.
    places = np.concatenate(
        [start + cluster * np.arange(size) for start, size in zip(first, count, strict=True)]
    )
    ascending = np.argsort(places)
    values = np.empty(places.size)
    values[ascending] = series.at(angle, places[ascending])
    ends = np.cumsum(count)
    return float(_kernels.lag_one_order(values, ends - count, count, 1, order))


def _nearest_type(exponent: float, cluster: int) -> int:
    bounds = _NOISE_BOUNDS if cluster == 1 else _NOISE_BOUNDS_APART
    return 2 - sum(exponent < bound for bound in bounds)


def _sample_stretches(
    starts: NDArray[np.int64], lengths: NDArray[np.int64], cluster: int
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Where to read angles a cluster apart, and how many: some 32 000 in all at most.

    They fix the autocorrelation to half a percent, far inside the width of a noise type. A
    short record is read up to eight times, each time starting elsewhere in the cluster.
    """
    length, most = 4096, 8
    counts = (lengths - 1) // cluster + 1
    places, sizes = [], []
    if counts.sum() <= length * most:
        readings = min(cluster, most, int(length * most // counts.sum()))
        for start, size in zip(starts, lengths, strict=True):
            for k in range(readings):
                offset = k * cluster // readings
                places.append(int(start) + offset)
                sizes.append((int(size) - 1 - offset) // cluster + 1)
        return np.array(places), np.array(sizes)
    for start, count in zip(starts, counts, strict=True):
        pieces = max(1, int(count) // length)
        for k in range(pieces):
            places.append(int(start) + (k * int(count) // pieces) * cluster)
            sizes.append(min(length, int(count) // pieces))
    chosen = np.unique(np.rint(np.linspace(0, len(places) - 1, most)).astype(np.int64))
    return np.array(places)[chosen], np.array(sizes)[chosen]


def check_noise_type(noise_type: int, estimator: Properties) -> None:
    """Refuse a power law for which the estimator does not converge.

    Raises
    ------
    ValueError
        With the exponents to choose from.
    """
    lowest = estimator.lowest_exponent
    if noise_type not in range(lowest, 3):
        raise ValueError(
            f"noise_type {noise_type!r} is out of range for {estimator.name}; use {lowest} to 2"
        )
