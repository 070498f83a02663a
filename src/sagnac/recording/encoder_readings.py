"""Encoder readings made the angle of a table: missing ones found and interpolated, unwrapped.

An encoder on a bus drops a reading now and then. Recorders mark it by NaN, by a value off the
table's path (0, -1, full scale), or not at all: the reading before stands there once more. A table
is heavy and its angle smooth, so an isolated reading can be told from its neighbours; a gyro
sample never can, since its noise is what is measured.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from sagnac.core.arrays import BooleanArray, FloatArray, IntegerArray, blocks, elementwise, every
from sagnac.core.errors import Note, counted
from sagnac.core.units import ARCSECOND, Unit
from sagnac.recording.channel import finite_extent, unwrapped
from sagnac.recording.stamps import GAP_STEPS, at_ticks, between_ticks, clock_of

# As many missing encoder samples in a row are interpolated: as with time stamps, the angle turned
# during a longer run is a guess, unless a gyro tells it. If more than this share is missing, the
# gaps come close to one another, and it is no recording but what is left of one.
MOST_MISSING_IN_A_ROW: Final = int(GAP_STEPS) - 1
LARGEST_SHARE_MISSING: Final = 0.05
# Twice the periodic error that an encoder may have: what an interpolated reading may be off by.
ENCODER_ACCURACY: Final = 10.0 * ARCSECOND
# A reading is off the path if it leaves by more than this many usual steps, and than this part of
# a turn, and is back within `MOST_MISSING_IN_A_ROW` samples: no table does that.
_USUAL_STEPS: Final = 5.0
_LEAST_JUMP: Final = 1.0 / 360.0
# A reading is held if the table steps evenly, to this part, apart from steps of nothing that the
# next one makes up for. This many of the steps behind it have to agree, of this many looked at.
_EVEN: Final = 0.125
_STEPS_LOOKED_AT: Final = 8
_STEPS_THAT_AGREE: Final = 6
_HELD_LOOK_BACK: Final = 64
_OFTEN: Final = 0.1
# Changes below this part of a turn are rounding of readings, not their resolution.
_ROUNDING: Final = 1e-10
# Interpolation takes two readings on each side; a third on each side tells what it may be wrong by.
_SIDE: Final = 2
_WIDE_SIDE: Final = 3
# It is trusted to this many times the error that known samples show.
_USUAL_ERRORS: Final = 10.0
_PLACES: Final = 1000
_AT_ONCE: Final = 2**14
# A table that moves by more than this part of the range between two samples may have gone either
# way round.
_IN_DOUBT: Final = 0.25
# Readings that go beyond a turn by no more than this start over there all the same.
_BEYOND: Final = 1.001
_NONE: Final[IntegerArray] = np.empty(0, dtype=np.int64)


@dataclass(frozen=True, slots=True, kw_only=True)
class Marked:
    """Readings that were found to stand for missing ones.

    Attributes
    ----------
    off_path
        How many lay off the table's path.
    reading
        What all of those read; None where they differ, or there are none.
    held
        How many repeated the one before while the table turned.
    """

    off_path: int
    reading: float | None
    held: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Filled:
    """Missing samples that were interpolated.

    Attributes
    ----------
    samples
        How many.
    longest
        Samples in the longest run of them.
    error
        95 % of known samples, in runs as long, are met by the interpolation to this; NaN where
        nothing was filled or too little is known. In the unit of the readings.
    """

    samples: int
    longest: int
    error: float


@dataclass(frozen=True, slots=True, kw_only=True)
class TableAngle:
    """Angle of a table from its readings, rad, shape (samples,), and what was noticed of them."""

    angle: FloatArray
    notes: tuple[Note, ...] = ()


def angle_of_readings(
    readings: FloatArray, unit: Unit, *, counter_period: float | None = None
) -> TableAngle:
    """The table angle that an encoder's readings stand for.

    Readings that stand for missing ones are marked, isolated missing ones interpolated; where
    the readings start over, they are made continuous. They start over at a full turn, unless
    they cover more than one: then they are a running angle, or a counter wider than a turn. If the
    encoder is slower than the recording, so that its readings are held, a spline goes through them.

    Parameters
    ----------
    readings
        (samples,) in `unit`. They are worked on in place.
    unit
        Of angle; one count for a counter.
    counter_period
        Reading at which a counter starts over, if it is one.

    Returns
    -------
    TableAngle
        Samples that stay missing are NaN.
    """
    turn = 2.0 * math.pi / unit.size
    samples, clock = readings.size, clock_of(readings)
    if clock is not None:
        # What repeats the reading at the tick before was lost.
        readings = at_ticks(readings, clock)
    notes = _marked_notes(mark_missing(readings, turn), unit)
    period = turn
    extent = finite_extent(readings)
    if extent > turn * (1.0 + 1e-9) and not _leaps_back(readings, turn, extent):
        period = counter_period if counter_period and extent < counter_period else math.inf
    filled = fill_missing(readings, period, accuracy=ENCODER_ACCURACY / unit.size)
    notes += _filled_notes(filled, unit)
    running, wraps = (readings, 0) if math.isinf(period) else unwrapped(readings, period)
    if wraps:
        notes.append(_about_table(f"unwrapped where it starts over, {counted(wraps, 'time')}"))
    if not math.isinf(period) and running.size > 1:
        largest = _largest_step(running) / period
        if largest > _IN_DOUBT:
            text = (
                f"moves by up to {largest:.2f} of its range between samples; unwrapping is in doubt"
            )
            notes.append(_about_table(text, warning=True))
    if clock is not None:
        running = between_ticks(running, clock, samples)
        text = (
            f"read every {clock.period:.4g} samples and held between: a spline goes through its "
            "readings"
        )
        notes.append(_about_table(text))
    angle = elementwise(np.multiply, running, unit.size, out=running)
    return TableAngle(angle=angle, notes=tuple(notes))


def _leaps_back(readings: FloatArray, turn: float, extent: float) -> bool:
    """Whether readings that go a little beyond a turn start over there."""
    return extent < _BEYOND * turn and _largest_step(readings) > (1.0 - _IN_DOUBT) * turn


def _about_table(text: str, *, warning: bool = False) -> Note:
    return Note(text=text, channel="table", level="warning" if warning else "remark")


def _marked_notes(marked: Marked, unit: Unit) -> list[Note]:
    notes = []
    if marked.off_path:
        alike = "" if marked.reading is None else f", all reading {marked.reading:.6g} {unit.name}"
        text = f"{counted(marked.off_path, 'sample')} off its path{alike}: taken as missing"
        notes.append(_about_table(text))
    if marked.held:
        text = f"{counted(marked.held, 'repeated sample')} while it turns: taken as missing"
        notes.append(_about_table(text))
    return notes


def _filled_notes(filled: Filled, unit: Unit) -> list[Note]:
    if not filled.samples:
        return []
    error = filled.error * unit.size / ARCSECOND
    known = f" (known ones are met to {error:.2g} arcsec)" if math.isfinite(error) else ""
    text = (
        f"{counted(filled.samples, 'missing sample')}, at most {filled.longest} in a row, "
        f"interpolated from their neighbours{known}"
    )
    return [_about_table(text)]


def _largest_step(values: FloatArray) -> float:
    """Largest step between two samples that are there."""
    largest = 0.0
    for block in blocks(values.size - 1):
        steps = np.abs(np.diff(values[block.start : block.stop + 1]))
        largest = float(np.fmax.reduce(steps, initial=largest))
    return largest


def mark_missing(values: FloatArray, turn: float) -> Marked:
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
    Marked
        What was found.
    """
    held = _held(values, turn)
    off_path = _off_path(values, turn)
    readings = values[off_path]
    same = readings.size > 0 and bool((readings == readings[0]).all())
    reading = float(readings[0]) if same else None
    if reading is not None:
        off_path = np.union1d(off_path, _reading_alike(values, reading))
    values[held] = np.nan
    values[off_path] = np.nan
    return Marked(off_path=int(off_path.size), reading=reading, held=int(held.size))


