"""The stretch of a recording that is sound, as a remedy for the rest of it."""

import math

from sagnac.recording.model import MINIMUM_SAMPLES, Recording, second_of
from sagnac.recording.stretches import Stretch


def remedy_of(recording: Recording, stretch: Stretch) -> str:
    """Remedy if only this stretch is sound: ``take the sound stretch with {slice 30:90}``.

    Rounded inwards to ms, so that the slice named holds no sample outside the stretch.
    """
    first, last = stretch.first, stretch.after - 1
    begin = 0.0 if first == 0 else second_of(recording, first) * 1e3
    # Stamps of a damaged file may be any number.
    if stretch.samples < MINIMUM_SAMPLES or not math.isfinite(begin):
        return "get the file again from its source"
    start = math.ceil(begin) / 1e3
    stop = "" if last == recording.samples - 1 else f"{second_of(recording, last):.3f}"
    return f"take the sound stretch with {{slice {start:g}:{stop}}}"
