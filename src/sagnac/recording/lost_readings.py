"""Encoder readings that were lost for longer than a polynomial bridges, taken from a gyro.

Where the encoder is silent a gyro goes on. Between the last reading and the next one its turn,
divided by its share of the table's rate and tilted to meet both, is the table's: off by no more
than the gyro's own noise, and by as little of its wrong share as the rate changes meanwhile.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from sagnac import series
from sagnac.arrays import FloatArray, IntegerArray
from sagnac.errors import Note, counted
from sagnac.recording.channel import Channel
from sagnac.recording.columns import Taken
from sagnac.recording.encoder_readings import LARGEST_SHARE_MISSING, runs
from sagnac.recording.kinds import angle_of
from sagnac.recording.stretches import Places, is_not_finite
from sagnac.units import DEGREE

# Places that tell a gyro's share, seconds that each looks ahead, and the least share, as it is for
# a gyro that senses its table.
_PLACES: Final = 2000
_AHEAD: Final = 1.0
_LEAST_SHARE: Final = 0.05
# A gyro and the readings on both sides agree to this part of what was turned, and this angle; the
# readings may have started over meanwhile.
_AGREE: Final = 0.03
_AT_LEAST: Final = 0.1 * DEGREE
_TURN: Final = 2.0 * math.pi


def with_lost_readings(table: Taken, gyros: Sequence[Channel], sample_rate: float) -> Taken:
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
    Taken
        As it was if more than `LARGEST_SHARE_MISSING` are missing, if some are at either end, or
        if no gyro agrees with the readings on both sides.
    """
    values = table.channel.values
    if not values.size or math.isfinite(series.mean(values)):
        return table
    lost = Places(values=values, test=is_not_finite).all()
    firsts, lengths = runs(lost)
    inside = lost.size and lost[0] > 0 and lost[-1] < values.size - 1
    if not inside or lost.size > LARGEST_SHARE_MISSING * values.size:
        return table
    shares = {
        gyro.name: _share(angle_of(gyro, sample_rate), values, sample_rate)
        for gyro in gyros
        if math.isfinite(series.mean(gyro.values))
    }
    name = max(shares, key=lambda one: abs(shares[one]), default="")
    if not name or not abs(shares[name]) > _LEAST_SHARE:
        return table
    gyro = next(one for one in gyros if one.name == name)
    turned = angle_of(gyro, sample_rate)
    filled = _bridged(values, firsts, firsts + lengths, turned, shares[name])
    if filled is None:
        return table
    text = (
        f"{counted(int(lost.size), 'reading')} lost at {counted(int(firsts.size), 'place')}, the "
        f"longest for {lengths.max() / sample_rate:.3g} s, the first at "
        f"{firsts[0] / sample_rate:.3f} s: gyro {name} tells how the table turned meanwhile"
    )
    note = Note(name="lost", level="warning", channel="table", text=text)
    return replace(table, channel=replace(table.channel, values=filled), notes=(*table.notes, note))


def _share(angle: FloatArray, table: FloatArray, sample_rate: float) -> float:
    """Share of the table's rate that a gyro senses; 0 if nothing turns."""
    ahead = max(1, round(_AHEAD * sample_rate))
    if table.size <= ahead:
        return 0.0
    places = np.linspace(0, table.size - 1 - ahead, _PLACES).astype(np.int64)
    by_table = series.at(table, places + ahead) - series.at(table, places)
    by_gyro = series.at(angle, places + ahead) - series.at(angle, places)
    known = np.isfinite(by_table)
    if not known.any():
        return 0.0
    turning = known & (np.abs(by_table) > 0.2 * np.quantile(np.abs(by_table[known]), 0.9))
    return float(np.median(by_gyro[turning] / by_table[turning])) if turning.any() else 0.0


def _bridged(
    values: FloatArray,
    firsts: IntegerArray,
    afters: IntegerArray,
    turned: FloatArray,
    share: float,
) -> FloatArray | None:
    """The table angle with its gaps bridged; None if a gyro does not agree with one."""
    filled = series.made(lambda block: values[block].copy(), values.size, values)
    for first, after in zip(firsts.tolist(), afters.tolist(), strict=True):
        path = (turned[first - 1 : after + 1] - turned[first - 1]) / share
        gap = float(filled[after] - filled[first - 1])
        around = _TURN * round((float(path[-1]) - gap) / _TURN)
        rest = gap + around - float(path[-1])
        if abs(rest) > max(_AT_LEAST, _AGREE * abs(float(path[-1]))):
            return None
        if around:
            # What is behind was unwrapped without what passed meanwhile.
            filled = _raised(filled, after, around)
        tilt = rest * np.linspace(0.0, 1.0, path.size)
        filled[first:after] = filled[first - 1] + (path + tilt)[1:-1]
    return filled


def _raised(values: FloatArray, first: int, by: float) -> FloatArray:
    """Values with `by` added from sample `first` on."""

    def raised(block: slice) -> FloatArray:
        part = values[block].copy()
        part[max(first - block.start, 0) :] += by
        return part

    return series.made(raised, values.size, values)
