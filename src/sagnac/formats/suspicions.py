"""Statements that a file's numbers speak against: counters, stamps and kinds taken for others."""

import math
import re
from collections.abc import Mapping
from contextlib import suppress
from itertools import pairwise
from typing import Final

import numpy as np
from scipy.fft import rfft

from sagnac.core.arrays import FloatArray
from sagnac.core.errors import Note, RecordingError, counted
from sagnac.core.marks import marked_steps
from sagnac.core.units import DEGREE_PER_ROOT_HOUR, TIME_UNITS, canonical, unit_of
from sagnac.formats.choice import Choice, is_like_time
from sagnac.formats.source import Column, Source
from sagnac.formats.statement import COUNTER_BITS, Statements
from sagnac.recording import channel, columns
from sagnac.recording.stamps import Sampling, Span, Stretch

_LOOKED_AT: Final = 100_000
# Rates that recorders of gyros have, Hz.
_USUAL_RATES: Final = (1.0, 2e4)
_BLOCKS: Final = 64
# Bands of ordinates of such a block that are level to this factor if its low frequencies are white:
# those of a random walk differ twentyfold.
_BANDS: Final = (2, 5, 11, 24)
_LEVEL: Final = 1.5
_LEAST_SAMPLES: Final = 10 * _BLOCKS


def roll_overs(readings: FloatArray, extent: float) -> tuple[int, float] | None:
    """How often readings start over, and at what, in their own unit; None if they do not.

    They start over by steps that cover most of the range. What a reading changes by there beyond
    the usual step is the period.

    Parameters
    ----------
    readings
        (samples,), in any unit.
    extent
        Largest less smallest of them.
    """
    if readings.size < 3 or extent <= 0.0:
        return None
    steps = np.diff(readings[:_LOOKED_AT])
    steps = steps[np.isfinite(steps)]
    # A step is a roll-over if it covers more than this part of the range, and the usual ones less
    # than a tenth: no gyro turns through most of its range from one sample to the next.
    limit = 0.75 * extent
    usual = np.abs(steps[np.abs(steps) <= limit])
    if usual.size < 2 or float(np.quantile(usual, 0.99)) > 0.1 * extent:
        return None
    places = np.flatnonzero(marked_steps(readings, lambda step: np.abs(step) > limit))
    if not places.size:
        return None
    leap = float(np.median(readings[places] - readings[places - 1]))
    return int(places.size), abs(leap - float(np.median(steps[np.abs(steps) <= limit])))


def counter_notes(name: str, raw: FloatArray, kind: channel.Kind, unit: str) -> tuple[Note, ...]:
    """A gyro's raw numbers that look like those of a counter, while none is stated: a warning."""
    some = raw[:_LOOKED_AT]
    finite = some[np.isfinite(some)]
    if not np.array_equal(finite, np.rint(finite)):
        return ()
    extent = channel.finite_extent(raw)
    bits = next((bits for bits in COUNTER_BITS if extent < 2.0**bits), None)
    wraps = None if bits is None else roll_overs(raw, extent)
    if bits is None or wraps is None:
        # No gyro reads out so coarsely, and one value is no reading.
        if canonical(unit) not in ("deg/s", "rad/s") or finite.size < _LEAST_SAMPLES or not extent:
            return ()
        fact = f"all samples are whole numbers of {unit}, as counts would be"
        text = f"{fact}; if they are counts, state {{unit counts}} and {{scale}}"
        return (Note(name="units", level="warning", channel=name, text=text),)
    (count, period), is_angle = wraps, kind == "angle"
    size, what = f"{2**bits}", f"a {bits} bit counter that rolls over"
    remedy = f"state {{counter-bits {bits}}}"
    if abs(period / 2.0**bits - 1.0) <= 0.05:
        if not is_angle:
            remedy = f"if it counts angle, state {{kind angle}} and {{counter-bits {bits}}}"
    elif is_angle and period >= 100.0:
        # No counter starts over after fewer counts.
        likely = _likely_period(period)
        size = f"{likely:.7g}"
        what = "a counter that starts over there, which is no number of bits"
        remedy = f"state {{counter-period {likely:.12g}}}"
    else:
        return ()
    text = f"leaps by about {size} counts {counted(count, 'time')}: {what}; {remedy}"
    # On numbers that are stated to be an angle it is the finding that spoils it.
    return (Note(name="wraps" if is_angle else "", level="warning", channel=name, text=text),)


