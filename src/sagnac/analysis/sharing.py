"""Whether the two gyros of a pair share noise, which their difference hides."""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from sagnac.analysis.averaged import Averaged
from sagnac.analysis.measurement import Measurement
from sagnac.analysis.removal import Remainder
from sagnac.arrays import FloatArray
from sagnac.coefficients.common_walk import CommonWalk, common_walk, differenced_factor
from sagnac.coefficients.estimates import Estimate
from sagnac.errors import Note, rounded
from sagnac.recording.kinds import angle_of
from sagnac.recording.model import Recording
from sagnac.table.kinematics import (
    Kinematics,
    block_averages,
    block_gain,
    harmonic_sum,
    kinematics,
)
from sagnac.table.motion import follow_table_together
from sagnac.table.turns import FEW_TURNS, full_turns

# A share below this does not matter.
_MATTERS: Final = 0.01


@dataclass(frozen=True, slots=True, kw_only=True)
class Sharing:
    """What two gyros on one table share.

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

    def __post_init__(self) -> None:
        if self.reads is not None and not 0.0 < self.reads[0] <= self.reads[1]:
            raise ValueError(f"reads is {self.reads}; give two factors above zero, low then high")

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
    found: Averaged,
    *,
    table: FloatArray,
    confidence: float,
) -> Sharing:
    """What the cross spectrum of gyros on a turning table says, motion and orders taken out.

    What the encoder adds to every gyro looks like the gyros' own, but not like an angle random
    walk (`coefficients.common_walk`).

    Parameters
    ----------
    recording
        With the gyros.
    measured, left
        The difference, and what removal left of it.
    found
        The average, which says where N rules.
    table
        (samples,) unwrapped table angle, rad.
    confidence
        Of the interval.
    """
    walk = found.average.angle_random_walk
    if measured.gyros_differenced == 1 or walk.status != "estimated":
        return Sharing()
    if full_turns(table) < FEW_TURNS:
        # Table motion and its orders are nearly one basis: nothing is left of a gyro alone.
        return Sharing()
    kinematic = kinematics(table, recording.sample_rate)
    gyros = (recording.gyro(name) for name in measured.gyros)
    angles = [angle_of(gyro, recording.sample_rate) for gyro in gyros]
    increments = np.diff(_without_table(angles, table, kinematic))
    rate = 1.0 / kinematic.interval
    low, high = found.average.rests_on.band_hz
    try:
        shared = common_walk(
            increments,
            sample_rate=rate,
            band_hz=(low, min(high, _PART_OF_RATE * rate)),
            masked=left.removal.masked,
            confidence=confidence,
        )
    except ValueError:
        # A band that is too narrow, or of lines alone.
        return Sharing()
    return _worded(measured.channel, shared, walk.value)


# Part of the rate of averages above which they are bent.
_PART_OF_RATE: Final = 0.25


def _without_table(
    angles: list[FloatArray], table: FloatArray, kinematic: Kinematics
) -> FloatArray:
    """(gyros, averages) of angles, rad, without table motion, Earth rate and whole orders."""
    averages = np.stack([block_averages(angle, kinematic) for angle in angles])
    for number, motion in enumerate(follow_table_together(averages, table, kinematic)):
        of = motion.kinematics
        gain = block_gain(of, motion.orders)
        orders = harmonic_sum(of.angle, motion.orders, motion.cosine * gain, motion.sine * gain)
        averages[number] -= motion.averages + orders
    return averages


def _worded(channel: str, shared: CommonWalk, walk: float) -> Sharing:
    low, factor, high = (
        differenced_factor(square, walk) for square in (shared.high, shared.square, shared.low)
    )
    if not shared.is_present:
        text = (
            "no angle random walk that the two gyros share is seen beside the table's motion: "
            f"the difference reads at most {rounded(100.0 * (1.0 - low))} % low against the gyros "
            "themselves"
        )
        return Sharing(notes=(Note(channel=channel, text=text),))
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
