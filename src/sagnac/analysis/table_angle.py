"""The table as an analysis uses it, and the gyros without what only its encoder says."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np

from sagnac.analysis.measurement import Measurement
from sagnac.analysis.settings import Method
from sagnac.core.arrays import FloatArray, differences, elementwise, mean, square
from sagnac.core.errors import Note, RecordingError, rounded
from sagnac.core.units import ARCSECOND
from sagnac.quality.encoder_faults import require_encoder_follows
from sagnac.recording.channel import angle_of
from sagnac.recording.model import Recording
from sagnac.table.estimate import EstimatedTable, estimated_table, order_drift
from sagnac.table.kinematics import KINEMATIC_RATE, averages_of
from sagnac.table.turns import SHORTEST, is_turning, mean_rate

ALIKE: Final = (0.9, 1.1)
"""Weights of a pair that take the table out of it, between which they stand for its difference."""

# Motion that two gyros do not share, in that of both, from which on no weights take it out.
_TOGETHER: Final = 0.1
# Part of the pair's increments by which the encoder has to raise them for weights far from one.
_QUIETER: Final = 0.9
# Change of a delay that is worth a note, s. What interpolation does between slow readings is less.
_CHANGES: Final = 1e-4
# Standard errors of it from which on it is no chance.
_SURE: Final = 5.0
# Noise of the encoder that is worth a note: beside the gyros in all, and at least.
_NOISY: Final = 1.0 * ARCSECOND


@dataclass(frozen=True, slots=True, kw_only=True)
class TurningTable:
    """The table as an analysis uses it.

    Attributes
    ----------
    angle
        (samples,) as read, unwrapped, rad; None where nothing turns.
    estimate
        What gyros and encoder together say of it; None for a method that takes readings as they
        are.
    shares
        Gyro -> its share of the table's rate, as in `estimate`.
    notes
        On the encoder.
    """

    angle: FloatArray | None
    estimate: EstimatedTable | None = None
    shares: Mapping[str, float] = field(default_factory=dict)
    notes: tuple[Note, ...] = ()

    @property
    def known(self) -> FloatArray | None:
        """(samples,) the best angle there is, rad."""
        return self.angle if self.estimate is None else self.estimate.angle

    @property
    def readings(self) -> FloatArray | None:
        """(samples,) as read, a delay taken out, rad."""
        return self.angle if self.estimate is None else self.estimate.readings


def turning_table(recording: Recording, gyros: tuple[str, ...], method: Method) -> TurningTable:
    """The table angle, if there is a table and it turns.

    Raises
    ------
    RecordingError
        If the encoder does not follow the gyros, or the recording is too short to tell its motion
        from their noise.
    """
    if recording.table is None:
        return TurningTable(angle=None)
    table = recording.table.values
    if not is_turning(table):
        note = Note(text="the table does not turn: its angle is not used")
        return TurningTable(angle=None, notes=(note,))
    if method == "fos" and recording.duration < SHORTEST:
        raise RecordingError(
            f"{recording.duration:.4g} s of a turning table do not tell its motion from the "
            "gyro's noise",
            remedy=f"take {SHORTEST:g} s or more, or the standing part ({{slice}})",
        )
    for name in gyros:
        require_encoder_follows(recording, recording.gyro(name))
    if method != "fos":
        return TurningTable(angle=table)
    rate = recording.sample_rate
    estimate = estimated_table(
        [angle_of(recording.gyro(name), rate) for name in gyros], table, rate
    )
    return TurningTable(
        angle=table,
        estimate=estimate,
        shares=dict(zip(gyros, estimate.shares.tolist(), strict=True)),
        notes=_notes(estimate, _rms_rate(estimate.angle, rate)),
    )


def _rms_rate(angle: FloatArray, sample_rate: float) -> float:
    """Root mean square rate of a table that may turn back or stand, rad/s."""
    block = max(1, round(sample_rate / KINEMATIC_RATE))
    return float(np.sqrt(np.mean(np.diff(averages_of(angle, block)) ** 2))) * sample_rate / block


def _notes(estimate: EstimatedTable, rate: float) -> tuple[Note, ...]:
    """How the encoder is read beside the gyros, on a table of that rms rate, rad/s."""
    notes = []
    delay = estimate.delay
    if delay is not None:
        late = "after" if delay.mean > 0.0 else "before"
        text = (
            f"its readings come {1e3 * abs(delay.mean):.4g} ms (± {1e3 * delay.mean_error:.1g} ms) "
            f"{late} the gyros'"
        )
        if abs(delay.change) > max(_SURE * delay.change_error, _CHANGES):
            text += (
                f", and the delay changes by {1e3 * delay.change:+.4g} ms (± "
                f"{1e3 * delay.change_error:.1g} ms) over the record"
            )
        text += "; they are shifted by that"
        notes.append(Note(channel="table", text=text))
    if estimate.smoothed and estimate.noise > _NOISY:
        jitter = estimate.noise / max(rate, 1e-12)
        text = (
            f"its readings scatter by {rounded(estimate.noise / ARCSECOND, 3)} arcsec rms about "
            "the angle that the gyros sense, as if latched "
            f"{rounded(1e6 * jitter, 3)} us rms beside them; above {estimate.corner:.2g} Hz the "
            "angle is taken from the gyros"
        )
        notes.append(Note(channel="table", text=text))
    return tuple(notes)


def settled(table: TurningTable, measured: Measurement) -> TurningTable:
    """The table with the phases that the orders of what is measured keep.

    Parameters
    ----------
    table
        As `turning_table` gives it.
    measured
        As `followed` gives it.
    """
    if table.estimate is None:
        return table
    share = measured.share(table.shares)
    drift = order_drift(table.estimate, measured.angle, measured.sample_rate, share=share)
    if drift is None:
        return table
    led = replace(table, estimate=table.estimate.led(drift))
    rate = mean_rate(table.estimate.angle, measured.sample_rate)
    # A delay that was fitted has a change of its own, with an error that the orders undo.
    fitted = 0.0 if table.estimate.delay is None else table.estimate.delay.change
    change, error = fitted + drift.value / rate, drift.error / abs(rate)
    if fitted and abs(change) < max(_SURE * error, _CHANGES):
        return led
    note = Note(
        channel="table",
        text=f"its angle runs off by {change * rate / ARCSECOND:+.4g} arcsec (± "
        f"{rounded(drift.error / ARCSECOND, 1)} arcsec) over the record against what repeats with "
        f"it, as if its delay changed by {1e3 * change:.3g} ms; the angle is brought to that",
    )
    return replace(led, notes=(*table.notes, note))


def followed(measured: Measurement, recording: Recording, table: TurningTable) -> Measurement:
    """The measurement without what the encoder's readings say beside the estimated angle.

    Two gyros take the table out by themselves: each is weighted by the other's share, so that
    no error of the encoder is left. One gyro alone has the readings taken off, since
    nothing else tells its own noise from the table's motion.

    Parameters
    ----------
    measured
        One gyro or a difference.
    recording
        With the gyros.
    table
        As `turning_table` gives it.
    """
    estimate = table.estimate
    if estimate is None:
        return measured
    share = measured.share(table.shares)
    if measured.is_pair:
        weights = _weights([table.shares[name] for name in measured.gyros])
        first, second = (
            angle_of(recording.gyro(name), measured.sample_rate) for name in measured.gyros
        )
        alone = elementwise(lambda x, z: weights[0] * x - weights[1] * z, first, second)
        if _takes_table_out(weights, measured, alone, share, estimate):
            return replace(measured, angle=alone, weights=weights)
    if estimate.angle is estimate.readings:
        return measured
    own = elementwise(
        lambda angle, readings, known: angle - share * (readings - known),
        measured.angle, estimate.readings, estimate.angle,
    )  # fmt: skip
    return replace(measured, angle=own)


def _weights(shares: Sequence[float]) -> tuple[float, float]:
    """Weights of two gyros that leave no motion of the table; their squares add up to 2."""
    size = math.hypot(*shares)
    if size == 0.0:
        return 1.0, 1.0
    sign = math.copysign(math.sqrt(2.0), shares[1])
    return sign * shares[1] / size, sign * shares[0] / size


def _takes_table_out(
    weights: tuple[float, float],
    measured: Measurement,
    alone: FloatArray,
    share: float,
    estimate: EstimatedTable,
) -> bool:
    """Whether two gyros `alone`, so weighted, tell more than their difference and the encoder."""
    if not 0.0 < estimate.alike < _TOGETHER:
        return False
    if all(ALIKE[0] < abs(weight) < ALIKE[1] for weight in weights):
        return True
    by_encoder = elementwise(
        lambda angle, table: angle - share * table, measured.angle, estimate.readings
    )
    block = max(1, round(measured.sample_rate / KINEMATIC_RATE))
    slow = _step(averages_of(alone, block)) < _QUIETER * _step(averages_of(by_encoder, block))
    return slow or _step(alone) < _QUIETER * _step(by_encoder)


def _step(angle: FloatArray) -> float:
    """Rms increment about the mean, rad."""
    steps = differences(angle)
    return math.sqrt(max(square(steps) / steps.size - mean(steps) ** 2, 0.0))
