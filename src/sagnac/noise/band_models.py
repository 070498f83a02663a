"""Every band of a spectrum and every choice of terms, fitted by the gamma likelihood.

A model weighs ``exp(-(deviance + 2 terms + 2 bins left out)/2)``: the Akaike weight of models that
also choose their data (Jay and Neil, Phys. Rev. D 103, 114502, 2021). Nothing lowers N at low
frequency, so that bins left out below the band have to lie above N: what they lack is added to the
deviance. A hump of vibration is flat at its top, but the spectrum below it is lower.

A low-pass may lower what lies above a band that reaches to 0.2 Hz. A bin that is 1.2 times lower
costs one more than the deviance to be expected of it if it were described, which is less than one
if most of the error that a fit allows it is no chance: else the floor of a converter above a
low-pass, in bins of many cells, would outweigh the plateau below.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from itertools import groupby
from typing import Final

import numpy as np

from sagnac.core.arrays import BooleanArray, FloatArray, IntegerArray
from sagnac.noise._kernels import score_bands
from sagnac.noise.laws import STOCHASTIC_NAMES, CoefficientName, level_laws, rate_density_basis
from sagnac.noise.slow_laws import FLICKER, LOW_PASS, PLAIN, QUANTIZATION, WALK, SlowLaw
from sagnac.spectrum.levels import Levels

# Relative error of a bin that no model describes: it stands for what is neither chance nor a term.
FLOOR: Final = 0.03
# Fewest bins of a band.
LEAST_BINS: Final = 4
# Models lighter than this, relative to the heaviest, are dropped.
LIGHT: Final = 1e-5
# Column of slow noise that is less steep than 1/f, behind Q, N, B and K, and its law.
GENTLE: Final = len(STOCHASTIC_NAMES)
_GENTLE_LAW: Final = SlowLaw(slope=0.7)
# Column of the first of the falls with frequency.
FALL: Final = GENTLE + 1
# Orders of a low-pass, one fall each.
ORDERS: Final = (1, 2)
# Number of columns.
_COLUMNS: Final = FALL + len(ORDERS)
# A bin above a band counts as lowered by a low-pass if it lies below N by this factor. With 1 bands
# that chance makes a little high gained by every bin above them: beside flicker and a low-pass some
# intervals of 100 minutes were three times as wide. With 1.4 that of a MEMS gyro (MPU6050) was.
_FALLEN: Final = 1.2
# Steps of a fit, of which the first is least squares on relative residuals.
_MOST_STEPS: Final = 21
# A model is given up if its deviance is this much above that of another.
_HOPELESS: Final = 60.0


def _is_choice(mask: int) -> bool:
    """Whether these terms are fitted together: one fall at most, with N, and Q or slow noise.

    With both, a fall can take the shape of many other filters, and N is no longer determined.
    """
    falls, slow, walk = mask >> FALL, mask >> FLICKER & 0b111, bool(mask >> WALK & 1)
    # Gentle slow noise beside K would take the shape of 1/f.
    if mask >> GENTLE & 1 and (slow != 0b100 or not walk):
        return False
    return falls == 0 or (falls.bit_count() == 1 and walk and not (mask & 1 and slow))


_MASKS: Final = [mask for mask in range(1, 1 << _COLUMNS) if _is_choice(mask)]


@dataclass(frozen=True, slots=True, kw_only=True)
class BandModel:
    """One model as a law of the spectrum.

    Attributes
    ----------
    squares
        Squared Q, N, B and K, SI.
    interval
        Between the angles whose increments were taken, s.
    falls
        c of the divisors ``1 + c f^2`` and ``1 + c f^4``; zero without a low-pass.
    slow
        What B and K are.
    """

    squares: tuple[float, ...]
    interval: float
    falls: tuple[float, ...] = (0.0,) * len(ORDERS)
    slow: SlowLaw = PLAIN

    def density(self, frequency: FloatArray) -> FloatArray:
        """One-sided rate density, (rad/s)^2/Hz, at frequencies (points,), Hz, above zero."""
        laws = rate_density_basis(frequency, self.interval)
        return np.asarray(self._terms(laws, frequency).sum(axis=1))

    def terms(self, levels: Levels) -> FloatArray:
        """(bins, 4) levels that Q, N, B and K make."""
        return self._terms(level_laws(levels), levels.frequency)

    def _terms(self, laws: FloatArray, frequency: FloatArray) -> FloatArray:
        terms = laws * np.array(self.squares) * self.slow.shares(frequency)
        # Q comes after the low-pass.
        terms[:, WALK:] /= 1.0 + divisor_laws(frequency) @ np.array(self.falls)[:, np.newaxis]
        return np.asarray(terms)

    def over(self, levels: Levels) -> FloatArray:
        """(bins,) levels over what the model makes of them."""
        return np.asarray(levels.level / self.terms(levels).sum(axis=1))


@dataclass(frozen=True, slots=True, kw_only=True)
class BandModels:
    """Every fit, one row a model.

    Attributes
    ----------
    first, last
        (models,) band of bins, last exclusive.
    mask
        (models,) bit c set: term c of Q, N, B, K, gentle slow noise and the two falls is fitted.
    ruled
        (models,) bins in which N is half of the fitted spectrum or more.
    deviance
        (models,) gamma deviance over the band.
    squares, covariance
        (models, 7) squared coefficients, SI, and (models, 7, 7) their covariance; the last two
        are c of the divisors ``1 + c f^2`` and ``1 + c f^4``.
    logarithm
        (models,) logarithm of the weight; models of the same levels compare.
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
        return np.bitwise_count(self.mask).astype(np.int64)

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
        some = {item.name: getattr(self, item.name)[rows] for item in fields(BandModels)}
        return BandModels(**some)

    def heaviest(self) -> "BandModels":
        """Models that matter, heaviest first."""
        if self.count == 0:
            return self
        order = np.argsort(-self.logarithm, kind="stable")
        return self.kept(order[self.logarithm[order] > self.logarithm.max() + math.log(LIGHT)])

    def law(self, row: int, interval: float) -> BandModel:
        """One model as a law of a spectrum of angles that lie an interval (s) apart."""
        every = self.squares[row].tolist()
        slow = _GENTLE_LAW if every[GENTLE] else PLAIN
        every[FLICKER] += every[GENTLE]
        squares, falls = tuple(every[:GENTLE]), tuple(every[FALL:])
        return BandModel(squares=squares, interval=interval, falls=falls, slow=slow)

    def terms(self, row: int) -> tuple[CoefficientName, ...]:
        """Names of the terms of one model."""
        mask = int(self.mask[row])
        return tuple(name for column, name in enumerate(STOCHASTIC_NAMES) if mask >> column & 1)


