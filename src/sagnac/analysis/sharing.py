"""Whether the two gyros of a pair share noise, which their difference hides: at rest, turning."""

import math
from collections.abc import Sequence
from typing import Final

import numpy as np

from sagnac import series
from sagnac.analysis.averaged import Averaged
from sagnac.analysis.measurement import Measurement
from sagnac.analysis.removal import Remainder
from sagnac.analysis.table_angle import TurningTable
from sagnac.arrays import FloatArray
from sagnac.coefficients.common_noise import Common, band_moments, common_noise
from sagnac.coefficients.common_walk import CommonWalk, common_walk, differenced_factor
from sagnac.coefficients.estimates import Estimate
from sagnac.errors import Note
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

# A correlation below this moves the answer by less than half a per cent.
_WORTH_A_NOTE: Final = 0.01
# Samples of each gyro that are looked at.
_MOST: Final = 2**21


def sharing_notes(
    recording: Recording, measured: Measurement, left: Remainder, found: Averaged
) -> tuple[Note, ...]:
    """What the cross spectrum of a pair at rest says over the band of N.

    On a turning table both gyros sense the table, and their cross spectrum is of that.

    Parameters
    ----------
    recording
        With both gyros.
    measured, left
        The difference, and what removal left of it.
    found
        The average, which says where N rules.
    """
    if measured.gyros_differenced == 1 or not found.average.rests_on.terms:
        return ()
    rate = recording.sample_rate
    increments = np.stack(
        [
            series.differences(angle_of(recording.gyro(name), rate)[: _MOST + 1])
            for name in measured.gyros
        ]
    )
    low, high = found.average.rests_on.band_hz
    try:
        moments = band_moments(
            increments,
            sample_rate=rate,
            band_hz=(low, min(high, 0.5 * rate)),
            masked=left.removal.masked,
        )
    except ValueError:
        # A band of lines alone.
        return ()
    common = common_noise(moments)
    return (_note(measured.channel, common),) if common.degrees_of_freedom > _LEAST else ()


# Degrees of freedom from which on a correlation says anything.
_LEAST: Final = 8.0


def _note(channel: str, common: Common) -> Note:
    said = f"correlation {common.correlation:+.2g} ({common.low:+.2g} to {common.high:+.2g})"
    if not common.present or abs(common.correlation) < _WORTH_A_NOTE:
        return Note(
            channel=channel, text=f"the two gyros share no noise in the band of the answer: {said}"
        )
    off = 100.0 * (common.differenced - 1.0)
    return Note(
        name="shared",
        effect=common.differenced,
        channel=channel,
        level="warning" if abs(off) >= 1.0 else "remark",
        text=f"the two gyros share noise in the band of the answer ({said}): the difference reads "
        f"{abs(off):.2g} % {'low' if off < 0.0 else 'high'} against the gyros themselves; "
        "see each alone ({gyros})",
    )


# --- on a turning table -----------------------------------------------------------------------


def sharing_notes_of_turning(
    recording: Recording,
    measured: Measurement,
    left: Remainder,
    found: Averaged,
    *,
    table: TurningTable,
    confidence: float,
) -> tuple[Note, ...]:
    """What the cross spectrum of gyros on a turning table says, motion and orders taken out.

    What the encoder adds to every gyro looks like the gyros' own, but not like an angle random
    walk (`coefficients.common_walk`), unless it wanders.

    Parameters
    ----------
    recording
        With the gyros.
    measured, left
        The difference, and what removal left of it.
    found
        The average, which says where N rules.
    table
        As the analysis uses it.
    confidence
        Of the interval.
    """
    walk = found.average.angle_random_walk
    if measured.gyros_differenced == 1 or walk.status != "estimated":
        return ()
    shared = shared_walk(
        recording,
        measured.gyros,
        table,
        band_hz=found.average.rests_on.band_hz,
        masked=left.removal.masked,
        confidence=confidence,
    )
    return () if shared is None else (_note_of_turning(measured.channel, shared, walk.value),)


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
    readings = table.angle if table.estimate is None else table.estimate.readings
    if readings is None or full_turns(readings) < FEW_TURNS:
        # Table motion and its orders are nearly one basis: nothing is left of a gyro alone.
        return None
    kinematic = kinematics(readings, recording.sample_rate)
    angles = [angle_of(recording.gyro(name), recording.sample_rate) for name in gyros]
    increments = np.diff(_without_table(angles, kinematic))
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
# What it leaves at the least, below which nothing is told.
_TELLING: Final = 0.5
# Part of the rate of averages above which they are bent.
_PART_OF_RATE: Final = 0.25


def _without_table(angles: list[FloatArray], kinematic: Kinematics) -> FloatArray:
    """(gyros, averages) of angles, rad, without table motion, Earth rate and whole orders."""
    averages = np.stack([block_averages(angle, kinematic) for angle in angles])
    for number, motion in enumerate(follow_table_together(averages, kinematic)):
        of = motion.kinematics
        gain = block_gain(of, motion.orders)
        orders = harmonic_sum(of.angle, motion.orders, motion.cosine * gain, motion.sine * gain)
        averages[number] -= motion.averages + orders
    return averages


def _note_of_turning(channel: str, shared: CommonWalk, walk: float) -> Note:
    low, factor, high = (
        differenced_factor(square, walk) for square in (shared.high, shared.square, shared.low)
    )
    if factor < _ENCODER and shared.is_present:
        walks = Estimate(
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
            f"{walks.to('deg/sqrt(h)')} of the encoder's; the answer of the two gyros is free of "
            "it, one alone would not be",
        )
    if not shared.is_present:
        if low < _TELLING:
            return Note(
                channel=channel,
                text="whether the two gyros share an angle random walk cannot be told beside the "
                "noise of the encoder",
            )
        return Note(
            channel=channel,
            text="no angle random walk that the two gyros share is seen beside the table's motion: "
            f"the difference reads at most {100.0 * (1.0 - low):.2g} % low against the gyros "
            "themselves",
        )
    off, ends = 100.0 * (factor - 1.0), sorted(abs(100.0 * (end - 1.0)) for end in (low, high))
    return Note(
        name="shared",
        effect=factor,
        channel=channel,
        level="warning" if abs(off) >= 1.0 else "remark",
        text="the two gyros share an angle random walk that their difference does not show: per "
        f"gyro it reads {abs(off):.2g} % ({ends[0]:.2g} to {ends[1]:.2g} %) "
        f"{'low' if off < 0.0 else 'high'} against the gyros themselves, unless the encoder "
        "wanders that much",
    )
