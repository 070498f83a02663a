"""Why N is what it is: every candidate in one list, and the one rule that chooses among them.

The rule: **the first candidate of the list that the data bear out is the answer.**

==  ============================  ==================================================================
    candidate                     it is borne out if
==  ============================  ==================================================================
1   Step 4 of the paper           the method is the paper's, and the fit of the curve shows N
2   whole band, every sample      the levels of the spectrum bear out a likelihood of five terms
3   whole band, fewer angles      the same by the levels of the angles of the curve's fit; every
                                  sample is described up to half their rate, allows the value, and
                                  tells less of it
4   average over bands and terms  N rules three bins or more
5   likelihood fit alone          too little is left for levels, and the curve allows the value
6   lowest point of the curve     a cluster time is left that no low-pass lowers: an upper bound
7   levels below a roll-off       two bins or more lie there: an upper bound
==  ============================  ==================================================================

If the levels neither bear out 2 or 3 nor reject it, it is the answer, and its interval holds that
of 4, too. The paper's methods know 1 and 6 alone, and a search for lines that did not come to an
end leaves 6 alone, with the lines in. If nothing is borne out, N is not observable.

What happens to the answer then: the interval holds N of the parts if these disagree (here), what
the encoder of a table adds or hides (`encoder`), and what two gyros share (`common_noise`);
findings of the data divide it or withhold it (`trust`).
"""

from dataclasses import dataclass, replace
from typing import Final

from sagnac.analysis.averaged import (
    Averaged,
    clean,
    completed,
    reaches,
    roll_off_of,
    spectrum_of,
    uncleaned,
)
from sagnac.analysis.curves import Coefficients, Points, allan_curve, points_at, with_likelihood_of
from sagnac.analysis.measurement import Measurement
from sagnac.analysis.removal import Remainder
from sagnac.analysis.settings import PUBLISHED, Settings
from sagnac.core.errors import Note
from sagnac.noise.bounds import CurveBound, highest_walk
from sagnac.noise.estimates import Estimate, unobserved
from sagnac.noise.whole_band import with_both, with_whole_band
from sagnac.quality.readout import joint_readout
from sagnac.recording.model import Recording
from sagnac.stability.curve import StabilityCurve

# Chance at which the curve, against a sound likelihood fit, calls it impossible.
_VETO: Final = 1e-4
# Samples over which a gyro's low-pass filter may still lower the curve.
_FILTERED: Final = 10.0


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
        Why it is no more than a bound.
    by_encoder
        Whether what is left of one gyro is the encoder's rather than its own.
    """

    estimate: Estimate
    source: str
    notes: tuple[Note, ...] = ()
    by_encoder: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Evidence:
    """All that a candidate is read from and judged by.

    Attributes
    ----------
    recording, settings
        With the gyros by name in the settings.
    measured, left
        The angle, and what removal left of it.
    curve
        After removal.
    coefficients
        The fits.
    """

    recording: Recording
    settings: Settings
    measured: Measurement
    left: Remainder
    curve: StabilityCurve
    coefficients: Coefficients

    @property
    def is_published(self) -> bool:
        """Whether the method is the paper's."""
        return self.settings.method in PUBLISHED

    @property
    def is_finished(self) -> bool:
        """Whether the search for lines came to an end."""
        return self.left.removal.unfinished is None


@dataclass(frozen=True, slots=True, kw_only=True)
class Decision:
    """The answer, the spectrum that was read for it, and the fits beside it.

    `found` is None if no spectrum was read.
    """

    headline: Headline
    found: Averaged | None
    coefficients: Coefficients


def decide(evidence: Evidence) -> Decision:
    """The answer by the rule: the first candidate that the data bear out."""
    spectra, found = _spectra(evidence), None
    notes: tuple[Note, ...] = ()
    if not evidence.is_finished:
        notes = (_search_without_end(evidence.measured.channel),)
    for candidate in _CANDIDATES:
        read = candidate(evidence, spectra)
        notes += read.notes
        found = read.found or found
        if read.estimate is not None:
            break
    estimate = read.estimate or unobserved("angle_random_walk", evidence.settings.confidence)
    return Decision(
        headline=Headline(estimate=estimate, source=read.source, notes=notes),
        found=found,
        coefficients=evidence.coefficients if found is None else found.coefficients,
    )


def _search_without_end(channel: str) -> Note:
    return Note(
        level="warning",
        text=f"the search for the lines of {channel} did not come to an end, and the noise that "
        "it leaves is not to be trusted: no estimate is given, and a bound is with all lines in; "
        "take a stretch on which the table turns evenly ({slice})",
    )


# ---- what candidates are read from -------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class _Spectra:
    """The spectrum of every sample, the fits of all of them, and those of fewer angles."""

    every: Averaged
    fitted: Coefficients | None
    fewer: Coefficients


