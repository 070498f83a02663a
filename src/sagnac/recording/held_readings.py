"""Encoder readings that are held: a slow encoder in a fast recording.

An encoder that is read 20 times a second stands in a recording of 200 samples a second as steps,
each ten samples long. At a table that turns by 40 deg/s the steps are 2 deg. Between its readings
the table's motion is smooth; so the readings are put at the times of the encoder's own clock, and
a spline goes through them.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from sagnac import series
from sagnac.arrays import FloatArray, IntegerArray

# Readings are held if nearly all come at the ticks of a clock, to a sample, this slow at least.
_NEARLY_ALL: Final = 0.95
_SLOWER: Final = 1.5
# Fewer changes tell no clock.
_FEWEST: Final = 20
# More changes than this part of the samples are no steps.
_MOST_CHANGES: Final = 1.0 / _SLOWER


@dataclass(frozen=True, slots=True, kw_only=True)
class Clock:
    """When an encoder is read.

    Attributes
    ----------
    period
        Samples between readings.
    first
        Sample of the first of them, not whole.
    """

    period: float
    first: float


def clock_of(angle: FloatArray) -> Clock | None:
    """The clock of readings that are held between its ticks; None if they are not.

    Parameters
    ----------
    angle
        (samples,) readings, any unit; wrapped or running.

    Returns
    -------
    Clock or None
        None as well if any reading is missing.
    """
    if angle.size < _FEWEST or not np.isfinite(series.mean(angle)):
        return None
    changes = _changes(angle)
    if changes.size < _FEWEST or changes.size > _MOST_CHANGES * angle.size:
        return None
    gaps = np.diff(changes)
    usual = float(np.median(gaps))
    near = gaps[np.abs(gaps - usual) <= 1.0]
    if near.size < _NEARLY_ALL * gaps.size:
        return None
    period = float(near.mean())
    for _ in range(2):
        # Ticks between changes, and from those the period that fits them all.
        ticks = np.concatenate([[0], np.cumsum(np.rint(gaps / period))])
        period, first = np.polynomial.Polynomial.fit(ticks, changes, 1).convert().coef[::-1]
    late = changes - first - period * ticks
    on_time = np.abs(late - np.median(late)) <= 1.0
    if period < _SLOWER or on_time.mean() < _NEARLY_ALL:
        return None
    return Clock(period=float(period), first=float(first % period))


def between_ticks(angle: FloatArray, clock: Clock) -> FloatArray:
    """(samples,) a running angle, in its unit, by a spline through the readings at the ticks.

    Before the first tick and after the last the table goes on at the rate that it has there.

    Parameters
    ----------
    angle
        (samples,) none missing.
    clock
        As `clock_of` finds it.
    """
    ticks = np.arange(clock.first, angle.size - 1.0, clock.period)
    # A reading stands from the first sample behind its tick to the next tick: half-way is safe.
    places = np.minimum(np.floor(ticks + 0.5 * clock.period).astype(np.int64), angle.size - 1)
    # Imported here: it takes a sixth of a second that other recordings need not wait for.
    from scipy.interpolate import CubicSpline  # noqa: PLC0415

    spline = CubicSpline(ticks, series.at(angle, places))

    def read(span: slice) -> FloatArray:
        at = np.arange(span.start, span.stop, dtype=np.float64)
        inside = np.clip(at, ticks[0], ticks[-1])
        return np.asarray(spline(inside) + spline(inside, 1) * (at - inside))

    return series.made(read, angle.size, angle)


def _changes(angle: FloatArray) -> IntegerArray:
    """Samples that read otherwise than the one before."""

    def of_block(span: slice) -> IntegerArray:
        some = angle[span.start : span.stop + 1]
        return np.asarray(span.start + 1 + np.flatnonzero(some[1:] != some[:-1]))

    parts = series.map(of_block, angle.size - 1, angle)
    return np.concatenate(parts) if parts else np.empty(0, dtype=np.int64)
