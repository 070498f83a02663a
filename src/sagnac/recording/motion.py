"""Gyros that move while nothing tells how: no bench."""

import math
from typing import Final

import numpy as np

from sagnac.errors import Level, Note
from sagnac.recording.channel import Channel
from sagnac.recording.encoder_mismatch import TURNING_RATE, block_rates
from sagnac.recording.model import Recording, second_of
from sagnac.recording.profile import Profile
from sagnac.recording.soundness import remedy_of
from sagnac.recording.stretches import longest_between
from sagnac.units import DEGREE

# Scatters of the mean of a block of noise beyond which it moves.
_SIGMAS: Final = 10.0
# A rate that never changes is the bias of the cheapest gyros up to here, and a table beyond.
_LARGEST_BIAS: Final = 25.0 * DEGREE
# So is one beyond this many times the walk in a root second: 200 deg/s for 1 deg/sqrt(h). Of MEMS
# units as they are sold it is 70 at most.
_BIAS_OVER_WALK: Final = 12_000.0


def motion_notes(recording: Recording, gyro: Channel, profile: Profile) -> tuple[Note, ...]:
    """A gyro that turns now more and now less without an encoder beside: an error.

    Means over seconds that lie farther than 2 deg/s from their median, and farther than noise puts
    them, are motion. What is read then is that of the motion.
    """
    rates, starts = block_rates(recording, gyro)
    if rates.size < 2:
        return ()
    middle = float(np.median(rates))
    off = np.abs(rates - middle)
    scale = profile.scale * (1.0 if gyro.kind == "rate" else recording.sample_rate)
    length = recording.samples / rates.size
    limit = max(TURNING_RATE, _SIGMAS * scale / np.sqrt(length))
    moves = np.flatnonzero(off > limit)
    if moves.size == 0:
        walk = scale / math.sqrt(recording.sample_rate)
        return _turns_steadily(recording, gyro, middle, max(TURNING_RATE, _BIAS_OVER_WALK * walk))
    between = longest_between(rates.size, moves)
    edges = np.append(starts, recording.samples)
    still = type(between)(first=int(edges[between.first]), after=int(edges[between.after]))
    text = (
        f"turns at up to {float(np.abs(rates).max()) / DEGREE:.3g} deg/s, in "
        f"{100.0 * moves.size / rates.size:.2g} % of the record, first at "
        f"{second_of(recording, int(starts[moves[0]])):.1f} s, and no encoder is named: this is no "
        f"still bench; name the encoder with {{table}}, or {remedy_of(recording, still)}"
    )
    return (Note(name="motion", level="error", channel=gyro.name, text=text),)


def _turns_steadily(
    recording: Recording, gyro: Channel, rate: float, largest: float
) -> tuple[Note, ...]:
    """A mean rate beyond the bias of any gyro: a warning; or beyond the `largest`, rad/s, that one
    of such noise has: an error, since what is read then is the error of the table."""
    if abs(rate) < min(_LARGEST_BIAS, largest):
        return ()
    why = "and no encoder is named: name it with {table}"
    if recording.table is not None:
        why = "and the encoder that is named does not: name its column and unit with {table}"
    text = (
        f"turns steadily at {rate / DEGREE:.4g} deg/s, as on a table, {why}, or state the right "
        "{unit}"
    )
    level: Level = "error" if abs(rate) >= largest else "warning"
    return (Note(name="motion", level=level, channel=gyro.name, text=text),)
