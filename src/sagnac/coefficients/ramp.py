"""The rate ramp: a straight line in noise of the other terms."""

import math
from dataclasses import dataclass, replace

import numpy as np

from sagnac.arrays import FloatArray
from sagnac.coefficients.cosine_spectrum import SINGLE, Ordinates, slope_transform
from sagnac.coefficients.estimates import SquaredEstimate
from sagnac.coefficients.limits import CONVERGED, PRESENCE, crossing, likelihood_drop, low_end
from sagnac.coefficients.maximum import Optimum, maximize
from sagnac.coefficients.spectrum_model import MarkovRate, SpectrumModel


@dataclass(frozen=True, slots=True, kw_only=True)
class _Line:
    """A spectrum of increments, from which a further slope takes its share of each square.

    Attributes
    ----------
    spectrum
        Without that slope.
    shape
        (bins,) transform of a unit slope; zero in bins of more than one index.
    cosine
        (bins,) transform of the increments, in the same bins.
    """

    spectrum: Ordinates
    shape: FloatArray
    cosine: FloatArray

    def fitted(self, further: float, start: FloatArray) -> Optimum:
        """Maximum with a further slope taken off, no square below zero.

        A line that meets the lowest frequency exactly would leave its variance free to vanish.
        """
        change = further * self.shape * (further * self.shape - 2.0 * self.cosine)
        less = replace(self.spectrum, power=self.spectrum.power + change)
        return maximize(less, start=start, limited=True)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Slope:
    """The most likely further slope, its error, and the maximum there."""

    further: float
    error: float
    best: Optimum
    start: FloatArray


def ramp_square(
    model: SpectrumModel, rate: MarkovRate | None, weight: FloatArray, confidence: float
) -> SquaredEstimate:
    """Square of the rate ramp by profile likelihood, (rad/s^2)^2.

    Parameters
    ----------
    model
        The spectrum, of increments that a slope was taken off.
    rate
        Markov rate besides, if there is one.
    weight
        (bins from the second index on,) degrees of freedom granted to each.
    confidence
        Of the interval or bound.
    """
    held = None if rate is None else replace(rate, driving=None)
    line = _line(model, held, weight)
    if not line.shape.any():
        return SquaredEstimate.unseen()
    found = _most_likely(line)
    slope = model.cosine.slope
    return _slope_square(line, found, slope, confidence).per(model.cosine.interval**4)


def _line(model: SpectrumModel, rate: MarkovRate | None, weight: FloatArray) -> _Line:
    bins, transform = model.bins, model.cosine.transform
    weights = bins.count.copy()
    weights[bins.starts > 1] = weight
    low = (bins.count == 1.0) & (bins.starts < SINGLE)
    shape = np.where(low, slope_transform(bins.starts.astype(np.float64), transform.size), 0.0)
    cosine = np.zeros(bins.starts.size)
    cosine[low] = transform[bins.starts[low]]
    spectrum = replace(model.ordinates_with_slope(rate), weight=weights)
    return _Line(spectrum=spectrum, shape=shape, cosine=cosine)


def _most_likely(line: _Line) -> _Slope:
    """Slope and squared coefficients in turn, until the slope moves no more."""
    start = np.zeros(line.spectrum.basis.shape[1])
    further, error = 0.0, math.inf
    for _ in range(20):
        best = line.fitted(further, start)
        start = best.squares
        information = float(line.shape**2 @ (1.0 / best.mean))
        error = 1.0 / math.sqrt(information)
        moved = float(line.shape @ (line.cosine / best.mean)) / information
        if abs(moved - further) < CONVERGED * error:
            break
        further = moved
    return _Slope(further=further, error=error, best=best, start=start)


def _slope_square(line: _Line, found: _Slope, slope: float, confidence: float) -> SquaredEstimate:
    """Square of the whole slope per sample, `slope` of which was taken off before."""
    total = slope + found.further
    sign = math.copysign(1.0, total)
    threshold = likelihood_drop(confidence)

    def excess(size: float) -> float:
        further = sign * size - slope
        return line.fitted(further, found.start).deviance - found.best.deviance

    def rise(size: float) -> float:
        return math.sqrt(max(excess(size), 0.0)) - math.sqrt(threshold)

    step = found.error * math.sqrt(threshold)
    high = crossing(rise, abs(total), step)
    if not math.isfinite(high):
        return SquaredEstimate.unseen()
    presence = math.sqrt(max(excess(0.0), 0.0))
    down = low_end(presence, confidence) if presence > math.sqrt(PRESENCE) else math.inf
    if math.isfinite(down):
        low = crossing(
            lambda size: math.sqrt(max(excess(size), 0.0)) - down,
            abs(total),
            -found.error * down,
            0.0,
        )
        return SquaredEstimate(value=total**2, low=low**2, high=high**2, status="estimated")
    return SquaredEstimate.bound(high**2)
