"""Every band of a spectrum and every choice of terms, fitted by the gamma likelihood.

A model weighs ``exp(-(deviance + 2 terms + 2 bins left out)/2)``: the Akaike weight of models that
also choose their data (Jay and Neil, Phys. Rev. D 103, 114502, 2021).
"""

import math
from dataclasses import dataclass, fields
from typing import Final

import numpy as np

from sagnac.arrays import BooleanArray, FloatArray, IntegerArray
from sagnac.coefficients._kernels import every_model
from sagnac.coefficients.laws import STOCHASTIC_NAMES, CoefficientName, rate_density_basis
from sagnac.spectrum.levels import Levels

# Relative error of a bin that no model describes: it stands for what is neither chance nor a term.
FLOOR: Final = 0.03
# Relative error of a bin in which all cells stand out: weaker lines are in what is left.
_STANDING: Final = 0.15
# Fewest bins of a band.
LEAST_BINS: Final = 4
# Models lighter than this, relative to the heaviest, are dropped.
LIGHT: Final = 1e-5
# Columns of the walk, and of its fall with frequency.
WALK: Final = STOCHASTIC_NAMES.index("angle_random_walk")
FALL: Final = len(STOCHASTIC_NAMES)
# Number of terms by bit mask.
_SIZES: Final = np.array([mask.bit_count() for mask in range(1 << (FALL + 1))])
# What may not stand beside the fall of N: Q and B bend as it does.
_BARRED_WITH_FALL: Final = 0b101


@dataclass(frozen=True, slots=True, kw_only=True)
class BandModels:
    """Every fit, one row a model.

    Attributes
    ----------
    first, last
        (models,) band of bins, last exclusive.
    mask
        (models,) bit c set: term c of Q, N, B, K and the fall of N is fitted.
    ruled
        (models,) bins in which N is half of the fitted spectrum or more.
    deviance
        (models,) gamma deviance over the band.
    squares, covariance
        (models, 5) squared coefficients, SI, and (models, 5, 5) their covariance; the last is
        that of ``-2 f^2``.
    logarithm
        (models,) logarithm of the weight, 0 for the heaviest.
    """

    first: IntegerArray
    last: IntegerArray
    mask: IntegerArray
    ruled: IntegerArray
    deviance: FloatArray
    squares: FloatArray
    covariance: FloatArray
    logarithm: FloatArray

    def __post_init__(self) -> None:
        count = self.logarithm.size
        if any(getattr(self, item.name).shape[:1] != (count,) for item in fields(BandModels)):
            raise ValueError("the arrays of models must have one length")

    @property
    def count(self) -> int:
        """How many there are."""
        return int(self.logarithm.size)

    @property
    def sizes(self) -> IntegerArray:
        """(models,) number of terms."""
        return np.asarray(_SIZES[self.mask])

    @property
    def weights(self) -> FloatArray:
        """(models,) with a sum of one."""
        weight = np.exp(self.logarithm - self.logarithm.max(initial=-math.inf))
        return np.asarray(weight / weight.sum())

    @property
    def widening(self) -> FloatArray:
        """(models,) deviance per degree of freedom, one or more."""
        freedom = np.maximum(1.0, self.last - self.first - self.sizes)
        return np.asarray(np.maximum(1.0, self.deviance / freedom))

    def holding(self, column: int) -> BooleanArray:
        """(models,) those that fit a term."""
        return np.asarray((self.mask >> column & 1).astype(bool))

    def kept(self, rows: BooleanArray | IntegerArray) -> "BandModels":
        """Some of the models."""
        return BandModels(
            **{item.name: getattr(self, item.name)[rows] for item in fields(BandModels)}
        )

    def heaviest(self) -> "BandModels":
        """Models that matter, heaviest first."""
        if self.count == 0:
            return self
        order = np.argsort(-self.logarithm, kind="stable")
        return self.kept(order[self.logarithm[order] > self.logarithm.max() + math.log(LIGHT)])

    def terms(self, row: int) -> tuple[CoefficientName, ...]:
        """Names of the terms of one model."""
        mask = int(self.mask[row])
        return tuple(name for column, name in enumerate(STOCHASTIC_NAMES) if mask >> column & 1)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Scaled:
    """Levels at one, their laws scaled to about one, and the shapes with the floor in them."""

    shape: FloatArray
    laws: FloatArray
    scale: FloatArray


