"""Dither taken out of a gyro's angle by regression on its pick-off.

The readout of a dithered gyro strips the dither by its pick-off, at a gain and a delay that are
not quite right. What is left is the pick-off through a filter that changes little over the width
of the dither's line, at a frequency that sampling has folded. Three neighbouring samples of the
pick-off make any gain and phase there, whether the dither is steady or randomised. It is fitted on
increments, where the walk is white.
"""

import math
from dataclasses import dataclass

import numpy as np

from sagnac.core.arrays import FloatArray, blocks, empty, mean

_REACH = 1  # samples either way
_TAPS = 2 * _REACH + 1
_LEAST_SAMPLES = 100
# Smallest eigenvalue of the normal matrix over the largest that is told from rounding.
_SINGULAR = 1e-12


@dataclass(frozen=True, slots=True, kw_only=True)
class Stripped:
    """An angle without what follows a pick-off.

    Attributes
    ----------
    angle
        (samples,) rad.
    taps
        (3,) rad of the angle per unit of the pick-off: one sample earlier, the same, one later.
    taken
        Rms of what was taken, rad.
    """

    angle: FloatArray
    taps: FloatArray
    taken: float


def stripped(angle: FloatArray, pickoff: FloatArray) -> Stripped:
    """Take what follows the pick-off out of an angle.

    Parameters
    ----------
    angle
        (samples,) rad.
    pickoff
        (samples,) in any unit, sampled with the angle.

    Raises
    ------
    ValueError
        If the two differ in length, are shorter than 100 samples, or the pick-off does not move.

    Examples
    --------
    >>> turns = 0.613 * np.arange(1000.0)
    >>> swing = np.cos(2.0 * np.pi * turns)
    >>> left = stripped(1e-3 * np.cos(2.0 * np.pi * turns + 0.3), swing)
    >>> bool(np.ptp(left.angle) < 1e-12)
    True
    """
    if angle.shape != pickoff.shape or angle.size < _LEAST_SAMPLES:
        raise ValueError(
            f"angle {angle.shape} and pickoff {pickoff.shape}; give two series of one length, "
            f"{_LEAST_SAMPLES} samples or more"
        )
    taps = _fitted(angle, pickoff)
    ends = _beyond(pickoff)
    middle = taps.sum() * mean(pickoff)
    square, rest = 0.0, empty(angle.size)
    for block in blocks(angle.size):
        follows = _neighbours(pickoff, block.start, block.stop, ends) @ taps - middle
        square += float(follows @ follows)
        rest[block] = angle[block] - follows
    return Stripped(angle=rest, taps=taps, taken=math.sqrt(square / angle.size))


def _beyond(pickoff: FloatArray) -> tuple[float, float]:
    """The sample before the first and the one after the last, as a swing would have them.

    A swing of one frequency about its mean has p[n-1] + p[n+1] = c p[n].
    """
    middle = mean(pickoff)
    both = square = 0.0
    for block in blocks(pickoff.size):
        here = pickoff[max(block.start, 1) - 1 : block.stop + 1] - middle
        both += float((here[:-2] + here[2:]) @ here[1:-1])
        square += float(here[1:-1] @ here[1:-1])
    ratio = both / square if square > 0.0 else 0.0
    before = ratio * (pickoff[0] - middle) - (pickoff[1] - middle)
    after = ratio * (pickoff[-1] - middle) - (pickoff[-2] - middle)
    return float(before + middle), float(after + middle)


def _neighbours(
    pickoff: FloatArray, start: int, stop: int, ends: tuple[float, float]
) -> FloatArray:
    """(stop - start, 3) the pick-off one sample earlier, at the same, and one later."""
    around = pickoff[max(start - _REACH, 0) : stop + _REACH]
    if start == 0:
        around = np.concatenate([ends[:1], around])
    if stop == pickoff.size:
        around = np.concatenate([around, ends[1:]])
    return np.stack([around[k : k + stop - start] for k in range(_TAPS)], axis=1)


def _fitted(angle: FloatArray, pickoff: FloatArray) -> FloatArray:
    """Taps by least squares of the angle's increments on the pick-off's, with a constant."""
    columns = _TAPS + 1
    total = np.zeros((columns, columns + 1))
    for block in blocks(angle.size):
        # Increments whose neighbours all exist.
        first = max(block.start, _REACH)
        last = max(min(block.stop, angle.size - 1 - _REACH), first)
        around = np.diff(pickoff[first - _REACH : last + 1 + _REACH])
        made = np.ones((last - first, columns))
        for tap in range(_TAPS):
            made[:, tap] = around[tap : tap + last - first]
        turned = np.diff(angle[first : last + 1])
        total += np.column_stack([made.T @ made, made.T @ turned])
    matrix, right = total[:, :columns], total[:, columns]
    size = np.sqrt(np.diag(matrix))
    if not np.all(size[:_TAPS] > 0.0):
        raise ValueError("the pick-off does not move; it shows no dither")
    inverse = np.linalg.pinv(matrix / np.outer(size, size), rcond=_SINGULAR, hermitian=True)
    solution: FloatArray = inverse @ (right / size) / size
    return solution[:_TAPS]
