"""Why N is what it is: the candidates, the one rule, and what moves the answer then.

The rule: **the first candidate of the list that the data bear out is the answer.**

==  ============================  ==================================================================
    candidate                     it is borne out if
==  ============================  ==================================================================
1   Step 4 of the paper           the method is the paper's, and the fit of the curve shows N
2   whole band, every sample      the levels of the spectrum bear out a likelihood of five terms
3   whole band, fewer angles      the same of the angles of the likelihood fit (`Evidence.fine`);
                                  every sample is described up to half their rate, allows the
                                  value, and tells less of it
4   average over bands and terms  N rules three bins or more (`noise.model_average`)
5   likelihood fit alone          too little is left for levels, and the curve allows the value
6   lowest point of the curve     a cluster time is left that no low-pass lowers: an upper bound
7   levels below a roll-off       two bins or more lie there (`noise.bounds`): an upper bound
==  ============================  ==================================================================

If the levels neither bear out 2 or 3 nor reject it, this candidate is the answer, and half of the
weight of its interval is that of 4. If N of fewer angles is more than every sample allows in the
same band, it is bounded by what this allows. The paper's methods know 1 and 6 alone, and a search
for lines that did not come to an end leaves 6, with the lines in. If nothing is borne out, N is not
observable.

The answer then goes through six steps, in this order in `answer`:

1. its interval is wider if large deviations are more frequent than in normal noise (`_widened`);
2. it holds N over parts of the record if these disagree (`averaged.Parts`);
3. Q, B, K and R beside it are no more than the curve allows (`noise.bounds`), and B is not bounded
   below what it may be if flicker ends (`noise.slow_laws`);
4. it holds what the encoder of a table adds or hides (`encoder.with_encoder`);
5. it holds what two gyros share (`encoder.with_shared_noise`);
6. findings of the data divide it or withhold it (`trust.apply_findings`).

Beside it, each gyro of a triad is read alone (`triad.each_alone`).
"""

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Final

import numpy as np

from sagnac.analysis import averaged
from sagnac.analysis.averaged import AnswerSpectrum, Headline
from sagnac.analysis.encoder import WalkOfPair, with_encoder, with_shared_noise
from sagnac.analysis.evidence import Evidence, Points, curve_of, points_at
from sagnac.analysis.settings import PUBLISHED
from sagnac.analysis.triad import each_alone
from sagnac.analysis.trust import apply_findings
from sagnac.core.errors import Note, RecordingError
from sagnac.noise.bounds import RollOff, highest_terms, highest_walk, within_curve
from sagnac.noise.estimates import Fit, unobserved
from sagnac.noise.fit import likelihood_fit
from sagnac.noise.whole_band import with_both, with_slow_laws, with_whole_band
from sagnac.quality.readout import joint_readout

Candidate = Callable[[], Headline | None]
"""Reads N from the evidence: the answer, no N and why, or nothing."""

# Share of the variance up to which the floor between lines tells what they took. Chosen on 140
# still gyros (60 s at 10 Hz, 300 s at 50 Hz) whose 40 lines are noise: bounds lay at a third of N.
_TOLD_SHARE: Final = 0.05


def answer(evidence: Evidence, walk_of_pair: WalkOfPair, *, brief: bool = False) -> Headline:
    """The answer, with the fits that stand beside it.

    Parameters
    ----------
    evidence
        All that it is read from.
    walk_of_pair
        Called if the encoder decides what one gyro shows.
    brief
        Whether to leave out noise that two gyros share, and notes that touch no figure.

    Raises
    ------
    RecordingError
        If the settings are strict and something is found that they do not accept.
    """
    headline = first_candidate(evidence)
    headline = replace(headline, hat=each_alone(evidence, headline))
    headline = _within_curve(evidence, _widened(headline))
    headline = with_encoder(headline, evidence, walk_of_pair)
    if not brief:
        headline = with_shared_noise(headline, evidence)
    return apply_findings(headline, evidence, brief=brief)


