"""How a gyro's noise runs through the record: its power from block to block.

The step that numbers are counted in, noise between lines made white, and the stretch that is
sound, which is a remedy for the rest.
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.fft import irfft, rfft

from sagnac.core.arrays import FloatArray, IntegerArray, blocks, differences, every, extent
from sagnac.quality import _kernels
from sagnac.recording.channel import Channel
from sagnac.recording.model import MINIMUM_SAMPLES, Recording, second_of
from sagnac.recording.stamps import Stretch

# ---- lattice -----------------------------------------------------------------------

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
    counts, smallest, nothing = _sizes_of(changes, rounding)
    filled = np.flatnonzero(counts)
    if filled.size == 0:
        return math.inf
    finest = float(smallest[filled[0]])
    below = nothing + np.cumsum(counts[filled])[:-1]
    gaps = np.flatnonzero((np.diff(filled) > _CLASSES) & (below >= _LEAST_OFTEN))
    # Decimals are a lattice of their own: the coarsest is the readout's.
    for gap in gaps[::-1].tolist():
        step = _whole_step(changes, float(smallest[filled[gap + 1]]))
        if step is not None:
            return step
    return finest


def _off(changes: FloatArray) -> FloatArray:
    """How far samples lie from the median on the nearer side, without the outermost."""
    off = np.empty(changes.size - 2 * _SIDE)
    _kernels.off_nearer_side(changes, off)
    return off


def _sizes_of(changes: FloatArray, rounding: float) -> tuple[IntegerArray, FloatArray, int]:
    """How many sizes each class holds, the smallest of each, and how many are nothing."""
    counts = np.zeros(_EDGES.size - 1, dtype=np.int64)
    smallest = np.full(counts.size, math.inf)
    nothing = 0
    for block in blocks(changes.size - 2 * _SIDE):
        sizes = np.sort(_off(changes[block.start : block.stop + 2 * _SIDE]))
        zeros = int(np.searchsorted(sizes, rounding, side="right"))
        sizes = sizes[zeros:]
        nothing += zeros
        places = np.searchsorted(sizes, _EDGES)
        here = np.diff(places) > 0
        counts += np.diff(places)
        smallest[here] = np.minimum(smallest[here], sizes[places[:-1][here]])
    return counts, smallest, nothing


def _whole_step(changes: FloatArray, least: float) -> float | None:
    """The step of sizes from `least` on; None if they are not whole numbers of it."""
    # Sizes, and whether the changes go on the same way before and behind.
    parts = []
    for block in blocks(changes.size - 2 * _SIDE):
        off = _off(changes[block.start : block.stop + 2 * _SIDE])
        steps = np.diff(changes[block.start + _SIDE - 1 : block.stop + _SIDE + 1])
        taken = (off >= least) & (off < _WITHIN * least)
        parts.append(np.stack([off[taken], (steps[1:] * steps[:-1] > 0.0)[taken]]))
    sizes, goes_on = np.concatenate(parts, axis=1)
    if sizes.size < _LEAST_SHARE * changes.size:
        return None
    if np.mean(sizes < 2.5 * least) > _FEW_SIZES and goes_on.mean() > _GOES_ON:
        return None
    step = float(np.median(sizes[sizes < 1.5 * least]))
    off = np.abs(sizes / step - np.rint(sizes / step))
    return step if float(np.median(off)) < _NEAR else None


# ---- white -------------------------------------------------------------------------

# Frequencies whose median is the level of the noise there, and times that level that a line keeps.
_TOGETHER: Final = 64
_KEPT_WHITE: Final = 12.0
# Samples at either end that are left out.
EDGE: Final = 512


@dataclass(frozen=True, slots=True, kw_only=True)
class White:
    """White noise.

    Attributes
    ----------
    values
        (samples - 1024,) of any scale, from sample 512 on.
    innovation
        Standard deviation of what each change adds to all before it, in their unit: the root of
        the geometric mean of the spectrum between the lines (Kolmogorov). Motion that is slow,
        however large, adds next to nothing.
    """

    values: FloatArray
    innovation: float


def whitened(changes: FloatArray, *, bands: int | None = None, kept: float = _KEPT_WHITE) -> White:
    """Increments with each frequency divided by the level around it.

    Lines are cut down to a few times the level, which is the median over 64 frequencies, or over
    a band.

    Parameters
    ----------
    changes
        (samples,), more than 1024.
    bands
        How many equal bands have a level each, so that lines that wander stay within one.
    kept
        Times the level that a line keeps.
    """
    transform = rfft(changes)
    power = transform.real**2 + transform.imag**2
    together = max(_TOGETHER, power.size // bands) if bands else _TOGETHER
    blocks = power.size // together
    level = np.median(power[: blocks * together].reshape(blocks, together), axis=1)
    level = np.repeat(level, together) / math.log(2.0)
    level = np.append(level, np.full(power.size - level.size, level[-1]))
    held = level[level > 0.0]
    innovation = math.exp(0.5 * float(np.log(held).mean())) if held.size else 0.0
    scale = np.sqrt(np.maximum(level, power / kept))
    transform = np.divide(transform, scale, out=np.zeros_like(transform), where=scale > 0.0)
    # The slowest are drift.
    transform[:_TOGETHER] = 0.0
    # The end does not go on at the beginning, and what that makes of both is no noise.
    return White(
        values=np.asarray(irfft(transform, changes.size)[EDGE:-EDGE]),
        innovation=innovation / math.sqrt(changes.size),
    )


# ---- profile -----------------------------------------------------------------------

# Blocks that a record is cut into, and fewest samples of one.
_BLOCKS: Final = 64
_LEAST: Final = 64
# Share of the squares that counts for the typical power, the smallest; and the mean square of a
# standard normal number among that share of the smallest.
_KEPT: Final = 0.99
_KEPT_SQUARE: Final = 0.9247
# Roots of that power beyond which a sample counts as if it were there.
_FAR: Final = 3.0
# Changes below this many last places of the largest value are rounding: an angle of many turns is
# rounded where its changes would not be.
_LAST_PLACES: Final = 8.0
# Samples of a block that its median is taken of.
_SAMPLED: Final = 4096
# Samples whose blocks are worked on at once, about.
_AT_ONCE: Final = 2**16


@dataclass(frozen=True, slots=True, kw_only=True)
class Profile:
    """Noise of one channel, from differences of what neighbouring samples turn.

    Attributes
    ----------
    channel
        Whose noise it is.
    changes
        What each sample turned: the values of a rate or of increments, the differences of an
        angle.
    level
        (blocks,) median of the changes.
    power
        (blocks,) half the mean square of their differences: the variance of white noise.
    typical
        (blocks,) the same without the largest hundredth of them: single samples do not move it.
    spread
        (blocks,) mean square of the changes about their median, single samples far off cut down.
    step
        What the readout counts in; the smallest change there is if it does not count, infinite if
        nothing changes.
    block
        Samples in a block.
    """

    channel: Channel
    changes: FloatArray
    level: FloatArray
    power: FloatArray
    typical: FloatArray
    spread: FloatArray
    step: float
    block: int

    @property
    def scale(self) -> float:
        """Standard deviation that is typical of the record, without single samples."""
        return math.sqrt(float(np.median(self.typical)))

    @property
    def is_coarse(self) -> bool:
        """Whether the noise strays over fewer than two steps of the readout."""
        return 2.0 * self.step > self.scale


def changes_of(channel: Channel) -> FloatArray:
    """Turn of each sample, in the unit of the values: an angle's differences, or the values."""
    return differences(channel.values) if channel.kind == "angle" else channel.values


