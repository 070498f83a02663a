"""Increments mixed down from a frequency to zero, in means over blocks."""

from typing import Final

import numpy as np

from sagnac.arrays import ComplexArray, FloatArray

MIX_BLOCK: Final = 50
"""Samples in each mean of `mixed_down`."""


def mixed_down(values: FloatArray, frequency: float, center: float) -> ComplexArray:
    """Means over blocks of ``values * exp(-2j pi frequency (n - center))``.

    Parameters
    ----------
    values
        (samples,) in any unit.
    frequency
        Cycles per sample.
    center
        Sample number at which the phase is zero.

    Returns
    -------
    (samples // `MIX_BLOCK`,) in the unit of the values.
    """
    blocks = values.size // MIX_BLOCK
    fine = 2.0 * np.pi * frequency * np.arange(MIX_BLOCK)
    waves = np.stack([np.cos(fine), -np.sin(fine)], axis=1) / MIX_BLOCK
    means = values[: blocks * MIX_BLOCK].reshape(blocks, MIX_BLOCK) @ waves
    turns = frequency * (np.arange(blocks) * MIX_BLOCK - center)
    return np.asarray(means.view(np.complex128)[:, 0] * np.exp(-2j * np.pi * (turns % 1.0)))
