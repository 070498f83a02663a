"""Power laws in frequency fitted to a spectrum with lines in it."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.optimize import nnls

from sagnac import series
from sagnac.arrays import BooleanArray, FloatArray, IntegerArray
from sagnac.spectrum.median import median

# An ordinate this many floors high in a narrow bin is a line, not noise: exp(-9) of them by chance.
_LINE_RATIO: Final = 9.0
_ROUNDS: Final = 16
# Logarithmic bins, and single ones before them.
_BINS: Final = 160
_SINGLE: Final = 9
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

    Raises
    ------
    ValueError
        If there are not four coefficients, one is negative, or the level is not positive.
    """

    coefficients: FloatArray
    level: float
    bins: int

    def __post_init__(self) -> None:
        if self.coefficients.shape != (4,) or not (self.coefficients >= 0.0).all():
            raise ValueError(f"coefficients is {self.coefficients}; give four, none negative")
        if not self.level > 0.0:
            raise ValueError(f"level is {self.level}; give a power above zero")

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
    binned = bin_levels(power)
    level = max(float(np.median(binned.level)), np.finfo(float).tiny)
    design = _laws(binned.center, power.size)
    coefficients = fit_levels(design, binned.level / level, binned.count)
    return PowerLaws(coefficients=coefficients, level=level, bins=power.size)


@dataclass(frozen=True, slots=True, kw_only=True)
class Binned:
    """Ordinates in some 160 bins, logarithmic from the tenth ordinate on.

    Attributes
    ----------
    center
        (bins,) mean number of the ordinates in each.
    count
        (bins,) how many there are.
    level
        (bins,) expected power, from their median.
    """

    center: FloatArray
    count: IntegerArray
    level: FloatArray


def bin_levels(power: FloatArray) -> Binned:
    """Ordinates at 1, 2, ... in bins; lines do not lift the level of a bin they are few in."""
    edges = np.unique(
        np.concatenate(
            [np.arange(_SINGLE), np.geomspace(_SINGLE, power.size, _BINS).astype(np.int64)]
        )
    )
    starts, stops = edges[:-1], edges[1:]
    count = stops - starts
    level = np.empty(count.size)

    def medians(some: slice) -> None:
        for index in range(some.start, some.stop):
            level[index] = median(power[starts[index] : stops[index]])

    # The widest bins of a long series are each some blocks of it: few at once, and their memory
    # given back soon.
    series.map(medians, count.size, power, length=1)
    # Median over mean of n exponential variates, to within 1 %: 1 at n = 1, ln 2 for many.
    level /= np.log(2.0) + (1.0 - np.log(2.0)) / count
    return Binned(center=0.5 * (starts + stops + 1.0), count=count, level=level)


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
    for number in range(_ROUNDS):
        weight = np.where(keep, np.sqrt(count) / model, 0.0)
        solution, _ = nnls(design * weight[:, None], target * weight)
        model = np.maximum(design @ solution, least)
        highest = model * (1.0 + _LINE_RATIO / np.sqrt(count))
        if number < _ROUNDS // 2:
            # What stands above the law may be a line or a law not seen yet: it pulls, but no
            # harder than a line may. Left out at once, a law could never come in.
            target = np.minimum(level, highest)
        else:
            target, keep = level, _below(level, highest)
    return np.asarray(solution / size)


def _below(level: FloatArray, highest: FloatArray) -> BooleanArray:
    return np.asarray(level < highest)
