"""How a gyro's noise runs through the record: its power from block to block."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from sagnac import series
from sagnac.arrays import FloatArray
from sagnac.recording.channel import Channel

# Blocks that a record is cut into, and fewest samples of one.
_BLOCKS: Final = 64
_LEAST: Final = 64
# Share of the squares that counts for the typical power, the smallest; and the mean square of a
# standard normal number among that share of the smallest.
_KEPT: Final = 0.99
_KEPT_SQUARE: Final = 0.9247
# Differences below this part of the largest are rounding.
_ROUNDING: Final = 1e-9
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
    step
        Smallest difference of changes that is not 0: what the readout counts in; infinite if
        there is none.
    block
        Samples in a block.
    """

    changes: FloatArray
    level: FloatArray
    power: FloatArray
    typical: FloatArray
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
    """What each sample turned, in the unit of the values: an angle's differences, or the values."""
    return series.differences(channel.values) if channel.kind == "angle" else channel.values


def profile_of(channel: Channel) -> Profile:
    """The noise of a channel, in one pass."""
    changes = changes_of(channel)
    # Fewer than a block are one.
    block = min(max(_LEAST, changes.size // _BLOCKS), changes.size)
    blocks = changes.size // block

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
        step=float(found[:, 3].min()),
        block=block,
    )


def _noise_of(rows: FloatArray) -> FloatArray:
    """(blocks, 4) median, power, typical power and smallest step of (blocks, samples)."""
    sampled = rows[:, :: max(1, rows.shape[1] // _SAMPLED)]
    size = np.abs(np.diff(rows, axis=1))
    count = max(size.shape[1], 1)
    kept = max(1, int(_KEPT * size.shape[1]))
    rounding = _ROUNDING * size.max(axis=1, initial=0.0, keepdims=True)
    finest = size.min(axis=1, where=size > rounding, initial=math.inf)
    whole = np.einsum("ij,ij->i", size, size)
    if kept < size.shape[1]:
        size.partition(kept, axis=1)
    smallest = size[:, :kept]
    typical = np.einsum("ij,ij->i", smallest, smallest) / kept / _KEPT_SQUARE
    return np.stack(
        [np.median(sampled, axis=1), 0.5 * whole / count, 0.5 * typical, finest], axis=1
    )
