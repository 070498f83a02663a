"""Total and modified total variance: differences beyond the ends of the record.

SP1065, sections 5.2.11 and 5.2.12.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from sagnac import series
from sagnac.arrays import FloatArray
from sagnac.errors import Note
from sagnac.stability import _kernels
from sagnac.stability.accumulate import Track, mirrored_values
from sagnac.stability.names import Estimator
from sagnac.stability.strides import stride_notes, window_stride
from sagnac.stability.sums import (
    Points,
    Sums,
    Windows,
    averaged,
    second_difference_sums,
    whole_counts,
)

_MODIFIED_TOTAL: Final[Estimator] = "mtotdev"


def total_points(*, windows: Windows) -> Sums:
    """Total variance: second differences centred on every inner sample."""

    def points(track: Track, clusters: NDArray[np.int64]) -> Points:
        whole = whole_counts(windows, clusters, track.angle.size)
        sums = _reflected_sums(track.angle, clusters)
        return averaged("totdev", track, clusters, sums=sums, terms=whole, whole=whole, divisor=2.0)

    return points


def modified_total_points(*, windows: Windows) -> Sums:
    """Modified total variance: every window of three clusters, extended by its mirror image."""

    def points(track: Track, clusters: NDArray[np.int64]) -> Points:
        whole = whole_counts(windows, clusters, track.angle.size)
        strides = [
            window_stride(int(count), 3 * int(m), int(m))
            for count, m in zip(whole, clusters, strict=True)
        ]
        taken = -(-whole // np.array(strides))
        sums = np.array(
            [
                _kernels.sum_modified_total_terms(track.angle, int(m), stride)
                for m, stride in zip(clusters, strides, strict=True)
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

    return points


@dataclass(frozen=True, slots=True, kw_only=True)
class _Reflected:
    """Centres from `begin` to before `stop`, an arm of which, or both, lies beyond an end.

    `ahead` and `behind` hold the angles that the two arms reach, with the signs that their
    reflection gives them; `ends` is the sum of the end angles that are reflected in.
    """

    begin: int
    stop: int
    ahead: FloatArray
    behind: FloatArray
    ends: float
    sign_ahead: float
    sign_behind: float


def _reflected_sums(angle: FloatArray, clusters: NDArray[np.int64]) -> FloatArray:
    """Sums of squared second differences centred on every inner sample.

    Beyond an end the angle is its point reflection in that end, reached in a mirrored copy of
    the record.
    """
    sums = second_difference_sums(angle, clusters)
    mirrored = mirrored_values(angle)
    for j, m in enumerate(map(int, clusters)):
        for part in _reflected_parts(angle, mirrored, m):
            sums[j] = _added_arms(float(sums[j]), angle, mirrored, part)
    return sums


def _reflected_parts(
    angle: FloatArray, mirrored: FloatArray, cluster: int
) -> tuple[_Reflected, _Reflected, _Reflected]:
    """Centres whose left arm, whose both arms, and whose right arm are reflected."""
    last = angle.size - 1
    right = last - cluster  # last centre whose right arm stays inside
    first_end, last_end = float(angle[0]), float(angle[last])
    left, both, rest = 1, max(right + 1, 1), max(cluster, right + 1)
    return (
        _Reflected(
            begin=left,
            stop=min(cluster, right + 1),
            ahead=angle[left + cluster :],
            behind=mirrored[left + right :],
            ends=first_end,
            sign_ahead=1.0,
            sign_behind=-1.0,
        ),
        _Reflected(
            begin=both,
            stop=cluster,
            ahead=mirrored[both - right :],
            behind=mirrored[both + right :],
            ends=first_end + last_end,
            sign_ahead=-1.0,
            sign_behind=-1.0,
        ),
        _Reflected(
            begin=rest,
            stop=last,
            ahead=mirrored[rest - right :],
            behind=angle[rest - cluster :],
            ends=last_end,
            sign_ahead=-1.0,
            sign_behind=1.0,
        ),
    )


def _added_arms(total: float, angle: FloatArray, mirrored: FloatArray, part: _Reflected) -> float:
    """`total` and the squares of `part`."""

    def add(total: float, block: slice) -> float:
        squares = _kernels.sum_squared_arms(
            angle[part.begin + block.start : part.begin + block.stop],
            part.ahead[block],
            part.behind[block],
            part.ends,
            part.sign_ahead,
            part.sign_behind,
        )
        return total + float(squares)

    return series.reduce(add, total, max(part.stop - part.begin, 0), angle, mirrored)
