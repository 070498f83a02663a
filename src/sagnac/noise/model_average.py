"""N, Q, B and K averaged over every band and every choice of terms.

The answer averages the models in which N rules three bins or more (`band_models` fits and weights
them); its variance is the mean of the variances plus the scatter of the means, and its interval is
of quantiles of the mixture. A likelihood fit of the whole band stands beside it (`whole_band`), if
the levels bear it out.

Every fit allows each bin a relative error of 3 % beside chance (`band_models.FLOOR`): without it
the thousands of cells of the highest bins would outweigh all the others. Where levels follow a law
more closely than that, the fits err less than they allow for. Their weights stay, and their
variance becomes what the levels show: ``H^-1 M H^-1`` (Huber, Proc. Fifth Berkeley Symp. 1, 221,
1967), H being the information that a fit used and M that of the errors found.

A band of few bins shows its error poorly. If one fit of ten bins were all there is, its interval
would hold in 93 to 94 of 100, and of four bins in 89; the scatter between models makes up for that.
"""

import math
from dataclasses import asdict, dataclass, replace
from typing import Final, Literal

import numpy as np
from scipy.optimize import brentq
from scipy.special import chdtri, expit, gammaincc, logsumexp, ndtr, ndtri

from sagnac.core.arrays import BooleanArray, FloatArray
from sagnac.noise import band_models
from sagnac.noise import laws as noise_laws
from sagnac.noise.band_models import FALL, FLOOR, BandModel, BandModels, bin_shapes, gamma_deviance
from sagnac.noise.bounds import highest_coefficient
from sagnac.noise.estimates import Coefficients, Estimate, Interval, unobserved
from sagnac.noise.laws import COEFFICIENT_NAMES, STOCHASTIC_NAMES, CoefficientName, level_laws
from sagnac.noise.slow_laws import WALK
from sagnac.spectrum.levels import Levels


def error_of_bins(levels: Levels, models: BandModels) -> float:
    """Relative error of a bin beside chance, as the heaviest model leaves it.

    At this error the gamma deviance of that model equals the median of its chi-square law.

    Parameters
    ----------
    levels
        Robust levels.
    models
        Of these levels, the heaviest first.

    Returns
    -------
    float
        From 0 to `FLOOR`, which the fits allow for. What goes beyond widens the fits.
    """
    band = slice(int(models.first[0]), int(models.last[0]))
    ratio = models.law(0, levels.spectrum.interval).over(levels)[band]
    median = float(chdtri(max(1, ratio.size - int(models.sizes[0])), 0.5))

    def excess(square: float) -> float:
        return gamma_deviance(bin_shapes(levels, math.sqrt(square))[band], ratio) - median

    if excess(0.0) <= 0.0:
        return 0.0
    if excess(FLOOR**2) > 0.0:
        return FLOOR
    return math.sqrt(brentq(excess, 0.0, FLOOR**2, xtol=1e-16))


def with_error_of_bins(levels: Levels, models: BandModels, error: float) -> BandModels:
    """The models with the covariance that a relative error of the bins beside chance makes.

    Parameters
    ----------
    levels
        Robust levels.
    models
        Of these levels, fitted with the floor.
    error
        Of every bin beside chance.
    """
    bins, laws = np.arange(levels.level.size), band_models.band_laws(levels)
    divisors = band_models.divisor_laws(levels.frequency)
    inside = (bins >= models.first[:, np.newaxis]) & (bins < models.last[:, np.newaxis])
    held = models.mask[:, np.newaxis] >> np.arange(FALL + len(band_models.ORDERS)) & 1 == 1
    # Derivatives of the logarithm of the mean.
    divisor = 1.0 + models.squares[:, FALL:] @ divisors.T
    filtered = models.squares[:, WALK:FALL] @ laws[:, WALK:].T / divisor
    mean = filtered + np.outer(models.squares[:, 0], laws[:, 0])
    slopes = np.concatenate([
        np.broadcast_to(laws[:, :1], (*mean.shape, 1)),
        laws[:, WALK:] / divisor[:, :, np.newaxis],
        -divisors * (filtered / divisor)[:, :, np.newaxis],
    ], axis=2)  # fmt: skip
    slopes /= mean[:, :, np.newaxis]
    slopes *= inside[:, :, np.newaxis] & held[:, np.newaxis, :]
    weight = bin_shapes(levels, FLOOR) ** 2 / bin_shapes(levels, error)
    scatter = slopes.transpose(0, 2, 1) @ (slopes * weight[:, np.newaxis])
    return replace(models, covariance=models.covariance @ scatter @ models.covariance)


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
    # A fit whose error is larger than its value has a shape below one. A law of that shape has no
    # mean, and its upper end lies thousands of times above every level of the spectrum.
    shape = np.clip(shape, 1.0, 1e7)
    low, high = math.log(float(square.min())) - 12.0, math.log(float(square.max())) + 25.0
    # From here on the gamma law is normal in its cube root.
    few = shape < 3000.0
    # Bisection: the distribution is flat between models that lie apart.
    for _ in range(60):
        middle = 0.5 * (low + high)
        ratio = square / math.exp(middle)
        below = np.empty(shape.size)
        below[few] = gammaincc(shape[few], shape[few] * ratio[few])
        root = np.cbrt(ratio[~few]) - (1.0 - 1.0 / (9.0 * shape[~few]))
        below[~few] = ndtr(-root * 3.0 * np.sqrt(shape[~few]))
        low, high = (middle, high) if float(weight @ below) < chance else (low, middle)
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
    # A tenth more than that of its fit, measured on `benchmarks/gallery.py`: the band of a model
    # was chosen with the same data.
    variance = 1.1 * models.covariance[:, column, column] * models.widening
    shape = square**2 / np.maximum(variance, 1e-300)
    tail = 0.5 * (1.0 - confidence)
    value = math.exp(float(weight @ np.log(square)))
    low = min(value, mixture_quantile(tail, square, shape, weight))
    high = max(value, mixture_quantile(1.0 - tail, square, shape, weight))
    return Interval(value=math.sqrt(value), low=math.sqrt(low), high=math.sqrt(high))


