"""Earth rate on the table, and how large it can be."""

import math

import numpy as np

from sagnac.arrays import FloatArray
from sagnac.constants import EARTH_RATE


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
        If the latitude lies beyond a pole.
    """
    if not abs(latitude) <= math.pi / 2:
        raise ValueError(f"latitude {latitude:g} rad lies beyond a pole; give -pi/2 to pi/2")
    north = EARTH_RATE * math.cos(latitude)
    return np.array(
        [
            north * math.cos(heading),
            -north * math.sin(heading),
            -EARTH_RATE * math.sin(latitude),
        ]
    )
