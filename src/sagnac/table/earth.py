"""Earth rate on the table: what it is, and how large a fit may find it."""

import math
from collections.abc import Callable
from typing import Final

import numpy as np

from sagnac.arrays import FloatArray
from sagnac.constants import EARTH_RATE

LARGEST_EARTH_RATE: Final = 2.0 * EARTH_RATE
"""Bound of an Earth-rate coefficient of a gyro or of a difference of two, rad/s.

At a constant table rate the Earth terms coincide with the sine and cosine of the table angle, and
what is left of them is encoder noise. Nothing but their size is known then: this bound serves as
the standard deviation of their prior, and a fit under that prior may not exceed it
(`bounded_by_earth`).
"""

# Factor by which the prior is tightened at a time where a solution exceeds the bound. The first
# solution within the bound is taken, not the one on it: a root would be no better known.
_TIGHTER: Final = 1.3


def earth_rate(latitude: float, heading: float) -> FloatArray:
    """Earth rate in the b0 frame, eta of Eq. 5, for a level table.

    Parameters
    ----------
    latitude
        rad, north positive.
    heading
        rad, of x_b0 (the null pulse) from north, clockwise seen from above.

    Returns
    -------
    FloatArray
        (3,) rad/s.

    Raises
    ------
    ValueError
        If the latitude lies beyond a pole, or the heading is not finite.
    """
    if not abs(latitude) <= math.pi / 2:
        raise ValueError(f"latitude {latitude:g} rad lies beyond a pole; give -pi/2 to pi/2")
    if not math.isfinite(heading):
        raise ValueError(f"heading is {heading!r}; give an angle in rad")
    north = EARTH_RATE * math.cos(latitude)
    return np.array(
        [
            north * math.cos(heading),
            -north * math.sin(heading),
            -EARTH_RATE * math.sin(latitude),
        ]
    )


def bounded_by_earth(
    solve: Callable[[FloatArray], FloatArray], penalty: FloatArray, earth: slice
) -> FloatArray:
    """Solution of a ridge regression whose Earth-rate coefficients stay within the bound.

    Parameters
    ----------
    solve
        Gives the (coefficients,) solution for a (coefficients,) penalty.
    penalty
        (coefficients,) noise over prior standard deviation; 0 without a prior.
    earth
        Which coefficients are Earth rate, rad/s.

    Returns
    -------
    FloatArray
        (coefficients,) the first solution within the bound as the prior is tightened; the plain
        one if Earth rate has no penalty, so that no prior could hold it.
    """
    solution = solve(penalty)
    if not np.all(penalty[earth] > 0.0):
        return solution
    while np.abs(solution[earth]).max() > LARGEST_EARTH_RATE:
        # Encoder error speaks here, not noise, and no amount of it makes the Earth turn faster.
        penalty = _TIGHTER * penalty
        solution = solve(penalty)
    return solution
