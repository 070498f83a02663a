"""Whether the encoder and the gyros turn together."""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from sagnac import series
from sagnac.arrays import FloatArray
from sagnac.errors import RecordingError
from sagnac.recording.findings import Finding, counted, longest_stretch, places_where
from sagnac.recording.model import Channel, Recording, second_of
from sagnac.units import DEGREE

# A gyro senses at most the whole of the table's rate; a tenth is left for its scale factor.
LARGEST_SHARE: Final = 1.1
# An encoder jumps when it moves by this much from one sample to the next, this many times as far as
# it usually does, and the gyro moves less than half of that in so many samples around: no table
# leaves its gyros behind, but the two may be sampled some samples apart.
LEAST_JUMP: Final = 1.0 * DEGREE
JUMP_RATIO: Final = 10.0
JUMP_REACH: Final = 2
LEAST_SHARE: Final = 0.05
# A gyro is said to turn above this rate: more than the bias of any gyro on a rate table, but
# for a MEMS gyro as it comes from the factory.
TURNING_RATE: Final = 2.0 * DEGREE


def require_encoder_follows(recording: Recording, gyro: Channel) -> None:
    """Refuse an encoder whose motion is not the gyro's.

    The record is cut into blocks of at least 1 s and the share of the table rate that the
    gyro senses is taken as the median over the blocks in which the table turns. A block
    disagrees when gyro rate minus share times table rate exceeds the larger of 2 deg/s and
    a fifth of the rate sensed at the table's usual rate. One block in a hundred may (a
    start, a stop, a stamp that came late); more is an error. So a gyro across the axis,
    whose share is about zero, follows any encoder as long as it does not turn itself, and
    turning below 2 deg/s decides nothing. A share beyond 1.1 is an error too: no gyro
    turns faster than its table.

    Raises
    ------
    RecordingError
        If the two do not belong together.
    """
    finding = _encoder_finding(recording, gyro)
    if finding is not None:
        where = recording.provenance.path if recording.provenance else "recording"
        raise RecordingError(f"{where}: {finding.channel}: {finding.message}")