def table_counter_notes(key: str, raw: FloatArray, unit: str) -> tuple[Note, ...]:
    """Encoder readings that start over elsewhere than at a turn of their unit: a warning."""
    turn = 2.0 * math.pi / unit_of(unit, "angle").size
    wraps = roll_overs(raw, channel.finite_extent(raw))
    # No counter has ten places in a turn or fewer; damaged readings may seem to.
    if wraps is None or not wraps[1] > 10.0:
        return ()
    period = _likely_period(wraps[1])
    bits, is_whole = math.log2(period), np.array_equal(raw[:_LOOKED_AT], np.rint(raw[:_LOOKED_AT]))
    # Below a turn readings may leap for another reason, unless a counter has that many places.
    if not (period > 1.001 * turn or (period < 0.95 * turn and bits.is_integer() and is_whole)):
        return ()
    problem = f"starts over at {period:.7g} {unit}, not at a full turn: it looks like a counter"
    text = f"{problem}; if that is one turn, state {{table {key}:{360.0 / period:.12g}deg}}"
    if bits.is_integer():
        text += f"; if {unit} is right, state {{counter-bits {bits:g}}}"
    return (Note(level="warning", channel="table", text=text),)


def _likely_period(measured: float) -> float:
    """The power of two, or round number of parts of a turn, that a period was measured as."""
    round_ones = [2.0**bits for bits in range(8, 33)] + [36.0 * 10**n for n in range(1, 8)]
    nearest = min(round_ones, key=lambda one: abs(math.log(measured / one)))
    return nearest if abs(measured / nearest - 1.0) < 0.02 else round(measured)


def stamp_unit_notes(column: Column, sample_rate: float) -> tuple[Note, ...]:
    """Stamps further apart, or closer together, than any gyro is sampled: a warning.

    Parameters
    ----------
    column
        That of the stamps, in the unit that is stated.
    sample_rate
        Samples per second that they give.
    """
    key, unit = column.name, column.unit or ""
    if canonical(unit) not in TIME_UNITS or 0.01 <= sample_rate <= _USUAL_RATES[1]:
        return ()
    size = TIME_UNITS[canonical(unit)]
    likely = likely_time_unit(1.0 / (sample_rate * size))
    # Far outside of the usual rates the unit is wrong, whichever is right.
    if sample_rate <= 1e6 and likely is None:
        return ()
    text = f"stamps are {1.0 / sample_rate:.3g} s apart on average: the unit {unit} looks wrong"
    if likely is not None:
        rate = sample_rate * size / TIME_UNITS[likely]
        text += f"; in {likely} they would be those of {rate:.6g} Hz ({{time {key}:{likely}}})"
    return (Note(name="units", level="warning", channel="time", text=text),)


def likely_time_unit(step: float) -> str | None:
    """The unit in which stamps so far apart would be those of a usual rate, None if there is none.

    Parameters
    ----------
    step
        Mean step of the stamps, in their unit.

    Examples
    --------
    >>> likely_time_unit(0.01), likely_time_unit(1e7), likely_time_unit(0.01 / 86400.0)
    ('s', 'ns', 'd')
    """
    rates = {unit: 1.0 / (step * TIME_UNITS[unit]) for unit in ("s", "ms", "us", "ns", "d")}
    low, high = _USUAL_RATES
    usual = {unit: rate for unit, rate in rates.items() if low <= rate <= high}
    # A usual rate is most often near 200 Hz.
    return min(usual, key=lambda unit: abs(math.log(usual[unit] / 200.0)), default=None)


