"""When samples were taken: stamps, sample rate, and the stretch of the file that is taken."""

import math
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from sagnac import series
from sagnac.arrays import BooleanArray, FloatArray
from sagnac.errors import Note, RecordingError
from sagnac.formats.source import Stored
from sagnac.recording.stamps import median_step

Span = tuple[float | None, float | None]

# Sampling is called uniform when no stamp is off its place by more than this share of a step.
UNIFORM: Final = 1e-6
# Rates stated twice, by stamps and in words, have to agree to this.
RATE_AGREEMENT: Final = 0.01
# A stamp that misses the limit of a slice by less than this, s, is at it.
_SLACK: Final = 1e-9


@dataclass(frozen=True, slots=True, kw_only=True)
class Sampling:
    """The samples that are taken, and when they were.

    Attributes
    ----------
    first, stop
        First sample of the file that is taken, and the one after the last.
    start
        Time of the first, s from the first sample of the file.
    rate
        Samples per second.
    times
        (samples,) s from the first that is taken; None where sampling is uniform.
    notes
        What was noticed of the stamps.

    Raises
    ------
    ValueError
        If the stretch is none, or the rate is not positive.
    """

    first: int
    stop: int
    start: float
    rate: float
    times: FloatArray | None = None
    notes: tuple[Note, ...] = ()

    def __post_init__(self) -> None:
        if not 0 <= self.first <= self.stop:
            raise ValueError(f"first and stop are {self.first} and {self.stop}; stop comes last")
        if not self.rate > 0.0:
            raise ValueError(f"rate is {self.rate!r}; give samples per second, above zero")

    @property
    def span_s(self) -> tuple[float, float]:
        """Start of the first sample and end of the last, s from the first of the file."""
        return self.start, self.start + (self.stop - self.first) / self.rate


def sampled_by_rate(samples: int, rate: float, span: Span | None) -> Sampling:
    """Uniform samples without stamps.

    Parameters
    ----------
    samples
        In the file.
    rate
        Samples per second.
    span
        Start and stop to take, s from the first sample, or None for all.

    Raises
    ------
    RecordingError
        If fewer than two samples lie in the span.
    """
    if span is None:
        return Sampling(first=0, stop=samples, start=0.0, rate=rate)
    start, stop = span
    first = min(samples, math.ceil((start or 0.0) * rate - 1e-6))
    last = samples if stop is None else min(samples, math.ceil(stop * rate - 1e-6))
    _check_slice(first, last)
    return Sampling(first=first, stop=last, start=first / rate, rate=rate)


def sampled_by_stamps(stamps: FloatArray, span: Span | None, stated_rate: float | None) -> Sampling:
    """Samples with stamps.

    Parameters
    ----------
    stamps
        (two samples or more,) s from the first of the file.
    span
        Start and stop to take, s from the first sample, or None for all.
    stated_rate
        Samples per second in words, or None.

    Raises
    ------
    RecordingError
        If fewer than two samples lie in the span, time does not run forwards, or the stamps
        contradict the rate in words.
    """
    first, last = 0, stamps.size
    if span is not None:
        start, stop = span
        first = first_at(stamps, start or 0.0)
        last = stamps.size if stop is None else first + first_at(stamps[first:], stop)
        _check_slice(first, last)
    sampling = timed(stamps[first:last], stated_rate)
    return replace(sampling, first=first, stop=last, start=float(stamps[first]))


def _check_slice(first: int, stop: int) -> None:
    """Refuse a slice of too few samples to tell a rate from their stamps."""
    if stop - first < 2:
        raise RecordingError(
            "fewer than two samples lie in the slice", remedy="widen {slice START:STOP}"
        )


def stamps_in_seconds(stored: Stored, key: str, unit: float, until: float | None) -> FloatArray:
    """Stamps in s from the first, to the one at `until`.

    The first is taken off before anything is converted, so that integers lose nothing by the size
    of the epoch.

    Parameters
    ----------
    stored
        Columns of the file.
    key
        That of the stamps.
    unit
        Seconds in one unit of them.
    until
        s from the first, after which none are needed, or None.
    """
    samples = stored.lengths[key]
    times = series.Filling(samples)
    origin: Any = None
    for piece in stored.pieces([key], 0, samples):
        raw = piece[key]
        origin = raw[0] if origin is None else origin
        seconds = np.asarray(raw - origin, dtype=np.float64) * unit
        times.append(seconds)
        if until is not None and (seconds >= until - _SLACK).any():
            break
    return times.filled


