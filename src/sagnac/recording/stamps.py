"""Time stamps: the rate they give, and whether they are those of uniform sampling."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from sagnac import series
from sagnac.arrays import FloatArray, IntegerArray
from sagnac.errors import Note, RecordingError

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

    Raises
    ------
    ValueError
        If the rate is not above zero.
    """

    times: FloatArray | None
    sample_rate: float
    notes: tuple[Note, ...] = ()

    def __post_init__(self) -> None:
        if not self.sample_rate > 0.0:
            raise ValueError(
                f"sample_rate is {self.sample_rate!r}; give samples per second, above zero"
            )


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
    times = series.less(stamps, stamps[0])
    finite = all(series.map(lambda block: np.isfinite(times[block]).all(), times.size, times))
    if times.size < 2 or not finite or times[-1] <= 0.0:
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

    def usable(block: slice) -> FloatArray:
        steps = np.diff(times[block.start : block.stop + 1])
        return steps[np.isfinite(steps) & ((steps >= 0.0) if repeats else (steps > 0.0))]

    size = max(times.size - 1, 0)
    if not series.is_mapped(times):
        steps = usable(slice(0, size))
        return float(np.median(steps)) if steps.size else math.nan

    def counts(found: int, shift: int) -> IntegerArray:
        """How many intervals continue the bits `found` by each of the sixteen next ones."""

        def add(so_far: IntegerArray, block: slice) -> IntegerArray:
            bits = usable(block).view(np.int64)
            bits = bits[bits >> (shift + 16) == found] if shift < 48 else bits
            so_far += np.bincount((bits >> shift) & 0xFFFF, minlength=2**16)
            return so_far

        return series.reduce(add, np.zeros(2**16, dtype=np.int64), size, times)

    def ranked(rank: int) -> float:
        # Floats that are not negative are ordered as the integers of the same bits; those are
        # found sixteen at a time, by counting.
        found = 0
        for shift in (48, 32, 16, 0):
            here = counts(found, shift)
            until = np.cumsum(here)
            digit = int(np.searchsorted(until, rank, side="right"))
            rank -= int(until[digit] - here[digit])
            found = found << 16 | digit
        return float(np.int64(found).view(np.float64))

    number = sum(series.map(lambda block: usable(block).size, size, times))
    if number == 0:
        return math.nan
    return float(np.mean([ranked((number - 1) // 2), ranked(number // 2)]))


def _furthest_off(times: FloatArray, step: float) -> float:
    """Largest distance of a stamp from its place at an even `step`, s."""

    def furthest(block: slice) -> float:
        off = np.arange(block.start, block.stop) * step
        off -= times[block]
        return max(float(off.max()), -float(off.min()))

    return max(0.0, *series.map(furthest, times.size, times))


def _resolution(times: FloatArray) -> float:
    """Clock step of the stamps: the coarsest power of ten that they are multiples of, s."""
    sample = series.every(times, max(1, times.size // 10_000))
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
