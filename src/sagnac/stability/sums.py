"""How the finite-difference estimators of the Allan family sum their differences.

An estimator's `sums` takes the track and the clusters and gives `Points`: plain, overlapping and
modified variances here, the total family in `total`, Theo1 in `theo1`.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from sagnac import series
from sagnac.arrays import FloatArray
from sagnac.errors import Note, RecordingError, rounded
from sagnac.stability import _kernels
from sagnac.stability.accumulate import Track
from sagnac.stability.names import Estimator

# Starts worked on at once: of a mapped angle, an eighth of a megabyte beside each of some hundred
# places. A multiple of the kernels' block, so that the sums of the parts are those of the whole.
STARTS: Final = 2**14
# Angles in a stretch up to which many stretches go through the kernels at a time.
_SHORT: Final = 2**16
_ONE: Final = np.ones(1, dtype=np.int64)


@dataclass(frozen=True, slots=True, kw_only=True)
class Points:
    """Result of an estimator: one variance for each cluster.

    Attributes
    ----------
    tau_samples
        (points,) cluster times in sample intervals.
    variance
        (points,) per sample interval squared.
    terms
        (points,) squares averaged.
    windows
        (points,) outer averages, which rule the degrees of freedom.
    clusters
        (points,) clusters in samples; the span for Theo1.
    rules
        The estimator whose degrees of freedom each point has.
    notes
        What was noticed.
    """

    tau_samples: FloatArray
    variance: FloatArray
    terms: NDArray[np.int64]
    windows: NDArray[np.int64]
    clusters: NDArray[np.int64]
    rules: tuple[Estimator, ...]
    notes: tuple[Note, ...] = ()


Sums = Callable[[Track, NDArray[np.int64]], Points]
Windows = Callable[[int, int], int]


def overlapping_points(name: Estimator, *, order: int, divisor: float, windows: Windows) -> Sums:
    """Means of squared differences of `order` from every start, over `divisor` m^2."""

    def points(track: Track, clusters: NDArray[np.int64]) -> Points:
        sums, terms = _overlapping_sums(track, clusters, order)
        whole = whole_counts(windows, clusters, track.angle.size)
        return averaged(name, track, clusters, sums=sums, terms=terms, whole=whole, divisor=divisor)

    return points


def plain_points(name: Estimator, *, order: int, divisor: float, windows: Windows) -> Sums:
    """Means of squared differences of `order` from every m-th start, over `divisor` m^2."""

    def points(track: Track, clusters: NDArray[np.int64]) -> Points:
        # Plain clusters are overlapping ones of one sample on every m-th angle.
        columns = [_overlapping_sums(track.every(int(m)), _ONE, order) for m in clusters]
        sums = np.array([column[0] for column, _ in columns])
        terms = np.array([column[0] for _, column in columns])
        whole = whole_counts(windows, clusters, track.angle.size)
        return averaged(name, track, clusters, sums=sums, terms=terms, whole=whole, divisor=divisor)

    return points


def modified_points(name: Estimator, *, windows: Windows) -> Sums:
    """Modified Allan variance: squares of second differences of means over a cluster."""

    def points(track: Track, clusters: NDArray[np.int64]) -> Points:
        sums = _stretch_sums(
            track,
            lambda stretch: _window_sums(stretch, clusters),
            lambda starts, lengths: _kernels.sum_squared_window_differences_in_stretches(
                track.angle, starts, lengths, clusters
            ),
        )
        return averaged(
            name,
            track,
            clusters,
            sums=sums / clusters.astype(np.float64) ** 2,
            terms=_counts(track, 3 * clusters - 1),
            whole=whole_counts(windows, clusters, track.angle.size),
            divisor=2.0,
        )

    return points


def averaged(
    name: Estimator,
    track: Track,
    clusters: NDArray[np.int64],
    *,
    sums: FloatArray,
    terms: NDArray[np.int64],
    whole: NDArray[np.int64],
    divisor: float,
) -> Points:
    """Means of squared differences over `divisor` m^2, less what gaps took.

    Parameters
    ----------
    name
        Of the estimator.
    track, clusters
        What was summed.
    sums, terms
        (clusters,) sums of squares, and how many.
    whole
        (clusters,) how many there would be without gaps.
    divisor
        2 for Allan, 6 for Hadamard.

    Raises
    ------
    RecordingError
        If no term is left.
    """
    kept = terms > 0
    if not kept.any():
        raise RecordingError(
            f"the gaps leave no term of {name} at any tau asked for",
            channel="values",
            remedy="ask for shorter",
        )
    m = clusters[kept].astype(np.float64)
    return Points(
        tau_samples=m,
        variance=sums[kept] / (divisor * m * m * terms[kept]),
        terms=terms[kept],
        windows=terms[kept],
        clusters=clusters[kept],
        rules=(name,) * int(kept.sum()),
        notes=_gap_notes(whole, terms) if track.missing else (),
    )


def _gap_notes(whole: NDArray[np.int64], terms: NDArray[np.int64]) -> tuple[Note, ...]:
    lost = whole - terms
    note = Note(
        text=f"gaps left out {int(lost.sum())} of {int(whole.sum())} terms, "
        f"at most {rounded(100.0 * float((lost / whole).max()), 3)} % of those at one tau"
    )
    empty = int(np.count_nonzero(terms <= 0))
    if not empty:
        return (note,)
    return note, Note(text=f"{empty} taus have no term free of gaps and are left out")


def whole_counts(windows: Windows, clusters: NDArray[np.int64], angles: int) -> NDArray[np.int64]:
    """Outer averages of a whole record at each cluster, none skipped."""
    return np.array([windows(int(m), angles) for m in clusters], dtype=np.int64)


def second_difference_sums(angle: FloatArray, clusters: NDArray[np.int64]) -> FloatArray:
    """Sums over every start of squared second differences, for each cluster."""
    return _difference_sums(_kernels.sum_squared_second_differences, angle, clusters)


def _difference_sums(
    kernel: Callable[..., FloatArray], angle: FloatArray, clusters: NDArray[np.int64]
) -> FloatArray:
    return series.reduce(
        lambda sums, block: kernel(angle, clusters, block.start, block.stop, sums),
        np.zeros(clusters.size),
        angle.size,
        angle,
        length=STARTS,
    )


def _overlapping_sums(
    track: Track, clusters: NDArray[np.int64], order: int
) -> tuple[FloatArray, NDArray[np.int64]]:
    """Sums and numbers of squared differences that touch no gap."""
    if track.missing and not track.broken:
        # Angles on both sides of a gap belong together.
        return _sums_across_gaps(track.angle, clusters, order)
    kernel = (
        _kernels.sum_squared_second_differences
        if order == 2
        else _kernels.sum_squared_third_differences
    )
    return _stretch_sums(
        track,
        lambda stretch: _difference_sums(kernel, stretch, clusters),
        lambda starts, lengths: _kernels.sum_squared_differences_in_stretches(
            track.angle, starts, lengths, clusters, order
        ),
    ), _counts(track, order * clusters)


def _sums_across_gaps(
    angle: FloatArray, clusters: NDArray[np.int64], order: int
) -> tuple[FloatArray, NDArray[np.int64]]:
    """Sums and numbers of squared differences none of whose angles is missing."""
    State = tuple[FloatArray, NDArray[np.int64]]

    def add(state: State, block: slice) -> State:
        parts = [
            _kernels.sum_squared_differences_with_gaps(
                angle, int(m), order, block.start, block.stop
            )
            for m in clusters
        ]
        return (
            state[0] + np.array([total for total, _ in parts]),
            state[1] + np.array([count for _, count in parts], dtype=np.int64),
        )

    start = np.zeros(clusters.size), np.zeros(clusters.size, dtype=np.int64)
    return series.reduce(add, start, angle.size, angle, length=STARTS)


def _counts(track: Track, reaches: NDArray[np.int64]) -> NDArray[np.int64]:
    """Terms that lie in one stretch each, by how far on the last angle of a term is."""
    return np.array(
        [np.maximum(track.lengths - reach, 0).sum() for reach in reaches], dtype=np.int64
    )


def _stretch_sums(
    track: Track,
    of_long: Callable[[FloatArray], FloatArray],
    of_short: Callable[[NDArray[np.int64], NDArray[np.int64]], FloatArray],
) -> FloatArray:
    """Sums over all stretches, the long ones one by one, the short ones many at a time."""
    angle = track.angle
    short = track.lengths <= _SHORT
    sums = of_short(track.starts[:0], track.lengths[:0])
    for start, length in zip(track.starts[~short], track.lengths[~short], strict=True):
        sums += of_long(angle[start : start + length])
    starts, lengths = track.starts[short], track.lengths[short]

    def add(sums: FloatArray, block: slice) -> FloatArray:
        first, last = np.searchsorted(starts, (block.start, block.stop))
        return sums + of_short(starts[first:last], lengths[first:last]) if last > first else sums

    return series.reduce(add, sums, angle.size, angle)


def _window_sums(angle: FloatArray, clusters: NDArray[np.int64]) -> FloatArray:
    """Sums of squared second differences of sums over a cluster, from every start."""
    windows = np.array([_first_window(angle, int(m)) for m in clusters])
    sums, _ = series.reduce(
        lambda state, block: _kernels.sum_squared_window_differences(
            angle, clusters, block.start, block.stop, *state
        ),
        (windows**2, windows),
        angle.size,
        angle,
        length=STARTS,
    )
    return np.asarray(sums)


def _first_window(angle: FloatArray, cluster: int) -> float:
    """Sum of the first `cluster` second differences, or zero if they do not fit."""
    return series.reduce(
        lambda window, block: float(
            _kernels.window_difference(angle, cluster, block.start, block.stop, window)
        ),
        0.0,
        cluster if 3 * cluster <= angle.size else 0,
        angle,
        length=STARTS,
    )
