"""The noise floor of a spectrum with lines in it, and power laws in frequency fitted to it."""

from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy.optimize import nnls

from sagnac.core.arrays import (
    FloatArray,
    IntegerArray,
    blocks,
    elementwise,
    median,
    release,
    values_at,
)
from sagnac.spectrum import _kernels

# ---- median ------------------------------------------------------------------------


def running_median(values: FloatArray, width: int) -> FloatArray:
    """The median of the values around each; the first and the last stand for those beyond.

    Parameters
    ----------
    values
        (samples,), finite, one or more.
    width
        Values that count, odd.

    Returns
    -------
    (samples,).

    Examples
    --------
    >>> import numpy as np
    >>> running_median(np.array([1.0, 9.0, 2.0, 3.0]), 3)
    array([1., 2., 3., 3.])
    """
    around = np.pad(values, width // 2, mode="edge")
    return np.asarray(np.median(sliding_window_view(around, width), axis=1))


# ---- power laws --------------------------------------------------------------------

# A law is nowhere lower than this part of the usual level.
_LEAST: Final = 1e-12


@dataclass(frozen=True, slots=True, kw_only=True)
class PowerLaws:
    """A sum of f^-2, f^-1, 1 and 4 sin^2(pi f), f in cycles a sample.

    They are rate random walk, flicker, angle random walk and quantization, as the power of angle
    increments.

    Attributes
    ----------
    coefficients
        (4,) of these laws, not negative, in parts of `level`.
    level
        Usual power, in the unit of the spectrum.
    bins
        Bins of the spectrum from 1 to half a cycle a sample.
    """

    coefficients: FloatArray
    level: float
    bins: int

    @property
    def points(self) -> FloatArray:
        """(points,) the first 400 bins, and then some half a percent apart.

        Linear between them the laws are good to 1 part in 1e5.
        """
        first, rest = np.arange(1.0, min(self.bins + 1, 401)), np.geomspace(1.0, self.bins, 3000)
        return np.unique(np.concatenate([first, rest]))

    def at(self, number: FloatArray) -> FloatArray:
        """Expected power at bins of these numbers, (numbers,)."""
        powers = _laws(number, self.bins) @ self.coefficients
        return np.asarray(np.maximum(powers, _LEAST) * self.level)


def _laws(number: FloatArray, bins: int) -> FloatArray:
    """(numbers, 4) of the laws at bins of these numbers."""
    f = number / (2.0 * bins)
    return np.column_stack([f**-2.0, 1.0 / f, np.ones_like(f), 4.0 * np.sin(np.pi * f) ** 2])


def fit_power_laws(power: FloatArray) -> PowerLaws:
    """Non-negative power laws fitted to binned ordinates by iterated Gamma weights.

    Parameters
    ----------
    power
        (bins,) ordinates at bins 1, 2, ..., in memory or mapped. Lines may stand among them.
    """
    center, count, levels = bin_levels(power)
    level = max(median(levels), np.finfo(float).tiny)
    coefficients = fit_levels(_laws(center, power.size), levels / level, count)
    return PowerLaws(coefficients=coefficients, level=level, bins=power.size)


def bin_levels(power: FloatArray) -> tuple[FloatArray, IntegerArray, FloatArray]:
    """Ordinates at 1, 2, ... in some 160 bins, logarithmic from the tenth ordinate on.

    Returns
    -------
    center, count, level
        (bins,) mean number of the ordinates in each, how many there are, and the expected power
        from their median: lines do not lift the level of a bin they are few in.
    """
    logarithmic = np.geomspace(9, power.size, 160).astype(np.int64)
    edges = np.unique(np.concatenate([np.arange(9), logarithmic]))
    starts, stops = edges[:-1], edges[1:]
    count = stops - starts
    level = np.empty(count.size)
    for index, (start, stop) in enumerate(zip(starts, stops, strict=True)):
        level[index] = median(power[start:stop])
        release()
    # Median over mean of n exponential variates, to within 1 %: 1 at n = 1, ln 2 for many.
    level /= np.log(2.0) + (1.0 - np.log(2.0)) / count
    return 0.5 * (starts + stops + 1.0), count, level


def fit_levels(design: FloatArray, level: FloatArray, count: IntegerArray) -> FloatArray:
    """Non-negative coefficients of the columns of `design` that make up `level`.

    Maximum likelihood for Gamma ordinates is least squares with weights n / model^2, iterated.

    Parameters
    ----------
    design
        (bins, laws).
    level
        (bins,) expected power; what stands above the laws is a line.
    count
        (bins,) ordinates in each.

    Returns
    -------
    (laws,).
    """
    size = np.linalg.norm(design, axis=0)
    design = design / size
    least = max(_LEAST * float(np.max(level)), np.finfo(float).tiny)
    model = np.maximum(level, _LEAST)
    target, keep = level, np.ones(level.size, dtype=bool)
    for number in range(16):
        weight = np.where(keep, np.sqrt(count) / model, 0.0)
        solution, _ = nnls(design * weight[:, None], target * weight)
        model = np.maximum(design @ solution, least)
        # An ordinate nine floors high in a narrow bin is a line, not noise: exp(-9) of them by
        # chance.
        highest = model * (1.0 + 9.0 / np.sqrt(count))
        if number < 8:
            # What stands above the law may be a line or a law not seen yet: it pulls, but no
            # harder than a line may. Left out at once, a law could never come in.
            target = np.minimum(level, highest)
        else:
            target, keep = level, level < highest
    return np.asarray(solution / size)


# ---- floor -------------------------------------------------------------------------

_HALF_WIDTH: Final = 256  # bins; the median of 513 ordinates is good to 6 %
_MOST_HALF_WIDTH: Final = 4096


def noise_floor(power: FloatArray) -> FloatArray:
    """Expected power without lines, at every bin of a periodogram.

    Two steps. A sum of non-negative power laws in frequency (f^-2, f^-1, 1 and
    4 sin^2(pi f): rate random walk, flicker, angle random walk, quantization) is fitted
    to binned ordinates, lines excluded; it carries the slope at low frequency, where
    bins are few. The running median of power over that fit then follows whatever else
    the noise does.

    Parameters
    ----------
    power
        (bins,) ordinates at k / size cycles per sample, k = 0 .... Bin 0 is not used.

    Returns
    -------
    (bins,) floor; bin 0 takes the value of bin 1.

    Examples
    --------
    >>> import numpy as np
    >>> power = np.random.default_rng(0).exponential(size=100_001)
    >>> power[[300, 40_000]] = 1e6
    >>> bool(abs(noise_floor(power).mean() - 1.0) < 0.02)
    True
    """
    if power.size < 32:
        # One constant level.
        level = median(power[1:]) / np.log(2.0)
        return np.full(power.size, max(level, np.finfo(float).tiny))
    law, windows = fit_power_laws(power[1:]), floor_windows(power.size)
    floor, ratios = elementwise(np.ones_like, power), np.empty(len(windows))
    multiply(floor, law.points, law.at(law.points))
    # Ratio of mean power to the law in each window, from the median of exponential ordinates.
    # 64 of the widest windows fill one block of memory.
    for some in blocks(len(windows), 64):
        for index, window in enumerate(windows[some], start=some.start):
            ratios[index] = median(power[window] / floor[window]) / np.log(2.0)
    middles = np.array([0.5 * (window.start + window.stop) for window in windows])
    if middles.size == 1:
        middles, ratios = np.array([1.0, power.size]), np.repeat(ratios, 2)
    multiply(floor, middles, ratios)
    _reach_up_to_plateau(floor, power)
    floor[0] = floor[1]
    return floor


# Ordinates whose median is a level of a plateau, the fewest: it is good to 25 %.
_FEWEST: Final = 32


def _reach_up_to_plateau(floor: FloatArray, power: FloatArray) -> None:
    """Raise a floor, in place, to the level that a spectrum holds from its lowest bins on.

    If the plateau ahead of a low-pass is narrower than a window of the running median, most of
    what is in the window is what the low-pass leaves. A hump of vibration stands above what lies
    below it, and is not reached.
    """
    edges = [1]
    # A longer plateau fills half of every window ahead of its end.
    while edges[-1] < min(power.size, 4 * _MOST_HALF_WIDTH):
        edges.append(edges[-1] + max(_FEWEST, edges[-1] // 10))
    windows = [slice(*pair) for pair in pairwise(edges[:-1])]
    if len(windows) < 2:
        return
    level = np.array([median(power[window]) for window in windows]) / np.log(2.0)
    place = np.array([0.5 * (window.start + window.stop - 1) for window in windows])
    at_place = values_at(floor, place.astype(np.int64))
    # Chance lets one level of twenty be half of another on the same plateau.
    short = (level < 3.0 * np.minimum.accumulate(level)) & (level > 2.0 * at_place)
    if short.any():
        multiply(floor[: windows[-1].stop], place, np.where(short, level / at_place, 1.0))


def multiply(series: FloatArray, points: FloatArray, levels: FloatArray) -> None:
    """Multiply a series in place by levels at some places, linear between them.

    Parameters
    ----------
    series
        (samples,)
    points, levels
        (points,) numbers of samples, ascending, two or more, and the level at each; beyond them it
        is that of the nearest.
    """
    for block in blocks(series.size):
        _kernels.times_levels(block.start, points, levels, series[block])


def floor_windows(bins: int) -> list[slice]:
    """Windows of bins for the running median; each starts midway through the previous one.

    Examples
    --------
    >>> floor_windows(1000)
    [slice(1, 513, None), slice(257, 769, None), slice(513, 1000, None)]
    """
    windows: list[slice] = []
    start = 1
    while start < bins:
        half = int(min(max(0.1 * start, _HALF_WIDTH), _MOST_HALF_WIDTH))
        stop = min(start + 2 * half, bins)
        if stop - start < half and windows:
            break
        windows.append(slice(start, stop))
        start += half
    return windows


def floor_scatter(bins: int) -> float:
    """Relative standard error of `noise_floor` at the middle of a periodogram of `bins`.

    Equal to that of the median of n exponential variates, n being the bins in that window.
    """
    half = np.clip(0.05 * bins, _HALF_WIDTH, _MOST_HALF_WIDTH)
    return float(1.0 / (np.log(2.0) * np.sqrt(2.0 * half)))
