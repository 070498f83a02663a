"""The difference of two gyros, and what it says of one."""

import math


def per_gyro(square: float, gyros_differenced: int) -> float:
    """Coefficient of one gyro from the squared coefficient of what was measured.

    This is the one place where the factor for a difference stands. Independent gyros
    add in square, so a difference of two has twice their mean square (Eq. 3 of the
    paper), whatever the term.

    Parameters
    ----------
    square
        Squared coefficient of the measured signal.
    gyros_differenced
        1 for a single gyro, 2 for a difference.

    Returns
    -------
    float
        Root of the mean square over the gyros.

    Raises
    ------
    ValueError
        If `gyros_differenced` is neither 1 nor 2.
    """
    if gyros_differenced not in (1, 2):
        raise ValueError(f"gyros_differenced is {gyros_differenced}; use 1 (a gyro) or 2 (a pair)")
    return math.sqrt(square / gyros_differenced)
