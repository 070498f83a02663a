"""Degrees of freedom of a stability estimate, and what interval they give."""

import math

import numpy as np
from scipy.special import gammaincinv

from sagnac.arrays import FloatArray
from sagnac.stability.estimators import properties_of
from sagnac.stability.names import Estimator
from sagnac.stability.noise_type import check_noise_type


def ieee_relative_error(samples: int, cluster: int) -> float:
    """Relative error of an Allan deviation, 1/sqrt(2 (N/n - 1)), of IEEE Std 952.

    `samples` rates in clusters of `cluster`; it counts the N/n - 1 independent differences
    and knows neither overlap nor noise type.

    Raises
    ------
    ValueError
        If there are fewer than two clusters.
    """
    if cluster < 1 or samples < 2 * cluster:
        raise ValueError(
            f"cluster {cluster} leaves under two clusters in {samples} samples; "
            f"use 1 to {samples // 2}"
        )
    return 1.0 / math.sqrt(2.0 * (samples / cluster - 1.0))


def equivalent_degrees_of_freedom(
    estimator: Estimator, noise_type: int, cluster: int, samples: int
) -> float:
    """Equivalent degrees of freedom of a stability variance over a whole record.

    Finite-difference estimators by the exact sum of Greenhall and Riley; the total and Theo1
    families by the formulas of SP1065, section 5.4, and by counting for total variances of
    angle noise, which it leaves out.

    Greenhall and Riley average the angle over each sample interval. White rate samples are
    not like that at m = 1, where overlapped terms have 2 (N - 2)/3 degrees of freedom and the
    paper has 15 % more: a 95 % interval covers 93 % there. At m = 2 and beyond it covers 95 to
    96 %.

    Parameters
    ----------
    estimator
        As in `stability_curve`; ``theoh`` at a cluster means its Theo1 part.
    noise_type
        Power law of the rate noise, 2 to -2, or to -4 for ``hdev`` and ``ohdev``.
    cluster
        m: tau = m tau0; for ``theo1`` and ``theoh`` the span m.
    samples
        N: accumulated angles, one more than there are rates.

    Raises
    ------
    ValueError
        If an argument is out of its range.
    """
    row = properties_of(estimator)
    check_noise_type(noise_type, row)
    smallest, largest = row.shortest, row.longest(samples)
    if not smallest <= cluster <= largest:
        raise ValueError(
            f"cluster {cluster} is out of range for {estimator}; use {smallest} to {largest}"
        )
    return row.freedom(noise_type, cluster, samples, row.windows(cluster, samples))


def chi_squared_limits(
    deviation: FloatArray, edf: FloatArray, confidence: float
) -> tuple[FloatArray, FloatArray]:
    """Limits of the deviation: edf s^2 / sigma^2 is chi-squared with edf degrees.

    Parameters
    ----------
    deviation, edf
        (points,).
    confidence
        Probability content between the limits.

    Returns
    -------
    low, high
        (points,) in the unit of `deviation`.
    """
    tail = 0.5 * (1.0 - confidence)
    upper = 2.0 * gammaincinv(0.5 * edf, 1.0 - tail)
    lower = 2.0 * gammaincinv(0.5 * edf, tail)
    return np.asarray(deviation * np.sqrt(edf / upper)), np.asarray(
        deviation * np.sqrt(edf / lower)
    )
