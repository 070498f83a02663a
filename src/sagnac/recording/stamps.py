"""Stamps of samples: the rate that they give, how even they are, and a stretch of a record."""

import math
from dataclasses import dataclass, replace
from itertools import product
from typing import Final

import numpy as np

from sagnac.core import arrays
from sagnac.core.arrays import FloatArray
from sagnac.core.errors import Note, RecordingError, counted
from sagnac.core.marks import first_of, is_missing, marked_steps, number_of
from sagnac.recording.encoder_readings import MOST_MISSING_IN_A_ROW

# An interval longer than this many nominal steps is a gap: an error. Recorders that stamp on
# arrival, on a clock of 1 ms, repeat a stamp now and then and follow it with one of two steps,
# and a busy host holds a few samples back (stamps up to 4.4 steps apart at 100 Hz are known
# from sound recordings); from more than four samples missing, the angle turned meanwhile is a
# guess. Shorter ones are a remark.
GAP_STEPS: Final = MOST_MISSING_IN_A_ROW + 1.0
CORRECT_STAMPS: Final = "correct the stamps, or state {time none} with {rate}"
# Rates stated twice, by stamps and in words, have to agree to this.
RATE_AGREEMENT: Final = 0.01


@dataclass(frozen=True, slots=True, kw_only=True)
class Sampling:
    """When the samples were taken.

    Attributes
    ----------
    times
        (samples,) s from the first sample, or None if sampling is uniform.
    sample_rate
        Mean samples per second.
    notes
        What was noticed of the stamps.
    """

    times: FloatArray | None
    sample_rate: float
    notes: tuple[Note, ...] = ()


# What stamps start over at, s: counters of 16, 24 and 32 bits in us, ms and ns, a GPS week, a day.
# Minutes and hours are not among them: logs last as long, and begin at 0 again if several are put
# together.
_COUNTERS: Final = [tick * 2.0**bits for tick, bits in product((1e-3, 1e-6, 1e-9), (32, 24, 16))]
_STARTING_OVER: Final = (604_800.0, 86_400.0, *_COUNTERS)


def without_starting_over(times: FloatArray) -> tuple[FloatArray, tuple[Note, ...]]:
    """Stamps that go on where a clock starts over, as far as each of its leaps back shows that.

    Parameters
    ----------
    times
        (samples,) s.

    Returns
    -------
    times
        (samples,) s: those given, unless they start over.
    notes
        That they do.
    """
    backwards = marked_steps(times, lambda steps: steps < 0.0)
    usual = median_step(times, repeats=False)
    if not backwards.any() or not usual > 0.0:
        return times, ()
    places = np.flatnonzero(backwards)
    leaps = times[places] - times[places - 1]
    for period in _STARTING_OVER:
        # A clock of milliseconds rounds, and a stamp may come late, but none is lost there.
        if period > 4.0 * usual and np.all(np.abs(leaps + period - usual) < 0.75 * usual):
            running = period * np.cumsum(backwards, dtype=np.float64)
            running += times
            text = f"starts over at {period:.9g} s, {counted(places.size, 'time')}"
            return running, (Note(text=f"{text}: taken as going on", channel="time"),)
    return times, ()


def sampling(stamps: FloatArray, stated_rate: float | None = None) -> Sampling:
    """Rate and evenness of time stamps, which go on where their clock starts over.

    The rate is the mean one: the median interval of stamps on a clock of 1 ms is
    0.010 s both for 99.9 Hz and for 100 Hz.

    Parameters
    ----------
    stamps
        (samples,) s, from any origin.
    stated_rate
        Hz, if it is stated as well.

    Raises
    ------
    RecordingError
        If the stamps do not run forwards and no rate is stated, the two disagree, or no sensor
        samples as fast.
    """
    times, notes = without_starting_over(arrays.elementwise(np.subtract, stamps, stamps[0]))
    taken = _evenness(times, stated_rate)
    return replace(taken, notes=(*notes, *taken.notes))


