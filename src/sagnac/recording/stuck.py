"""Channels that stick at one value."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from sagnac import series
from sagnac.arrays import FloatArray, IntegerArray
from sagnac.errors import Note
from sagnac.recording.channel import Channel
from sagnac.recording.model import Recording, second_of
from sagnac.recording.soundness import remedy_of
from sagnac.recording.stretches import Stretch

# A run of one value is a stuck channel if it is this long, and this many times longer than
# the tenth longest. A quantized quiet gyro repeats itself for long, but then it does so all
# over the record (ten runs of noise differ by less than a factor of two or three in length),
# while a channel that sticks does so once or a few times. Nothing can be said of a channel that
# repeats itself nine times out of ten anyway: an angle read out coarsely is a random walk over
# its steps, and the stays of a walk have no typical length.
STUCK_SAMPLES: Final = 100
STUCK_RATIO: Final = 10.0
STUCK_RANK: Final = 10
STUCK_REPEATS: Final = 0.9


@dataclass(frozen=True, slots=True, kw_only=True)
class Runs:
    """Runs of one value.

    Attributes
    ----------
    number
        How many there are.
    longest
        The longest, the first if two are as long.
    lengths
        Samples in the `STUCK_RANK` longest, in no order.
    edge
        Last sample of the last run.
    """

    number: int
    longest: Stretch
    lengths: IntegerArray
    edge: int

    def and_then(self, last_samples: IntegerArray) -> "Runs":
        """With the runs that follow, given the last sample of each."""
        edges = np.concatenate(([self.edge], last_samples))
        lengths = np.diff(edges)
        longest = self.longest
        if lengths.size and lengths.max() > longest.samples:
            at = int(np.argmax(lengths))
            longest = Stretch(first=int(edges[at]) + 1, after=int(edges[at + 1]) + 1)
        ranked = np.concatenate((self.lengths, lengths))
        if ranked.size > STUCK_RANK:
            ranked = np.partition(ranked, ranked.size - STUCK_RANK)[-STUCK_RANK:]
        return Runs(
            number=self.number + lengths.size,
            longest=longest,
            lengths=ranked,
            edge=int(edges[-1]),
        )


def runs_of(values: FloatArray) -> Runs:
    """The runs of one value in a series, of one sample each if it never repeats."""

    def add(so_far: Runs, block: slice) -> Runs:
        some = values[block.start : block.stop + 1]
        return so_far.and_then(block.start + np.flatnonzero(some[1:] != some[:-1]))

    nothing = np.empty(0, dtype=np.int64)
    start = Runs(number=0, longest=Stretch(first=0, after=0), lengths=nothing, edge=-1)
    runs = series.reduce(add, start, values.size - 1, values)
    return runs.and_then(np.array([values.size - 1]))


def is_stuck(runs: Runs, samples: int) -> bool:
    """Whether the longest of the runs in `samples` is longer than noise explains."""
    length = runs.longest.samples
    if length == samples:
        return True
    usual = float(runs.lengths.min()) if runs.number >= STUCK_RANK else 0.0
    # Share of repeats among the samples outside the longest run.
    repeats = 1.0 - (runs.number - 1) / (samples - length)
    return not (length < STUCK_SAMPLES or length <= STUCK_RATIO * usual or repeats > STUCK_REPEATS)


def stuck_notes(recording: Recording, gyro: Channel) -> tuple[Note, ...]:
    """The longest run of one value, if no noise explains it: an error."""
    # A run that long shows in samples half as far apart; most gyros never repeat and are done.
    samples = gyro.values.size
    sparse = series.every(gyro.values, STUCK_SAMPLES // 2)
    if not (sparse[1:] == sparse[:-1]).any() and sparse.size > 1:
        return ()
    runs = runs_of(gyro.values)
    if not is_stuck(runs, samples):
        return ()
    run = runs.longest
    if run.samples == samples:
        text = "is stuck: every sample is the same; name another channel with {gyros} or {columns}"
    else:
        before = Stretch(first=0, after=run.first)
        behind = Stretch(first=run.after, after=samples)
        sound = behind if behind.samples > before.samples else before
        text = (
            f"is stuck at one value for {run.samples} samples from "
            f"{second_of(recording, run.first):.3f} s; {remedy_of(recording, sound)}"
        )
    return (Note(name="stuck", level="error", channel=gyro.name, text=text),)
