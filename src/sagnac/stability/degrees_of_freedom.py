"""Degrees of freedom of a stability estimate, and what interval they give."""

import math
from functools import lru_cache
from typing import Final

import numpy as np

from sagnac.stability import _kernels
from sagnac.stability.clusters import cluster_range
from sagnac.stability.estimators import (
    DIFFERENCES,
    FINITE_DIFFERENCE,
    THEO1_EFFECTIVE,
    Estimator,
    check_choice,
)
from sagnac.stability.noise_type import check_noise_type
from sagnac.stability.sums import window_count


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
    check_choice("estimator", estimator, Estimator)
    check_noise_type(noise_type, estimator)
    smallest, largest = cluster_range(estimator, samples)
    if not smallest <= cluster <= largest:
        raise ValueError(
            f"cluster {cluster} is out of range for {estimator}; use {smallest} to {largest}"
        )
    rule: Estimator = "theo1" if estimator == "theoh" else estimator
    windows = window_count(rule, cluster, samples)
    return curve_degrees_of_freedom(rule, noise_type, cluster, samples, windows)


def curve_degrees_of_freedom(
    estimator: Estimator, noise_type: int, cluster: int, samples: int, windows: int
) -> float:
    """Equivalent degrees of freedom of one point of a curve."""
    if estimator in FINITE_DIFFERENCE:
        return _greenhall_riley(estimator, noise_type, cluster, windows)
    ratio = (samples - 1) / cluster
    alpha = max(noise_type, -2)
    # The published fits are for long clusters and run past what one-sample clusters have.
    shortest = _greenhall_riley("oadev", alpha, 1, samples - 2)
    if estimator == "totdev":
        if alpha > 0:
            return _total_of_angle_noise(cluster, samples)
        slope, offset = _TOTAL_COEFFICIENTS[alpha]
        edf = slope * ratio - offset
        if alpha == 0:
            # The table is for long clusters; Stein's factor for white rate leads up to them.
            edf *= 4.0 * cluster**2 / (4.0 * cluster**2 + 5.0)
        return min(max(edf, _SMALLEST_EDF), shortest)
    if estimator == "mtotdev":
        slope, offset = _MODIFIED_TOTAL_COEFFICIENTS[alpha]
        return min(max(slope * ratio - offset, _SMALLEST_EDF), shortest)
    return max(_theo1_degrees_of_freedom(alpha, THEO1_EFFECTIVE * cluster, samples), 1.0)


def _total_of_angle_noise(cluster: int, samples: int) -> float:
    """White angle noise, of which SP1065 gives none: (tr Q)^2 / tr Q^2 of the total variance.

    Counted to leading order: each reflected difference holds an end of the record twice, and
    that one angle, met in every reflected difference, is what rules long clusters.
    """
    n, m = float(samples), float(cluster)
    if 2 * cluster < samples:
        inner = n - 2.0 * m
        return (6.0 * inner + 20.0 * m) ** 2 / (70.0 * inner + 32.0 * m * m + 340.0 * m)
    one, both = n - m, 2.0 * m - n  # differences that hold one end, and both
    return (20.0 * one + 14.0 * both) ** 2 / (32.0 * one**2 + 64.0 * both**2 + 64.0 * one * both)


@lru_cache(maxsize=4096)
def _greenhall_riley(estimator: Estimator, noise_type: int, cluster: int, windows: int) -> float:
    """Exact degrees of freedom of `windows` squared differences in a row.

    The filter factor F is 1 for modified variances, m for plain ones, and infinite for long
    clusters of rate noise, as in the paper.

    With gaps the windows are taken as if they stood in one row, which is on the safe side:
    apart they would be less correlated.
    """
    order = DIFFERENCES[estimator]
    modified = estimator in ("mdev", "tdev")
    overlapping = estimator not in ("adev", "hdev")
    if modified:
        filter_factor = 1.0
    elif noise_type <= 0 and cluster * (order + 1) > _LONGEST_FILTERED:
        filter_factor = math.inf
    else:
        filter_factor = float(cluster)
    inverse = _kernels.inverse_degrees_of_freedom(
        windows,
        cluster if overlapping else 1,
        filter_factor,
        noise_type,
        order,
        _GAUSS_NODES,
        _GAUSS_WEIGHTS,
    )
    return 1.0 / float(inverse)


def _theo1_degrees_of_freedom(alpha: int, tau: float, samples: int) -> float:
    """SP1065 Table 9: `tau` in samples (0.75 of the span), `samples` angles."""
    n = float(samples)
    if alpha == 2:
        return (0.86 * (n + 1.0) * (n - 4.0 / 3.0 * tau) / (n - tau)) * (tau / (tau + 1.14))
    if alpha == 1:
        return (
            (4.798 * n * n - 6.374 * n * tau + 12.387 * tau)
            / (math.sqrt(tau + 36.6) * (n - tau))
            * (tau / (tau + 0.3))
        )
    if alpha == 0:
        rise = tau * math.sqrt(tau)
        return ((4.1 * n + 0.8) / tau - (3.1 * n + 6.5) / n) * (rise / (rise + 5.2))
    if alpha == -1:
        return (2.0 * n * n - 1.3 * n * tau - 3.5 * tau) / (n * tau) * (tau**3 / (tau**3 + 2.3))
    scaled = 4.4 * n - 1.0
    return (
        (4.4 * n - 2.0)
        / (2.9 * tau)
        * (scaled**2 - 8.6 * tau * scaled + 11.4 * tau**2)
        / (4.4 * n - 3.0) ** 2
    )


_SMALLEST_EDF: Final = 0.5
_LONGEST_FILTERED: Final = 100  # lags beyond which Greenhall and Riley let F grow to infinity
_GAUSS_NODES, _GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(8)
# edf = b T / tau - c: SP1065 Tables 7 and 8.
_TOTAL_COEFFICIENTS: Final = {0: (1.50, 0.0), -1: (1.17, 0.22), -2: (0.93, 0.36)}
_MODIFIED_TOTAL_COEFFICIENTS: Final = {
    2: (1.90, 2.10),
    1: (1.20, 1.40),
    0: (1.10, 1.20),
    -1: (0.85, 0.50),
    -2: (0.75, 0.31),
}