@dataclass(frozen=True, slots=True, kw_only=True)
class ScaledLaws:
    """Laws relative to the levels, scaled to about one, and the shapes with the floor in them.

    Attributes
    ----------
    shape
        (bins,)
    laws
        (bins, 7) of `band_laws`, and f^2 and f^4 of the divisors, one at the highest bin.
    scale
        (7,) by which these were divided.
    chance
        (bins,) share of it in the variance that a fit allows a bin.
    low_passed
        (bins,) whether a low-pass may begin to fall there.
    """

    shape: FloatArray
    chance: FloatArray
    low_passed: BooleanArray
    laws: FloatArray
    scale: FloatArray


def bin_shapes(levels: Levels, error: float) -> FloatArray:
    """(bins,) shapes of the levels' gamma laws with a relative error of each beside chance."""
    # If all cells of a bin stand out, weaker lines are in what is left.
    return np.asarray(1.0 / (1.0 / levels.shape + error**2 + (0.15 * levels.outstanding) ** 2))


def divisor_laws(frequency: FloatArray) -> FloatArray:
    """(points, orders) of the divisors, without their one and their factor c."""
    return np.asarray(frequency[:, np.newaxis] ** (2.0 * np.array(ORDERS)))


def gamma_deviance(shape: FloatArray, ratio: FloatArray) -> float:
    """Deviance of levels from their law, by their shapes and ratios to it, (bins,) both."""
    return float(2.0 * shape @ (ratio - 1.0 - np.log(ratio)))


def band_laws(levels: Levels) -> FloatArray:
    """(bins, 5) levels of Q, N, B, K and slow noise less steep than 1/f at one."""
    laws = level_laws(levels)
    gentle = laws[:, FLICKER] * _GENTLE_LAW.shares(levels.frequency)[:, FLICKER]
    return np.column_stack([laws, gentle])


