"""From samples to the accumulated angle, in one pass, with gaps or without."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sagnac import series
from sagnac.arrays import FloatArray
from sagnac.errors import RecordingError
from sagnac.recording.model import Kind
from sagnac.stability import _kernels
from sagnac.stability.names import Estimator, Gaps


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
    starts: NDArray[np.int64]
    lengths: NDArray[np.int64]
    missing: int = 0
    broken: bool = False

    def every(self, step: int) -> "Track":
        """Every `step`-th angle."""
        starts = -(-self.starts // step)
        lengths = (self.starts + self.lengths - 1) // step - starts + 1
        return Track(
            angle=series.every(self.angle, step),
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
        mean = series.mean(samples)
    missing = 0
    starts, stops = np.array([0]), np.array([samples.size])
    if not math.isfinite(mean):
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
        mean = _mean_of_present(samples)
        samples = _filled(samples, mean)
    return Track(
        angle=_accumulated(samples, mean),
        starts=starts,
        lengths=stops - starts + 1,
        missing=missing,
        broken=missing > 0,
    )


def mirrored_values(angle: FloatArray) -> FloatArray:
    """From the last to the first, a series of its own."""
    return series.made(
        lambda block: angle[angle.size - block.stop : angle.size - block.start][::-1],
        angle.size,
        angle,
    )


def _whole_stretches(samples: FloatArray) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Where samples begin and cease to be present."""

    def changes(block: slice) -> NDArray[np.int64]:
        before = block.start > 0 and not np.isnan(samples[block.start - 1])
        present = ~np.isnan(samples[block])
        return np.asarray(block.start + np.flatnonzero(np.diff(present, prepend=before)))

    edges = series.map(changes, samples.size, samples)
    last = [] if np.isnan(samples[-1]) else [samples.size]
    whole = np.concatenate([*edges, np.array(last, dtype=np.int64)])
    return whole[::2], whole[1::2]


def _mean_of_present(samples: FloatArray) -> float:
    def sum_and_count(block: slice) -> FloatArray:
        present = samples[block][~np.isnan(samples[block])]
        return np.array([present.sum(), present.size], dtype=np.float64)

    total, count = series.total(sum_and_count, samples.size, samples)
    return float(total / count)


def _filled(samples: FloatArray, value: float) -> FloatArray:
    """With `value` in the place of what is missing, a new series."""
    return series.made(
        lambda block: np.where(np.isnan(samples[block]), value, samples[block]),
        samples.size,
        samples,
    )


def _without_ramp(samples: FloatArray, slope: float, offset: float) -> FloatArray:
    angle = series.empty(samples.size)
    series.map(
        lambda block: _kernels.subtract_ramp(
            samples[block], slope, offset, block.start, angle[block]
        ),
        samples.size,
        samples,
        angle,
    )
    return angle


def _accumulated(samples: FloatArray, mean: float) -> FloatArray:
    """Angles from zero on, one more than there are samples."""
    angle = series.empty(samples.size + 1)
    angle[0] = 0.0

    def accumulate(total: float, block: slice) -> float:
        after = angle[block.start + 1 : block.stop + 1]
        return float(_kernels.accumulate_deviations(samples[block], mean, total, after))

    series.reduce(accumulate, 0.0, samples.size, samples, angle)
    return angle


def _count_gaps(
    samples: FloatArray, sample_rate: float, gaps: Gaps, only_whole: Estimator | None
) -> int:
    """How many samples are missing, if none is infinite and missing ones are allowed."""
    infinite, first = _tally(np.isinf, samples)
    if infinite:
        raise RecordingError(
            f"sample {first} ({first / sample_rate:g} s) is infinite, {infinite} in all",
            channel="values",
            remedy="mark bad samples as NaN and use gaps='omit'",
        )
    missing, first = _tally(np.isnan, samples)
    if missing and gaps == "reject":
        raise RecordingError(
            f"sample {first} ({first / sample_rate:g} s) is missing, {missing} in all",
            channel="values",
            remedy="use gaps='omit' or fill them first",
        )
    if missing and only_whole is not None:
        raise RecordingError(
            f"sample {first} ({first / sample_rate:g} s) is missing and "
            f"{only_whole} needs a whole record",
            channel="values",
            remedy="gaps='omit' works with oadev, mdev and ohdev",
        )
    return missing


def _tally(
    is_bad: Callable[[FloatArray], NDArray[np.bool_]], samples: FloatArray
) -> tuple[int, int]:
    """How many samples are bad, and the first of them."""

    def count(seen: tuple[int, int], block: slice) -> tuple[int, int]:
        bad = np.flatnonzero(is_bad(samples[block]))
        if not bad.size:
            return seen
        return seen[0] + bad.size, min(seen[1], block.start + int(bad[0]))

    return series.reduce(count, (0, samples.size), samples.size, samples)


def _exact_slope(slope: float, samples: int) -> float:
    """`slope` rounded to so few bits that its product with any index is exact.

    What is left of the ramp is too small to cost digits, and removing it adds no rounding.
    """
    mantissa, exponent = math.frexp(slope)
    scale = 2.0 ** (53 - samples.bit_length())
    return math.ldexp(round(mantissa * scale) / scale, exponent)
