"""Tones that follow the table, moved to the angle scale."""

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from sagnac.core.arrays import BooleanArray, ComplexArray, FloatArray, blocks
from sagnac.lines.components import MIX_BLOCK, Components, Turning, joined, mixed_down
from sagnac.table.kinematics import averages_of

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
# How near tones are put back with one, as a share of its frequency, and of the blocks' rate.
_NEIGHBOURS: Final = 0.1
_NEAREST: Final = 0.25
# A record of fewer blocks than this has not as many bins.
_FEWEST_BLOCKS: Final = 24
# The net rate of the table, in its mean speed, below which it goes back and forth.
_ONE_WAY: Final = 0.5


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Wander:
    """How the table strays from a steady rate, block by block.

    Attributes
    ----------
    rate
        Mean rate of the table, rad a sample.
    middles
        (blocks,) middle of each, in samples from mid-record.
    phase
        (blocks,) mean table angle less that of a steady rate, rad.
    """

    rate: float
    middles: FloatArray
    phase: FloatArray


def wander(turns: Turning) -> Wander | None:
    """`Wander` of a table; None if it goes back and forth, or the record is too short to tell.

    Such a table has no rate that a tone could be an order of.
    """
    steps = turns.table.size - 1
    if steps < _FEWEST_BLOCKS * MIX_BLOCK:
        return None
    angle = averages_of(turns.table[:steps], MIX_BLOCK)
    middles = np.arange(float(angle.size)) * MIX_BLOCK + (0.5 * (MIX_BLOCK - 1) - 0.5 * steps)
    number = middles - float(middles.mean())
    rate = float(number @ angle) / float(number @ number)
    if abs(rate) < _ONE_WAY * abs(turns.mean_rate) / turns.sample_rate:
        return None
    return Wander(rate=rate, middles=middles, phase=angle - angle.mean() - rate * number)


def rescaled_components(
    components: Components, steps: FloatArray, turns: Turning, strays: Wander, levels: FloatArray
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
    turns, strays
        How the table turns, and how it strays from a steady rate.
    levels
        (components,) noise floor at each, rad^2.
    """
    angles = components.orders.size
    orders = 2.0 * np.pi * components.frequencies / abs(strays.rate)
    moved = np.zeros(components.size, dtype=bool)
    near, around = -np.inf, np.empty(0, dtype=np.complex128)
    for index in np.argsort(components.frequencies).tolist():
        level = float(levels[angles + index])
        if not _would_show(components, strays, index, steps.size, level):
            continue
        frequency = float(components.frequencies[index])
        if frequency - near > _AT_ONCE / MIX_BLOCK:
            near, around = frequency, _put_back(components, steps, strays, frequency)
        mixed = around * np.exp(-2j * np.pi * (frequency - near) * strays.middles[: around.size])
        moved[angles + index] = _follows(mixed, strays, float(orders[index]), level / steps.size)
    if not moved.any():
        return None
    return _in_angle(components, moved, orders[moved[angles:]], turns)


def _phasors(components: Components) -> ComplexArray:
    """(tones,) complex amplitudes of the increments: step n leads from sample n to n + 1."""
    tones = slice(components.orders.size, None)
    amplitudes = components.cosine[tones] - 1j * components.sine[tones]
    return np.asarray(amplitudes * (np.exp(2j * np.pi * components.frequencies) - 1.0))


def _would_show(
    components: Components, strays: Wander, index: int, steps: int, level: float
) -> bool:
    """Whether the phase of a tone is known so well that an order would look different."""
    order = 2.0 * np.pi * components.frequencies[index] / abs(strays.rate)
    strength = np.abs(_phasors(components)[index]) * np.sqrt(steps / (2.0 * level))
    return bool(order * float(np.std(strays.phase)) * strength >= _TOLD_APART)


def _put_back(
    components: Components, steps: FloatArray, strays: Wander, frequency: float
) -> ComplexArray:
    """Means over blocks of the steps mixed down from a frequency, the tones about it put back.

    They may be sidebands that the table's wander makes of one order.
    """
    mixed = _mixed_down(steps, frequency, components.center)
    apart = components.frequencies - frequency
    reach = min(_NEIGHBOURS * frequency, _NEAREST / MIX_BLOCK)
    phasors = _phasors(components)
    for other in np.flatnonzero(np.abs(apart) < reach):
        turning = np.exp(2j * np.pi * apart[other] * strays.middles[: mixed.size])
        mixed += 0.5 * phasors[other] * turning
    return mixed


def _follows(mixed: ComplexArray, strays: Wander, order: float, level: float) -> bool:
    """Whether what was mixed down from a tone is more of an order than of that tone.

    `level` is the noise in the power of a mean of all increments.
    """
    turned = mixed * np.exp(-1j * np.sign(strays.rate) * order * strays.phase[: mixed.size])
    gain = np.abs(turned.mean()) ** 2 - np.abs(mixed.mean()) ** 2
    # What stands beside is asked last: it takes a transform.
    return bool(gain > _BETTER * level and gain > _BETTER * _power_beside(turned))


def _power_beside(mixed: ComplexArray) -> float:
    """Power of a mean over all blocks that what stands beside zero frequency would make."""
    power = np.abs(np.fft.fft(mixed * np.hanning(mixed.size))) ** 2
    beside = np.concatenate([power[_BESIDE], power[-_BESIDE]])
    # The median of noise is ln 2 of its mean; the squares of a Hann window add up to 3/8.
    return float(np.median(beside)) / (math.log(2.0) * 0.375 * mixed.size**2)


def _mixed_down(steps: FloatArray, frequency: float, center: float) -> ComplexArray:
    """Means over blocks of the steps, mixed down from `frequency` (cycles a sample) to zero."""
    return np.concatenate(
        [
            mixed_down(steps[block], frequency, center - block.start)
            for block in blocks(steps.size, multiple=MIX_BLOCK)
        ]
    )


def _in_angle(
    components: Components, moved: BooleanArray, orders: FloatArray, turns: Turning
) -> Components:
    """The components, those moved as lines at `orders`: whole where it is not told from whole."""
    rounded = np.rint(orders)
    whole = np.abs(orders - rounded) * turns.turns < 0.5
    taken = replace(
        components.select(moved),
        orders=np.where(whole, rounded, orders),
        free=~whole,
        frequencies=np.empty(0),
    )
    return joined(components.select(~moved), taken)
