"""What a sample is: angle, increment or rate, and the way from each to the angle."""

import math

import numpy as np
from numpy.typing import ArrayLike

from sagnac import series
from sagnac.arrays import FloatArray
from sagnac.errors import RecordingError
from sagnac.recording.model import Channel, Kind


def angle_of(channel: Channel, sample_rate: float) -> FloatArray:
    """Accumulated angle of a channel, rad, shape (samples,).

    Increments and rates are summed after their mean is taken off and put back as a
    ramp, so that a large constant rate costs no precision in the noise.
    """
    if channel.kind == "angle":
        return channel.values
    values = channel.values
    per_step = 1.0 if channel.kind == "increment" else sample_rate
    mean = series.mean(values) / per_step
    angle = series.empty(values.size)
    turned = 0.0
    for span in series.through(values.size, values, angle):
        steps = values[span] / per_step
        steps -= mean
        steps[0] += turned
        np.cumsum(steps, out=angle[span])
        turned = float(angle[span.stop - 1])
        angle[span] += mean * np.arange(span.start + 1, span.stop + 1)
    return angle


def unwrapped(values: FloatArray, period: float) -> tuple[FloatArray, int]:
    """A reading that starts over at `period`, made continuous.

    Of two samples less than half a period apart either way is taken to be the shorter
    one, so the direction may be either and may change.

    Parameters
    ----------
    values
        (samples,) readings; samples that are not finite are passed over.
    period
        Reading at which the counter starts over, in the unit of `values`.

    Returns
    -------
    values
        (samples,), a new array where anything was unwrapped, else the one given.
    wraps
        How often the reading started over.
    """

    def periods(span: slice) -> FloatArray:
        """Whole periods between each sample of a span and the next."""
        result = np.diff(values[span.start : span.stop + 1])
        result /= period
        np.rint(result, out=result)
        result[~np.isfinite(result)] = 0.0
        return result

    steps = values.size - 1
    if not any(periods(span).any() for span in series.through(steps, values)):
        return values, 0
    result = series.empty(values.size)
    result[0] = values[0]
    wraps, total = 0, 0.0
    for span in series.through(steps, values, result):
        over = periods(span)
        wraps += int(np.count_nonzero(over))
        # Sums of integers, so nothing is lost.
        over[0] += total
        np.cumsum(over, out=over)
        total = float(over[-1])
        over *= period
        later = slice(span.start + 1, span.stop + 1)
        np.subtract(values[later], over, out=result[later])
    return result, wraps


def median_step(times: FloatArray, *, repeats: bool = True) -> float:
    """Median interval of time stamps, of those that are finite and do not run backwards.

    Parameters
    ----------
    times
        (samples,) s.
    repeats
        Whether stamps that repeat the one before count.

    Returns
    -------
    s, or NaN where there is no such interval.
    """

    def usable(span: slice) -> FloatArray:
        steps = np.diff(times[span.start : span.stop + 1])
        return steps[np.isfinite(steps) & ((steps >= 0.0) if repeats else (steps > 0.0))]

    size = max(times.size - 1, 0)
    if not series.is_mapped(times):
        steps = usable(slice(0, size))
        return float(np.median(steps)) if steps.size else math.nan

    def ranked(rank: int) -> float:
        # Floats that are not negative are ordered as the integers of the same bits; those are
        # found sixteen at a time, by counting.
        found = 0
        for shift in (48, 32, 16, 0):
            counts = np.zeros(2**16, dtype=np.int64)
            for span in series.through(size, times):
                bits = usable(span).view(np.int64)
                bits = bits[bits >> (shift + 16) == found] if shift < 48 else bits
                counts += np.bincount((bits >> shift) & 0xFFFF, minlength=2**16)
            until = np.cumsum(counts)
            digit = int(np.searchsorted(until, rank, side="right"))
            rank -= int(until[digit] - counts[digit])
            found = found << 16 | digit
        return float(np.int64(found).view(np.float64))

    number = sum(usable(span).size for span in series.through(size, times))
    if number == 0:
        return math.nan
    return float(np.mean([ranked((number - 1) // 2), ranked(number // 2)]))


def angle_increments(values: ArrayLike, *, kind: Kind, sample_rate: float) -> FloatArray:
    """Angle turned over each sample interval.

    Parameters
    ----------
    values
        (samples,), rad for ``angle`` and ``increment``, rad/s for ``rate``.
    kind
        What one sample is.
    sample_rate
        Samples per second.

    Returns
    -------
    FloatArray
        (increments,), rad: one fewer than the samples for ``angle``, else as many.

    Raises
    ------
    RecordingError
        If a sample is not finite.
    ValueError
        If an argument makes no sense.
    """
    samples = np.asarray(values, dtype=np.float64)
    if samples.ndim != 1:
        raise ValueError(f"values has shape {samples.shape}; give one channel, shape (samples,)")
    if kind not in ("angle", "increment", "rate"):
        raise ValueError(f"kind is {kind!r}; state angle, increment or rate")
    if not (math.isfinite(sample_rate) and sample_rate > 0.0):
        raise ValueError(f"sample_rate is {sample_rate}; give samples per second, above zero")
    # One sum tells whole samples without a second array of their size.
    finite = samples.size == 0 or math.isfinite(series.mean(samples))
    if not finite and not np.isfinite(samples).all():
        first = int(np.argmin(np.isfinite(samples)))
        raise RecordingError(
            f"sample {first} is not finite and there is no room for gaps here; "
            "take a span without gaps (--slice)"
        )
    if kind == "angle":
        return series.differences(samples)
    return samples / sample_rate if kind == "rate" else samples
