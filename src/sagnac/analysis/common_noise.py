"""Whether the two gyros of a pair share noise, which their difference hides."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from sagnac.analysis.averaged import Averaged
from sagnac.analysis.measurement import Measurement
from sagnac.analysis.removal import Remainder
from sagnac.analysis.table_angle import TurningTable
from sagnac.core.arrays import FloatArray
from sagnac.core.errors import Note, rounded
from sagnac.noise.common_walk import CommonWalk, common_walk, differenced_factor
from sagnac.noise.estimates import Estimate
from sagnac.recording.channel import angle_of
from sagnac.recording.model import Recording
from sagnac.table.kinematics import Kinematics, block_averages, block_gain, harmonic_sum, kinematics
from sagnac.table.motion import follow_table_together
from sagnac.table.turns import FEW_TURNS, full_turns

# A share below this does not matter.
_MATTERS: Final = 0.01


@dataclass(frozen=True, slots=True, kw_only=True)
class Sharing:
    """Noise that two gyros on one table share.

    Attributes
    ----------
    notes
        What is said of it.
    reads
        Smallest and largest factor at which the difference reads N of a gyro itself; None if
        nothing that matters is seen.
    """

    notes: tuple[Note, ...] = ()
    reads: tuple[float, float] | None = None

    def widened(self, read: Estimate) -> Estimate:
        """N per gyro of the difference with an interval that holds N of the gyros themselves."""
        if self.reads is None or read.status != "estimated":
            return read
        least, most = self.reads
        return replace(
            read, low=min(read.low, read.low / most), high=max(read.high, read.high / least)
        )


def sharing_of(
    recording: Recording,
    measured: Measurement,
    left: Remainder,
    found: Averaged | None,
    *,
    table: TurningTable,
    confidence: float,
) -> Sharing:
    """Shared noise by the cross spectrum of gyros on a turning table, motion and orders taken out.

    What the encoder adds to every gyro looks like the gyros' own, but not like an angle random
    walk (`noise.common_walk`), unless it wanders.

    Parameters
    ----------
    recording
        With the gyros.
    measured, left
        The difference, and what removal left of it.
    found
        The average, which says where N rules; None if there is none.
    table
        As the analysis uses it.
    confidence
        Of the interval.
    """
    if found is None or table.angle is None or not measured.is_pair:
        return Sharing()
    walk = found.average.angle_random_walk
    if walk.status != "estimated":
        return Sharing()
    shared = shared_walk(
        recording,
        measured.gyros,
        table,
        band_hz=found.average.rests_on.band_hz,
        masked=left.removal.masked,
        confidence=confidence,
    )
    return Sharing() if shared is None else _worded(measured.channel, shared, walk.value)


def shared_walk(
    recording: Recording,
    gyros: tuple[str, ...],
    table: TurningTable,
    *,
    band_hz: tuple[float, float] = (0.0, math.inf),
    masked: Sequence[tuple[float, float]],
    confidence: float,
) -> CommonWalk | None:
    """Angle random walk that gyros on a turning table show alike: their own, or the encoder's.

    Parameters
    ----------
    recording
        With the gyros.
    gyros
        Names.
    table
        As the analysis uses it.
    band_hz
        In which to look.
    masked
        (low, high) bands to leave out, Hz.
    confidence
        Of the interval.

    Returns
    -------
    CommonWalk or None
        None if it cannot be told.
    """
    known, readings = table.known, table.readings
    if known is None or readings is None or full_turns(known) < FEW_TURNS:
        # Table motion and its orders are nearly one basis: nothing is left of a gyro alone.
        return None
    kinematic = kinematics(known, recording.sample_rate)
    angles = [angle_of(recording.gyro(name), recording.sample_rate) for name in gyros]
    increments = np.diff(_without_table(angles, kinematic, readings))
    rate = 1.0 / kinematic.interval
    low, high = band_hz
    try:
        return common_walk(
            increments,
            sample_rate=rate,
            band_hz=(low, min(high, _PART_OF_RATE * rate)),
            masked=masked,
            confidence=confidence,
        )
    except ValueError:
        # A band that is too narrow, or of lines alone.
        return None


# What differencing leaves of N, below which it is the encoder that wanders: two gyros hardly share
# more noise than they have of their own.
_ENCODER: Final = 0.6
# Half intervals that a wander of the encoder has to measure to be named.
_CLEAR: Final = 5.0
# More than this it adds to no N: gyros do not lean on each other so.
_ODD: Final = 1.5
# What it leaves at the least, below which nothing is told.
_TELLING: Final = 0.5
# Part of the rate of averages above which they are bent.
_PART_OF_RATE: Final = 0.25


def _without_table(
    angles: list[FloatArray], kinematic: Kinematics, readings: FloatArray
) -> FloatArray:
    """(gyros, averages) of angles, rad, without table motion, Earth rate and whole orders.

    They are fitted to the angle that gyros and encoder know together. The share that each gyro has
    is then taken of the readings: what the encoder errs by is left in all gyros alike.
    """
    averages = np.stack([block_averages(angle, kinematic) for angle in angles])
    errors = block_averages(readings, kinematic) - kinematic.angle
    for number, motion in enumerate(follow_table_together(averages, kinematic)):
        of = motion.kinematics
        gain = block_gain(of, motion.orders)
        orders = harmonic_sum(of.angle, motion.orders, motion.cosine * gain, motion.sine * gain)
        averages[number] -= motion.averages + orders + motion.share * errors
    return averages


def _worded(channel: str, shared: CommonWalk, walk: float) -> Sharing:
    low, factor, high = (
        differenced_factor(square, walk) for square in (shared.high, shared.square, shared.low)
    )
    if not shared.is_present or factor > _ODD:
        most = max(0.0, 1.0 - low)
        text = (
            "whether the two gyros share an angle random walk cannot be told beside the noise of "
            "the encoder"
            if low < _TELLING or factor > _ODD
            else "no angle random walk that the two gyros share is seen beside the table's motion: "
            f"the difference reads at most {rounded(100.0 * most)} % low against the gyros "
            "themselves"
        )
        return Sharing(notes=(Note(channel=channel, text=text),))
    if factor < _ENCODER:
        clear = shared.square > _CLEAR * (shared.square - shared.low)
        return Sharing(notes=(_wander(shared),) if clear else ())
    off, ends = 100.0 * (factor - 1.0), sorted(abs(100.0 * (end - 1.0)) for end in (low, high))
    matters = abs(factor - 1.0) >= _MATTERS
    note = Note(
        name="shared",
        effect=factor,
        channel=channel,
        level="warning" if matters else "remark",
        text="the two gyros share an angle random walk that their difference does not show: per "
        f"gyro it reads {rounded(abs(off))} % ({rounded(ends[0])} to {rounded(ends[1])} %) "
        f"{'low' if off < 0.0 else 'high'} against the gyros themselves, unless the encoder "
        f"wanders that much{'; the interval allows for it' if matters else ''}",
    )
    return Sharing(notes=(note,), reads=(low, high) if matters else None)


def _wander(shared: CommonWalk) -> Note:
    """The wander of an encoder, as two gyros show it alike."""
    walk = Estimate(
        name="angle_random_walk",
        value=math.sqrt(shared.square),
        low=math.sqrt(shared.low),
        high=math.sqrt(shared.high),
        confidence=shared.confidence,
        status="estimated",
    )
    return Note(
        channel="table",
        text="its readings wander: each gyro taken against them shows "
        f"{walk.to('deg/sqrt(h)')} of the encoder's; the answer of the two gyros is free of it, "
        "one alone would not be",
    )
