"""N, Q, B and K averaged over every band and every choice of terms.

The answer averages the models in which N rules three bins or more (`band_models` fits and weights
them); its variance is the mean of the variances plus the scatter of the means, and its interval is
of quantiles of the mixture. A likelihood fit of the whole band stands beside it
(`with_whole_band`), if the levels bear it out.

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
from typing import Final, Literal, NamedTuple

import numpy as np
from scipy.optimize import brentq
from scipy.special import chdtri, expit, gammainc, gammaincc, logsumexp, ndtr, ndtri

from sagnac.core.arrays import BooleanArray, FloatArray
from sagnac.noise import band_models
from sagnac.noise.band_models import (
    FALL,
    FLOOR,
    BandModel,
    BandModels,
    bin_shapes,
    gamma_deviance,
)
from sagnac.noise.bounds import highest_coefficient
from sagnac.noise.estimates import Estimate, Fit, FitBand, Interval, unobserved
from sagnac.noise.laws import (
    COEFFICIENT_NAMES,
    STOCHASTIC_NAMES,
    SYMBOLS,
    CoefficientName,
    level_laws,
)
from sagnac.noise.slow_laws import FLICKER, PLAIN, RATE_WALK, WALK, SlowLaws
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
    bins, laws = np.arange(levels.level.size), level_laws(levels)
    divisors = band_models.divisor_laws(levels.frequency)
    inside = (bins >= models.first[:, np.newaxis]) & (bins < models.last[:, np.newaxis])
    held = models.mask[:, np.newaxis] >> np.arange(FALL + len(band_models.ORDERS)) & 1 == 1
    # Derivatives of the logarithm of the mean.
    sums = models.squares[:, :FALL] @ laws.T
    divisor = 1.0 + models.squares[:, FALL:] @ divisors.T
    slopes = np.concatenate(
        [laws / sums[:, :, np.newaxis], -divisors / divisor[:, :, np.newaxis]], axis=2
    )
    slopes *= inside[:, :, np.newaxis] & held[:, np.newaxis, :]
    used = bin_shapes(levels, FLOOR)
    weighed = slopes * (used**2 / bin_shapes(levels, error))[:, np.newaxis]
    found = slopes.transpose(0, 2, 1) @ weighed
    return replace(models, covariance=models.covariance @ found @ models.covariance)


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
# Share of the weight that needs a term for the term to be called estimated.
_NEEDED: Final = 0.95


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
            slow = "" if self.law is None else self.law.slow.in_words()
            with_slow = f", with {slow}" if slow else ""
            return f"the whole band to {high:.3g} Hz, which {letters} describe{with_slow}"
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
    covariance
        Of the values of `names`, SI.
    models
        All that matter.
    relied
        Those that N is read by, else all, the heaviest first.
    """

    coefficients: Mapping[CoefficientName, Estimate]
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

    def with_coefficients(self, coefficients: Mapping[CoefficientName, Estimate]) -> "Average":
        """The same with other estimates; the covariance is of those that are still estimated."""
        kept = [self.names.index(name) for name in estimated_names(coefficients)]
        covariance = self.covariance[np.ix_(kept, kept)].copy()
        return replace(self, coefficients=coefficients, covariance=covariance)


def estimated_names(
    coefficients: Mapping[CoefficientName, Estimate],
) -> tuple[CoefficientName, ...]:
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
    models = models.kept(models.logarithm > math.log(band_models.LIGHT) - 60.0)
    ruling = (models.ruled >= RULED) & _unrivalled(models, levels.level.size)
    answering = models.kept(ruling).heaviest()
    relied = answering if answering.count else models.heaviest()
    coefficients: dict[CoefficientName, Estimate] = {
        "rate_ramp": ramp or unobserved("rate_ramp", confidence)
    }
    for column, name in enumerate(STOCHASTIC_NAMES):
        holding = models.holding(column)
        needed = _need(models, holding) >= _NEEDED
        read = answering if column == WALK else models.kept(holding & needed).heaviest()
        coefficients[name] = _averaged(levels, column, read, confidence)
    return Average(
        coefficients=coefficients,
        rests_on=_choice(answering, levels),
        covariance=covariance_of(relied, coefficients),
        models=models,
        relied=relied,
    )


