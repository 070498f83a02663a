"""The gyros of the rig: what they sense and what they add."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sagnac.arrays import FloatArray
from sagnac.rig import _kernels
from sagnac.rig.ring_laser import Dither, RingLaser
from sagnac.rig.sections import GYRO_NAMES
from sagnac.units import (
    ARCSECOND,
    DEGREE,
    DEGREE_PER_HOUR,
    DEGREE_PER_HOUR_PER_ROOT_HOUR,
    DEGREE_PER_ROOT_HOUR,
)

if TYPE_CHECKING:
    from sagnac.rig.config import RigConfig

_MARKOV_RATIO = 3.0  # between neighbouring correlation times
_LONGEST_CORRELATION = 10.0  # of the duration


def ring_lasers_of(config: RigConfig) -> tuple[tuple[RingLaser, ...], Dither | None]:
    """The three lasers (none in mode ``ideal``) and their dither."""
    gyro = config.gyro
    if gyro.mode == "ideal":
        return (), None
    lasers = tuple(
        RingLaser(
            lock_in=gyro.lock_in_deg_per_h[g] * DEGREE_PER_HOUR,
            fringe=gyro.fringe_arcsec * ARCSECOND,
            quantum_noise=gyro.arw_deg_per_sqrt_h[g] * DEGREE_PER_ROOT_HOUR,
            backscatter_diffusion=gyro.backscatter_diffusion_rad2_per_s,
        )
        for g in range(len(GYRO_NAMES))
    )
    if gyro.mode != "dithered":
        return lasers, None
    return lasers, Dither(
        frequency=gyro.dither_frequency_hz,
        rate=gyro.dither_rate_deg_per_s * DEGREE,
        amplitude_noise=gyro.dither_amplitude_noise,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Drift:
    """Slow rate of one gyro on a coarse grid: its processes and their state."""

    decay: FloatArray
    spread: FloatArray
    walk: float
    state: FloatArray
    random: np.random.Generator

    def advance(self, points: int) -> FloatArray:
        out = np.zeros(points)
        normals = self.random.standard_normal((points, self.decay.size + 1))
        _kernels.rig_markov(normals, self.decay, self.spread, self.walk, self.state, out)
        return out


def gyro_drift(config: RigConfig, gyro: int, step: float, random: np.random.Generator) -> _Drift:
    """Flicker rate noise as a sum of Markov processes, rate random walk beside it.

    Processes of variance s^2 at correlation times a ratio r apart have the two-sided
    density s^2 / (2 f ln r); bias instability has B^2 / (2 pi f).
    """
    instability = config.gyro.bias_instability_deg_per_h[gyro] * DEGREE_PER_HOUR
    walk = config.gyro.rate_random_walk_deg_per_h_per_sqrt_h[gyro] * DEGREE_PER_HOUR_PER_ROOT_HOUR
    count = 0
    if instability > 0.0:
        longest = max(_LONGEST_CORRELATION * config.duration_s, 10.0 * step)
        count = 1 + math.ceil(math.log(longest / step) / math.log(_MARKOV_RATIO))
    correlation = step * _MARKOV_RATIO ** np.arange(count)
    deviation = instability * math.sqrt(math.log(_MARKOV_RATIO) / math.pi)
    decay = np.exp(-step / correlation)
    state = np.zeros(count + 1)
    state[:count] = deviation * random.standard_normal(count)
    return _Drift(
        decay=decay,
        spread=deviation * np.sqrt(1.0 - decay**2),
        walk=walk * math.sqrt(step),
        state=state,
        random=random,
    )
