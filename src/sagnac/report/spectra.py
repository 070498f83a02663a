"""Spectra as they are shown: per gyro, in few bins, and how many peaks are left in one."""

import numpy as np
from scipy.special import gammainccinv, gammaincinv

from sagnac.analysis.result import Analysis
from sagnac.analysis.spectra import Spectrum
from sagnac.recording.difference import per_gyro
from sagnac.spectrum.median import running_median
from sagnac.units import DEGREE_PER_HOUR

_NEIGHBOURS = 51


def per_gyro_density(analysis: Analysis) -> Spectrum:
    """Frequency (Hz) and one-sided rate density of one gyro, (deg/h)^2/Hz."""
    measured = analysis.density
    if measured is None:
        return Spectrum.empty()
    size = (per_gyro(1.0, analysis.gyros_differenced) / DEGREE_PER_HOUR) ** 2
    return Spectrum(frequency=measured.frequency, density=size * measured.density)


def coarser(spectrum: Spectrum, most: int) -> Spectrum:
    """The spectrum in `most` log-spaced bins at most, each the mean of those it takes."""
    if spectrum.frequency.size <= most:
        return spectrum
    edges = np.geomspace(spectrum.frequency[0], spectrum.frequency[-1], most + 1)[:-1]
    starts = np.unique(np.searchsorted(spectrum.frequency, edges))
    # Bins that were log-spaced before are wider at high frequency and count by their width.
    width = np.gradient(spectrum.frequency)
    total = np.add.reduceat(width, starts)
    return Spectrum(
        frequency=np.add.reduceat(width * spectrum.frequency, starts) / total,
        density=np.add.reduceat(width * spectrum.density, starts) / total,
    )


def residual_peaks(analysis: Analysis, false_alarm: float = 1e-3) -> int:
    """How many peaks the spectrum after removal still has.

    A bin is one of a peak if it stands above the median of the bins around it by more than
    noise does once in `false_alarm` over the whole spectrum; bins that touch are one peak.
    Bins are means of `n` exponential ordinates, gamma distributed of shape `n`.
    """
    frequency, density = analysis.spectrum.frequency, analysis.spectrum.density
    if density.size < _NEIGHBOURS:
        return 0
    shape = np.maximum(np.round(np.gradient(frequency) * analysis.recording.duration), 1.0)
    threshold = gammainccinv(shape, false_alarm / density.size) / gammaincinv(shape, 0.5)
    above = density > threshold * running_median(density, _NEIGHBOURS)
    return int(np.count_nonzero(above[1:] & ~above[:-1]) + above[0])
