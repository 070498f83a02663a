"""Cluster times of a curve."""

import math
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sagnac.stability.estimators import THEO1_EFFECTIVE, Estimator


def cluster_range(estimator: Estimator, samples: int) -> tuple[int, int]:
    """Smallest and largest m for `samples` angles; the span for Theo1."""
    if estimator in ("adev", "oadev", "haar"):
        return 1, (samples - 1) // 2
    if estimator in ("mdev", "tdev", "mtotdev"):
        return 1, samples // 3
    if estimator in ("hdev", "ohdev"):
        return 1, (samples - 1) // 3
    if estimator == "totdev":
        return 1, samples - 1
    if estimator == "theo1":
        return 10, (samples - 1) // 2 * 2
    return 1, int(THEO1_EFFECTIVE * ((samples - 1) // 2 * 2))


def cluster_sizes(
    taus: ArrayLike | None,
    samples: int,
    sample_rate: float,
    estimator: Estimator,
    notes: list[str],
) -> NDArray[np.int64]:
    """Cluster sizes, in samples, at the cluster times asked for."""
    smallest, largest = cluster_range(estimator, samples)
    if largest < smallest or (estimator == "theoh" and samples < _THEOH_SMALLEST):
        raise ValueError(
            f"values: {samples} accumulated angles are too few for {estimator}; "
            "record longer or use oadev"
        )
    step = 2 if estimator == "theo1" else 1
    if taus is None:
        if estimator == "haar":
            return 2 ** np.arange(int(largest).bit_length(), dtype=np.int64)
        count = 1 + math.ceil(_POINTS_PER_DECADE * math.log10(largest / smallest))
        grid = np.geomspace(smallest, largest, count)
        clusters = np.unique(np.rint(grid / step).astype(np.int64) * step)
        return np.asarray(clusters[(clusters >= smallest) & (clusters <= largest)])
    wanted = np.atleast_1d(np.asarray(taus, dtype=np.float64))
    if wanted.ndim != 1 or wanted.size == 0:
        raise ValueError(f"taus has shape {wanted.shape}; give one or more cluster times in s")
    if not np.isfinite(wanted).all():
        raise ValueError("taus holds a value that is not finite; give cluster times in s")
    rounded = np.rint(wanted * sample_rate / step) * step
    outside = (rounded < smallest) | (rounded > largest)
    if outside.any():
        raise ValueError(
            f"taus: {wanted[outside][0]:g} s is out of range for {estimator}; "
            f"use {smallest / sample_rate:g} s to {largest / sample_rate:g} s"
        )
    clusters = np.unique(rounded.astype(np.int64))
    moved = np.abs(rounded - wanted * sample_rate) > 1e-6 * rounded
    if moved.any():
        unit = "two sample intervals" if step == 2 else "the sample interval"
        notes.append(f"{int(moved.sum())} of {wanted.size} taus rounded to a multiple of {unit}")
    if clusters.size < wanted.size:
        notes.append(f"{wanted.size - clusters.size} of {wanted.size} taus coincide and are merged")
    return clusters


_THEOH_SMALLEST: Final = 90  # the first ratio needs 0.1 N / 3 - 3 >= 0
_POINTS_PER_DECADE: Final = 20
