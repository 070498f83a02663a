"""Encoder readings made the angle of a table: held and missing ones found, filled, unwrapped.

An encoder on a bus drops a reading now and then. Recorders mark it by NaN, by a value off the
table's path (0, -1, full scale), or not at all: the reading before stands there once more. A table
is heavy and its angle smooth, so an isolated reading can be told from its neighbours; a gyro
sample never can, since its noise is what is measured.

An encoder that is read 20 times a second stands in a recording of 200 samples a second as steps,
each ten samples long: its readings are put at the times of its own clock, and a spline goes through
them. Readings that were lost for longer than a polynomial bridges are taken from a gyro: its turn
between the last reading and the next one, divided by its share of the table's rate and tilted to
meet both, is the table's. It is off by no more than the gyro's own noise, and by as little of its
wrong share as the rate changes meanwhile.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from sagnac.core import arrays
from sagnac.core.arrays import BooleanArray, FloatArray, IntegerArray
from sagnac.core.errors import Note, counted
from sagnac.core.marks import is_missing, marked, marked_steps, number_of, stretches
from sagnac.core.units import ARCSECOND, DEGREE, unit_of
from sagnac.recording.channel import Channel, Conversion, angle_of, finite_extent, unwrapped

# As many missing encoder samples in a row are interpolated: as with time stamps, the angle turned
# during a longer run is a guess, unless a gyro tells it. If more than this share is missing, the
# gaps come close to one another, and it is no recording but what is left of one.
MOST_MISSING_IN_A_ROW: Final = 4
LARGEST_SHARE_MISSING: Final = 0.05
# Rows of an array that are worked on at once.
_AT_ONCE: Final = 2**14
# A table that moves by more than this part of the range between two samples may have gone either
# way round.
_IN_DOUBT: Final = 0.25
_NONE: Final[IntegerArray] = np.empty(0, dtype=np.int64)


def table_of_readings(
    readings: FloatArray, unit: str, *, counter_period: float | None = None
) -> Conversion:
    """The table whose encoder gives these readings.

    Readings that stand for missing ones are marked, isolated missing ones interpolated; where
    the readings start over, they are made continuous. They start over at a full turn, unless
    they cover more than one: then they are a running angle, or a counter wider than a turn. If the
    encoder is slower than the recording, so that its readings are held, a spline goes through them.

    Parameters
    ----------
    readings
        (samples,) in `unit`. They are worked on in place.
    unit
        Of angle, ``deg``; of a counter that of one count, ``0.1arcsec``.
    counter_period
        Reading at which counters start over, if they do.

    Returns
    -------
    Conversion
        Samples that stay missing are NaN.

    Raises
    ------
    ValueError
        If `unit` is not one of angle.
    """
    size = unit_of(unit, "angle", "table_unit").size
    turn = 2.0 * math.pi / size
    samples, clock = readings.size, clock_of(readings)
    if clock is not None:
        # What repeats the reading at the tick before was lost.
        readings = at_ticks(readings, clock)
    off_path, reading, repeated = mark_missing(readings, turn)
    remarks = []
    if off_path:
        alike = "" if reading is None else f", all reading {reading:.6g} {unit}"
        remarks.append(f"{counted(off_path, 'sample')} off its path{alike}: taken as missing")
    if repeated:
        remarks.append(f"{counted(repeated, 'repeated sample')} while it turns: taken as missing")
    period, covered = turn, finite_extent(readings)
    # Readings that go beyond a turn by a thousandth at most may start over there all the same.
    starts_over = covered < 1.001 * turn and _largest_step(readings) > (1.0 - _IN_DOUBT) * turn
    if covered > turn * (1.0 + 1e-9) and not starts_over:
        period = counter_period if counter_period and covered < counter_period else math.inf
    elif counter_period and covered < counter_period < turn:
        period = counter_period
    # Twice the periodic error that an encoder may have: what an interpolated reading may be off by.
    filled, longest, error = fill_missing(readings, period, accuracy=10.0 * ARCSECOND / size)
    if filled:
        met = f" (known ones are met to {error * size / ARCSECOND:.2g} arcsec)"
        fact = f"{counted(filled, 'missing sample')}, at most {longest} in a row, interpolated from"
        remarks.append(f"{fact} their neighbours{met if math.isfinite(error) else ''}")
    running, wraps = unwrapped(readings, period)
    if wraps:
        remarks.append(f"unwrapped where it starts over, {counted(wraps, 'time')}")
    notes = [Note(text=text, channel="table") for text in remarks]
    largest = _largest_step(running) / period
    if largest > _IN_DOUBT:
        text = f"moves by up to {largest:.2f} of its range between samples; unwrapping is in doubt"
        notes.append(Note(text=text, channel="table", level="warning"))
    if clock is not None:
        running = between_ticks(running, clock, samples)
        held = f"read every {clock.period:.4g} samples and held between"
        notes.append(Note(text=f"{held}: a spline goes through its readings", channel="table"))
    table = Channel.from_values("table", running, kind="angle", unit=unit, out=running)
    return Conversion(channel=table, notes=tuple(notes))


def _largest_step(values: FloatArray) -> float:
    """Largest step between two samples that are there."""
    ends = values[:-1], values[1:]
    with np.errstate(invalid="ignore"):
        steps = arrays.by_blocks(lambda here, later: np.fmax.reduce(np.abs(later - here)), *ends)
    return float(np.fmax.reduce(steps, initial=0.0))


def _folded(steps: FloatArray, period: float) -> FloatArray:
    """Steps by the shorter way round; NaN for those to or from an infinite reading."""
    return steps if np.isinf(period) else np.asarray(steps - period * np.rint(steps / period))


# ---- held readings -----------------------------------------------------------------

# Readings are held if nearly all come at the ticks of a clock, to a sample, this slow at least.
_NEARLY_ALL: Final = 0.95
_SLOWER: Final = 1.5
# Fewer changes tell no clock.
_FEWEST: Final = 20


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

    def ticks(self, samples: int) -> FloatArray:
        """(ticks,) times of readings in a record, samples."""
        return np.arange(self.first, samples - 1.0, self.period)


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
    if angle.size < _FEWEST or not np.isfinite(arrays.mean(angle)):
        return None
    changes = marked(np.not_equal, angle[1:], angle[:-1])
    # Counted first: the places of millions of them take far longer. More changes are no steps.
    if not _FEWEST <= number_of(changes) <= angle.size / _SLOWER:
        return None
    changed = np.flatnonzero(changes) + 1
    gaps = np.diff(changed)
    near = gaps[np.abs(gaps - float(np.median(gaps))) <= 1.0]
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
    places = np.floor(clock.ticks(angle.size) + 0.5 * clock.period).astype(np.int64)
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

    ticks, there = clock.ticks(samples), np.isfinite(readings)
    spline = CubicSpline(ticks[there], readings[there])
    result = arrays.empty(samples)
    for block in arrays.blocks(samples):
        at = np.arange(block.start, block.stop, dtype=np.float64)
        inside = np.clip(at, ticks[0], ticks[-1])
        place = (inside - ticks[0]) / clock.period
        before = np.minimum(place.astype(np.int64), ticks.size - 1)
        known = there[before] & there[np.minimum(before + 1, ticks.size - 1)]
        values = spline(inside) + spline(inside, 1) * (at - inside)
        result[block] = np.where(known, values, np.nan)
    return result


# ---- readings that stand for missing ones ------------------------------------------

# A reading is held if the table steps evenly, to this part, apart from steps of nothing that the
# next one makes up for.
_EVEN: Final = 0.125
_HELD_LOOK_BACK: Final = 64


def mark_missing(values: FloatArray, turn: float) -> tuple[int, float | None, int]:
    """Set readings that stand for missing ones to NaN, in place.

    Marked are readings off the table's path, if no more of them follow one another than can be
    interpolated. If all of them read the same, every other sample that reads so is marked too,
    since near the path it cannot be told from a reading, unless it is one of a long row. Marked
    are also readings held: the one before once more, or several times, while the table turns,
    made up for by the step after.

    Parameters
    ----------
    values
        (samples,) readings, wrapped or not.
    turn
        Reading of a full turn.

    Returns
    -------
    off_path
        How many lay off the table's path.
    reading
        What all of those read; None where they differ, or there are none.
    held
        How many repeated the one before while the table turned.
    """
    # Steps between infinite readings are no finding.
    with np.errstate(invalid="ignore"):
        held, off_path = _held(values, turn), _off_path(values, turn)
    readings = values[off_path]
    same = readings.size > 0 and bool((readings == readings[0]).all())
    if same:
        # A table may stand at this reading for long.
        firsts, afters = stretches(marked(lambda some: some == readings[0], values))
        few = afters - firsts <= MOST_MISSING_IN_A_ROW
        off_path = np.union1d(off_path, _ranges(firsts[few], afters[few]))
    values[held] = np.nan
    values[off_path] = np.nan
    return off_path.size, float(readings[0]) if same else None, held.size


def _ranges(firsts: IntegerArray, afters: IntegerArray) -> IntegerArray:
    """Samples of stretches, ascending."""
    lengths = afters - firsts
    return np.arange(lengths.sum()) + np.repeat(afters - np.cumsum(lengths), lengths)


def _off_path(values: FloatArray, turn: float) -> IntegerArray:
    """Samples that leave the table's path and are back within `MOST_MISSING_IN_A_ROW` samples."""
    usual_steps = np.abs(_folded(arrays.some_steps(values, 100_000), turn))
    usual_steps = usual_steps[np.isfinite(usual_steps)]
    if usual_steps.size == 0:
        return _NONE
    usual = float(np.quantile(usual_steps, 0.9))
    # A reading is off the path if it leaves by more than five usual steps, than a degree and than
    # a count of a coarse encoder, and is back within `MOST_MISSING_IN_A_ROW` samples: no table does
    # that.
    count = float(usual_steps[usual_steps > 0.0].min(initial=turn))
    limit = max(5.0 * usual, turn / 360.0, 1.5 * count)
    large = marked_steps(values, lambda steps: np.abs(_folded(steps, turn)) > limit)[1:]
    if number_of(large) > 2.0 * LARGEST_SHARE_MISSING * values.size + 2:
        # That is how this table moves.
        return _NONE
    places = np.flatnonzero(large)
    sizes = _folded(values[places + 1] - values[places], turn).tolist()
    off: list[IntegerArray] = [_NONE]
    number = 0
    while number + 1 < places.size:
        out, back = int(places[number]), int(places[number + 1])
        there, home = sizes[number], sizes[number + 1]
        # The table makes its usual steps meanwhile.
        rest = abs(there + home) - (back - out + 1) * usual
        returns = there * home < 0.0 and rest <= 0.25 * min(abs(there), abs(home))
        if back - out <= MOST_MISSING_IN_A_ROW and returns:
            off.append(np.arange(out + 1, back + 1))
            number += 1
        number += 1
    return np.concatenate(off)