@dataclass(frozen=True, slots=True, kw_only=True)
class _Read:
    """N as a candidate reads it and what it rests on, or no N and why."""

    estimate: Estimate | None = None
    source: str = ""
    notes: tuple[Note, ...] = ()
    found: Averaged | None = None


def _spectra(evidence: Evidence) -> _Spectra | None:
    """What 2 to 4 are read from; None if too little is left for levels."""
    fewer = evidence.coefficients
    if evidence.is_published or not evidence.is_finished or fewer.readout.every is None:
        return None
    points = _every_sample(evidence)
    confidence, masked = evidence.settings.confidence, evidence.left.removal.masked
    fitted: Coefficients | None = fewer
    if points.rate > fewer.points.rate:
        fitted = with_likelihood_of(fewer, points, confidence=confidence, masked=masked)
    every = spectrum_of(clean(points), fewer, masked=masked, confidence=confidence)
    return None if every is None else _Spectra(every=every, fitted=fitted, fewer=fewer)


def _every_sample(evidence: Evidence) -> Points:
    """Angles as often as the readout is dithered, at least as often as those of the fit.

    The frequencies of an encoder's error that the angles of the fit do not see are left out; if
    they see one, it is slow, and its steps count.
    """
    left, fine, readout = evidence.left, evidence.coefficients.points, evidence.coefficients.readout
    if left.once_a_turn:
        return fine
    slow = readout.every is not None and readout.every > 1
    finer = joint_readout(
        evidence.recording, evidence.settings.gyros, left.rate, with_encoder=slow
    ).every
    if finer is None or left.rate / finer <= fine.rate:
        return fine
    return points_at(left.removal.residual, left.rate, finer / left.rate)


# ---- each candidate as an answer ---------------------------------------------------------


def _step_4(evidence: Evidence, _: _Spectra | None) -> _Read:
    """Step 4 of the paper. A fit whose interval begins at 0 shows no N, whatever its value."""
    if not evidence.is_published:
        return _Read()
    fitted = evidence.coefficients.fits["paper"].coefficients["angle_random_walk"]
    channel, reading = evidence.measured.channel, evidence.settings.step_4.in_words
    if fitted.status != "estimated" or not fitted.low > 0.0:
        text = (
            f"Step 4 of the paper ({reading}) shows no angle random walk of {channel}: only an "
            "upper bound is given"
        )
        return _Read(notes=(Note(text=text),))
    source = (
        f"least squares on the Allan variance of {channel} at "
        f"{1.0 / evidence.curve.sample_rate:.4g} s (Step 4 of the paper): {reading}"
    )
    return _Read(estimate=fitted, source=source)


def _whole_band(evidence: Evidence, spectra: _Spectra | None) -> _Read:
    """A likelihood of five terms of every sample."""
    if spectra is None or spectra.fitted is None or spectra.every.cleaned.is_changed:
        return _Read()
    every, fitted = spectra.every, spectra.fitted
    average = with_whole_band(every.levels, every.average, fitted.likelihood)
    if average.rests_on.member == "average":
        return _Read()
    return _by_spectrum(evidence, replace(every, average=average, coefficients=fitted))


def _whole_band_of_fewer(evidence: Evidence, spectra: _Spectra | None) -> _Read:
    """The same of fewer angles, into whose band folds what lies above half their rate.

    If the terms do not describe every sample up to there, they do not describe what folds.
    """
    if spectra is None or spectra.every.cleaned.is_changed:
        return _Read()
    every, fine, fit = spectra.every, spectra.fewer.points, spectra.fewer.likelihood
    walk, fitted = every.average.angle_random_walk, fit.coefficients["angle_random_walk"]
    allowed = walk.status == "not observable" or walk.low <= fitted.value <= walk.high
    # Every sample may tell more of N.
    narrower = walk.status != "estimated" or walk.high * fitted.low > fitted.high * walk.low
    finer = every.cleaned.rate > fine.rate
    reached = reaches(every.average.rests_on, 0.5 * fine.rate)
    if not (finer and allowed and narrower and reached):
        return _Read()
    few = spectrum_of(
        uncleaned(fine), spectra.fewer, masked=every.masked, confidence=every.confidence
    )
    if few is None:
        return _Read()
    average = with_whole_band(few.levels, few.average, fit)
    if average.rests_on.member == "whole band":
        return _by_spectrum(evidence, replace(few, average=average, roll_off=every.roll_off))
    if average.rests_on.member == "both" and walk.status == "estimated":
        return _by_spectrum(evidence, replace(every, average=with_both(every.average, fit)))
    return _Read()


def _average(evidence: Evidence, spectra: _Spectra | None) -> _Read:
    """The average over bands and terms."""
    return _Read() if spectra is None else _by_spectrum(evidence, spectra.every)


