"""A rate spectrum under sine tapers, in cells, at any length and in bounded memory."""

import math
from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Final

import numpy as np
from scipy.fft import prev_fast_len

from sagnac.core.arrays import BLOCK, BooleanArray, FloatArray, blocks, empty, less
from sagnac.spectrum import periodogram
from sagnac.spectrum.periodogram import CELL, HALF_WIDTH
from sagnac.spectrum.sums import angle_series

# First ordinate in use, cycles a record. Below it the line that is taken off is missed.
_FIRST: Final = 6
# Longest stretch that is transformed at once, samples: such a transform stays in cache.
SEGMENT: Final = 2**17
# Stop band of the filters before decimation, dB.
_STOP: Final = 140.0
# Part of the rate of the decimated record up to which it is used.
_USED: Final = 0.2
# Smallest record, samples.
LEAST_SAMPLES: Final = 64


@dataclass(frozen=True, slots=True, kw_only=True)
class Cells:
    """Ordinates of a spectrum averaged by eight.

    Attributes
    ----------
    frequency
        (cells,) middle of each cell, Hz.
    low, high
        (cells,) edges of the ordinates in each cell, Hz.
    density
        (cells,), (rad/s)^2/Hz: the mean of the ordinates.
    degrees_of_freedom
        (cells,) of the chi-square law that the density follows, so that its relative variance
        is 2 over it.
    leaked
        (cells,), (rad/s)^2/Hz: what leaks in from more than two window widths away, from the
        spectrum itself and the measured response of the tapers.
    half_width
        (cells,) Hz over which the tapers smooth, either way.
    """

    frequency: FloatArray
    low: FloatArray
    high: FloatArray
    density: FloatArray
    degrees_of_freedom: FloatArray
    leaked: FloatArray
    half_width: FloatArray

    def kept(self, some: BooleanArray) -> "Cells":
        """Some of the cells."""
        return Cells(**{item.name: getattr(self, item.name)[some] for item in fields(Cells)})

    def followed_by(self, other: "Cells") -> "Cells":
        """These and others above them."""
        names = [item.name for item in fields(Cells)]
        pairs = {name: (getattr(self, name), getattr(other, name)) for name in names}
        return Cells(**{name: np.concatenate(pair) for name, pair in pairs.items()})


@dataclass(frozen=True, slots=True, kw_only=True)
class TaperedSpectrum:
    """One-sided rate spectrum in cells that are nearly independent.

    Attributes
    ----------
    cells
        In order of frequency.
    interval
        Between the angles whose increments were taken, s.
    """

    cells: Cells
    interval: float


def tapered_spectrum(
    increments: FloatArray, *, sample_rate: float, segment: int = SEGMENT
) -> TaperedSpectrum:
    """Sine multitaper spectrum of angle increments, as the rate that they average.

    A straight line is taken off first. A record longer than `segment` is cut into segments
    whose spectra are averaged; the lowest frequencies come from the whole record, filtered
    and decimated. Increments taken at ``1/interval`` Hz hold what folds: the laws that belong
    to this spectrum are those of `noise.laws.rate_density_basis` for the same interval.

    Parameters
    ----------
    increments
        (samples,), rad between angles one sample interval apart; in memory or mapped.
    sample_rate
        Samples per second.
    segment
        Longest stretch transformed at once, samples; 4096 or more.

    Returns
    -------
    TaperedSpectrum
    """
    values = _straight(increments)
    cells = _cells(values, sample_rate, segment)
    if values.size > segment:
        # The coarse cells below, the fine ones above the first 64 of a segment.
        coarse = _coarse_cells(values, sample_rate, segment)
        edge = min(float(cells.low[min(64, cells.low.size - 1)]), float(coarse.high[-1]))
        cells = coarse.kept(coarse.high <= edge).followed_by(cells.kept(cells.low >= edge))
    return TaperedSpectrum(cells=cells, interval=1.0 / sample_rate)


def _straight(values: FloatArray) -> FloatArray:
    """Values less their line by least squares under a Hann weight.

    Without the weight a strong dither tilts the line by what does not fit a whole cycle, and
    the tilt is put into the lowest cells.
    """
    size = values.size
    sums = np.zeros(4)
    for block in blocks(size):
        place = np.arange(block.start, block.stop) + 0.5
        # The Hann weight as a sum of whole orders of a phase.
        weight = angle_series(2.0 * math.pi / size * place, np.array([0.5, -0.5 + 0.0j]))
        place -= 0.5 * size
        part = values[block]
        sums += [weight @ part, (weight * place) @ part, weight.sum(), weight @ place**2]
    total, moment, weights, spread = sums
    slope, level = moment / spread, total / weights
    return less(values, lambda number: level + slope * (number - 0.5 * (size - 1)))