def _block_angles(channel: Channel, sample_rate: float, edges: NDArray[np.intp]) -> FloatArray:
    """Angle turned from each edge to the next, rad, shape (edges - 1,)."""
    if channel.kind == "angle":
        return np.diff(series.at(channel.values, edges))
    sums = np.empty(edges.size - 1)
    for blocks in series.spans(sums.size, max(1, series.SPAN * sums.size // edges[-1])):
        inside = edges[blocks.start : blocks.stop + 1]
        # reduceat runs its last sum to the end of what it is given: the last edge included.
        values = channel.values[inside[0] + 1 : inside[-1] + 1]
        sums[blocks] = np.add.reduceat(values, inside[:-1] - inside[0])
        series.release(values)
    return sums if channel.kind == "increment" else sums / sample_rate


def block_rates(recording: Recording, channel: Channel) -> tuple[FloatArray, NDArray[np.intp]]:
    """Mean rate over blocks of about a second, rad/s, and the samples they start at."""
    samples = recording.samples
    second = max(1, round(recording.sample_rate))
    blocks = max(min(samples // second, 4096), min(samples - 1, 20))
    edges = np.linspace(0, samples - 1, blocks + 1).astype(np.intp)
    seconds = np.diff(edges) / recording.sample_rate
    return _block_angles(channel, recording.sample_rate, edges) / seconds, edges[:-1]


def _share(gyro_rate: FloatArray, table_rate: FloatArray) -> float:
    """Share of the table rate that the gyro senses; NaN where the table does not turn."""
    usual = float(np.percentile(np.abs(table_rate), 90.0))
    turning = np.abs(table_rate) > max(0.2 * usual, 0.05 * DEGREE)
    if not turning.any():
        return math.nan
    return float(np.median(gyro_rate[turning] / table_rate[turning]))


def _encoder_finding(recording: Recording, gyro: Channel) -> Finding | None:
    if recording.table is None:
        return None
    gyro_rate, starts = block_rates(recording, gyro)
    table_rate, _ = block_rates(recording, recording.table)
    share = _share(gyro_rate, table_rate)
    usual = float(np.percentile(np.abs(table_rate), 90.0))
    if math.isnan(share):
        share = 0.0
    limit = max(TURNING_RATE, 0.2 * abs(share) * usual)
    disagree = np.flatnonzero(np.abs(gyro_rate - share * table_rate) > limit)
    if disagree.size > max(2.0, 0.01 * gyro_rate.size):
        at = second_of(recording, int(starts[disagree[0]]))
        first = disagree[0]
        return Finding(
            level="error",
            channel="table",
            message=f"the encoder does not follow gyro {gyro.name} in "
            f"{100.0 * disagree.size / gyro_rate.size:.0f} % of the record, first at {at:.1f} s "
            f"(gyro {gyro_rate[first] / DEGREE:.3g} deg/s, encoder "
            f"{table_rate[first] / DEGREE:.3g} deg/s); name the right column and unit with "
            "--table, or take a sound stretch with --slice",
        )
    if abs(share) > LARGEST_SHARE:
        return Finding(
            level="error",
            channel=gyro.name,
            message=f"turns {share:.3g} times as fast as the table: a unit or kind is wrong; "
            "state --unit and --kind, or the table's with --table COLUMN:UNIT",
        )
    return _unfollowed_jump(recording, recording.table, gyro, share)


def _unfollowed_jump(
    recording: Recording, table: Channel, gyro: Channel, share: float
) -> Finding | None:
    """A jump of the encoder that the gyro does not make; None where it senses too little."""
    if abs(share) < LEAST_SHARE:
        return None
    angle, values = table.values, gyro.values
    sample = np.arange(0, angle.size - 1, max(1, (angle.size - 1) // 100_000))
    steps = np.abs(series.at(angle, sample + 1) - series.at(angle, sample))
    limit = max(LEAST_JUMP, JUMP_RATIO * float(np.quantile(steps, 0.99)))
    found = places_where(angle, lambda some: np.abs(np.diff(some)) > limit, following=1)
    jumps = np.concatenate([np.empty(0, dtype=np.int64), *found])
    if jumps.size == 0:
        return None
    jump = series.at(angle, jumps + 1) - series.at(angle, jumps)
    # Step n leads from sample n to the next.
    first = np.maximum(jumps - JUMP_REACH, 0)
    last = np.minimum(jumps + 1 + JUMP_REACH, values.size - 1)
    if gyro.kind == "angle":
        turned = series.at(values, last) - series.at(values, first)
    else:
        around = [first + number for number in range(1, 2 * JUMP_REACH + 2)]
        turned = sum(series.at(values, np.minimum(some, last)) * (some <= last) for some in around)
        turned = turned / (recording.sample_rate if gyro.kind == "rate" else 1.0)
    alone = np.flatnonzero(np.abs(turned) < 0.5 * np.abs(share * jump))
    if alone.size == 0:
        return None
    at = jumps[alone]
    return Finding(
        level="error",
        channel="table",
        message=f"{counted(alone.size, 'jump')} that gyro {gyro.name} does not make, the first by "
        f"{jump[alone[0]] / DEGREE:.3g} deg at {second_of(recording, int(at[0]) + 1):.3f} s; "
        f"{longest_stretch(recording, (at + 1,))}",
    )


def table_findings(recording: Recording, gyro: Channel) -> list[Finding]:
    """How a gyro and the encoder go together."""
    if recording.table is None:
        return []
    finding = _encoder_finding(recording, gyro)
    if finding is not None:
        return [finding]
    gyro_rate, _ = block_rates(recording, gyro)
    table_rate, _ = block_rates(recording, recording.table)
    share = _share(gyro_rate, table_rate)
    if math.isnan(share):
        return [Finding(level="note", channel="table", message="the table does not turn")]
    if abs(share) < 0.01 and float(np.percentile(np.abs(table_rate), 90.0)) > TURNING_RATE:
        return [
            Finding(
                level="warning",
                channel=gyro.name,
                message=f"senses {100.0 * share:.2g} % of the table rate: it is mounted across "
                "the axis, or its unit or kind is wrong (--unit, --kind)",
            )
        ]
    return [
        Finding(level="note", channel=gyro.name, message=f"senses {share:.4f} of the table rate")
    ]
