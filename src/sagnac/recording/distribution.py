"""Noise whose samples are not distributed as noise is: bent by a soft limit, or full of spikes."""

import math
from dataclasses import dataclass
from typing import Final

from sagnac.arrays import FloatArray
from sagnac.errors import Note
from sagnac.recording.channel import Channel
from sagnac.recording.effects import finding
from sagnac.recording.profile import Profile
from sagnac.recording.white import whitened

# Samples looked at, the most and the least.
_LOOKED_AT: Final = 2**15
_LEAST: Final = 2**12
# Steps of the readout shape the distribution if what each sample adds strays over fewer of them: at
# two the excess kurtosis of counted noise is 0.001, at one 0.01, at half 0.1.
_FINE: Final = 2.0
# Standard errors, and least size, of an excess kurtosis below zero, and of a skewness or a
# kurtosis above it, that are said. Noise of N that a soft limit lowers by 5 % has one of -0.4.
_SIGMAS: Final = 6.0
_FLAT: Final = 0.2
_SKEW: Final = 0.3
_HEAVY: Final = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Shape:
    """Distribution of white numbers; a normal one has zeros.

    Attributes
    ----------
    skewness, kurtosis
        Third cumulant and fourth (excess kurtosis), of unit variance.
    innovation
        Standard deviation of what each change adds to those before, in their unit.
    samples
        How many numbers.
    """

    skewness: float
    kurtosis: float
    innovation: float
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
    found = whitened(changes)
    white = (found.values - found.values.mean()) / found.values.std()
    squares = white * white
    return Shape(
        skewness=float(squares @ white) / white.size,
        kurtosis=float(squares @ squares) / white.size - 3.0,
        innovation=found.innovation,
        samples=white.size,
    )


def distribution_notes(gyro: Channel, profile: Profile) -> tuple[Note, ...]:
    """A soft limit, with what it does to N, or noise that is full of spikes: a warning."""
    shape = _shape_in(profile)
    return _flat(gyro, shape) or _heavy(gyro, shape)


def heavy_notes(gyro: Channel, profile: Profile) -> tuple[Note, ...]:
    """Noise that is full of spikes alone."""
    return _heavy(gyro, _shape_in(profile))


def flat_notes(gyro: Channel, profile: Profile) -> tuple[Note, ...]:
    """A soft limit alone, with what it does to N."""
    return _flat(gyro, _shape_in(profile))


def _shape_in(profile: Profile) -> Shape | None:
    """The distribution of a gyro's noise; None if there are too few samples or coarse steps."""
    changes = profile.changes[:_LOOKED_AT]
    if changes.size < _LEAST:
        return None
    shape = shape_of(changes)
    return None if _FINE * profile.step > shape.innovation else shape


def _flat(gyro: Channel, shape: Shape | None) -> tuple[Note, ...]:
    if shape is None or not shape.is_flat:
        return ()
    text = (
        f"large deviations are missing (excess kurtosis {shape.kurtosis:.2g}), as if it came "
        "near the end of its range: a soft saturation; take a wider range"
    )
    return (finding("clipping", gyro.name, text, effect=_bent_scatter(shape.kurtosis)),)


def _bent_scatter(kurtosis: float) -> float:
    """Standard deviation behind a soft limit, of a normal number's of 1, by its excess kurtosis.

    That of x - a x^3 is 1 - 3 a and its excess kurtosis -24 a. The next order is that of a
    hyperbolic tangent; for an arc tangent and x / sqrt(1 + x^2) it is good to 0.01 up to a limit at
    2.5 standard deviations.
    """
    return 1.0 + kurtosis / 8.0 - 0.075 * kurtosis**2


def _heavy(gyro: Channel, shape: Shape | None) -> tuple[Note, ...]:
    if shape is None or not shape.is_heavy:
        return ()
    text = (
        f"its noise is no even noise (skewness {shape.skewness:.2g}, excess kurtosis "
        f"{shape.kurtosis:.2g}): spikes or bursts are a part of it, and of its angle random "
        "walk"
    )
    return (Note(name="spikes", channel=gyro.name, text=text, level="warning"),)
