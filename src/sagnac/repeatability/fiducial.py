"""Variances drawn from their fiducial distribution: intervals that hold at few degrees of freedom.

The contrasts of a factor, free of all others, are normal with the covariance
``G s_k^2 + I s_run^2 + S`` (s_k^2 the variance of the factor, S the known variances), so that
their squared length in that metric is chi-square with as many degrees of freedom. It falls as s_k^2
rises; a draw of the chi-square therefore is a draw of s_k^2, given one of s_run^2, which comes
from the residual contrasts in the same way. In a balanced design these are the generalized pivotal
quantities of Weerahandi (*J. Am. Stat. Assoc.* 88, 899, 1993), which start from exact chi-squares.

If contrasts happen to be shorter than chance makes them without any s_k^2, most draws are zero,
and a quantile of them would say that nothing scatters. A bound takes them to be no shorter than in
the shortest 16 of 100 campaigns without any scatter. So it claims no more than the runs can show
(power-constrained limits: Cowan et al., arXiv:1105.3166).
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.special import chdtri, gammainc

from sagnac.arrays import FloatArray
from sagnac.repeatability.design import Design

DRAWS: Final = 4000
_HALVINGS: Final = 60
# Chance of contrasts shorter than a bound takes them to be.
_POWER: Final = 0.16


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

    def of(self, name: str) -> FloatArray:
        """(draws,) of a factor, or of ``run``."""
        return self.run if name == "run" else self.factors[name]


def draws_of(
    design: Design, *, count: int = DRAWS, seed: int = 0, bounded: Collection[str] = ()
) -> Draws:
    """Draw the variances of a design.

    Parameters
    ----------
    design
        With a residual degree of freedom or more.
    count
        Number of draws.
    seed
        Of the draws: the same runs always give the same intervals.
    bounded
        Factors, and ``run``, of which a bound is wanted.

    Raises
    ------
    ValueError
        If the runs leave no residual contrast.
    """
    if design.residual_contrasts.shape[1] < 1:
        raise ValueError("values leave no contrast free of all factors; measure more runs")
    random = np.random.default_rng(seed)
    run = _run_draws(design, random, count, bounded=False)
    factors = {
        name: _factor_draws(design, name, run, random, bounded=name in bounded)
        for name in design.seen
    }
    if "run" in bounded:
        run = _run_draws(design, random, count, bounded=True)
    return Draws(factors=factors, run=run)


def chance_of_less(design: Design) -> float:
    """Chance that runs lie as close together or closer by their known variances alone.

    One if nothing is known of them.
    """
    squares, sizes = _residual_squares(design)
    if not np.all(sizes > 0.0):
        return 1.0
    return float(gammainc(0.5 * sizes.size, 0.5 * np.sum(squares / sizes)))


def _residual_squares(design: Design) -> tuple[FloatArray, FloatArray]:
    """(contrasts,) squared residual contrasts, and what the known variances make of each."""
    contrasts = design.residual_contrasts
    known = contrasts.T @ (design.variances[:, np.newaxis] * contrasts)
    sizes, directions = np.linalg.eigh(known)
    squares = (directions.T @ (contrasts.T @ design.values)) ** 2
    return squares, np.maximum(sizes, 0.0)


def _run_draws(
    design: Design, random: np.random.Generator, count: int, *, bounded: bool
) -> FloatArray:
    squares, sizes = _residual_squares(design)
    return _variances(random, count, squares[np.newaxis], sizes[np.newaxis], bounded=bounded)


def _factor_draws(
    design: Design, name: str, run: FloatArray, random: np.random.Generator, *, bounded: bool
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
    return _variances(random, run.size, squares, np.ones_like(sizes), sizes, bounded=bounded)


def _variances(
    random: np.random.Generator,
    count: int,
    squares: FloatArray,
    fixed: FloatArray,
    slope: FloatArray | None = None,
    *,
    bounded: bool,
) -> FloatArray:
    """Draws of s, for which the sum of ``squares / (fixed + slope s)`` is chi-square.

    `bounded` lengthens squares that are shorter than in most campaigns with an s of zero.
    """
    freedom = squares.shape[-1]
    slope = np.ones_like(fixed) if slope is None else slope
    if bounded and np.all(fixed > 0.0):
        least = float(chdtri(freedom, 1.0 - _POWER))
        length = np.sum(squares / fixed, axis=-1, keepdims=True)
        even = np.broadcast_to(fixed / freedom, squares.shape)
        with np.errstate(divide="ignore", invalid="ignore"):
            squares = np.where(
                length > 0.0, squares * np.maximum(1.0, least / length), least * even
            )
    return _variance_at(random.chisquare(freedom, count), squares, fixed, slope)


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
