"""Missing encoder samples: found, and interpolated where the table cannot have strayed meanwhile.

An encoder on a bus drops a reading now and then. Recorders mark it by NaN, by a value off the
table's path (0, -1, full scale), or not at all: the reading before stands there once more. A table
is heavy and its angle smooth, so an isolated reading can be told from its neighbours; a gyro
sample never can, since its noise is what is measured.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from sagnac import series
from sagnac.arrays import FloatArray, IntegerArray
from sagnac.recording.model import GAP_STEPS

# Missing encoder samples are interpolated up to so many in a row: as with time stamps, from there
# on the angle turned meanwhile is a guess. With more than this share missing the gaps come close
# to one another, and it is no recording but what is left of one.
MOST_MISSING_IN_A_ROW: Final = int(GAP_STEPS) - 1
LARGEST_SHARE_MISSING: Final = 0.01
# A reading is off the path when it leaves by more than this many usual steps, and than this part of
# a turn, and is back within `MOST_MISSING_IN_A_ROW` samples: no table does that.
_USUAL_STEPS: Final = 5.0
_LEAST_JUMP: Final = 1.0 / 360.0
# A reading is held where the table steps evenly, to this part, but for steps of nothing that the
# next one makes up for. Of the steps behind it this many have to agree, of so many.
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


def mark_missing(values: FloatArray, turn: float) -> Marked:
    """Set readings that stand for missing ones to NaN, in place.

    Those off the table's path for no more samples than can be interpolated; where all of them read
    the same, every other sample that reads so and is not one of a long row of them, since near the
    path it cannot be told from a reading. And those held: the one before once more, or several
    times, while the table turns, made up for by the step after.

    Parameters
    ----------
    values
        (samples,) readings, wrapped or not.
    turn
        Reading of a full turn.
    """
    # Steps between two infinite readings are no number, and no finding either.
    with np.errstate(invalid="ignore"):
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

    A cubic through two readings on each side. Left missing are runs of more than
    `MOST_MISSING_IN_A_ROW`; all of them where more than `LARGEST_SHARE_MISSING` of the samples are
    missing or any is infinite; those at the ends; and those where the table moved unevenly: where
    a quintic, through three readings on each side, disagrees by more than `accuracy` and by more
    than ten times what the cubic errs on known samples.

    Parameters
    ----------
    values
        (samples,) readings.
    period
        Reading at which they start over, inf where they do not. What is filled in continues the
        readings before it, and may lie a little beyond the period.
    accuracy
        Error that does no harm, in the unit of `values`.
    """
    missing = _found(lambda piece: ~np.isfinite(piece), values)
    nothing = Filled(samples=0, longest=0, error=float("nan"))
    if (
        missing.size == 0
        or missing.size > LARGEST_SHARE_MISSING * values.size
        or np.isinf(values[missing]).any()
    ):
        return nothing
    firsts, lengths = _runs(missing)
    filled, longest, error = 0, 0, float("nan")
    for length in range(1, MOST_MISSING_IN_A_ROW + 1):
        starts = firsts[lengths == length]
        usual = _error_on_known(values, length, period)
        around = _neighbours(missing, starts, length, values.size)
        usable = (around[:, 0] >= 0) & (around[:, -1] < values.size)
        starts, around = starts[usable], around[usable]
        limit = max(accuracy, _USUAL_ERRORS * usual) if np.isfinite(usual) else accuracy
        for some in series.spans(starts.size, _AT_ONCE):
            cubic, quintic = _interpolated(values, starts[some], around[some], length, period)
            doubt = np.abs(cubic - quintic).max(axis=1)
            across = np.abs(_continued(values, around[some], period)[:, _WIDE_SIDE])
            # Of a step of more than a quarter of the period the shorter way round is in doubt.
            good = (doubt <= limit) & (across < 0.25 * period)
            values[starts[some][good, np.newaxis] + np.arange(length)] = cubic[good]
            series.release(values)
            if good.any():
                filled += int(good.sum()) * length
                longest, error = length, usual
    return Filled(samples=filled, longest=longest, error=error)


def _found(test: Callable[[FloatArray], NDArray[np.bool_]], values: FloatArray) -> IntegerArray:
    """Samples for which `test` holds, up to the first span in which they become too many."""
    found: list[IntegerArray] = []
    count = 0
    for span in series.through(values.size, values):
        here = span.start + np.flatnonzero(test(values[span]))
        found.append(here)
        count += here.size
        if count > LARGEST_SHARE_MISSING * values.size:
            break
    return np.concatenate(found) if found else np.empty(0, dtype=np.int64)


