"""Dither that is left in the angle of a gyro, and what its pick-off shows.

A dither is a resonator kept swinging by an even drive and shaken by a random one, so that the
random part of its complex amplitude decays with the resonator's ring-down::

    p(t) = Re[(1 + u(t)) A exp(i (2 pi f t + phi))],   A = peak rate / (2 pi f)

with u a complex Ornstein-Uhlenbeck process. The gyro turns with its body, and its readout takes off
what the pick-off says, at a slightly wrong gain and a little late. Sampling folds what is left,
since f lies above half the sample rate as a rule.
"""

import cmath
import math
from dataclasses import dataclass
from typing import Self

import numpy as np
from scipy.signal import lfilter

from sagnac.arrays import FloatArray
from sagnac.rig import _kernels
from sagnac.rig.config import RigConfig
from sagnac.units import ARCSECOND, DEGREE


def dither_frequency(config: RigConfig, gyro: int) -> float:
    """Frequency of the dither of one gyro, Hz."""
    return config.gyro.dither_frequency_hz + config.dither.detuning_hz[gyro]


def folded(frequency: float, sample_rate: float) -> float:
    """Where sampling shows a frequency, Hz.

    Examples
    --------
    >>> folded(400.0, 500.0)
    100.0
    """
    return abs(frequency - sample_rate * round(frequency / sample_rate))


def left_of(config: RigConfig, gyro: int) -> complex:
    """Part of the dither that is left in the angle: 1 less the gain, delayed, of the stripping."""
    late = 2.0 * math.pi * dither_frequency(config, gyro) * config.dither.delay_s[gyro]
    return 1.0 - (1.0 - config.dither.residue[gyro]) * cmath.exp(-1j * late)


@dataclass(slots=True, kw_only=True)
class DitherMotion:
    """The dither of one gyro.

    Attributes
    ----------
    amplitude
        Of the even part, rad.
    left
        Part of it in the gyro's angle, with its phase.
    cycles, phase
        Cycles in a sample interval, and phase at the first sample, rad.
    decay, spread
        Correlation of the random part from one sample to the next, and rms of what each of its two
        components gains, as a part of the amplitude.
    noise
        Of the pick-off, rms, rad.
    random
        Stream of the dither.
    shaken
        (2,) random part at the last sample, in phase and in quadrature, as a part of the amplitude.
    """

    amplitude: float
    left: complex
    cycles: float
    phase: float
    decay: float
    spread: float
    noise: float
    random: np.random.Generator
    shaken: FloatArray

    @classmethod
    def drawn(cls, config: RigConfig, gyro: int, random: np.random.Generator) -> Self:
        """The dither of one gyro in its stationary state."""
        frequency = dither_frequency(config, gyro)
        decay = math.exp(-1.0 / (config.sample_rate_hz * config.dither.ring_down_s))
        relative = config.gyro.dither_amplitude_noise
        return cls(
            amplitude=config.gyro.dither_rate_deg_per_s * DEGREE / (2.0 * math.pi * frequency),
            left=left_of(config, gyro),
            cycles=frequency / config.sample_rate_hz,
            phase=float(random.uniform(-np.pi, np.pi)),
            decay=decay,
            spread=relative * math.sqrt(1.0 - decay**2),
            noise=config.dither.pickoff_noise_arcsec * ARCSECOND,
            random=random,
            shaken=relative * random.standard_normal(2),
        )

    def advance(self, first: int, angle: FloatArray) -> FloatArray:
        """Add what is left at the next samples to the gyro's angle.

        Parameters
        ----------
        first
            Number of the first sample.
        angle
            (n,) rad.

        Returns
        -------
        FloatArray
            (n,) what the pick-off shows, arcsec.
        """
        drawn = self.random.standard_normal((angle.size, 3))
        shaken, _ = lfilter(
            [self.spread],
            [1.0, -self.decay],
            drawn[:, :2],
            axis=0,
            zi=self.decay * self.shaken[np.newaxis],
        )
        self.shaken = shaken[-1]
        left = self.amplitude * self.left
        swing = np.zeros(angle.size)
        _kernels.dither_swing(
            first, self.cycles, self.phase, shaken, (left.real, left.imag), angle, swing
        )
        return np.asarray((self.amplitude * swing + self.noise * drawn[:, 2]) / ARCSECOND)