def rate_notes(name: str, values: FloatArray) -> tuple[Note, ...]:
    """An angle that scatters about one value as a rate does and never adds up: a warning.

    A rate's samples are nearly independent, also behind a low-pass if they lie far enough apart,
    and means over blocks of them agree; an angle is the sum of what was turned, and goes on from
    sample to sample.

    Parameters
    ----------
    name
        Of the gyro.
    values
        (samples,) of kind ``angle``.
    """
    if values.size < _LEAST_SAMPLES:
        return ()
    blocks = _blocks(values)
    within = math.sqrt(float(np.mean(np.var(blocks, axis=1))))
    step = math.sqrt(float(np.mean(np.square(np.diff(blocks, axis=1)))))
    between = float(np.std(np.mean(blocks, axis=1)))
    if not (within > 0.0 and between < 0.5 * within):
        return ()
    if not step > within:
        # Behind a low-pass: what scatters is no more than the level at low frequency makes.
        level = _flat_level(blocks)
        if level is None or not within**2 < _LEVEL * level:
            return ()
    problem = "stays about one value and scatters from sample to sample as a rate does"
    text = f"{problem}; if it is one, state {{kind rate}} with its {{unit}}"
    return (Note(name="units", level="warning", channel=name, text=text),)


def increment_notes(name: str, values: FloatArray, sample_rate: float) -> tuple[Note, ...]:
    """Increments whose white noise is above that of any gyro: a warning.

    Rates that are called increments have noise that is the sample rate times too large.

    Parameters
    ----------
    name
        Of the gyro.
    values
        (samples,) of kind ``increment``, rad.
    sample_rate
        Hz.
    """
    level = _flat_level(_blocks(values)) if values.size >= _LEAST_SAMPLES else None
    # No gyro has more white noise than 10 deg/sqrt(h): the worst have 6.
    if level is None or not level * sample_rate > (10.0 * DEGREE_PER_ROOT_HOUR) ** 2:
        return ()
    walk = math.sqrt(level * sample_rate) / DEGREE_PER_ROOT_HOUR
    problem = f"its white noise would be {walk:.3g} deg/sqrt(h), more than that of any gyro"
    text = f"{problem}; if the numbers are rates, state {{kind rate}} with their {{unit}}"
    return (Note(name="units", level="warning", channel=name, text=text),)


