"""The noise floor of a spectrum with lines in it."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from sagnac import series
from sagnac.arrays import FloatArray
from sagnac.spectrum import _kernels
from sagnac.spectrum.median import median
from sagnac.spectrum.power_laws import PowerLaws, fit_power_laws

_HALF_WIDTH: Final = 256  # bins; the median of 513 ordinates is good to 6 %
_MOST_HALF_WIDTH: Final = 4096
# With fewer bins than this the floor is one constant level.
_FEWEST_BINS: Final = 32
# Windows handled at once; this many of the widest fill one block of a series.
_WINDOWS_AT_ONCE: Final = 64


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
    if power.size < _FEWEST_BINS:
        level = float(np.median(power[1:])) / np.log(2.0)
        return np.full(power.size, max(level, np.finfo(float).tiny))
    law = tabulated(fit_power_laws(power[1:]))
    windows = floor_windows(power.size)
    ratios = ratios_to_law(power, law, windows)
    middles = np.array([0.5 * (window.start + window.stop) for window in windows])

    if middles.size == 1:
        middles, ratios = np.array([1.0, power.size]), np.repeat(ratios, 2)
    ratio = Tabulated(points=middles, levels=ratios)

    def times_ratio(block: slice) -> FloatArray:
        floor = law.over(block)
        floor *= ratio.over(block)
        return floor

    floor = series.made(times_ratio, power.size)
    floor[0] = floor[1]
    return floor


@dataclass(frozen=True, slots=True, kw_only=True)
class Tabulated:
    """Levels at some bins, and linear between them.

    A law tabulated every 0.5 % is accurate to 1 part in 1e5.

    Attributes
    ----------
    points
        (points,) numbers of bins, ascending, two or more.
    levels
        (points,) expected power there.
    """

    points: FloatArray
    levels: FloatArray

    def over(self, block: slice) -> FloatArray:
        """(bins,) level over a block of bins; beyond the points that of the nearest."""
        levels = np.empty(block.stop - block.start)
        _kernels.interpolated(block.start, self.points, self.levels, levels)
        return levels


def tabulated(law: PowerLaws) -> Tabulated:
    """The law at every bin of the first 400, and then at points half a percent apart."""
    bins = law.bins
    points = np.unique(
        np.concatenate([np.arange(1.0, min(bins + 1, 401)), np.geomspace(1.0, bins, 3000)])
    )
    return Tabulated(points=points, levels=law.at(points))


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


def ratios_to_law(power: FloatArray, law: Tabulated, windows: list[slice]) -> FloatArray:
    """Ratio of mean power to the law in each window, from the median of exponential ordinates.

    Parameters
    ----------
    power
        (bins,) of a periodogram.
    law
        Expected power.
    windows
        Bins of each, in ascending order.

    Returns
    -------
    (windows,).
    """
    ratios = np.empty(len(windows))

    def whiten(some: slice) -> None:
        first = windows[some.start].start
        stop = windows[some.stop - 1].stop
        white = power[first:stop] / law.over(slice(first, stop))
        for index in range(some.start, some.stop):
            window = windows[index]
            ratios[index] = median(white[window.start - first : window.stop - first])

    series.map(whiten, len(windows), power, length=_WINDOWS_AT_ONCE)
    ratios /= np.log(2.0)
    return ratios


def floor_scatter(bins: int) -> float:
    """Relative standard error of `noise_floor` at the middle of a periodogram of `bins`.

    Equal to that of the median of n exponential variates, n being the bins in that window.
    """
    half = np.clip(0.05 * bins, _HALF_WIDTH, _MOST_HALF_WIDTH)
    return float(1.0 / (np.log(2.0) * np.sqrt(2.0 * half)))
