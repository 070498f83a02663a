"""How a gyro's noise runs through the record: its power from block to block."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from sagnac import series
from sagnac.arrays import FloatArray
from sagnac.recording.channel import Channel
from sagnac.recording.lattice import count_step

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
    return series.differences(channel.values) if channel.kind == "angle" else channel.values


def profile_of(channel: Channel) -> Profile:
    """The noise of a channel."""
    changes = changes_of(channel)
    # Fewer than a block are one.
    block = min(max(_LEAST, changes.size // _BLOCKS), changes.size)
    blocks = changes.size // block
    low, high = series.extent(channel.values)
    rounding = _LAST_PLACES * float(np.finfo(np.float64).eps) * max(abs(low), abs(high))

    def of_blocks(some: slice) -> FloatArray:
        rows = changes[some.start * block : some.stop * block].reshape(-1, block)
        return _noise_of(rows)

    together = max(1, _AT_ONCE // block)
    found = np.concatenate(series.map(of_blocks, blocks, changes, length=together))
    return Profile(
        changes=changes,
        level=found[:, 0],
        power=found[:, 1],
        typical=found[:, 2],
        step=count_step(changes, rounding),
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
