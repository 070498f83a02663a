"""The Allan family: how each estimator sums its differences."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from sagnac import series
from sagnac.arrays import FloatArray
from sagnac.errors import RecordingError
from sagnac.stability import _kernels
from sagnac.stability.accumulate import Track, mirrored_values
from sagnac.stability.estimators import DIFFERENCES, THEO1_EFFECTIVE, Estimator


@dataclass(frozen=True, slots=True, kw_only=True)
class _Points:
    """Variances per sample interval squared, one for each cluster.

    `windows` counts the outer averages, which rule the degrees of freedom; `terms` all
    squares; `estimators` names the rule of each point.
    """

    tau_samples: FloatArray
    variance: FloatArray
    terms: NDArray[np.int64]
    windows: NDArray[np.int64]
    clusters: NDArray[np.int64]
    estimators: list[Estimator]


def window_count(estimator: Estimator, cluster: int, samples: int) -> int:
    """Outer averages of a whole record, none skipped."""
    if estimator == "adev":
        return (samples - 1) // cluster - 1
    if estimator == "hdev":
        return (samples - 1) // cluster - 2
    if estimator in ("oadev", "haar"):
        return samples - 2 * cluster
    if estimator == "ohdev":
        return samples - 3 * cluster
    if estimator in ("mdev", "tdev", "mtotdev"):
        return samples - 3 * cluster + 1
    if estimator == "totdev":
        return samples - 2
    return samples - cluster


def _difference_points(estimator: Estimator) -> Callable[..., _Points]:
    """Allan and Hadamard variances, plain, overlapping and Haar."""
    order = DIFFERENCES[estimator]
    overlapping = estimator not in ("adev", "hdev")
    divisor = 6.0 if order == 3 else 4.0 if estimator == "haar" else 2.0

    def points(track: Track, clusters: NDArray[np.int64], notes: list[str]) -> _Points:
        if overlapping:
            sums, terms = _overlapping_sums(track, clusters, order)
        else:
            # Plain clusters are overlapping ones of one sample on every m-th angle.
            columns = [_overlapping_sums(_every(track, int(m)), _ONE, order) for m in clusters]
            sums = np.array([column[0] for column, _ in columns])
            terms = np.array([column[0] for _, column in columns])
        return _averaged(
            estimator, track, clusters, sums=sums, terms=terms, divisor=divisor, notes=notes
        )

    return points


def _every(track: Track, step: int) -> Track:
    """Every `step`-th angle."""
    starts = -(-track.starts // step)
    lengths = (track.starts + track.lengths - 1) // step - starts + 1
    return replace(
        track,
        angle=series.every(track.angle, step),
        starts=starts[lengths > 0],
        lengths=lengths[lengths > 0],
    )


def _overlapping_sums(
    track: Track, clusters: NDArray[np.int64], order: int
) -> tuple[FloatArray, NDArray[np.int64]]:
    """Sums and numbers of squared differences that touch no gap."""
    angle = track.angle
    if track.missing and not track.broken:
        # Angles on both sides of a gap belong together.
        sums, terms = np.zeros(clusters.size), np.zeros(clusters.size, dtype=np.int64)
        for span in series.spans(angle.size, _STARTS):
            for j, m in enumerate(map(int, clusters)):
                total, count = _kernels.sum_squared_differences_with_gaps(
                    angle, m, order, span.start, span.stop
                )
                sums[j] += total
                terms[j] += count
            series.release(angle)
        return sums, terms
    kernel = (
        _kernels.sum_squared_second_differences
        if order == 2
        else _kernels.sum_squared_third_differences
    )
    return _stretch_sums(
        track,
        lambda stretch: _difference_sums(kernel, stretch, clusters),
        lambda starts, lengths: _kernels.sum_squared_differences_in_stretches(
            angle, starts, lengths, clusters, order
        ),
    ), _counts(track, order * clusters)


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
    short = track.lengths <= _STARTS
    sums = of_short(track.starts[:0], track.lengths[:0])
    for start, length in zip(track.starts[~short], track.lengths[~short], strict=True):
        sums += of_long(angle[start : start + length])
    starts, lengths = track.starts[short], track.lengths[short]
    for span in series.spans(angle.size):
        first, last = np.searchsorted(starts, (span.start, span.stop))
        if last > first:
            sums += of_short(starts[first:last], lengths[first:last])
            series.release(angle)
    return sums


def _difference_sums(
    kernel: Callable[..., FloatArray], angle: FloatArray, clusters: NDArray[np.int64]
) -> FloatArray:
    """Sums of squared differences from every start, of a mapped angle some starts at a time."""
    sums = np.zeros(clusters.size)
    for span in series.spans(angle.size, _STARTS):
        sums = kernel(angle, clusters, span.start, span.stop, sums)
        series.release(angle)
    return sums


def _window_sums(angle: FloatArray, clusters: NDArray[np.int64]) -> FloatArray:
    """Sums of squared second differences of sums over a cluster, from every start."""
    windows = np.zeros(clusters.size)
    for j, m in enumerate(map(int, clusters)):
        for span in series.spans(m if 3 * m <= angle.size else 0, _STARTS):
            windows[j] = _kernels.window_difference(
                angle, m, span.start, span.stop, float(windows[j])
            )
            series.release(angle)
    sums = windows**2
    for span in series.spans(angle.size, _STARTS):
        sums, windows = _kernels.sum_squared_window_differences(
            angle, clusters, span.start, span.stop, sums, windows
        )
        series.release(angle)
    return sums


def _reflected_sums(angle: FloatArray, clusters: NDArray[np.int64]) -> FloatArray:
    """Sums of squared second differences centred on every inner sample.

    Beyond an end the angle is its point reflection in that end, reached in a mirrored copy of
    the record.
    """
    sums = _difference_sums(_kernels.sum_squared_second_differences, angle, clusters)
    mirrored = mirrored_values(angle)
    last = angle.size - 1
    first_end, last_end = float(angle[0]), float(angle[last])
    for j, m in enumerate(map(int, clusters)):
        right = last - m  # last centre whose right arm stays inside
        # Centres whose left arm, whose both arms, and whose right arm are reflected.
        left, both, rest = 1, max(right + 1, 1), max(m, right + 1)
        parts = (
            (
                left,
                min(m, right + 1),
                angle[left + m :],
                mirrored[left + right :],
                first_end,
                1,
                -1,
            ),
            (
                both,
                m,
                mirrored[both - right :],
                mirrored[both + right :],
                first_end + last_end,
                -1,
                -1,
            ),
            (rest, last, mirrored[rest - right :], angle[rest - m :], last_end, -1, 1),
        )
        for begin, stop, ahead, behind, ends, sign_ahead, sign_behind in parts:
            for span in series.spans(max(stop - begin, 0)):
                sums[j] += _kernels.sum_squared_arms(
                    angle[begin + span.start : begin + span.stop],
                    ahead[span],
                    behind[span],
                    ends,
                    float(sign_ahead),
                    float(sign_behind),
                )
                series.release(angle, mirrored)
    return sums


def _whole_counts(
    estimator: Estimator, clusters: NDArray[np.int64], samples: int
) -> NDArray[np.int64]:
    return np.array([window_count(estimator, int(m), samples) for m in clusters], dtype=np.int64)


def _modified_points(estimator: Estimator) -> Callable[..., _Points]:
    def points(track: Track, clusters: NDArray[np.int64], notes: list[str]) -> _Points:
        sums = _stretch_sums(
            track,
            lambda stretch: _window_sums(stretch, clusters),
            lambda starts, lengths: _kernels.sum_squared_window_differences_in_stretches(
                track.angle, starts, lengths, clusters
            ),
        )
        terms = _counts(track, 3 * clusters - 1)
        return _averaged(
            estimator,
            track,
            clusters,
            sums=sums / clusters.astype(np.float64) ** 2,
            terms=terms,
            divisor=2.0,
            notes=notes,
        )

    return points


def _averaged(
    estimator: Estimator,
    track: Track,
    clusters: NDArray[np.int64],
    *,
    sums: FloatArray,
    terms: NDArray[np.int64],
    divisor: float,
    notes: list[str],
) -> _Points:
    """Means of squared differences over 2 m^2 (6 m^2 for Hadamard), less what gaps took."""
    kept = terms > 0
    if not kept.any():
        raise RecordingError(
            f"values: the gaps leave no term of {estimator} at any tau asked for; ask for shorter"
        )
    if track.missing:
        whole = _whole_counts(estimator, clusters, track.angle.size)
        lost = whole - terms
        notes.append(
            f"gaps left out {int(lost.sum())} of {int(whole.sum())} terms, "
            f"at most {100.0 * float((lost / whole).max()):.3g} % of those at one tau"
        )
        if not kept.all():
            notes.append(f"{int((~kept).sum())} taus have no term free of gaps and are left out")
    m = clusters[kept].astype(np.float64)
    return _Points(
        tau_samples=m,
        variance=sums[kept] / (divisor * m * m * terms[kept]),
        terms=terms[kept],
        windows=terms[kept],
        clusters=clusters[kept],
        estimators=[estimator] * int(kept.sum()),
    )


def _total_points(track: Track, clusters: NDArray[np.int64], notes: list[str]) -> _Points:
    """Total variance, SP1065 section 5.2.11."""
    return _averaged(
        "totdev",
        track,
        clusters,
        sums=_reflected_sums(track.angle, clusters),
        terms=_whole_counts("totdev", clusters, track.angle.size),
        divisor=2.0,
        notes=notes,
    )


def _modified_total_points(track: Track, clusters: NDArray[np.int64], notes: list[str]) -> _Points:
    """Modified total variance, SP1065 section 5.2.12."""
    whole = _whole_counts("mtotdev", clusters, track.angle.size)
    strides = [_stride(int(w), 3 * int(m), int(m)) for w, m in zip(whole, clusters, strict=True)]
    windows = -(-whole // np.array(strides))
    sums = np.array(
        [
            _kernels.sum_modified_total_terms(track.angle, int(m), stride)
            for m, stride in zip(clusters, strides, strict=True)
        ]
    )
    m = clusters.astype(np.float64)
    _note_strides("mtotdev", strides, clusters, notes)
    notes.append("mtotdev keeps its bias: its variance lies below that of mdev")
    return _Points(
        tau_samples=m,
        variance=sums / (2.0 * m**4 * windows),
        terms=windows * 6 * clusters,
        windows=windows,
        clusters=clusters,
        estimators=["mtotdev"] * clusters.size,
    )


def _theo1_points(track: Track, spans: NDArray[np.int64], notes: list[str]) -> _Points:
    """Theo1, SP1065 section 5.2.15, of even spans m; tau = 0.75 m tau0."""
    variance, windows, strides = _theo1_variances(track.angle, spans)
    _note_strides("theo1", strides, spans, notes)
    notes.append("theo1 keeps its bias (theoh removes it); taus asked for are its spans m tau0")
    return _Points(
        tau_samples=THEO1_EFFECTIVE * spans.astype(np.float64),
        variance=variance,
        terms=windows * (spans // 2),
        windows=windows,
        clusters=spans,
        estimators=["theo1"] * spans.size,
    )


def _theo1_variances(
    angle: FloatArray, spans: NDArray[np.int64]
) -> tuple[FloatArray, NDArray[np.int64], list[int]]:
    variance, windows, strides = [], [], []
    mirrored = mirrored_values(angle)
    for m in map(int, spans):
        stride = _stride(angle.size - m, m // 2, m)
        count = -(-(angle.size - m) // stride)
        total = _kernels.sum_theo1_terms(angle, mirrored, m, stride)
        series.release(angle, mirrored)
        variance.append(total / (THEO1_EFFECTIVE * m * m * count))
        windows.append(count)
        strides.append(stride)
    return np.array(variance), np.array(windows, dtype=np.int64), strides


def _theoh_points(track: Track, clusters: NDArray[np.int64], notes: list[str]) -> _Points:
    """Bias-removed hybrid: OADEV up to a fifth of the record, Theo1 less its bias beyond."""
    angle = track.angle
    short = clusters[clusters <= _THEOH_ALLAN_SHARE * (angle.size - 1)]
    spans = np.unique(2 * np.rint(clusters[short.size :] / (2 * THEO1_EFFECTIVE)).astype(np.int64))
    variance, windows, strides = _theo1_variances(angle, spans)
    if spans.size:
        variance = variance * _theo1_bias_removal(angle, notes)
        _note_strides("theoh", strides, spans, notes)
    return _Points(
        tau_samples=np.concatenate((short.astype(np.float64), THEO1_EFFECTIVE * spans)),
        variance=np.concatenate((_overlapping_allan(angle, short), variance)),
        terms=np.concatenate((angle.size - 2 * short, windows * (spans // 2))),
        windows=np.concatenate((angle.size - 2 * short, windows)),
        clusters=np.concatenate((short, spans)),
        estimators=["oadev" if i < short.size else "theo1" for i in range(short.size + spans.size)],
    )


def _overlapping_allan(angle: FloatArray, clusters: NDArray[np.int64]) -> FloatArray:
    m = clusters.astype(np.float64)
    sums = _difference_sums(_kernels.sum_squared_second_differences, angle, clusters)
    return sums / (2.0 * m * m * (angle.size - 2 * clusters))


def _theo1_bias_removal(angle: FloatArray, notes: list[str]) -> float:
    """Mean ratio of Allan to Theo1 variance at equal tau up to a tenth of the record.

    Allan at m = 9 + 3 i beside Theo1 at 12 + 4 i, i = 0 .. 0.1 N / 3 - 3.
    """
    last = int(0.1 * angle.size / 3.0 - 3.0)
    steps = np.arange(last + 1)
    if steps.size > _BIAS_RATIOS:
        steps = np.unique(np.rint(np.linspace(0, last, _BIAS_RATIOS)).astype(np.int64))
        notes.append(f"theoh takes its bias from {steps.size} of {last + 1} ratios, evenly spaced")
    theo1, _, _ = _theo1_variances(angle, 12 + 4 * steps)
    allan = _overlapping_allan(angle, 9 + 3 * steps)
    usable = theo1 > 0.0
    return float(np.mean(allan[usable] / theo1[usable])) if usable.any() else 1.0


def _stride(windows: int, squares: int, cluster: int) -> int:
    """Spacing of the outer windows that bounds the work at one tau.

    Windows an eighth of a cluster apart are so correlated that skipping between them costs
    next to nothing, so it is never wider.
    """
    return min(max(1, math.ceil(windows * squares / _LARGEST_WORK)), max(1, cluster // 8))


def _note_strides(
    estimator: Estimator, strides: Sequence[int], clusters: NDArray[np.int64], notes: list[str]
) -> None:
    skipped = [(int(m), s) for m, s in zip(clusters, strides, strict=True) if s > 1]
    if skipped:
        widest = max(s / m for m, s in skipped)
        notes.append(
            f"{estimator} averages every k-th window at {len(skipped)} of {len(strides)} taus, "
            f"k = {min(s for _, s in skipped)} to {max(s for _, s in skipped)}, "
            f"at most {widest:.2g} of a cluster"
        )


_THEOH_ALLAN_SHARE: Final = 0.2
_BIAS_RATIOS: Final = 48
_LARGEST_WORK: Final = 3e7  # squares at one tau before windows are skipped
_ONE: Final = np.ones(1, dtype=np.int64)
# Starts worked on before the memory of a mapped angle is given back: half a megabyte of it beside
# each of some hundred places. A multiple of the kernels' block.
_STARTS: Final = 2**16
POINTS: Final[dict[Estimator, Callable[..., _Points]]] = {
    "adev": _difference_points("adev"),
    "oadev": _difference_points("oadev"),
    "haar": _difference_points("haar"),
    "hdev": _difference_points("hdev"),
    "ohdev": _difference_points("ohdev"),
    "mdev": _modified_points("mdev"),
    "tdev": _modified_points("tdev"),
    "totdev": _total_points,
    "mtotdev": _modified_total_points,
    "theo1": _theo1_points,
    "theoh": _theoh_points,
}
