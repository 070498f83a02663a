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
    block = max(_LEAST, changes.size // _BLOCKS)

    def of_block(some: slice) -> tuple[float, float, float, float]:
        part = changes[some]
        steps = np.diff(part)
        squares = np.square(steps)
        kept = max(1, int(_KEPT * squares.size))
        smallest = np.partition(squares, kept - 1)[:kept] if squares.size else np.zeros(1)
        size = np.abs(steps)
        rounding = _ROUNDING * float(size.max(initial=0.0))
        return (
            float(np.median(part[:: max(1, part.size // _SAMPLED)])),
            0.5 * float(squares.sum()) / max(steps.size, 1),
            0.5 * float(smallest.mean()) / _KEPT_SQUARE,
            float(size[size > rounding].min(initial=math.inf)),
        )

    whole = max(block, changes.size // block * block)
    found = np.array(series.map(of_block, min(whole, changes.size), changes, length=block))
    return Profile(
        changes=changes,
        level=found[:, 0],
        power=found[:, 1],
        typical=found[:, 2],
        step=float(found[:, 3].min()),
        block=block,
    )
