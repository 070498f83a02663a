"""Runs that the others do not bear out, and a drift of the days."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.special import stdtr, stdtrit

from sagnac.arrays import FloatArray
from sagnac.repeatability.design import Design
from sagnac.repeatability.restricted import Components, covariance_of, residual_metric

# Chance, over all runs together, at which a run is called an outlier.
CHANCE: Final = 0.05


@dataclass(frozen=True, slots=True, kw_only=True)
class Departure:
    """A run that lies off what the others foretell.

    Attributes
    ----------
    index
        Of the run.
    foretold
        Value that the other runs give for it.
    deviations
        Standard deviations that it lies off that.
    mean_without
        Mean of the campaign without it.
    """

    index: int
    foretold: float
    deviations: float
    mean_without: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Slope:
    """Change for each day, with an interval."""

    value: float
    low: float
    high: float


def departures(design: Design, components: Components) -> tuple[Departure, ...]:
    """Runs off what the others foretell by more than chance, the farthest first.

    With the metric P of the restricted likelihood, the value that the others foretell of run i
    lies ``(P y)_i / P_ii`` off it, and the variance of that is ``1 / P_ii``. The run itself has
    raised the variances; Student's deleted residual takes that back.

    Parameters
    ----------
    design
        The runs.
    components
        Variances of the effects.
    """
    metric = residual_metric(covariance_of(design, components))
    weighted = metric @ design.values
    weight = np.diag(metric)
    standard = weighted / np.sqrt(weight)
    freedom = float(design.residual_contrasts.shape[1])
    if freedom < 2.0:
        return ()
    # The variances make the squares of all runs sum to one less than their number.
    total = design.values.size - 1.0
    deleted = standard * np.sqrt((total - 1.0) / np.maximum(total - standard**2, 1e-9))
    chance = 2.0 * stdtr(freedom - 1.0, -np.abs(deleted)) * design.values.size
    found = []
    for index in np.flatnonzero(chance < CHANCE).tolist():
        off = float(weighted[index] / weight[index])
        found.append(
            Departure(
                index=index,
                foretold=float(design.values[index]) - off,
                deviations=float(deleted[index]),
                mean_without=_mean_without(design, components, index),
            )
        )
    return tuple(sorted(found, key=lambda one: -abs(one.deviations)))


def _mean_without(design: Design, components: Components, index: int) -> float:
    kept = np.delete(np.arange(design.values.size), index)
    covariance = covariance_of(design, components)[np.ix_(kept, kept)]
    row = np.linalg.inv(covariance).sum(axis=0)
    return float(row @ design.values[kept] / row.sum())


def slope_of_days(
    design: Design, days: FloatArray, *, factor: str, confidence: float
) -> Slope | None:
    """Change of the values for each day, from the means of the days.

    All runs of a day share its effect, so that the days, not the runs, are what a slope is fitted
    to: three days leave one degree of freedom.

    Parameters
    ----------
    design
        The runs.
    days
        (levels,) time of each level of the factor, days, in the order of `Design.levels`.
    factor
        Name of the factor that stands for days.
    confidence
        Of the interval.

    Returns
    -------
    Slope or None
        None with fewer than three days, or if the other factors cannot be told from them.
    """
    times = days - days.mean()
    if times.size < 3 or not np.any(times) or factor not in design.seen:
        return None
    incidence = design.incidence(factor)
    others = [design.incidence(name) for name in design.factors if name != factor]
    columns = np.hstack([incidence, *others]) if others else incidence
    effects = np.linalg.lstsq(columns, design.values, rcond=None)[0][: times.size]
    effects = effects - effects.mean()
    slope = float(times @ effects / (times @ times))
    left = effects - slope * times
    error = math.sqrt(float(left @ left) / (times.size - 2) / float(times @ times))
    reach = float(stdtrit(times.size - 2, 0.5 + 0.5 * confidence)) * error
    return Slope(value=slope, low=slope - reach, high=slope + reach)