def _held(values: FloatArray, turn: float) -> IntegerArray:
    """Samples that repeat the one before while the table turns evenly, missing ones left out.

    A missing reading counts as one more repetition: the step behind it makes up for both.
    """
    values, marks = _carried(values)
    # Step n leads from sample n to the next.
    still = marked_steps(values, lambda steps: steps == 0.0)[1:]
    firsts, afters = stretches(still)
    inside = (firsts > 0) & (afters < still.size)
    # The step that makes up for steps of nothing, and the last one before them.
    before, late = firsts[inside] - 1, afters[inside]
    if late.size == 0:
        return _NONE

    def smallest_change(first: FloatArray, second: FloatArray, third: FloatArray) -> float:
        changes = np.abs((third - second) - (second - first))
        # Changes below this part of a turn are rounding of readings, not their resolution.
        return float(changes[changes > 1e-10 * turn].min(initial=turn))

    # The resolution of the readings.
    count = float(arrays.by_blocks(smallest_change, values[:-2], values[1:-1], values[2:]).min())
    is_held = np.zeros(late.size, dtype=np.bool_)
    # Eight steps are looked at on either side.
    ahead = np.arange(1, 9)
    for some in arrays.blocks(late.size, _AT_ONCE):
        start, stop = before[some], late[some]
        typical, agree = _typical(values, stop[:, np.newaxis] + ahead, turn)
        # Where more readings are held ahead, or the record ends, those behind may tell.
        typical_behind, agree_behind = _typical(values, start[:, np.newaxis] + 1 - ahead, turn)
        typical = np.where(agree_behind > agree, typical_behind, typical)
        due = (stop - start) * typical
        rest = np.abs(_folded(values[stop + 1] - values[stop] - due, turn))
        back = start[:, np.newaxis] - np.arange(_HELD_LOOK_BACK)
        earlier = (still[np.maximum(back, 0)] & (back >= 0)).sum(axis=1)
        # A table slower than some counts a sample repeats its readings anyway, and often.
        is_fast = (_EVEN * np.abs(typical) > count) | (earlier < 0.1 * _HELD_LOOK_BACK)
        # Six of them have to agree. Where others are held or lost on both sides, the two together
        # tell: eight of both.
        is_sure = (np.maximum(agree, agree_behind) >= 6) | (agree + agree_behind >= 8)
        is_held[some] = (rest < _EVEN * np.minimum(np.abs(due), turn)) & is_fast & is_sure
    held = _ranges(before[is_held] + 2, late[is_held] + 1)
    return held[~marks[held]]


