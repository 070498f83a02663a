"""Frames of the platform: C_b^s, the shares of the table rate and Earth rate, Eqs. 1, 2 and 5.

Frames n (north, east, down), b (turns with the table, z along the shaft and down),
b0 (b at the null pulse) and s (the gyro axes) are those of Yu et al., Sensors 2013,
13, 2750.
"""

import math

import numpy as np
from numpy.typing import ArrayLike

from sagnac.core.arrays import FloatArray
from sagnac.core.errors import refusal
from sagnac.core.units import EARTH_RATE

_UNIT_NORM_TOLERANCE = 1e-9


def shares_from_deviations(deviations: ArrayLike) -> FloatArray:
    """Shares (e_x, e_y, e_z) of the table rate from their deviations from 1/sqrt(3), Eq. 2.

    The shaft is one direction, so the shares have unit length; two deviations fix the
    third. The vector 1/sqrt(3) + deviation is scaled to unit length, which moves each
    share by no more than the mean deviation and its square.

    Parameters
    ----------
    deviations
        (3,) delta e_x, delta e_y, delta e_z.

    Returns
    -------
    FloatArray
        (3,) of unit length.

    Raises
    ------
    ValueError
        If the deviations are not three finite numbers below 0.1 in size.
    """
    values = np.asarray(deviations, dtype=np.float64)
    if values.shape != (3,) or not np.all(np.abs(values) < 0.1):
        wanted = "must be three numbers below 0.1; the shares stay near 1/sqrt(3)"
        raise ValueError(f"deviations {values.tolist()} {wanted}")
    shares = 1.0 / math.sqrt(3.0) + values
    return np.asarray(shares / np.linalg.norm(shares))


def table_to_gyro_matrix(e_x: float, e_y: float, e_z: float) -> FloatArray:
    """C_b^s of Eq. 1: table frame b to the orthogonal gyro axes s.

    Parameters
    ----------
    e_x, e_y, e_z
        Shares of the table rate on the three gyros; their squares sum to 1.

    Returns
    -------
    FloatArray
        (3, 3), a rotation.

    Raises
    ------
    ValueError
        If the squares do not sum to 1 within 1e-9, or e_x is +-1 (x_s along the shaft
        has no projection on the table plane).
    """
    square = e_x * e_x + e_y * e_y + e_z * e_z
    if not abs(square - 1.0) <= _UNIT_NORM_TOLERANCE:
        why = f"e_x^2 + e_y^2 + e_z^2 is {square:.12g}, not 1, so Eq. 1 is no rotation"
        raise ValueError(f"{why}; scale the shares to unit length (shares_from_deviations)")
    in_plane = math.sqrt(max(0.0, 1.0 - e_x * e_x))
    if in_plane < _UNIT_NORM_TOLERANCE:
        raise ValueError(f"e_x = {e_x:g} leaves x_s no projection on the table; keep |e_x| below 1")
    second = [-e_x * e_y / in_plane, e_z / in_plane, e_y]
    third = [-e_x * e_z / in_plane, -e_y / in_plane, e_z]
    return np.array([[in_plane, 0.0, e_x], second, third])


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
        raise refusal("heading", f"is {heading!r}; give an angle in rad")
    north = EARTH_RATE * math.cos(latitude)
    level = north * math.cos(heading), -north * math.sin(heading)
    return np.array([*level, -EARTH_RATE * math.sin(latitude)])
