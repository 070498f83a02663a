"""Samples of a gyro that were lost and stand as zeros."""

import math
from typing import Final

import numpy as np

from sagnac import series
from sagnac.errors import Note, counted
from sagnac.recording.channel import Channel
from sagnac.recording.effects import finding
from sagnac.recording.model import Recording, second_of
from sagnac.recording.profile import Profile
from sagnac.recording.stretches import Places, Tally

# Zeros that are dropouts are this many, and this many times as many as the values next to zero.
_LEAST_OFTEN: Final = 10
_OFTENER: Final = 3
# Steps of the readout that noise strays over if a sample is 0 by chance alone; and standard
# deviations of the noise by which 0 lies off the rest, however coarse the steps.
_FINE: Final = 20.0
_AWAY: Final = 4.0
# An angle falls to zero by this many of its usual steps.
_FALL: Final = 50.0


def dropout_notes(recording: Recording, gyro: Channel, profile: Profile) -> tuple[Note, ...]:
    """Zeros far more often than the values beside zero; of an angle, zeros that it falls to."""
    if gyro.kind == "angle":
        zeros, effect = _falls(gyro, profile), None
    else:
        # A gyro that counts coarsely, and turns little, counts 0 most of the time.
        fine = profile.scale > _FINE * profile.step
        away = abs(float(np.median(profile.level))) > _AWAY * profile.scale
        zeros = _zeros(gyro) if fine or away else Tally(count=0, first=-1)
        effect = _effect(gyro, zeros.count)
    if zeros.count == 0:
        return ()
    text = (
        f"{counted(zeros.count, 'sample')} of exactly zero, the first at "
        f"{second_of(recording, zeros.first):.3f} s, as if readings were lost (dropouts); mark "
        "lost samples as NaN"
    )
    return (finding("dropouts", gyro.name, text, effect=effect),)


def _zeros(gyro: Channel) -> Tally:
    """Zeros of a rate or of increments, if they are too many."""
    values = gyro.values
    zeros = Places(values=values, test=lambda some: some == 0.0).tally()
    if zeros.count < _LEAST_OFTEN:
        return Tally(count=0, first=-1)

    def beside(block: slice) -> tuple[float, float]:
        part = values[block]
        above, below = part[part > 0.0], part[part < 0.0]
        return float(above.min(initial=math.inf)), float(below.max(initial=-math.inf))

    found = np.array(series.map(beside, values.size, values))
    next_up, next_down = float(found[:, 0].min()), float(found[:, 1].max())
    usual = max(
        Places(values=values, test=lambda some: some == next_up).tally().count,
        Places(values=values, test=lambda some: some == next_down).tally().count,
    )
    return zeros if zeros.count > _OFTENER * usual else Tally(count=0, first=-1)


def _falls(gyro: Channel, profile: Profile) -> Tally:
    """Zeros that an angle falls to from far away."""
    values = gyro.values
    steps = series.every(profile.changes, max(1, profile.changes.size // 100_000))
    fall = _FALL * float(np.median(np.abs(steps)))
    if not fall:
        return Tally(count=0, first=-1)
    falls = Places(
        values=values,
        test=lambda some: (some[1:] == 0.0) & (np.abs(some[:-1]) > fall),
        following=1,
    ).tally()
    return Tally(count=falls.count, first=falls.first + 1)


def _effect(gyro: Channel, zeros: int) -> float | None:
    """Scatter of all samples over that without the zeros."""
    values = gyro.values
    left = values.size - zeros
    if not 0 < zeros < values.size - 1:
        return None
    mean = series.mean(values) * values.size / left

    def squares(block: slice) -> float:
        part = values[block]
        part = part[part != 0.0] - mean
        return float(part @ part)

    inside = series.total(squares, values.size, values) / left
    # Zeros lie by the mean off the rest.
    share = zeros / values.size
    whole = (1.0 - share) * inside + share * (1.0 - share) * mean * mean
    return math.sqrt(whole / inside) if inside > 0.0 else None