def first_candidate(evidence: Evidence) -> Headline:
    """The first candidate that the data bear out, and the fits beside it."""
    headline, finest, candidates = _no_walk(evidence), None, list[Candidate]()
    if evidence.settings.method in PUBLISHED:
        candidates = [partial(_step_4, evidence)]
    elif not evidence.left.is_finished:
        search = f"the search for the lines of {evidence.measured.channel} did not come to an end"
        leaves = "the noise that it leaves is not to be trusted: no estimate is given"
        remedy = "take a stretch on which the table turns evenly ({slice})"
        text = f"{search}, and {leaves}, and a bound is with all lines in; {remedy}"
        headline = _no_walk(evidence, Note(level="warning", text=text))
    elif (finest := _spectrum(evidence)) is None:
        candidates = [partial(_likelihood_alone, evidence)]
    else:
        candidates = [
            partial(_whole_band, evidence, finest),
            partial(_whole_band_of_fewer, evidence, finest),
            # The average over bands and terms.
            partial(_by_spectrum, evidence, finest, evidence.fine),
        ]
    candidates += [partial(_curve, evidence, finest), partial(_levels, evidence, finest)]
    for candidate in candidates:
        read = candidate()
        if read is None:
            continue
        notes, spectrum = (*headline.notes, *read.notes), read.spectrum or headline.spectrum
        headline = replace(read, notes=notes, spectrum=spectrum)
        if read.estimate.status != "not observable":
            break
    fits = dict(evidence.fits)
    if headline.spectrum is not None:
        fits["likelihood"] = headline.spectrum.likelihood
    return replace(headline, fits=fits)


def _widened(headline: Headline) -> Headline:
    """The answer for the fourth cumulant of the noise, and for parts that disagree on N."""
    estimate, spectrum = headline.estimate, headline.spectrum
    if spectrum is None or estimate.status != "estimated":
        return headline
    samples, values = spectrum.increments.size, spectrum.parts.values
    estimate = averaged.with_tails(estimate, spectrum.kurtosis, samples, estimate.confidence)
    if not spectrum.parts.agree:
        low, high = min(estimate.low, *values), max(estimate.high, *values)
        estimate = replace(estimate, low=low, high=high)
    return replace(headline, estimate=estimate)


def _within_curve(evidence: Evidence, headline: Headline) -> Headline:
    """The fit of the spectrum and the average without what contradicts the curve."""
    spectrum, fit = headline.spectrum, headline.fits["likelihood"]
    lowered = 0.0 if spectrum is None else spectrum.roll_off.cluster_time()
    confidence, shortest = evidence.settings.confidence, max(lowered, evidence.readout.time)
    other, curve = fit.slow, evidence.curve
    end = math.inf if other is None else other.lowest_end
    highest = highest_terms(curve, confidence=confidence, shortest=shortest, flicker_end=end)
    slow = with_slow_laws(fit).coefficients["bias_instability"]
    fit = replace(fit, coefficients=within_curve(fit.coefficients, highest))
    if spectrum is not None:
        coefficients = dict(spectrum.average.coefficients)
        # The average takes flicker to have no end, and so bounds B too low if it has one.
        one = coefficients["bias_instability"]
        may_end = other is not None and (other.seen or one.status == "upper bound")
        if may_end and math.isfinite(end) and slow.high > one.high:
            coefficients["bias_instability"] = one.bounded(slow.high)
        limited = within_curve(coefficients, highest)
        spectrum = replace(spectrum, average=spectrum.average.with_coefficients(limited))
    return replace(headline, spectrum=spectrum, fits={**headline.fits, "likelihood": fit})


# ---- the spectrum that 2 to 4 are read from ----------------------------------------------


def _spectrum(evidence: Evidence) -> AnswerSpectrum | None:
    """The spectrum of every sample; None if too little is left for levels.

    Angles are taken as often as the noise crosses the steps of the readout, at least as often as
    those of the likelihood fit. The frequencies of an encoder's error that the angles of the fit do
    not see are left out; if they see one, it is slow, and its steps count.
    """
    left, points, readout = evidence.left, evidence.fine, evidence.readout
    if readout.every is None:
        return None
    if not left.once_a_turn and points.rate < left.rate:
        gyros, slow = evidence.settings.gyros, readout.time > 0.0
        finer = joint_readout(evidence.recording, gyros, left.rate, with_encoder=slow)
        if finer.every is not None and left.rate / finer.every > points.rate:
            points = points_at(left.removal.residual, left.rate, finer.time)
    return averaged.spectrum_of(evidence, points)


# ---- each candidate: the answer, or no N and why, or nothing -----------------------------