def _carried(values: FloatArray) -> tuple[FloatArray, BooleanArray]:
    """Readings with the last one before each that is missing in its place; and which are missing.

    Missing ones at the beginning stay so.
    """
    marks = is_missing(values)
    firsts, afters = stretches(marks)
    firsts, afters = firsts[firsts > 0], afters[firsts > 0]
    if firsts.size:
        values = arrays.elementwise(np.add, values, 0.0)
        values[_ranges(firsts, afters)] = np.repeat(values[firsts - 1], afters - firsts)
    return values, marks


def _typical(values: FloatArray, at: IntegerArray, turn: float) -> tuple[FloatArray, IntegerArray]:
    """(rows,) median of the steps at (rows, some) places, and how many of them are about that.

    None are if a place lies outside the steps.
    """
    inside = np.asarray(((at >= 0) & (at < values.size - 1)).all(axis=1))
    at = np.where(inside[:, np.newaxis], at, 0)
    rows = _folded(values[at + 1] - values[at], turn)
    middle: FloatArray = np.asarray(np.median(rows, axis=1, keepdims=True))
    even = np.abs(rows - middle) < _EVEN * np.abs(middle)
    return middle[:, 0], np.asarray(even.sum(axis=1) * inside)


# ---- interpolation -----------------------------------------------------------------

