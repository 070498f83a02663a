"""N, Q, B and K averaged over every band and every choice of terms.

The answer averages the models in which N rules three bins or more (`band_models` fits and weights
them); its variance is the mean of the variances plus the scatter of the means, and its interval is
of quantiles of the mixture. How a likelihood fit stands beside it, `whole_band` says.

Every fit allows each bin a relative error of 3 % beside chance (`band_models.FLOOR`): without it
the thousands of cells of the highest bins would outweigh all the others. Where levels follow a law
more closely than that, the fits err less than they allow for. Their weights stay, and their
variance becomes what the levels show: ``H^-1 M H^-1`` (Huber, Proc. Fifth Berkeley Symp. 1, 221,
1967), H being the information that a fit used and M that of the errors found.

A band of few bins shows its error poorly. If one fit of ten bins were all there is, its interval
would hold in 93 to 94 of 100, and of four bins in 89; the scatter between models makes up for that.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np
from scipy.optimize import brentq
from scipy.special import chdtri, expit, gammaincc, logsumexp, ndtr, ndtri

from sagnac.core.arrays import BooleanArray, FloatArray
from sagnac.noise.band_models import (
    FALL,
    FLOOR,
    LIGHT,
    ORDERS,
    BandModel,
    BandModels,
    band_models,
    bin_shapes,
)
from sagnac.noise.bounds import highest_coefficient
from sagnac.noise.estimates import Estimate, Interval, Status, unobserved
from sagnac.noise.laws import (
    COEFFICIENT_NAMES,
    STOCHASTIC_NAMES,
    SYMBOLS,
    CoefficientName,
    level_laws,
)
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


# Bins in which N has to be half of the spectrum or more.
RULED: Final = 3
# A model without the rule of N over the same bins that weighs this much more makes N a bound.
_NOT_RULED: Final = 20.0
# Share of the weight that needs a term for the term to be called estimated.
_NEEDED: Final = 0.95
# Factor by which N of a model is another N, and share of the weight from which on it is told of:
# that of one tail of an interval.
_ANOTHER: Final = 2.0
_TOLD: Final = 0.02


@dataclass(frozen=True, slots=True, kw_only=True)
class Elsewhere:
    """Models that read another N than the average, by a factor of two or more.

    Attributes
    ----------
    low, high
        Band of the heaviest of them, Hz.
    share
        Of the weight, of all of them.
    walk
        N of the heaviest, rad/sqrt(s).
    """

    low: float
    high: float
    share: float
    walk: float


@dataclass(frozen=True, slots=True, kw_only=True)
class ModelChoice:
    """Basis of an average.

    Attributes
    ----------
    band_hz
        Lowest and highest frequency of the heaviest model, Hz; NaN if there is none.
    terms
        Of the heaviest model.
    mask
        Bits of the terms of the heaviest model, its fall included.
    share
        Share of the weight that models of these very terms hold, over all their bands.
    falls
        Share of the weight of models in which N falls towards the top of the band, as under the
        beginning of a low-pass.
    slow_terms
        ``low band`` if B and K are of a likelihood fit to the lowest frequencies beside an
        average.
    low_band_hz
        Highest frequency of that fit; NaN without it.
    member
        ``average``, ``whole band``, or ``both`` if the levels neither bear out nor reject the
        likelihood of the whole band: its value, and an interval that holds the average's, too.
    law
        Of the heaviest model, or of the whole band; None if there is none.
    elsewhere
        Models that read another N; None if they hold next to no weight.
    """

    band_hz: tuple[float, float] = (math.nan, math.nan)
    terms: tuple[CoefficientName, ...] = ()
    mask: int = 0
    share: float = 0.0
    falls: float = 0.0
    slow_terms: Literal["average", "whole band", "low band"] = "average"
    low_band_hz: float = math.nan
    member: Literal["average", "whole band", "both"] = "average"
    law: BandModel | None = None
    elsewhere: Elsewhere | None = None

    def in_words(self) -> str:
        """One phrase for a person: ``0.01 to 4 Hz with N, B (93 % of the weight)``."""
        if not self.terms:
            return "no band in which the angle random walk rules"
        letters = ", ".join(SYMBOLS[name] for name in self.terms)
        low, high = self.band_hz
        if self.member == "whole band":
            return f"the whole band to {high:.3g} Hz, which {letters} describe"
        average = (
            f"{low:.3g} to {high:.3g} Hz with {letters} ({100.0 * self.share:.0f} % of the weight)"
        )
        return f"the whole band, and {average}" if self.member == "both" else average


@dataclass(frozen=True, slots=True, kw_only=True)
class Average:
    """Result of the average, and its basis.

    Attributes
    ----------
    coefficients
        By name, all five, SI.
    rests_on
        Band, terms, share.
    names, covariance
        Terms that are estimated and the covariance of their values, SI.
    models
        All that matter.
    relied
        Those that N is read by, else all, the heaviest first.
    """

    coefficients: Mapping[CoefficientName, Estimate]
    rests_on: ModelChoice
    names: tuple[CoefficientName, ...]
    covariance: FloatArray
    models: BandModels
    relied: BandModels

    def __post_init__(self) -> None:
        if set(self.coefficients) != set(COEFFICIENT_NAMES):
            raise ValueError(f"coefficients has {', '.join(self.coefficients)}; give all five")
        if self.covariance.shape != (len(self.names), len(self.names)):
            raise ValueError(f"covariance has shape {self.covariance.shape}, names {self.names}")
        self.covariance.flags.writeable = False

    @property
    def angle_random_walk(self) -> Estimate:
        """N."""
        return self.coefficients["angle_random_walk"]

    def with_coefficients(self, coefficients: Mapping[CoefficientName, Estimate]) -> "Average":
        """The same with other estimates; the covariance is of those that are still estimated."""
        names = tuple(name for name in self.names if coefficients[name].status == "estimated")
        kept = [self.names.index(name) for name in names]
        covariance = self.covariance[np.ix_(kept, kept)].copy()
        return replace(self, coefficients=coefficients, names=names, covariance=covariance)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Evidence:
    """Input that all steps of an average look at."""

    levels: Levels
    laws: FloatArray
    models: BandModels
    confidence: float

    def estimate(
        self, name: CoefficientName, status: Status, value: float, low: float, high: float
    ) -> Estimate:
        """At the confidence asked for."""
        return Estimate(
            value=value, low=low, high=high, confidence=self.confidence, status=status, name=name
        )

    def bounded(self, name: CoefficientName) -> Estimate:
        """The largest coefficient that the levels below any roll-off allow."""
        law = self.laws[:, STOCHASTIC_NAMES.index(name)]
        bound = highest_coefficient(self.levels, law, self.confidence)
        if not math.isfinite(bound):
            return unobserved(name, self.confidence)
        return self.estimate(name, "upper bound", bound, 0.0, bound)

    def estimated(self, name: CoefficientName, models: BandModels) -> Estimate:
        """By the mixture of models that hold the term, with the errors that the levels show."""
        error = error_of_bins(self.levels, self.laws, models)
        models = with_error_of_bins(self.levels, self.laws, models, error)
        found = mixture(models, STOCHASTIC_NAMES.index(name), self.confidence)
        return self.estimate(name, "estimated", found.value, found.low, found.high)


def average(
    levels: Levels,
    *,
    confidence: float = 0.95,
    ramp: Estimate | None = None,
) -> Average:
    """Average N and the other coefficients over all models.

    Parameters
    ----------
    levels
        Robust levels of the spectrum.
    confidence
        Of every interval and bound.
    ramp
        The rate ramp, rad/s^2; None if it was not looked for.

    Returns
    -------
    Average
        With all five names.

    Raises
    ------
    ValueError
        If an argument makes no sense.
    """
    models = band_models(levels)
    evidence = _Evidence(
        levels=levels,
        laws=level_laws(levels),
        models=models.kept(models.logarithm > math.log(LIGHT) - 60.0),
        confidence=confidence,
    )
    ruling = (evidence.models.ruled >= RULED) & _unrivalled(evidence.models, levels.level.size)
    answering = evidence.models.kept(ruling).heaviest()
    relied = answering if answering.count else evidence.models.heaviest()
    coefficients = {name: _term(evidence, name) for name in STOCHASTIC_NAMES}
    coefficients["angle_random_walk"] = (
        evidence.estimated("angle_random_walk", answering)
        if answering.count
        else evidence.bounded("angle_random_walk")
    )
    coefficients["rate_ramp"] = ramp or unobserved("rate_ramp", confidence)
    names = estimated_names(coefficients)
    return Average(
        coefficients={name: coefficients[name] for name in COEFFICIENT_NAMES},
        rests_on=_choice(answering, levels),
        names=names,
        covariance=covariance_of(relied, coefficients, names),
        models=evidence.models,
        relied=relied,
    )


def estimated_names(
    coefficients: Mapping[CoefficientName, Estimate],
) -> tuple[CoefficientName, ...]:
    """Names of the coefficients that are estimated."""
    return tuple(name for name in COEFFICIENT_NAMES if coefficients[name].status == "estimated")


def _unrivalled(models: BandModels, bins: int) -> BooleanArray:
    """Models whose band no model explains nearly as well or better without the rule of N.

    A rival covers the whole band of the model, so that it explains the very plateau: what lies
    elsewhere in the spectrum says nothing of whether there is one.
    """
    rival = np.full((bins + 1, bins + 1), -np.inf)
    other = models.ruled < RULED
    np.maximum.at(rival, (models.first[other], models.last[other]), models.logarithm[other])
    # The best over all bands from no later to no earlier.
    rival = np.maximum.accumulate(rival, axis=0)
    rival = np.maximum.accumulate(rival[:, ::-1], axis=1)[:, ::-1]
    margin = math.log(_NOT_RULED)
    return np.asarray(models.logarithm > rival[models.first, models.last] - margin)


def _need(models: BandModels, name: CoefficientName) -> float:
    """Share of the weight of the models that hold a term."""
    holding = models.holding(STOCHASTIC_NAMES.index(name))
    if holding.all() or not holding.any():
        return float(holding.any())
    logarithm = models.logarithm
    return float(expit(logsumexp(logarithm[holding]) - logsumexp(logarithm[~holding])))


def _term(evidence: _Evidence, name: CoefficientName) -> Estimate:
    """Estimated if the models that need a term hold nearly all the weight, else a bound."""
    if _need(evidence.models, name) < _NEEDED:
        return evidence.bounded(name)
    holding = evidence.models.holding(STOCHASTIC_NAMES.index(name))
    return evidence.estimated(name, evidence.models.kept(holding).heaviest())


def _choice(models: BandModels, levels: Levels) -> ModelChoice:
    """The heaviest band and terms, and the share of weight."""
    if models.count == 0:
        return ModelChoice()
    weight = models.weights
    bands: dict[tuple[int, int], float] = {}
    for first, last, part in zip(models.first, models.last, weight, strict=True):
        bands[int(first), int(last)] = bands.get((int(first), int(last)), 0.0) + float(part)
    first, last = max(bands, key=lambda band: bands[band])
    return ModelChoice(
        band_hz=(float(levels.low[first]), float(levels.high[last - 1])),
        terms=models.terms(0),
        mask=int(models.mask[0]),
        share=float(weight[models.mask == models.mask[0]].sum()),
        falls=float(weight[models.falling].sum()),
        law=models.law(0, levels.spectrum.interval),
        elsewhere=other_walk(models, levels),
    )


def other_walk(models: BandModels, levels: Levels) -> Elsewhere | None:
    """The models whose N is another than that of the average."""
    weight = models.weights
    logarithm = 0.5 * np.log(models.squares[:, STOCHASTIC_NAMES.index("angle_random_walk")])
    another = np.abs(logarithm - weight @ logarithm) > math.log(_ANOTHER)
    # Rounding can lift the sum of all weights above one.
    share = min(1.0, float(weight[another].sum()))
    if share < _TOLD:
        return None
    heaviest = int(np.flatnonzero(another)[np.argmax(weight[another])])
    return Elsewhere(
        low=float(levels.low[models.first[heaviest]]),
        high=float(levels.high[models.last[heaviest] - 1]),
        share=share,
        walk=math.exp(float(logarithm[heaviest])),
    )


def covariance_of(
    models: BandModels,
    coefficients: Mapping[CoefficientName, Estimate],
    names: tuple[CoefficientName, ...],
) -> FloatArray:
    """Covariance of the estimated values: that of the means over models, plus the mean of each.

    The variances are those of the intervals, which may be of a likelihood fit or of other models;
    the correlations are of the models.
    """
    columns = [STOCHASTIC_NAMES.index(name) for name in names if name in STOCHASTIC_NAMES]
    result = np.zeros((len(names), len(names)))
    size = len(columns)
    if columns and models.count:
        weight = models.weights
        jacobian = 0.5 / np.array([coefficients[STOCHASTIC_NAMES[c]].value for c in columns])
        within = np.einsum("m,mij->ij", weight * models.widening, models.covariance)
        within = within[np.ix_(columns, columns)] * jacobian * jacobian[:, np.newaxis]
        values = np.sqrt(models.squares[:, columns])
        apart = values - weight @ values
        result[:size, :size] = within + (apart.T * weight) @ apart
    deviation = np.array([deviation_of(coefficients[name]) for name in names])
    own = np.sqrt(np.diagonal(result))
    scale = np.divide(deviation, own, out=np.zeros(len(names)), where=own > 0.0)
    result = result * scale * scale[:, np.newaxis]
    np.fill_diagonal(result, deviation**2)
    return np.asarray(result)


def deviation_of(estimate: Estimate) -> float:
    """Standard deviation that an interval says."""
    reach = float(ndtri(0.5 + 0.5 * estimate.confidence))
    return 0.5 * (estimate.high - estimate.low) / reach
