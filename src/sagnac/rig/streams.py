"""Random streams of the rig: one for each thing that draws."""

from dataclasses import dataclass

import numpy as np

_STREAMS = 35


@dataclass(frozen=True, slots=True, kw_only=True)
class RandomStreams:
    """Independent random streams of one seed, one for each thing that draws.

    `white` and `slow` hold one for each gyro. The others belong to the table's jitter and
    wander, the null passages, the encoder's latch, the phases of table and encoder, and the
    disturbances. `dither` and `mount` hold one for each gyro, too. Then come the table's hunting
    and nutation, and of the encoder the walk of its delay, the readings lost and the null pulses
    that are missing. `readout` holds one for each gyro, for the noise of its sampled angle, and the
    three of `force_…` one for each accelerometer. New ones are appended, so that a seed keeps its
    numbers.
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
    mount: tuple[np.random.Generator, ...]
    hunting: np.random.Generator
    nutation: np.random.Generator
    delay: np.random.Generator
    lost: np.random.Generator
    missing: np.random.Generator
    readout: tuple[np.random.Generator, ...]
    force_white: tuple[np.random.Generator, ...]
    force_slow: tuple[np.random.Generator, ...]
    force_readout: tuple[np.random.Generator, ...]


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
        mount=tuple(generators[15:18]),
        hunting=generators[18],
        nutation=generators[19],
        delay=generators[20],
        lost=generators[21],
        missing=generators[22],
        readout=tuple(generators[23:26]),
        force_white=tuple(generators[26:29]),
        force_slow=tuple(generators[29:32]),
        force_readout=tuple(generators[32:35]),
    )
