"""Cluster times of a curve."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sagnac.errors import Note
from sagnac.stability.estimators import Properties

_POINTS_PER_DECADE: Final = 20


@dataclass(frozen=True, slots=True, kw_only=True)
class Clusters:
    """Clusters to take: `sizes` (points,) in samples, ascending, and what was noticed."""

    sizes: NDArray[np.int64]
    notes: tuple[Note, ...] = ()


def cluster_sizes(
    taus: ArrayLike | None, angles: int, sample_rate: float, estimator: Properties
) -> Clusters:
    """Clusters at the cluster times asked for.

    Parameters
    ----------
    taus
        s, or None for those of the estimator's own grid.
    angles
        Accumulated angles in the record.
    sample_rate
        Hz.
    estimator
        Its row of the table.

    Raises
    ------
    ValueError
        If the record is too short, or a cluster time cannot be used.
    """
    smallest, largest = estimator.shortest, estimator.longest(angles)
    if largest < smallest or angles < estimator.fewest_angles:
        raise ValueError(
            f"values: {angles} accumulated angles are too few for {estimator.name}; "
            "record longer or use oadev"
        )
    if taus is None:
        return Clusters(sizes=_default_sizes(smallest, largest, estimator))
    wanted = np.atleast_1d(np.asarray(taus, dtype=np.float64))
    if wanted.ndim != 1 or wanted.size == 0:
        raise ValueError(f"taus has shape {wanted.shape}; give one or more cluster times in s")
    if not np.isfinite(wanted).all():
        raise ValueError("taus holds a value that is not finite; give cluster times in s")
    rounded = np.rint(wanted * sample_rate / estimator.step) * estimator.step
    outside = (rounded < smallest) | (rounded > largest)
    if outside.any():
        raise ValueError(
            f"taus: {wanted[outside][0]:.12g} s is out of range for {estimator.name}; "
            f"use {smallest / sample_rate:.12g} s to {largest / sample_rate:.12g} s"
        )
    sizes = np.unique(rounded.astype(np.int64))
    moved = np.abs(rounded - wanted * sample_rate) > 1e-6 * rounded
    notes = []
    if moved.any():
        unit = "two sample intervals" if estimator.step == 2 else "the sample interval"
        notes.append(f"{int(moved.sum())} of {wanted.size} taus rounded to a multiple of {unit}")
    if sizes.size < wanted.size:
        notes.append(f"{wanted.size - sizes.size} of {wanted.size} taus coincide and are merged")
    return Clusters(sizes=sizes, notes=tuple(Note(text=text) for text in notes))


def _default_sizes(smallest: int, largest: int, estimator: Properties) -> NDArray[np.int64]:
    if estimator.octaves:
        return 2 ** np.arange(int(largest).bit_length(), dtype=np.int64)
    count = 1 + math.ceil(_POINTS_PER_DECADE * math.log10(largest / smallest))
    grid = np.geomspace(smallest, largest, count)
    sizes = np.unique(np.rint(grid / estimator.step).astype(np.int64) * estimator.step)
    return np.asarray(sizes[(sizes >= smallest) & (sizes <= largest)])
