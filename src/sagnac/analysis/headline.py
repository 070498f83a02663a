"""Basis of the headline: the average over bands and terms, or a bound."""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from scipy.special import gammaincinv

from sagnac.analysis.averaged import Averaged, roll_off_of
from sagnac.analysis.curves import Points, allan_curve, points_at
from sagnac.analysis.fits import Coefficients
from sagnac.analysis.measurement import Measurement
from sagnac.analysis.removal import Remainder
from sagnac.analysis.settings import PUBLISHED, Settings
from sagnac.coefficients.bounds import RollOff
from sagnac.coefficients.estimates import Estimate, unobserved
from sagnac.errors import Note
from sagnac.recording.readout import JointReadout
from sagnac.stability.curve import StabilityCurve
from sagnac.stability.noise_type import equivalent_degrees_of_freedom

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
class CurveBound:
    """Largest N of one gyro that a curve allows, rad/sqrt(s), and the cluster time of it, s."""

    value: float
    tau: float


def headline_of(
    measured: Measurement,
    left: Remainder,
    *,
    curve: StabilityCurve,
    coefficients: Coefficients,
    found: Averaged | None,
    settings: Settings,
) -> Headline:
    """The average where it shows N, else a bound.

    The paper's methods answer by their own Step 4, the fit of the Allan curve. Without an
    average, since too little is left for a spectrum, the likelihood fit is the answer
    if the curve allows what it says.

    Parameters
    ----------
    measured, left
        The angle, and what removal left of it.
    curve
        After removal.
    coefficients
        The fits.
    found
        The average; None if there is none.
    settings
        Confidence and interval.
    """
    if settings.method in PUBLISHED:
        return _of_allan_fit(measured, left, curve, coefficients, settings)
    if found is not None and found.average.angle_random_walk.status == "estimated":
        return _of_average(measured, found, coefficients)
    fit = coefficients.fits["likelihood"].coefficients["angle_random_walk"]
    bounding = _bounding(
        measured, left, curve=curve, coefficients=coefficients, found=found, settings=settings
    )
    if left.removal.unfinished is not None:
        notes: tuple[Note, ...] = (_search_without_end(measured.channel),)
    elif found is None and fit.status != "not observable":
        # A fit that is known not to describe its spectrum yields to the curve much sooner.
        sound = coefficients.fits["likelihood"].departure == 0.0
        veto = bounding.highest(_VETO if sound else 1.0 - settings.confidence)
        if veto is None or fit.low <= veto.value:
            return Headline(estimate=fit, source=_likelihood_source(measured.channel, coefficients))
        notes = (_asks_for_too_much(measured.channel, veto.tau),)
    elif found is not None:
        notes = (_no_plateau(measured.channel),)
    else:
        notes = ()
    return _bound(bounding, found, settings, notes)


def _of_average(measured: Measurement, found: Averaged, coefficients: Coefficients) -> Headline:
    """The average, its interval widened to the parts if these disagree."""
    estimate, choice = found.average.angle_random_walk, found.average.rests_on
    if found.parts is not None and not found.parts.agree:
        estimate = replace(
            estimate,
            low=min(estimate.low, found.parts.smallest),
            high=max(estimate.high, found.parts.largest),
        )
    fitted = _likelihood_source(measured.channel, coefficients)
    if choice.member == "whole band":
        source = f"{fitted}; averages over narrow bands agree"
    elif choice.member == "both":
        source = (
            f"{fitted}; averages over narrow bands do not decide, so that the interval also holds "
            "the average over bands and terms "
            f"(heaviest: {replace(choice, member='average').in_words()})"
        )
    else:
        source = (
            f"average over bands and terms of the spectrum of {measured.channel}, "
            f"most on {choice.in_words()}"
        )
    if choice.slow_terms == "low band":
        source += f"; B and K: likelihood fit of the spectrum to {choice.low_band_hz:.3g} Hz"
    return Headline(estimate=estimate, source=source)


def _of_allan_fit(
    measured: Measurement,
    left: Remainder,
    curve: StabilityCurve,
    coefficients: Coefficients,
    settings: Settings,
) -> Headline:
    """Step 4 of the paper by the reading chosen.

    A fit whose interval begins at 0 shows no N, whatever value its squares have.
    """
    fitted = coefficients.fits["paper"].coefficients["angle_random_walk"]
    reading = settings.step_4.in_words
    if fitted.status == "estimated" and fitted.low > 0.0:
        return Headline(
            estimate=fitted,
            source=f"least squares on the Allan variance of {measured.channel} at "
            f"{1.0 / curve.sample_rate:.4g} s (Step 4 of the paper): {reading}",
        )
    bounding = _bounding(
        measured, left, curve=curve, coefficients=coefficients, found=None, settings=settings
    )
    note = Note(
        text=f"Step 4 of the paper ({reading}) shows no angle random walk of {measured.channel}: "
        "only an upper bound is given"
    )
    return _bound(bounding, None, settings, (note,))


