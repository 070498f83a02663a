"""Variances of units, days, rates and runs by restricted maximum likelihood (REML)."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

from sagnac.arrays import FloatArray
from sagnac.repeatability.design import Design

# A component below this share of the variance of all values is none.
_ABSENT = 1e-7


@dataclass(frozen=True, slots=True, kw_only=True)
class Components:
    """Variances of the effects of a design.

    Attributes
    ----------
    factors
        By name of the factor.
    run
        Between runs, beyond the known variance of each.
    """

    factors: Mapping[str, float]
    run: float

    def __post_init__(self) -> None:
        for name, variance in (*self.factors.items(), ("run", self.run)):
            if not variance >= 0.0:
                raise ValueError(f"{name} is {variance!r}; a variance is zero or more")


def covariance_of(design: Design, components: Components) -> FloatArray:
    """(runs, runs) covariance of the values."""
    # A trace on the diagonal keeps it invertible where nothing is known to scatter.
    floor = 1e-12 * design.spread**2
    covariance = np.diag(components.run + design.variances + floor)
    for name, variance in components.factors.items():
        incidence = design.incidence(name)
        covariance += variance * (incidence @ incidence.T)
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
    names = design.seen
    scale = design.spread**2
    shared = [design.incidence(name) @ design.incidence(name).T for name in names]
    shared.append(np.eye(design.values.size))

    def components_of(relative: FloatArray) -> Components:
        sizes = (scale * np.maximum(relative, 0.0)).tolist()
        return Components(factors=dict(zip(names, sizes[:-1], strict=True)), run=sizes[-1])

    def loss(relative: FloatArray) -> tuple[float, FloatArray]:
        covariance = covariance_of(design, components_of(relative))
        metric = residual_metric(covariance)
        weighted = metric @ design.values
        total = float(np.linalg.inv(covariance).sum())
        value = np.linalg.slogdet(covariance)[1] + np.log(total) + design.values @ weighted
        slope = [
            float(np.sum(metric * block)) - float(weighted @ block @ weighted) for block in shared
        ]
        return float(value), scale * np.array(slope)

    starts = [np.full(len(shared), 1.0 / len(shared)), np.append(np.full(len(names), 0.02), 0.5)]
    bounds = [(0.0, None)] * len(names) + [(1e-9, None)]
    found = [
        minimize(
            loss,
            start,
            jac=True,
            method="L-BFGS-B",
            bounds=bounds,
            options={"ftol": 1e-14, "gtol": 1e-9, "maxiter": 500},
        )
        for start in starts
    ]
    best = min(found, key=lambda one: float(one.fun)).x
    return components_of(np.where(best < _ABSENT, 0.0, best))
