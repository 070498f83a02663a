"""Tones that follow the table, moved to the angle scale."""

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Final

import numpy as np

from sagnac.core.arrays import ComplexArray, FloatArray
from sagnac.lines.components import Components, joined, mixed_down
from sagnac.lines.sampling import MIX_BLOCK, Sampling, Wander

# Phase error over its deviation, below which a tone and an order look the same.
_TOLD_APART: Final = 6.0
# Noise levels of a mean by which an order has to say more of the power than a tone. A line that
# wanders makes a band, in which chance favours an order as often as not: so the noise is read these
# bins to either side, beyond the main lobe of a Hann window.
_BETTER: Final = 10.0
_BESIDE: Final = np.arange(3, 11)
# How near tones are mixed down at one frequency, as a share of the blocks' rate: their means are
# then short of 2e-4.
_AT_ONCE: Final = 0.01
# Carriers that one pass mixes down; the means of a day take 14 MiB for each.
_CARRIERS: Final = 8
# How near tones are put back with one, as a share of its frequency, and of the blocks' rate.
_NEIGHBOURS: Final = 0.1
_NEAREST: Final = 0.25


def rescaled_components(
    components: Components, steps: FloatArray, sampled: Sampling, levels: FloatArray
) -> Components | None:
    """The components with those moved to the angle scale that follow the table; None if none does.

    A tone is mixed down to zero frequency and its phase compared with the table's
    wander about its mean rate, scaled by the order it would have. At a steady rate the two are
    one, and the component stays in time.

    Parameters
    ----------
    components
        Lines that are out of the increments.
    steps
        (samples - 1,) increments of the angle, rad, without the components.
    sampled
        How the table turns, and strays from a steady rate.
    levels
        (components,) noise floor at each, rad^2.
    """
    angles, frequencies, strays = components.orders.size, components.frequencies, sampled.wander
    if strays is None or frequencies.size == 0:
        return None
    orders = 2.0 * np.pi * frequencies / abs(strays.rate)
    # Complex amplitudes of the increments: step n leads from sample n to n + 1.
    phasors = components.phasor[angles:].conj() * (np.exp(2j * np.pi * frequencies) - 1.0)
    # Only if its phase is known so well that an order would look different is a tone looked at.
    strength = np.abs(phasors) * np.sqrt(steps.size / (2.0 * levels[angles:]))
    shown = orders * float(np.std(strays.phase)) * strength >= _TOLD_APART
    moved = np.zeros(components.size, dtype=bool)
    for carrier, means in _mixed_down(steps, frequencies[shown], components.center):
        around, middles = means, strays.middles[: means.size]
        # The tones about it are put back: they may be sidebands that the table's wander makes of
        # one order.
        reach = min(_NEIGHBOURS * carrier, _NEAREST / MIX_BLOCK)
        for other in np.flatnonzero(np.abs(frequencies - carrier) < reach):
            turning = np.exp(2j * np.pi * (frequencies[other] - carrier) * middles)
            around += 0.5 * phasors[other] * turning
        apart = frequencies - carrier
        for index in np.flatnonzero(shown & (apart >= 0.0) & (apart <= _AT_ONCE / MIX_BLOCK)):
            mixed = around * np.exp(-2j * np.pi * apart[index] * middles)
            level = float(levels[angles + index]) / steps.size
            moved[angles + index] = _follows(mixed, strays, float(orders[index]), level)
    if not moved.any():
        return None
    orders = orders[moved[angles:]]
    # Whole where it is not told from whole.
    whole = np.abs(orders - np.rint(orders)) * sampled.turns < 0.5
    in_angle = replace(
        components.select(moved),
        orders=np.where(whole, np.rint(orders), orders),
        free=~whole,
        frequencies=np.empty(0),
    )
    return joined(components.select(~moved), in_angle)


def _follows(mixed: ComplexArray, strays: Wander, order: float, level: float) -> bool:
    """Whether what was mixed down from a tone is more of an order than of that tone.

    `level` is the noise in the power of a mean of all increments.
    """
    turned = mixed * np.exp(-1j * np.sign(strays.rate) * order * strays.phase[: mixed.size])
    gain = np.abs(turned.mean()) ** 2 - np.abs(mixed.mean()) ** 2
    if gain <= _BETTER * level:
        return False
    # Power of a mean that what stands beside zero frequency would make. The median of noise is ln 2
    # of its mean; the squares of a Hann window add up to 3/8.
    power = np.abs(np.fft.fft(turned * np.hanning(turned.size))) ** 2
    beside = float(np.median(np.concatenate([power[_BESIDE], power[-_BESIDE]])))
    return bool(gain > _BETTER * beside / (math.log(2.0) * 0.375 * turned.size**2))


def _mixed_down(
    steps: FloatArray, frequencies: FloatArray, center: float
) -> Iterator[tuple[float, ComplexArray]]:
    """Carriers, cycles a sample, and means of the steps mixed down from each to zero frequency.

    A carrier serves all the frequencies that are near above it; some share a pass over the steps.
    """
    carriers: list[float] = []
    for frequency in np.sort(frequencies).tolist():
        if not carriers or frequency - carriers[-1] > _AT_ONCE / MIX_BLOCK:
            carriers.append(frequency)
    for first in range(0, len(carriers), _CARRIERS):
        some = np.array(carriers[first : first + _CARRIERS])
        means = mixed_down(steps, some, center)
        yield from zip(some.tolist(), means.T.copy(), strict=True)
