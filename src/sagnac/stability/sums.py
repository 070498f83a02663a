"""How the finite-difference estimators of the Allan family sum their differences.

The accumulated angle is made in one pass, with gaps or without; windows are skipped if taking every
one would cost too much. Plain, overlapping and modified variances are summed here, the total family
and Theo1 in `estimators`.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from sagnac.core.arrays import (
    BooleanArray,
    FloatArray,
    IntegerArray,
    blocks,
    elementwise,
    empty,
    every,
    mean,
)
from sagnac.core.errors import Note, RecordingError, rounded
from sagnac.recording.channel import first_of, marked, number_of
from sagnac.recording.model import Kind
from sagnac.stability import Estimator, Gaps, _kernels

# ---- accumulate --------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class Track:
    """Accumulated angle without its constant rate, and where it is whole.

    Attributes
    ----------
    angle
        (angles,), a series, in the unit of the samples (times one sample interval for rates).
    starts, lengths
        (stretches,) first angle and number of angles of each whole stretch.
    missing
        Samples that are missing.
    broken
        Whether the sum of rates or increments is interrupted at each gap, so that the angles of
        two stretches have nothing to do with each other. If not, the angles themselves are
        missing (NaN) between the stretches.
    """

    angle: FloatArray
    starts: IntegerArray
    lengths: IntegerArray
    missing: int = 0
    broken: bool = False

    def every(self, step: int) -> "Track":
        """Every `step`-th angle."""
        starts = -(-self.starts // step)
        lengths = (self.starts + self.lengths - 1) // step - starts + 1
        return Track(
            angle=every(self.angle, step),
            starts=starts[lengths > 0],
            lengths=lengths[lengths > 0],
            missing=self.missing,
            broken=self.broken,
        )


def accumulated_track(
    samples: FloatArray,
    kind: Kind,
    sample_rate: float,
    gaps: Gaps,
    *,
    only_whole: Estimator | None = None,
) -> Track:
    """The accumulated angle that an estimator takes its differences of.

    Parameters
    ----------
    samples
        (samples,); NaN marks a missing one.
    kind, sample_rate, gaps
        As in `stability_curve`.
    only_whole
        Name of the estimator, if it takes no record with gaps.

    Raises
    ------
    RecordingError
        If a sample is infinite, or missing and not allowed to be, or too few are present.
    ValueError
        If there are too few samples.
    """
    smallest = 3 if kind == "angle" else 2
    if samples.size < smallest:
        raise ValueError(
            f"values has {samples.size} samples; an Allan variance takes {smallest} or more"
        )
    # One sum tells a clean record without a second array of its size.
    with np.errstate(over="ignore", invalid="ignore"):
        usual = mean(samples)
    missing = 0
    starts, stops = np.array([0]), np.array([samples.size])
    if not math.isfinite(usual):
        missing = _count_gaps(samples, sample_rate, gaps, only_whole)
    if missing:
        starts, stops = _whole_stretches(samples)
    present = samples.size - missing
    if present < smallest:
        raise RecordingError(
            f"{present} of {samples.size} samples are present; "
            f"an Allan variance takes {smallest} or more",
            channel="values",
        )
    if kind == "angle":
        first, last = int(starts[0]), int(stops[-1]) - 1
        slope = _exact_slope((samples[last] - samples[first]) / (last - first), samples.size)
        angle = _without_ramp(samples, slope, float(samples[first]))
        return Track(angle=angle, starts=starts, lengths=stops - starts, missing=missing)
    if missing:
        usual = mean(_filled(samples, 0.0)) * samples.size / present
        samples = _filled(samples, usual)
    return Track(
        angle=_accumulated(samples, usual),
        starts=starts,
        lengths=stops - starts + 1,
        missing=missing,
        broken=missing > 0,
    )


def mirrored_values(angle: FloatArray) -> FloatArray:
    """From the last to the first, an array of its own."""
    mirrored = empty(angle.size)
    for block in blocks(angle.size):
        mirrored[angle.size - block.stop : angle.size - block.start] = angle[block][::-1]
    return mirrored


def _whole_stretches(samples: FloatArray) -> tuple[IntegerArray, IntegerArray]:
    """Where samples begin and cease to be present."""
    present = np.zeros(samples.size + 2, dtype=np.bool_)
    for block in blocks(samples.size):
        present[block.start + 1 : block.stop + 1] = ~np.isnan(samples[block])
    whole = np.flatnonzero(present[1:] != present[:-1])
    return whole[::2], whole[1::2]


def _filled(samples: FloatArray, value: float) -> FloatArray:
    """With `value` in the place of what is missing, a new array."""
    return elementwise(lambda some: np.where(np.isnan(some), value, some), samples)


def _without_ramp(samples: FloatArray, slope: float, offset: float) -> FloatArray:
    rest = empty(samples.size)
    for block in blocks(samples.size):
        rest[block] = (samples[block] - slope * np.arange(block.start, block.stop)) - offset
    return rest


def _accumulated(samples: FloatArray, mean: float) -> FloatArray:
    """Angles from zero on, one more than there are samples."""
    angle = empty(samples.size + 1)
    angle[0] = 0.0
    for block in blocks(samples.size):
        after = angle[block.start + 1 : block.stop + 1]
        np.subtract(samples[block], mean, out=after)
        after[0] += angle[block.start]
        np.cumsum(after, out=after)
    return angle


def _count_gaps(
    samples: FloatArray, sample_rate: float, gaps: Gaps, only_whole: Estimator | None
) -> int:
    """How many samples are missing, if none is infinite and missing ones are allowed."""
    infinite = marked(np.isinf, samples)
    if infinite.any():
        what = f"infinite, {number_of(infinite)} in all"
        remedy = "mark bad samples as NaN and use gaps='omit'"
        raise _refused(infinite, sample_rate, what, remedy)
    missing = marked(np.isnan, samples)
    count = number_of(missing)
    if count and gaps == "reject":
        what, remedy = f"missing, {count} in all", "use gaps='omit' or fill them first"
        raise _refused(missing, sample_rate, what, remedy)
    if count and only_whole is not None:
        what = f"missing and {only_whole} needs a whole record"
        remedy = "gaps='omit' works with oadev, mdev and ohdev"
        raise _refused(missing, sample_rate, what, remedy)
    return count


def _refused(marks: BooleanArray, sample_rate: float, what: str, remedy: str) -> RecordingError:
    first = first_of(marks)
    return RecordingError(
        f"sample {first} ({first / sample_rate:g} s) is {what}",
        channel="values",
        remedy=remedy,
    )


def _exact_slope(slope: float, samples: int) -> float:
    """`slope` rounded to so few bits that its product with any index is exact.

    What is left of the ramp is too small to cost digits, and removing it adds no rounding.
    """
    mantissa, exponent = math.frexp(slope)
    scale = 2.0 ** (53 - samples.bit_length())
    return math.ldexp(round(mantissa * scale) / scale, exponent)


# ---- strides -----------------------------------------------------------------------

# Squares at one tau before windows are skipped.
LARGEST_WORK: Final = 3e7


def window_stride(windows: int, squares: int, cluster: int) -> int:
    """Spacing of the outer windows that bounds the work at one tau.

    Windows an eighth of a cluster apart are so correlated that skipping between them costs
    next to nothing, so it is never wider.

    Parameters
    ----------
    windows
        Outer windows in the record.
    squares
        In each window.
    cluster
        In samples.
    """
    return min(max(1, math.ceil(windows * squares / LARGEST_WORK)), max(1, cluster // 8))


def stride_notes(
    name: Estimator, strides: Sequence[int], clusters: IntegerArray
) -> tuple[Note, ...]:
    """Note on windows that are skipped, if any are."""
    skipped = [(int(m), stride) for m, stride in zip(clusters, strides, strict=True) if stride > 1]
    if not skipped:
        return ()
    narrowest, largest = min(s for _, s in skipped), max(s for _, s in skipped)
    widest = max(s / m for m, s in skipped)
    return (
        Note(
            text=f"{name} averages every k-th window at {len(skipped)} of {len(strides)} taus, "
            f"k = {narrowest} to {largest}, at most {widest:.2g} of a cluster"
        ),
    )


# ---- sums --------------------------------------------------------------------------

# Starts worked on at once: of a mapped angle, an eighth of a megabyte beside each of some hundred
# places. A multiple of the kernels' block, so that the sums of the parts are those of the whole.
STARTS: Final = 2**14
# Angles in a stretch up to which stretches, if there are more than a few, go through the kernels
# many at a time.
_SHORT: Final = 2**16
_FEW: Final = 100
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
    terms: IntegerArray
    windows: IntegerArray
    clusters: IntegerArray
    rules: tuple[Estimator, ...]
    notes: tuple[Note, ...] = ()


def plain_sums(track: Track, clusters: IntegerArray, order: int) -> tuple[FloatArray, IntegerArray]:
    """Sums and numbers of squared differences of `order` from every m-th start."""
    # Plain clusters are overlapping ones of one sample on every m-th angle.
    columns = [overlapping_sums(track.every(int(m)), _ONE, order) for m in clusters]
    sums, terms = (np.concatenate(column) for column in zip(*columns, strict=True))
    return sums, terms


def modified_sums(track: Track, clusters: IntegerArray) -> tuple[FloatArray, IntegerArray]:
    """Sums and numbers of squared second differences of means over a cluster."""
    sums = _stretch_sums(
        track,
        clusters.size,
        lambda stretch: _window_sums(stretch, clusters),
        lambda starts, lengths: _kernels.sum_squared_window_differences_in_stretches(
            track.angle, starts, lengths, clusters
        ),
    )
    return sums / clusters.astype(np.float64) ** 2, _counts(track, 3 * clusters - 1)


def averaged(
    name: Estimator,
    track: Track,
    clusters: IntegerArray,
    *,
    sums: FloatArray,
    terms: IntegerArray,
    whole: IntegerArray,
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


def _gap_notes(whole: IntegerArray, terms: IntegerArray) -> tuple[Note, ...]:
    lost = whole - terms
    note = Note(
        text=f"gaps left out {int(lost.sum())} of {int(whole.sum())} terms, "
        f"at most {rounded(100.0 * float((lost / whole).max()), 3)} % of those at one tau"
    )
    empty = int(number_of(terms <= 0))
    if not empty:
        return (note,)
    return note, Note(text=f"{empty} taus have no term free of gaps and are left out")


def difference_sums(angle: FloatArray, clusters: IntegerArray, order: int = 2) -> FloatArray:
    """Sums over every start of squared differences of `order` 2 or 3, for each cluster."""
    sums = np.zeros(clusters.size)
    for block in blocks(angle.size, STARTS):
        sums = _kernels.sum_squared_differences(
            angle, clusters, order, block.start, block.stop, sums
        )
    return sums


def overlapping_sums(
    track: Track, clusters: IntegerArray, order: int
) -> tuple[FloatArray, IntegerArray]:
    """Sums and numbers of squared differences of `order`, from every start, that touch no gap."""
    if track.missing and not track.broken:
        # Angles on both sides of a gap belong together.
        return _sums_across_gaps(track.angle, clusters, order)
    return _stretch_sums(
        track,
        clusters.size,
        lambda stretch: difference_sums(stretch, clusters, order),
        lambda starts, lengths: _kernels.sum_squared_differences_in_stretches(
            track.angle, starts, lengths, clusters, order
        ),
    ), _counts(track, order * clusters)


def _sums_across_gaps(
    angle: FloatArray, clusters: IntegerArray, order: int
) -> tuple[FloatArray, IntegerArray]:
    """Sums and numbers of squared differences none of whose angles is missing."""
    sums, counts = np.zeros(clusters.size), np.zeros(clusters.size, dtype=np.int64)
    for block in blocks(angle.size, STARTS):
        for number, m in enumerate(clusters.tolist()):
            total, count = _kernels.sum_squared_differences_with_gaps(
                angle, m, order, block.start, block.stop
            )
            sums[number] += total
            counts[number] += count
    return sums, counts


def _counts(track: Track, reaches: IntegerArray) -> IntegerArray:
    """Terms that lie in one stretch each, by how far on the last angle of a term is."""
    return np.array(
        [np.maximum(track.lengths - reach, 0).sum() for reach in reaches], dtype=np.int64
    )


def _stretch_sums(
    track: Track,
    clusters: int,
    of_long: Callable[[FloatArray], FloatArray],
    of_short: Callable[[IntegerArray, IntegerArray], FloatArray],
) -> FloatArray:
    """Sums over all stretches, the long ones one by one, the short ones many at a time."""
    angle = track.angle
    short = (track.lengths <= _SHORT) & (track.lengths.size > _FEW)
    sums = np.zeros(clusters)
    for start, length in zip(track.starts[~short], track.lengths[~short], strict=True):
        sums += of_long(angle[start : start + length])
    starts, lengths = track.starts[short], track.lengths[short]
    for block in blocks(angle.size):
        first, last = np.searchsorted(starts, (block.start, block.stop))
        if last > first:
            sums += of_short(starts[first:last], lengths[first:last])
    return sums


def _window_sums(angle: FloatArray, clusters: IntegerArray) -> FloatArray:
    """Sums of squared second differences of sums over a cluster, from every start."""
    fits = (3 * m <= angle.size for m in clusters.tolist())
    windows = np.array(
        [
            _kernels.window_difference(angle, m, 0, m, 0.0) if fit else 0.0
            for m, fit in zip(clusters.tolist(), fits, strict=True)
        ]
    )
    sums = windows**2
    for block in blocks(angle.size, STARTS):
        sums, windows = _kernels.sum_squared_window_differences(
            angle, clusters, block.start, block.stop, sums, windows
        )
    return sums
