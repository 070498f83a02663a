"""Total and modified total variance, Theo1 and its bias-removed hybrid.

SP1065, sections 5.2.11, 5.2.12, 5.2.15 and 5.2.16.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from sagnac.arrays import FloatArray, blocks, release
from sagnac.errors import Note
from sagnac.stability import _kernels
from sagnac.stability.names import Estimator
from sagnac.stability.sums import (
    Points,
    Track,
    averaged,
    difference_sums,
    mirrored_values,
    stride_notes,
    window_stride,
)

# ---- theo1 -------------------------------------------------------------------------

_ALLAN: Final[Estimator] = "oadev"
_THEO1: Final[Estimator] = "theo1"
# Effective cluster time of Theo1 as a share of its span.
THEO1_EFFECTIVE: Final = 0.75
# Share of the record up to which the hybrid is the overlapping Allan deviation.
_ALLAN_SHARE: Final = 0.2
# Ratios that the bias is the mean of, at most.
_BIAS_RATIOS: Final = 48


def theo1_points(track: Track, spans: NDArray[np.int64], whole: NDArray[np.int64]) -> Points:
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


def theoh_points(track: Track, clusters: NDArray[np.int64], whole: NDArray[np.int64]) -> Points:
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


def _theo1(
    angle: FloatArray, spans: NDArray[np.int64]
) -> tuple[FloatArray, NDArray[np.int64], list[int]]:
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


def _overlapping_allan(angle: FloatArray, clusters: NDArray[np.int64]) -> FloatArray:
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

_MODIFIED_TOTAL: Final[Estimator] = "mtotdev"


def total_points(track: Track, clusters: NDArray[np.int64], whole: NDArray[np.int64]) -> Points:
    """Total variance: second differences centred on every inner sample."""
    sums = _reflected_sums(track.angle, clusters)
    return averaged("totdev", track, clusters, sums=sums, terms=whole, whole=whole, divisor=2.0)


def modified_total_points(
    track: Track, clusters: NDArray[np.int64], whole: NDArray[np.int64]
) -> Points:
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
            *stride_notes(_MODIFIED_TOTAL, strides, clusters),
            Note(text="mtotdev keeps its bias: its variance lies below that of mdev"),
        ),
    )


def _reflected_sums(angle: FloatArray, clusters: NDArray[np.int64]) -> FloatArray:
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