def _scaled(levels: Levels, floor: float) -> _Scaled:
    if not 0.0 <= floor < 1.0:
        raise ValueError(f"floor is {floor}; give a relative error from 0 to 1")
    interval = levels.spectrum.interval

    def law(frequency: FloatArray) -> FloatArray:
        fall = -2.0 * frequency[:, np.newaxis] ** 2
        return np.concatenate([rate_density_basis(frequency, interval), fall], axis=1)

    relative = levels.law(law) / levels.level[:, np.newaxis]
    scale = np.abs(relative).max(axis=0)
    shape = 1.0 / (1.0 / levels.shape + floor**2 + (_STANDING * levels.outstanding) ** 2)
    return _Scaled(shape=shape, laws=relative / scale, scale=scale)


def band_models(levels: Levels, *, floor: float = FLOOR) -> BandModels:
    """Fit every band and every choice of terms.

    Beside Q, N, B and K a fall of N with frequency is tried (with neither Q nor B),
    ``2 N^2 (1 - c f^2)`` with c >= 0: the beginning of any low-pass of the sensor. Without it
    bands that reach into the roll-off pull N down. Only the beginning is of that law; what falls
    farther lies outside the band.

    Parameters
    ----------
    levels
        Robust levels of the spectrum.
    floor
        Relative error added to that of every bin.

    Returns
    -------
    BandModels
        Those whose coefficients are all above zero.

    Raises
    ------
    ValueError
        If the floor makes no sense.
    """
    scaled = _scaled(levels, floor)
    plain = _models(scaled, LEAST_BINS, 0, 1 << FALL, math.inf)
    lightest = -2.0 * float(plain.logarithm.max(initial=-math.inf))
    falling = _models(scaled, LEAST_BINS, 1 << FALL | 1 << WALK, _BARRED_WITH_FALL, lightest)
    both = BandModels(
        **{
            item.name: np.concatenate([getattr(plain, item.name), getattr(falling, item.name)])
            for item in fields(BandModels)
        }
    )
    return _relative(both)


def models_of_one_band(
    levels: Levels, band_hz: tuple[float, float], mask: int, *, floor: float = FLOOR
) -> BandModels:
    """The models of one band that hold N and no term outside a mask.

    Parameters
    ----------
    levels
        Robust levels.
    band_hz
        Lowest and highest frequency, Hz; bins whose middle lies within are used.
    mask
        Bits of the terms allowed.
    floor
        Relative error added to that of every bin.

    Returns
    -------
    BandModels
        None of them if fewer than four bins lie in the band.
    """
    scaled = _scaled(levels, floor)
    inside = (levels.frequency >= band_hz[0]) & (levels.frequency <= band_hz[1])
    some = _Scaled(shape=scaled.shape[inside], laws=scaled.laws[inside], scale=scaled.scale)
    bins = int(np.count_nonzero(inside))
    barred = ~mask & ((1 << (FALL + 1)) - 1)
    return _relative(_models(some, max(bins, LEAST_BINS), 1 << WALK, barred, math.inf))


def _models(scaled: _Scaled, least: int, needed: int, barred: int, lightest: float) -> BandModels:
    """Fits whose terms are `needed` and others but `barred`; logarithms of weights are absolute."""
    first, last, mask, ruled, deviance, squares, covariance = every_model(
        np.ones(scaled.shape.size),
        scaled.shape,
        np.ascontiguousarray(scaled.laws),
        WALK,
        least,
        needed,
        barred,
        lightest,
    )
    left_out = scaled.shape.size - (last - first)
    return BandModels(
        first=first,
        last=last,
        mask=mask,
        ruled=ruled,
        deviance=deviance,
        squares=squares / scaled.scale,
        covariance=covariance / (scaled.scale[:, np.newaxis] * scaled.scale),
        logarithm=-0.5 * (deviance + 2.0 * (_SIZES[mask] + left_out)),
    )


def _relative(models: BandModels) -> BandModels:
    """With the logarithm of the heaviest at zero."""
    logarithm = models.logarithm - models.logarithm.max(initial=-math.inf)
    return BandModels(
        **{
            item.name: logarithm if item.name == "logarithm" else getattr(models, item.name)
            for item in fields(BandModels)
        }
    )
