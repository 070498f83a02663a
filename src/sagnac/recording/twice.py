"""Blocks of samples that stand in a record twice."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from sagnac import series
from sagnac.arrays import FloatArray, IntegerArray
from sagnac.errors import Note
from sagnac.recording import _kernels
from sagnac.recording.channel import Channel
from sagnac.recording.effects import finding
from sagnac.recording.model import Recording, second_of

# Samples of a window by which a block is known again, odd numbers that mix their bits, and part of
# all windows that is kept: that whose mixed bits begin with this many zeros, in either block.
_WINDOW: Final = 8
_MIXED_BY: Final = 0x9E3779B97F4A7C15
_ZEROS: Final = 4
# A block is this long at least, and takes this many values: what few steps of a readout make comes
# about by chance.
_LEAST: Final = 64
_VALUES: Final = 16
# Distances between two windows alike that are looked at, the most frequent.
_DISTANCES: Final = 4


@dataclass(frozen=True, slots=True, kw_only=True)
class Twice:
    """A block and its repetition.

    Attributes
    ----------
    first, again
        First sample of either.
    samples
        In the block.
    """

    first: int
    again: int
    samples: int


def twice_notes(recording: Recording, gyro: Channel) -> tuple[Note, ...]:
    """The longest block that stands in the record twice: a warning."""
    found = longest_twice(gyro.values)
    if found is None:
        return ()
    text = (
        f"{found.samples} samples from {second_of(recording, found.first):.3f} s on are there "
        f"again from {second_of(recording, found.again):.3f} s on: an interval counts them twice; "
        "take a stretch without with {slice}"
    )
    return (finding("repeats", gyro.name, text, effect=1.0),)


def longest_twice(values: FloatArray) -> Twice | None:
    """The longest block that stands in a series twice, value by value; None if there is none.

    Parameters
    ----------
    values
        (samples,)
    """
    if values.size < 2 * _LEAST:
        return None
    parts = series.map(
        lambda block: _windows(values[block.start : block.stop + _WINDOW - 1], block.start),
        values.size - _WINDOW + 1,
        values,
    )
    places = np.concatenate([part[0] for part in parts])
    mixed = np.concatenate([part[1] for part in parts])
    order = np.argsort(mixed, kind="stable")
    alike = np.flatnonzero(mixed[order[1:]] == mixed[order[:-1]])
    if alike.size == 0:
        return None
    apart = places[order[alike + 1]] - places[order[alike]]
    distances, counts = np.unique(apart[apart >= _LEAST], return_counts=True)
    found = [
        block
        for distance in distances[np.argsort(-counts, kind="stable")[:_DISTANCES]].tolist()
        if (block := _at_distance(values, distance)) is not None
    ]
    return max(found, key=lambda block: block.samples, default=None)


def _windows(values: FloatArray, start: int) -> tuple[IntegerArray, IntegerArray]:
    """Places and mixed bits of the windows that are kept."""
    bits = np.ascontiguousarray(values).view(np.uint64)
    mixed = np.empty(bits.size - _WINDOW + 1, dtype=np.uint64)
    # Uncompiled, numpy would warn of the products that wrap around.
    with np.errstate(over="ignore"):
        _kernels.mixed_windows(bits, np.uint64(_MIXED_BY), _WINDOW, mixed)
    kept = np.flatnonzero(mixed >> np.uint64(64 - _ZEROS) == 0)
    return start + kept, mixed[kept].view(np.int64)


def _at_distance(values: FloatArray, distance: int) -> Twice | None:
    """The longest run of samples that equal those a fixed number of samples later."""

    def add(so_far: tuple[int, int, int], block: slice) -> tuple[int, int, int]:
        """First sample and length of the longest run, and the last sample that differed."""
        first, length, edge = so_far
        later = values[block.start + distance : block.stop + distance]
        differs = block.start + np.flatnonzero(values[block] != later)
        edges = np.concatenate(([edge], differs, [block.stop] if block.stop == last else []))
        runs = np.diff(edges) - 1
        if runs.size and runs.max() > length:
            at = int(np.argmax(runs))
            first, length = int(edges[at]) + 1, int(runs[at])
        return first, length, int(differs[-1]) if differs.size else edge

    last = values.size - distance
    first, length, _ = series.reduce(add, (0, 0, -1), last, values)
    # A block that reaches into its repetition is a channel that goes round.
    length = min(length, distance)
    if length < _LEAST or np.unique(values[first : first + length]).size < _VALUES:
        return None
    return Twice(first=first, again=first + distance, samples=length)
