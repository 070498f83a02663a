"""Single steps of a channel far outside the rest."""

from typing import Final

import numpy as np

from sagnac import series
from sagnac.arrays import FloatArray, IntegerArray
from sagnac.errors import Note, counted
from sagnac.recording.channel import Channel
from sagnac.recording.model import Recording, second_of
from sagnac.recording.soundness import remedy_of
from sagnac.recording.stretches import Places
from sagnac.units import DEGREE

# Steps that tell what is usual.
_LOOKED_AT: Final = 20_000
# Jumps from which on they may be steps of a readout, how large these may be, and how near to a
# whole number of steps.
_OFTEN: Final = 3
_COARSEST: Final = 0.1 * DEGREE
_WHOLE: Final = 0.05


def jump_notes(recording: Recording, channel: Channel) -> tuple[Note, ...]:
    """Steps of over 20 times the 99 % quantile, which is 50 sigma of noise: a warning.

    Small ones that are all whole numbers of the smallest are no jumps: a motion that is all but
    steady meets the steps of a readout so.
    """
    values = channel.values
    sample = np.arange(0, values.size - 1, max(1, (values.size - 1) // _LOOKED_AT))
    steps = series.at(values, sample + 1) - series.at(values, sample)
    middle = float(np.median(steps))
    limit = 20.0 * float(np.quantile(np.abs(steps - middle), 0.99))
    if limit <= 0.0:
        return ()
    jumps = Places(
        values=values, test=lambda some: np.abs(np.diff(some) - middle) > limit, following=1
    )
    found = jumps.tally()
    if found.count == 0 or (found.count >= _OFTEN and _of_readout(values, jumps.all(), middle)):
        return ()
    text = (
        f"{counted(found.count, 'jump')} of over 20 times the usual step, the first at "
        f"{second_of(recording, found.first + 1):.3f} s; "
        f"{remedy_of(recording, jumps.longest_between(recording.samples, later=1))}"
    )
    return (Note(name="steps", level="warning", channel=channel.name, text=text),)


def _of_readout(values: FloatArray, places: IntegerArray, middle: float) -> bool:
    """Whether all jumps are whole numbers of one small step."""
    sizes = np.abs(series.at(values, places + 1) - series.at(values, places) - middle)
    step = float(sizes.min())
    parts = sizes / step
    return bool(sizes.max() < _COARSEST and np.all(np.abs(parts - np.rint(parts)) < _WHOLE))
