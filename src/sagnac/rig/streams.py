"""Random streams of the rig, one for each thing that draws, and the disturbances drawn."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sagnac.arrays import FloatArray
from sagnac.rig.config import RigConfig
from sagnac.rig.sections import GYRO_NAMES, Pairs
from sagnac.units import ARCSECOND


@dataclass(frozen=True, slots=True, kw_only=True)
class DrawnLines:
    """One scale's periodic disturbances: (lines,) positions, (3, lines) phasors in rad."""

    position: FloatArray
    phasor: NDArray[np.complex128]


@dataclass(frozen=True, slots=True, kw_only=True)
class RandomStreams:
    """Independent random streams, one for each thing that draws."""

    jitter: np.random.Generator
    wander: np.random.Generator
    null: np.random.Generator
    phases: np.random.Generator
    disturbances: np.random.Generator
    white: tuple[np.random.Generator, ...]
    slow: tuple[np.random.Generator, ...]


def random_streams(seed: int) -> RandomStreams:
    """The streams of one seed."""
    generators = [np.random.default_rng(s) for s in np.random.SeedSequence(seed).spawn(11)]
    return RandomStreams(
        jitter=generators[0],
        wander=generators[1],
        null=generators[2],
        phases=generators[3],
        disturbances=generators[4],
        white=tuple(generators[5:8]),
        slow=tuple(generators[8:11]),
    )


def _draw_lines(pairs: Pairs, random: np.random.Generator) -> DrawnLines:
    position = np.array([position for position, _ in pairs])
    amplitude = np.array([amplitude for _, amplitude in pairs]) * ARCSECOND
    shape = (len(GYRO_NAMES), len(pairs))
    amplitudes = amplitude * random.uniform(0.5, 1.0, shape)
    phases = random.uniform(-np.pi, np.pi, shape)
    order = np.argsort(position, kind="stable")
    return DrawnLines(position=position[order], phasor=(amplitudes * np.exp(1j * phases))[:, order])


def disturbance_of(config: RigConfig, random: np.random.Generator) -> tuple[DrawnLines, DrawnLines]:
    """Disturbances in table angle and in time, drawn once a recording."""
    angle = _draw_lines(config.disturbances.angle, random)
    return angle, _draw_lines(config.disturbances.time, random)