# Interpolation takes two readings on each side; a third on each side tells what it may be wrong by.
_SIDE: Final = 2
_WIDE_SIDE: Final = 3


def fill_missing(values: FloatArray, period: float, *, accuracy: float) -> tuple[int, int, float]:
    """Interpolate isolated NaN from their neighbours, in place.

    Interpolation is by a cubic through two readings on each side. These stay missing: runs of
    more than `MOST_MISSING_IN_A_ROW`; all, if more than `LARGEST_SHARE_MISSING` of the samples are
    missing or any is infinite; those at the ends; and those during which the table moved unevenly,
    which shows if a quintic through three readings on each side disagrees by more than `accuracy`
    and by more than ten times what the cubic errs on known samples.

    Parameters
    ----------
    values
        (samples,) readings.
    period
        Reading at which they start over, inf if they do not. What is filled in continues the
        readings before it, and may lie a little beyond the period.
    accuracy
        Error that does no harm, in the unit of `values`.

    Returns
    -------
    samples
        How many were interpolated.
    longest
        Samples in the longest run of them.
    error
        95 % of known samples, in runs as long, are met by the interpolation to this; NaN where
        nothing was filled or too little is known. In the unit of the readings.
    """
    marks, samples, longest, error = is_missing(values), 0, 0, math.nan
    few = number_of(marks) <= LARGEST_SHARE_MISSING * values.size
    missing = np.flatnonzero(marks) if few else _NONE
    if missing.size == 0 or np.isinf(values[missing]).any():
        return samples, longest, error
    firsts, afters = stretches(marks)
    for length in range(1, MOST_MISSING_IN_A_ROW + 1):
        starts = firsts[afters - firsts == length]
        usual = _error_on_known(values, length, period)
        # It is trusted to ten times the error that known samples show.
        limit = max(accuracy, 10.0 * usual) if np.isfinite(usual) else accuracy
        good = 0
        for some in arrays.blocks(starts.size, _AT_ONCE):
            around = _nearest(missing, starts[some], length, values.size)
            usable = around[:, 0] >= 0
            here, around = starts[some][usable], around[usable]
            cubic, quintic = _interpolated(values, here, around, length, period)
            doubt = np.abs(cubic - quintic).max(axis=1)
            across = np.abs(_continued(values, around, period)[:, _WIDE_SIDE])
            # If a step exceeds a quarter of the period, the shorter way round is in doubt.
            sure = (doubt <= limit) & (across < _IN_DOUBT * period)
            values[here[sure, np.newaxis] + np.arange(length)] = cubic[sure]
            good += int(sure.sum())
        if good:
            samples, longest, error = samples + good * length, length, usual
    return samples, longest, error


