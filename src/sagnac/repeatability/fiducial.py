"""Variances drawn from their fiducial distribution: intervals that hold at few degrees of freedom.

The contrasts of a factor, free of all others, are normal with the covariance
``G s_k^2 + I s_run^2 + S`` (s_k^2 the variance of the factor, S the known variances), so that
their squared length in that metric is chi-square with as many degrees of freedom. It falls as s_k^2
rises; a draw of the chi-square therefore is a draw of s_k^2, given one of s_run^2, which comes
from the residual contrasts in the same way. In a balanced design these are the generalized pivotal
quantities of Weerahandi (*J. Am. Stat. Assoc.* 88, 899, 1993), which start from exact chi-squares.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from sagnac.arrays import FloatArray
from sagnac.repeatability.design import Design

DRAWS: Final = 4000
_HALVINGS: Final = 60


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Draws:
    """Variances that the runs allow, each set as likely as the next.

    Attributes
    ----------
    factors
        By name of the factor: (draws,) variances, zero or more.
    run
        (draws,) variance between runs beyond what is known of each.
    """

    factors: Mapping[str, FloatArray]
    run: FloatArray


def draws_of(design: Design, *, count: int = DRAWS, seed: int = 0) -> Draws:
    """Draw the variances of a design.

    Parameters
    ----------
    design
        With a residual degree of freedom or more.
    count
        Number of draws.
    seed
        Of the draws: the same runs always give the same intervals.

    Raises
    ------
    ValueError
        If the runs leave no residual contrast.
    """
    if design.residual_contrasts.shape[1] < 1:
        raise ValueError("values leave no contrast free of all factors; measure more runs")
    random = np.random.default_rng(seed)
    run = _run_draws(design, random, count)
    factors = {name: _factor_draws(design, name, run, random) for name in design.seen}
    return Draws(factors=factors, run=run)


def _run_draws(design: Design, random: np.random.Generator, count: int) -> FloatArray:
    contrasts = design.residual_contrasts
    known = contrasts.T @ (design.variances[:, np.newaxis] * contrasts)
    sizes, directions = np.linalg.eigh(known)
    squares = (directions.T @ (contrasts.T @ design.values)) ** 2
    wanted = random.chisquare(sizes.size, count)
    sizes = np.maximum(sizes, 0.0)
    return _variance_at(wanted, squares[np.newaxis], sizes[np.newaxis], np.ones((1, sizes.size)))


def _factor_draws(
    design: Design, name: str, run: FloatArray, random: np.random.Generator
) -> FloatArray:
    contrasts = design.contrasts(name)
    freedom = contrasts.shape[1]
    incidence = contrasts.T @ design.incidence(name)
    known = contrasts.T @ (design.variances[:, np.newaxis] * contrasts)
    values = contrasts.T @ design.values
    metric = known + run[:, np.newaxis, np.newaxis] * np.eye(freedom)
    metric += 1e-12 * design.spread**2 * np.eye(freedom)
    root = np.linalg.cholesky(metric)
    white = np.linalg.solve(root, np.broadcast_to(incidence, (run.size, *incidence.shape)))
    sizes, directions = np.linalg.eigh(white @ white.transpose(0, 2, 1))
    whitened = np.linalg.solve(root, np.broadcast_to(values[:, np.newaxis], (run.size, freedom, 1)))
    squares = (directions.transpose(0, 2, 1) @ whitened)[..., 0] ** 2
    return _variance_at(random.chisquare(freedom, run.size), squares, np.ones_like(sizes), sizes)


def _variance_at(
    wanted: FloatArray, squares: FloatArray, fixed: FloatArray, slope: FloatArray
) -> FloatArray:
    """Where the sum of ``squares / (fixed + slope s)`` is as wanted; 0 if it is less already.

    Parameters
    ----------
    wanted
        (draws,)
    squares, fixed, slope
        (draws or 1, contrasts)
    """
    high = np.sum(squares / slope, axis=-1) / wanted
    low = np.zeros_like(high)
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        reached = np.sum(squares / (fixed + slope * middle[:, np.newaxis]), axis=-1) < wanted
        high = np.where(reached, middle, high)
        low = np.where(reached, low, middle)
    with np.errstate(divide="ignore", invalid="ignore"):
        short = np.sum(np.where(squares > 0.0, squares / fixed, 0.0), axis=-1) <= wanted
    return np.asarray(np.where(short, 0.0, high))
