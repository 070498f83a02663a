"""The Allan family: one table of what each estimator is.

A new estimator takes its name in `names.Estimator`, a compiled loop in `_kernels` with a function
that sums by it, a row here, and its definition in plain loops in ``tests/naive_stability.py``.

==========  =====================================  =====  ===========  ====================
name        deviation                              order  overlapping  degrees of freedom
==========  =====================================  =====  ===========  ====================
adev        Allan                                  2      no           Greenhall and Riley
oadev       overlapping Allan                      2      yes          Greenhall and Riley
mdev        modified Allan                         2      yes          Greenhall and Riley
tdev        time, tau mdev / sqrt(3)               2      yes          Greenhall and Riley
hdev        Hadamard                               3      no           Greenhall and Riley
ohdev       overlapping Hadamard                   3      yes          Greenhall and Riley
totdev      total                                  2      yes          SP1065 Table 7
mtotdev     modified total                         2      yes          SP1065 Table 8
theo1       Theo1                                  2      yes          SP1065 Table 9
theoh       oadev, then Theo1 less its bias        2      yes          SP1065 Table 9
haar        Haar wavelet, oadev / sqrt(2)          2      yes          Greenhall and Riley
==========  =====================================  =====  ===========  ====================
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

import numpy as np

from sagnac.arrays import FloatArray, IntegerArray
from sagnac.stability.freedom import (
    FreedomLaw,
    finite_difference_freedom,
    modified_total_freedom,
    theo1_freedom,
    total_freedom,
)
from sagnac.stability.names import Estimator, Gaps, check_choice
from sagnac.stability.sums import (
    Points,
    Sums,
    Track,
    Windows,
    modified_points,
    overlapping_points,
    plain_points,
)
from sagnac.stability.total import (
    THEO1_EFFECTIVE,
    modified_total_points,
    theo1_points,
    theoh_points,
    total_points,
)

__all__ = ["ESTIMATORS", "Estimator", "Gaps", "Properties", "check_choice", "properties_of"]


def _unchanged(deviation: FloatArray, tau: FloatArray) -> FloatArray:
    return deviation


def _time_deviation(deviation: FloatArray, tau: FloatArray) -> FloatArray:
    return np.asarray(deviation * tau / math.sqrt(3.0))


@dataclass(frozen=True, slots=True, kw_only=True)
class Properties:
    """Properties of one estimator.

    Attributes
    ----------
    name, title
        As arguments name it, and in words.
    order
        Of the differences of the angle.
    overlapping
        Whether differences start at every sample, or at every m-th.
    whole_record_only
        Whether it takes no record with gaps.
    shortest
        Smallest cluster, in samples.
    longest
        Largest cluster by the number of accumulated angles.
    windows
        Outer averages of a whole record, by cluster and number of angles.
    sums
        Track and clusters to variances.
    freedom
        Degrees of freedom by noise type, cluster, angles and windows.
    fewest_angles
        Angles below which it gives nothing.
    step
        Clusters are multiples of it.
    octaves
        Whether the default clusters are the powers of two.
    finished
        From the root of the variance and tau to the deviation shown.
    """

    name: Estimator
    title: str
    longest: Callable[[int], int]
    windows: Windows
    sums: Sums
    freedom: FreedomLaw
    order: int = 2
    overlapping: bool = True
    whole_record_only: bool = False
    shortest: int = 1
    fewest_angles: int = 0
    step: int = 1
    octaves: bool = False
    finished: Callable[[FloatArray, FloatArray], FloatArray] = _unchanged

    def __post_init__(self) -> None:
        check_choice("name", self.name, Estimator)
        if self.order not in (2, 3):
            raise ValueError(f"order is {self.order}; the kernels take differences of 2 or 3")

    def points(self, track: Track, clusters: IntegerArray) -> Points:
        """Its variance at each cluster."""
        whole = [self.windows(m, track.angle.size) for m in clusters.tolist()]
        return self.sums(track, clusters, np.array(whole, dtype=np.int64))

    @property
    def lowest_exponent(self) -> int:
        """Steepest power law of the rate noise for which it converges."""
        return -2 if self.order == 2 else -4


def _difference_row(
    name: Estimator,
    title: str,
    *,
    order: int,
    overlapping: bool,
    divisor: float,
    octaves: bool = False,
) -> Properties:
    """Plain or overlapping averages of squared differences over `divisor` m^2."""

    def windows(cluster: int, angles: int) -> int:
        if overlapping:
            return angles - order * cluster
        return (angles - 1) // cluster - (order - 1)

    points = overlapping_points if overlapping else plain_points
    return Properties(
        name=name,
        title=title,
        order=order,
        overlapping=overlapping,
        longest=lambda angles: (angles - 1) // order,
        windows=windows,
        sums=points(name, order=order, divisor=divisor),
        freedom=finite_difference_freedom(order=order, overlapping=overlapping),
        octaves=octaves,
    )


def _windows_of_three(cluster: int, angles: int) -> int:
    """Windows of three clusters."""
    return angles - 3 * cluster + 1


def _modified_row(
    name: Estimator,
    title: str,
    *,
    finished: Callable[[FloatArray, FloatArray], FloatArray] = _unchanged,
) -> Properties:
    """Averages of squared second differences of angles averaged over a cluster."""
    return Properties(
        name=name,
        title=title,
        longest=lambda angles: angles // 3,
        windows=_windows_of_three,
        sums=modified_points(name),
        freedom=finite_difference_freedom(order=2, overlapping=True, modified=True),
        finished=finished,
    )


def _inner_angles(cluster: int, angles: int) -> int:
    """Centres of total differences, whatever the cluster."""
    return angles - 2


def _starts_of_span(span: int, angles: int) -> int:
    """Starts from which a span of Theo1 fits."""
    return angles - span


def _longest_span(angles: int) -> int:
    """Largest even span of Theo1."""
    return (angles - 1) // 2 * 2


_ROWS: Final = (
    _difference_row("adev", "Allan", order=2, overlapping=False, divisor=2.0),
    _difference_row("oadev", "overlapping Allan", order=2, overlapping=True, divisor=2.0),
    _modified_row("mdev", "modified Allan"),
    _modified_row("tdev", "time", finished=_time_deviation),
    _difference_row("hdev", "Hadamard", order=3, overlapping=False, divisor=6.0),
    _difference_row("ohdev", "overlapping Hadamard", order=3, overlapping=True, divisor=6.0),
    Properties(
        name="totdev",
        title="total",
        whole_record_only=True,
        longest=lambda angles: angles - 1,
        windows=_inner_angles,
        sums=total_points,
        freedom=total_freedom,
    ),
    Properties(
        name="mtotdev",
        title="modified total",
        whole_record_only=True,
        longest=lambda angles: angles // 3,
        windows=_windows_of_three,
        sums=modified_total_points,
        freedom=modified_total_freedom,
    ),
    Properties(
        name="theo1",
        title="Theo1",
        whole_record_only=True,
        shortest=10,
        longest=_longest_span,
        windows=_starts_of_span,
        sums=theo1_points,
        freedom=theo1_freedom,
        step=2,
    ),
    Properties(
        name="theoh",
        title="overlapping Allan and bias-removed Theo1",
        whole_record_only=True,
        longest=lambda angles: int(THEO1_EFFECTIVE * _longest_span(angles)),
        windows=_starts_of_span,
        sums=theoh_points,
        freedom=theo1_freedom,
        fewest_angles=90,  # the first ratio to Allan needs 0.1 N / 3 - 3 >= 0
    ),
    _difference_row("haar", "Haar wavelet", order=2, overlapping=True, divisor=4.0, octaves=True),
)
ESTIMATORS: Final[Mapping[Estimator, Properties]] = MappingProxyType(
    {row.name: row for row in _ROWS}
)


def properties_of(estimator: Estimator) -> Properties:
    """The row of the table.

    Raises
    ------
    ValueError
        If there is no such estimator.
    """
    check_choice("estimator", estimator, Estimator)
    return ESTIMATORS[estimator]