def _nearest(missing: IntegerArray, starts: IntegerArray, length: int, size: int) -> IntegerArray:
    """(runs, 6) nearest samples that are there, three before and three behind runs of `length`.

    All are -1 if there are fewer, or some lie too far.
    """
    # Known sample number n is sample n, and one more for each missing one before it.
    skipped = missing - np.arange(missing.size)
    behind = starts - np.searchsorted(missing, starts)
    known = behind[:, np.newaxis] + np.arange(-_WIDE_SIDE, _WIDE_SIDE)
    around = known + np.searchsorted(skipped, known, side="right")
    reach = 2 * (_WIDE_SIDE + MOST_MISSING_IN_A_ROW)
    near = (around[:, 0] >= starts - reach) & (around[:, -1] < starts + length + reach)
    inside = (known[:, 0] >= 0) & (around[:, -1] < size)
    return np.where((near & inside)[:, np.newaxis], around, -1)


def _continued(values: FloatArray, around: IntegerArray, period: float) -> FloatArray:
    """(runs, 6) readings around runs, unwrapped, from the last one before each."""
    steps = _folded(np.diff(values[around], axis=1), period)
    path = np.pad(np.cumsum(steps, axis=1), ((0, 0), (1, 0)))
    return np.asarray(path - path[:, _WIDE_SIDE - 1 : _WIDE_SIDE])


def _interpolated(
    values: FloatArray, starts: IntegerArray, around: IntegerArray, length: int, period: float
) -> tuple[FloatArray, FloatArray]:
    """(runs, length) readings by a cubic and by a quintic."""
    path = _continued(values, around, period)
    origin = values[around[:, _WIDE_SIDE - 1]][:, np.newaxis]
    nodes = around - starts[:, np.newaxis]
    few = slice(_WIDE_SIDE - _SIDE, _WIDE_SIDE + _SIDE)
    cubic = _polynomial(nodes[:, few], path[:, few], length)
    return origin + cubic, origin + _polynomial(nodes, path, length)


def _polynomial(nodes: IntegerArray, heights: FloatArray, length: int) -> FloatArray:
    """(runs, length) values at 0, 1, ... of polynomials through (runs, nodes), Lagrange's form."""
    own = np.eye(nodes.shape[1], dtype=np.bool_)
    apart = nodes[:, :, np.newaxis] - nodes[:, np.newaxis]
    to = np.arange(length)[:, np.newaxis] - nodes[:, np.newaxis]
    factors = to[:, :, np.newaxis] / np.where(own, 1, apart)[:, np.newaxis]
    weights = np.where(own, 1.0, factors).prod(axis=3)
    return np.asarray((weights * heights[:, np.newaxis]).sum(axis=2))


def _error_on_known(values: FloatArray, length: int, period: float) -> float:
    """95 % of known samples, taken for missing in runs of `length`, are met to this."""
    last = values.size - length - _WIDE_SIDE
    if last <= _WIDE_SIDE:
        return math.nan
    starts = np.unique(np.linspace(_WIDE_SIDE, last, 1000).astype(np.int64))
    whole = np.isfinite(values[starts[:, np.newaxis] + np.arange(-_WIDE_SIDE, length + _WIDE_SIDE)])
    starts = starts[whole.all(axis=1)]
    if starts.size == 0:
        return math.nan
    sides = np.concatenate([np.arange(-_WIDE_SIDE, 0), np.arange(length, length + _WIDE_SIDE)])
    cubic, _ = _interpolated(values, starts, starts[:, np.newaxis] + sides, length, period)
    error = _folded(cubic - values[starts[:, np.newaxis] + np.arange(length)], period)
    return float(np.quantile(np.abs(error).max(axis=1), 0.95))


