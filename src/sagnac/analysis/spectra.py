"""Rate spectra for figures and tables."""

from collections.abc import Callable
from dataclasses import dataclass

from sagnac import series
from sagnac.arrays import FloatArray
from sagnac.spectrum.periodogram import density as rate_density
from sagnac.spectrum.periodogram import periodogram, smoothed
from sagnac.spectrum.tapers import multitaper


@dataclass(frozen=True, slots=True, kw_only=True)
class Spectrum:
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


def multitaper_density(increments: FloatArray, sample_rate: float) -> Spectrum:
    """Multitaper rate density of angle increments (rad), in log-spaced bins."""
    return _density(multitaper, increments, sample_rate)


def _density(
    power_of: Callable[[FloatArray], FloatArray], increments: FloatArray, sample_rate: float
) -> Spectrum:
    """One-sided rate density of angle increments (rad), averaged into log-spaced bins."""
    steps = series.less(increments, series.mean(increments))
    frequency, power = smoothed(power_of(steps))
    return Spectrum(frequency=frequency * sample_rate, density=rate_density(power, sample_rate))


def figure_spectrum(angle: FloatArray, sample_rate: float) -> Spectrum:
    """One-sided rate spectrum of an angle, averaged into log-spaced bins for a figure."""
    return _density(periodogram, series.differences(angle), sample_rate)
