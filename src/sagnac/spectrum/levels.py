"""Ten bins a decade with a level in each that lines inside the bin do not move.

Within a bin the cells are flattened by a law through the neighbouring bins first, so that a
sloping spectrum is no scatter. Then cells that stand out are left out with their neighbours,
and of what remains the lower part is averaged (an L-estimate of a gamma mean), divided by what
that average is of gamma variates of the same shape. The level has no bias for noise, and half
of a bin of lines moves it little.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache, lru_cache
from itertools import pairwise
from typing import Final

import numpy as np
from scipy.special import betainc, gammaincinv, roots_legendre

from sagnac.core.arrays import BooleanArray, FloatArray
from sagnac.spectrum.periodogram import CELL, band_degrees_of_freedom
from sagnac.spectrum.power_laws import running_median
from sagnac.spectrum.tapered import TaperedSpectrum, smoothed_law

BINS_A_DECADE: Final = 10


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Levels:
    """Robust levels of a rate spectrum in logarithmic bins.

    Attributes
    ----------
    frequency
        (bins,) geometric middle of the cells used, Hz.
    low, high
        (bins,) edges, Hz.
    level
        (bins,) one-sided rate density, (rad/s)^2/Hz, at `frequency`.
    shape
        (bins,) of the gamma law that the level follows: its relative variance is 1/shape.
    outstanding
        (bins,) share of the cells that stand out.
    members
        First and last cell (exclusive) of each bin.
    flat
        (cells,) law that each cell was divided by, about one; 0 for a cell that is left out.
    spectrum
        That the levels are of.
    """

    frequency: FloatArray
    low: FloatArray
    high: FloatArray
    level: FloatArray
    shape: FloatArray
    outstanding: FloatArray
    members: tuple[tuple[int, int], ...]
    flat: FloatArray
    spectrum: TaperedSpectrum

    def law(self, law: Callable[[FloatArray], FloatArray]) -> FloatArray:
        """A law as these levels show it.

        Parameters
        ----------
        law
            Frequency (points,), Hz, to (points, terms), (rad/s)^2/Hz.

        Returns
        -------
        FloatArray
            (bins, terms): seen through the tapers and flattened as the levels are.
        """
        weight = np.divide(1.0, self.flat, out=np.zeros(self.flat.size), where=self.flat > 0.0)
        starts = [first for first, _ in self.members]
        cells = smoothed_law(law, self.spectrum) * weight[:, np.newaxis]
        count = np.add.reduceat(self.flat > 0.0, starts, dtype=np.int64)
        return np.asarray(np.add.reduceat(cells, starts) / count[:, np.newaxis])


def robust_levels(
    spectrum: TaperedSpectrum, *, masked: Sequence[tuple[float, float]] = ()
) -> Levels:
    """Levels of a tapered spectrum.

    Parameters
    ----------
    spectrum
        Of the increments.
    masked
        Bands (low, high), Hz, to leave out, for lines that were removed; each is widened by
        what the tapers smooth over.

    Returns
    -------
    Levels
        Bins with nothing left in them are absent.

    Raises
    ------
    ValueError
        If no cell is left.
    """
    cells = spectrum.cells
    usable = cells.leaked < 0.2 * cells.density
    for low, high in masked:
        usable &= (cells.high + cells.half_width < low) | (cells.low - cells.half_width > high)
    # Rounding, or a readout that never moves.
    usable &= cells.density > 1e-12 * np.median(cells.density)
    members = tuple(
        (first, last)
        for first, last in _members(spectrum)
        if usable[first:last].sum() >= max(1, (last - first) // 4)
    )
    if not members:
        raise ValueError("no cell of the spectrum is left; give fewer masked bands")
    kept = [np.flatnonzero(usable[first:last]) + first for first, last in members]
    height = np.log(cells.frequency)
    place = np.array([height[some].mean() for some in kept])
    shapes = [round(0.5 * float(cells.degrees_of_freedom[some].mean()), 3) for some in kept]
    law = np.zeros(height.size)
    # The levels are read three times, each time flattened by those before.
    for _ in range(3):
        flat = np.zeros(height.size)
        for some in kept:
            flat[some] = np.exp(law[some] - law[some].mean())
        pairs = zip(kept, shapes, strict=True)
        levels = [_level(cells.density[some] / flat[some], shape) for some, shape in pairs]
        level, shape, outstanding = np.array(levels).T.copy()
        # Straight in logarithms between the levels; one bin of lines tilts no neighbour.
        law = np.interp(height, place, running_median(np.log(level), 3))
    return Levels(
        frequency=np.exp(place),
        low=np.array([cells.low[first] for first, _ in members]),
        high=np.array([cells.high[last - 1] for _, last in members]),
        level=level,
        shape=shape,
        outstanding=outstanding,
        members=members,
        flat=flat,
        spectrum=spectrum,
    )


def _members(spectrum: TaperedSpectrum) -> list[tuple[int, int]]:
    """First and last cell (exclusive) of each logarithmic bin that holds any.

    A bin ends where cells of the whole record meet those averaged over segments: what the lower
    part of the cells averages to is known of cells that scatter alike.
    """
    frequency, freedom = spectrum.cells.frequency, spectrum.cells.degrees_of_freedom
    index = np.floor(BINS_A_DECADE * np.log10(frequency * 2.0 * spectrum.interval))
    others = np.abs(np.diff(np.log(freedom))) > math.log(1.5)
    edges = np.flatnonzero((np.diff(index) > 0.0) | others) + 1
    return list(pairwise([0, *edges.tolist(), frequency.size]))


def _level(density: FloatArray, shape: float) -> tuple[float, float, float]:
    """Level of the cells of a bin, its own shape, and the share of the cells that stand out."""
    standing = _standing(density, shape)
    used = np.sort(density[~standing])
    kept, expected, efficiency = _lower_average(used.size, shape)
    # Neighbouring cells share a little; the whole of them is worth less than their sum.
    joint = band_degrees_of_freedom(CELL * used.size)
    joint /= used.size * band_degrees_of_freedom(CELL)
    own = shape * used.size * min(joint, 1.0) * efficiency
    return float(used[:kept].mean()) / expected, own, np.count_nonzero(standing) / standing.size


def _standing(cells: FloatArray, shape: float) -> BooleanArray:
    """Cells above what chance gives the largest of them all, and their neighbours."""
    standing = np.zeros(cells.size, dtype=np.bool_)
    if cells.size < 4:
        return standing
    # Lines fill the upper part: the level of the noise shows at the lower third of the cells.
    # `numpy.quantile` takes ten times as long as sorting so few.
    third = np.interp(0.35 * (cells.size - 1), np.arange(cells.size), np.sort(cells))
    typical = float(third) / (gammaincinv(shape, 0.35) / shape)
    # The third itself scatters, by about one and a half standard errors of the mean.
    scatter = 1.0 + 3.0 * 1.3 / math.sqrt(shape * cells.size)
    # A bin of noise loses a cell in one of a hundred.
    largest = float(gammaincinv(shape, 1.0 - 0.01 / cells.size)) / shape
    standing = cells > typical * largest * scatter
    beside = np.convolve(standing, np.ones(3), mode="same") > 0.0
    return np.asarray(beside if np.count_nonzero(~beside) >= 3 else standing)


# Whatever is integrated.
_legendre = cache(roots_legendre)


@lru_cache(maxsize=64)
def _quantiles(shape: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Places from 0 to 1 with weights of Gauss's quadrature, and gamma quantiles of mean one."""
    nodes, weights = _legendre(600)
    place = 0.5 * (nodes + 1.0)
    return place, 0.5 * weights, gammaincinv(shape, place) / shape