# ---- lost readings -----------------------------------------------------------------

_TURN: Final = 2.0 * math.pi


def with_lost_readings(
    table: Conversion, gyros: Sequence[Channel], sample_rate: float
) -> Conversion:
    """The table with missing readings taken from the gyro that senses it most.

    Parameters
    ----------
    table
        (samples,) unwrapped, NaN where readings are missing.
    gyros
        Beside it.
    sample_rate
        Hz.

    Returns
    -------
    Conversion
        As it was if more than `LARGEST_SHARE_MISSING` are missing, if some are at either end, or
        if no gyro agrees with the readings on both sides.
    """
    values = table.channel.values
    if not values.size or math.isfinite(arrays.mean(values)):
        return table
    marks = is_missing(values)
    lost = number_of(marks)
    if marks[0] or marks[-1] or not 0 < lost <= LARGEST_SHARE_MISSING * values.size:
        return table
    whole = [gyro for gyro in gyros if math.isfinite(arrays.mean(gyro.values))]
    shares = [(_share(one, values, sample_rate), one) for one in whole]
    share, gyro = max(shares, key=lambda one: abs(one[0]), default=(0.0, None))
    # The least share of a gyro that senses its table.
    if gyro is None or not abs(share) > 0.05:
        return table
    firsts, afters = stretches(marks)
    filled = _bridged(values, firsts, afters, angle_of(gyro, sample_rate), share)
    if filled is None:
        return table
    longest, first = (afters - firsts).max() / sample_rate, firsts[0] / sample_rate
    problem = f"{counted(lost, 'reading')} lost at {counted(int(firsts.size), 'place')}"
    problem += f", the longest for {longest:.3g} s, the first at {first:.3f} s"
    text = f"{problem}: gyro {gyro.name} tells how the table turned meanwhile"
    note = Note(name="lost", level="warning", channel="table", text=text)
    return replace(table, channel=replace(table.channel, values=filled), notes=(*table.notes, note))


def _share(gyro: Channel, table: FloatArray, sample_rate: float) -> float:
    """Share of the table's rate that a gyro senses, by some of its angles; 0 if nothing turns."""
    # Each of two thousand places looks a second ahead.
    ahead = max(1, round(sample_rate))
    if table.size <= ahead:
        return 0.0
    places = np.linspace(0, table.size - 1 - ahead, 2000).astype(np.int64)
    angle = angle_of(gyro, sample_rate)
    by_table, by_gyro = (one[places + ahead] - one[places] for one in (table, angle))
    known = np.isfinite(by_table)
    return float(np.nan_to_num(share_of_turns(by_gyro[known], by_table[known])))


def share_of_turns(gyro: FloatArray, table: FloatArray, least: float = 0.0) -> float:
    """Share of the table's turns that a gyro senses; NaN if nothing turns.

    Parameters
    ----------
    gyro, table
        (spans,) turn of each in the same spans, or mean rate.
    least
        Turn of the table above which it turns.
    """
    size = np.abs(table)
    turning = size > max(0.2 * float(np.quantile(size, 0.9)) if size.size else 0.0, least)
    return float(np.median(gyro[turning] / table[turning])) if turning.any() else math.nan


def _bridged(
    values: FloatArray, firsts: IntegerArray, afters: IntegerArray, turned: FloatArray, share: float
) -> FloatArray | None:
    """The table angle with its gaps bridged; None if a gyro does not agree with one."""
    filled = arrays.elementwise(np.add, values, 0.0)
    for first, after in zip(firsts.tolist(), afters.tolist(), strict=True):
        path = (turned[first - 1 : after + 1] - turned[first - 1]) / share
        gap = float(filled[after] - filled[first - 1])
        around = _TURN * round((float(path[-1]) - gap) / _TURN)
        rest = gap + around - float(path[-1])
        # A gyro and the readings on both sides agree to this part of what was turned, and this
        # angle; the readings may have started over meanwhile.
        if abs(rest) > max(0.1 * DEGREE, 0.03 * abs(float(path[-1]))):
            return None
        if around:
            # What is behind was unwrapped without what passed meanwhile.
            filled[after:] += around
        tilt = rest * np.linspace(0.0, 1.0, path.size)
        filled[first:after] = filled[first - 1] + (path + tilt)[1:-1]
    return filled