def _blocks(values: FloatArray) -> FloatArray:
    """(64, samples) of equal length from all over a record."""
    length = min(values.size // _BLOCKS, _LOOKED_AT // _BLOCKS)
    starts = np.linspace(0, values.size - length, _BLOCKS).astype(int)
    return np.array([values[start : start + length] for start in starts])


def _flat_level(blocks: FloatArray) -> float | None:
    """Variance that white noise of the level at low frequency has; None if that is not level."""
    if blocks.shape[1] < 2 * _BANDS[-1]:
        return None
    window = np.hanning(blocks.shape[1])
    with np.errstate(over="ignore", invalid="ignore"):
        # What is not finite is named elsewhere.
        spectra = rfft((blocks - blocks.mean(axis=1)[:, np.newaxis]) * window)
        power = np.mean(np.abs(spectra) ** 2, axis=0)
    levels = [float(power[low:high].mean()) for low, high in pairwise(_BANDS)]
    if not max(levels) < _LEVEL * min(levels):
        return None
    return float(np.mean(levels)) / float(np.sum(window**2))


# ---- unused ------------------------------------------------------------------------

_COUNTER: Final = re.compile(
    r"(?i)(?:^|[^a-z])(?:count(?:er)?s?|cnt|seq(?:uence)?|samples?|index|idx|frames?|packets?|pkt|"
    r"nr|no|num(?:ber)?|row|n|#|zähler|lfd)(?:$|[^a-z])"
)


def force_notes(gyros: Mapping[str, Column]) -> list[Note]:
    """On gyros whose columns are named as those of accelerometers."""
    problem = "its column is named as that of an accelerometer, and it is read as a gyro"
    problem += "; if it is an accelerometer, state {{accelerometers {key}}} beside a gyro"
    return [
        Note(name="units", level="warning", channel=name, text=problem.format(key=column.key))
        for name, column in gyros.items()
        if column.name.lower() in columns.ACCELEROMETER_NAMES
    ]


def slice_notes(span: Span | None, stretch: Stretch) -> list[Note]:
    """On a slice that asks for more than the file has."""
    last = stretch.span_s[1]
    if span is None or span[1] is None or span[1] <= last + 1.0 / stretch.sampling.sample_rate:
        return []
    text = f"the slice asks for samples up to {span[1]:.9g} s and the file ends at {last:.9g} s"
    return [Note(text=text)]


def unused_notes(
    source: Source, choice: Choice, statements: Statements, stretch: Stretch
) -> list[Note]:
    """Samples that a counter beside the columns that are taken shows to be missing.

    Raises
    ------
    RecordingError
        If time stamps that are not taken contradict the rate that is stated.
    """
    notes: list[Note] = []
    for column in source.columns:
        if column.key in choice.keys:
            continue
        if is_like_time(column):
            if choice.time is None and statements.role("time") != "none":
                _require_rate(column, _loaded(source, column, stretch), stretch.sampling)
        elif _COUNTER.search(column.name) and not notes:
            notes += _lost(column.key, _loaded(source, column, stretch), stretch)
    return notes


def _require_rate(column: Column, stamps: FloatArray, sampling: Sampling) -> None:
    """Refuse a rate that even stamps contradict, in whatever unit of time they may be.

    Raises
    ------
    RecordingError
        It names the rate that they give.
    """
    steps = np.diff(stamps)
    usual = float(np.median(steps)) if steps.size else 0.0
    # A column without a unit that goes 0, 1, 2 numbers the rows.
    is_number = usual == 1.0 and column.unit is None
    if not usual > 0.0 or is_number or not _mostly(np.abs(steps - usual) < 0.5 * usual):
        return
    step, stated = float(stamps[-1] - stamps[0]) / steps.size, sampling.sample_rate
    own = canonical(column.unit or "")
    units = (own,) if own in TIME_UNITS else tuple(TIME_UNITS)
    rates = {unit: 1.0 / (step * TIME_UNITS[unit]) for unit in units}
    unit = own if own in TIME_UNITS else likely_time_unit(step)
    agree = any(abs(rate / stated - 1.0) < 0.02 for rate in rates.values())
    if unit is not None and not agree:
        rate = f"{rates[unit]:.6g}"
        problem = f"its stamps are those of {rate} Hz in {unit}, and {stated:.6g} Hz is stated"
        remedy = f"state {{rate {rate}}} or {{time {column.name}:{unit}}}, or ignore the stamps "
        raise RecordingError(problem, channel=column.key, remedy=remedy + "with {time none}")


def _lost(key: str, counts: FloatArray, stretch: Stretch) -> tuple[Note, ...]:
    """Samples that a counter leaves out: a warning; nothing if the column is no counter."""
    steps = np.diff(counts)
    usual = float(np.median(steps)) if steps.size else 0.0
    is_whole = np.array_equal(counts, np.rint(counts))
    if usual == 0.0 or not is_whole or not _mostly(steps == usual):
        return ()
    ahead, one = steps * np.sign(usual), abs(usual)
    if (back := ahead < 0.0).any():
        # It starts over at what most of its falls come to.
        falls, often = np.unique(one - ahead[back], return_counts=True)
        ahead = np.where(back, ahead + falls[int(np.argmax(often))], ahead)
    places = np.flatnonzero((ahead > one) & (np.mod(ahead, one) == 0.0))
    if places.size == 0:
        return ()
    missing = int((np.rint(ahead[places] / one) - 1.0).sum())
    at = stretch.start + (int(places[0]) + 1) / stretch.sampling.sample_rate
    lost, where = counted(missing, "sample"), counted(places.size, "place")
    fact = f"counts {lost} that are not there, at {where}, the first at {at:.3f} s: they were lost"
    text = f"{fact}; take a stretch without such a place with {{slice}}"
    return (Note(level="warning", channel=key, text=text),)


def _mostly(usual: np.ndarray) -> bool:
    return bool(np.count_nonzero(usual) >= 0.9 * usual.size)


def _loaded(source: Source, column: Column, stretch: Stretch) -> FloatArray:
    """The numbers of a column that is not taken; none if they cannot be read or are not finite."""
    with suppress(RecordingError):
        values = source.stamps(column.key, stretch.first, stretch.stop)
        if values.size > 1 and np.isfinite(values).all():
            return values
    return np.empty(0)
