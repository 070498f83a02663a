"""Turns of the table, and angles taken once a turn."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from sagnac import series
from sagnac.arrays import FloatArray
from sagnac.errors import RecordingError
from sagnac.table.kinematics import KINEMATIC_RATE

# The table is at rest below this motion over the whole record.
_AT_REST: Final = np.radians(0.1)
# A table with fewer turns than this does not tell neighbouring orders apart.
FEW_TURNS: Final = 4.0
# Seconds of a turning table below which its averages of 1 s do not say how steadily it turns.
SHORTEST: Final = 10.0


def is_turning(table: FloatArray | None) -> bool:
    """Whether the table angle, (samples,) rad, moves at all."""
    if table is None:
        return False
    lowest, highest = series.extent(table)
    return bool(highest - lowest > _AT_REST)


def full_turns(table: FloatArray) -> float:
    """Turns between the lowest and the highest table angle, (samples,) rad."""
    lowest, highest = series.extent(table)
    return (highest - lowest) / (2.0 * np.pi)


def mean_rate(table: FloatArray, sample_rate: float) -> float:
    """Mean speed of the table, rad/s, signed by its net direction where it has one."""
    net = float(table[-1] - table[0])
    # Quantization noise of the encoder would add to the path at every sample.
    coarse = series.every(table, max(1, round(sample_rate / KINEMATIC_RATE)))
    path = float(np.abs(np.diff(coarse)).sum()) + abs(float(table[-1] - coarse[-1]))
    sign = -1.0 if net < 0.0 and abs(net) > 0.5 * path else 1.0
    return sign * path * sample_rate / (table.size - 1)


def full_turn_times(table: FloatArray, *, null_angle: float = 0.0) -> FloatArray:
    """Fractional sample numbers at which the table passes each full turn.

    Linear interpolation between the two samples beside the crossing. A table that reverses
    passes the same angle again; only crossings in its net direction that open a new turn
    count, so that the turns between consecutive times are whole.

    Parameters
    ----------
    table
        (samples,) unwrapped table angle, rad.
    null_angle
        Table angle of the null pulse, rad.

    Returns
    -------
    (crossings,) ascending.
    """
    sign = -1.0 if table[-1] < table[0] else 1.0
    times: list[FloatArray] = [np.empty(0)]
    # The furthest turn reached so far: flat while the table goes back, so each whole turn
    # is crossed exactly once.
    reached = -np.inf
    for span in series.through(table.size - 1, table):
        turn = sign * ((table[span.start : span.stop + 1] - null_angle) / (2.0 * np.pi))
        furthest = np.maximum.accumulate(np.maximum(turn, reached))
        lowest = np.ceil(turn[0]) if span.start == 0 else np.floor(reached) + 1.0
        reached = furthest[-1]
        whole = np.arange(lowest, np.floor(reached) + 1.0)
        after = np.maximum(np.searchsorted(furthest, whole, side="left"), 1)
        before = furthest[after - 1]
        step = furthest[after] - before
        fraction = np.where(step > 0.0, (whole - before) / np.where(step > 0.0, step, 1.0), 0.0)
        times.append(span.start + after - 1 + np.clip(fraction, 0.0, 1.0))
    return np.concatenate(times)


def full_rotation_samples(
    angle: FloatArray, table: FloatArray | None, null_pulse: NDArray[np.bool_] | None = None
) -> tuple[FloatArray, FloatArray]:
    """Full rotation interval sampling (FRIS): the angle at each full turn, Eq. 8.

    Full turns are counted from the null pulse where there is one, and from where the encoder
    reads zero where there is none. The time of each is interpolated in the encoder's angle;
    without an encoder it is taken midway between the pulse and the sample before.

    Parameters
    ----------
    angle
        (samples,) gyro angle or difference of two, rad.
    table
        (samples,) table angle, rad, or None.
    null_pulse
        (samples,) bool, true on the first sample at or after the pulse, or None.

    Returns
    -------
    times, values
        (turns + 1,) fractional sample numbers, and the angle there, rad.

    Raises
    ------
    RecordingError
        If the table completes fewer than two full turns.

    References
    ----------
    Eqs. 8 and 9 of Yu et al. 2013.
    """
    pulses = np.empty(0, dtype=np.int64) if null_pulse is None else np.flatnonzero(null_pulse)
    pulses = pulses[pulses > 0]
    if table is None:
        times = pulses.astype(np.float64) - 0.5
    else:
        null_angle = 0.0
        if pulses.size:
            # It lies somewhere in the step before; the mean over the turns is finer than a step.
            middles = 0.5 * (series.at(table, pulses) + series.at(table, pulses - 1))
            null_angle = float(np.angle(np.exp(1j * middles).sum()))
        times = full_turn_times(table, null_angle=null_angle)
    if times.size < 3:
        covered = "" if table is None else f" (it covers {360.0 * full_turns(table):.1f} deg)"
        raise RecordingError(
            f"the table never completes two full turns{covered}, so full rotation interval "
            "sampling has nothing to sample; use --method fos"
        )
    first = np.minimum(times.astype(np.int64), angle.size - 2)
    fraction = times - first
    before = series.at(angle, first)
    return times, before + fraction * (series.at(angle, first + 1) - before)
