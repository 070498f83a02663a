"""Value and interval of one coefficient over models of different weight.

Every fit allows each bin a relative error of 3 % beside chance (`band_models.FLOOR`): without it
the thousands of cells of the highest bins would outweigh all the others. Where levels follow a law
more closely than that, the fits err less than they allow for. Their weights stay, and their
variance becomes what the levels show: ``H^-1 M H^-1`` (Huber, Proc. Fifth Berkeley Symp. 1, 221,
1967), H being the information that a fit used and M that of the errors found.

A band of few bins shows its error poorly. If one fit of ten bins were all there is, its interval
would hold in 93 to 94 of 100, and of four bins in 89; the scatter between models makes up for that.
"""

import math
from dataclasses import replace
from typing import Final

import numpy as np
from scipy.optimize import brentq
from scipy.special import chdtri, gammaincc, ndtr

from sagnac.arrays import FloatArray
from sagnac.coefficients.band_models import FALL, FLOOR, ORDERS, BandModels, bin_shapes
from sagnac.coefficients.estimates import Interval
from sagnac.spectrum.levels import Levels


def error_of_bins(levels: Levels, laws: FloatArray, models: BandModels) -> float:
    """Relative error of a bin beside chance, as the heaviest model leaves it.

    At this error the gamma deviance of that model equals the median of its chi-square law.

    Parameters
    ----------
    levels
        Robust levels.
    laws
        (bins, 4) laws of Q, N, B, K as the levels show them.
    models
        Of these levels, the heaviest first.

    Returns
    -------
    float
        From 0 to `FLOOR`, which the fits allow for. What goes beyond widens the fits.
    """
    band = slice(int(models.first[0]), int(models.last[0]))
    law = models.law(0, levels.spectrum.interval)
    mean = laws @ np.array(law.squares) / law.divisor(levels.frequency)
    ratio = (levels.level / mean)[band]
    distance = 2.0 * (ratio - 1.0 - np.log(ratio))
    freedom = max(1, ratio.size - int(models.sizes[0]))
    median = float(chdtri(freedom, 0.5))

    def excess(square: float) -> float:
        return float(bin_shapes(levels, math.sqrt(square))[band] @ distance) - median

    if excess(0.0) <= 0.0:
        return 0.0
    if excess(FLOOR**2) > 0.0:
        return FLOOR
    return math.sqrt(brentq(excess, 0.0, FLOOR**2, xtol=1e-16))


def with_error_of_bins(
    levels: Levels, laws: FloatArray, models: BandModels, error: float
) -> BandModels:
    """The models with the covariance that a relative error of the bins beside chance makes.

    Parameters
    ----------
    levels, laws
        Robust levels, and (bins, 4) the laws of Q, N, B, K as they show them.
    models
        Of these levels, fitted with the floor.
    error
        Of every bin beside chance.
    """
    bins = np.arange(levels.level.size)
    inside = (bins >= models.first[:, np.newaxis]) & (bins < models.last[:, np.newaxis])
    held = np.stack([models.holding(column) for column in range(FALL + len(ORDERS))], axis=1)
    # Derivatives of the logarithm of the mean.
    sums = models.squares[:, :FALL] @ laws.T
    divisors = levels.frequency[:, np.newaxis] ** (2.0 * np.array(ORDERS))
    divisor = 1.0 + models.squares[:, FALL:] @ divisors.T
    slopes = np.concatenate(
        [laws / sums[:, :, np.newaxis], -divisors / divisor[:, :, np.newaxis]], axis=2
    )
    slopes *= inside[:, :, np.newaxis] & held[:, np.newaxis, :]
    used = bin_shapes(levels, FLOOR)
    weighed = slopes * (used**2 / bin_shapes(levels, error))[:, np.newaxis]
    found = slopes.transpose(0, 2, 1) @ weighed
    return replace(models, covariance=models.covariance @ found @ models.covariance)


# Variance of a model's value over that of its fit, measured on the gallery of troublesome gyros:
# its band was chosen with the same data.
_WIDER: Final = 1.1
# Shapes from which on the gamma law is normal in its cube root.
_NORMAL: Final = 3000.0


def mixture_quantile(
    chance: float, square: FloatArray, shape: FloatArray, weight: FloatArray
) -> float:
    """Quantile of a mixture of inverse-gamma laws of a square.

    A level of gamma shape a and mean m says of m what an inverse-gamma law of shape a says; so
    does a fit of relative variance 1/shape. With few degrees of freedom the quantiles are
    lopsided as they should be.

    Parameters
    ----------
    chance
        Probability below the quantile.
    square, shape, weight
        (models,) value, reciprocal relative variance, and weight, which sums to one.

    Returns
    -------
    float
        In the unit of `square`.
    """
    shape = np.clip(shape, 0.05, 1e7)
    low, high = math.log(float(square.min())) - 12.0, math.log(float(square.max())) + 25.0
    few = shape < _NORMAL
    # Bisection: the distribution is flat between models that lie apart.
    for _ in range(60):
        middle = 0.5 * (low + high)
        ratio = square / math.exp(middle)
        below = np.empty(shape.size)
        below[few] = gammaincc(shape[few], shape[few] * ratio[few])
        root = np.cbrt(ratio[~few]) - (1.0 - 1.0 / (9.0 * shape[~few]))
        below[~few] = ndtr(-root * 3.0 * np.sqrt(shape[~few]))
        if float(weight @ below) < chance:
            low = middle
        else:
            high = middle
    return math.exp(0.5 * (low + high))


def mixture(models: BandModels, column: int, confidence: float) -> Interval:
    """One coefficient over models that hold it.

    Parameters
    ----------
    models
        One or more.
    column
        Of the coefficient among Q, N, B, K.
    confidence
        Of the interval.
    """
    weight = models.weights
    square = models.squares[:, column]
    variance = _WIDER * models.covariance[:, column, column] * models.widening
    shape = square**2 / np.maximum(variance, 1e-300)
    tail = 0.5 * (1.0 - confidence)
    value = math.exp(float(weight @ np.log(square)))
    low = mixture_quantile(tail, square, shape, weight)
    high = mixture_quantile(1.0 - tail, square, shape, weight)
    return Interval(
        value=math.sqrt(value),
        low=math.sqrt(min(low, value)),
        high=math.sqrt(max(high, value)),
    )
