"""Several sensors whose samples stand in one channel by turns."""

import math
from typing import Final

import numpy as np

from sagnac import series
from sagnac.arrays import FloatArray
from sagnac.errors import Note
from sagnac.recording.channel import Channel
from sagnac.recording.model import Recording
from sagnac.recording.profile import Profile
from sagnac.recording.white import whitened

# How many sensors may take turns. Of four, a line at a quarter of the sample rate (mains at 200 Hz)
# looks alike.
_ORDINALS: Final = {2: "second", 3: "third"}
# Samples looked at, the most and the least, and parts of them that all have to show it.
_LOOKED_AT: Final = 2**17
_PARTS: Final = 4
_LEAST_SAMPLES: Final = 4096
# Standard errors by which the means of the turns differ, and least difference, in scatters of one
# sensor; ratio of their scatters.
_SIGMAS: Final = 8.0
_LEAST: Final = 0.5
_RATIO: Final = 1.3
# Scatters beyond which a sample counts as if it were there.
_FAR: Final = 5.0
# Last places of the largest angle within which its changes are rounding.
_LAST_PLACES: Final = 8.0
# Median of the size of the difference of two standard normal numbers.
_MEDIAN_STEP: Final = 0.9539


def interleaved_notes(recording: Recording, gyro: Channel, profile: Profile) -> tuple[Note, ...]:
    """Every second sample, or every third, has a mean or a scatter of its own: an error.

    One sensor has that only of a line at exactly half its sample rate, or a third.
    """
    del recording
    rounding = 0.0
    if gyro.kind == "angle":
        rounding = _LAST_PLACES * float(np.spacing(max(map(abs, series.extent(gyro.values)))))
    for sensors in _ORDINALS:
        if _take_turns(profile, sensors, rounding):
            text = (
                f"every {_ORDINALS[sensors]} sample is of another kind: {sensors} sensors seem to "
                "stand in this column by turns; write each into a column of its own"
            )
            return (Note(name="interleaved", level="error", channel=gyro.name, text=text),)
    return ()


def _take_turns(profile: Profile, sensors: int, rounding: float) -> bool:
    """Whether samples `sensors` apart are alike and those between are not, all along."""
    changes = profile.changes[:_LOOKED_AT]
    if changes.size < _LEAST_SAMPLES:
        return False
    turns = _turns(changes, sensors)
    typical = float(np.median(_scatters(turns)))
    if not typical > rounding:
        return False
    # Motion is taken off by the mean of each round, and single samples far off shift no mean.
    off = turns - turns.mean(axis=2, keepdims=True)
    middle = np.median(off, axis=1)
    reach = _FAR * typical
    means = middle + np.clip(off - middle[:, np.newaxis], -reach, reach).mean(axis=1)
    least = max(_SIGMAS * typical / math.sqrt(turns.shape[1]), _LEAST * typical)
    # The same one in every part, on the same side.
    apart = np.all(np.abs(means) > least, axis=0)
    if (apart & (np.abs(np.sign(means).sum(axis=0)) == _PARTS)).any():
        return True
    # Of a line at a part of the sample rate some turns see more: the noise between lines tells.
    white = whitened(changes)
    if not white.innovation > rounding:
        return False
    scatters = _scatters(_turns(white.values, sensors))
    order = np.argsort(scatters, axis=1)
    louder = scatters.max(axis=1) > _RATIO * scatters.min(axis=1)
    return bool(louder.all() and (order == order[0]).all())


def _turns(values: FloatArray, sensors: int) -> FloatArray:
    """(parts, rounds, sensors)"""
    length = values.size // _PARTS // sensors
    return values[: _PARTS * length * sensors].reshape(_PARTS, length, sensors)


def _scatters(turns: FloatArray) -> FloatArray:
    """(parts, sensors) by the median of the steps from each sample to the next of its own turn."""
    return np.asarray(np.median(np.abs(np.diff(turns, axis=1)), axis=1) / _MEDIAN_STEP)
