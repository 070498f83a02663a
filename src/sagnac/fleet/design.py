"""Which runs share a unit, a day or a rate, and the variances of these.

REML gives the variances; their fiducial distribution gives intervals that hold at few degrees of
freedom.

The contrasts of a factor, free of all others, are normal with the covariance
``G s_k^2 + I s_run^2 + S`` (s_k^2 the variance of the factor, S the known variances), so that
their squared length in that metric is chi-square with as many degrees of freedom. It falls as s_k^2
rises; a draw of the chi-square therefore is a draw of s_k^2, given one of s_run^2, which comes
from the residual contrasts in the same way. The contrasts of units hold the variance of days as
well if each day is of one unit: a draw of that is given, too. In a balanced design these are the
generalized pivotal quantities of Weerahandi (*J. Am. Stat. Assoc.* 88, 899, 1993), which start
from exact chi-squares.

If contrasts happen to be shorter than chance makes them without any s_k^2, most draws are zero,
and a quantile of them would say that nothing scatters. A bound takes them to be no shorter than in
the shortest 16 of 100 campaigns without any scatter. So it claims no more than the runs can show
(power-constrained limits: Cowan et al., arXiv:1105.3166).
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Final

import numpy as np
from scipy.optimize import minimize
from scipy.special import chdtri, gammainc

from sagnac.core.arrays import FloatArray

# ---- design ------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True, eq=False)
class Design:
    """Runs, and the labels that they share.

    Parameters
    ----------
    values
        (runs,) what was measured, on the scale on which effects add.
    factors
        By name of the factor, such as ``unit``, the label of each run. Equal labels are the same
        unit (day, rate). If the third day of one unit has nothing to do with that of another,
        give the two days two labels.
    variances
        (runs,) known variance of each value; zeros if nothing is known.
    """

    values: FloatArray
    factors: Mapping[str, tuple[str, ...]]
    variances: FloatArray

    @cached_property
    def seen(self) -> tuple[str, ...]:
        """Factors whose variance the runs can tell from that of the others, inner ones first."""
        seen = [name for name in self.factors if self.contrasts(name).shape[1] > 0]
        return tuple(sorted(seen, key=lambda name: len(self.within(name))))

    @cached_property
    def hidden(self) -> Mapping[str, str]:
        """The other factors, and why."""
        counts = {name: len(self.levels(name)) for name in self.factors if name not in self.seen}
        together = "its {} levels change only together with the other factors"
        return {
            name: together.format(count) if count > 1 else f"all runs are of one {name}"
            for name, count in counts.items()
        }

    def within(self, name: str) -> tuple[str, ...]:
        """Factors whose levels each belong to one level of this one, as days of one unit each."""
        wide = self.factors.get(name, ("",))
        both = {one: len(set(zip(own, wide, strict=False))) for one, own in self.factors.items()}
        # Each level stands beside one of the wide ones, and several beside the same.
        return tuple(one for one in both if 1 < len(set(wide)) < both[one] == len(self.levels(one)))

    def levels(self, name: str) -> tuple[str, ...]:
        """Labels of a factor, in order of appearance."""
        return tuple(dict.fromkeys(self.factors[name]))

    def incidence(self, name: str) -> FloatArray:
        """(runs, levels) 1 where a run is of a level; each run is a level of ``run``."""
        if name == "run":
            return np.eye(self.values.size)
        labels = np.array(self.factors[name])
        return np.asarray(labels[:, np.newaxis] == self.levels(name), dtype=np.float64)

    def shared(self, name: str) -> FloatArray:
        """(runs, runs) 1 where two runs share a level of a factor, or are one ``run``."""
        incidence = self.incidence(name)
        return np.asarray(incidence @ incidence.T)

    def contrasts(self, name: str) -> FloatArray:
        """(runs, degrees of freedom) orthonormal contrasts of a factor, free of all others.

        They span what the factor explains beside the mean and the other factors, the space of
        Henderson's third sum of squares. Factors that lie within it are in its contrasts, too.
        Those of ``run`` are the residual ones, free of the mean and all factors.
        """
        free_of = set(self.factors) - {name, *self.within(name)}
        others = [self.incidence(other) for other in self.factors if other in free_of]
        rest = _orthonormal(np.hstack([np.ones((self.values.size, 1)), *others]))
        own = self.incidence(name)
        left = _orthonormal(own - rest @ (rest.T @ own))
        spanned = left.shape[1] + rest.shape[1]
        if name != "run" and spanned >= self.values.size and not np.any(self.variances):
            # Nothing is left to tell the factor from the scatter of single runs.
            return left[:, :0]
        return left

    @property
    def typical_variance(self) -> float:
        """Median of the known variances."""
        return float(np.median(self.variances))

    @property
    def spread(self) -> float:
        """Standard deviation of the values, 1 if they are all equal."""
        spread = float(np.std(self.values, ddof=1))
        return spread if spread > 0.0 and math.isfinite(spread) else 1.0


def _orthonormal(columns: FloatArray) -> FloatArray:
    """Orthonormal basis of what some columns span."""
    left, sizes, _ = np.linalg.svd(columns, full_matrices=False)
    # Share of a squared length that rounding leaves of a direction that others already span.
    return np.asarray(left[:, sizes**2 > 1e-10 * max(columns.shape[0], 1)])


# ---- restricted --------------------------------------------------------------------

Components = Mapping[str, float]
"""Variance of the effects of each factor and, as ``run``, between runs beyond what is known."""


def covariance_of(design: Design, components: Components) -> FloatArray:
    """(runs, runs) covariance of the values."""
    # A trace on the diagonal keeps it invertible where nothing is known to scatter.
    covariance = np.diag(components["run"] + design.variances + 1e-12 * design.spread**2)
    for name in design.seen:
        covariance += components[name] * design.shared(name)
    return np.asarray(covariance)


def residual_metric(covariance: FloatArray) -> FloatArray:
    """(runs, runs) ``V^-1 - V^-1 1 (1' V^-1 1)^-1 1' V^-1``, which takes the mean out."""
    inverse = np.linalg.inv(covariance)
    row = inverse.sum(axis=0)
    return np.asarray(inverse - np.outer(row, row) / row.sum())


def restricted_components(design: Design) -> Components:
    """Variances that make the contrasts of the values most likely, none below zero.

    The restricted likelihood is that of Patterson and Thompson (*Biometrika* 58, 545, 1971) with
    the mean as its one fixed effect; the gradient is ``-(tr(P Z Z') - y' P Z Z' P y) / 2``.

    Parameters
    ----------
    design
        Factors that the runs cannot tell apart are left out.
    """
    names, scale = (*design.seen, "run"), design.spread**2
    shared = [design.shared(name) for name in names]

    def components_of(relative: FloatArray) -> Components:
        return dict(zip(names, (scale * np.maximum(relative, 0.0)).tolist(), strict=True))

    def loss(relative: FloatArray) -> tuple[float, FloatArray]:
        covariance = covariance_of(design, components_of(relative))
        metric = residual_metric(covariance)
        weighted = metric @ design.values
        total = float(np.linalg.inv(covariance).sum())
        value = np.linalg.slogdet(covariance)[1] + np.log(total) + design.values @ weighted
        slope = [float(np.sum(metric * one)) - float(weighted @ one @ weighted) for one in shared]
        return float(value), scale * np.array(slope)

    factors, count = len(design.seen), len(names)
    starts = [np.full(count, 1.0 / count), np.append(np.full(factors, 0.02), 0.5)]
    bounds = [(0.0, None)] * factors + [(1e-9, None)]
    stop = {"ftol": 1e-14, "gtol": 1e-9, "maxiter": 500}
    fit = partial(minimize, loss, jac=True, method="L-BFGS-B", bounds=bounds, options=stop)
    best = min(map(fit, starts), key=lambda found: float(found.fun)).x
    # A component below this share of the variance of all values is none.
    return components_of(np.where(best < 1e-7, 0.0, best))


# ---- fiducial ----------------------------------------------------------------------

DRAWS: Final = 4000


def draws_of(
    design: Design, *, count: int = DRAWS, seed: int = 0, bounded: str = ""
) -> dict[str, FloatArray]:
    """Variances that the runs allow, each set as likely as the next.

    Parameters
    ----------
    design
        With a residual degree of freedom or more.
    count
        Number of draws.
    seed
        Of the draws: the same runs always give the same intervals.
    bounded
        Factor, or ``run``, of which a bound is wanted.

    Returns
    -------
    dict
        By factor and ``run``: (draws,) variances, zero or more.
    """
    random = np.random.default_rng(seed)
    squares, known = _residual_squares(design)

    def of_runs(*, bounded: bool) -> FloatArray:
        chosen = random.chisquare(known.size, count)
        return _variances(chosen, squares, known, np.ones_like(known), bounded=bounded)

    draws = {"run": of_runs(bounded=False)}
    for name in design.seen:
        chosen = random.chisquare(design.contrasts(name).shape[1], count)
        squares_of = _whitened(design, name, draws)
        draws[name] = _variances(chosen, *squares_of, bounded=name == bounded)
    return {**draws, "run": of_runs(bounded=True)} if bounded == "run" else draws


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
    contrasts = design.contrasts("run")
    sizes, directions = np.linalg.eigh(contrasts.T @ (design.variances[:, np.newaxis] * contrasts))
    return (directions.T @ (contrasts.T @ design.values)) ** 2, np.maximum(sizes, 0.0)


def _whitened(design: Design, name: str, draws: Mapping[str, FloatArray]) -> tuple[FloatArray, ...]:
    """(draws, contrasts) squared contrasts of a factor, what runs make of each, and the factor.

    They are whitened by the known variances and the `draws` (draws,) of runs and of the factors
    within this one: these make one.
    """
    contrasts = design.contrasts(name)
    known = design.variances + 1e-12 * design.spread**2
    metric = contrasts.T @ (known[:, np.newaxis] * contrasts)
    for inner in ("run", *design.within(name)):
        if inner in draws:
            shared = contrasts.T @ design.shared(inner) @ contrasts
            metric = metric + draws[inner][:, np.newaxis, np.newaxis] * shared
    root = np.linalg.cholesky(metric)
    white = np.linalg.solve(root, contrasts.T @ design.incidence(name))
    sizes, directions = np.linalg.eigh(white @ white.transpose(0, 2, 1))
    whitened = np.linalg.solve(root, (contrasts.T @ design.values)[:, np.newaxis])
    return (directions.transpose(0, 2, 1) @ whitened)[..., 0] ** 2, np.ones_like(sizes), sizes


def _variances(
    wanted: FloatArray, squares: FloatArray, fixed: FloatArray, slope: FloatArray, *, bounded: bool
) -> FloatArray:
    """Where the sum of ``squares / (fixed + slope s)`` is as wanted; 0 if it is less already.

    Parameters
    ----------
    wanted
        (draws,) of the chi-square of that sum.
    squares, fixed, slope
        (draws, contrasts), or (contrasts,) for all draws.
    bounded
        Whether squares are lengthened that are shorter than in most campaigns with an s of zero.
    """
    if bounded and np.all(fixed > 0.0):
        freedom = squares.shape[-1]
        # Contrasts are shorter than a bound takes them to be with a chance of 16 %.
        least = float(chdtri(freedom, 1.0 - 0.16))
        length = np.sum(squares / fixed, axis=-1, keepdims=True)
        with np.errstate(divide="ignore", invalid="ignore"):
            longer = squares * np.maximum(1.0, least / length)
        squares = np.where(length > 0.0, longer, least * fixed / freedom)
    high = np.sum(squares / slope, axis=-1) / wanted
    low = np.zeros_like(high)
    for _ in range(60):
        middle = 0.5 * (low + high)
        reached = np.sum(squares / (fixed + slope * middle[:, np.newaxis]), axis=-1) < wanted
        high = np.where(reached, middle, high)
        low = np.where(reached, low, middle)
    with np.errstate(divide="ignore", invalid="ignore"):
        short = np.sum(np.where(squares > 0.0, squares / fixed, 0.0), axis=-1) <= wanted
    return np.asarray(np.where(short, 0.0, high))
