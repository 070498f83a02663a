"""Single samples far off their neighbours."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtr, ndtri

from sagnac import series
from sagnac.arrays import FloatArray, IntegerArray
from sagnac.errors import Note, counted
from sagnac.recording import _kernels
from sagnac.recording.channel import Channel
from sagnac.recording.effects import effect_words
from sagnac.recording.model import Recording, second_of
from sagnac.recording.profile import Profile

# Chance that noise without spikes shows one.
_SPIKE_CHANCE: Final = 1e-3
# More of the samples than this are no spikes, but the noise.
_MANY: Final = 0.01
# A heavy tail of the noise goes on below the limit: from 0.6 of the limit up to it lie more than
# twice as many samples as beyond it. A tail that falls as x^-3 has 3.6 times as many there, one as
# x^-6 20 times; spikes whose heights are spread evenly have fewer than one.
_TAIL: Final = 2.0
_BELOW: Final = 0.6
# Samples looked at around each for its neighbourhood.
_AROUND: Final = 2
# Samples whose median is the level that a spike stands on, and share of it that has to stay.
_WIDE: Final = 8
_KEPT: Final = 0.5
# A limit is this much above that of chance: the scatter of a block is not known better.
_MARGIN: Final = 1.15
_BLOCK: Final = 2**16
# Samples of a block that tell its scatter, about.
_TELL: Final = 2**13
# Fewest samples in which spikes are looked for.
LEAST_FOR_SPIKES: Final = 16


@dataclass(frozen=True, slots=True, kw_only=True)
class Spikes:
    """Samples far off their neighbours.

    Attributes
    ----------
    index
        (count,) where.
    height
        (count,) how far each lies from its neighbours, rad.
    added_walk
        What they add to N, rad/sqrt(s): ``N^2`` grows by its square, the sum of the squared
        heights over the duration.
    many
        Whether more than one in a hundred samples lie so far off, whether the angle keeps what they
        add or not: that is the noise, and none is listed.
    tail
        Whether they are the end of a heavy tail: that is the noise as well, and none is listed.
    """

    index: IntegerArray
    height: FloatArray
    added_walk: float
    many: bool = False
    tail: bool = False


def find_spikes(increments: ArrayLike, *, sample_rate: float) -> Spikes:
    """Find single samples that lie farther from their neighbours than chance puts them.

    Each sample less the median of the four around it, against the scatter of such differences
    in its block of 65,536 samples (by their quartiles).

    Parameters
    ----------
    increments
        (samples,), rad.
    sample_rate
        Samples per second.

    Returns
    -------
    Spikes
        None are listed if more than one in a hundred samples lie so far off, or if they are the
        end of a heavy tail that goes on below them: that is the noise.
    """
    values = np.asarray(increments, dtype=np.float64)
    if values.ndim != 1 or values.size < LEAST_FOR_SPIKES:
        raise ValueError(f"increments has shape {values.shape}; give {LEAST_FOR_SPIKES} or more")
    # Beyond this many scatters lies one sample in a record by chance.
    limit = -float(ndtri(0.5 * _SPIKE_CHANCE / values.size))
    blocks = series.map(
        lambda block: _spikes_in(values, block, limit), values.size, values, length=_BLOCK
    )
    index = np.concatenate([block.index for block in blocks])
    height = np.concatenate([block.height for block in blocks])
    beyond = sum(block.beyond for block in blocks)
    many = beyond > _MANY * values.size
    by_chance = 2.0 * values.size * float(ndtr(-_BELOW * _MARGIN * limit))
    below = sum(block.below for block in blocks) - by_chance
    tail = not many and index.size > 0 and below > _TAIL * beyond
    if many or tail:
        index, height = index[:0], height[:0]
    added = math.sqrt(float(height @ height) * sample_rate / values.size)
    return Spikes(index=index, height=height, added_walk=added, many=many, tail=tail)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Far:
    """Samples of one block that lie far off their neighbours.

    Besides how many lie beyond the limit, whether the angle keeps them or not, and how many lie
    somewhat below it.
    """

    index: IntegerArray
    height: FloatArray
    beyond: int
    below: int


def _spikes_in(values: FloatArray, block: slice, limit: float) -> _Far:
    first, last = max(0, block.start - _AROUND), min(values.size, block.stop + _AROUND)
    off = _off_neighbours(values[first:last])[block.start - first :][: block.stop - block.start]
    some = off[:: max(1, off.size // _TELL)]
    low, high = np.quantile(some, [0.25, 0.75])
    # Coarse steps have quartiles of a step or none: the root mean square of the inner part.
    inner = some[np.abs(some) <= np.quantile(np.abs(some), 0.95)]
    scale = max((high - low) / 1.349, 1.3 * float(np.sqrt(np.mean(inner**2))))
    # A gyro that stands still in a block shows no scatter: nothing lies off there.
    size, reach = np.abs(off), _MARGIN * limit * scale if scale > 0.0 else math.inf
    found = np.flatnonzero(size > reach)
    stays = [
        place for place in found.tolist() if _stays(values, place + block.start, float(off[place]))
    ]
    index = np.array(stays, dtype=np.int64)
    return _Far(
        index=index + block.start,
        height=off[index],
        beyond=found.size,
        below=int(np.count_nonzero(size > _BELOW * reach)) - found.size,
    )


def _stays(values: FloatArray, place: int, height: float) -> bool:
    """Whether the angle keeps what a sample adds.

    If its neighbours take it back, the angle alone was off for a moment: that adds nothing to N,
    and to replace one of them would.
    """
    if not _AROUND <= place < values.size - _AROUND:
        return False
    typical = np.median(values[max(0, place - _WIDE) : place + _WIDE + 1])
    net = float((values[place - _AROUND : place + _AROUND + 1] - typical).sum())
    return net / height > _KEPT


def _off_neighbours(values: FloatArray) -> FloatArray:
    """Each sample less the median of the two before and the two after."""
    padded = np.pad(values, _AROUND, mode="reflect")
    off = np.empty(values.size)
    _kernels.off_neighbours(padded, off)
    return off


def without_spikes(increments: ArrayLike, spikes: Spikes) -> FloatArray:
    """Increments with each spike replaced by the median of its neighbours.

    Parameters
    ----------
    increments
        (samples,), rad.
    spikes
        Of `find_spikes`.
    """
    values = np.asarray(increments, dtype=np.float64)

    def cleaned(block: slice) -> FloatArray:
        part = values[block].copy()
        first, last = np.searchsorted(spikes.index, [block.start, block.stop])
        part[spikes.index[first:last] - block.start] -= spikes.height[first:last]
        return part

    return series.made(cleaned, values.size, values)


def spike_notes(recording: Recording, gyro: Channel, profile: Profile) -> tuple[Note, ...]:
    """Single samples far off their neighbours: a warning, for the answer goes without them."""
    changes = profile.changes
    if changes.size < LEAST_FOR_SPIKES:
        return ()
    found = find_spikes(changes, sample_rate=1.0)
    if found.many and not profile.is_coarse:
        text = (
            f"more than one sample in {round(1.0 / _MANY)} lies far off its neighbours: it is no "
            "even noise, and its angle random walk contains them"
        )
        return (Note(name="spikes", channel=gyro.name, text=text, level="warning"),)
    if found.tail:
        text = (
            "some samples lie far off their neighbours, as the end of a heavy tail of the noise "
            "that goes on below them: the angle random walk contains them"
        )
        return (Note(name="spikes", channel=gyro.name, text=text, level="remark"),)
    if found.index.size == 0:
        return ()
    inside = profile.scale
    effect = math.hypot(1.0, found.added_walk / inside) if inside > 0.0 else None
    text = (
        f"{counted(int(found.index.size), 'sample')} far off their neighbours (spikes), the first "
        f"at {second_of(recording, int(found.index[0])):.3f} s: an answer goes without them; left "
        "in"
    )
    note = Note(
        name="spikes",
        channel=gyro.name,
        text=f"{text}, {effect_words(effect)}",
        level="warning",
        effect=effect,
    )
    return (note,)
