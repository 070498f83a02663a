"""Leaps of an encoder: rows of the file that were lost, and slips that the gyros do not make."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from sagnac import series
from sagnac.arrays import BooleanArray, FloatArray, IntegerArray
from sagnac.errors import Note, counted
from sagnac.recording.channel import Channel
from sagnac.recording.encoder_mismatch import LEAST_SHARE, table_share
from sagnac.recording.jumps import jump_notes
from sagnac.recording.kinds import angle_of
from sagnac.recording.model import Recording, second_of
from sagnac.recording.soundness import remedy_of
from sagnac.recording.spikes import LEAST_FOR_SPIKES, find_spikes
from sagnac.recording.stretches import longest_between
from sagnac.units import ARCSECOND, DEGREE

# Steps before and behind a leap that tell the usual one, and how unlike they may be, of it.
_SIDE: Final = 2
_UNLIKE: Final = 0.3
# A leap is longer than the usual step by whole steps to this, and to this part of their number; and
# a usual step is this many scatters of steps.
_WHOLE: Final = 0.15
_OF_NUMBER: Final = 0.01
_SCATTERS: Final = 8.0
_DEVIATION: Final = 1.4826
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

        def closed(block: slice) -> FloatArray:
            passed = np.searchsorted(self.places, np.arange(block.start, block.stop))
            return np.asarray(channel.values[block] - turned[passed])

        values = series.made(closed, channel.values.size, channel.values)
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

    def beside(block: slice) -> FloatArray:
        part = slice(block.start, block.stop + 1)
        return np.asarray(np.diff(table.values[part]) - np.diff(angle[part]) / share)

    steps = series.made(beside, angle.size - 1, angle, table.values)
    found = find_spikes(steps, sample_rate=1.0)
    far = (np.abs(found.height) > _SLIPS) & _inside(found.index, table.values.size)
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

    def of_block(block: slice) -> IntegerArray:
        usual, beyond, unlike = _around(np.diff(values[block.start : block.stop + 2 * _SIDE + 1]))
        steady = (np.abs(usual) > least) & (np.abs(unlike) < _UNLIKE * np.abs(usual))
        ratio = np.divide(beyond, usual, out=np.zeros_like(beyond), where=steady)
        return np.asarray(block.start + _SIDE + np.flatnonzero(_is_whole(ratio)))

    return np.concatenate(series.map(of_block, values.size - 2 * _SIDE - 1, values))


def _is_whole(ratio: FloatArray) -> BooleanArray:
    number = np.rint(ratio)
    return np.asarray((number >= 1.0) & (np.abs(ratio - number) < _tolerance(number)))


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
    some = np.stack([series.at(values, places + one) for one in reach])
    usual, beyond, _ = _around(np.diff(some, axis=0))
    return usual[0], beyond[0]


def _ratio(values: FloatArray, places: IntegerArray) -> FloatArray:
    usual, beyond = _steps_around(values, places)
    return np.divide(beyond, usual, out=np.zeros_like(beyond), where=usual != 0.0)


def _scatter(values: FloatArray) -> float:
    """Scatter of steps about those around them, without what is far off."""
    last = values.size - 2 - _SIDE
    places = np.linspace(_SIDE, last, min(_LOOKED_AT, last)).astype(np.int64)
    _, beyond = _steps_around(values, places)
    return _DEVIATION * float(np.median(np.abs(beyond)))


def _inside(places: IntegerArray, size: int) -> BooleanArray:
    return np.asarray((places >= _SIDE) & (places < size - 1 - _SIDE))