# Bins in which N has to be half of the spectrum or more.
RULED: Final = 3
# Of power laws that may explain a plateau.
_SLOPES: Final = (0.5, 0.75, 1.0, 1.25, 1.5)


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
        Lowest and highest frequency of the band that all its models together make the heaviest,
        Hz; NaN if there is none.
    terms
        Of the heaviest model of that band.
    mask
        Bits of the terms of that model, its fall included.
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
        likelihood of the whole band: its value, in an interval of the mixture with the average.
    law
        Of that model, or of the whole band; None if there is none.
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
        letters = ", ".join(noise_laws.SYMBOLS[name] for name in self.terms)
        low, high = self.band_hz
        slow = "" if self.law is None else self.law.slow.in_words()
        with_slow = f", with {slow}" if slow else ""
        if self.member == "whole band":
            return f"the whole band to {high:.3g} Hz, which {letters} describe{with_slow}"
        weight = f"{100.0 * self.share:.0f} % of the weight"
        average = f"{low:.3g} to {high:.3g} Hz with {letters}{with_slow} ({weight})"
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
    covariance
        Of the values of `names`, SI.
    models
        All that matter.
    relied
        Those that N is read by, else all, the heaviest first.
    """

    coefficients: Coefficients
    rests_on: ModelChoice
    covariance: FloatArray
    models: BandModels
    relied: BandModels

    @property
    def names(self) -> tuple[CoefficientName, ...]:
        """Those of the coefficients that are estimated."""
        return estimated_names(self.coefficients)

    @property
    def angle_random_walk(self) -> Estimate:
        """N."""
        return self.coefficients["angle_random_walk"]

    def with_coefficients(self, coefficients: Coefficients) -> "Average":
        """The same with other estimates; the covariance is of those that are still estimated."""
        places = [self.names.index(name) for name in estimated_names(coefficients)]
        covariance = self.covariance[np.ix_(places, places)].copy()
        return replace(self, coefficients=coefficients, covariance=covariance)


def estimated_names(coefficients: Coefficients) -> tuple[CoefficientName, ...]:
    """Names of the coefficients that are estimated."""
    return tuple(name for name in COEFFICIENT_NAMES if coefficients[name].status == "estimated")


def average(levels: Levels, *, confidence: float = 0.95, ramp: Estimate | None = None) -> Average:
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
    models = band_models.band_models(levels)
    lightest = models.logarithm.max(initial=-math.inf) + math.log(band_models.LIGHT) - 60.0
    models = models.kept(models.logarithm > lightest)
    ruled = models.ruled >= RULED
    ahead = models.logarithm - _rivals(models, levels)[models.first, models.last]
    # Those of which a rival weighs 20 times as much do not count, and none do if all have one that
    # weighs as much: N is a bound.
    seen = bool(np.any(ruled & (ahead > 0.0)))
    answering = models.kept(ruled & seen & (ahead > -math.log(20.0))).heaviest()
    relied = answering if answering.count else models.heaviest()
    coefficients = {name: unobserved(name, confidence) for name in COEFFICIENT_NAMES}
    coefficients["rate_ramp"] = ramp or coefficients["rate_ramp"]
    for column, name in enumerate(STOCHASTIC_NAMES):
        holding = models.holding(column)
        # Share of the weight that needs a term for the term to be called estimated.
        needed = _need(models, holding) >= 0.95
        read = answering if column == WALK else models.kept(holding & needed).heaviest()
        coefficients[name] = averaged(levels, column, read, confidence)
    return Average(
        coefficients=coefficients,
        rests_on=_choice(answering, levels),
        covariance=covariance_of(relied, coefficients),
        models=models,
        relied=relied,
    )


def averaged(levels: Levels, column: int, models: BandModels, confidence: float) -> Estimate:
    """One coefficient by models that hold it; without one, the largest that the levels allow.

    Models have the errors that the levels show.

    Parameters
    ----------
    levels
        Robust levels.
    column
        Of the coefficient among Q, N, B, K.
    models
        Of these levels, the heaviest first.
    confidence
        Of the interval or bound.
    """
    nothing = unobserved(STOCHASTIC_NAMES[column], confidence)
    if models.count == 0:
        bound = highest_coefficient(levels, level_laws(levels)[:, column], confidence)
        return nothing.bounded(bound) if math.isfinite(bound) else nothing
    spread = with_error_of_bins(levels, models, error_of_bins(levels, models))
    return replace(nothing, **asdict(mixture(spread, column, confidence)), status="estimated")


def _rivals(models: BandModels, levels: Levels) -> FloatArray:
    """(bins + 1, bins + 1) weight of the best model without the rule of N, by first and last bin.

    A rival covers the whole band of a model, so that it explains the very plateau: what lies
    elsewhere in the spectrum says nothing of whether there is one. One power law is a rival, too.
    """
    rival = _power_laws(levels)
    other = models.ruled < RULED
    np.maximum.at(rival, (models.first[other], models.last[other]), models.logarithm[other])
    # The best over all bands from no later to no earlier.
    rival = np.maximum.accumulate(rival, axis=0)
    return np.asarray(np.maximum.accumulate(rival[:, ::-1], axis=1)[:, ::-1])


def _power_laws(levels: Levels) -> FloatArray:
    """(bins + 1, bins + 1) weight of the best power law over each band, with two terms each.

    From f^-0.5, since one that is nearly white is white noise, to f^-1.5.
    """
    bins, shape = levels.level.size, bin_shapes(levels, FLOOR)
    weight = np.full((bins + 1, bins + 1), -np.inf)
    for slope in _SLOPES:
        ratio = levels.level * levels.frequency**slope
        for first in range(bins):
            own, here = shape[first:], ratio[first:]
            total = np.cumsum(own)
            deviance = total * np.log(np.cumsum(own * here) / total) - np.cumsum(own * np.log(here))
            left_out = bins - np.arange(1, bins - first + 1)
            better = np.maximum(weight[first, first + 1 :], -deviance - 2.0 - left_out)
            weight[first, first + 1 :] = better
    return weight


def _need(models: BandModels, holding: BooleanArray) -> float:
    """Share of the weight of the models that hold a term."""
    if holding.all() or not holding.any():
        return float(holding.any())
    logarithm = models.logarithm
    return float(expit(logsumexp(logarithm[holding]) - logsumexp(logarithm[~holding])))


def _choice(models: BandModels, levels: Levels) -> ModelChoice:
    """The band of most weight and the heaviest of its models, with its share of the weight."""
    if models.count == 0:
        return ModelChoice()
    weight = models.weights
    bands = np.zeros((levels.level.size, levels.level.size + 1))
    np.add.at(bands, (models.first, models.last), weight)
    first, last = np.unravel_index(int(np.argmax(bands)), bands.shape)
    heaviest = int(np.argmax((models.first == first) & (models.last == last)))
    return ModelChoice(
        band_hz=(float(levels.low[first]), float(levels.high[last - 1])),
        terms=models.terms(heaviest),
        mask=int(models.mask[heaviest]),
        share=float(weight[models.mask == models.mask[heaviest]].sum()),
        falls=float(weight[models.falling].sum()),
        law=models.law(heaviest, levels.spectrum.interval),
        elsewhere=other_walk(models, levels),
    )


def other_walk(models: BandModels, levels: Levels) -> Elsewhere | None:
    """The models whose N is another than that of the average."""
    weight = models.weights
    logarithm = 0.5 * np.log(models.squares[:, WALK])
    another = np.abs(logarithm - weight @ logarithm) > math.log(2.0)
    # Rounding can lift the sum of all weights above one.
    share = min(1.0, float(weight[another].sum()))
    # Less than one tail of an interval is not told of.
    if share < 0.02:
        return None
    heaviest = int(np.flatnonzero(another)[np.argmax(weight[another])])
    low, high = levels.low[models.first[heaviest]], levels.high[models.last[heaviest] - 1]
    walk = math.exp(float(logarithm[heaviest]))
    return Elsewhere(low=float(low), high=float(high), share=share, walk=walk)


def covariance_of(models: BandModels, coefficients: Coefficients) -> FloatArray:
    """Covariance of the estimated values: that of the means over models, plus the mean of each.

    The variances are those of the intervals, which may be of a likelihood fit or of other models;
    the correlations are of the models.
    """
    names = estimated_names(coefficients)
    columns = [STOCHASTIC_NAMES.index(name) for name in names if name in STOCHASTIC_NAMES]
    result, size = np.zeros((len(names), len(names))), len(columns)
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
    return 0.5 * (estimate.high - estimate.low) / float(ndtri(0.5 + 0.5 * estimate.confidence))
