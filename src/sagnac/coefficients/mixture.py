"""Value and interval of one coefficient over models of different weight."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.special import gammaincc, ndtr

from sagnac.arrays import FloatArray
from sagnac.coefficients.band_models import BandModels

# Variance of a model's value over that of its fit, measured on the gallery of troublesome gyros:
# its band was chosen with the same data.
_WIDER: Final = 1.1
# Shapes from which on the gamma law is normal in its cube root.
_NORMAL: Final = 3000.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Interval:
    """Value, low and high of a coefficient, SI."""

    value: float
    low: float
    high: float

    def __post_init__(self) -> None:
        if not 0.0 <= self.low <= self.value <= self.high:
            raise ValueError(f"value {self.value} must lie within [{self.low}, {self.high}]")


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