def _scaled(levels: Levels) -> ScaledLaws:
    relative = band_laws(levels) / levels.level[:, np.newaxis]
    laws = np.column_stack([relative, divisor_laws(levels.frequency)])
    scale = np.abs(laws).max(axis=0)
    shape = bin_shapes(levels, FLOOR)
    chance = shape / bin_shapes(levels, 0.0)
    passed = levels.frequency >= LOW_PASS
    return ScaledLaws(shape=shape, chance=chance, low_passed=passed, laws=laws / scale, scale=scale)


def band_models(levels: Levels) -> BandModels:
    """Fit every band and every choice of terms.

    Beside Q, N, B and K a low-pass of the sensor is tried: N, B and K, not Q of a readout behind
    it, are divided by ``1 + c f^2`` or ``1 + c f^4`` with c >= 0, as behind a Butterworth filter of
    first or second order. Without it bands that reach into the roll-off pull N down. Slow noise may
    be gentle, f^-0.7: with B, N is too large where a low-pass leaves no band to it alone. Only the
    beginning of a fall is fitted; what falls farther lies outside the band, or below Q.

    Parameters
    ----------
    levels
        Robust levels of the spectrum.

    Returns
    -------
    BandModels
        Those whose coefficients are all above zero.
    """
    bins = levels.level.size
    width = np.arange(bins + 1) - np.arange(bins)[:, np.newaxis]
    return _models(_scaled(levels), np.argwhere(width >= LEAST_BINS), _MASKS)


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
    of_bins = ("shape", "chance", "low_passed", "laws")
    some = replace(scaled, **{name: getattr(scaled, name)[inside] for name in of_bins})
    bands = np.array([[0, some.shape.size]])
    masks = [one for one in _MASKS if one >> WALK & 1 and not one & ~mask]
    return _models(some, bands[bands[:, 1] >= LEAST_BINS], masks)


def _models(scaled: ScaledLaws, bands: IntegerArray, masks: Sequence[int]) -> BandModels:
    """Fits of bands (bands, 2) with choices of terms."""

    def order(mask: int) -> tuple[bool, int]:
        return mask >= 1 << FALL, mask.bit_count()

    fits: list[BandModels] = []
    lightest = math.inf
    # Without a low-pass and the fewest terms first: what weighs nothing beside is not finished.
    for size, alike in groupby(sorted(masks, key=order), key=order):
        fits.append(_models_of_size(scaled, bands, list(alike), size[1], lightest))
        lightest = min(lightest, -2.0 * float(fits[-1].logarithm.max(initial=-math.inf)))
    names = [item.name for item in fields(BandModels)]
    joined = {name: np.concatenate([getattr(one, name) for one in fits]) for name in names}
    return BandModels(**joined)


def _models_of_size(
    scaled: ScaledLaws, bands: IntegerArray, masks: list[int], size: int, lightest: float
) -> BandModels:
    """Fits with choices of one number of terms.

    Models with a coefficient at or below zero are those with fewer terms and are left out, and so
    are bands that reach to where a low-pass leaves less than 1/2.5 and Q behind it is not the most
    of what is there: how far a filter of another kind falls is not known.
    """
    columns = np.array([np.flatnonzero(mask >> np.arange(_COLUMNS) & 1) for mask in masks])
    bands = bands[bands[:, 1] - bands[:, 0] > size]
    # The least that the bins outside may cost: all above the band are lower than N.
    above = np.append(np.cumsum(1.0 + scaled.chance[::-1])[::-1], 0.0)
    outside = 2.0 * bands[:, 0] + above[bands[:, 1]]
    bands, outside = (one[outside <= lightest + _HOPELESS] for one in (bands, outside))
    mask, columns = np.repeat(masks, len(bands)), np.repeat(columns, len(bands), axis=0)
    bands = np.tile(bands, (len(masks), 1))
    hopeless = lightest + _HOPELESS - np.tile(outside, len(masks))
    deviance, squares, covariance = fitted_models(scaled, bands, columns, hopeless)
    row = np.arange(mask.size)[:, np.newaxis]
    placed, spread = np.zeros((mask.size, _COLUMNS)), np.zeros((mask.size, _COLUMNS, _COLUMNS))
    placed[row, columns] = squares
    spread[row[..., np.newaxis], columns[:, :, np.newaxis], columns[:, np.newaxis]] = covariance
    stands = np.isfinite(deviance) & (squares > 0.0).all(axis=1)
    stands[stands] = _is_shallow(scaled, bands[stands], placed[stands])
    bands, mask, placed = bands[stands], mask[stands], placed[stands]
    outside = _outside(scaled, bands, placed[:, WALK])
    return BandModels(
        first=bands[:, 0],
        last=bands[:, 1],
        mask=mask,
        ruled=_ruled(scaled, bands, placed),
        deviance=deviance[stands],
        squares=placed / scaled.scale,
        covariance=spread[stands] / (scaled.scale[:, np.newaxis] * scaled.scale),
        # Flicker seldom has another slope than 1/f: this law is priced as two more terms.
        logarithm=-0.5 * (deviance[stands] + outside) - size - 2 * (mask >> GENTLE & 1),
    )


