"""Steps of the readout that are coarse beside the noise."""

import math
from typing import Final

import numpy as np

from sagnac import series
from sagnac.errors import Level, Note
from sagnac.recording.channel import Channel
from sagnac.recording.effects import finding
from sagnac.recording.model import Recording
from sagnac.recording.profile import Profile
from sagnac.units import UNITS, split_factor

# Steps of single precision, in scatters of the noise, that are said and that spoil an answer.
_SEEN: Final = 0.1
_SPOILS: Final = 0.5
# Share of the scatter of white noise below which its own variance cannot be told from the steps'.
_TOLD: Final = 1.25
# Change of N that is worth a word.
_WORTH: Final = 0.02
# Samples that tell whether all values are of single precision.
_LOOKED_AT: Final = 4096
# Part of a value that its conversion to SI and back may move it by.
_ROUNDING: Final = 1e-15


def resolution_notes(recording: Recording, gyro: Channel, profile: Profile) -> tuple[Note, ...]:
    """Single precision, or coarse counts, if the noise does not cover its steps."""
    del recording
    step = single_precision_step(gyro)
    # The step follows the size of an angle; where that is largest the noise is compared with it.
    scatter = math.sqrt(2.0) * profile.scale
    if step > _SEEN * scatter:
        text = (
            "is stored in single precision (float32): its steps grow to "
            f"{_shown(gyro, step)}, beside a scatter of {_shown(gyro, scatter)} from sample to "
            "sample; store it in double precision"
        )
        level: Level = "error" if step > _SPOILS * scatter else "warning"
        return (finding("resolution", gyro.name, text, effect=None, level=level),)
    # Counts of an angle lose nothing from one sample to the next; those of a rate do.
    return _coarse(gyro, profile) if gyro.kind == "rate" else ()


def single_precision_step(gyro: Channel) -> float:
    """Largest step of a channel of which all values are of single precision; else 0.

    In the unit of its values. They count as such in the unit that they came in, or in that unit
    without the number before it.
    """
    values = gyro.values
    some = series.every(values, max(1, values.size // _LOOKED_AT))
    lowest, highest = series.extent(values)
    largest = max(abs(lowest), abs(highest))
    factor, name = split_factor(gyro.shown_in)
    for size in {UNITS[name].size, factor * UNITS[name].size}:
        stored = some / size
        rounded = stored.astype(np.float32).astype(np.float64)
        whole = rounded == np.rint(rounded)
        alike = np.abs(stored - rounded) <= _ROUNDING * np.abs(rounded)
        # Whole numbers below 2^24 are the same in both precisions and tell nothing.
        tells = ~whole | (np.abs(rounded) > 2.0**24)
        if alike.all() and tells.any():
            return size * float(np.spacing(np.float32(largest / size)))
    return 0.0


def _coarse(gyro: Channel, profile: Profile) -> tuple[Note, ...]:
    """Counts of a rate that are coarser than their noise."""
    step = profile.step
    variance = float(np.median(profile.power))
    hidden = step * step / 12.0
    # Noise of this variance is what steps move by 2 %.
    covering = hidden / (1.0 - (1.0 + _WORTH) ** -2)
    if not math.isfinite(step) or variance > covering:
        return ()
    # Sheppard: steps add their own variance, as long as the noise strays over several of them.
    effect = math.sqrt(variance / (variance - hidden)) if variance > _TOLD * hidden else None
    text = (
        f"is read out in steps of {_shown(gyro, step)}, beside a scatter of "
        f"{_shown(gyro, math.sqrt(variance))}: what is read is in part the steps"
    )
    return (finding("resolution", gyro.name, text, effect=effect),)


def _shown(gyro: Channel, value: float) -> str:
    unit = gyro.plain_unit
    return f"{value / unit.size:.3g} {unit.name}"
