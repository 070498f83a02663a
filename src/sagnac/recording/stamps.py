"""Samples in time: stamps and the rate they give, stretches, and encoder readings that are held.

An encoder that is read 20 times a second stands in a recording of 200 samples a second as steps,
each ten samples long. At a table that turns by 40 deg/s the steps are 2 deg. Between its readings
the table's motion is smooth; so the readings are put at the times of the encoder's own clock, and
a spline goes through them.
"""

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from itertools import chain
from typing import Final

import numpy as np

from sagnac.core.arrays import (
    BooleanArray,
    FloatArray,
    IntegerArray,
    blocks,
    differences,
    elementwise,
    empty,
    every,
    is_finite,
    mean,
)
from sagnac.core.errors import Note, RecordingError

# ---- stretches ---------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class Tally:
    """How many places there are, and the first; -1 if there is none."""

    count: int
    first: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Stretch:
    """Samples from `first` up to, and not including, `after`."""

    first: int
    after: int

    @property
    def samples(self) -> int:
        """How many there are."""
        return self.after - self.first


@dataclass(frozen=True, slots=True, kw_only=True)
class Places:
    """The samples of a series for which a test holds.

    They are found anew at each pass, and none are kept: in a bad record there are as many as it
    has samples.

    Attributes
    ----------
    values
        (samples,) of any length.
    test
        Given the values of a block and of `following` samples more, says of each sample of the
        block whether it is such a place.
    following
        Samples after one that `test` looks at to judge it.
    """

    values: FloatArray
    test: Callable[[FloatArray], BooleanArray]
    following: int = 0

    def _by_blocks(self) -> Iterator[tuple[int, BooleanArray]]:
        for block in blocks(self.values.size - self.following):
            yield block.start, self.test(self.values[block.start : block.stop + self.following])

    def parts(self, later: int = 0) -> Iterator[IntegerArray]:
        """All of them, ascending, or the samples that lie by some `later`; part by part."""
        for start, here in self._by_blocks():
            yield start + later + np.flatnonzero(here)

    def all(self) -> IntegerArray:
        """All of them, ascending."""
        return np.concatenate([np.empty(0, dtype=np.int64), *self.parts()])

    def tally(self) -> Tally:
        """Count them."""
        count, first = 0, -1
        for start, here in self._by_blocks():
            more = int(np.count_nonzero(here))
            first = start + int(np.argmax(here)) if more and not count else first
            count += more
        return Tally(count=count, first=first)

    def longest_between(self, samples: int, *, later: int = 0) -> Stretch:
        """The longest stretch of `samples` without any of them, the first if two are as long.

        Parameters
        ----------
        samples
            Length of the record.
        later
            By how many samples the record's bad sample lies behind the place: 1 for steps.
        """
        return _longest(samples, self.parts(later))

    def edges(self) -> Iterator[IntegerArray]:
        """-1, the places and the last sample, each part from the last edge of the part before."""
        yield from _edges(self.parts(), self.values.size - 1)


def _edges(parts: Iterable[IntegerArray], last: int) -> Iterator[IntegerArray]:
    edge = -1
    for places in chain(parts, [np.array([last])]):
        if places.size:
            yield np.concatenate(([edge], places))
            edge = int(places[-1])


def longest_between(samples: int, places: IntegerArray) -> Stretch:
    """The longest stretch of `samples` without one of `places`, which ascend."""
    return _longest(samples, [places])


def _longest(samples: int, parts: Iterable[IntegerArray]) -> Stretch:
    longest = Stretch(first=0, after=0)
    for edges in _edges(parts, samples):
        lengths = np.diff(edges) - 1
        at = int(np.argmax(lengths))
        if lengths[at] > longest.samples:
            longest = Stretch(first=int(edges[at]) + 1, after=int(edges[at + 1]))
    return longest


def changes(values: FloatArray) -> BooleanArray:
    """Whether the sample behind each is another."""
    return np.asarray(values[1:] != values[:-1])


def is_not_finite(values: FloatArray) -> BooleanArray:
    """Whether values are NaN or infinite."""
    return ~np.isfinite(values)


# ---- held readings -----------------------------------------------------------------