def fitted_models(
    scaled: ScaledLaws, bands: IntegerArray, columns: IntegerArray, hopeless: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Fisher scoring of many models at once, from least squares on relative residuals.

    Parameters
    ----------
    scaled
        Laws and shapes.
    bands, columns
        (models, 2) and (models, terms).
    hopeless
        (models,) deviance above which a model is given up after a few steps: it has no weight, and
        scoring takes long if a law does not describe its bins.

    Returns
    -------
    deviance, squares, covariance
        (models,), infinite if there is no fit; (models, terms); (models, terms, terms).
    """
    squares = np.zeros(columns.shape)
    # The highest Q that no level lies below, and a fall of some depth at the top of the band: from
    # 10 to 1000 nearly the same fits are reached, tried behind filters of 2 to 50 Hz and none.
    behind = (columns[:, 0] == QUANTIZATION) & (columns[:, -1] >= FALL)
    laws = np.vstack([scaled.laws, np.zeros((1, scaled.laws.shape[1]))])
    squares[behind, 0] = 1.0 / np.maximum.reduceat(laws[:, 0], bands.ravel())[::2][behind]
    squares[behind, -1] = 30.0 / scaled.laws[bands[behind, 1] - 1, columns[behind, -1]]
    _, information, vector = _scored(scaled, bands, columns, squares, begun=False)
    information[behind, 0] = information[behind, :, 0] = 0.0
    information[behind, 0, 0], vector[behind, 0] = 1.0, squares[behind, 0]
    squares[:] = 0.0
    deviance, reached = np.full((2, len(columns)), math.inf)
    covariance, settled = np.zeros_like(information), np.zeros(len(columns), dtype=np.bool_)
    # Each band by itself: of a law that falls by sixteen decades, differences of sums are zero.
    typical = np.add.reduceat(laws, bands.ravel(), axis=0)[::2] / np.diff(bands)
    least = 1e-3 / np.take_along_axis(typical, columns, axis=1)
    running = np.arange(len(columns))
    for step in range(_MOST_STEPS + 1):
        inverse, regular = _inverted(information[running])
        ended = settled[running] | (step == _MOST_STEPS)
        reached[running[regular & ended]] = deviance[running[regular & ended]]
        covariance[running] = inverse
        going = regular & ~ended
        if step == 5:
            going &= deviance[running] <= hopeless[running]
        running = rows = running[going]
        target = np.einsum("nij,nj->ni", inverse[going], vector[running])
        settled[running] = True
        for halvings in range(8):
            trial = squares[rows] + 0.5**halvings * (target - squares[rows])
            if step == 0 and halvings:
                # Least squares with large residuals may fall below zero.
                trial = np.maximum(target, least[rows])
            outcome, *others = _scored(scaled, bands[rows], columns[rows], trial, begun=True)
            lower = (outcome <= deviance[rows] + 1e-9) & np.isfinite(outcome)
            lowered = rows[lower]
            settled[lowered] = deviance[lowered] - outcome[lower] < 1e-3
            squares[lowered], deviance[lowered] = trial[lower], outcome[lower]
            information[lowered], vector[lowered] = (each[lower] for each in others)
            rows, target = rows[~lower], target[~lower]
            if not rows.size:
                break
        running = running[np.isfinite(deviance[running])]
        if not running.size:
            break
    return reached, squares, covariance


def _scored(
    scaled: ScaledLaws, bands: IntegerArray, columns: IntegerArray, squares: FloatArray, begun: bool
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Deviance, information and its product with the next squares: see `score_bands`."""
    models, terms = columns.shape
    result = np.zeros(models), np.zeros((models, terms, terms)), np.zeros((models, terms))
    score_bands(scaled.shape, scaled.laws, FALL, bands, columns, squares, begun, *result)
    information = result[1]
    information += np.tril(information, -1).swapaxes(1, 2)
    return result


def _inverted(matrices: FloatArray) -> tuple[FloatArray, BooleanArray]:
    """Inverses of small symmetric matrices (Gauss-Jordan), and which of them are not singular."""
    inverse = np.moveaxis(matrices, 0, -1).copy()
    regular = np.ones(len(matrices), dtype=np.bool_)
    for row in range(len(inverse)):
        pivot = inverse[row, row].copy()
        # Relative: far above a roll-off the laws are millions of times the levels.
        regular &= pivot > 1e-13 * matrices[:, row, row]
        pivot[~regular] = 1.0
        scaled, factor = inverse[row] / pivot, inverse[:, row].copy()
        scaled[row], factor[row] = 1.0 / pivot, 0.0
        inverse[:, row] = 0.0
        inverse -= factor[:, np.newaxis] * scaled
        inverse[row] = scaled
    return np.moveaxis(inverse, -1, 0), regular


def _is_shallow(scaled: ScaledLaws, bands: IntegerArray, squares: FloatArray) -> BooleanArray:
    """(models,) those of which Q is the most of every bin that a low-pass lowers below 1/2.5.

    Q beside a fall has to rise above N at the top of the band: a smaller Q and a fall cancel out.
    """
    bins = np.arange(scaled.shape.size)
    filtered, readout, divisor = _parts(scaled, squares)
    inside = (bins >= bands[:, :1]) & (bins < bands[:, 1:])
    deep = (inside & (divisor > 2.5) & (filtered > readout)).any(axis=1)
    row, top = np.arange(len(bands)), bands[:, 1] - 1
    walk = squares[:, WALK] * scaled.laws[top, WALK]
    faint = (divisor[row, top] > 1.0) & (squares[:, QUANTIZATION] > 0.0)
    faint &= readout[row, top] < walk
    return np.asarray(~(deep | faint))


def _ruled(scaled: ScaledLaws, bands: IntegerArray, squares: FloatArray) -> IntegerArray:
    """(models,) bins in which N is half of the sum or more, and falls by 0.3 or less."""
    bins = np.arange(scaled.shape.size)
    filtered, readout, divisor = _parts(scaled, squares)
    walk = np.outer(squares[:, WALK], scaled.laws[:, WALK]) / divisor
    rules = (walk >= 0.5 * (filtered + readout)) & (divisor <= 1.4)
    rules &= (bins >= bands[:, :1]) & (bins < bands[:, 1:])
    return np.asarray(rules.sum(axis=1))


def _parts(scaled: ScaledLaws, squares: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """(models, bins) N, B and K behind the low-pass, Q, and the divisor of the low-pass."""
    divisor = 1.0 + squares[:, FALL:] @ scaled.laws[:, FALL:].T
    filtered = squares[:, WALK:FALL] @ scaled.laws[:, WALK:FALL].T / divisor
    readout = np.outer(squares[:, QUANTIZATION], scaled.laws[:, QUANTIZATION])
    return filtered, readout, divisor


def _outside(scaled: ScaledLaws, bands: IntegerArray, walk: FloatArray) -> FloatArray:
    """(models,) what the bins outside of each band cost."""
    bins, mean = np.arange(scaled.shape.size), np.outer(walk, scaled.laws[:, WALK])
    below, above = bins < bands[:, :1], bins >= bands[:, 1:]
    # Levels are one.
    mean, passed = np.maximum(mean, 1.0), scaled.low_passed[bands[:, 1:] - 1]
    lacking = 2.0 * scaled.shape * (1.0 / mean - 1.0 + np.log(mean))
    fallen = (mean > _FALLEN) & passed
    cost = below * (2.0 + lacking) + above * np.where(fallen, 1.0 + scaled.chance, 2.0)
    return np.asarray(cost.sum(axis=1))
