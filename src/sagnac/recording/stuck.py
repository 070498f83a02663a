"""Channels that stick at one value."""

from itertools import chain
from typing import Final

import numpy as np

from sagnac import series
from sagnac.recording.findings import Finding, longest_stretch, places_where
from sagnac.recording.model import Channel, Recording, second_of

# A run of one value is a stuck channel when it is this long, and this many times longer than
# the tenth longest. A quantized quiet gyro repeats itself for long, but then it does so all
# over the record (ten runs of noise differ by less than a factor of two or three in length),
# while a channel that sticks does so once or a few times. Of a channel that repeats itself nine
# times out of ten anyway nothing can be said: an angle read out coarsely is a random walk over
# its steps, and the stays of a walk have no typical length.
STUCK_SAMPLES: Final = 100
STUCK_RATIO: Final = 10.0
STUCK_RANK: Final = 10
STUCK_REPEATS: Final = 0.9


def stuck_findings(recording: Recording, gyro: Channel) -> list[Finding]:
    """The longest run of one value, where no noise explains it."""
    # A run that long shows in samples half as far apart; most gyros never repeat and are done.
    samples = gyro.values.size
    sparse = series.every(gyro.values, STUCK_SAMPLES // 2)
    if not (sparse[1:] == sparse[:-1]).any() and sparse.size > 1:
        return []
    changes = places_where(gyro.values, lambda some: some[1:] != some[:-1], following=1)
    first, length, number, edge = 0, 0, 0, -1
    longest = np.empty(0, dtype=np.int64)
    for places in chain(changes, (np.array([samples - 1]),)):
        edges = np.concatenate(([edge], places))
        edge = int(edges[-1])
        runs = np.diff(edges)
        number += runs.size
        if runs.size and runs.max() > length:
            at = int(np.argmax(runs))
            first, length = int(edges[at]) + 1, int(runs[at])
        longest = np.concatenate((longest, runs))
        if longest.size > STUCK_RANK:
            longest = np.partition(longest, longest.size - STUCK_RANK)[-STUCK_RANK:]
    usual = float(longest.min()) if number >= STUCK_RANK else 0.0
    whole = length == samples
    # Share of repeats among the samples outside the longest run.
    repeats = 1.0 if whole else 1.0 - (number - 1) / (samples - length)
    if not whole and (
        length < STUCK_SAMPLES or length <= STUCK_RATIO * usual or repeats > STUCK_REPEATS
    ):
        return []
    if whole:
        return [
            Finding(
                level="error",
                channel=gyro.name,
                message="is stuck: every sample is the same; name another channel with --gyros "
                "or --columns",
            )
        ]
    stuck = (first + np.arange(span.start, span.stop) for span in series.spans(length))
    return [
        Finding(
            level="error",
            channel=gyro.name,
            message=f"is stuck at one value for {length} samples from "
            f"{second_of(recording, first):.3f} s; "
            f"{longest_stretch(recording, stuck)}",
        )
    ]