# Readings are held if nearly all come at the ticks of a clock, to a sample, this slow at least.
_NEARLY_ALL: Final = 0.95
_SLOWER: Final = 1.5
# Fewer changes tell no clock.
_FEWEST: Final = 20
# More changes than this part of the samples are no steps.
_MOST_CHANGES: Final = 1.0 / _SLOWER


@dataclass(frozen=True, slots=True, kw_only=True)
class Clock:
    """When an encoder is read.

    Attributes
    ----------
    period
        Samples between readings.
    first
        Sample of the first of them, not whole.
    """

    period: float
    first: float


def clock_of(angle: FloatArray) -> Clock | None:
    """The clock of readings that are held between its ticks; None if they are not.

    Parameters
    ----------
    angle
        (samples,) readings, any unit; wrapped or running.

    Returns
    -------
    Clock or None
        None as well if any reading is missing.
    """
    if angle.size < _FEWEST or not np.isfinite(mean(angle)):
        return None
    steps = Places(values=angle, test=changes, following=1)
    # Counted first: the places of millions of them take far longer.
    if not _FEWEST <= steps.tally().count <= _MOST_CHANGES * angle.size:
        return None
    changed = steps.all() + 1
    gaps = np.diff(changed)
    usual = float(np.median(gaps))
    near = gaps[np.abs(gaps - usual) <= 1.0]
    if near.size < _NEARLY_ALL * gaps.size:
        return None
    period = float(near.mean())
    for _ in range(2):
        # Ticks between changes, and from those the period that fits them all.
        ticks = np.concatenate([[0], np.cumsum(np.rint(gaps / period))])
        period, first = np.polynomial.Polynomial.fit(ticks, changed, 1).convert().coef[::-1]
    late = changed - first - period * ticks
    on_time = np.abs(late - np.median(late)) <= 1.0
    if period < _SLOWER or on_time.mean() < _NEARLY_ALL:
        return None
    return Clock(period=float(period), first=float(first % period))


def at_ticks(angle: FloatArray, clock: Clock) -> FloatArray:
    """(ticks,) readings at the ticks of the clock at which they are read.

    Parameters
    ----------
    angle
        (samples,) readings that are held, any unit.
    clock
        As `clock_of` finds it.
    """
    # A reading stands from the first sample behind its tick to the next tick: half-way is safe.
    places = np.floor(_ticks(clock, angle.size) + 0.5 * clock.period).astype(np.int64)
    return angle[np.minimum(places, angle.size - 1)]


def between_ticks(readings: FloatArray, clock: Clock, samples: int) -> FloatArray:
    """(samples,) a running angle, in its unit, by a spline through the readings at the ticks.

    Before the first tick and after the last the table goes on at the rate that it has there.
    Beside a reading that is missing the angle is NaN.

    Parameters
    ----------
    readings
        (ticks,) as `at_ticks` gives them, unwrapped; NaN if missing.
    clock
        As `clock_of` finds it.
    samples
        Of the record.
    """
    # Imported here: it takes a sixth of a second that other recordings need not wait for.
    from scipy.interpolate import CubicSpline  # noqa: PLC0415

    ticks, there = _ticks(clock, samples), np.isfinite(readings)
    spline = CubicSpline(ticks[there], readings[there])
    result = empty(samples)
    for block in blocks(samples):
        at = np.arange(block.start, block.stop, dtype=np.float64)
        inside = np.clip(at, ticks[0], ticks[-1])
        place = (inside - ticks[0]) / clock.period
        before = np.minimum(place.astype(np.int64), ticks.size - 1)
        known = there[before] & there[np.minimum(before + 1, ticks.size - 1)]
        values = spline(inside) + spline(inside, 1) * (at - inside)
        result[block] = np.where(known, values, np.nan)
    return result


def _ticks(clock: Clock, samples: int) -> FloatArray:
    """(ticks,) times of readings in a record, samples."""
    return np.arange(clock.first, samples - 1.0, clock.period)


# ---- stamps ------------------------------------------------------------------------