def _by_spectrum(evidence: Evidence, chosen: Averaged) -> _Read:
    """N of the chosen one of 2 to 4, its interval widened to the parts if these disagree."""
    found = completed(chosen)
    estimate, choice = found.average.angle_random_walk, found.average.rests_on
    channel = evidence.measured.channel
    if estimate.status != "estimated":
        text = (
            f"the spectrum of {channel} shows no band in which the angle random walk rules: no "
            "estimate is given"
        )
        return _Read(notes=(Note(text=text),), found=found)
    if found.parts is not None and found.changes:
        estimate = replace(
            estimate,
            low=min(estimate.low, found.parts.smallest),
            high=max(estimate.high, found.parts.largest),
        )
    of_likelihood = _likelihood_source(evidence.measured.channel, found.coefficients)
    source = {
        "whole band": f"{of_likelihood}; averages over narrow bands agree",
        "both": f"{of_likelihood}; averages over narrow bands do not decide, so "
        "that the interval also holds the average over bands and terms "
        f"(heaviest: {replace(choice, member='average').in_words()})",
        "average": f"average over bands and terms of the spectrum of {channel}, "
        f"most on {choice.in_words()}",
    }[choice.member]
    if choice.slow_terms == "low band":
        source += f"; B and K: likelihood fit of the spectrum to {choice.low_band_hz:.3g} Hz"
    return _Read(estimate=estimate, source=source, found=found)


def _likelihood_source(channel: str, fits: Coefficients) -> str:
    points, band = fits.points, fits.likelihood.band
    return (
        f"likelihood fit of the spectrum of {points.angle.size} angles of "
        f"{channel} at {1.0 / points.rate:.4g} s, to "
        f"{0.0 if band is None else band.high:.4g} Hz"
    )


def _likelihood_alone(evidence: Evidence, spectra: _Spectra | None) -> _Read:
    fit = evidence.coefficients.likelihood
    walk, channel = fit.coefficients["angle_random_walk"], evidence.measured.channel
    refused = evidence.is_published or not evidence.is_finished or spectra is not None
    if refused or walk.status == "not observable":
        return _Read()
    # A fit that is known not to describe its spectrum yields to the curve much sooner.
    chance = _VETO if fit.departure == 0.0 else 1.0 - evidence.settings.confidence
    veto = _highest(evidence, spectra, chance)
    if veto is None or walk.low <= veto.value:
        return _Read(estimate=walk, source=_likelihood_source(channel, evidence.coefficients))
    text = (
        f"the likelihood fit of {channel} asks for more angle random walk than the curve shows at "
        f"{veto.tau:.4g} s: the five terms do not describe this spectrum, and no estimate is given"
    )
    return _Read(notes=(Note(level="warning", text=text),))


def _curve(evidence: Evidence, spectra: _Spectra | None) -> _Read:
    confidence = evidence.settings.confidence
    bound = _highest(evidence, spectra, 1.0 - confidence)
    if bound is None:
        return _Read()
    estimate = Estimate(
        value=bound.value,
        low=0.0,
        high=bound.value,
        confidence=confidence,
        status="upper bound",
        name="angle_random_walk",
    )
    source = f"lowest point of the curve of {_bounded(evidence)} against the slope of the ARW"
    return _Read(estimate=estimate, source=source)


def _levels(evidence: Evidence, spectra: _Spectra | None) -> _Read:
    estimate = None if spectra is None else spectra.every.average.angle_random_walk
    if estimate is None or estimate.status == "not observable":
        return _Read(source=f"nothing: no candidate is borne out by {_bounded(evidence)}")
    source = f"the spectrum of {_bounded(evidence)} below its roll-off"
    return _Read(estimate=estimate, source=source)


def _bounded(evidence: Evidence) -> str:
    """Name of what a bound is of."""
    return evidence.measured.channel + ("" if evidence.is_finished else " with its lines in")


def _highest(evidence: Evidence, spectra: _Spectra | None, chance: float) -> CurveBound | None:
    """Largest N that the curve allows except with a probability.

    Of a search that did not come to an end, the curve with all lines in: lines only raise a curve,
    and half of a search can lower it. A gyro's own low-pass lowers the shortest cluster times:
    those below ten samples, and those that the spectrum shows, are left out.
    """
    curve, rate = evidence.curve, evidence.measured.sample_rate
    roll_off = None if spectra is None else spectra.every.roll_off
    unfinished = evidence.left.removal.unfinished
    if unfinished is not None:
        points = points_at(unfinished, rate, evidence.settings.interval)
        curve = allan_curve(points, evidence.settings.confidence)
        roll_off = roll_off_of(Points(angle=unfinished, rate=rate))
    used = curve.tau * rate >= _FILTERED
    if roll_off is not None:
        used &= curve.tau >= roll_off.cluster_time()
    return highest_walk(curve, evidence.coefficients.readout, chance=chance, used=used)


_CANDIDATES: Final = (
    _step_4,
    _whole_band,
    _whole_band_of_fewer,
    _average,
    _likelihood_alone,
    _curve,
    _levels,
)