def _runs(samples: IntegerArray) -> tuple[IntegerArray, IntegerArray]:
    """First sample and length of every run of consecutive ones among `samples`, ascending."""
    edges = np.flatnonzero(np.diff(samples) > 1) + 1
    starts = np.concatenate([[0], edges]).astype(np.int64)[: samples.size]
    return samples[starts], np.diff(np.append(starts, samples.size))


def _folded(steps: FloatArray, period: float) -> FloatArray:
    """Steps by the shorter way round."""
    if np.isinf(period):
        return steps
    return np.asarray(steps - period * np.rint(steps / period))


def _off_path(values: FloatArray, turn: float) -> IntegerArray:
    """Samples that leave the table's path and are back within `MOST_MISSING_IN_A_ROW` samples."""
    some = np.arange(0, values.size - 1, max(1, values.size // 100_000))
    usual_steps = np.abs(_folded(series.at(values, some + 1) - series.at(values, some), turn))
    usual_steps = usual_steps[np.isfinite(usual_steps)]
    if usual_steps.size == 0:
        return np.empty(0, dtype=np.int64)
    usual = float(np.quantile(usual_steps, 0.9))
    limit = max(_USUAL_STEPS * usual, _LEAST_JUMP * turn)
    places: list[int] = []
    sizes: list[float] = []
    for span in series.through(values.size - 1, values):
        steps = _folded(np.diff(values[span.start : span.stop + 1]), turn)
        large = np.flatnonzero(np.abs(steps) > limit)
        places += (span.start + large).tolist()
        sizes += steps[large].tolist()
        if len(places) > 2.0 * LARGEST_SHARE_MISSING * values.size + 2:
            # That is how this table moves.
            return np.empty(0, dtype=np.int64)
    off: list[IntegerArray] = []
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
    return np.concatenate(off) if off else np.empty(0, dtype=np.int64)


def _reading_alike(values: FloatArray, reading: float) -> IntegerArray:
    """Samples of one reading, but for long rows of them: a table may stand there."""
    found: list[IntegerArray] = [np.empty(0, dtype=np.int64)]
    for span in series.through(values.size, values):
        alike = span.start + np.flatnonzero(values[span] == reading)
        _, lengths = _runs(alike)
        found.append(alike[np.repeat(lengths <= MOST_MISSING_IN_A_ROW, lengths)])
    return np.concatenate(found)


def _held(values: FloatArray, turn: float) -> IntegerArray:
    """Samples that repeat the one before while the table turns evenly."""
    found: list[IntegerArray] = [np.empty(0, dtype=np.int64)]
    ahead = np.arange(1, _STEPS_LOOKED_AT + 1)
    for span in series.through(values.size, values):
        first = max(0, span.start - _HELD_LOOK_BACK)
        steps = np.diff(values[first : span.stop + _STEPS_LOOKED_AT + 1])
        # The step that makes up for it, and the last one before it that was none.
        moving = steps != 0.0
        late = 1 + np.flatnonzero(moving[1:] & ~moving[:-1])
        late = late[(late + first + 1 >= span.start) & (late < steps.size - _STEPS_LOOKED_AT)]
        if late.size == 0:
            continue
        number = np.arange(steps.size)
        before = np.maximum.accumulate(np.where(moving, number, -1))[late - 1]
        rows = _folded(steps[late[:, np.newaxis] + ahead], turn)
        typical = np.median(rows, axis=1)
        even = np.abs(rows - typical[:, np.newaxis]) < _EVEN * np.abs(typical)[:, np.newaxis]
        due = (late - before) * typical
        made_up = np.abs(_folded(steps[late], turn) - due) < _EVEN * np.abs(due)
        # A table slower than some counts a sample repeats its readings anyway, and often.
        changes = np.abs(np.diff(steps))
        count = changes[changes > _ROUNDING * turn].min(initial=turn)
        still = np.concatenate([[0], np.cumsum(~moving)])
        earlier = still[before + 1] - still[np.maximum(before + 1 - _HELD_LOOK_BACK, 0)]
        made_up &= (_EVEN * np.abs(typical) > count) | (earlier < _OFTEN * _HELD_LOOK_BACK)
        held = (before >= 0) & made_up & (even.sum(axis=1) >= _STEPS_THAT_AGREE)
        for start, stop in zip(before[held], late[held], strict=True):
            # Step n leads from sample n to the next.
            found.append(first + np.arange(start + 2, stop + 1))
    return np.unique(np.concatenate(found))


def _neighbours(
    missing: IntegerArray, starts: IntegerArray, length: int, size: int
) -> IntegerArray:
    """(runs, 6) nearest samples that are there, three before and three after runs of `length`.

    Where they are too far, or there are none, -1 before and `size` after.
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
