"""Which power law rules at a cluster time."""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from sagnac import series
from sagnac.arrays import FloatArray
from sagnac.stability import _kernels
from sagnac.stability.accumulate import Track
from sagnac.stability.estimators import DIFFERENCES, Estimator


def identified_noise_types(
    track: Track, clusters: NDArray[np.int64], order: int, notes: list[str]
) -> NDArray[np.int64]:
    """Power law of the rate noise at each cluster, by lag-1 autocorrelation.

    Angles a cluster apart lose a parabola and are differenced until they are stationary.
    From short clusters to long, on octaves at least, the type found before stands as long as
    the reading is within its scatter of it, or less red; and it stands for good where fewer than
    30 angles are left.
    """
    starts, lengths = track.starts, track.lengths
    longest = int(lengths.max(initial=1)) - 1
    usable = longest // (_FEWEST_FOR_NOISE - 1)
    anchor = max(1, min(int(clusters[0]), longest // _SURE_OF_NOISE))
    octaves = anchor * 2 ** np.arange(int(clusters[-1]).bit_length(), dtype=np.int64)
    ladder = np.unique(np.concatenate((octaves[octaves <= clusters[-1]], clusters)))
    ladder = ladder[ladder <= usable]
    found: list[int] = []
    for m in map(int, ladder):
        reading, scatter = _read_noise(track.angle, starts, lengths, m, order)
        previous = found[-1] if found else None
        if math.isnan(reading):
            break
        lowest = -2 if order == 2 else -4
        nearest = max(_nearest_type(reading, m), lowest)
        above = max(_nearest_type(reading + scatter, m), lowest)
        below = max(_nearest_type(reading - scatter, m), lowest)
        # Noise only gets redder with the cluster time: of a sum of power laws the redder rules
        # the longer, and a reading that says otherwise is scatter, or a line.
        stands = previous is not None and (below <= previous <= above or nearest > previous)
        found.append(previous if previous is not None and stands else nearest)
    if not found:
        notes.append(
            "noise type taken as 0 (angle random walk) for the intervals: "
            f"under {_FEWEST_FOR_NOISE} angles, or no noise, to tell it from"
        )
        return np.zeros(clusters.size, dtype=np.int64)
    ladder = ladder[: len(found)]
    carried = int((clusters > usable).sum())
    if carried:
        notes.append(
            f"noise type of the {carried} longest taus is that found at {ladder[-1]} samples"
        )
    place = np.maximum(np.searchsorted(ladder, clusters, side="right") - 1, 0)
    return np.array(found, dtype=np.int64)[place]


def _read_noise(
    angle: FloatArray,
    starts: NDArray[np.int64],
    lengths: NDArray[np.int64],
    cluster: int,
    order: int,
) -> tuple[float, float]:
    """Exponent as read, not rounded, and about its standard deviation times 1.3."""
    counts = (lengths - 1) // cluster + 1
    enough = counts >= _FEWEST_FOR_NOISE
    first, count = _sample_stretches(starts[enough], lengths[enough], cluster)
    if series.is_mapped(angle):
        # Reading here and there would bring in all of the record.
        places = np.concatenate(
            [start + cluster * np.arange(size) for start, size in zip(first, count, strict=True)]
        )
        ascending = np.argsort(places)
        values = np.empty(places.size)
        values[ascending] = series.at(angle, places[ascending])
        ends = np.cumsum(count)
        level = float(_kernels.lag_one_order(values, ends - count, count, 1, order))
    else:
        level = float(_kernels.lag_one_order(angle, first, count, cluster, order))
    return 2.0 - 2.0 * level, 2.0 / math.sqrt(min(int(counts[enough].sum()), int(count.sum())))


def _nearest_type(reading: float, cluster: int) -> int:
    bounds = _NOISE_BOUNDS if cluster == 1 else _NOISE_BOUNDS_APART
    return 2 - sum(reading < bound for bound in bounds)


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


def check_noise_type(noise_type: int, estimator: Estimator) -> None:
    """Refuse a power law for which the estimator does not converge."""
    lowest = -2 if DIFFERENCES[estimator] == 2 else -4
    if noise_type not in range(lowest, 3):
        raise ValueError(
            f"noise_type {noise_type!r} is out of range for {estimator}; use {lowest} to 2"
        )


_FEWEST_FOR_NOISE: Final = 30  # Riley and Greenhall
_SURE_OF_NOISE: Final = 200  # angles that leave no doubt between one type and the next
_NOISE_BOUNDS: Final = (1.5, 0.5, -0.5, -1.5, -2.5, -3.5)
# Angles taken a cluster apart stay correlated after differencing where they are integrals of
# a random walk: the method reads -2.4, -3.9 and -4.6 for -2, -3 and -4.
_NOISE_BOUNDS_APART: Final = (1.5, 0.5, -0.5, -1.5, -3.1, -4.25)
