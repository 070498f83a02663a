"""The step that numbers are counted in, through what a scale, decimals or single precision add."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from sagnac import series
from sagnac.arrays import FloatArray, IntegerArray
from sagnac.recording import _kernels

# Samples on one side of which a median is taken.
_SIDE: Final = 3
# Classes of sizes: half octaves, far beyond all that is measured in rad or m/s on either side.
_EDGES: Final = np.exp2(np.arange(-240, 121) / 2.0)
# Sizes that rounding makes lie this many classes, a factor of four, below those that a step makes.
# They are this many at least, and the others more than this share of all: fewer are spikes.
_CLASSES: Final = 4
_LEAST_OFTEN: Final = 10
_LEAST_SHARE: Final = 0.01
# Largest sizes that are looked at, in steps, and how near to whole steps half of them lie.
_WITHIN: Final = 6.0
_NEAR: Final = 0.12
# A motion that speeds up or slows down evenly makes sizes as well: what it changes by in one sample
# and, behind its first samples, in two; and the changes go on growing or falling. Steps of a
# readout come and go, or are of more sizes. Shares of the samples.
_GOES_ON: Final = 0.6
_FEW_SIZES: Final = 0.95


@dataclass(frozen=True, slots=True, kw_only=True)
class _Sizes:
    """How many sizes each class holds, the smallest of each, and how many are nothing."""

    counts: IntegerArray
    smallest: FloatArray
    nothing: int


def count_step(changes: FloatArray, rounding: float = 0.0) -> float:
    """The step of a readout.

    What a sample turned is held against the median of three before and of three behind, whichever
    is nearer, so that a motion that reverses at once makes no size of its own. In numbers that are
    counted, these sizes are whole steps, or what the rounding of a file leaves of nothing; between
    the two lies a gap. In numbers that are not, the sizes go on to the smallest.

    Parameters
    ----------
    changes
        (samples,) what each sample turned.
    rounding
        Sizes up to this are nothing.

    Returns
    -------
    float
        In the unit of the changes. If the numbers are not counted, the smallest size there is;
        infinite if there is none.
    """
    if changes.size <= 2 * _SIDE:
        return math.inf
    found = _sizes_of(changes, rounding)
    filled = np.flatnonzero(found.counts)
    if filled.size == 0:
        return math.inf
    finest = float(found.smallest[filled[0]])
    below = found.nothing + np.cumsum(found.counts[filled])[:-1]
    gaps = np.flatnonzero((np.diff(filled) > _CLASSES) & (below >= _LEAST_OFTEN))
    # Decimals are a lattice of their own: the coarsest is the readout's.
    for gap in gaps[::-1].tolist():
        step = _whole_step(changes, float(found.smallest[filled[gap + 1]]))
        if step is not None:
            return step
    return finest


def _off(changes: FloatArray, block: slice) -> FloatArray:
    """(block,) how far samples lie from the median on the nearer side, without the outermost."""
    off = np.empty(block.stop - block.start)
    _kernels.off_nearer_side(changes[block.start : block.stop + 2 * _SIDE], off)
    return off


def _sizes_of(changes: FloatArray, rounding: float) -> _Sizes:
    def counted(block: slice) -> _Sizes:
        sizes = np.sort(_off(changes, block))
        sizes = sizes[np.searchsorted(sizes, rounding, side="right") :]
        places = np.searchsorted(sizes, _EDGES)
        counts = np.diff(places)
        smallest = np.full(counts.size, math.inf)
        smallest[counts > 0] = sizes[places[:-1][counts > 0]]
        nothing = block.stop - block.start - sizes.size
        return _Sizes(counts=counts, smallest=smallest, nothing=nothing)

    parts = series.map(counted, changes.size - 2 * _SIDE, changes)
    return _Sizes(
        counts=np.sum([part.counts for part in parts], axis=0),
        smallest=np.min([part.smallest for part in parts], axis=0),
        nothing=sum(part.nothing for part in parts),
    )


def _whole_step(changes: FloatArray, least: float) -> float | None:
    """The step of sizes from `least` on; None if they are not whole numbers of it."""

    def within(block: slice) -> FloatArray:
        """Sizes, and whether the changes go on the same way before and behind."""
        sizes = _off(changes, block)
        steps = np.diff(changes[block.start + _SIDE - 1 : block.stop + _SIDE + 1])
        taken = (sizes >= least) & (sizes < _WITHIN * least)
        return np.stack([sizes[taken], (steps[1:] * steps[:-1] > 0.0)[taken]])

    parts = series.map(within, changes.size - 2 * _SIDE, changes)
    sizes, goes_on = np.concatenate(parts, axis=1)
    if sizes.size < _LEAST_SHARE * changes.size:
        return None
    if np.mean(sizes < 2.5 * least) > _FEW_SIZES and goes_on.mean() > _GOES_ON:
        return None
    step = float(np.median(sizes[sizes < 1.5 * least]))
    off = np.abs(sizes / step - np.rint(sizes / step))
    return step if float(np.median(off)) < _NEAR else None
