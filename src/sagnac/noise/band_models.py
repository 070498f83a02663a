"""Every band of a spectrum and every choice of terms, fitted by the gamma likelihood.

A model weighs ``exp(-(deviance + 2 terms + 2 bins left out)/2)``: the Akaike weight of models that
also choose their data (Jay and Neil, Phys. Rev. D 103, 114502, 2021). Nothing lowers N at low
frequency, so that bins left out below the band have to lie above N: what they lack is added to the
deviance. A hump of vibration is flat at its top, but the spectrum below it is lower.
"""

import math
from dataclasses import dataclass, fields
from typing import Final

import numpy as np

from sagnac.core.arrays import BooleanArray, FloatArray, IntegerArray
from sagnac.noise._kernels import every_model
from sagnac.noise.laws import (
    STOCHASTIC_NAMES,
    CoefficientName,
    level_laws,
    rate_density_basis,
)
from sagnac.spectrum.levels import Levels

# Relative error of a bin that no model describes: it stands for what is neither chance nor a term.
FLOOR: Final = 0.03
# Relative error of a bin in which all cells stand out: weaker lines are in what is left.
_STANDING: Final = 0.15
# Fewest bins of a band.
LEAST_BINS: Final = 4
# Models lighter than this, relative to the heaviest, are dropped.
LIGHT: Final = 1e-5
# Columns of the walk, and of the first of the falls with frequency.
WALK: Final = STOCHASTIC_NAMES.index("angle_random_walk")
FALL: Final = len(STOCHASTIC_NAMES)
# Orders of a low-pass, one fall each.
ORDERS: Final = (1, 2)
# Number of columns, and of terms by bit mask.
_COLUMNS: Final = FALL + len(ORDERS)
_SIZES: Final = np.array([mask.bit_count() for mask in range(1 << _COLUMNS)])
# What may not stand beside a fall: Q comes after the sensor's filter.
_BARRED_WITH_FALL: Final = 0b001


@dataclass(frozen=True, slots=True, kw_only=True)
class BandModel:
    """One model as a law of the spectrum.

    Attributes
    ----------
    squares
        Squared Q, N, B and K, SI.
    interval
        Between the angles whose increments were taken, s.
    order, fall
        Of the divisor ``1 + fall f^(2 order)``; 0 without a low-pass.
    """

    squares: tuple[float, ...]
    interval: float
    order: int = 0
    fall: float = 0.0

    def density(self, frequency: FloatArray) -> FloatArray:
        """One-sided rate density, (rad/s)^2/Hz, at frequencies (points,), Hz, above zero."""
        laws = rate_density_basis(frequency, self.interval) @ np.array(self.squares)
        return np.asarray(laws / self.divisor(frequency))

    def divisor(self, frequency: FloatArray) -> FloatArray:
        """Divisor of the terms by the low-pass at frequencies (points,), Hz."""
        return np.asarray(1.0 + self.fall * frequency ** (2.0 * self.order))


@dataclass(frozen=True, slots=True, kw_only=True)
class BandModels:
    """Every fit, one row a model.

    Attributes
    ----------
    first, last
        (models,) band of bins, last exclusive.
    mask
        (models,) bit c set: term c of Q, N, B, K and the falls of first and second order is fitted.
    ruled
        (models,) bins in which N is half of the fitted spectrum or more.
    deviance
        (models,) gamma deviance over the band.
    squares, covariance
        (models, 6) squared coefficients, SI, and (models, 6, 6) their covariance; the last two
        are c of the divisors ``1 + c f^2`` and ``1 + c f^4``.
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

    @property
    def falling(self) -> BooleanArray:
        """(models,) those under the beginning of a low-pass."""
        return np.asarray(self.mask >= 1 << FALL)

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

    def law(self, row: int, interval: float) -> BandModel:
        """One model as a law of a spectrum of angles that lie an interval (s) apart."""
        mask = int(self.mask[row])
        order = next((each for each in ORDERS if mask >> (FALL + each - 1) & 1), 0)
        return BandModel(
            squares=tuple(self.squares[row, :FALL].tolist()),
            interval=interval,
            order=order,
            fall=float(self.squares[row, FALL + order - 1]) if order else 0.0,
        )

    def terms(self, row: int) -> tuple[CoefficientName, ...]:
        """Names of the terms of one model."""
        mask = int(self.mask[row])
        return tuple(name for column, name in enumerate(STOCHASTIC_NAMES) if mask >> column & 1)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Scaled:
    """Levels at one, their laws scaled to about one, and the shapes with the floor in them.

    `divisors` are f^2 and f^4 scaled to one at the highest bin.
    """

    shape: FloatArray
    laws: FloatArray
    divisors: FloatArray
    scale: FloatArray

    def of(self, order: int) -> FloatArray:
        """(bins, columns): the laws, and the divisor of an order, 0 for none."""
        return (
            self.laws if order == 0 else np.column_stack([self.laws, self.divisors[:, order - 1]])
        )


def bin_shapes(levels: Levels, error: float) -> FloatArray:
    """(bins,) shapes of the levels' gamma laws with a relative error of each beside chance."""
    standing = _STANDING * levels.outstanding
    return np.asarray(1.0 / (1.0 / levels.shape + error**2 + standing**2))


