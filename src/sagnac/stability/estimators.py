"""The Allan family: one table of what each estimator is, and how the total family sums.

A new estimator takes its name in `sagnac.stability.Estimator`, a compiled loop in `_kernels` with a
function that sums by it, a row here, and its definition in plain loops in
``tests/naive_stability.py``.

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

Total and modified total variance, Theo1 and its bias-removed hybrid: SP1065, sections 5.2.11,
5.2.12, 5.2.15 and 5.2.16.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

import numpy as np

from sagnac.core.arrays import FloatArray, IntegerArray, blocks, release
from sagnac.core.errors import Note, require_choice
from sagnac.stability import Estimator, _kernels
from sagnac.stability.freedom import (
    THEO1_EFFECTIVE,
    FreedomLaw,
    finite_difference_freedom,
    modified_total_freedom,
    theo1_freedom,
    total_freedom,
)
from sagnac.stability.sums import (
    Points,
    Track,
    averaged,
    difference_sums,
    mirrored_values,
    modified_sums,
    overlapping_sums,
    plain_sums,
    stride_notes,
    window_stride,
)

# Given the track, the clusters, and how many outer averages of each a whole record has.
Sums = Callable[[Track, IntegerArray, IntegerArray], Points]


def _unchanged(deviation: FloatArray, tau: FloatArray) -> FloatArray:
    return deviation


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
    windows: Callable[[int, int], int]
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

    summed = overlapping_sums if overlapping else plain_sums

    def points(track: Track, clusters: IntegerArray, whole: IntegerArray) -> Points:
        sums, terms = summed(track, clusters, order)
        return averaged(name, track, clusters, sums=sums, terms=terms, whole=whole, divisor=divisor)

    return Properties(
        name=name,
        title=title,
        order=order,
        overlapping=overlapping,
        longest=lambda angles: (angles - 1) // order,
        windows=windows,
        sums=points,
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

    def points(track: Track, clusters: IntegerArray, whole: IntegerArray) -> Points:
        sums, terms = modified_sums(track, clusters)
        return averaged(name, track, clusters, sums=sums, terms=terms, whole=whole, divisor=2.0)

    return Properties(
        name=name,
        title=title,
        longest=lambda angles: angles // 3,
        windows=_windows_of_three,
        sums=points,
        freedom=finite_difference_freedom(order=2, overlapping=True, modified=True),
        finished=finished,
    )


def _starts_of_span(span: int, angles: int) -> int:
    """Starts from which a span of Theo1 fits."""
    return angles - span


def _longest_span(angles: int) -> int:
    """Largest even span of Theo1."""
    return (angles - 1) // 2 * 2


# ---- theo1 -------------------------------------------------------------------------

_ALLAN: Final[Estimator] = "oadev"
_THEO1: Final[Estimator] = "theo1"
_MODIFIED_TOTAL: Final[Estimator] = "mtotdev"
# Share of the record up to which the hybrid is the overlapping Allan deviation.
_ALLAN_SHARE: Final = 0.2
# Ratios that the bias is the mean of, at most.
_BIAS_RATIOS: Final = 48


def theo1_points(track: Track, spans: IntegerArray, whole: IntegerArray) -> Points:
    """Theo1 of even spans m; tau = 0.75 m tau0."""
    variance, windows, strides = _theo1(track.angle, spans)
    return Points(
        tau_samples=THEO1_EFFECTIVE * spans.astype(np.float64),
        variance=variance,
        terms=windows * (spans // 2),
        windows=windows,
        clusters=spans,
        rules=(_THEO1,) * spans.size,
        notes=(
            *stride_notes(_THEO1, strides, spans),
            Note(
                text="theo1 keeps its bias (theoh removes it); taus asked for are its spans m tau0"
            ),
        ),
    )


def theoh_points(track: Track, clusters: IntegerArray, whole: IntegerArray) -> Points:
    """Overlapping Allan up to a fifth of the record, Theo1 less its bias beyond."""
    angle = track.angle
    short = clusters[clusters <= _ALLAN_SHARE * (angle.size - 1)]
    spans = np.unique(2 * np.rint(clusters[short.size :] / (2 * THEO1_EFFECTIVE)).astype(np.int64))
    variance, long, strides = _theo1(angle, spans)
    notes: tuple[Note, ...] = ()
    if spans.size:
        ratio, noticed = _allan_to_theo1(angle)
        variance = variance * ratio
        notes = (*noticed, *stride_notes("theoh", strides, spans))
    windows = angle.size - 2 * short
    return Points(
        tau_samples=np.concatenate((short.astype(np.float64), THEO1_EFFECTIVE * spans)),
        variance=np.concatenate((_overlapping_allan(angle, short), variance)),
        terms=np.concatenate((windows, long * (spans // 2))),
        windows=np.concatenate((windows, long)),
        clusters=np.concatenate((short, spans)),
        rules=(_ALLAN,) * short.size + (_THEO1,) * spans.size,
        notes=notes,
    )


def _theo1(angle: FloatArray, spans: IntegerArray) -> tuple[FloatArray, IntegerArray, list[int]]:
    """(spans,) Theo1 variances, the windows averaged, and their spacing."""
    variance, windows, strides = [], [], []
    mirrored = mirrored_values(angle)
    for m in map(int, spans):
        stride = window_stride(angle.size - m, m // 2, m)
        count = -(-(angle.size - m) // stride)
        total = _kernels.sum_theo1_terms(angle, mirrored, m, stride)
        release()
        variance.append(total / (THEO1_EFFECTIVE * m * m * count))
        windows.append(count)
        strides.append(stride)
    return np.array(variance), np.array(windows, dtype=np.int64), strides


def _overlapping_allan(angle: FloatArray, clusters: IntegerArray) -> FloatArray:
    m = clusters.astype(np.float64)
    sums = difference_sums(angle, clusters)
    return sums / (2.0 * m * m * (angle.size - 2 * clusters))


def _allan_to_theo1(angle: FloatArray) -> tuple[float, tuple[Note, ...]]:
    """Mean ratio of Allan to Theo1 variance at equal tau up to a tenth of the record.

    Allan at m = 9 + 3 i beside Theo1 at 12 + 4 i, i = 0 .. 0.1 N / 3 - 3.
    """
    notes: tuple[Note, ...] = ()
    last = int(0.1 * angle.size / 3.0 - 3.0)
    steps = np.arange(last + 1)
    if steps.size > _BIAS_RATIOS:
        steps = np.unique(np.rint(np.linspace(0, last, _BIAS_RATIOS)).astype(np.int64))
        notes = (
            Note(
                text=f"theoh takes its bias from {steps.size} of {last + 1} ratios, evenly spaced"
            ),
        )
    theo1, *_ = _theo1(angle, 12 + 4 * steps)
    allan = _overlapping_allan(angle, 9 + 3 * steps)
    usable = theo1 > 0.0
    return float(np.mean(allan[usable] / theo1[usable])) if usable.any() else 1.0, notes


# ---- total -------------------------------------------------------------------------


def total_points(track: Track, clusters: IntegerArray, whole: IntegerArray) -> Points:
    """Total variance: second differences centred on every inner sample."""
    sums = _reflected_sums(track.angle, clusters)
    return averaged("totdev", track, clusters, sums=sums, terms=whole, whole=whole, divisor=2.0)


def modified_total_points(track: Track, clusters: IntegerArray, whole: IntegerArray) -> Points:
    """Modified total variance: every window of three clusters, extended by its mirror image."""
    sizes = clusters.tolist()
    strides = [
        window_stride(count, 3 * m, m) for count, m in zip(whole.tolist(), sizes, strict=True)
    ]
    taken = -(-whole // np.array(strides))
    sums = np.array(
        [
            _kernels.sum_modified_total_terms(track.angle, m, stride)
            for m, stride in zip(sizes, strides, strict=True)
        ]
    )
    m = clusters.astype(np.float64)
    return Points(
        tau_samples=m,
        variance=sums / (2.0 * m**4 * taken),
        terms=taken * 6 * clusters,
        windows=taken,
        clusters=clusters,
        rules=(_MODIFIED_TOTAL,) * clusters.size,
        notes=(
            *stride_notes("mtotdev", strides, clusters),
            Note(text="mtotdev keeps its bias: its variance lies below that of mdev"),
        ),
    )


def _reflected_sums(angle: FloatArray, clusters: IntegerArray) -> FloatArray:
    """Sums of squared second differences centred on every inner sample.

    Beyond an end the angle is its point reflection in that end, reached in a mirrored copy of
    the record.
    """
    mirrored = mirrored_values(angle)
    beyond = [_sum_beyond_ends(angle, mirrored, m) for m in clusters.tolist()]
    return np.asarray(difference_sums(angle, clusters) + beyond)


def _sum_beyond_ends(angle: FloatArray, mirrored: FloatArray, cluster: int) -> float:
    """Sum of the squared differences an arm of which, or both, lies beyond an end."""
    last = angle.size - 1
    right = last - cluster  # last centre whose right arm stays inside
    total = 0.0
    # From the first centre to before the last, and whether the arm ahead and the one behind are
    # inside.
    for begin, stop, ahead_inside, behind_inside in (
        (1, min(cluster, right + 1), True, False),
        (max(right + 1, 1), cluster, False, False),
        (max(cluster, right + 1), last, False, True),
    ):
        ahead = angle[begin + cluster :] if ahead_inside else mirrored[begin - right :]
        behind = angle[begin - cluster :] if behind_inside else mirrored[begin + right :]
        ends = (0.0 if behind_inside else angle[0]) + (0.0 if ahead_inside else angle[last])
        signs = [1.0 if inside else -1.0 for inside in (ahead_inside, behind_inside)]
        for block in blocks(stop - begin):
            centre = angle[begin + block.start : begin + block.stop]
            total += _kernels.sum_squared_arms(centre, ahead[block], behind[block], ends, *signs)
    return total


# ---- table -------------------------------------------------------------------------

_ROWS: Final = (
    _difference_row("adev", "Allan", order=2, overlapping=False, divisor=2.0),
    _difference_row("oadev", "overlapping Allan", order=2, overlapping=True, divisor=2.0),
    _modified_row("mdev", "modified Allan"),
    _modified_row("tdev", "time", finished=lambda shown, tau: shown * tau / math.sqrt(3.0)),
    _difference_row("hdev", "Hadamard", order=3, overlapping=False, divisor=6.0),
    _difference_row("ohdev", "overlapping Hadamard", order=3, overlapping=True, divisor=6.0),
    Properties(
        name="totdev",
        title="total",
        whole_record_only=True,
        longest=lambda angles: angles - 1,
        windows=lambda cluster, angles: angles - 2,
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
    require_choice("estimator", estimator, Estimator)
    return ESTIMATORS[estimator]
