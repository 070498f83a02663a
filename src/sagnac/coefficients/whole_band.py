"""A likelihood fit of five terms to a band, and whether the levels bear it out."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.special import gammainc, gammaincc, gammaincinv, ndtri

from sagnac.arrays import FloatArray
from sagnac.coefficients.band_models import FALL, WALK, BandModels
from sagnac.coefficients.estimates import Estimate, Fit
from sagnac.coefficients.laws import (
    COEFFICIENT_NAMES,
    STOCHASTIC_NAMES,
    CoefficientName,
    level_laws,
)
from sagnac.spectrum.levels import Levels


@dataclass(frozen=True, slots=True, kw_only=True)
class _Strictness:
    """How much the levels may speak against a fit.

    Attributes
    ----------
    chance
        That a true fit fails one of the tests of the levels against their law.
    outdone
        Logarithm of the weight by which a model of fewer bins may outdo that of all.
    apart
        Standard errors of the average by which the fit may differ from it.
    """

    chance: float
    outdone: float
    apart: float


# One in twenty recordings of five terms is outdone by more; one in twenty differs by more.
_SURELY: Final = _Strictness(chance=0.02, outdone=3.0, apart=1.3)
# Hardly one in a hundred recordings of five terms goes beyond these.
_BARELY: Final = _Strictness(chance=0.001, outdone=6.0, apart=4.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class WholeBand:
    """A fit of all five terms to the whole band, made elsewhere, as one member of the average.

    Attributes
    ----------
    coefficients
        All five at the confidence of the average, of the values whose levels are averaged.
    band_hz
        Lowest and highest frequency it used, Hz.
    describes
        Whether it found its own spectrum described up to chance.

    Raises
    ------
    ValueError
        If a coefficient is missing or the frequencies are not in order.
    """

    coefficients: Mapping[CoefficientName, Estimate]
    band_hz: tuple[float, float]
    describes: bool

    def __post_init__(self) -> None:
        if set(self.coefficients) != set(COEFFICIENT_NAMES):
            raise ValueError(f"coefficients has {', '.join(self.coefficients)}; give all five")
        if not 0.0 <= self.band_hz[0] < self.band_hz[1]:
            raise ValueError(f"band_hz is {self.band_hz}; give two frequencies, low then high")

    @property
    def angle_random_walk(self) -> Estimate:
        """N."""
        return self.coefficients["angle_random_walk"]


@dataclass(frozen=True, slots=True, kw_only=True)
class BorneOut:
    """How far the levels bear out a fit of five terms to the whole band.

    Attributes
    ----------
    row
        The heaviest model of all bins.
    surely
        Whether the fit is the answer. If not, the levels neither bear it out nor reject it: the
        average may be right as well.
    """

    row: int
    surely: bool


def borne_out(
    levels: Levels, laws: FloatArray, models: BandModels, whole_band: WholeBand, walk: Estimate
) -> BorneOut | None:
    """Whether the levels bear out a fit of five terms to the whole band.

    The heaviest model of all bins has to pass two tests at a chance of 0.02 each, without any
    floor of the errors: its deviance, and the largest mean departure over any run of bins,
    which finds what bends. No model of fewer bins may outweigh it by more than e^3. And the value
    must lie within 1.3 standard errors of the average, or below its bound. A fit that fails
    these, but passes at a chance of 0.001, e^6 and four standard errors from an estimate, is
    neither borne out nor rejected.

    Parameters
    ----------
    levels, laws
        The levels and the laws of Q, N, B, K as they show them.
    models
        Of these levels.
    whole_band
        The fit. It has to use every bin: what it leaves out it does not describe.
    walk
        N of the average.

    Returns
    -------
    BorneOut or None
        None if the levels reject the fit, or it cannot be compared with them.
    """
    low, high = whole_band.band_hz
    fitted = whole_band.angle_random_walk
    if not whole_band.describes or fitted.status != "estimated":
        return None
    if not (low <= levels.frequency[0] and levels.frequency[-1] <= high):
        return None
    complete = (models.first == 0) & (models.last == levels.level.size)
    complete &= models.holding(WALK) & ~models.falling
    if not complete.any():
        return None
    row = int(np.flatnonzero(complete)[np.argmax(models.logarithm[complete])])
    outdone = float(models.logarithm.max() - models.logarithm[row])
    ratio = levels.level / (laws @ models.squares[row, :FALL])
    freedom = ratio.size - int(models.sizes[row])

    def passes(test: _Strictness) -> bool:
        return (
            outdone <= test.outdone
            and _agrees(fitted, walk, test.apart)
            and describes(levels.shape, ratio, freedom, test.chance)
        )

    if passes(_SURELY):
        return BorneOut(row=row, surely=True)
    if walk.status == "estimated" and passes(_BARELY):
        return BorneOut(row=row, surely=False)
    return None


def levels_bear_out(levels: Levels, fit: Fit, walk: Estimate) -> bool:
    """Whether the levels bear out a fit to the lowest frequencies.

    N of both, interval or bound, has to overlap, and the levels in the band of the fit have to pass
    both tests of `borne_out` against its squares at a chance of 0.02.

    Parameters
    ----------
    levels
        Of the same values.
    fit
        By likelihood.
    walk
        N of the average.
    """
    fitted = fit.coefficients["angle_random_walk"]
    if fit.departure != 0.0 or fit.band is None or fitted.status == "not observable":
        return False
    used = levels.frequency <= fit.band.high
    if np.count_nonzero(used) <= FALL or fitted.low > walk.high or fitted.high < walk.low:
        return False
    law = level_laws(levels)[used] @ [fit.squares.get(name, 0.0) for name in STOCHASTIC_NAMES]
    if not law.min() > 0.0:
        return False
    ratio, freedom = levels.level[used] / law, int(np.count_nonzero(used)) - FALL
    return describes(levels.shape[used], ratio, freedom, _SURELY.chance)


def describes(shape: FloatArray, ratio: FloatArray, freedom: int, chance: float) -> bool:
    """Whether levels depart from their law by chance alone.

    Parameters
    ----------
    shape
        (bins,) of the gamma law of each level.
    ratio
        (bins,) level over its mean.
    freedom
        Bins less the terms fitted.
    chance
        That levels of the law fail the test.
    """
    deviance = float(2.0 * shape @ (ratio - 1.0 - np.log(ratio)))
    within = deviance <= 2.0 * float(gammaincinv(0.5 * freedom, 1.0 - chance))
    return within and largest_run(shape, ratio) < -float(ndtri(chance / (4.0 * ratio.size)))


def _agrees(fitted: Estimate, walk: Estimate, apart: float) -> bool:
    """Whether a fit differs from the average by no more than chance, or lies below its bound."""
    if walk.status != "estimated":
        return walk.status == "not observable" or fitted.value <= walk.high
    above = fitted.value >= walk.value
    # The interval may be lopsided: the error is that of the side on which the fit lies.
    end = walk.high if above else max(walk.low, 1e-3 * walk.value)
    error = abs(math.log(end / walk.value)) / float(ndtri(0.5 + 0.5 * walk.confidence))
    return abs(math.log(fitted.value / walk.value)) <= apart * error


def largest_run(shape: FloatArray, ratio: FloatArray) -> float:
    """Largest mean departure over any run of bins, in standard errors.

    Parameters
    ----------
    shape
        (bins,) of the gamma law of each level.
    ratio
        (bins,) level over its mean.
    """
    upper = np.clip(gammaincc(shape, shape * ratio), 1e-300, 1.0)
    lower = np.clip(gammainc(shape, shape * ratio), 1e-300, 1.0)
    deviate = np.where(ratio > 1.0, -ndtri(upper), ndtri(lower))
    total = np.concatenate([[0.0], np.cumsum(deviate)])
    place = np.arange(total.size)
    length = np.maximum(np.abs(place - place[:, np.newaxis]), 1)
    return float((np.abs(total - total[:, np.newaxis]) / np.sqrt(length)).max())
