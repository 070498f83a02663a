"""Rates that no gyro has, which tell of a wrong unit, kind or sample rate."""

import math
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
# Gyros are read at 1 Hz and faster. Means over longer times are recorded for a day; at 1 Hz a few
# days are usual. If a recording is slower than the first number, Hz, and longer than the second, s,
# its stamps may be ms that were taken as s.
_SLOW_FOR_LONG: Final = ((1.0, 86_400.0), (2.5, 10.0 * 86_400.0))
# Factors between units of time; a usual rate lies between these, most often near the last, Hz.
_TIMES_FINER: Final = {1e3: "ms", 1e6: "us", 1e9: "ns"}
_USUAL: Final = (5.0, 2e4)
_COMMON: Final = 200.0


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


def rate_doubts(recording: Recording) -> tuple[Note, ...]:
    """A recording sampled more slowly, and for longer, than gyros are: a warning."""
    factor = likely_time_factor(recording)
    if factor is None:
        return ()
    rate = recording.sample_rate
    text = (
        f"samples stand {1.0 / rate:.4g} s apart, for {recording.duration / 86_400.0:.3g} days, as "
        f"no gyro is read: the unit of time looks {factor:.0f} times too large; if they are those "
        f"of {rate * factor:.6g} Hz, state {{time COLUMN:{_TIMES_FINER[factor]}}} or "
        f"{{rate {rate * factor:.6g}}}"
    )
    return (Note(name="units", level="warning", channel="time", text=text),)


def likely_time_factor(recording: Recording) -> float | None:
    """By how many times a unit of time too large makes the sample rate unusually slow, if any."""
    rate = recording.sample_rate
    if not any(rate < slow and recording.duration > long for slow, long in _SLOW_FOR_LONG):
        return None
    usual = [one for one in _TIMES_FINER if _USUAL[0] <= rate * one <= _USUAL[1]]
    return min(usual, key=lambda one: abs(math.log(rate * one / _COMMON)), default=None)
