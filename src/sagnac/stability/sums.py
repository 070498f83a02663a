"""How the finite-difference estimators of the Allan family sum their differences.

The accumulated angle is made in one pass, with gaps or without; windows are skipped if taking every
one would cost too much. Plain, overlapping and modified variances are summed here, the total family
and Theo1 in `estimators`.
"""

import math
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Final

import numpy as np

from sagnac.core.arrays import FloatArray, IntegerArray, blocks, elementwise, empty, every, less
from sagnac.core.errors import Note, RecordingError, refusal
from sagnac.core.marks import first_of, marked, number_of
from sagnac.core.marks import stretches as present_stretches
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
    stretches
        (stretches, 2) first angle of each whole stretch, and the first behind it.
    missing
        Samples that are missing.
    broken
        Whether the sum of rates or increments is interrupted at each gap, so that the angles of
        two stretches have nothing to do with each other. If not, the angles themselves are
        missing (NaN) between the stretches.
    """

    angle: FloatArray
    stretches: IntegerArray
    missing: int = 0
    broken: bool = False

    def every(self, step: int) -> "Track":
        """Every `step`-th angle."""
        stretches = -(-self.stretches // step)
        held = stretches[np.diff(stretches)[:, 0] > 0]
        return replace(self, angle=every(self.angle, step), stretches=held)

    def within(self, block: slice) -> IntegerArray:
        """The stretches that have an angle in a block."""
        first = np.searchsorted(self.stretches[:, 1], block.start, side="right")
        return self.stretches[first : np.searchsorted(self.stretches[:, 0], block.stop)]


def whole_track(angle: FloatArray) -> Track:
    """A track without gaps."""
    return Track(angle=angle, stretches=np.array([[0, angle.size]]))


def accumulated_track(
    samples: FloatArray, kind: Kind, sample_rate: float, gaps: Gaps, only_whole: Estimator | None
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
    takes = f"an Allan variance takes {smallest} or more"
    if samples.size < smallest:
        raise refusal("values", f"has {samples.size} samples; {takes}")
    with np.errstate(invalid="ignore"):
        total = sum(float(samples[block].sum()) for block in blocks(samples.size))
    # A finite sum tells in one pass that nothing is missing.
    missing, stretches = 0, np.array([[0, samples.size]])
    if not math.isfinite(total):
        missing = _count_gaps(samples, sample_rate, gaps, only_whole)
        total = sum(float(np.nansum(samples[block])) for block in blocks(samples.size))
        stretches = np.stack(present_stretches(~marked(np.isnan, samples)), axis=1)
    present = samples.size - missing
    if present < smallest:
        problem = f"{present} of {samples.size} samples are present; {takes}"
        raise RecordingError(problem, channel="values")
    if kind == "angle":
        first, last = int(stretches[0, 0]), int(stretches[-1, 1]) - 1
        slope = _exact_slope((samples[last] - samples[first]) / (last - first), samples.size)
        angle = less(samples, lambda number: slope * number)
        angle = elementwise(np.subtract, angle, float(samples[first]), out=angle)
        return Track(angle=angle, stretches=stretches, missing=missing)
    # Each stretch of rates ends at an angle more, where the next one may begin.
    angle, longer = _accumulated(samples, total / present, missing), stretches + np.array([0, 1])
    return Track(angle=angle, stretches=longer, missing=missing, broken=missing > 0)


def _accumulated(samples: FloatArray, mean: float, missing: int) -> FloatArray:
    """Angles from zero on, one more than there are samples."""
    angle = empty(samples.size + 1)
    angle[0] = 0.0
    for block in blocks(samples.size):
        after = angle[block.start + 1 : block.stop + 1]
        np.subtract(samples[block], mean, out=after)
        if missing:
            # A missing sample turns by what is usual.
            after[np.isnan(after)] = 0.0
        after[0] += angle[block.start]
        np.cumsum(after, out=after)
    return angle


def _count_gaps(samples: FloatArray, rate: float, gaps: Gaps, only_whole: Estimator | None) -> int:
    """How many samples are missing, if none is infinite and missing ones are allowed."""
    missing = marked(np.isnan, samples)
    count, infinite = number_of(missing), marked(np.isinf, samples)
    if infinite.any():
        marks, what = infinite, f"infinite, {number_of(infinite)} in all"
        remedy = "mark bad samples as NaN and use gaps='omit'"
    elif count and gaps == "reject":
        marks, what = missing, f"missing, {count} in all"
        remedy = "use gaps='omit' of stability_curve, or fill them first"
    elif count and only_whole is not None:
        marks, what = missing, f"missing and {only_whole} needs a whole record"
        remedy = "gaps='omit' works with adev, oadev, mdev, tdev, hdev, ohdev and haar"
    else:
        return count
    first = first_of(marks)
    text = f"sample {first} ({first / rate:g} s) is {what}"
    raise RecordingError(text, channel="values", remedy=remedy)


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


def stride_of(windows: IntegerArray, squares: IntegerArray, clusters: IntegerArray) -> IntegerArray:
    """(clusters,) spacing of the outer windows that bounds the work at one tau.

    Windows an eighth of a cluster apart are so correlated that skipping between them costs
    next to nothing, so it is never wider.

    Parameters
    ----------
    windows
        (clusters,) outer windows in the record.
    squares
        (clusters,) squares in each.
    clusters
        (clusters,) in samples.
    """
    wanted = np.ceil(windows * squares.astype(np.float64) / LARGEST_WORK).astype(np.int64)
    return np.minimum(np.maximum(wanted, 1), np.maximum(clusters // 8, 1))


# ---- sums --------------------------------------------------------------------------

# Starts worked on at once: of a mapped angle, an eighth of a megabyte beside each of some hundred
# places.
STARTS: Final = 2**14


@dataclass(frozen=True, slots=True, kw_only=True)
class Points:
    """Result of an estimator: one variance for each cluster.

    Attributes
    ----------
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

    variance: FloatArray
    terms: IntegerArray
    windows: IntegerArray
    clusters: IntegerArray
    rules: tuple[Estimator, ...]
    notes: tuple[Note, ...] = ()

    def followed_by(self, other: "Points") -> "Points":
        """These and others behind them."""
        names = ("variance", "terms", "windows", "clusters")
        joined = {one: np.concatenate([getattr(self, one), getattr(other, one)]) for one in names}
        rules, notes = self.rules + other.rules, self.notes + other.notes
        return Points(**joined, rules=rules, notes=notes)


