"""Noise between the lines of a record, made white."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.fft import irfft, rfft

from sagnac.arrays import FloatArray

# Frequencies whose median is the level of the noise there, and times that level that a line keeps.
_TOGETHER: Final = 64
_KEPT: Final = 12.0
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


def whitened(changes: FloatArray, *, bands: int | None = None, kept: float = _KEPT) -> White:
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
    if changes.size <= 2 * EDGE:
        raise ValueError(f"changes has {changes.size} samples; give more than {2 * EDGE}")
    transform = rfft(changes)
    power = transform.real**2 + transform.imag**2
    together = max(_TOGETHER, power.size // bands) if bands else _TOGETHER
    blocks = power.size // together
    level = np.median(power[: blocks * together].reshape(blocks, together), axis=1)
    level = np.repeat(level, together) / math.log(2.0)
    level = np.append(level, np.full(power.size - level.size, level[-1]))
    held = level[level > 0.0]
    innovation = math.exp(0.5 * float(np.log(held).mean())) if held.size else 0.0
    scale = np.sqrt(np.maximum(level, power / kept))
    transform = np.divide(transform, scale, out=np.zeros_like(transform), where=scale > 0.0)
    # The slowest are drift.
    transform[:_TOGETHER] = 0.0
    # The end does not go on at the beginning, and what that makes of both is no noise.
    return White(
        values=np.asarray(irfft(transform, changes.size)[EDGE:-EDGE]),
        innovation=innovation / math.sqrt(changes.size),
    )
