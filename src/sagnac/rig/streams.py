"""Random streams of the rig: one for each thing that draws."""

from dataclasses import dataclass

import numpy as np

_STREAMS = 15


@dataclass(frozen=True, slots=True, kw_only=True)
class RandomStreams:
    """Independent random streams of one seed, one for each thing that draws.

    `white` and `slow` hold one for each gyro. The others belong to the table's jitter and
    wander, the null passages, the encoder's latch, the phases of table and encoder, and the
    disturbances. `dither` holds one for each gyro, too.
    """

    jitter: np.random.Generator
    wander: np.random.Generator
    null: np.random.Generator
    phases: np.random.Generator
    disturbances: np.random.Generator
    white: tuple[np.random.Generator, ...]
    slow: tuple[np.random.Generator, ...]
    latch: np.random.Generator
    dither: tuple[np.random.Generator, ...]


def random_streams(seed: int) -> RandomStreams:
    """The streams of one seed; what one of them gives does not depend on the others."""
    spawned = np.random.SeedSequence(seed).spawn(_STREAMS)
    generators = [np.random.default_rng(sequence) for sequence in spawned]
    return RandomStreams(
        jitter=generators[0],
        wander=generators[1],
        null=generators[2],
        phases=generators[3],
        disturbances=generators[4],
        white=tuple(generators[5:8]),
        slow=tuple(generators[8:11]),
        latch=generators[11],
        dither=tuple(generators[12:15]),
    )
