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
from sagnac.stability.estimators import WHOLE_RECORD_ONLY, Estimator, Gaps


@dataclass(frozen=True, slots=True, kw_only=True)
class Track:
    """Accumulated angle without its constant rate, and where it is whole.

    Of a record with `missing` samples the angle is whole in stretches of so many (`lengths`)
    from `starts` on. Between them angles are missing (NaN), or, if `broken`, the sum of rates or
    increments is, so that the angles of two stretches have nothing to do with each other.
    """

    angle: FloatArray
    starts: NDArray[np.int64]
    lengths: NDArray[np.int64]
    missing: int = 0
    broken: bool = False


def accumulated_track(
    samples: FloatArray, kind: Kind, sample_rate: float, gaps: Gaps, estimator: Estimator
) -> Track:
    """The accumulated angle that an estimator takes its differences of."""
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
        missing = _count_gaps(samples, sample_rate, gaps, estimator)
    if missing:
        starts, stops = _whole_stretches(samples)
    present = samples.size - missing
    if present < smallest:
        raise RecordingError(
            f"values: {present} of {samples.size} samples are present; "
            f"an Allan variance takes {smallest} or more"
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


def _whole_stretches(samples: FloatArray) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Where samples begin and cease to be present."""
    edges = []
    before = False
    for span in series.through(samples.size, samples):
        present = ~np.isnan(samples[span])
        edges.append(span.start + np.flatnonzero(np.diff(present, prepend=before)))
        before = bool(present[-1])
    edges.append(np.array([samples.size] if before else [], dtype=np.int64))
    whole = np.concatenate(edges)
    return whole[::2], whole[1::2]


def _mean_of_present(samples: FloatArray) -> float:
    total, count = 0.0, 0
    for span in series.through(samples.size, samples):
        present = samples[span][~np.isnan(samples[span])]
        total += float(present.sum())
        count += present.size
    return total / count


def _filled(samples: FloatArray, value: float) -> FloatArray:
    """With `value` in the place of what is missing, a new series."""
    filled = series.empty(samples.size)
    for span in series.through(samples.size, samples, filled):
        filled[span] = np.where(np.isnan(samples[span]), value, samples[span])
    return filled


def _without_ramp(samples: FloatArray, slope: float, offset: float) -> FloatArray:
    angle = series.empty(samples.size)
    for span in series.through(samples.size, samples, angle):
        _kernels.subtract_ramp(samples[span], slope, offset, span.start, angle[span])
    return angle


def _accumulated(samples: FloatArray, mean: float) -> FloatArray:
    """Angles from zero on, one more than there are samples."""
    angle = series.empty(samples.size + 1)
    angle[0] = total = 0.0
    for span in series.through(samples.size, samples, angle):
        after = angle[span.start + 1 : span.stop + 1]
        total = _kernels.accumulate_deviations(samples[span], mean, total, after)
    return angle


def mirrored_values(angle: FloatArray) -> FloatArray:
    """From the last to the first, a series of its own."""
    mirrored = series.empty(angle.size)
    for span in series.through(angle.size, angle, mirrored):
        mirrored[span] = angle[angle.size - span.stop : angle.size - span.start][::-1]
    return mirrored


def _count_gaps(samples: FloatArray, sample_rate: float, gaps: Gaps, estimator: Estimator) -> int:
    infinite, first = _tally(np.isinf, samples)
    if infinite:
        raise RecordingError(
            f"values: sample {first} ({first / sample_rate:g} s) is infinite, "
            f"{infinite} in all; mark bad samples as NaN and use gaps='omit'"
        )
    missing, first = _tally(np.isnan, samples)
    if missing and gaps == "reject":
        raise RecordingError(
            f"values: sample {first} ({first / sample_rate:g} s) is missing, "
            f"{missing} in all; use gaps='omit' or fill them first"
        )
    if missing and estimator in WHOLE_RECORD_ONLY:
        raise RecordingError(
            f"values: sample {first} ({first / sample_rate:g} s) is missing and "
            f"{estimator} needs a whole record; gaps='omit' works with oadev, mdev and ohdev"
        )
    return missing


def _tally(
    is_bad: Callable[[FloatArray], NDArray[np.bool_]], samples: FloatArray
) -> tuple[int, int]:
    """How many samples are bad, and the first of them."""
    count, first = 0, samples.size
    for span in series.through(samples.size, samples):
        bad = np.flatnonzero(is_bad(samples[span]))
        if bad.size:
            count += bad.size
            first = min(first, span.start + int(bad[0]))
    return count, first


def _exact_slope(slope: float, samples: int) -> float:
    """`slope` rounded to so few bits that its product with any index is exact.

    What is left of the ramp is too small to cost digits, and removing it adds no rounding.
    """
    mantissa, exponent = math.frexp(slope)
    scale = 2.0 ** (53 - samples.bit_length())
    return math.ldexp(round(mantissa * scale) / scale, exponent)
