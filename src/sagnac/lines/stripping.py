"""Dither taken out of a gyro's angle by regression on its pick-off.

The readout of a dithered gyro strips the dither by its pick-off, at a gain and a delay that are
not quite right. What is left is the pick-off through a filter that changes little over the width
of the dither's line, at a frequency that sampling has folded. Three neighbouring samples of the
pick-off make any gain and phase there, whether the dither is steady or randomised. It is fitted on
increments, where the walk is white.
"""

import math

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from sagnac.core.arrays import FloatArray, blocks, empty, mean

_TAPS = 3
_LEAST_SAMPLES = 100


def stripped(angle: FloatArray, pickoff: FloatArray) -> tuple[FloatArray, float]:
    """Take what follows the pick-off out of an angle.

    Parameters
    ----------
    angle
        (samples,) rad.
    pickoff
        (samples,) in any unit, sampled with the angle.

    Returns
    -------
    angle
        (samples,) rad.
    taken
        Rms of what was taken, rad.

    Raises
    ------
    ValueError
        If the two differ in length, are shorter than 100 samples, or the pick-off does not move.

    Examples
    --------
    >>> turns = 0.613 * np.arange(1000.0)
    >>> swing = np.cos(2.0 * np.pi * turns)
    >>> left, _ = stripped(1e-3 * np.cos(2.0 * np.pi * turns + 0.3), swing)
    >>> bool(np.ptp(left) < 1e-12)
    True
    """
    if angle.shape != pickoff.shape or angle.size < _LEAST_SAMPLES:
        remedy = f"give two series of one length, {_LEAST_SAMPLES} samples or more"
        raise ValueError(f"angle {angle.shape} and pickoff {pickoff.shape}; {remedy}")
    taps = _fitted(angle, pickoff)
    before, after = _beyond(pickoff)
    middle = taps.sum() * mean(pickoff)
    square, rest = 0.0, empty(angle.size)
    for block in blocks(angle.size):
        around = pickoff[max(block.start - 1, 0) : block.stop + 1]
        around = np.append(before, around) if block.start == 0 else around
        around = np.append(around, after) if block.stop == angle.size else around
        follows = sliding_window_view(around, _TAPS) @ taps - middle
        square += float(follows @ follows)
        rest[block] = angle[block] - follows
    return rest, math.sqrt(square / angle.size)


def _beyond(pickoff: FloatArray) -> tuple[float, float]:
    """The sample before the first and the one after the last, as a swing would have them.

    A swing of one frequency about its mean has p[n-1] + p[n+1] = c p[n].
    """
    middle = mean(pickoff)
    both = square = 0.0
    for block in blocks(pickoff.size - 2):
        here = pickoff[block.start : block.stop + 2] - middle
        both += float((here[:-2] + here[2:]) @ here[1:-1])
        square += float(here[1:-1] @ here[1:-1])
    ratio = both / square if square > 0.0 else 0.0
    beyond = middle + ratio * (pickoff[[0, -1]] - middle) - (pickoff[[1, -2]] - middle)
    return float(beyond[0]), float(beyond[1])


def _fitted(angle: FloatArray, pickoff: FloatArray) -> FloatArray:
    """Taps by least squares of the angle's increments on the pick-off's, with a constant.

    (3,) rad of the angle per unit of the pick-off: one sample earlier, the same, one later.
    """
    total = np.zeros((_TAPS + 1, _TAPS + 2))
    # Increments whose neighbours all exist.
    for block in blocks(angle.size - 2):
        first, last = max(block.start, 1), block.stop
        around, turned = np.diff(pickoff[first - 1 : last + 2]), np.diff(angle[first : last + 1])
        made = np.column_stack([sliding_window_view(around, _TAPS), np.ones(turned.size)])
        total += np.column_stack([made.T @ made, made.T @ turned])
    matrix, right = total[:, :-1], total[:, -1]
    size = np.sqrt(np.diag(matrix))
    if not np.all(size[:_TAPS] > 0.0):
        raise ValueError("the pick-off does not move; it shows no dither")
    inverse = np.linalg.pinv(matrix / np.outer(size, size), rcond=1e-12, hermitian=True)
    solution: FloatArray = inverse @ (right / size) / size
    return solution[:_TAPS]