def _evenness(times: FloatArray, stated_rate: float | None) -> Sampling:
    """Rate and evenness of stamps from the first sample, s; see `sampling`."""
    if times.size < 2 or not arrays.all_finite(times) or times[-1] <= 0.0:
        rate = stated_rate
        if rate is None:
            usual = median_step(times, repeats=False)
            if math.isnan(usual):
                remedy = "state {time none} and {rate HZ}"
                raise RecordingError("does not run forwards", channel="time", remedy=remedy)
            rate = 1.0 / _plausible(usual)
        return Sampling(times=times, sample_rate=rate)
    step = _plausible(float(times[-1]) / (times.size - 1))
    # The largest distance of a stamp from its place at even steps.
    worst = max(
        float(np.abs(np.arange(some.start, some.stop) * step - times[some]).max())
        for some in arrays.blocks(times.size)
    )
    # The clock: the coarsest power of ten that stamps are multiples of, s.
    sample = arrays.every(times, max(1, times.size // 10_000))
    ticks = ((exponent, sample * 10.0**exponent) for exponent in range(10))
    whole = (one for one, some in ticks if np.abs(some - np.rint(some)).max() < 1e-3)
    clock = next((float(10.0**-exponent) for exponent in whole), 0.0)
    # Sampling is uniform if no stamp is off its place by more than a millionth of a step. Stamps
    # are exact only to the last digit that was written, or that a float holds.
    slack = max(1e-6 * step, 1e-9 * clock, 4.0 * float(np.spacing(times[-1])))
    # The round figure that the rate cannot be told from, or the rate.
    rate, unsure = 1.0 / step, (min(worst, clock) + slack) / float(times[-1])
    rate = round_figure(rate, unsure)
    disagree = stated_rate is not None and abs(rate / stated_rate - 1.0) > RATE_AGREEMENT
    # Stamps that run back, as of two logs put together, have no rate, and are refused as such.
    if disagree and not marked_steps(times, lambda steps: steps < 0.0).any():
        problem = f"the stamps give {rate:.6g} Hz but {stated_rate:.6g} Hz is stated"
        remedy = "leave out {rate}, or ignore the stamps with {time none}"
        raise RecordingError(problem, channel="time", remedy=remedy)
    notes: tuple[Note, ...] = ()
    # A part in ten thousand is 0.005 % of N.
    if stated_rate is not None and abs(rate / stated_rate - 1.0) > max(unsure, 1e-4):
        text = f"{stated_rate:.6g} Hz is stated, and the stamps give {rate:.6g} Hz, which is taken"
        notes = (Note(text=text, channel="time"),)
    if worst <= slack:
        return Sampling(times=None, sample_rate=rate, notes=notes)
    is_uniform = worst <= 0.75 * clock < 0.75 * step
    off = f"stamps up to {worst:.3g} s off an even spacing"
    text = f"sampling is not uniform, mean rate {rate:.6g} Hz, {off}"
    if is_uniform:
        text = f"stamps are those of uniform sampling at {rate:.9g} Hz on a clock of {clock:g} s"
        text += ": taken as uniform"
    notes = (*notes, Note(text=text, channel="time"))
    return Sampling(times=None if is_uniform else times, sample_rate=rate, notes=notes)


def round_figure(rate: float, unsure: float) -> float:
    """The rate of the fewest decimals that a rate known to a share of `unsure` may be.

    Examples
    --------
    >>> round_figure(99.993, 1e-4), round_figure(99.993, 1e-6)
    (100.0, 99.993)
    """
    near = (round(rate, digits) for digits in range(10))
    return next((one for one in near if one > 0.0 and abs(one - rate) <= unsure * rate), rate)


def require_forwards(taken: Sampling) -> Sampling:
    """Refuse stamps that are missing or run backwards.

    Raises
    ------
    RecordingError
        With how many do, and when the first does.
    """
    times = taken.times
    if times is None:
        return taken
    missing, backwards = is_missing(times), marked_steps(times, lambda steps: steps < 0.0)
    problem, when = "", 0.0
    if missing.any():
        problem = f"{counted(number_of(missing), 'sample')} NaN or infinite, the first"
        when = first_of(missing) / taken.sample_rate
    elif backwards.any():
        problem = f"runs backwards {counted(number_of(backwards), 'time')}, first"
        when = float(times[first_of(backwards) - 1])
    if problem:
        raise RecordingError(f"{problem} at {when:.3f} s", channel="time", remedy=CORRECT_STAMPS)
    return taken


def _plausible(step: float) -> float:
    """The step, s.

    Raises
    ------
    RecordingError
        If no sensor samples as fast: the stamps are no times, or in another unit.
    """
    if step >= 1e-15:
        return step
    problem = f"the stamps are {step:.3g} s apart, faster than any sensor samples"
    remedy = "state their unit ({time COLUMN:UNIT}), or {time none} and {rate HZ}"
    raise RecordingError(problem, channel="time", remedy=remedy)


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
    float
        s, or NaN if there is no such interval.
    """
    steps = arrays.differences(times)
    kept = 0
    for block in arrays.blocks(steps.size):
        here = steps[block]
        here = here[np.isfinite(here) & ((here >= 0.0) if repeats else (here > 0.0))]
        steps[kept : kept + here.size] = here
        kept += here.size
    return float(np.median(steps[:kept], overwrite_input=True)) if kept else math.nan


# ---- slices ------------------------------------------------------------------------

Span = tuple[float | None, float | None]


@dataclass(frozen=True, slots=True, kw_only=True)
class Stretch:
    """The samples of a file that are taken, and when they were.

    Attributes
    ----------
    first, stop
        First sample of the file that is taken, and the one after the last.
    start
        Time of the first, s from the first sample of the file.
    sampling
        Rate and times of those taken.
    """

    first: int
    stop: int
    start: float
    sampling: Sampling

    @property
    def span_s(self) -> tuple[float, float]:
        """Start of the first sample and end of the last, s from the first of the file."""
        return self.start, self.start + (self.stop - self.first) / self.sampling.sample_rate


def stretch_of(
    samples: int, span: Span | None, rate: float | None, stamps: FloatArray | None = None
) -> Stretch:
    """The samples that lie in a span, their rate and their times.

    Parameters
    ----------
    samples
        In the file.
    span
        Start and stop to take, s from the first sample, or None for all.
    rate
        Samples per second that are stated, or None.
    stamps
        (two samples or more,) s from the first of the file; None for uniform samples.

    Raises
    ------
    RecordingError
        If fewer than two samples lie in the span, time does not run forwards, the stamps
        contradict the rate, or there is neither.
    """
    if stamps is None and rate is None:
        problem = "one sample or none is too few to tell a rate"
        raise RecordingError(problem, channel="time", remedy="give a longer file")

    def first_after(limit: float, known: int) -> int:
        if stamps is None:
            return min(samples, math.ceil(limit * (rate or 0.0) - 1e-6))
        return known + first_at(stamps[known:], limit)

    start, stop = span or (None, None)
    first = first_after(start, 0) if start else 0
    last = samples if stop is None else first_after(stop, first)
    if span is not None and last - first < 2:
        remedy = "widen {slice START:STOP}"
        raise RecordingError("fewer than two samples lie in the slice", remedy=remedy)
    if stamps is None:
        even = Sampling(times=None, sample_rate=rate or 0.0)
        return Stretch(first=first, stop=last, start=first / even.sample_rate, sampling=even)
    taken = sampling(stamps[first:last], rate)
    return Stretch(first=first, stop=last, start=float(stamps[first]), sampling=taken)


def first_at(times: FloatArray, limit: float) -> int:
    """First sample at or after `limit`, s; their number if there is none."""
    for block in arrays.blocks(times.size):
        # A stamp that misses the limit of a slice by a nanosecond is at it.
        reached = times[block] >= limit - 1e-9
        if reached.any():
            return int(block.start + reached.argmax())
    return times.size