def _step_4(evidence: Evidence) -> Headline:
    """Step 4 of the paper. A fit whose interval begins at 0 shows no N, whatever its value."""
    fitted = evidence.fits["paper"].coefficients["angle_random_walk"]
    channel, reading = evidence.measured.channel, evidence.settings.step_4.in_words
    if fitted.status != "estimated" or not fitted.low > 0.0:
        why = f"Step 4 of the paper ({reading}) shows no angle random walk of {channel}"
        return _no_walk(evidence, Note(text=f"{why}: only an upper bound is given"))
    interval = f"{1.0 / evidence.curve.sample_rate:.4g} s (Step 4 of the paper)"
    source = f"least squares on the Allan variance of {channel} at {interval}: {reading}"
    return Headline(estimate=fitted, source=source)


def _whole_band(evidence: Evidence, finest: AnswerSpectrum) -> Headline | None:
    """A likelihood of five terms of every sample."""
    if finest.is_changed:
        return None
    points, fit = finest.points, finest.likelihood
    if points.rate > evidence.fine.rate:
        try:
            steps, rate = finest.increments, points.rate
            fit = likelihood_fit(steps, kind="increment", sample_rate=rate, **evidence.how)
        except RecordingError:
            return None
    # Four terms may describe no more than a part of the band, and another law all of it.
    fit = fit.of_other_law or fit
    average = with_whole_band(finest.levels, finest.average, fit)
    if average.rests_on.member == "average":
        return None
    return _by_spectrum(evidence, replace(finest, average=average, likelihood=fit), points)


def _whole_band_of_fewer(evidence: Evidence, finest: AnswerSpectrum) -> Headline | None:
    """The same of fewer angles, into whose band folds what lies above half their rate.

    If the terms do not describe every sample up to there, they do not describe what folds.
    """
    if finest.is_changed or finest.points.rate <= evidence.fine.rate:
        return None
    fine, fit = evidence.fine, finest.likelihood
    walk, fitted = finest.average.angle_random_walk, fit.coefficients["angle_random_walk"]
    allowed = walk.status == "not observable" or walk.low <= fitted.value <= walk.high
    # Every sample may tell more of N.
    narrower = walk.status != "estimated" or walk.high * fitted.low > fitted.high * walk.low
    if not (allowed and narrower and averaged.reaches(finest.average.rests_on, 0.5 * fine.rate)):
        return None
    few = averaged.spectrum_of(evidence, fine, as_they_are=True)
    if few is None:
        return None
    average = with_whole_band(few.levels, few.average, fit)
    chosen = replace(few, average=average, roll_off=finest.roll_off)
    if average.rests_on.member == "both" and walk.status == "estimated":
        chosen = replace(finest, average=with_both(finest.average, fit))
    elif average.rests_on.member != "whole band":
        return None
    return _by_spectrum(evidence, chosen, fine)


def _by_spectrum(evidence: Evidence, chosen: AnswerSpectrum, fitted: Points) -> Headline:
    """N of the chosen one of 2 to 4, beside which is a likelihood fit of some angles."""
    spectrum = averaged.complete(chosen, evidence)
    estimate, choice = spectrum.average.angle_random_walk, spectrum.average.rests_on
    channel = evidence.measured.channel
    if estimate.status != "estimated":
        why = f"the spectrum of {channel} shows no band in which the angle random walk rules"
        nothing = _no_walk(evidence, Note(text=f"{why}: no estimate is given"))
        return replace(nothing, spectrum=spectrum)
    if estimate.low > (highest := averaged.highest_of_every_sample(spectrum, evidence)):
        source = f"every sample of {channel}, whose spectrum contradicts that of fewer angles"
        return Headline(estimate=estimate.bounded(highest), source=source, spectrum=spectrum)
    of_likelihood = _likelihood_source(channel, fitted, spectrum.likelihood)
    other = "" if choice.law is None else choice.law.slow.in_words()
    source = {
        "whole band": f"{of_likelihood}; "
        + (f"the spectrum shows {other}" if other else "averages over narrow bands agree"),
        "both": f"{of_likelihood}; averages over narrow bands do not decide, so "
        "that half of the weight of the interval is of the average over bands and terms "
        f"(heaviest: {replace(choice, member='average').in_words()})",
        "average": f"average over bands and terms of the spectrum of {channel}, "
        f"most on {choice.in_words()}",
    }[choice.member]
    if choice.slow_terms == "low band":
        source += f"; B and K: likelihood fit of the spectrum to {choice.low_band_hz:.3g} Hz"
    return Headline(estimate=estimate, source=source, spectrum=spectrum)