def first_at(times: FloatArray, limit: float) -> int:
    """First sample at or after `limit`, s; their number where there is none."""

    def reached(block: slice) -> BooleanArray:
        return np.asarray(times[block] >= limit - _SLACK)

    return series.first_where(reached, times.size, times)


def timed(stamps: FloatArray, stated_rate: float | None) -> Sampling:
    """Times and rate of all these samples.

    The rate is the mean one: the median interval of stamps on a clock of 1 ms is
    0.010 s both for 99.9 Hz and for 100 Hz.

    Parameters
    ----------
    stamps
        (samples,) s.
    stated_rate
        Samples per second in words, or None.

    Raises
    ------
    RecordingError
        If time does not run forwards, or the stamps contradict the rate in words.
    """
    times = series.less(stamps, stamps[0])
    taken = Sampling(first=0, stop=times.size, start=0.0, rate=1.0)
    if not _runs_forwards(times):
        # `integrity` says what is wrong, if anything can be told.
        return replace(taken, times=times, rate=stated_rate or _usual_rate(times))
    step = float(times[-1]) / (times.size - 1)
    worst = worst_offset(times, step)
    clock = resolution(times)
    # Stamps are exact only to the last digit that was written, or that a float holds.
    slack = max(UNIFORM * step, 1e-9 * clock, 4.0 * float(np.spacing(times[-1])))
    rate = tidy(1.0 / step, (min(worst, clock) + slack) / float(times[-1]))
    _check_agreement(rate, stated_rate)
    if worst <= slack:
        return replace(taken, rate=rate)
    if worst <= 0.75 * clock < 0.75 * step:
        text = (
            f"stamps are those of uniform sampling at {rate:.9g} Hz on a clock of {clock:g} s: "
            "taken as uniform"
        )
        return replace(taken, rate=rate, notes=(Note(channel="time", text=text),))
    text = (
        f"sampling is not uniform, mean rate {rate:.6g} Hz, stamps up to {worst:.3g} s off an "
        "even spacing"
    )
    return replace(taken, times=times, rate=rate, notes=(Note(channel="time", text=text),))


def _runs_forwards(times: FloatArray) -> bool:
    """Whether there are two stamps or more, all are finite, and the last is after the first."""
    finite = all(series.map(lambda block: np.isfinite(times[block]).all(), times.size, times))
    return times.size > 1 and finite and bool(times[-1] > 0.0)


def _usual_rate(times: FloatArray) -> float:
    usual = median_step(times, repeats=False)
    if math.isnan(usual):
        raise RecordingError(
            "does not run forwards", channel="time", remedy="state {time none} and {rate HZ}"
        )
    return 1.0 / usual


def worst_offset(times: FloatArray, step: float) -> float:
    """What stamps are off an even spacing by `step` from zero on, at most; s."""

    def worst_of(block: slice) -> float:
        off = np.arange(block.start, block.stop) * step
        off -= times[block]
        return max(float(off.max()), -float(off.min()))

    return max(0.0, *series.map(worst_of, times.size, times))


def resolution(times: FloatArray) -> float:
    """Clock step of the stamps: the coarsest power of ten that they are multiples of, s."""
    sample = series.every(times, max(1, times.size // 10_000))
    for exponent in range(0, 10):
        ticks = sample * 10.0**exponent
        if np.abs(ticks - np.rint(ticks)).max() < 1e-3:
            return float(10.0**-exponent)
    return 0.0


def tidy(rate: float, uncertainty: float) -> float:
    """`rate`, or the round figure it cannot be told from (relative `uncertainty`).

    Examples
    --------
    >>> tidy(99.99999, 1e-6)
    100.0
    """
    for digits in range(0, 10):
        rounded = round(rate, digits)
        if rounded > 0.0 and abs(rounded - rate) <= uncertainty * rate:
            return rounded
    return rate


def _check_agreement(rate: float, stated_rate: float | None) -> None:
    if stated_rate is not None and abs(rate / stated_rate - 1.0) > RATE_AGREEMENT:
        raise RecordingError(
            f"the stamps give {rate:.6g} Hz but {stated_rate:.6g} Hz is stated",
            channel="time",
            remedy="leave out {rate}, or ignore the stamps with {time none}",
        )
