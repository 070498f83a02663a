"""Noise between lines made white, and errors that take turns in its signs."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.fft import irfft, rfft

from sagnac.core.arrays import ComplexArray, FloatArray

# Frequencies whose median is the level of the noise there.
_TOGETHER: Final = 64
# Samples at either end that are left out.
EDGE: Final = 512


@dataclass(frozen=True, slots=True, kw_only=True)
class White:
    """White noise.

    Attributes
    ----------
    values
        (samples - 1024,) of any scale, from sample 512 on.
    innovation
        Standard deviation of what each change adds to all before it, in their unit: the root of
        the geometric mean of the spectrum between the lines (Kolmogorov). Motion that is slow,
        however large, adds next to nothing.
    """

    values: FloatArray
    innovation: float


def whitened(changes: FloatArray, *, bands: int | None = None, kept: float = 12.0) -> White:
    """Increments with each frequency divided by the level around it.

    Lines are cut down to a few times the level, which is the median over 64 frequencies, or over
    a band.

    Parameters
    ----------
    changes
        (samples,), more than 1024.
    bands
        How many equal bands have a level each, so that lines that wander stay within one.
    kept
        Times the level that a line keeps.
    """
    transform, level = _by_level(changes, bands or 0, kept)
    held = level[level > 0.0]
    innovation = math.exp(0.5 * float(np.log(held).mean())) if held.size else 0.0
    values = _inner(transform, changes.size)
    return White(values=values, innovation=innovation / math.sqrt(changes.size))


def without_lines(changes: FloatArray) -> FloatArray:
    """(samples - 1024,) increments without lines and what is slowest, their spectrum as it was.

    `changes` are (samples,), more than 1024; the first value is of sample 512.
    """
    transform, level = _by_level(changes, 0, 12.0)
    return _inner(transform * np.sqrt(level), changes.size)


def alternating(values: FloatArray) -> tuple[float, float]:
    """Variance that goes into (samples,) with one sign and out with the next, and its error.

    Errors of an angle do so in what each sample turned. Slow noise adds about as much to the
    covariance of samples one apart and two apart, white noise nothing.
    """
    size = values.size
    variance = float(values @ values) / size
    one_apart = float(values[1:] @ values[:-1]) / size
    two_apart = float(values[2:] @ values[:-2]) / size
    return two_apart - one_apart, variance * math.sqrt(2.0 / size)


def _by_level(changes: FloatArray, bands: int, kept: float) -> tuple[ComplexArray, FloatArray]:
    """The transform divided by the root of the level around each frequency, and that level."""
    transform = rfft(changes)
    power = transform.real**2 + transform.imag**2
    together = max(_TOGETHER, power.size // bands) if bands else _TOGETHER
    number = power.size // together
    level = np.median(power[: number * together].reshape(number, together), axis=1)
    level = np.repeat(level, together) / math.log(2.0)
    level = np.append(level, np.full(power.size - level.size, level[-1]))
    scale = np.sqrt(np.maximum(level, power / kept))
    transform = np.divide(transform, scale, out=np.zeros_like(transform), where=scale > 0.0)
    # The slowest are drift.
    transform[:_TOGETHER] = 0.0
    return transform, level


def _inner(transform: ComplexArray, samples: int) -> FloatArray:
    """What a transform is of, without both ends.

    The end does not go on at the beginning, and what that makes of both is no noise.
    """
    return np.asarray(irfft(transform, samples)[EDGE:-EDGE])