def rounding_in(values: FloatArray) -> float:
    """Changes up to which those of a series are rounding, in its unit."""
    return _LAST_PLACES * float(np.finfo(np.float64).eps) * max(map(abs, extent(values)))


def rounding_of(channel: Channel) -> float:
    """Rounding of the changes of an angle, in its unit; 0 if the values are no differences."""
    if channel.kind != "angle":
        return 0.0
    return _LAST_PLACES * float(np.spacing(max(map(abs, extent(channel.values)))))


def profile_of(channel: Channel) -> Profile:
    """The noise of a channel."""
    changes = changes_of(channel)
    # Fewer than a block are one.
    block = min(max(_LEAST, changes.size // _BLOCKS), changes.size)
    together = block * max(1, _AT_ONCE // block)
    found = np.concatenate(
        [
            _noise_of(changes[some].reshape(-1, block))
            for some in blocks(changes.size // block * block, together)
        ]
    )
    return Profile(
        channel=channel,
        changes=changes,
        level=found[:, 0],
        power=found[:, 1],
        typical=found[:, 2],
        step=count_step(changes, rounding_in(channel.values)),
        spread=found[:, 3],
        block=block,
    )


def _noise_of(rows: FloatArray) -> FloatArray:
    """(blocks, 4) median, power, typical power and spread of (blocks, samples)."""
    sampled = rows[:, :: max(1, rows.shape[1] // _SAMPLED)]
    size = np.abs(np.diff(rows, axis=1))
    count = max(size.shape[1], 1)
    kept = max(1, int(_KEPT * size.shape[1]))
    whole = np.einsum("ij,ij->i", size, size)
    if kept < size.shape[1]:
        size.partition(kept, axis=1)
    smallest = size[:, :kept]
    typical = np.einsum("ij,ij->i", smallest, smallest) / kept / _KEPT_SQUARE
    level = np.median(sampled, axis=1)
    off = rows - level[:, np.newaxis]
    # A sample far off counts as one that is not.
    farthest = _FAR * np.sqrt(typical)[:, np.newaxis]
    np.clip(off, -farthest, farthest, out=off)
    spread = np.einsum("ij,ij->i", off, off) / rows.shape[1]
    return np.stack([level, 0.5 * whole / count, 0.5 * typical, spread], axis=1)


# ---- robust ------------------------------------------------------------------------

# Standard deviation of a normal number, of the median of its size.
_DEVIATION: Final = 1.4826


def scatter_of(values: FloatArray) -> float:
    """Standard deviation of normal numbers about zero, by the median of their size."""
    return _DEVIATION * float(np.median(np.abs(values)))


def some_steps(values: FloatArray, most: int) -> FloatArray:
    """Steps from a sample to the next at even distances, about `most` of them."""
    apart = max(1, (values.size - 1) // most)
    return every(values[1:], apart) - every(values[:-1], apart)


# ---- soundness ---------------------------------------------------------------------


def remedy_of(recording: Recording, stretch: Stretch) -> str:
    """Remedy if only this stretch is sound: ``take the sound stretch with {slice 30:90}``.

    Rounded inwards to ms, so that the slice named holds no sample outside the stretch.
    """
    first, last = stretch.first, stretch.after - 1
    begin = 0.0 if first == 0 else second_of(recording, first) * 1e3
    # Stamps of a damaged file may be any number.
    if stretch.samples < MINIMUM_SAMPLES or not math.isfinite(begin):
        return "get the file again from its source"
    start = math.ceil(begin) / 1e3
    stop = "" if last == recording.samples - 1 else f"{second_of(recording, last):.3f}"
    return f"take the sound stretch with {{slice {start:g}:{stop}}}"