# An interval longer than this many nominal steps is a gap: an error. Recorders that stamp on
# arrival, on a clock of 1 ms, repeat a stamp now and then and follow it with one of two steps,
# and a busy host holds a few samples back (stamps up to 4.4 steps apart at 100 Hz are known
# from sound recordings); from more than four samples missing, the angle turned meanwhile is a
# guess. Shorter ones are a remark.
GAP_STEPS: Final = 5.0
# Stamps closer than this, s, are no times, or in another unit.
_SHORTEST: Final = 1e-15
# Sampling is called uniform if no stamp is off its place by more than this share of a step.
UNIFORM: Final = 1e-6
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


def sampling(stamps: FloatArray, stated_rate: float | None = None) -> Sampling:
    """Rate and evenness of time stamps.

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
    times = elementwise(np.subtract, stamps, stamps[0])
    if times.size < 2 or not is_finite(times) or times[-1] <= 0.0:
        if stated_rate is not None:
            return Sampling(times=times, sample_rate=stated_rate)
        usual = median_step(times, repeats=False)
        if math.isnan(usual):
            raise RecordingError(
                "does not run forwards", channel="time", remedy="state {time none} and {rate HZ}"
            )
        return Sampling(times=times, sample_rate=1.0 / _plausible(usual))
    step = _plausible(float(times[-1]) / (times.size - 1))
    worst = _furthest_off(times, step)
    clock = _resolution(times)
    # Stamps are exact only to the last digit that was written, or that a float holds.
    slack = max(UNIFORM * step, 1e-9 * clock, 4.0 * float(np.spacing(times[-1])))
    rate = _tidy(1.0 / step, (min(worst, clock) + slack) / float(times[-1]))
    if stated_rate is not None and abs(rate / stated_rate - 1.0) > RATE_AGREEMENT:
        raise RecordingError(
            f"the stamps give {rate:.6g} Hz but {stated_rate:.6g} Hz is stated",
            channel="time",
            remedy="leave out {rate}, or ignore the stamps with {time none}",
        )
    if worst <= slack:
        return Sampling(times=None, sample_rate=rate)
    if worst <= 0.75 * clock < 0.75 * step:
        text = (
            f"stamps are those of uniform sampling at {rate:.9g} Hz on a clock of {clock:g} s: "
            "taken as uniform"
        )
        return Sampling(times=None, sample_rate=rate, notes=(Note(text=text, channel="time"),))
    text = (
        f"sampling is not uniform, mean rate {rate:.6g} Hz, stamps up to {worst:.3g} s "
        "off an even spacing"
    )
    return Sampling(times=times, sample_rate=rate, notes=(Note(text=text, channel="time"),))


def _plausible(step: float) -> float:
    """The step, s.

    Raises
    ------
    RecordingError
        If no sensor samples as fast: the stamps are no times, or in another unit.
    """
    if step >= _SHORTEST:
        return step
    raise RecordingError(
        f"the stamps are {step:.3g} s apart, faster than any sensor samples",
        channel="time",
        remedy="state their unit ({time COLUMN:UNIT}), or {time none} and {rate HZ}",
    )


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
    steps = differences(times)
    kept = 0
    for block in blocks(steps.size):
        here = steps[block]
        here = here[np.isfinite(here) & ((here >= 0.0) if repeats else (here > 0.0))]
        steps[kept : kept + here.size] = here
        kept += here.size
    return float(np.median(steps[:kept], overwrite_input=True)) if kept else math.nan


def _furthest_off(times: FloatArray, step: float) -> float:
    """Largest distance of a stamp from its place at an even `step`, s."""
    furthest = 0.0
    for block in blocks(times.size):
        off = np.arange(block.start, block.stop) * step
        off -= times[block]
        furthest = max(furthest, float(np.abs(off).max()))
    return furthest


def _resolution(times: FloatArray) -> float:
    """Clock step of the stamps: the coarsest power of ten that they are multiples of, s."""
    sample = every(times, max(1, times.size // 10_000))
    for exponent in range(0, 10):
        ticks = sample * 10.0**exponent
        if np.abs(ticks - np.rint(ticks)).max() < 1e-3:
            return float(10.0**-exponent)
    return 0.0


def _tidy(rate: float, uncertainty: float) -> float:
    """`rate`, or the round figure it cannot be told from (relative `uncertainty`)."""
    for digits in range(0, 10):
        rounded = round(rate, digits)
        if rounded > 0.0 and abs(rounded - rate) <= uncertainty * rate:
            return rounded
    return rate
