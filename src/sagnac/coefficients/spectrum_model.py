"""Cosine spectrum of the terms, in the bins of a fit."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sagnac.arrays import FloatArray
from sagnac.coefficients.cosine_spectrum import (
    CosineSpectrum,
    Ordinates,
    SpectrumBins,
    bin_means,
    cosine_bins,
    fitted_sinusoid,
    less_slope,
)
from sagnac.coefficients.estimates import SquaredEstimate
from sagnac.coefficients.laws import (
    STOCHASTIC_NAMES,
    CoefficientName,
    cosine_power_basis,
    markov_cosine_power,
)
from sagnac.errors import RecordingError


@dataclass(frozen=True, slots=True, kw_only=True)
class MarkovRate:
    """A first-order Markov rate besides the terms.

    Attributes
    ----------
    time
        Correlation time, s.
    driving
        Square of the driving noise, by which the change of the spectrum with the logarithm of
        the time becomes one more column; None if the time is held.
    """

    time: float
    driving: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class SpectrumModel:
    """A cosine spectrum in bins, and what is expected there.

    Attributes
    ----------
    cosine
        The transform.
    bins
        Those of the fit.
    power
        (bins,) mean squares, rad^2.
    names
        Of the stochastic terms fitted.
    """

    cosine: CosineSpectrum
    bins: SpectrumBins
    power: FloatArray
    names: tuple[CoefficientName, ...]

    @property
    def samples(self) -> int:
        """Length of the transform."""
        return self.cosine.transform.size

    def expected(self, index: FloatArray, rate: MarkovRate | None) -> FloatArray:
        """Expected squares at each index with the coefficients at one, (indices, columns)."""
        columns = [STOCHASTIC_NAMES.index(name) for name in self.names]
        basis = cosine_power_basis(index, self.samples, self.cosine.interval)[:, columns]
        if rate is None:
            return basis
        return np.concatenate([basis, self._markov_columns(index, rate)], axis=1)

    def _markov_columns(self, index: FloatArray, rate: MarkovRate) -> FloatArray:
        def power(time: float) -> FloatArray:
            return markov_cosine_power(index, self.samples, self.cosine.interval, time)[
                :, np.newaxis
            ]

        if rate.driving is None:
            return power(rate.time)
        change = power(1.01 * rate.time) - power(rate.time / 1.01)
        return np.concatenate(
            [power(rate.time), rate.driving * change / (2.0 * math.log(1.01))], axis=1
        )

    def ordinates(self, rate: MarkovRate | None = None) -> Ordinates:
        """Ordinates of a fit, with what the slope took of each term if one was taken off."""
        starts, stops = self.bins.starts, self.bins.stops
        spectrum = Ordinates(
            basis=bin_means(self.bins, lambda index: self.expected(index, rate)),
            power=self.power,
            count=self.bins.count,
            weight=self.bins.count,
            frequency=np.asarray(
                0.25 * (starts + stops - 1.0) / (self.samples * self.cosine.interval)
            ),
        )
        if "rate_ramp" not in self.cosine.terms:
            return spectrum
        return less_slope(
            spectrum, self.bins, self.samples, lambda index: self.expected(index, rate)
        )


def spectrum_model(
    cosine: CosineSpectrum,
    masked: Sequence[tuple[float, float]],
    band: tuple[float, float] | None,
) -> SpectrumModel:
    """`cosine` in bins, less what is masked, outside the band, or beside a fitted sinusoid.

    Raises
    ------
    RecordingError
        If the values do not vary, or too few frequencies are left.
    ValueError
        If `masked` or `band` makes no sense.
    """
    if cosine.sinusoid is not None:
        masked = [*masked, (cosine.sinusoid.frequency, cosine.sinusoid.frequency)]
    transform = cosine.transform
    bins = cosine_bins(transform.size, cosine.interval, masked, band)
    power = bins.mean(transform, transform)
    # A single square may be zero, of angles a few readout steps apart.
    if not np.median(power) > 0.0:
        raise RecordingError(
            "the values do not vary",
            remedy="a spectrum needs noise, check the channel",
        )
    return SpectrumModel(
        cosine=cosine,
        bins=bins,
        power=power,
        names=tuple(name for name in STOCHASTIC_NAMES if name in cosine.terms),
    )


def sinusoid_square(
    cosine: CosineSpectrum, frequency: FloatArray, mean: FloatArray, confidence: float
) -> SquaredEstimate:
    """Squared peak rate of the sinusoid taken off, by the noise about it.

    Parameters
    ----------
    cosine
        With its sinusoid.
    frequency, mean
        (bins,) Hz, and the fitted mean of the squares.
    confidence
        Of the interval or bound.

    Raises
    ------
    ValueError
        If no sinusoid was taken off.
    """
    if cosine.sinusoid is None:
        raise ValueError("cosine has no sinusoid; give its frequency to cosine_spectrum")
    place = cosine.sinusoid.frequency
    density = float(np.interp(place, frequency, mean))
    # The rate is averaged over each interval, which takes sinc off the amplitude.
    gain = float(np.sinc(place * cosine.interval)) * cosine.interval
    variance = 2.0 * density / cosine.transform.size / gain**2
    return fitted_sinusoid(cosine.sinusoid.square / gain**2, variance, confidence)