def _likelihood_alone(evidence: Evidence) -> Headline | None:
    """The likelihood fit without levels beside it."""
    fit, channel = evidence.fits["likelihood"], evidence.measured.channel
    walk = fit.coefficients["angle_random_walk"]
    if walk.status == "not observable":
        return None
    # A fit that is known not to describe its spectrum yields to the curve much sooner.
    chance = 1e-4 if fit.departure == 0.0 else 1.0 - evidence.settings.confidence
    highest, tau = _highest_walk(evidence, None, chance)
    if walk.low <= highest:
        return Headline(estimate=walk, source=_likelihood_source(channel, evidence.fine, fit))
    asks = f"the likelihood fit of {channel} asks for more angle random walk than the curve shows"
    why = "the five terms do not describe this spectrum, and no estimate is given"
    return _no_walk(evidence, Note(level="warning", text=f"{asks} at {tau:.4g} s: {why}"))


def _curve(evidence: Evidence, finest: AnswerSpectrum | None) -> Headline | None:
    """The lowest point of the curve."""
    bound, _ = _highest_walk(evidence, finest, 1.0 - evidence.settings.confidence)
    if not math.isfinite(bound):
        return None
    curve = f"lowest point of the curve of {_bounded_channel(evidence)}"
    estimate = _no_walk(evidence).estimate.bounded(bound)
    return Headline(estimate=estimate, source=f"{curve} against the slope of the ARW")


def _levels(evidence: Evidence, finest: AnswerSpectrum | None) -> Headline:
    """The levels below a roll-off, which are the last resort."""
    nothing, channel = _no_walk(evidence), _bounded_channel(evidence)
    estimate = nothing.estimate if finest is None else finest.average.angle_random_walk
    if estimate.status == "not observable":
        return replace(nothing, source=f"nothing: no candidate is borne out by {channel}")
    return Headline(estimate=estimate, source=f"the spectrum of {channel} below its roll-off")


# ---- what several candidates ask ---------------------------------------------------------


def _no_walk(evidence: Evidence, *why: Note) -> Headline:
    """No N, and why."""
    nothing = unobserved("angle_random_walk", evidence.settings.confidence)
    return Headline(estimate=nothing, source="", notes=why)


def _likelihood_source(channel: str, points: Points, fit: Fit) -> str:
    highest = 0.0 if fit.band is None else fit.band.high
    angles = f"{points.angle.size} angles of {channel} at {1.0 / points.rate:.4g} s"
    return f"likelihood fit of the spectrum of {angles}, to {highest:.4g} Hz"


def _bounded_channel(evidence: Evidence) -> str:
    """Name of what a bound is of."""
    return evidence.measured.channel + ("" if evidence.left.is_finished else " with its lines in")


def _highest_walk(
    evidence: Evidence, finest: AnswerSpectrum | None, chance: float
) -> tuple[float, float]:
    """Largest N that the curve allows except with a probability.

    Of a search that did not come to an end, the curve with all lines in: lines only raise a curve,
    and half of a search can lower it. A gyro's own low-pass lowers the shortest cluster times:
    those below ten samples, and those that the spectrum shows, are left out.
    """
    curve, rate = evidence.curve, evidence.measured.sample_rate
    roll_off = RollOff() if finest is None else finest.roll_off
    unfinished = evidence.left.removal.unfinished
    if unfinished is not None:
        points = points_at(unfinished, rate, evidence.settings.interval)
        curve = curve_of(points.angle, points.rate, evidence.settings)
        roll_off = averaged.roll_off_of(Points(angle=unfinished, rate=rate))
    elif evidence.settings.method in PUBLISHED and not evidence.settings.step_4.noise_restored:
        # A bound contains the noise that the lines took. If they took much of it, what is left does
        # not tell how much; the curve with all lines in is never too low.
        raised = np.hypot(curve.deviation, np.sqrt(evidence.taken))
        told = evidence.taken <= _TOLD_SHARE * raised**2
        curve = replace(curve, deviation=np.where(told, raised, evidence.curve_before.deviation))
    used = (curve.tau * rate >= 10.0) & (curve.tau >= roll_off.cluster_time())
    return highest_walk(curve, evidence.readout, chance=chance, used=used)