def _likelihood_source(channel: str, coefficients: Coefficients) -> str:
    points = coefficients.points
    return (
        f"likelihood fit of the spectrum of {points.angle.size} angles of {channel} "
        f"at {1.0 / points.rate:.4g} s, to {coefficients.highest:.4g} Hz"
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Bounding:
    """The curve that bounds N, and from which cluster time on.

    Attributes
    ----------
    curve
        With its lines in if the search for them did not come to an end.
    channel
        Its name in words.
    readout
        What raises the bound.
    shortest
        Cluster times below this, s, are lowered by a low-pass of the sensor.
    sample_rate
        Of what is measured, Hz.
    """

    curve: StabilityCurve
    channel: str
    readout: JointReadout
    shortest: float
    sample_rate: float

    def highest(self, chance: float) -> CurveBound | None:
        """Largest N that the curve allows except with probability `chance`.

        Every other term only adds to N^2 / tau, so N lies below the curve at every point. A gyro's
        own low-pass filter lowers the shortest cluster times, which are left out: those below
        `shortest` and below ten samples. If none is left there is no bound, and the result is None.
        If nothing dithers the readout within a cluster, its steps hide up to two steps of each
        second difference: the deviation is raised by the root of their mean square. If something
        does, a mean of few may still come out as zero: the deviation is raised by half a step in
        square.
        """
        curve = self.curve
        angles = curve.samples + (curve.kind != "angle")
        # One limit for the lowest of many points: each at its share of the chance (Bonferroni).
        share = chance / curve.tau.size
        # The point asks what N could be if it ruled there, so the degrees of freedom are those of
        # white rate, whatever noise was identified.
        edf = np.array(
            [
                equivalent_degrees_of_freedom(
                    curve.estimator, 0, round(tau * curve.sample_rate), angles
                )
                for tau in curve.tau
            ]
        )
        step = self.readout.step / (np.sqrt(2.0) * curve.tau)
        raised = np.where(
            curve.tau < self.readout.time,
            curve.deviation + 2.0 * step,
            np.hypot(curve.deviation, 0.5 * step),
        )
        # Lower limit of chi-squared; importing scipy.stats for it would take a second.
        high = raised * np.sqrt(edf / (2.0 * gammaincinv(0.5 * edf, share)))
        lowered = (curve.tau * self.sample_rate < _FILTERED) | (curve.tau < self.shortest)
        highest = np.where(lowered, np.inf, high * np.sqrt(curve.tau))
        if not np.isfinite(highest).any():
            return None
        index = int(np.nanargmin(highest))
        return CurveBound(value=float(highest[index]), tau=float(curve.tau[index]))


def _bounding(
    measured: Measurement,
    left: Remainder,
    *,
    curve: StabilityCurve,
    coefficients: Coefficients,
    found: Averaged | None,
    settings: Settings,
) -> _Bounding:
    channel, rate = measured.channel, measured.sample_rate
    if left.removal.unfinished is not None:
        # Lines only raise a curve; half of a search can lower it.
        every = Points(angle=left.removal.unfinished, rate=rate)
        curve = allan_curve(points_at(every.angle, rate, settings.interval), settings.confidence)
        lowered, channel = roll_off_of(every, ()), f"{channel} with its lines in"
    else:
        lowered = RollOff() if found is None else found.roll_off
    return _Bounding(
        curve=curve,
        channel=channel,
        readout=coefficients.readout,
        shortest=lowered.cluster_time(),
        sample_rate=rate,
    )


def _bound(
    bounding: _Bounding, found: Averaged | None, settings: Settings, notes: tuple[Note, ...]
) -> Headline:
    """By the curve; by the levels if a low-pass lowers all of the curve; else nothing."""
    bound = bounding.highest(1.0 - settings.confidence)
    if bound is not None:
        estimate = Estimate(
            value=bound.value,
            low=0.0,
            high=bound.value,
            confidence=settings.confidence,
            status="upper bound",
            name="angle_random_walk",
        )
        source = f"lowest point of the curve of {bounding.channel} against the slope of the ARW"
        return Headline(estimate=estimate, source=source, notes=notes)
    source = f"the spectrum of {bounding.channel} below its roll-off"
    if found is not None:
        return Headline(estimate=found.average.angle_random_walk, source=source, notes=notes)
    unseen = unobserved("angle_random_walk", settings.confidence)
    return Headline(estimate=unseen, source=source, notes=notes)


def _no_plateau(channel: str) -> Note:
    return Note(
        text=f"the spectrum of {channel} shows no band in which the angle random walk rules: no "
        "estimate is given",
    )


def _search_without_end(channel: str) -> Note:
    return Note(
        level="warning",
        text=f"the search for the lines of {channel} did not come to an end, and the noise that "
        "it leaves is not to be trusted: no estimate is given, and a bound is with all lines in; "
        "take a stretch on which the table turns evenly ({slice})",
    )


def _asks_for_too_much(channel: str, tau: float) -> Note:
    return Note(
        level="warning",
        text=f"the likelihood fit of {channel} asks for more angle random walk than the curve "
        f"shows at {tau:.4g} s: the five terms do not describe this spectrum, and no estimate is "
        "given",
    )