def _averaged(levels: Levels, column: int, models: BandModels, confidence: float) -> Estimate:
    """One coefficient by models that hold it; without one, the largest that the levels allow.

    Models have the errors that the levels show.
    """
    name = STOCHASTIC_NAMES[column]
    if models.count == 0:
        bound = highest_coefficient(levels, level_laws(levels)[:, column], confidence)
        nothing = unobserved(name, confidence)
        return nothing.bounded(bound) if math.isfinite(bound) else nothing
    spread = with_error_of_bins(levels, models, error_of_bins(levels, models))
    return mixture(spread, column, confidence).of(name, confidence)


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
    # One that weighs 20 times as much makes N a bound.
    return np.asarray(models.logarithm > rival[models.first, models.last] - math.log(20.0))


def _need(models: BandModels, holding: BooleanArray) -> float:
    """Share of the weight of the models that hold a term."""
    if holding.all() or not holding.any():
        return float(holding.any())
    logarithm = models.logarithm
    return float(expit(logsumexp(logarithm[holding]) - logsumexp(logarithm[~holding])))


def _choice(models: BandModels, levels: Levels) -> ModelChoice:
    """The heaviest band and terms, and the share of weight."""
    if models.count == 0:
        return ModelChoice()
    weight = models.weights
    bands = np.zeros((levels.level.size, levels.level.size + 1))
    np.add.at(bands, (models.first, models.last), weight)
    first, last = np.unravel_index(int(np.argmax(bands)), bands.shape)
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
    logarithm = 0.5 * np.log(models.squares[:, WALK])
    another = np.abs(logarithm - weight @ logarithm) > math.log(2.0)
    # Rounding can lift the sum of all weights above one.
    share = min(1.0, float(weight[another].sum()))
    # Less than one tail of an interval is not told of.
    if share < 0.02:
        return None
    heaviest = int(np.flatnonzero(another)[np.argmax(weight[another])])
    return Elsewhere(
        low=float(levels.low[models.first[heaviest]]),
        high=float(levels.high[models.last[heaviest] - 1]),
        share=share,
        walk=math.exp(float(logarithm[heaviest])),
    )


def covariance_of(
    models: BandModels, coefficients: Mapping[CoefficientName, Estimate]
) -> FloatArray:
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
    reach = float(ndtri(0.5 + 0.5 * estimate.confidence))
    return 0.5 * (estimate.high - estimate.low) / reach


# ---- a likelihood fit beside the average --------------------------------------------------


class _Strictness(NamedTuple):
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
# Standard errors by which a fit of another law of slow noise may differ from an average whose
# heaviest model explains the levels better.
_OF_OTHER_LAWS: Final = 6.0


def with_whole_band(levels: Levels, average: Average, fit: Fit) -> Average:
    """An average beside a likelihood fit of five terms to the whole band.

    The heaviest model of all bins has to pass two tests at a chance of 0.02 each, without any
    floor of the errors: its deviance, and the largest mean departure over any run of bins,
    which finds what bends. No model of fewer bins may outweigh it by more than e^3. And the value
    must lie within 1.3 standard errors of the average, or below its bound. A fit that fails
    these, but passes at a chance of 0.001, e^6 and four standard errors from an estimate, is
    neither borne out nor rejected.

    Its Q, N, B and K become those of slow noise whose law is not known (`with_slow_laws`). If the
    fit shows another law than 1/f and 1/f^2, that is tested, and may lie up to six standard errors
    from the average, which knows none, or any number if it outweighs all models of the average.

    Parameters
    ----------
    levels, average
        Of the values that the fit is of.
    fit
        All five terms, at the confidence of the average. It has to use every bin: what it leaves
        out it does not describe.

    Returns
    -------
    Average
        Its member says which: the fit if the levels bear it out, `with_both` if they neither bear
        it out nor reject it, else the average as it is.
    """
    fitted, walk = fit.coefficients["angle_random_walk"], average.angle_random_walk
    models, band = average.models, fit.band
    complete = (models.first == 0) & (models.last == levels.level.size)
    complete &= models.holding(WALK) & ~models.falling
    if (
        band is None
        or not band.is_whole
        or not band.low <= levels.frequency[0] <= levels.frequency[-1] <= band.high
        or fit.departure != 0.0
        or fitted.status != "estimated"
        or not complete.any()
    ):
        return average
    row = int(np.flatnonzero(complete)[np.argmax(models.logarithm[complete])])
    outdone = float(models.logarithm.max() - models.logarithm[row])
    law, surely, barely = models.law(row, levels.spectrum.interval), _SURELY, _BARELY
    ratio, terms = law.over(levels), int(models.sizes[row])
    fit = with_slow_laws(fit)
    fitted = fit.coefficients["angle_random_walk"]
    other = _other_law(fit)
    if other is not None:
        law, terms, shape = other, FALL + 1, bin_shapes(levels, FLOOR)
        outdone += 1.0 - 0.5 * gamma_deviance(shape, ratio)
        ratio = law.over(levels)
        outdone += 0.5 * gamma_deviance(shape, ratio)
        # The average knows of no such law, and lies apart for that.
        surely = surely._replace(apart=_OF_OTHER_LAWS if outdone > 0.0 else math.inf)
        barely = barely._replace(apart=math.inf)
    freedom = ratio.size - terms

    def passes(test: _Strictness) -> bool:
        return (
            outdone <= test.outdone
            and _agrees(fitted, walk, test.apart)
            and describes(levels.shape, ratio, freedom, test.chance)
        )

    if passes(surely):
        return _of_whole_band(average, fit, band, row)
    if walk.status == "estimated" and passes(barely):
        return with_both(average, fit)
    return average


