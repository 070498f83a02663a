"""What the headline rests on: a fit, or a bound from the curve."""

import math
from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np
from scipy.stats import chi2

from sagnac import series
from sagnac.analysis.settings import Settings
from sagnac.arrays import FloatArray
from sagnac.coefficients.cosine_spectrum import cosine_spectrum
from sagnac.coefficients.curve_fit import paper_fit, weighted_fit
from sagnac.coefficients.estimates import Estimate, Fit, FitName
from sagnac.coefficients.laws import COEFFICIENT_NAMES
from sagnac.coefficients.spectrum_fit import spectrum_fit
from sagnac.errors import RecordingError, as_note
from sagnac.recording.difference import per_gyro
from sagnac.recording.kinds import angle_of
from sagnac.recording.model import Recording
from sagnac.recording.readout import readout_of
from sagnac.stability.curve import StabilityCurve
from sagnac.stability.degrees_of_freedom import equivalent_degrees_of_freedom
from sagnac.units import ARCSECOND

# Samples over which a gyro's low-pass filter may still lower the curve.
_FILTERED: Final = 10.0
# Angles that a readout step has to leave for a fit. Of fewer, five terms are not told apart: even
# with white readout noise nine intervals in ten hold N, and what is estimated lies half an error
# high.
_LEAST_DITHERED: Final = 320
# A curve of fewer points than this has no cluster time whose deviation means anything.
LEAST_POINTS: Final = 32


def fit_curve(
    method: Literal["paper", "weighted"], curve: StabilityCurve, differenced: int, confidence: float
) -> Fit:
    """One of the two fits to the curve; a curve too short for it observes nothing, and says so."""
    fit = paper_fit if method == "paper" else weighted_fit
    try:
        return fit(curve, gyros_differenced=differenced, confidence=confidence)
    except RecordingError as error:
        return nothing_observed(method, confidence, f"no {method} fit: {error}")


def nothing_observed(method: FitName, confidence: float, *notes: str) -> Fit:
    """A fit that observes nothing."""
    nothing = Estimate(
        value=np.nan, low=np.nan, high=np.nan, confidence=confidence, status="not observable"
    )
    return Fit(
        method=method,
        coefficients=dict.fromkeys(COEFFICIENT_NAMES, nothing),
        notes=tuple(map(as_note, notes)),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class JointReadout:
    """What the readouts of all gyros together allow.

    `step` is the sum of their steps, rad. Of angles taken `every` so many, `time` seconds apart,
    they are dithered. `every` is None where too few are left for a fit, and `time` is infinite
    where they are dithered at no time.
    """

    step: float = 0.0
    every: int | None = 1
    time: float = 0.0
    notes: tuple[str, ...] = ()


def joint_readout(recording: Recording, settings: Settings, angle_rate: float) -> JointReadout:
    """What the gyros' readouts allow of angles taken at `angle_rate`, Hz."""
    taken = round(recording.sample_rate / angle_rate)
    readouts = {}
    for name in settings.gyros:
        angle = angle_of(recording.gyro(name), recording.sample_rate)
        readouts[name] = readout_of(angle if taken == 1 else series.every(angle, taken))
    step = sum(readout.step for readout in readouts.values())
    undithered = {name: readout for name, readout in readouts.items() if readout.every != 1}
    if not undithered:
        return JointReadout(step=step)
    largest = max(readout.step for readout in undithered.values()) / ARCSECOND
    what = f"the readout step of {', '.join(undithered)} ({largest:.3g} arcsec)"
    counts = [readout.every for readout in undithered.values() if readout.every is not None]
    apart = max(counts) / angle_rate if len(counts) == len(undithered) else math.inf
    if not recording.duration / apart >= _LEAST_DITHERED:
        note = (
            f"{recording.duration:.4g} s dither {what} too few times for a fit to tell angle "
            "random walk from it, and only an upper bound is given; record longer, or read out "
            "finer"
        )
        return JointReadout(step=step, every=None, time=apart, notes=(note,))
    note = (
        f"nothing dithers {what} in less than {apart:.4g} s: coefficients are of angles that far "
        "apart, and the curve at shorter cluster times shows the readout"
    )
    return JointReadout(step=step, every=max(counts), time=apart, notes=(note,))


def from_cluster(curve: StabilityCurve, shortest: float) -> StabilityCurve:
    """The part of a curve at cluster times of `shortest` (s) and more."""
    kept = curve.tau >= shortest * (1.0 - 1e-9)
    return replace(
        curve,
        tau=curve.tau[kept],
        deviation=curve.deviation[kept],
        terms=curve.terms[kept],
        edf=curve.edf[kept],
        low=curve.low[kept],
        high=curve.high[kept],
        noise_type=curve.noise_type[kept],
    )


def fit_likelihood(
    angle: FloatArray,
    sample_rate: float,
    differenced: int,
    confidence: float,
    masked: tuple[tuple[float, float], ...],
) -> tuple[Fit, float]:
    """Likelihood fit over the widest band that the five terms describe, and its upper edge, Hz.

    Vibration and resonances at high frequency are no gyro noise; the band is halved until
    chance explains what is left, and where it never does, the band with the least is taken.
    """
    best: tuple[Fit, float] | None = None
    highest = 0.5 * sample_rate
    cosine = cosine_spectrum(angle, kind="angle", sample_rate=sample_rate)
    while best is None or highest * angle.size / sample_rate > 2 * LEAST_POINTS:
        fit = spectrum_fit(
            cosine,
            gyros_differenced=differenced,
            confidence=confidence,
            masked=masked,
            band=None if best is None else (0.0, highest),
        )
        if best is None or fit.departure < best[0].departure:
            best = fit, highest
        if fit.departure == 0.0:
            break
        highest *= 0.5
    return best


def highest_allowed(
    curve: StabilityCurve,
    differenced: int,
    sample_rate: float,
    readout: JointReadout,
    chance: float,
) -> tuple[float, float]:
    """Largest N that the curve allows but by `chance`, per gyro, and the cluster time of it.

    Every other term only adds to N^2 / tau, so N lies below the curve at every point. A gyro's own
    low-pass filter takes away at the shortest cluster times, which are left out. Readout steps hide
    up to two of themselves of each second difference where nothing dithers them within a cluster:
    the root of their mean square is raised by that. Where it does, a mean of few may still come out
    as zero, and is raised by the square of half a step.
    """
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
    step = readout.step / (np.sqrt(2.0) * curve.tau)
    raised = np.where(
        curve.tau < readout.time,
        curve.deviation + 2.0 * step,
        np.hypot(curve.deviation, 0.5 * step),
    )
    high = raised * np.sqrt(edf / chi2.ppf(share, edf))
    highest = np.where(curve.tau * sample_rate < _FILTERED, np.inf, high * np.sqrt(curve.tau))
    index = int(np.nanargmin(highest))
    return per_gyro(float(highest[index]) ** 2, differenced), float(curve.tau[index])
