"""What goes with the angle of a table that makes less than a few turns.

Over part of a turn orders are no basis: many sums of them make the same function of the angle, so
that a search takes one for another and goes on. The function itself is well known. All orders are
fitted to it at once, each with a prior, as many as the record asks for (Schwarz's criterion),
beside table motion and Earth rate.
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from sagnac import series
from sagnac.arrays import FloatArray
from sagnac.table.earth import LARGEST_EARTH_RATE
from sagnac.table.kinematics import (
    averages_of,
    block_gain,
    harmonic_sum,
    highest_harmonic,
    kinematics,
)
from sagnac.table.turns import FEW_TURNS, full_turns
from sagnac.table.whitened import whitened
from sagnac.units import ARCSECOND

# Numbers of orders that are tried.
_ORDERS: Final = (4, 8, 16, 32, 64, 128)
# Standard deviation of an order's prior, at the least.
_USUAL: Final = 30.0 * ARCSECOND
# Columns before the orders: table angle, time, Earth rate.
_BEFORE: Final = 4
# Averages below which nothing is told.
_FEWEST: Final = 100


@dataclass(frozen=True, slots=True, kw_only=True)
class AngleFunction:
    """A function of the table angle, as a sum of orders that mean nothing one by one.

    Attributes
    ----------
    orders, cosine, sine
        (orders,) and their coefficients, rad.
    """

    orders: FloatArray
    cosine: FloatArray
    sine: FloatArray

    def less(self, angle: FloatArray, table: FloatArray) -> FloatArray:
        """(samples,) an angle without the function, rad: a new series."""
        return series.made(
            lambda span: (
                angle[span] - harmonic_sum(table[span], self.orders, self.cosine, self.sine)
            ),
            angle.size, angle, table,
        )  # fmt: skip


def function_of_angle(
    angle: FloatArray, table: FloatArray, sample_rate: float
) -> AngleFunction | None:
    """What in a gyro angle goes with the angle of a table over part of a turn, or a few.

    Parameters
    ----------
    angle
        (samples,) of a gyro or of a difference, rad.
    table
        (samples,) unwrapped, rad.
    sample_rate
        Hz.

    Returns
    -------
    AngleFunction or None
        None if the table turns far enough to tell orders apart, or nothing goes with the angle.
    """
    if full_turns(table) >= FEW_TURNS:
        return None
    kinematic = kinematics(table, sample_rate)
    highest = math.floor(highest_harmonic(kinematic))
    shown = averages_of(angle, kinematic.block)
    if shown.size < _FEWEST:
        return None
    time = np.arange(shown.size) * kinematic.interval
    slow = np.stack([kinematic.angle, time, kinematic.cosine, kinematic.sine])
    free = np.array([np.inf, np.inf, LARGEST_EARTH_RATE, LARGEST_EARTH_RATE])
    best = whitened(shown, slow, free)
    size = max(_USUAL, float(np.std(shown - best.values @ slow)))
    least, found = best.deviance, None
    for count in dict.fromkeys(min(count, highest) for count in _ORDERS):
        if count < 1:
            break
        orders = np.arange(1.0, count + 1.0)
        phases = orders[:, np.newaxis] * kinematic.angle
        columns = np.concatenate([slow, np.cos(phases), np.sin(phases)])
        fit = whitened(shown, columns, np.concatenate([free, np.full(2 * count, size)]))
        deviance = fit.deviance + fit.freedom * math.log(shown.size)
        if deviance < least:
            gain = block_gain(kinematic, orders)
            cosine, sine = np.split(fit.values[_BEFORE:], 2)
            least = deviance
            found = AngleFunction(orders=orders, cosine=cosine / gain, sine=sine / gain)
    return found