def with_slow_laws(fit: Fit) -> Fit:
    """A fit with estimates, intervals and bounds of slow noise whose law is not known.

    Value and both ends of an interval move as the mixture of the laws moves them. B and K are of
    those laws in which they are what their name says: if these hold less than half of the weight,
    or the term is not needed in half of them, what was estimated is a bound.

    Parameters
    ----------
    fit
        By likelihood; as it is if it sees no slow noise.
    """
    slow = fit.slow
    if slow is None or not slow.weight.any():
        return fit
    coefficients = dict(fit.coefficients)
    for column, name in enumerate(STOCHASTIC_NAMES):
        rows = slow.holding(column) & (slow.weight > 1e-6)
        weight, one = slow.weight[rows], coefficients[name]
        square, error = slow.squares[rows, column], slow.errors[rows, column]
        if not weight.size:
            continue
        present = float(weight @ (square > 3.0 * error))
        if one.status == "estimated" and (column < FLICKER or present >= 0.5):
            coefficients[name] = _moved(one, slow, column)
        elif one.status != "not observable":
            weight = weight / weight.sum()
            # A bound is no lower than what would have been estimated.
            highest = max(
                _highest_square(weight, square, error, one.confidence), 3.0 * float(weight @ error)
            )
            before = one.high if one.status == "upper bound" else 0.0
            coefficients[name] = one.bounded(max(before, math.sqrt(highest)))
    return replace(fit, coefficients=coefficients)


def _moved(one: Estimate, slow: SlowLaws, column: int) -> Estimate:
    """An estimate of the first law, moved as the mixture of those that hold it moves it."""
    rows = slow.holding(column) & (slow.squares[:, column] > 0.0) & (slow.weight > 0.0)
    of_all, first = slow.squares[:, column], slow.squares[:1, column]
    if not first[0] > 0.0 or not rows.any():
        return one
    shapes = (of_all / slow.errors[:, column]) ** 2
    weight, square, shape = slow.weight[rows] / slow.weight[rows].sum(), of_all[rows], shapes[rows]

    def ratio(chance: float) -> float:
        alone = mixture_quantile(chance, first, shapes[:1], np.ones(1))
        return math.sqrt(mixture_quantile(chance, square, shape, weight) / alone)

    tail = 0.5 * (1.0 - one.confidence)
    value = one.value * math.exp(0.5 * float(weight @ np.log(square / first)))
    low, high = one.low * ratio(tail), one.high * ratio(1.0 - tail)
    return replace(one, value=value, low=min(low, value), high=max(high, value))


def _highest_square(
    weight: FloatArray, square: FloatArray, error: FloatArray, confidence: float
) -> float:
    """Quantile of a mixture of normal laws of squares, which may be negative."""
    low, high = float((square - 10.0 * error).min()), float((square + 10.0 * error).max())
    chance = max(confidence, 0.5)

    def excess(place: float) -> float:
        return float(weight @ ndtr((place - square) / error)) - chance

    return float(brentq(excess, low, high))


