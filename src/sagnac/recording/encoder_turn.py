"""Whether an encoder's readings start over at a full turn, or short of it, or beyond."""

import math
from typing import Final

import numpy as np

from sagnac import series
from sagnac.arrays import BooleanArray, FloatArray, IntegerArray
from sagnac.errors import Note, counted
from sagnac.recording.model import Recording
from sagnac.recording.stretches import Places
from sagnac.units import ARCSECOND, UNITS, split_factor

# Readings start over at one of these, turns.
_STARTS_OVER: Final = (0.0, 0.5)
# Samples before and behind a start that the excess is taken over, and as many steps on either side
# that tell the rate.
_REACH: Final = 2
_STEPS: Final = 2 * _REACH + 1
# Fewest starts, other places that tell the scatter, and its multiple that the median lies off by.
_FEWEST: Final = 4
_PLACES: Final = 4001
_SIGMAS: Final = 8.0
# An excess below this is that of a sound encoder where its scale closes.
_CLOSES: Final = 10.0 * ARCSECOND
# A normal median is this much wider than the mean, and its scatter this many median deviations.
_MEDIAN: Final = 1.2533
_DEVIATION: Final = 1.4826


def turn_notes(recording: Recording) -> tuple[Note, ...]:
    """An encoder whose angle leaps each time its readings start over: a warning.

    Its turn is not 360 degrees in the unit that is stated, or its scale does not close. The leap
    stands once in every turn. A pair of gyros is free of it, and one gyro alone has it as its own.
    """
    table = recording.table
    if table is None:
        return ()
    for start in _STARTS_OVER:
        at = _starts(table.values, start)
        if at.size < _FEWEST:
            continue
        at = at[:: max(1, at.size // _PLACES)]
        other = np.linspace(_reach(), table.values.size - 1 - _reach(), _PLACES).astype(np.int64)
        usual = _excess(table.values, other)
        scatter = _DEVIATION * float(np.median(np.abs(usual - np.median(usual))))
        leap = float(np.median(_excess(table.values, at)))
        if abs(leap) < max(_CLOSES, _SIGMAS * _MEDIAN * scatter / math.sqrt(at.size)):
            continue
        return (_note(table.shown_in, leap, int(at.size)),)
    return ()


def _note(shown_in: str, leap: float, times: int) -> Note:
    factor, unit = split_factor(shown_in)
    right = f"{factor * 2.0 * math.pi / (2.0 * math.pi - leap):.8g}{unit}"
    size = abs(leap) / UNITS["deg"].size
    where = "short of" if leap > 0.0 else "beyond"
    text = (
        f"its readings start over {size:.3g} deg {where} a full turn, {counted(times, 'time')}: if "
        f"that is one turn, state {{table COLUMN:{right}}}; a pair of gyros is free of it, and one "
        "alone has only an upper bound"
    )
    return Note(name="encoder", level="warning", channel="table", text=text)


def _reach() -> int:
    return _REACH + _STEPS + 1


def _starts(angle: FloatArray, start: float) -> IntegerArray:
    """Samples before the angle passes a whole number of turns and `start` of one."""

    def passes(some: FloatArray) -> BooleanArray:
        return np.asarray(np.diff(np.floor(some / (2.0 * math.pi) - start)) != 0.0)

    found = Places(values=angle, test=passes, following=1).all()
    return found[(found >= _reach()) & (found < angle.size - _reach())]


def _excess(angle: FloatArray, at: IntegerArray) -> FloatArray:
    """By how much the angle goes on at places beyond what it does before and behind, forwards."""
    edges = [at - _REACH - _STEPS, at - _REACH, at + 1 + _REACH, at + 1 + _REACH + _STEPS]
    before, inside, behind = np.diff([series.at(angle, edge) for edge in edges], axis=0)
    return np.asarray((inside - 0.5 * (before + behind)) * np.sign(before + behind))