def _scaled(levels: Levels) -> _Scaled:
    laws = level_laws(levels) / levels.level[:, np.newaxis]
    divisors = levels.frequency[:, np.newaxis] ** (2.0 * np.array(ORDERS))
    both = np.column_stack([laws, divisors])
    scale = np.abs(both).max(axis=0)
    both /= scale
    shape = bin_shapes(levels, FLOOR)
    return _Scaled(shape=shape, laws=both[:, :FALL], divisors=both[:, FALL:], scale=scale)


def band_models(levels: Levels) -> BandModels:
    """Fit every band and every choice of terms.

    Beside Q, N, B and K a low-pass of the sensor is tried (without Q, which it does not lower):
    N, B and K divided by ``1 + c f^2`` or ``1 + c f^4`` with c >= 0, as behind a Butterworth
    filter of first or second order. Without it bands that reach into the roll-off pull N down.
    Only the beginning of a fall is fitted; what falls farther lies outside the band.

    Parameters
    ----------
    levels
        Robust levels of the spectrum.

    Returns
    -------
    BandModels
        Those whose coefficients are all above zero.
    """
    scaled = _scaled(levels)
    plain = _models(scaled, LEAST_BINS)
    lightest = -2.0 * float(plain.logarithm.max(initial=-math.inf))
    falling = [
        _models(scaled, LEAST_BINS, order=order, needed=1 << WALK, lightest=lightest)
        for order in ORDERS
    ]
    return _joined([plain, *falling])


def models_of_one_band(levels: Levels, band_hz: tuple[float, float], mask: int) -> BandModels:
    """The models of one band that hold N and no term outside a mask.

    Parameters
    ----------
    levels
        Robust levels.
    band_hz
        Lowest and highest frequency, Hz; bins whose middle lies within are used.
    mask
        Bits of the terms allowed.

    Returns
    -------
    BandModels
        None of them if fewer than four bins lie in the band.
    """
    scaled = _scaled(levels)
    inside = (levels.frequency >= band_hz[0]) & (levels.frequency <= band_hz[1])
    some = _Scaled(
        shape=scaled.shape[inside],
        laws=scaled.laws[inside],
        divisors=scaled.divisors[inside],
        scale=scaled.scale,
    )
    least = max(int(np.count_nonzero(inside)), LEAST_BINS)
    barred = ~mask & ((1 << FALL) - 1)
    allowed = [order for order in ORDERS if mask >> (FALL + order - 1) & 1]
    return _joined(
        [_models(some, least, order=one, needed=1 << WALK, barred=barred) for one in (0, *allowed)]
    )


def _models(
    scaled: _Scaled,
    least: int,
    *,
    order: int = 0,
    needed: int = 0,
    barred: int = 0,
    lightest: float = math.inf,
) -> BandModels:
    """Fits under a low-pass of an order, 0 for none, whose terms are `needed` and not `barred`.

    Logarithms of weights are absolute.
    """
    laws = scaled.of(order)
    places, deviance, squares, covariance = every_model(
        np.ones(scaled.shape.size),
        scaled.shape,
        np.ascontiguousarray(laws),
        WALK,
        least,
        needed | (1 << FALL if order else 0),
        barred | (_BARRED_WITH_FALL if order else 0),
        order > 0,
        lightest,
    )
    first, last, mask, ruled = places
    # The kernel knows one fall, in the column behind the laws.
    columns = np.r_[:FALL, FALL + order - 1][: laws.shape[1]]
    mask = (mask & ((1 << FALL) - 1)) | (1 << (FALL + order - 1) if order else 0)
    placed = np.zeros((mask.size, _COLUMNS))
    placed[:, columns] = squares
    spread = np.zeros((mask.size, _COLUMNS, _COLUMNS))
    spread[:, columns[:, np.newaxis], columns] = covariance
    left_out = scaled.shape.size - (last - first)
    lacking = _lacking(scaled, first, squares[:, WALK])
    return BandModels(
        first=first,
        last=last,
        mask=mask,
        ruled=ruled,
        deviance=deviance,
        squares=placed / scaled.scale,
        covariance=spread / (scaled.scale[:, np.newaxis] * scaled.scale),
        logarithm=-0.5 * (deviance + lacking + 2.0 * (_SIZES[mask] + left_out)),
    )


def _lacking(scaled: _Scaled, first: IntegerArray, walk: FloatArray) -> FloatArray:
    """(models,) gamma deviance of the bins below each band that are lower than N alone."""
    result = np.zeros(first.size)
    for number in range(int(first.max(initial=0))):
        mean = walk * scaled.laws[number, WALK]
        lower = (first > number) & (mean > 1.0)
        # Levels are one.
        ratio = 1.0 / mean[lower]
        result[lower] += 2.0 * scaled.shape[number] * (ratio - 1.0 - np.log(ratio))
    return result


def _joined(models: list[BandModels]) -> BandModels:
    """All of them, with the logarithm of the heaviest at zero."""
    joined = {
        item.name: np.concatenate([getattr(one, item.name) for one in models])
        for item in fields(BandModels)
    }
    joined["logarithm"] -= joined["logarithm"].max(initial=-math.inf)
    return BandModels(**joined)