# Sums of squares, and how many terms each has.
Counted = tuple[FloatArray, IntegerArray]


def plain_sums(track: Track, clusters: IntegerArray, order: int) -> Counted:
    """Sums and numbers of squared differences of `order` from every m-th start."""
    # Plain clusters are overlapping ones of one sample on every m-th angle.
    one = np.ones(1, dtype=np.int64)
    columns = [overlapping_sums(track.every(int(m)), one, order) for m in clusters]
    sums, terms = (np.concatenate(column) for column in zip(*columns, strict=True))
    return sums, terms


def overlapping_sums(track: Track, clusters: IntegerArray, order: int) -> Counted:
    """Sums and numbers of squared differences of `order`, from every start, that touch no gap."""
    if track.missing and not track.broken:
        # Angles on both sides of a gap belong together.
        return _sums_across_gaps(track.angle, clusters, order)
    sums = np.zeros(clusters.size)
    for block in blocks(track.angle.size, STARTS):
        here = track.within(block), clusters, order, block.start, block.stop
        _kernels.sum_squared_differences(track.angle, *here, sums)
    return sums, _counts(track, order * clusters)


def modified_sums(track: Track, clusters: IntegerArray) -> Counted:
    """Sums and numbers of squared second differences of sums over a cluster."""
    sums, windows = np.zeros((2, clusters.size))
    for block in blocks(track.angle.size, STARTS):
        here = track.within(block), clusters, block.start, block.stop
        _kernels.sum_squared_window_differences(track.angle, *here, sums, windows)
    return sums, _counts(track, 3 * clusters - 1)


def _sums_across_gaps(angle: FloatArray, clusters: IntegerArray, order: int) -> Counted:
    """Sums and numbers of squared differences none of whose angles is missing."""
    sums, counts = np.zeros(clusters.size), np.zeros(clusters.size, dtype=np.int64)
    for block in blocks(angle.size):
        for number, m in enumerate(clusters.tolist()):
            stop = max(block.start, min(block.stop, angle.size - order * m))
            arms = [angle[block.start + k * m : stop + k * m] for k in range(order + 1)]
            for _ in range(order):
                arms = [after - before for before, after in pairwise(arms)]
            squares = arms[0] ** 2
            sums[number] += np.nansum(squares)
            counts[number] += np.count_nonzero(~np.isnan(squares))
    return sums, counts


def _counts(track: Track, reaches: IntegerArray) -> IntegerArray:
    """Terms that lie in one stretch each, by how far on the last angle of a term is."""
    lengths = np.diff(track.stretches)[:, 0]
    return np.array([np.maximum(lengths - reach, 0).sum() for reach in reaches], dtype=np.int64)
