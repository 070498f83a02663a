"""Gyros that move while nothing tells how: no bench."""

from typing import Final

import numpy as np

from sagnac.errors import Note
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
        return _turns_steadily(gyro, middle)
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


def _turns_steadily(gyro: Channel, rate: float) -> tuple[Note, ...]:
    if abs(rate) < _LARGEST_BIAS:
        return ()
    text = (
        f"turns steadily at {rate / DEGREE:.4g} deg/s, as on a table, and no encoder is named: "
        "name it with {table}, or state the right {unit}"
    )
    return (Note(name="motion", level="warning", channel=gyro.name, text=text),)
