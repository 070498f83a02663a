"""Rate spectra, and the residual against time and table angle, for figures and tables."""

from dataclasses import dataclass
from typing import Final, Self

import numpy as np

from sagnac.analysis.measurement import Remainder
from sagnac.core.arrays import FloatArray, blocks, elementwise, mean, values_at
from sagnac.recording.channel import Compared
from sagnac.spectrum import periodogram


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Spectrum(Compared):
    """Rate power spectral density, one-sided.

    Attributes
    ----------
    frequency
        (bins,), Hz.
    density
        (bins,), (rad/s)^2/Hz.
    """

    frequency: FloatArray
    density: FloatArray

    def __post_init__(self) -> None:
        for array in (self.frequency, self.density):
            array.flags.writeable = False

    def __repr__(self) -> str:
        bins = self.frequency.size
        reach = f", {self.frequency[0]:.3g} to {self.frequency[-1]:.3g} Hz" if bins else ""
        return f"<Spectrum of {bins} bins{reach}>"

    @classmethod
    def empty(cls) -> Self:
        """A spectrum of no bin."""
        return cls(frequency=np.empty(0), density=np.empty(0))


def multitaper_density(increments: FloatArray, sample_rate: float, tapers: int = 5) -> Spectrum:
    """One-sided rate density of increments (rad), centred in place, in log-spaced bins."""
    elementwise(np.subtract, increments, mean(increments), out=increments)
    frequency, power = periodogram.smoothed(periodogram.multitaper(increments, tapers))
    density = periodogram.density(power, sample_rate)
    return Spectrum(frequency=frequency * sample_rate, density=density)


# Parts of a turn; half of them are orders.
# A power of two, so that a mask folds an angle into one turn.
_SECTORS: Final = 256


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


def residual_of(before: FloatArray, left: Remainder, table: FloatArray | None) -> Residual:
    """Mean rates of what removal leaves.

    Parameters
    ----------
    before, left
        (samples,) the angle, rad, per gyro, and what removal left of it.
    table
        (samples,) unwrapped, rad; None if nothing turns.
    """
    angle = left.removal.residual
    # Mean rates of 240 equal parts of the record.
    edges = np.unique(np.linspace(0, angle.size - 1, 241).round().astype(np.int64))
    rate = np.diff(values_at(angle, edges)) / np.diff(edges) * left.rate
    time = np.asarray(0.5 * (edges[1:] + edges[:-1]) / left.rate, dtype=np.float64)
    by_angle = None if table is None or left.once_a_turn else _by_angle(before, left, table)
    return Residual(time=time, rate=rate - rate.mean(), by_angle=by_angle)


def _by_angle(before: FloatArray, left: Remainder, table: FloatArray) -> ByAngle | None:
    # A mean over fewer than three turns is none.
    if abs(float(table[-1] - table[0])) < 6.0 * np.pi:
        return None
    # Count and both increments of each sector.
    sums = np.zeros((3, _SECTORS))
    for block in blocks(table.size - 1):
        here = slice(block.start, block.stop + 1)
        middle = 0.5 * (table[here][1:] + table[here][:-1])
        sector = np.floor(middle * (_SECTORS / (2.0 * np.pi))).astype(np.int64) & (_SECTORS - 1)
        sums[0] += np.bincount(sector, minlength=_SECTORS)
        for number, angle in enumerate((before, left.removal.residual), start=1):
            sums[number] += np.bincount(sector, weights=np.diff(angle[here]), minlength=_SECTORS)
    count, *increments = sums
    if not count.all():
        return None
    rates = [left.rate * each / count for each in increments]
    rates = [each - each.mean() for each in rates]
    amplitudes = [2.0 / _SECTORS * np.abs(np.fft.rfft(each))[1:-1] for each in rates]
    return ByAngle(
        angle=2.0 * np.pi * (np.arange(_SECTORS) + 0.5) / _SECTORS,
        before=rates[0],
        after=rates[1],
        order=np.arange(1.0, _SECTORS // 2),
        amplitude_before=amplitudes[0],
        amplitude_after=amplitudes[1],
    )
