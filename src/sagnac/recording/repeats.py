"""Samples that only repeat the one before."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from sagnac import series
from sagnac.arrays import FloatArray
from sagnac.errors import Note, counted
from sagnac.recording.channel import Channel
from sagnac.recording.effects import finding
from sagnac.recording.lattice import count_step
from sagnac.recording.model import Recording, second_of
from sagnac.recording.profile import Profile

# Repeats are this many, and this many times as many as the smallest changes there are. Noise
# repeats itself half as often as it makes one of the two smallest changes, if it is read out in
# steps of a third of its scatter or finer.
_LEAST_OFTEN: Final = 10
_OFTENER: Final = 3
_FINE: Final = 3.0
# Samples whose values are counted.
_LOOKED_AT: Final = 20_000
# Changes below this part of the scatter are rounding.
_ROUNDING: Final = 1e-9
# Runs of this many samples are a channel that sticks; shorter ones are samples that are held.
_STICKS: Final = 8
# Share of held samples from which on they are how the recorder works: it is faster than the gyro.
_ALL_HELD: Final = 0.45


@dataclass(frozen=True, slots=True, kw_only=True)
class Repeats:
    """Samples that equal the one before.

    Attributes
    ----------
    count, first
        How many, and the first.
    in_runs
        Samples in runs of eight or more.
    """

    count: int
    first: int
    in_runs: int


def repeat_notes(recording: Recording, gyro: Channel, profile: Profile) -> tuple[Note, ...]:
    """Repeats that no readout step explains."""
    if not _is_unexplained(gyro, profile):
        return ()
    found = repeats_of(gyro)
    samples = gyro.values.size
    share = found.count / samples
    held = (found.count - found.in_runs) / samples
    text = (
        f"{counted(found.count, 'sample')} repeat the one before, the first at "
        f"{second_of(recording, found.first):.3f} s"
    )
    if found.in_runs > held * samples:
        text = f"sticks again and again: {text}; take a stretch without with {{slice}}"
        # That of the noise as far as the runs are long; what they make of slower noise is open.
        effect = math.sqrt(1.0 - found.in_runs / samples)
        return (finding("repeats", gyro.name, text, effect=effect, level="error"),)
    if share > _ALL_HELD:
        text = f"{text}: it is sampled faster than it measures"
        return (Note(name="repeats", channel=gyro.name, text=text, level="warning"),)
    # Runs of held samples have lengths L, and slow noise grows by <L^2>/<L>: (1 + p)/(1 - p).
    effect = math.sqrt((1.0 + held) / (1.0 - held))
    return (finding("repeats", gyro.name, text, effect=effect),)


def _is_unexplained(gyro: Channel, profile: Profile) -> bool:
    """Whether values repeat more often than their steps make them."""
    values = gyro.values

    def none(block: slice) -> int:
        return int((np.diff(values[block.start : block.stop + 1]) == 0.0).sum())

    rounding = _ROUNDING * profile.scale
    zeros = sum(series.map(none, values.size - 1, values))
    step = count_step(values, rounding) if gyro.kind == "angle" else profile.step
    coarse = step * _FINE > math.sqrt(2.0) * profile.scale
    if zeros < _LEAST_OFTEN or coarse or not math.isfinite(step):
        return False

    def small(block: slice) -> int:
        steps = np.abs(np.diff(values[block.start : block.stop + 1]))
        return int(((steps > rounding) & (steps < 1.5 * step)).sum())

    by_steps = 0.5 * sum(series.map(small, values.size - 1, values))
    return zeros > _OFTENER * max(by_steps, _by_levels(values))


def _by_levels(values: FloatArray) -> float:
    """Repeats of samples that take the same few values in any order."""
    some = series.every(values, max(1, values.size // _LOOKED_AT))
    counts = np.unique(some, return_counts=True)[1].astype(np.float64)
    return values.size * float(counts @ (counts - 1.0)) / (some.size * (some.size - 1.0))


def repeats_of(gyro: Channel) -> Repeats:
    """Samples of a channel that equal the one before."""
    values = gyro.values

    def add(so_far: tuple[int, int, int, int], block: slice) -> tuple[int, int, int, int]:
        count, first, in_runs, edge = so_far
        part = values[block.start : block.stop + 1]
        same = part[1:] == part[:-1]
        places = block.start + np.flatnonzero(same) + 1
        # A run ends before each change.
        edges = np.concatenate(([edge], block.start + np.flatnonzero(~same)))
        lengths = np.diff(edges)
        in_runs += int((lengths[lengths >= _STICKS] - 1).sum())
        first = int(places[0]) if first < 0 and places.size else first
        return count + places.size, first, in_runs, int(edges[-1])

    count, first, in_runs, edge = series.reduce(add, (0, -1, 0, -1), values.size - 1, values)
    last = values.size - 1 - edge
    return Repeats(count=count, first=first, in_runs=in_runs + (last - 1) * (last >= _STICKS))
