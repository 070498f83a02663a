"""Rates that no gyro has, which tell of a wrong unit, kind or sample rate."""

from typing import Final

import numpy as np

from sagnac.errors import Note
from sagnac.recording.channel import Channel
from sagnac.recording.encoder_mismatch import block_rates
from sagnac.recording.model import Recording
from sagnac.units import DEGREE, DEGREE_PER_HOUR

# No gyro turns at 5000 deg/s for long, and none is stable to 1e-6 deg/h from sample to sample.
FASTEST_RATE: Final = 5000.0 * DEGREE
SLOWEST_RATE: Final = 1e-6 * DEGREE_PER_HOUR


def wrong_unit_notes(recording: Recording, gyro: Channel) -> tuple[Note, ...]:
    """A gyro that turns too fast or scatters too little for one: a warning."""
    rates, _ = block_rates(recording, gyro)
    typical = float(np.median(np.abs(rates)))
    scatter = float(np.sqrt(np.mean(np.square(np.diff(rates))))) if rates.size > 1 else typical
    if typical > FASTEST_RATE:
        text = (
            f"turns at {typical / DEGREE:.3g} deg/s: the unit, kind or rate looks wrong "
            "({unit}, {kind}, {rate})"
        )
    elif scatter < SLOWEST_RATE:
        text = (
            f"scatters by only {scatter / DEGREE_PER_HOUR:.2g} deg/h from second to second: "
            "the unit or kind looks wrong ({unit}, {kind})"
        )
    else:
        return ()
    return (Note(name="units", level="warning", channel=gyro.name, text=text),)
