"""Single samples far off their neighbours, and leaps of an encoder.

A leap is rows of the file that were lost, or a slip that the gyros do not make.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtr, ndtri

from sagnac.core.arrays import FloatArray, IntegerArray, blocks, elementwise, empty, values_at
from sagnac.core.errors import Note, counted
from sagnac.core.units import ARCSECOND, DEGREE
from sagnac.quality import _kernels
from sagnac.quality.effects import effect_words
from sagnac.quality.encoder_faults import LEAST_SHARE, jump_notes, table_share
from sagnac.quality.profile import Profile, remedy_of, scatter_of
from sagnac.recording.channel import Channel, angle_of
from sagnac.recording.model import Recording, second_of
from sagnac.recording.stamps import longest_between

# ---- spikes ------------------------------------------------------------------------

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
    # Beyond this many scatters lies one sample in a record by chance.
    limit = -float(ndtri(0.5 * _SPIKE_CHANCE / values.size))
    far = [
        _spikes_in(values, block.start, block.stop, limit) for block in blocks(values.size, _BLOCK)
    ]
    indices, heights, counts, lower = zip(*far, strict=True)
    index, height = np.concatenate(indices), np.concatenate(heights)
    beyond = sum(counts)
    many = beyond > _MANY * values.size
    by_chance = 2.0 * values.size * float(ndtr(-_BELOW * _MARGIN * limit))
    below = sum(lower) - by_chance
    tail = not many and index.size > 0 and below > _TAIL * beyond
    if many or tail:
        index, height = index[:0], height[:0]
    added = math.sqrt(float(height @ height) * sample_rate / values.size)
    return Spikes(index=index, height=height, added_walk=added, many=many, tail=tail)


def _spikes_in(
    values: FloatArray, start: int, stop: int, limit: float
) -> tuple[IntegerArray, FloatArray, int, int]:
    """Samples of one block that lie far off their neighbours, and how far.

    Besides how many lie beyond the limit, whether the angle keeps them or not, and how many lie
    somewhat below it.
    """
    first, last = max(0, start - _AROUND), min(values.size, stop + _AROUND)
    padded = np.pad(values[first:last], _AROUND, mode="reflect")
    # Each sample less the median of the two before and the two after.
    off = np.empty(last - first)
    _kernels.off_neighbours(padded, off)
    off = off[start - first :][: stop - start]
    some = np.sort(off[:: max(1, off.size // _TELL)])
    quartiles = _quantile(some, 0.75) - _quantile(some, 0.25)
    # Coarse steps have quartiles of a step or none: the root mean square of the inner part.
    sizes = np.sort(np.abs(some))
    inner = sizes[sizes <= _quantile(sizes, 0.95)]
    scale = max(quartiles / 1.349, 1.3 * math.sqrt(float(inner @ inner) / inner.size))
    # A gyro that stands still in a block shows no scatter: nothing lies off there.
    size, reach = np.abs(off), _MARGIN * limit * scale if scale > 0.0 else math.inf
    found = np.flatnonzero(size > reach)
    stays = [place for place in found.tolist() if _stays(values, place + start, float(off[place]))]
    index = np.array(stays, dtype=np.int64)
    below = int(np.count_nonzero(size > _BELOW * reach)) - found.size
    return index + start, off[index], found.size, below


def _quantile(ascending: FloatArray, share: float) -> float:
    """As ``numpy.quantile``, of values that are sorted once for all quantiles."""
    place = share * (ascending.size - 1)
    below = ascending[int(place)]
    return float(below + (place % 1.0) * (ascending[math.ceil(place)] - below))


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
    cleaned = elementwise(np.add, values, 0.0)
    cleaned[spikes.index] -= spikes.height
    return cleaned


def spike_notes(recording: Recording, profile: Profile) -> tuple[Note, ...]:
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
        return (Note(name="spikes", channel=profile.channel.name, text=text, level="warning"),)
    if found.tail:
        text = (
            "some samples lie far off their neighbours, as the end of a heavy tail of the noise "
            "that goes on below them: the angle random walk contains them"
        )
        return (Note(name="spikes", channel=profile.channel.name, text=text, level="remark"),)
    if found.index.size == 0:
        return ()
    inside = profile.scale
    effect = math.hypot(1.0, found.added_walk / inside) if inside > 0.0 else None
    text = (
        f"{counted(int(found.index.size), 'sample')} far off their neighbours (spikes), the first "
        f"at {second_of(recording, int(found.index[0])):.3f} s: an answer goes without them; left "
        "in"
    )
    text = f"{text}, {effect_words(effect)}"
    name = profile.channel.name
    return (Note(name="spikes", channel=name, text=text, level="warning", effect=effect),)


# ---- table leaps -------------------------------------------------------------------

# Steps before and behind a leap that tell the usual one, and how unlike they may be, of it.
_SIDE: Final = 2
_UNLIKE: Final = 0.3
# A leap is longer than the usual step by whole steps to this, and to this part of their number; and
# a usual step is this many scatters of steps.
_WHOLE: Final = 0.15
_OF_NUMBER: Final = 0.01
_SCATTERS: Final = 8.0
_LOOKED_AT: Final = 20_000
# A slip below this is that of a sound encoder; and the encoder itself leaps by as much, to this.
_SLIPS: Final = 10.0 * ARCSECOND
_ITSELF: Final = 0.3


@dataclass(frozen=True, slots=True, kw_only=True)
class LostRows:
    """Places at which rows of a file were lost.

    Attributes
    ----------
    places
        (places,) last sample before each.
    rows
        (places,) how many were lost there.
    """

    places: IntegerArray
    rows: IntegerArray

    def closed(self, recording: Recording) -> Recording:
        """The recording without what its channels of angle turned in the rows that are not there.

        Its times are left as they are.
        """
        table = recording.table
        if table is None or not self.places.size:
            return recording
        gyros = tuple(self._closed(gyro) for gyro in recording.gyros)
        return replace(recording, gyros=gyros, table=self._closed(table))

    def _closed(self, channel: Channel) -> Channel:
        if channel.kind != "angle":
            return channel
        # What is left is the step that is usual there: how the rate changed meanwhile is not known.
        _, beyond = _steps_around(channel.values, self.places)
        turned = np.concatenate([[0.0], np.cumsum(beyond)])
        values = empty(channel.values.size)
        for block in blocks(values.size):
            passed = np.searchsorted(self.places, np.arange(block.start, block.stop))
            np.subtract(channel.values[block], turned[passed], out=values[block])
        return replace(channel, values=values)

    def notes(self, recording: Recording) -> tuple[Note, ...]:
        """A warning, if any were lost."""
        if not self.places.size:
            return ()
        text = (
            f"{counted(int(self.rows.sum()), 'row')} of the file lost at "
            f"{counted(int(self.places.size), 'place')}, the first at "
            f"{second_of(recording, int(self.places[0])):.3f} s, where channels of angle leap by "
            "whole steps: lines in time break there; "
            f"{remedy_of(recording, longest_between(recording.samples, self.places + 1))}"
        )
        return (Note(name="lost", level="warning", channel="table", text=text),)


def lost_rows(recording: Recording, gyros: Sequence[Channel]) -> LostRows:
    """Rows of the file that are not there, of a table that turns on.

    Where k rows are lost, the encoder's step is k steps longer than those around it, and so is that
    of every gyro of kind ``angle`` that is steady enough to tell.

    Parameters
    ----------
    recording
        With a table.
    gyros
        That are looked at.
    """
    none = np.empty(0, dtype=np.int64)
    table = recording.table
    if table is None or table.values.size < 4 * _SIDE:
        return LostRows(places=none, rows=none)
    places = _leaps(table.values)
    rows = np.rint(_ratio(table.values, places)).astype(np.int64)
    kept = np.ones(places.size, dtype=np.bool_)
    for gyro in gyros:
        if gyro.kind == "angle" and places.size:
            usual, _ = _steps_around(gyro.values, places)
            tells = np.abs(usual) > _SCATTERS * _scatter(gyro.values)
            kept &= ~tells | (np.abs(_ratio(gyro.values, places) - rows) < _tolerance(rows))
    return LostRows(places=places[kept], rows=rows[kept])


def slip_notes(recording: Recording, gyros: Sequence[Channel]) -> tuple[Note, ...]:
    """Jumps of the encoder that the gyro which senses it most does not make: a warning.

    If no gyro senses the table, jumps far beyond the usual step count.
    """
    table = recording.table
    if table is None or table.values.size <= LEAST_FOR_SPIKES:
        return ()
    shares = {gyro.name: table_share(recording, gyro) for gyro in gyros}
    known = {name: share for name, share in shares.items() if abs(share) > LEAST_SHARE}
    if not known:
        return jump_notes(recording, table)
    name = max(known, key=lambda one: abs(known[one]))
    angle, share = angle_of(recording.gyro(name), recording.sample_rate), known[name]
    steps = empty(angle.size - 1)
    for block in blocks(steps.size):
        part = slice(block.start, block.stop + 1)
        steps[block] = np.diff(table.values[part]) - np.diff(angle[part]) / share
    found = find_spikes(steps, sample_rate=1.0)
    inside = (found.index >= _SIDE) & (found.index < table.values.size - 1 - _SIDE)
    far = (np.abs(found.height) > _SLIPS) & inside
    places, height = found.index[far], found.height[far]
    _, own = _steps_around(table.values, places)
    itself = np.abs(own - height) < _ITSELF * np.abs(height)
    places, height = places[itself], height[itself]
    if not places.size:
        return ()
    text = (
        f"{counted(int(places.size), 'jump')} that gyro {name} does not make, by up to "
        f"{np.abs(height).max() / DEGREE:.3g} deg, the first at "
        f"{second_of(recording, int(places[0]) + 1):.3f} s; a pair of gyros is free of them; "
        f"{remedy_of(recording, longest_between(recording.samples, places + 1))}"
    )
    return (Note(name="steps", level="warning", channel="table", text=text),)


def _leaps(values: FloatArray) -> IntegerArray:
    """Samples before steps that are longer than those around them by whole steps."""
    least = _SCATTERS * _scatter(values)
    found = []
    for block in blocks(values.size - 2 * _SIDE - 1):
        usual, beyond, unlike = _around(np.diff(values[block.start : block.stop + 2 * _SIDE + 1]))
        steady = (np.abs(usual) > least) & (np.abs(unlike) < _UNLIKE * np.abs(usual))
        ratio = np.divide(beyond, usual, out=np.zeros_like(beyond), where=steady)
        number = np.rint(ratio)
        whole = (number >= 1.0) & (np.abs(ratio - number) < _tolerance(number))
        found.append(block.start + _SIDE + np.flatnonzero(whole))
    return np.concatenate(found)


def _tolerance(number: FloatArray | IntegerArray) -> FloatArray:
    return np.asarray(_WHOLE + _OF_NUMBER * number)


def _around(steps: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Usual step around all but the outermost steps, what is beyond it, unlikeness of the sides."""
    size = steps.shape[0] - 2 * _SIDE
    before = 0.5 * (steps[:size] + steps[1 : size + 1])
    behind = 0.5 * (steps[_SIDE + 1 : size + _SIDE + 1] + steps[_SIDE + 2 : size + _SIDE + 2])
    usual = 0.5 * (before + behind)
    return usual, steps[_SIDE : size + _SIDE] - usual, before - behind


def _steps_around(values: FloatArray, places: IntegerArray) -> tuple[FloatArray, FloatArray]:
    """(places,) usual step around places, and by how much the step there is longer."""
    reach = np.arange(-_SIDE, _SIDE + 2)
    usual, beyond, _ = _around(np.diff(values_at(values, places[:, np.newaxis] + reach)).T)
    return usual[0], beyond[0]


def _ratio(values: FloatArray, places: IntegerArray) -> FloatArray:
    usual, beyond = _steps_around(values, places)
    return np.divide(beyond, usual, out=np.zeros_like(beyond), where=usual != 0.0)


def _scatter(values: FloatArray) -> float:
    """Scatter of steps about those around them, without what is far off."""
    last = values.size - 2 - _SIDE
    places = np.linspace(_SIDE, last, min(_LOOKED_AT, last)).astype(np.int64)
    _, beyond = _steps_around(values, places)
    return scatter_of(beyond)
