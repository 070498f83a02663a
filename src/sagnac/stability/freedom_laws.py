"""Published degrees of freedom of stability variances: one function for each family.

Each law takes the power law of the rate noise, the cluster in samples, the number of accumulated
angles, and the number of outer windows averaged.

References
----------
Greenhall and Riley
    Uncertainty of stability variances based on finite differences, PTTI 2003.
SP1065
    W. J. Riley, Handbook of Frequency Stability Analysis, NIST SP 1065, 2008, section 5.4.
"""

import math
from collections.abc import Callable
from functools import lru_cache
from typing import Final

from sagnac.stability.difference_freedom import inverse_freedom
from sagnac.stability.total import THEO1_EFFECTIVE

# Given noise type, cluster, angles and windows.
FreedomLaw = Callable[[int, int, int, int], float]

_SMALLEST_EDF: Final = 0.5
# Lags beyond which Greenhall and Riley let the filter factor grow to infinity.
_LONGEST_FILTERED: Final = 100
# edf = b T / tau - c: SP1065 Tables 7 and 8.
_TOTAL: Final = {0: (1.50, 0.0), -1: (1.17, 0.22), -2: (0.93, 0.36)}
_MODIFIED_TOTAL: Final = {
    2: (1.90, 2.10),
    1: (1.20, 1.40),
    0: (1.10, 1.20),
    -1: (0.85, 0.50),
    -2: (0.75, 0.31),
}


def finite_difference_freedom(
    *, order: int, overlapping: bool, modified: bool = False
) -> FreedomLaw:
    """Law of an average of squared differences of `order` (Greenhall and Riley)."""

    def law(noise_type: int, cluster: int, angles: int, windows: int) -> float:
        return greenhall_riley_freedom(
            noise_type, cluster, windows, order=order, overlapping=overlapping, modified=modified
        )

    return law


@lru_cache(maxsize=4096)
def greenhall_riley_freedom(
    noise_type: int, cluster: int, windows: int, *, order: int, overlapping: bool, modified: bool
) -> float:
    """Exact degrees of freedom of `windows` squared differences in a row.

    The filter factor F is 1 for modified variances, m for plain ones, and infinite for long
    clusters of rate noise, as in the paper.

    Windows on both sides of a gap are taken as if they stood in one row. That is the safe side:
    apart they are less correlated.

    Parameters
    ----------
    noise_type
        Power law of the rate noise, 2 to -4.
    cluster
        m: tau = m tau0.
    windows
        Squared differences averaged.
    order
        Of the differences, 2 or 3.
    overlapping
        Whether differences start at every sample, or at every m-th.
    modified
        Whether angles are averaged over a cluster first.
    """
    if modified:
        filter_factor = 1.0
    elif noise_type <= 0 and cluster * (order + 1) > _LONGEST_FILTERED:
        filter_factor = math.inf
    else:
        filter_factor = float(cluster)
    return 1.0 / inverse_freedom(
        windows, cluster if overlapping else 1, filter_factor, noise_type, order
    )


def total_freedom(noise_type: int, cluster: int, angles: int, windows: int) -> float:
    """Total variance: SP1065 Table 7, and by counting for angle noise, which it leaves out."""
    alpha = max(noise_type, -2)
    if alpha > 0:
        return _total_freedom_of_angle_noise(cluster, angles)
    slope, offset = _TOTAL[alpha]
    edf = slope * ((angles - 1) / cluster) - offset
    if alpha == 0:
        # The table is for long clusters; Stein's factor for white rate leads up to them.
        edf *= 4.0 * cluster**2 / (4.0 * cluster**2 + 5.0)
    return min(max(edf, _SMALLEST_EDF), _largest_freedom(alpha, angles))


def modified_total_freedom(noise_type: int, cluster: int, angles: int, windows: int) -> float:
    """Modified total variance: SP1065 Table 8."""
    alpha = max(noise_type, -2)
    slope, offset = _MODIFIED_TOTAL[alpha]
    edf = slope * ((angles - 1) / cluster) - offset
    return min(max(edf, _SMALLEST_EDF), _largest_freedom(alpha, angles))


def theo1_freedom(noise_type: int, span: int, angles: int, windows: int) -> float:
    """Theo1: SP1065 Table 9, at its effective cluster time."""
    return max(_theo1_table(max(noise_type, -2), THEO1_EFFECTIVE * span, angles), 1.0)


def _largest_freedom(alpha: int, angles: int) -> float:
    """Degrees of freedom at one sample, which the fits for long clusters run past."""
    return greenhall_riley_freedom(alpha, 1, angles - 2, order=2, overlapping=True, modified=False)


def _total_freedom_of_angle_noise(cluster: int, angles: int) -> float:
    """White angle noise, of which SP1065 gives none: (tr Q)^2 / tr Q^2 of the total variance.

    Counted to leading order: each reflected difference holds an end of the record twice, and
    that one angle, met in every reflected difference, is what rules long clusters.
    """
    n, m = float(angles), float(cluster)
    if 2 * cluster < angles:
        inner = n - 2.0 * m
        return (6.0 * inner + 20.0 * m) ** 2 / (70.0 * inner + 32.0 * m * m + 340.0 * m)
    one, both = n - m, 2.0 * m - n  # differences that hold one end, and both
    return (20.0 * one + 14.0 * both) ** 2 / (32.0 * one**2 + 64.0 * both**2 + 64.0 * one * both)


def _theo1_table(alpha: int, tau: float, angles: int) -> float:
    """SP1065 Table 9, `tau` in samples."""
    n = float(angles)
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
