"""Motion with the angle of a table that makes less than a few turns.

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
    Kinematics,
    averages_of,
    block_gain,
    harmonic_sum,
    highest_harmonic,
)
from sagnac.table.whitened import Whitened, whitened
from sagnac.units import ARCSECOND

# Numbers of orders that are tried.
_ORDERS: Final = (4, 8, 16, 32, 64, 128)
# Standard deviation of an order's prior, at the least.
_USUAL: Final = 30.0 * ARCSECOND
# Columns before the orders: table angle, Earth rate.
_BEFORE: Final = 3
# Averages below which nothing is told, and that an order takes.
_FEWEST: Final = 100
_AVERAGES_AN_ORDER: Final = 20


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


def function_of_angle(angle: FloatArray, kinematic: Kinematics) -> AngleFunction | None:
    """Part of a gyro angle that goes with the table angle over part of a turn, or a few.

    Parameters
    ----------
    angle
        (samples,) of a gyro or of a difference, rad.
    kinematic
        Of that table.

    Returns
    -------
    AngleFunction or None
        None if nothing goes with the angle.
    """
    highest = math.floor(highest_harmonic(kinematic))
    shown = averages_of(angle, kinematic.block)
    if shown.size < _FEWEST:
        return None
    slow = np.stack([kinematic.angle, kinematic.cosine, kinematic.sine])
    free = np.array([np.inf, LARGEST_EARTH_RATE, LARGEST_EARTH_RATE])
    plain = shown - whitened(shown, slow, free).values @ slow
    time = np.arange(shown.size, dtype=np.float64)
    line = np.polynomial.Polynomial.fit(time, plain, 1)(time)
    size = max(_USUAL, float(np.std(plain - line)))

    def fit_of(count: int, noises: tuple[float, float] | None) -> Whitened:
        phases = np.arange(1.0, count + 1.0)[:, np.newaxis] * kinematic.angle
        columns = np.concatenate([slow, np.cos(phases), np.sin(phases)])
        return whitened(shown, columns, np.concatenate([free, np.full(2 * count, size)]), noises)

    most = min(highest, shown.size // _AVERAGES_AN_ORDER)
    counts = dict.fromkeys(min(count, most) for count in (0, *_ORDERS))
    # All are judged beside the noise that the largest leaves: what is left of lines is no noise.
    largest = fit_of(most, None)
    noises = largest.readings, largest.walk
    fits = {count: fit_of(count, noises) for count in counts}
    best = min(
        counts,
        key=lambda count: fits[count].deviance + fits[count].freedom * math.log(shown.size),
    )
    if best == 0:
        return None
    orders = np.arange(1.0, best + 1.0)
    gain = block_gain(kinematic, orders)
    cosine, sine = np.split(fits[best].values[_BEFORE:], 2)
    return AngleFunction(orders=orders, cosine=cosine / gain, sine=sine / gain)