def fill_missing(values: FloatArray, period: float, *, accuracy: float) -> Filled:
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
    Filled
        What was interpolated.
    """
    missing = _found(lambda piece: ~np.isfinite(piece), values, LARGEST_SHARE_MISSING * values.size)
    nothing = Filled(samples=0, longest=0, error=float("nan"))
    if (
        missing.size == 0
        or missing.size > LARGEST_SHARE_MISSING * values.size
        or np.isinf(values[missing]).any()
    ):
        return nothing
    firsts, lengths = runs(missing)
    filled, longest, error = 0, 0, float("nan")
    for length in range(1, MOST_MISSING_IN_A_ROW + 1):
        starts = firsts[lengths == length]
        usual = _error_on_known(values, length, period)
        around = _neighbours(missing, starts, length, values.size)
        usable = (around[:, 0] >= 0) & (around[:, -1] < values.size)
        limit = max(accuracy, _USUAL_ERRORS * usual) if np.isfinite(usual) else accuracy
        good = _fill_runs(
            values,
            starts=starts[usable],
            around=around[usable],
            length=length,
            period=period,
            limit=limit,
        )
        if good:
            filled += good * length
            longest, error = length, usual
    return Filled(samples=filled, longest=longest, error=error)


def _fill_runs(
    values: FloatArray,
    *,
    starts: IntegerArray,
    around: IntegerArray,
    length: int,
    period: float,
    limit: float,
) -> int:
    """Fill runs of one `length` in place if both polynomials agree to `limit`; how many were."""
    filled = 0
    for some in blocks(starts.size, _AT_ONCE):
        cubic, quintic = _interpolated(values, starts[some], around[some], length, period)
        doubt = np.abs(cubic - quintic).max(axis=1)
        across = np.abs(_continued(values, around[some], period)[:, _WIDE_SIDE])
        # If a step exceeds a quarter of the period, the shorter way round is in doubt.
        good = (doubt <= limit) & (across < _IN_DOUBT * period)
        values[starts[some][good, np.newaxis] + np.arange(length)] = cubic[good]
        filled += int(good.sum())
    return filled


def _found(
    test: Callable[[FloatArray], BooleanArray],
    values: FloatArray,
    most: float,
    following: int = 0,
) -> IntegerArray:
    """Samples for which `test` holds, up to the first block in which they become more than `most`.

    What lies behind is not looked at: more than that is no finding, and takes memory. The test is
    given `following` samples more than it judges.
    """
    found = [_NONE]
    for block in blocks(values.size - following):
        here = test(values[block.start : block.stop + following])
        found.append(block.start + np.flatnonzero(here))
        if sum(some.size for some in found) > most:
            break
    return np.concatenate(found)


def runs(samples: IntegerArray) -> tuple[IntegerArray, IntegerArray]:
    """First sample and length of every run of consecutive ones among `samples`, ascending."""
    edges = np.flatnonzero(np.diff(samples) > 1) + 1
    starts = np.concatenate([[0], edges]).astype(np.int64)[: samples.size]
    return samples[starts], np.diff(np.append(starts, samples.size))


def _folded(steps: FloatArray, period: float) -> FloatArray:
    """Steps by the shorter way round; NaN for those to or from an infinite reading."""
    if np.isinf(period):
        return steps
    with np.errstate(invalid="ignore"):
        return np.asarray(steps - period * np.rint(steps / period))


def _steps(values: FloatArray) -> FloatArray:
    """From each value to the next; NaN between two infinite readings, which is no finding."""
    with np.errstate(invalid="ignore"):
        return np.diff(values)


def _off_path(values: FloatArray, turn: float) -> IntegerArray:
    """Samples that leave the table's path and are back within `MOST_MISSING_IN_A_ROW` samples."""
    apart = max(1, values.size // 100_000)
    with np.errstate(invalid="ignore"):
        steps = every(values[1:], apart) - every(values[:-1], apart)
    usual_steps = np.abs(_folded(steps, turn))
    usual_steps = usual_steps[np.isfinite(usual_steps)]
    if usual_steps.size == 0:
        return _NONE
    usual = float(np.quantile(usual_steps, 0.9))
    limit = max(_USUAL_STEPS * usual, _LEAST_JUMP * turn)
    most = 2.0 * LARGEST_SHARE_MISSING * values.size + 2
    places = _found(
        lambda some: np.abs(_folded(_steps(some), turn)) > limit, values, most, following=1
    )
    if places.size > most:
        # That is how this table moves.
        return _NONE
    sizes = _folded(values[places + 1] - values[places], turn)
    return _excursions(places.tolist(), sizes.tolist(), usual)


def _excursions(places: list[int], sizes: list[float], usual: float) -> IntegerArray:
    """Samples between a large step and the next one, if that leads back.

    Parameters
    ----------
    places
        Samples before the large steps, ascending.
    sizes
        Of the steps.
    usual
        Size of a usual step, which the table makes meanwhile.
    """
    off: list[IntegerArray] = [_NONE]
    number = 0
    while number + 1 < len(places):
        out, back = places[number], places[number + 1]
        there, home = sizes[number], sizes[number + 1]
        rest = abs(there + home) - (back - out + 1) * usual
        returns = there * home < 0.0 and rest <= 0.25 * min(abs(there), abs(home))
        if back - out <= MOST_MISSING_IN_A_ROW and returns:
            off.append(np.arange(out + 1, back + 1))
            number += 2
        else:
            number += 1
    return np.concatenate(off)


def _reading_alike(values: FloatArray, reading: float) -> IntegerArray:
    """Samples of one reading, except long rows of them: a table may stand there."""
    alike = [_NONE]
    for block in blocks(values.size):
        places = block.start + np.flatnonzero(values[block] == reading)
        _, lengths = runs(places)
        alike.append(places[np.repeat(lengths <= MOST_MISSING_IN_A_ROW, lengths)])
    return np.concatenate(alike)


def _held(values: FloatArray, turn: float) -> IntegerArray:
    """Samples that repeat the one before while the table turns evenly."""
    held = [_NONE]
    for block in blocks(values.size):
        first = max(0, block.start - _HELD_LOOK_BACK)
        steps = _steps(values[first : block.stop + _STEPS_LOOKED_AT + 1])
        held.append(first + _held_steps(steps, block.start - first - 1, turn))
    return np.unique(np.concatenate(held))


def _held_steps(steps: FloatArray, least: int, turn: float) -> IntegerArray:
    """Samples, counted from the one before the first step, that repeat the one before them.

    Parameters
    ----------
    steps
        From each sample to the next.
    least
        First step that may make up for those before it.
    turn
        Reading of a full turn.
    """
    # The step that makes up for it, and the last one before it that was none.
    moving = steps != 0.0
    late = 1 + np.flatnonzero(moving[1:] & ~moving[:-1])
    late = late[late >= least]
    if late.size == 0:
        return _NONE
    number = np.arange(steps.size)
    before = np.maximum.accumulate(np.where(moving, number, -1))[late - 1]
    ahead = np.arange(1, _STEPS_LOOKED_AT + 1)
    typical, agree = _typical(steps, late[:, np.newaxis] + ahead, turn)
    # Where more readings are held ahead, or the record ends, those behind may tell.
    typical_behind, agree_behind = _typical(steps, before[:, np.newaxis] + 1 - ahead, turn)
    typical = np.where(agree_behind > agree, typical_behind, typical)
    agree = np.maximum(agree, agree_behind)
    due = (late - before) * typical
    made_up = np.abs(_folded(steps[late] - due, turn)) < _EVEN * np.minimum(np.abs(due), turn)
    # A table slower than some counts a sample repeats its readings anyway, and often.
    changes = np.abs(_steps(steps))
    count = changes[changes > _ROUNDING * turn].min(initial=turn)
    still = np.concatenate([[0], np.cumsum(~moving)])
    earlier = still[before + 1] - still[np.maximum(before + 1 - _HELD_LOOK_BACK, 0)]
    made_up &= (_EVEN * np.abs(typical) > count) | (earlier < _OFTEN * _HELD_LOOK_BACK)
    held = (before >= 0) & made_up & (agree >= _STEPS_THAT_AGREE)
    # Step n leads from sample n to the next.
    runs = [
        np.arange(start + 2, stop + 1) for start, stop in zip(before[held], late[held], strict=True)
    ]
    return np.concatenate([_NONE, *runs])


def _typical(
    steps: FloatArray, places: IntegerArray, turn: float
) -> tuple[FloatArray, IntegerArray]:
    """(rows,) median of the steps at (rows, some) places, and how many of them are about that.

    None are if a place lies outside the steps.
    """
    inside = (places >= 0).all(axis=1) & (places < steps.size).all(axis=1)
    rows = _folded(steps[np.where(inside.reshape(-1, 1), places, 0)], turn)
    typical = np.asarray(np.median(rows, axis=1))
    even = np.abs(rows - typical.reshape(-1, 1)) < _EVEN * np.abs(typical.reshape(-1, 1))
    return typical, np.asarray(even.sum(axis=1) * inside)


def _neighbours(
    missing: IntegerArray, starts: IntegerArray, length: int, size: int
) -> IntegerArray:
    """(runs, 6) nearest samples that are there, three before and three after runs of `length`.

    If they are too far, or there are none, -1 stands before and `size` after.
    """
    sides = []
    for direction, nearest, none in ((-1, starts - 1, -1), (1, starts + length, size)):
        nodes = np.empty((starts.size, _WIDE_SIDE), dtype=np.int64)
        reached = nearest.copy()
        end = nearest + direction * 2 * (_WIDE_SIDE + MOST_MISSING_IN_A_ROW)
        for node in range(_WIDE_SIDE):
            while (blocked := np.isin(reached, missing) & (reached != end)).any():
                reached += direction * blocked
            nodes[:, node] = np.where(reached == end, none, reached)
            reached += direction * (reached != end)
        sides.append(np.clip(nodes, -1, size))
    return np.concatenate([sides[0][:, ::-1], sides[1]], axis=1)


def _continued(values: FloatArray, around: IntegerArray, period: float) -> FloatArray:
    """(runs, 6) readings around runs, unwrapped, from the last one before each."""
    nodes = values[around]
    steps = _folded(np.diff(nodes, axis=1), period)
    path = np.concatenate([np.zeros((nodes.shape[0], 1)), np.cumsum(steps, axis=1)], axis=1)
    return np.asarray(path - path[:, _WIDE_SIDE - 1 : _WIDE_SIDE])


def _interpolated(
    values: FloatArray, starts: IntegerArray, around: IntegerArray, length: int, period: float
) -> tuple[FloatArray, FloatArray]:
    """(runs, length) readings by a cubic and by a quintic, Lagrange's form."""
    path = _continued(values, around, period)
    origin = values[around[:, _WIDE_SIDE - 1]][:, np.newaxis]
    nodes = around - starts[:, np.newaxis]
    at = np.arange(length)
    results = []
    for side in (_SIDE, _WIDE_SIDE):
        used = slice(_WIDE_SIDE - side, _WIDE_SIDE + side)
        x, y = nodes[:, used], path[:, used]
        total = np.zeros((starts.size, length))
        for own in range(2 * side):
            weight = np.ones((starts.size, length))
            for other in range(2 * side):
                if other != own:
                    apart = (x[:, own] - x[:, other])[:, np.newaxis]
                    weight *= (at - x[:, other, np.newaxis]) / apart
            total += weight * y[:, own, np.newaxis]
        results.append(origin + total)
    return results[0], results[1]


def _error_on_known(values: FloatArray, length: int, period: float) -> float:
    """95 % of known samples, taken for missing in runs of `length`, are met to this."""
    last = values.size - length - _WIDE_SIDE
    if last <= _WIDE_SIDE:
        return float("nan")
    starts = np.unique(np.linspace(_WIDE_SIDE, last, _PLACES).astype(np.int64))
    whole = np.isfinite(values[starts[:, np.newaxis] + np.arange(-_WIDE_SIDE, length + _WIDE_SIDE)])
    starts = starts[whole.all(axis=1)]
    if starts.size == 0:
        return float("nan")
    sides = np.concatenate([np.arange(-_WIDE_SIDE, 0), np.arange(length, length + _WIDE_SIDE)])
    cubic, _ = _interpolated(values, starts, starts[:, np.newaxis] + sides, length, period)
    error = _folded(cubic - values[starts[:, np.newaxis] + np.arange(length)], period)
    return float(np.quantile(np.abs(error).max(axis=1), 0.95))