@lru_cache(maxsize=4096)
def _lower_average(cells: int, shape: float) -> tuple[int, float, float]:
    """The mean of the lower part of gamma variates: of how many, expected, and how efficient.

    The smallest r of m variates have the mean ``m/r int G^-1(u) P(Bin(m-1, u) < r) du``; the
    efficiency is that of a trimmed mean (Huber, Robust Statistics, 1981, 3.3).
    """
    # Beyond a thousand cells one more does not change what the average is of a mean.
    in_all, cells = cells, min(cells, 1000)
    # All of few, the lower part of more: the more cells there are the less their number matters
    # beside what is not noise.
    share = 0.5 if cells >= 40 else 0.75 if cells >= 8 else 1.0
    count = math.ceil(share * cells)
    if count == cells:
        return in_all, 1.0, 1.0
    place, weights, value = _quantiles(shape)
    # P(fewer than r of the other m-1 lie below u) is a beta distribution.
    below = betainc(cells - count, count, 1.0 - place)
    expected = float(cells / count * weights @ (value * below))
    # Influence of one variate on the mean of the lower share: itself, held at the quantile.
    held = np.minimum(value, float(gammaincinv(shape, count / cells)) / shape)
    centre = float(weights @ held)
    variance = float(weights @ (held - centre) ** 2) / share**2 / expected**2
    return math.ceil(share * in_all), expected, min(1.0, (1.0 / shape) / variance)
