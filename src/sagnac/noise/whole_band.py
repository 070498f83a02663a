"""A likelihood fit of five terms to the whole band beside the average over bands and terms.

It is more precise if five terms describe the noise, so that the levels of the spectrum are asked
whether they bear it out (`with_whole_band`). B and K of an average may be of a fit to the lowest
frequencies (`with_slow_terms`), and slow noise need not be 1/f and 1/f^2 (`with_slow_laws`).
"""

import math
from dataclasses import replace
from typing import Final, NamedTuple

import numpy as np
from scipy.optimize import brentq
from scipy.special import chdtri, gammainc, gammaincc, ndtr, ndtri

from sagnac.core.arrays import FloatArray
from sagnac.noise import model_average
from sagnac.noise.band_models import (
    FLOOR,
    GENTLE,
    BandModel,
    BandModels,
    bin_shapes,
    gamma_deviance,
    models_of_one_band,
)
from sagnac.noise.estimates import USUAL_CONFIDENCE, Estimate, Fit, FitBand
from sagnac.noise.laws import COEFFICIENT_NAMES, STOCHASTIC_NAMES
from sagnac.noise.model_average import Average, covariance_of, deviation_of, mixture_quantile
from sagnac.noise.slow_laws import FLICKER, PLAIN, QUANTIZATION, RATE_WALK, WALK, SlowLaws
from sagnac.spectrum.levels import Levels


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
# Logarithm of the weight by which a fall with a readout behind it has to outweigh the fit: of a
# hundred recordings of N and Q alone one did, of gyros behind a low-pass most do.
_BENT: Final = 1.5
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
    neither borne out nor rejected. It is rejected if a low-pass with Q of a readout behind it
    outweighs it by more than e^1.5.

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
    whole = models_of_one_band(levels, (0.0, math.inf), (1 << GENTLE) - 1).heaviest()
    if (
        band is None
        or not band.is_whole
        or not band.low <= levels.frequency[0] <= levels.frequency[-1] <= band.high
        or fit.departure != 0.0
        or fitted.status != "estimated"
        or not (whole.count and models.count)
    ):
        return average
    if walk.status == "estimated" and walk.confidence != USUAL_CONFIDENCE:
        walk = model_average.averaged(levels, WALK, average.relied, USUAL_CONFIDENCE)
    outdone = float(models.logarithm.max() - whole.logarithm[0])
    law, surely, barely = whole.law(0, levels.spectrum.interval), _SURELY, _BARELY
    ratio, terms = law.over(levels), int(whole.sizes[0])
    fit = with_slow_laws(fit)
    fitted = fit.coefficients["angle_random_walk"]
    other = _other_law(fit)
    if other is not None:
        law, terms, shape = other, GENTLE + 1, bin_shapes(levels, FLOOR)
        outdone += 1.0 - 0.5 * gamma_deviance(shape, ratio)
        ratio = law.over(levels)
        outdone += 0.5 * gamma_deviance(shape, ratio)
        # The average knows of no such law, and lies apart for that.
        surely = surely._replace(apart=_OF_OTHER_LAWS if outdone > 0.0 else math.inf)
        barely = barely._replace(apart=math.inf)
    # What falls behind a low-pass, down to a readout, may be taken for a slow law of some corner.
    bent = models.falling & models.holding(QUANTIZATION) & (models.last == levels.level.size)
    if models.logarithm[bent].max(initial=-math.inf) > models.logarithm.max() - outdone + _BENT:
        return average

    def passes(test: _Strictness) -> bool:
        within = outdone <= test.outdone and _agrees(fitted, walk, test.apart)
        return within and describes(levels.shape, ratio, ratio.size - terms, test.chance)

    if passes(surely):
        return _of_whole_band(average, fit, band, whole)
    if walk.status == "estimated" and passes(barely):
        return with_both(average, fit)
    return average


