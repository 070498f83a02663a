"""Noise whose samples are not distributed as noise is: bent by a soft limit, or full of spikes."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.fft import irfft, rfft

from sagnac.arrays import FloatArray
from sagnac.errors import Note
from sagnac.recording.channel import Channel
from sagnac.recording.effects import finding
from sagnac.recording.profile import Profile

# Samples looked at, the most and the least.
_LOOKED_AT: Final = 2**15
_LEAST: Final = 2**12
# Frequencies whose median is the level of the noise there, and times that level that a line keeps.
_TOGETHER: Final = 64
_KEPT: Final = 12.0
# Samples at either end that are left out.
_EDGE: Final = 512
# Steps of the readout shape the distribution if the scatter is below this many steps.
_FINE: Final = 5.0
# Standard errors, and least size, of an excess kurtosis below zero, and of a skewness or a
# kurtosis above it, that are said. Noise of N that a soft limit lowers by 5 % has one of -0.4.
_SIGMAS: Final = 6.0
_FLAT: Final = 0.2
_SKEW: Final = 0.3
_HEAVY: Final = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Shape:
    """Distribution of white numbers; a normal one has zeros and a ratio of 1.

    Attributes
    ----------
    skewness, kurtosis
        Third cumulant and fourth (excess kurtosis), of unit variance.
    ratio
        Standard deviation over that which the quartiles tell.
    samples
        How many numbers.
    """

    skewness: float
    kurtosis: float
    ratio: float
    samples: int

    @property
    def is_flat(self) -> bool:
        """Whether large numbers are missing."""
        return self.kurtosis < -max(_FLAT, _SIGMAS * math.sqrt(24.0 / self.samples))

    @property
    def is_heavy(self) -> bool:
        """Whether there are too many of them, or more on one side."""
        return abs(self.skewness) > _SKEW or self.kurtosis > _HEAVY


def shape_of(changes: FloatArray) -> Shape:
    """Distribution of what samples turned, made white first, with lines cut down to the noise.

    A sine is flat as a soft limit makes noise, and slow noise has few independent samples. So each
    frequency is divided by the level around it.

    Parameters
    ----------
    changes
        (samples,)
    """
    white = _whitened(changes)
    white = (white - white.mean()) / white.std()
    low, high = np.quantile(white, [0.25, 0.75])
    squares = white * white
    return Shape(
        skewness=float(squares @ white) / white.size,
        kurtosis=float(squares @ squares) / white.size - 3.0,
        ratio=1.349 / float(high - low) if high > low else math.inf,
        samples=white.size,
    )


def _whitened(changes: FloatArray) -> FloatArray:
    transform = rfft(changes)
    power = transform.real**2 + transform.imag**2
    blocks = power.size // _TOGETHER
    level = np.median(power[: blocks * _TOGETHER].reshape(blocks, _TOGETHER), axis=1)
    level = np.repeat(level, _TOGETHER) / math.log(2.0)
    level = np.append(level, np.full(power.size - level.size, level[-1]))
    scale = np.sqrt(np.maximum(level, power / _KEPT))
    transform = np.divide(transform, scale, out=np.zeros_like(transform), where=scale > 0.0)
    # The slowest are drift.
    transform[:_TOGETHER] = 0.0
    # The end does not go on at the beginning, and what that makes of both is no noise.
    return np.asarray(irfft(transform, changes.size)[_EDGE:-_EDGE])


def distribution_notes(gyro: Channel, profile: Profile) -> tuple[Note, ...]:
    """A soft limit, with what it does to N, or noise that is full of spikes: a warning."""
    changes = profile.changes[:_LOOKED_AT]
    if changes.size < _LEAST or _FINE * profile.step > profile.scale:
        return ()
    shape = shape_of(changes)
    if shape.is_flat:
        text = (
            f"large deviations are missing (excess kurtosis {shape.kurtosis:.2g}), as if it came "
            "near the end of its range: a soft saturation; take a wider range"
        )
        # Of x - a x^3 the excess kurtosis is -24 a, and the standard deviation 1 - 3 a.
        return (finding("clipping", gyro.name, text, effect=1.0 + shape.kurtosis / 8.0),)
    if shape.is_heavy:
        text = (
            f"its noise is no even noise (skewness {shape.skewness:.2g}, excess kurtosis "
            f"{shape.kurtosis:.2g}): spikes or bursts are a part of it, and of its angle random "
            "walk"
        )
        return (finding("spikes", gyro.name, text, effect=shape.ratio, level="warning"),)
    return ()
