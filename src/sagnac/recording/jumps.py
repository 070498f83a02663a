"""Single steps of a channel far outside the rest."""

from typing import Final

import numpy as np

from sagnac import series
from sagnac.errors import Note, counted
from sagnac.recording.channel import Channel
from sagnac.recording.model import Recording, second_of
from sagnac.recording.soundness import remedy_of
from sagnac.recording.stretches import Places

# Steps that tell what is usual.
_LOOKED_AT: Final = 20_000


def jump_notes(recording: Recording, channel: Channel) -> tuple[Note, ...]:
    """Steps of over 20 times the 99 % quantile, which is 50 sigma of noise: a warning.

    Steps that come three times in a thousand samples are no jumps: a motion that is all but steady
    meets the steps of a readout so.
    """
    values = channel.values
    sample = np.arange(0, values.size - 1, max(1, (values.size - 1) // _LOOKED_AT))
    steps = series.at(values, sample + 1) - series.at(values, sample)
    middle = float(np.median(steps))
    usual, rare = np.quantile(np.abs(steps - middle), [0.99, 0.997])
    limit = max(20.0 * float(usual), 2.5 * float(rare))
    if limit <= 0.0:
        return ()
    jumps = Places(
        values=values, test=lambda some: np.abs(np.diff(some) - middle) > limit, following=1
    )
    found = jumps.tally()
    if found.count == 0:
        return ()
    text = (
        f"{counted(found.count, 'jump')} of over 20 times the usual step, the first at "
        f"{second_of(recording, found.first + 1):.3f} s; "
        f"{remedy_of(recording, jumps.longest_between(recording.samples, later=1))}"
    )
    return (Note(name="steps", level="warning", channel=channel.name, text=text),)