def with_slow_laws(fit: Fit) -> Fit:
    """A fit with estimates, intervals and bounds of slow noise whose law is not known.

    Value and both ends of an interval move as the mixture of the laws moves them. B and K are of
    those laws in which they are what their name says. If these hold less than half of the weight,
    or Q, B or K is not needed in half of them, what was estimated is a bound.

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
        if one.status == "estimated" and (column == WALK or present >= 0.5):
            coefficients[name] = _moved(one, slow, column)
        elif one.status != "not observable":
            weight = weight / weight.sum()
            # A term that is less than three errors above zero is doubted. Its bound lies three
            # errors above its value.
            doubted = one.status == "estimated"
            chance = float(ndtr(3.0)) if doubted else max(one.confidence, 0.5)
            # Squares may be negative.
            highest = _normal_quantile(chance, square, error, weight)
            highest = max(highest, 3.0 * float(weight @ error))
            # A bound is no lower than what would have been estimated: K is doubted where chance
            # made it low.
            would_be = _moved(one, slow, column) if doubted else one
            coefficients[name] = one.bounded(max(would_be.high, math.sqrt(highest)))
    return replace(fit, coefficients=coefficients)


def _moved(one: Estimate, slow: SlowLaws, column: int) -> Estimate:
    """An estimate of the first law, moved as the mixture of those that hold it moves it."""
    rows = slow.holding(column) & (slow.squares[:, column] > 0.0) & (slow.weight > 0.0)
    of_all, first = slow.squares[:, column], slow.squares[:1, column]
    if not first[0] > 0.0 or not rows.any():
        return one
    error, weight = slow.errors[:, column], slow.weight[rows] / slow.weight[rows].sum()

    def end(chance: float, squares: FloatArray, of_first: float) -> float:
        shapes = (squares / error) ** 2
        mixed = mixture_quantile(chance, squares[rows], shapes[rows], weight)
        # The profile of a law that is out of the question says nothing of the others.
        if slow.weight[0] < 1e-6:
            return math.sqrt(mixed)
        alone = mixture_quantile(chance, squares[:1], shapes[:1], np.ones(1))
        return of_first * math.sqrt(mixed / alone)

    tail = 0.5 * (1.0 - one.confidence)
    value = one.value * math.exp(0.5 * float(weight @ np.log(of_all[rows] / first)))
    # The upper end of a square that is not seen has no bound under its lopsided law: two errors
    # stand for it.
    low = end(tail, of_all, one.low)
    high = end(1.0 - tail, np.maximum(of_all, 2.0 * error), one.high)
    return replace(one, value=value, low=min(low, value), high=max(high, value))


def _normal_quantile(
    chance: float, value: FloatArray, error: FloatArray, weight: FloatArray
) -> float:
    """Quantile of a mixture of normal laws."""
    low, high = float((value - 10.0 * error).min()), float((value + 10.0 * error).max())

    def excess(place: float) -> float:
        return float(weight @ ndtr((place - value) / error)) - chance

    # Squares in SI units are smaller than any absolute tolerance.
    return float(brentq(excess, low, high, xtol=1e-9 * (high - low)))


def _other_law(fit: Fit) -> BandModel | None:
    """The law that a fit shows in place of 1/f and 1/f^2, if it does."""
    if fit.slow is None or fit.band is None or not fit.slow.seen:
        return None
    row = fit.slow.seen
    squares = tuple(fit.slow.squares[row].tolist())
    return BandModel(squares=squares, interval=fit.band.interval, slow=fit.slow.laws[row])


def _of_whole_band(average: Average, fit: Fit, band: FitBand, whole: BandModels) -> Average:
    """The fit, with the correlations of the average; the terms are of the first of all bins."""
    slow, law = fit.slow, PLAIN
    stochastic = [fit.coefficients[name] for name in STOCHASTIC_NAMES]
    squares = [one.value**2 if one.status == "estimated" else 0.0 for one in stochastic]
    if slow is not None:
        law = slow.laws[slow.seen]
        # The noise is there, whether or not it is known to be B or K.
        for column in (FLICKER, RATE_WALK):
            if slow.seen or (squares[column] == 0.0 and whole.holding(column)[0]):
                squares[column] = max(0.0, float(slow.squares[slow.seen, column]))
    choice = replace(
        average.rests_on,
        band_hz=(band.low, band.high),
        terms=whole.terms(0),
        mask=int(whole.mask[0]),
        slow_terms="whole band",
        member="whole band",
        elsewhere=None,
        law=BandModel(squares=tuple(squares), interval=band.interval, slow=law),
    )
    coefficients = {name: fit.coefficients[name] for name in COEFFICIENT_NAMES}
    covariance = covariance_of(average.relied, coefficients)
    return replace(average, coefficients=coefficients, rests_on=choice, covariance=covariance)


def with_both(average: Average, fit: Fit) -> Average:
    """The value of a likelihood fit of the whole band, in an interval of the mixture of the two.

    Each has half of the weight, and is normal in its logarithm on either side of its value.

    Parameters
    ----------
    average
        With an estimate of N.
    fit
        Of which the levels do not say whether it is right.
    """
    ours, fitted = average.angle_random_walk, fit.coefficients["angle_random_walk"]
    values, tail = np.log([ours.value, fitted.value]), 0.5 - 0.5 * ours.confidence

    def mixed(first: float, second: float, chance: float) -> float:
        errors = np.maximum((np.log([first, second]) - values) / float(ndtri(chance)), 1e-9)
        return math.exp(_normal_quantile(chance, values, errors, np.full(2, 0.5)))

    low = mixed(max(ours.low, 1e-3 * ours.value), fitted.low, tail)
    high = mixed(ours.high, fitted.high, 1.0 - tail)
    both = replace(ours, value=fitted.value, low=low, high=high)
    wider = np.ones(len(average.names))
    wider[average.names.index("angle_random_walk")] = deviation_of(both) / deviation_of(ours)
    coefficients = {**average.coefficients, "angle_random_walk": both}
    choice = replace(average.rests_on, member="both")
    covariance = average.covariance * wider * wider[:, np.newaxis]
    return replace(average, coefficients=coefficients, rests_on=choice, covariance=covariance)


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
    read = {name: fit if name in low_band else average for name in COEFFICIENT_NAMES}
    coefficients = {name: one.coefficients[name] for name, one in read.items()}
    names = model_average.estimated_names(coefficients)
    covariance = np.diag([deviation_of(coefficients[name]) ** 2 for name in names])
    others = [name for name in names if name not in low_band]
    to, of = [names.index(name) for name in others], [average.names.index(name) for name in others]
    covariance[np.ix_(to, to)] = average.covariance[np.ix_(of, of)]
    highest = math.nan if fit.band is None else fit.band.high
    choice = replace(average.rests_on, slow_terms="low band", low_band_hz=highest)
    return replace(average, coefficients=coefficients, rests_on=choice, covariance=covariance)


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
    if np.count_nonzero(used) <= GENTLE or fitted.low > walk.high or fitted.high < walk.low:
        return False
    squares = tuple(fit.squares.get(name, 0.0) for name in STOCHASTIC_NAMES)
    law = _other_law(fit) or BandModel(squares=squares, interval=fit.band.interval)
    mean = law.terms(levels).sum(axis=1)[used]
    if not mean.min() > 0.0:
        return False
    ratio, freedom = levels.level[used] / mean, int(np.count_nonzero(used)) - GENTLE
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
    # The interval may be lopsided: the error is that of the side on which the fit lies.
    end = walk.high if fitted.value >= walk.value else max(walk.low, 1e-3 * walk.value)
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
    total = np.append(0.0, np.cumsum(np.where(ratio > 1.0, -ndtri(upper), ndtri(lower))))
    place = np.arange(total.size)
    length = np.maximum(np.abs(place - place[:, np.newaxis]), 1)
    return float((np.abs(total - total[:, np.newaxis]) / np.sqrt(length)).max())