def _other_law(fit: Fit) -> BandModel | None:
    """The law that a fit shows in place of 1/f and 1/f^2, if it does."""
    if fit.slow is None or fit.band is None or not fit.slow.seen:
        return None
    row = fit.slow.seen
    squares = tuple(fit.slow.squares[row].tolist())
    return BandModel(squares=squares, interval=fit.band.interval, slow=fit.slow.laws[row])


def _of_whole_band(average: Average, fit: Fit, band: FitBand, row: int) -> Average:
    """The fit, with the correlations of the average."""
    models, slow, law = average.models, fit.slow, PLAIN
    stochastic = [fit.coefficients[name] for name in STOCHASTIC_NAMES]
    squares = [one.value**2 if one.status == "estimated" else 0.0 for one in stochastic]
    if slow is not None:
        law = slow.laws[slow.seen]
        # The noise is there, whether or not it is known to be B or K.
        for column in (FLICKER, RATE_WALK):
            if slow.seen or (squares[column] == 0.0 and models.holding(column)[row]):
                squares[column] = max(0.0, float(slow.squares[slow.seen, column]))
    choice = replace(
        average.rests_on,
        band_hz=(band.low, band.high),
        terms=models.terms(row),
        mask=int(models.mask[row]),
        slow_terms="whole band",
        member="whole band",
        elsewhere=None,
        law=BandModel(squares=tuple(squares), interval=band.interval, slow=law),
    )
    return replace(
        average,
        coefficients={name: fit.coefficients[name] for name in COEFFICIENT_NAMES},
        rests_on=choice,
        covariance=covariance_of(average.relied, fit.coefficients),
    )


def with_both(average: Average, fit: Fit) -> Average:
    """The value of a likelihood fit of the whole band, and an interval that holds both.

    Parameters
    ----------
    average
        With an estimate of N.
    fit
        Of which the levels do not say whether it is right.
    """
    ours, fitted = average.angle_random_walk, fit.coefficients["angle_random_walk"]
    low, high = min(ours.low, fitted.low), max(ours.high, fitted.high)
    both = replace(ours, value=fitted.value, low=low, high=high)
    wider = np.ones(len(average.names))
    wider[average.names.index("angle_random_walk")] = deviation_of(both) / deviation_of(ours)
    return replace(
        average,
        coefficients={**average.coefficients, "angle_random_walk": both},
        rests_on=replace(average.rests_on, member="both"),
        covariance=average.covariance * wider * wider[:, np.newaxis],
    )


def with_slow_terms(average: Average, fit: Fit) -> Average:
    """B and K of a fit to the lowest frequencies; the others stay, uncorrelated with these.

    Parameters
    ----------
    average
        With an estimate of N.
    fit
        By likelihood, of what the average is of.
    """
    low_band = ("bias_instability", "rate_random_walk")
    coefficients = {
        name: (fit if name in low_band else average).coefficients[name]
        for name in COEFFICIENT_NAMES
    }
    names = estimated_names(coefficients)
    covariance = np.diag([deviation_of(coefficients[name]) ** 2 for name in names])
    kept = [name for name in names if name not in low_band]
    to, of = [names.index(name) for name in kept], [average.names.index(name) for name in kept]
    covariance[np.ix_(to, to)] = average.covariance[np.ix_(of, of)]
    highest = math.nan if fit.band is None else fit.band.high
    return replace(
        average,
        coefficients=coefficients,
        rests_on=replace(average.rests_on, slow_terms="low band", low_band_hz=highest),
        covariance=covariance,
    )


def levels_bear_out(levels: Levels, fit: Fit, walk: Estimate) -> bool:
    """Whether the levels bear out a fit to the lowest frequencies.

    N of both, interval or bound, has to overlap, and the levels in the band of the fit have to pass
    both tests of `with_whole_band` against its squares at a chance of 0.02.

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
    squares = tuple(fit.squares.get(name, 0.0) for name in STOCHASTIC_NAMES)
    law = _other_law(fit) or BandModel(squares=squares, interval=fit.band.interval)
    mean = law.terms(levels).sum(axis=1)[used]
    if not mean.min() > 0.0:
        return False
    ratio, freedom = levels.level[used] / mean, int(np.count_nonzero(used)) - FALL
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
    within = gamma_deviance(shape, ratio) <= float(chdtri(freedom, chance))
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
