"""The step of a readout: numbers that are counted lie on a lattice."""

import math
from typing import Final

import numpy as np

from sagnac.core.arrays import FloatArray, blocks, every
from sagnac.core.marks import number_of
from sagnac.quality import _kernels

# What is no chance happens this often, and this many times as often as chance makes it.
LEAST_OFTEN: Final = 10
OFTENER: Final = 3
# Samples on one side of which a median is taken.
_SIDE: Final = 3
# Largest sizes that are looked at, in steps.
_WITHIN: Final = 6.0
# Changes below this many last places of the largest value are rounding: an angle of many turns is
# rounded where its changes would not be.
LAST_PLACES: Final = 8.0
ROUNDING: Final = float(np.finfo(np.float64).eps)


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
    # Sizes in half octaves, which the exponents of their squares count.
    counts, smallest, nothing = np.zeros(2048, dtype=np.int64), math.inf, 0
    # What is made of so few samples together stays in cache.
    for block in blocks(changes.size - 2 * _SIDE, 2**15):
        sizes = _kernels.off_nearer_side(changes[block.start : block.stop + 2 * _SIDE])
        nothing += number_of(sizes <= rounding)
        sizes = sizes[(sizes > rounding) & (sizes < math.inf)]
        smallest = min(smallest, float(sizes.min(initial=math.inf)))
        counts += np.bincount(np.square(sizes).view(np.int64) >> 52, minlength=counts.size)
    filled = np.flatnonzero(counts)
    below = nothing + np.cumsum(counts[filled])[:-1]
    # Sizes that rounding makes lie four classes, a factor of four, below those that a step makes.
    gaps = np.flatnonzero((np.diff(filled) > 4) & (below >= LEAST_OFTEN))
    # Decimals are a lattice of their own: the coarsest is the readout's.
    for gap in gaps[::-1].tolist():
        step = _whole_step(changes, 2.0 ** (0.5 * (float(filled[gap + 1]) - 1023.0)))
        if step is not None:
            return step
    return smallest


def largest_step(values: FloatArray, *, scatter: float, unit: float) -> float:
    """The coarsest step of numbers whose steps grow with their size; 0 for numbers in no steps.

    Steps of single precision double from octave to octave, those of six figures in a text are ten
    times as large from decade to decade. A table that stops has numbers of many sizes.

    Parameters
    ----------
    values
        (samples,).
    scatter
        Typical change from sample to sample.
    unit
        In which the values were stored, SI.
    """
    with np.errstate(divide="ignore"):
        stored = np.abs(values / unit)
        # One more at each octave and at each decade.
        sizes = np.floor(np.log10(stored)) + np.floor(np.log2(stored))
    changes = np.abs(np.diff(values))
    few = (changes > ROUNDING * np.abs(values[1:])) & (changes < scatter)
    # The steps of the smaller of two numbers divide those of the larger.
    _, size = np.unique(np.minimum(sizes[1:], sizes[:-1])[few], return_inverse=True)
    changes, number = changes[few], np.bincount(size)
    least = np.full(number.size, np.inf)
    np.minimum.at(least, size, changes)
    parts = changes / least[size]
    whole = np.bincount(size, np.abs(parts - np.rint(parts)) < 0.1)
    return float(least[(number >= LEAST_OFTEN) & (whole > 0.9 * number)].max(initial=0.0))


def _whole_step(changes: FloatArray, bound: float) -> float | None:
    """The step of sizes from `bound` on; None if they are not whole numbers of it."""
    # Sizes, and whether the changes go on the same way before and behind.
    parts = []
    for block in blocks(changes.size - 2 * _SIDE):
        off = _kernels.off_nearer_side(changes[block.start : block.stop + 2 * _SIDE])
        steps = np.diff(changes[block.start + _SIDE - 1 : block.stop + _SIDE + 1])
        taken = (off >= bound) & (off < 2.0 * _WITHIN * bound)
        parts.append(np.stack([off[taken], (steps[1:] * steps[:-1] > 0.0)[taken]]))
    sizes, goes_on = np.concatenate(parts, axis=1)
    least = sizes.min()
    sizes, goes_on = sizes[sizes < _WITHIN * least], goes_on[sizes < _WITHIN * least]
    # Fewer sizes are spikes.
    if sizes.size < 0.01 * changes.size:
        return None
    # A motion that speeds up or slows down evenly makes sizes as well: what it changes by in one
    # sample and, behind its first samples, in two, or parts of that if it begins within a sample;
    # and the changes go on growing or falling. Steps of a readout come and go, or have more sizes.
    going = goes_on.mean()
    if going > 0.95 or (going > 0.6 and np.mean(sizes < 2.5 * least) > 0.95):
        return None
    step = float(np.median(sizes[sizes < 1.5 * least]))
    off = np.abs(sizes / step - np.rint(sizes / step))
    # Half of them have to lie near whole steps.
    return step if float(np.median(off)) < 0.12 else None


def rounding_in(values: FloatArray) -> float:
    """Changes up to which those of a series are rounding, in its unit."""
    # The largest sample may be a damaged one of 1e30, beside which all others are rounding. A high
    # quantile of a few hundred samples stands for it.
    some = np.abs(every(values, max(1, values.size // 256)))
    return LAST_PLACES * ROUNDING * float(np.quantile(some, 0.99))
