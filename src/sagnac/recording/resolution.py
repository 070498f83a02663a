"""Steps of the readout that are coarse beside the noise."""

import math
from typing import Final

import numpy as np
from scipy.fft import rfft

from sagnac import series
from sagnac.arrays import FloatArray
from sagnac.errors import Level, Note
from sagnac.recording.channel import Channel
from sagnac.recording.effects import finding
from sagnac.recording.model import Recording
from sagnac.recording.profile import Profile
from sagnac.units import UNITS, split_factor

# Steps of single precision, in scatters of the noise, that are said and that spoil an answer.
_SEEN: Final = 0.1
_SPOILS: Final = 0.5
# Half the mean square of what a rate changes by from sample to sample, in steps squared, from which
# on the error of its steps is white: its correlation is below 1 % (Widrow and Kollár, Quantization
# Noise, 2008), and the error's own variance, 1/12, is in it.
_WHITE: Final = 0.125 + 1.0 / 12.0
# Change of N that is worth a word.
_WORTH: Final = 0.02
# Octaves in which N is looked for end at this part of the sample rate, and begin at so many
# frequencies; the most samples looked at.
_HIGHEST: Final = 0.05
_LEAST_FREQUENCIES: Final = 16
_MOST: Final = 2**17
# Samples that tell whether all values are of single precision.
_LOOKED_AT: Final = 4096
# Part of a value that its conversion to SI and back may move it by.
_ROUNDING: Final = 1e-15


def resolution_notes(recording: Recording, gyro: Channel, profile: Profile) -> tuple[Note, ...]:
    """Single precision, or coarse counts, if the noise does not cover its steps."""
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
    return _coarse(recording, gyro, profile) if gyro.kind == "rate" else ()


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


def _coarse(recording: Recording, gyro: Channel, profile: Profile) -> tuple[Note, ...]:
    """Counts of a rate whose error is a part of its angle random walk."""
    step = profile.step
    variance = float(np.median(profile.power))
    if not math.isfinite(step):
        return ()
    effect = None
    if variance > _WHITE * step**2:
        effect = _added(step, recording.sample_rate, profile)
        if effect < 1.0 + _WORTH:
            return ()
    text = (
        f"is read out in steps of {_shown(gyro, step)}, beside a scatter of "
        f"{_shown(gyro, math.sqrt(variance))}: what is read is in part the steps"
    )
    return (finding("resolution", gyro.name, text, effect=effect),)


def _added(step: float, sample_rate: float, profile: Profile) -> float:
    """Factor on N of the error of white steps, which is spread evenly to half the sample rate.

    A sensor's own low-pass leaves less noise, but no less of it where N is read. If less is read
    there than the steps of a rate would make, an angle was counted, whose steps do not add up.
    """
    read = _density(profile.changes, sample_rate)
    steps = step * step / 6.0 / sample_rate
    return math.sqrt(read / (read - steps)) if read > steps else 1.0


def _density(rates: FloatArray, sample_rate: float) -> float:
    """One-sided density of a rate where its angle random walk is: the median over octaves.

    Lines and slow noise rule few of them.
    """
    some = rates[:_MOST]
    taper = np.hanning(some.size)
    transform = rfft((some - some.mean()) * taper)
    power = (transform.real**2 + transform.imag**2) * 2.0 / sample_rate / float(taper @ taper)
    highest = max(int(_HIGHEST * some.size), _LEAST_FREQUENCIES)
    levels = []
    while highest >= _LEAST_FREQUENCIES:
        levels.append(float(np.median(power[highest // 2 : highest])) / math.log(2.0))
        highest //= 2
    return float(np.median(levels))


def _shown(gyro: Channel, value: float) -> str:
    unit = gyro.plain_unit
    return f"{value / unit.size:.3g} {unit.name}"
