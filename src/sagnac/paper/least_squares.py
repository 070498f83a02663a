"""Least squares on the Allan deviation, in the forms that the paper may have used."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import nnls

Form = Literal[
    "deviation, relative",
    "deviation, plain",
    "variance, relative",
    "variance, plain",
    "variance, plain, none below zero",
]
FORMS: Final[tuple[Form, ...]] = get_args(Form)
# The published fit is not described. This form is taken because its Figures 2 and 3 both come
# near the published numbers; no other evidence is for it, and one thing is against it: on white
# noise at 1 s it scatters by 22 %, and the cells of Table 1 at rest by 6 %
# (`python -m benchmarks.figure_3`).
FORM: Final[Form] = "deviation, relative"
FITTED_TERMS: Final = 5
_POWERS: Final = (-2.0, -1.0, 0.0, 1.0, 2.0)  # of tau in the variance, Eq. 3


@dataclass(frozen=True, slots=True, kw_only=True)
class _Squares:
    """Which squares are made least: of variance or deviation, weighted or not, bounded or not."""

    of_variance: bool
    relative: bool
    bounded: bool = False


_SQUARES: Final[Mapping[Form, _Squares]] = {
    "deviation, relative": _Squares(of_variance=False, relative=True),
    "deviation, plain": _Squares(of_variance=False, relative=False),
    "variance, relative": _Squares(of_variance=True, relative=True),
    "variance, plain": _Squares(of_variance=True, relative=False),
    "variance, plain, none below zero": _Squares(of_variance=True, relative=False, bounded=True),
}


def least_squares(tau: ArrayLike, deviation: ArrayLike, form: Form) -> float:
    """N by plain least squares of the five terms of Eq. 3, as such fits are commonly made.

    ``variance``: the square of the deviation on powers -2 to 2 of tau. ``deviation``: the
    deviation on powers -1, -1/2, 0, 1/2, 1, which is not Eq. 3 (deviations do not add) but
    is widely used. ``relative``: every residual in units of its point. Only ``none below zero``
    keeps coefficients from falling below zero.

    Parameters
    ----------
    tau
        (points,) cluster times, s.
    deviation
        (points,) Allan deviation, rad/s.
    form
        Which squares are made least.

    Returns
    -------
    float
        rad/sqrt(s); of a coefficient below zero, minus the root of its size.

    Raises
    ------
    ValueError
        If there is no such form, or the points are fewer than five, of two lengths, or not above
        zero.
    """
    if form not in FORMS:
        raise ValueError(f"form is {form!r}; use one of {'; '.join(FORMS)}")
    squares = _SQUARES[form]
    times = np.asarray(tau, dtype=np.float64)
    sizes = np.asarray(deviation, dtype=np.float64)
    if times.size < FITTED_TERMS:
        raise ValueError(f"{times.size} points cannot hold five terms; give a longer curve")
    if sizes.shape != times.shape or np.any(times <= 0.0) or np.any(sizes <= 0.0):
        raise ValueError(
            f"tau {times.shape} and deviation {sizes.shape} must have one shape and lie above zero"
        )
    observed = sizes**2 if squares.of_variance else sizes
    basis = times[:, np.newaxis] ** (np.array(_POWERS) * (1.0 if squares.of_variance else 0.5))
    weight = 1.0 / observed if squares.relative else np.ones_like(observed)
    columns = basis * weight[:, np.newaxis]
    norm = np.linalg.norm(columns, axis=0)
    if squares.bounded:
        solution = nnls(columns / norm, observed * weight)[0] / norm
    else:
        solution = np.linalg.lstsq(columns / norm, observed * weight, rcond=None)[0] / norm
    size = abs(float(solution[1]))
    square = size if squares.of_variance else size**2
    return math.copysign(math.sqrt(square), float(solution[1]))
