"""The residual against time and against the table angle, and its spectrum in orders."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from sagnac import series
from sagnac.analysis.measurement import Measurement
from sagnac.analysis.removal import Remainder
from sagnac.arrays import FloatArray
from sagnac.recording.channel import per_gyro

# Equal parts of the record whose mean rates are shown.
_PARTS: Final = 240
# Parts of a turn; half of them are orders.
# A power of two, so that a mask folds an angle into one turn.
_SECTORS: Final = 256
# Turns from which on a mean over turns is one.
_LEAST_TURNS: Final = 3.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ByAngle:
    """Mean rate over the turns of the table, and the amplitude of each whole order in it.

    A drift within a turn is a saw here, since the turn begins again where it began.

    Attributes
    ----------
    angle
        (sectors,) middle of each, rad.
    before, after
        (sectors,) mean rate less the mean of all, rad/s, per gyro.
    order
        (orders,) 1, 2, 3 …
    amplitude_before, amplitude_after
        (orders,) of the mean rate, rad/s, per gyro.
    """

    angle: FloatArray
    before: FloatArray
    after: FloatArray
    order: FloatArray
    amplitude_before: FloatArray
    amplitude_after: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Residual:
    """The residual of a measurement.

    Attributes
    ----------
    time
        (parts,) middle of each, s.
    rate
        (parts,) mean rate less the mean of all, rad/s, per gyro.
    by_angle
        Against the table angle; None at rest, or with too few turns.
    """

    time: FloatArray
    rate: FloatArray
    by_angle: ByAngle | None


def residual_of(measured: Measurement, left: Remainder, table: FloatArray | None) -> Residual:
    """Mean rates of what removal leaves.

    Parameters
    ----------
    measured, left
        The angle, and what removal left of it.
    table
        (samples,) unwrapped, rad; None if nothing turns.
    """
    angle, scale = left.removal.residual, per_gyro(1.0, measured.gyros_differenced)
    edges = np.unique(np.linspace(0, angle.size - 1, _PARTS + 1).round().astype(np.int64))
    rate = scale * np.diff(angle[edges]) / np.diff(edges) * left.rate
    return Residual(
        time=np.asarray(0.5 * (edges[1:] + edges[:-1]) / left.rate, dtype=np.float64),
        rate=rate - rate.mean(),
        by_angle=None
        if table is None or left.once_a_turn
        else _by_angle(measured, angle, table, scale),
    )


def _by_angle(
    measured: Measurement, after: FloatArray, table: FloatArray, scale: float
) -> ByAngle | None:
    if abs(float(table[-1] - table[0])) < 2.0 * np.pi * _LEAST_TURNS:
        return None

    def sums(block: slice) -> FloatArray:
        """Count and both increments of each sector; a block lacks the step from the one before."""
        here = slice(max(block.start - 1, 0), block.stop)
        middle = 0.5 * (table[here][1:] + table[here][:-1])
        sector = np.floor(middle * (_SECTORS / (2.0 * np.pi))).astype(np.int64) & (_SECTORS - 1)
        return np.stack(
            [
                np.bincount(sector, minlength=_SECTORS).astype(np.float64),
                *(
                    np.bincount(sector, weights=np.diff(angle[here]), minlength=_SECTORS)
                    for angle in (measured.angle, after)
                ),
            ]
        )

    count, *increments = series.total(sums, table.size, table, measured.angle, after)
    if not count.all():
        return None
    before, left = (scale * measured.sample_rate * each / count for each in increments)
    before, left = before - before.mean(), left - left.mean()
    amplitudes = [2.0 / _SECTORS * np.abs(np.fft.rfft(each))[1:-1] for each in (before, left)]
    return ByAngle(
        angle=2.0 * np.pi * (np.arange(_SECTORS) + 0.5) / _SECTORS,
        before=before,
        after=left,
        order=np.arange(1.0, _SECTORS // 2),
        amplitude_before=amplitudes[0],
        amplitude_after=amplitudes[1],
    )
