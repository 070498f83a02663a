"""Gyros driven to the end of their range."""

import math
from functools import partial
from typing import Final, Literal

import numpy as np

from sagnac import series
from sagnac.arrays import FloatArray
from sagnac.errors import Note
from sagnac.recording.channel import Channel
from sagnac.recording.model import Recording, second_of
from sagnac.recording.stretches import Places

# A limit is taken this often at least, and this many times as often as the next value inwards.
# Noise takes an extreme value less often than the next one.
_LEAST_OFTEN: Final = 10
_OFTENER: Final = 3
# Few levels say nothing: a quiet gyro may count only 0 and 1.
_FEW_LEVELS: Final = 8


def saturation_notes(recording: Recording, gyro: Channel) -> tuple[Note, ...]:
    """An extreme value taken far more often than the next one inwards: a warning a side."""
    if gyro.kind == "angle":
        return ()
    values = gyro.values
    levels = np.unique(series.every(values, max(1, values.size // 10_000)))
    if levels.size <= _FEW_LEVELS:
        return ()
    lowest, highest = series.extent(values)
    return (
        *_at_limit(recording, gyro, highest, "upper"),
        *_at_limit(recording, gyro, lowest, "lower"),
    )


def _at_limit(
    recording: Recording, gyro: Channel, limit: float, side: Literal["upper", "lower"]
) -> tuple[Note, ...]:
    """What one limit says."""
    values = gyro.values
    at_limit = Places(values=values, test=partial(np.equal, limit)).tally()
    if at_limit.count < _LEAST_OFTEN:
        return ()
    inner = next_inwards(values, limit, side)
    following = Places(values=values, test=partial(np.equal, inner)).tally()
    if at_limit.count <= _OFTENER * following.count:
        return ()
    text = (
        f"is saturated: {at_limit.count} samples are at its {side} limit, the first at "
        f"{second_of(recording, at_limit.first):.3f} s; take a stretch without with {{slice}}"
    )
    return (Note(level="warning", channel=gyro.name, text=text),)


def next_inwards(values: FloatArray, limit: float, side: Literal["upper", "lower"]) -> float:
    """The value next to an extreme one; infinite, away from it, if there is none."""
    sign = 1.0 if side == "upper" else -1.0

    def further(inner: float, block: slice) -> float:
        inside = values[block][values[block] != limit]
        return max(inner, float((sign * inside).max(initial=-math.inf)))

    return sign * series.reduce(further, -math.inf, values.size, values)
