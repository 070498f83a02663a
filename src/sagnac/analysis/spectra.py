"""Rate spectra for figures and tables."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Self

import numpy as np

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

    def __post_init__(self) -> None:
        if self.frequency.shape != self.density.shape or self.frequency.ndim != 1:
            raise ValueError(
                f"frequency has shape {self.frequency.shape} and density {self.density.shape}; "
                "give one value of each for every bin"
            )
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


def multitaper_density(increments: FloatArray, sample_rate: float) -> Spectrum:
    """Multitaper rate density of angle increments (rad), in log-spaced bins."""
    return _density(multitaper, increments, sample_rate)


def figure_spectrum(angle: FloatArray, sample_rate: float) -> Spectrum:
    """One-sided rate spectrum of an angle, averaged into log-spaced bins for a figure."""
    return _density(periodogram, series.differences(angle), sample_rate)


def _density(
    power_of: Callable[[FloatArray], FloatArray], increments: FloatArray, sample_rate: float
) -> Spectrum:
    """One-sided rate density of angle increments (rad), averaged into log-spaced bins."""
    steps = series.less(increments, series.mean(increments))
    frequency, power = smoothed(power_of(steps))
    return Spectrum(frequency=frequency * sample_rate, density=rate_density(power, sample_rate))
