"""A likelihood fit beside the average over bands: whether the levels bear it out, and what then."""

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from scipy.special import gammainc, gammaincc, gammaincinv, ndtri

from sagnac.core.arrays import FloatArray
from sagnac.noise.band_models import FALL, WALK, BandModel
from sagnac.noise.estimates import Estimate, Fit, FitBand
from sagnac.noise.laws import COEFFICIENT_NAMES, STOCHASTIC_NAMES, level_laws
from sagnac.noise.model_average import Average, covariance_of, deviation_of, estimated_names
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
# Terms that a fit to the lowest frequencies may give beside an average.
_LOW_BAND: Final = ("bias_instability", "rate_random_walk")


def with_whole_band(levels: Levels, average: Average, fit: Fit) -> Average:
    """An average beside a likelihood fit of five terms to the whole band.

    The heaviest model of all bins has to pass two tests at a chance of 0.02 each, without any
    floor of the errors: its deviance, and the largest mean departure over any run of bins,
    which finds what bends. No model of fewer bins may outweigh it by more than e^3. And the value
    must lie within 1.3 standard errors of the average, or below its bound. A fit that fails
    these, but passes at a chance of 0.001, e^6 and four standard errors from an estimate, is
    neither borne out nor rejected.

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
    if band is None or not band.is_whole or fit.departure != 0.0 or fitted.status != "estimated":
        return average
    if not (band.low <= levels.frequency[0] and levels.frequency[-1] <= band.high):
        return average
    complete = (models.first == 0) & (models.last == levels.level.size)
    complete &= models.holding(WALK) & ~models.falling
    if not complete.any():
        return average
    row = int(np.flatnonzero(complete)[np.argmax(models.logarithm[complete])])
    outdone = float(models.logarithm.max() - models.logarithm[row])
    ratio = levels.level / (level_laws(levels) @ models.squares[row, :FALL])
    freedom = ratio.size - int(models.sizes[row])

    def passes(test: _Strictness) -> bool:
        return (
            outdone <= test.outdone
            and _agrees(fitted, walk, test.apart)
            and describes(levels.shape, ratio, freedom, test.chance)
        )

    if passes(_SURELY):
        return _of_whole_band(average, fit, band, row)
    if walk.status == "estimated" and passes(_BARELY):
        return with_both(average, fit)
    return average


def _of_whole_band(average: Average, fit: Fit, band: FitBand, row: int) -> Average:
    """The fit, with the correlations of the average."""
    names, models = estimated_names(fit.coefficients), average.models
    stochastic = (fit.coefficients[name] for name in STOCHASTIC_NAMES)
    choice = replace(
        average.rests_on,
        band_hz=(band.low, band.high),
        terms=models.terms(row),
        mask=int(models.mask[row]),
        slow_terms="whole band",
        member="whole band",
        elsewhere=None,
        law=BandModel(
            squares=tuple(one.value**2 if one.status == "estimated" else 0.0 for one in stochastic),
            interval=band.interval,
        ),
    )
    return replace(
        average,
        coefficients={name: fit.coefficients[name] for name in COEFFICIENT_NAMES},
        rests_on=choice,
        names=names,
        covariance=covariance_of(average.relied, fit.coefficients, names),
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
    both = replace(
        ours,
        value=fitted.value,
        low=min(ours.low, fitted.low),
        high=max(ours.high, fitted.high),
    )
    covariance = average.covariance.copy()
    place = average.names.index("angle_random_walk")
    wider = deviation_of(both) / deviation_of(ours)
    covariance[place] *= wider
    covariance[:, place] *= wider
    return replace(
        average,
        coefficients={**average.coefficients, "angle_random_walk": both},
        rests_on=replace(average.rests_on, member="both"),
        covariance=covariance,
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
    coefficients = {
        name: (fit if name in _LOW_BAND else average).coefficients[name]
        for name in COEFFICIENT_NAMES
    }
    names = estimated_names(coefficients)
    covariance = np.diag([deviation_of(coefficients[name]) ** 2 for name in names])
    kept = [name for name in names if name not in _LOW_BAND]
    to, of = [names.index(name) for name in kept], [average.names.index(name) for name in kept]
    covariance[np.ix_(to, to)] = average.covariance[np.ix_(of, of)]
    highest = math.nan if fit.band is None else fit.band.high
    return replace(
        average,
        coefficients=coefficients,
        rests_on=replace(average.rests_on, slow_terms="low band", low_band_hz=highest),
        names=names,
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
