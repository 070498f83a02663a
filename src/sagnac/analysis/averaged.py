"""The spectrum of what removal leaves: its average over bands and terms, and what else is in it.

N over parts of a record says whether the noise stood still. A part fits its own N and other terms,
which few bins tell apart poorly: two such values may differ twofold by chance. Whether the spectrum
is the same in each of the parts shows far more sharply, in the change of N that would explain it
with all other terms as they are. It does not say which term changes.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field, replace
from itertools import pairwise
from typing import Any, Final, TypeVar

import numpy as np
from scipy.special import chdtri, ndtri

from sagnac.analysis.corrections import WarmUp, find_warm_up, without_warm_up
from sagnac.analysis.evidence import Bands, Evidence, Points
from sagnac.analysis.result import Part
from sagnac.core.arrays import FloatArray, differences, extent
from sagnac.core.errors import Note, RecordingError
from sagnac.noise.band_models import FLOOR, bin_shapes, models_of_one_band
from sagnac.noise.bounds import Hump, RollOff, hump_above, roll_off
from sagnac.noise.estimates import Change, Estimate, Fit, FitName, Interval, each_changed
from sagnac.noise.fit import likelihood_fit
from sagnac.noise.laws import SLOW_NAMES, level_laws
from sagnac.noise.lowest_ordinates import rate_ramp
from sagnac.noise.model_average import RULED, Average, ModelChoice, average, mixture
from sagnac.noise.slow_laws import LOW_PASS, WALK
from sagnac.noise.three_cornered_hat import Separation
from sagnac.noise.whole_band import levels_bear_out, with_slow_laws, with_slow_terms
from sagnac.quality import distribution
from sagnac.quality.whitening import whitened
from sagnac.spectrum.levels import Levels, robust_levels
from sagnac.spectrum.periodogram import CELL, band_degrees_of_freedom, bin_sums
from sagnac.spectrum.tapered import LEAST_SAMPLES, tapered_spectrum


@dataclass(frozen=True, slots=True, kw_only=True)
class Parts:
    """N over parts, and whether chance explains how they differ.

    Attributes
    ----------
    parts
        In order of time.
    walks_agree
        Whether chance explains how far the values lie apart, and their mean from the whole; True
        with fewer than two parts.
    spectra_agree
        Whether chance explains how the spectra differ; True with fewer than two parts.
    spread
        Largest over smallest N that would make the spectra differ as they do.
    """

    parts: tuple[Part, ...] = ()
    walks_agree: bool = True
    spectra_agree: bool = True
    spread: float = 1.0

    @property
    def agree(self) -> bool:
        """Whether the noise stood still, as far as can be seen."""
        return self.walks_agree and self.spectra_agree

    @property
    def values(self) -> list[float]:
        """N of those that show it, rad/sqrt(s)."""
        return [part.value for part in self.parts if part.shows]


@dataclass(frozen=True, slots=True, kw_only=True)
class AnswerSpectrum:
    """The spectrum that an answer is read from.

    Attributes
    ----------
    points
        The angles that it is of.
    increments
        Their increments, rad, without bumps, spikes and warm-up.
    bumps
        Seconds in which a unit at rest was moved, replaced; None if there are none.
    spikes
        What was replaced; None if there are none, or too few samples to tell.
    warm_up
        What was taken off; None if nothing settles.
    levels
        Of their spectrum.
    average
        Coefficients and what they rest on.
    likelihood
        The fit that stands beside the average.
    roll_off
        Where the spectrum of every sample begins to be lowered.
    hump
        Above the band of the answer, with less behind it.
    parts
        N over parts; without any if the whole does not show it.
    kurtosis
        Excess of that of the increments over that of normal noise; 0 if chance explains it.
    """

    points: Points
    increments: FloatArray
    bumps: distribution.Bumps | None
    spikes: distribution.Spikes | None
    warm_up: WarmUp | None
    levels: Levels
    average: Average
    likelihood: Fit
    roll_off: RollOff
    hump: Hump | None = None
    parts: Parts = field(default_factory=Parts)
    kurtosis: float = 0.0

    @property
    def is_changed(self) -> bool:
        """Whether a bump or a spike was replaced or a warm-up taken off."""
        return any(one is not None for one in (self.bumps, self.spikes, self.warm_up))


@dataclass(frozen=True, slots=True, kw_only=True)
class Headline:
    """The answer.

    Attributes
    ----------
    estimate
        Angle random walk of one gyro, rad/sqrt(s).
    source
        What it rests on, in words.
    notes
        Why it is no more than a bound, or how it came about.
    spectrum
        The spectrum that was read for it; None if none was.
    by_encoder
        Whether what is left of one gyro is the encoder's rather than its own.
    findings
        What was noticed beside the noise.
    fits
        That stand beside it, by method.
    hat, per_gyro
        Each gyro's own N, of a triad, as read, and as the findings leave it.
    """

    estimate: Estimate
    source: str
    notes: tuple[Note, ...] = ()
    spectrum: AnswerSpectrum | None = None
    by_encoder: bool = False
    findings: tuple[Note, ...] = ()
    fits: Mapping[FitName, Fit] = field(default_factory=dict)
    hat: Separation = field(default_factory=lambda: Separation(angle_random_walk={}))
    per_gyro: Mapping[str, Estimate] = field(default_factory=dict)

    def with_each(self, changed: Change, *, beside: bool = False) -> "Headline":
        """The same with each coefficient of the average and the fits changed.

        With `beside` N of the average and the fit of the paper stay.
        """
        fits, spectrum = dict(self.fits), self.spectrum
        for name, fit in self.fits.items():
            if not (beside and name == "paper"):
                fits[name] = fit.with_each(changed)
        if spectrum is not None:
            coefficients = each_changed(spectrum.average.coefficients, changed)
            if beside:
                coefficients["angle_random_walk"] = spectrum.average.angle_random_walk
            average = spectrum.average.with_coefficients(coefficients)
            spectrum = replace(spectrum, average=average)
        return replace(self, fits=fits, spectrum=spectrum)


def levels_of(increments: FloatArray, rate: float, masked: Bands) -> Levels | None:
    """Robust levels of increments (rad) at a rate (Hz); None if there is nothing to level."""
    if increments.size < LEAST_SAMPLES or not np.any(np.diff(extent(increments))):
        return None
    try:
        levels = robust_levels(tapered_spectrum(increments, sample_rate=rate), masked=masked)
    except ValueError:
        # Masked bands that leave no cell.
        return None
    # Fewer bins say nothing of a band.
    return levels if levels.level.size >= 4 else None


def roll_off_of(points: Points) -> RollOff:
    """The frequency from which on the spectrum of angles is lowered; none of too few angles."""
    levels = levels_of(differences(points.angle), points.rate, ())
    return RollOff() if levels is None else roll_off(levels)


def highest_of_every_sample(read: AnswerSpectrum, evidence: Evidence) -> float:
    """Largest N that every sample allows in the band in which fewer angles were read, rad/sqrt(s).

    What lies above half the rate of the angles folds into their band. Steps of an encoder are white
    there only if the table's rate does not swing. In every sample they only add to N. Infinite if
    every sample was read, or tells nothing, or at rest.
    """
    left, (low, high), levels = evidence.left, read.average.rests_on.band_hz, None
    if evidence.table.angle is not None and read.points.rate < left.rate:
        levels = levels_of(differences(left.removal.residual), left.rate, evidence.masked)
    if levels is None:
        return math.inf
    shape = np.where((levels.frequency >= low) & (levels.frequency <= high), levels.shape, 0.0)
    squares, freedom = levels.level / level_laws(levels)[:, WALK], 2.0 * float(shape.sum())
    if freedom == 0.0:
        return math.inf
    # By the chi-square law of the mean of the squares.
    return math.sqrt(2.0 * shape @ squares / chdtri(freedom, evidence.settings.confidence))


def spectrum_of(
    evidence: Evidence, points: Points, *, as_they_are: bool = False
) -> AnswerSpectrum | None:
    """Levels of the increments of angles and their average; None if there is nothing to level.

    Parameters
    ----------
    evidence
        The fits beside them, the bands to leave out, and the confidence.
    points
        Angles.
    as_they_are
        Whether bumps, spikes and a warm-up stay in.
    """
    increments, rate = differences(points.angle), points.rate
    bumps = spikes = warm_up = None
    if not as_they_are:
        # A table's own motion comes in bumps, too; accelerometers are not looked at for any.
        if evidence.table.angle is None and evidence.recording.gyros[0].sensor == "gyro":
            bumps = distribution.find_bumps(increments, sample_rate=rate)
        if bumps is not None:
            increments = distribution.without_bumps(increments, bumps)
        if increments.size >= distribution.LEAST_FOR_SPIKES:
            far = distribution.find_spikes(increments, sample_rate=rate)
            if far.index.size:
                spikes, increments = far, distribution.without_spikes(increments, far)
        warm_up = find_warm_up(increments, sample_rate=rate)
        if warm_up is not None:
            increments = without_warm_up(increments, warm_up, sample_rate=rate)
    levels = levels_of(increments, rate, evidence.masked)
    if levels is None:
        return None
    settling = None if warm_up is None else warm_up.time
    ramp = rate_ramp(increments, sample_rate=rate, settling=settling, **evidence.how)
    return AnswerSpectrum(
        points=points,
        increments=increments,
        bumps=bumps,
        spikes=spikes,
        warm_up=warm_up,
        levels=levels,
        average=average(levels, confidence=evidence.settings.confidence, ramp=ramp),
        likelihood=evidence.fits["likelihood"],
        roll_off=roll_off(levels),
    )


def complete(spectrum: AnswerSpectrum, evidence: Evidence) -> AnswerSpectrum:
    """The spectrum with B and K of the lowest frequencies, N over parts, and a hump."""
    if spectrum.average.angle_random_walk.status != "estimated":
        return spectrum
    if spectrum.average.rests_on.member != "whole band":
        spectrum = replace(spectrum, average=_with_slow_terms(spectrum, evidence))
    spectrum = replace(spectrum, kurtosis=_excess_kurtosis(spectrum.increments))
    walk, choice = spectrum.average.angle_random_walk, spectrum.average.rests_on
    hump = hump_above(spectrum.levels, choice.band_hz, walk.value) if choice.terms else None
    lowest = min(LOW_PASS, 0.25 * choice.band_hz[1])
    if choice.member != "whole band" and spectrum.roll_off.frequency < lowest:
        # Slow noise or a hump that falls to N, read far above: no low-pass lowers a cluster time.
        spectrum = replace(spectrum, roll_off=roll_off(spectrum.levels, above=lowest))
    return replace(spectrum, hump=hump, parts=_parts(spectrum, evidence))


def _with_slow_terms(basis: AnswerSpectrum, evidence: Evidence) -> Average:
    """B and K of an average by the likelihood of angles farther apart.

    The average of every sample sees the lowest frequencies in a few levels only, and its band ends
    below a low-pass or a hump. The angles are taken so far apart, and the top of their band is left
    out, that hardly anything above the band of the average folds into it.
    """
    choice, increments, rate = basis.average.rests_on, basis.increments, basis.points.rate
    # Angles a second for slow terms; a short record needs more for a spectrum.
    wanted = max(10.0, 2048.0 * rate / increments.size)
    step = math.ceil(rate / min(wanted, 0.5 * choice.band_hz[1]))
    # Fitted where it is not seen, Q would take from N what a low-pass takes.
    quantization = tuple(name for name in choice.terms if name == "quantization")
    terms = (*quantization, "angle_random_walk", *SLOW_NAMES)
    how = {**evidence.how, "band": (0.0, 0.25 * rate / step), "terms": terms}
    sums = bin_sums(increments, step * np.arange(increments.size // step + 1))
    try:
        fit = likelihood_fit(sums, kind="increment", sample_rate=rate / step, **how)
    except RecordingError:
        return basis.average
    if not levels_bear_out(basis.levels, fit, basis.average.angle_random_walk):
        return basis.average
    return with_slow_terms(basis.average, with_slow_laws(fit))


def reaches(choice: ModelChoice, highest: float) -> bool:
    """Whether what an average rests on describes every sample up to a frequency, Hz."""
    # A bin less than the whole band of fewer angles is enough.
    return choice.band_hz[1] >= 0.79 * highest


def _parts(basis: AnswerSpectrum, evidence: Evidence) -> Parts:
    """N over parts, by the band and terms that the average rests on."""
    choice, walk = basis.average.rests_on, basis.average.angle_random_walk
    rate, confidence = basis.points.rate, evidence.settings.confidence

    def read(increments: FloatArray) -> PartEstimate | None:
        levels = levels_of(increments, rate, evidence.masked)
        if levels is None:
            return None
        # A part does not reach as low as the whole: if the whole read over the frequencies of the
        # part gives another N, the part does not show it.
        band = (max(choice.band_hz[0], float(levels.low[0])), choice.band_hz[1])
        seen = walk_in_band(basis.levels, replace(choice, band_hz=band), confidence)
        if seen is None or not walk.low <= seen.value <= walk.high:
            return None
        return estimate_in_band(levels, choice, confidence)

    how: dict[str, Any] = {"whole": walk, "confidence": confidence, "kurtosis": basis.kurtosis}
    return over_parts(basis.increments, sample_rate=rate, read=read, **how)


# ---- noise with frequent large deviations ------------------------------------------------

_Interval = TypeVar("_Interval", bound=Interval)

# Samples that the distribution of the noise is read from.
_FOR_SHAPE: Final = 2**18
# Standard errors from which on an excess kurtosis is no chance.
_SURE: Final = 6.0


def _excess_kurtosis(increments: FloatArray) -> float:
    """Excess kurtosis of increments made white; 0 if chance explains it or it is negative."""
    some = increments[:_FOR_SHAPE]
    if some.size < _FOR_SHAPE // 64:
        return 0.0
    kurtosis = distribution.shape_of(whitened(some).values).kurtosis
    return kurtosis if kurtosis >= _SURE * math.sqrt(24.0 / some.size) else 0.0


def with_tails(one: _Interval, kurtosis: float, samples: float, confidence: float) -> _Interval:
    """N with an interval that knows the fourth cumulant of the noise.

    Intervals of spectra are those of normal noise. In any other, each ordinate scatters the same,
    and all of them move together besides: the variance of the logarithm of N is larger by a quarter
    of the excess kurtosis over the samples (Brockwell and Davis 1991, *Time Series: Theory and
    Methods*, proposition 10.3.2).
    """
    if kurtosis == 0.0 or not one.low > 0.0:
        return one
    more = 0.5 * float(ndtri(0.5 + 0.5 * confidence)) * math.sqrt(kurtosis / samples)
    down = math.hypot(math.log(one.value / one.low), more)
    up = math.hypot(math.log(one.high / one.value), more)
    return replace(one, low=one.value * math.exp(-down), high=one.value * math.exp(up))


# ---- N over parts ------------------------------------------------------------------------

# Chance at which each test says of parts that agree that they do not.
_CHANCE: Final = 0.01


@dataclass(frozen=True, slots=True, kw_only=True)
class PartEstimate:
    """Estimate by the spectrum of a part.

    Attributes
    ----------
    walk
        N by a fit of its own, rad/sqrt(s).
    change, error
        Logarithm of N squared of the part over that of the law of the whole, if all other terms
        stood still, and the standard error allowed: chance, and what each fit allows a bin.
    """

    walk: Interval
    change: float
    error: float

    def with_tails(self, kurtosis: float, samples: float, confidence: float) -> "PartEstimate":
        """The same of as many samples whose fourth cumulant is not that of normal noise."""
        walk = with_tails(self.walk, kurtosis, samples, confidence)
        error = math.hypot(self.error, math.sqrt(kurtosis / samples))
        return replace(self, walk=walk, error=error)


def estimate_in_band(levels: Levels, choice: ModelChoice, confidence: float) -> PartEstimate | None:
    """Estimate by the levels of a part over the band and with the terms of an average.

    With share s of N in the law of the whole, N squared larger by a factor exp(c) lifts the
    logarithm of a level by about s c: c is the mean of the logarithms of level over law, each
    divided by s, weighted by s^2 and the shapes of the bins.

    Parameters
    ----------
    levels
        Of a part.
    choice
        Of the whole.
    confidence
        Of the interval.

    Returns
    -------
    PartEstimate or None
        None if the levels do not show N.
    """
    walk = walk_in_band(levels, choice, confidence)
    if walk is None or choice.law is None:
        return None
    terms = choice.law.terms(levels)
    means = terms.sum(axis=1)
    share = terms[:, WALK] / means
    low, high = choice.band_hz
    inside = (levels.frequency >= low) & (levels.frequency <= high)
    # A part need not reach down to where N rules in the law of the whole.
    if np.count_nonzero(share[inside] >= 0.5) < RULED:
        return None
    weight = (bin_shapes(levels, FLOOR) * share)[inside]
    information = float(weight @ share[inside])
    higher = np.log(levels.level / means)[inside]
    # Neighbouring cells share a little, across the edge of a bin, too: all are worth less.
    used = np.array([CELL * np.count_nonzero(levels.flat[slice(*one)]) for one in levels.members])
    shared = sum(map(band_degrees_of_freedom, used[inside]))
    shared /= band_degrees_of_freedom(int(used[inside].sum()))
    change, error = float(weight @ higher) / information, math.sqrt(max(shared, 1.0) / information)
    return PartEstimate(walk=walk, change=change, error=error)


def walk_in_band(levels: Levels, choice: ModelChoice, confidence: float) -> Interval | None:
    """N of some levels over the band and with the terms that an average rests on.

    Terms that come out at zero are left out. A part has too few bins to show their error: it is
    the one that the fits allow for.

    Parameters
    ----------
    levels
        Of a part, or of the whole.
    choice
        Band and terms.
    confidence
        Of the interval.

    Returns
    -------
    Interval or None
        None if too few bins lie in the band, or they do not show N.
    """
    models = models_of_one_band(levels, choice.band_hz, choice.mask).heaviest()
    # A short part may not reach down to where N rules: what is fitted there is not seen.
    if models.count == 0 or models.ruled[0] < RULED:
        return None
    return mixture(models, WALK, confidence)


def over_parts(
    increments: FloatArray,
    *,
    sample_rate: float,
    read: Callable[[FloatArray], PartEstimate | None],
    whole: Interval,
    confidence: float = 0.95,
    kurtosis: float = 0.0,
) -> Parts:
    """N over quarters of the record, or halves, against each other and against the whole.

    Parameters
    ----------
    increments
        (samples,), rad.
    sample_rate
        Samples per second.
    read
        What some increments say, over the same band and with the same terms; None if they do not
        show N.
    whole
        N of the whole: the answer that the parts have to bear out.
    confidence
        Of all intervals.
    kurtosis
        Excess of the noise, with which all levels of a part move together.

    Returns
    -------
    Parts
        Of the first count all of whose parts show N: if some of them do, they are those in which
        chance made it high. If there is none, of the first of which two show it.
    """
    tried: list[Parts] = []
    # Quarters, or halves if quarters do not show N.
    for count in (4, 2):
        ends = list(pairwise(number * increments.size // count for number in range(count + 1)))
        estimates = [read(increments[start:stop]) for start, stop in ends]
        samples = increments.size / count
        readings = [one and one.with_tails(kurtosis, samples, confidence) for one in estimates]
        spans = [{"start_s": one / sample_rate, "stop_s": two / sample_rate} for one, two in ends]
        walks = [{} if one is None else asdict(one.walk) for one in readings]
        parts = tuple(Part(**span, **walk) for span, walk in zip(spans, walks, strict=True))
        seen = [one for one in readings if one is not None]
        several = len(seen) > 1
        tried.append(_compared(parts, seen, whole, confidence) if several else Parts(parts=parts))
        if len(seen) == count:
            return tried[-1]
    return next((one for one in tried if len(one.values) > 1), tried[-1])


def _compared(
    parts: tuple[Part, ...], seen: list[PartEstimate], whole: Interval, confidence: float
) -> Parts:
    """Parts, and whether chance explains how the two or more that show N differ."""
    mean, chi_square = _weighted([one.walk for one in seen], confidence)
    most = float(chdtri(len(seen) - 1, _CHANCE))
    apart = _weighted([mean, whole], confidence)[1]
    change = np.array([one.change for one in seen])
    weight = np.array([one.error for one in seen]) ** -2.0
    of_changes = float(weight @ (change - weight @ change / weight.sum()) ** 2)
    alike = chi_square <= most and apart <= float(chdtri(1, _CHANCE))
    spread = math.exp(0.5 * float(change.max() - change.min()))
    return Parts(parts=parts, walks_agree=alike, spectra_agree=of_changes <= most, spread=spread)


def _weighted(seen: list[Interval], confidence: float) -> tuple[Interval, float]:
    """Mean of the logarithms and their chi-square, each in the error on its side of the mean."""
    reach = float(ndtri(0.5 + 0.5 * confidence))
    value, low, high = np.array([[one.value, one.low, one.high] for one in seen]).T
    height = np.log(value)
    up = np.maximum(np.log(high / value) / reach, 1e-6)
    down = np.maximum(-np.log(np.maximum(low / value, 1e-3)) / reach, 1e-6)
    error, mean = 0.5 * (up + down), 0.0
    for _ in range(20):
        weight = error**-2.0
        mean = float((height * weight).sum() / weight.sum())
        error = np.where(height < mean, up, down)
    chi_square = float((((height - mean) / error) ** 2).sum())
    own = reach / math.sqrt(float((error**-2.0).sum()))
    interval = Interval(value=math.exp(mean), low=math.exp(mean - own), high=math.exp(mean + own))
    return interval, chi_square