def _cells(values: FloatArray, sample_rate: float, segment: int) -> Cells:
    """Cells of the mean spectrum of equal segments."""
    count = -(-values.size // segment)
    stride = values.size // count
    periods = 2 * int(prev_fast_len((stride + 1) // 2, real=True))
    power = np.zeros(periods // 2 + 1)
    for stretch in blocks(count * stride, stride):
        power += periodogram.tapered_power(values[stretch.start : stretch.start + periods - 1])
    density = periodogram.density(power / count, sample_rate)
    cells = (density.size - 1 - _FIRST) // CELL
    used = slice(_FIRST, _FIRST + cells * CELL)
    first = _FIRST + CELL * np.arange(cells, dtype=np.float64)
    unit = sample_rate / periods
    return Cells(
        frequency=(first + 0.5 * (CELL - 1)) * unit,
        low=(first - 0.5) * unit,
        high=(first + CELL - 0.5) * unit,
        density=density[used].reshape(cells, CELL).mean(axis=1),
        degrees_of_freedom=np.full(cells, count * periodogram.band_degrees_of_freedom(CELL)),
        leaked=periodogram.leaked_density(density)[used].reshape(cells, CELL).mean(axis=1),
        half_width=np.full(cells, HALF_WIDTH * unit),
    )


def _coarse_cells(values: FloatArray, sample_rate: float, segment: int) -> Cells:
    """Cells of the filtered and decimated record, to a fifth of its rate."""
    factor = left = int(2 ** math.ceil(math.log2(values.size / segment)))
    while left > 1:
        # One filter takes a step of 4 at the most.
        step = min(left, 4)
        values = _decimated(values, _anti_alias(step, left), step)
        left //= step
    cells = _cells(factor * values, sample_rate / factor, segment)
    return cells.kept(cells.high < _USED * sample_rate / factor)


def _anti_alias(step: int, left: int) -> FloatArray:
    """Low-pass before every `step`-th sample is taken, if a factor of `left` is still to come.

    It passes what is used in the end, and stops what folds there; what folds elsewhere is
    stopped by a later step or not used. That leaves it a wide slope, and so a few taps. Their
    number is Kaiser's (Oppenheim and Schafer, Discrete-Time Signal Processing, 7.5). It is a sinc
    under a Kaiser window, of gain one at rest, as ``scipy.signal.firwin`` makes it, whose import
    takes half a second.
    """
    slope = 1.0 / step - 2.0 * _USED / left
    half = math.ceil((_STOP - 8.0) / (2.285 * 2.0 * math.pi * slope)) // 2
    taps = np.sinc(np.arange(-half, half + 1.0) / step)
    taps *= np.kaiser(taps.size, 0.1102 * (_STOP - 8.7))
    return np.asarray(taps / taps.sum())


def _decimated(values: FloatArray, taps: FloatArray, step: int) -> FloatArray:
    """Every `step`-th output of a symmetric filter, polyphase."""
    phases = np.append(taps, np.zeros(-taps.size % step)).reshape(-1, step)
    outputs = empty((values.size - taps.size) // step + 1)
    for block in blocks(outputs.size, BLOCK // step):
        inputs = values[block.start * step : (block.stop - 1) * step + taps.size]
        # One product for all phases; then each output is the sum of a diagonal.
        partial = phases @ np.append(inputs, np.zeros(-inputs.size % step)).reshape(-1, step).T
        count = block.stop - block.start
        outputs[block] = partial[0, :count]
        for lag in range(1, phases.shape[0]):
            outputs[block] += partial[lag, lag : lag + count]
    return outputs


def line_density(spectrum: TaperedSpectrum, frequency: float, amplitude: float) -> FloatArray:
    """Density that a line of the angle adds to the cells of a spectrum, on average over its phase.

    The increments of an angle ``A cos(2 pi f t)`` over an interval T have the mean rate amplitude
    ``2 A sin(pi f T) / T``; half its square stands at f, or where f folds, spread by the tapers.

    Parameters
    ----------
    spectrum
        To whose cells it is added.
    frequency
        Hz, above zero.
    amplitude
        Of the angle, rad.

    Returns
    -------
    FloatArray
        (cells,), (rad/s)^2/Hz; nothing beyond the reach of the tapers.
    """
    cells, interval = spectrum.cells, spectrum.interval
    rate = 2.0 * amplitude * abs(math.sin(math.pi * frequency * interval)) / interval
    seen = abs(frequency - round(frequency * interval) / interval)
    offset, kernel = periodogram.response()
    below = np.concatenate([[0.0], np.cumsum(0.5 * (kernel[1:] + kernel[:-1]))])
    places = (np.stack([cells.low, cells.high]) - seen) / (cells.half_width / HALF_WIDTH)
    low, high = np.interp(places, offset, below / below[-1])
    return np.asarray(0.5 * rate**2 * (high - low) / (cells.high - cells.low))


def smoothed_law(law: Callable[[FloatArray], FloatArray], spectrum: TaperedSpectrum) -> FloatArray:
    """A law as the cells of a spectrum show it: seen through the tapers and averaged.

    Only cells within some sixty cycles a record of zero differ: there a law like 1/f^2
    bends within the window. Below half a cycle a record the law is held, for the line that
    is taken off leaves nothing there.

    Parameters
    ----------
    law
        Frequency (points,), Hz, to (points, terms).
    spectrum
        Whose cells are meant.

    Returns
    -------
    FloatArray
        (cells, terms).
    """
    cells = spectrum.cells
    result = np.asarray(law(cells.frequency), dtype=np.float64).copy()
    unit = cells.half_width / HALF_WIDTH
    offset, kernel = periodogram.response()
    ordinates = np.arange(CELL) - 0.5 * (CELL - 1)
    shift = (ordinates[:, np.newaxis] + offset).ravel()
    weight = np.tile(kernel / kernel.sum(), CELL) / CELL
    bent = cells.frequency < 60.0 * unit
    place = np.abs(cells.frequency[bent, np.newaxis] + np.multiply.outer(unit[bent], shift))
    place = np.clip(place, 0.5 * unit[bent, np.newaxis], 0.5 / spectrum.interval)
    result[bent] = weight @ law(place.ravel()).reshape(*place.shape, result.shape[1])
    return result
