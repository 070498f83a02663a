"""Coefficients three ways, and each gyro of a triad alone."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from sagnac.analysis.curves import LEAST_POINTS, Points, points_at
from sagnac.analysis.removal import Remainder
from sagnac.analysis.settings import PUBLISHED, Settings
from sagnac.arrays import every
from sagnac.coefficients.cosine_spectrum import cosine_spectrum
from sagnac.coefficients.curve_fit import paper_fit, weighted_fit
from sagnac.coefficients.estimates import Estimate, Fit, FitName, unobserved
from sagnac.coefficients.fit import spectrum_fit
from sagnac.coefficients.laws import COEFFICIENT_NAMES
from sagnac.coefficients.three_cornered_hat import Separation, three_cornered_hat
from sagnac.errors import Note, RecordingError
from sagnac.recording.channel import PAIR_SIZE
from sagnac.recording.model import Recording
from sagnac.recording.readout import JointReadout, joint_readout
from sagnac.stability.curve import StabilityCurve

# The likelihood fit takes the angle this many times as often as the curve: ten times the bins,
# and still far below the frequencies where readout and bearing noise rule.
_FINER = 10


@dataclass(frozen=True, slots=True, kw_only=True)
class Coefficients:
    """Results of the fits, and their input.

    Attributes
    ----------
    fits
        By method.
    per_gyro
        Each gyro's own N by three-cornered hat, with a triad; else empty.
    readout
        What the readout steps allow.
    points
        The angles that the likelihood fit is of.
    notes
        What was noticed.
    """

    fits: Mapping[FitName, Fit]
    per_gyro: Mapping[str, Estimate]
    readout: JointReadout
    points: Points
    notes: tuple[Note, ...]

    @property
    def likelihood(self) -> Fit:
        """The fit of the spectrum."""
        return self.fits["likelihood"]


def coefficients_of(
    recording: Recording,
    settings: Settings,
    *,
    left: Remainder,
    second: Remainder | None,
    points: Points,
    curve: StabilityCurve,
) -> Coefficients:
    """The three fits of what is left, and the three-cornered hat of a triad.

    Parameters
    ----------
    recording, settings
        For the readout of the gyros, which the settings name, and the interval and confidence.
    left, second
        What removal left of the measurement and, of a triad, of the first gyro less the second.
    points
        The angles that the curve is made of.
    curve
        After removal.
    """
    fine, readout = points, JointReadout()
    # An angle between samples, one a turn, has no step.
    if not left.once_a_turn:
        if settings.interval is not None:
            finer = settings.interval / _FINER
            fine = points_at(left.removal.residual, recording.sample_rate, finer)
        readout = joint_readout(recording, settings.gyros, fine.rate)
    if readout.every is None:
        likelihood = nothing_observed("likelihood", settings.confidence)
    else:
        if readout.every > 1:
            fine = Points(angle=every(fine.angle, readout.every), rate=fine.rate / readout.every)
        likelihood = _fit_likelihood(fine, settings.confidence, left.removal.masked)
    of_gyro = _from_cluster(curve, readout.time)
    fits: dict[FitName, Fit] = {
        "paper": _fit_curve("paper", of_gyro, settings),
        "weighted": _fit_curve("weighted", of_gyro, settings),
        "likelihood": likelihood,
    }
    hat = Separation(angle_random_walk={})
    if second is not None and readout.every is not None:
        hat = _hat(settings, left, second, fine, likelihood)
    return Coefficients(
        fits=fits,
        per_gyro=hat.angle_random_walk,
        readout=readout,
        points=fine,
        notes=(*readout.notes, *hat.notes, *(note for fit in fits.values() for note in fit.notes)),
    )


def with_likelihood_of(
    coefficients: Coefficients,
    points: Points,
    *,
    confidence: float,
    masked: tuple[tuple[float, float], ...],
) -> Coefficients | None:
    """The same with the likelihood fit of other angles, or None if five terms do not describe them.

    Parameters
    ----------
    coefficients
        With a likelihood fit, whose place it takes.
    points
        All of whose band is to be described.
    confidence
        Of its intervals.
    masked
        (low, high) bands to leave out, Hz.
    """
    try:
        cosine = cosine_spectrum(points.angle, kind="angle", sample_rate=points.rate)
        fit = spectrum_fit(cosine, confidence=confidence, masked=masked)
    except RecordingError:
        return None
    if fit.departure != 0.0:
        return None
    others = (note for note in coefficients.notes if note not in coefficients.likelihood.notes)
    return replace(
        coefficients,
        fits={**coefficients.fits, "likelihood": fit},
        points=points,
        notes=(*others, *fit.notes),
    )


def nothing_observed(method: FitName, confidence: float, *notes: Note) -> Fit:
    """A fit that observes nothing."""
    return Fit(
        method=method,
        coefficients={name: unobserved(name, confidence) for name in COEFFICIENT_NAMES},
        notes=notes,
    )


def _fit_likelihood(
    points: Points, confidence: float, masked: tuple[tuple[float, float], ...]
) -> Fit:
    """Likelihood fit over the widest band that the five terms describe.

    Vibration and resonances at high frequency are no gyro noise. The band is halved until chance
    explains what the terms do not; if it never does, the band with the least left over is taken.
    Lines that leave no frequencies observe nothing, and a note says so.
    """
    highest = 0.5 * points.rate
    try:
        cosine = cosine_spectrum(points.angle, kind="angle", sample_rate=points.rate)
        best = latest = spectrum_fit(cosine, confidence=confidence, masked=masked)
        while latest.departure != 0.0:
            highest *= 0.5
            if highest * points.angle.size / points.rate <= 2 * LEAST_POINTS:
                break
            latest = spectrum_fit(cosine, confidence=confidence, masked=masked, band=(0.0, highest))
            if latest.departure < best.departure:
                best = latest
    except RecordingError as error:
        note = Note(text=f"no likelihood fit: {error}", level="warning")
        return nothing_observed("likelihood", confidence, note)
    return best


def _fit_curve(
    method: Literal["paper", "weighted"],
    curve: StabilityCurve,
    settings: Settings,
) -> Fit:
    """A fit to the curve; a curve too short for it observes nothing, and says so."""
    confidence = settings.confidence
    try:
        if method == "weighted":
            return weighted_fit(curve, confidence=confidence)
        # Beside another method's answer, relative squares tell of all five terms.
        squares = settings.step_4.squares if settings.method in PUBLISHED else "relative"
        return paper_fit(curve, squares=squares, confidence=confidence)
    except RecordingError as error:
        return nothing_observed(method, confidence, Note(text=f"no {method} fit: {error}"))


def _from_cluster(curve: StabilityCurve, shortest: float) -> StabilityCurve:
    """The part of a curve at cluster times of `shortest` (s) and more."""
    kept = curve.tau >= shortest * (1.0 - 1e-9)
    names = ("tau", "deviation", "terms", "edf", "low", "high", "noise_type")
    return replace(curve, **{name: getattr(curve, name)[kept] for name in names})


def _hat(
    settings: Settings, left: Remainder, second: Remainder, fine: Points, likelihood: Fit
) -> Separation:
    """Each gyro's own N, where both searches came to an end and angles are of samples."""
    if left.once_a_turn or any(one.removal.unfinished is not None for one in (left, second)):
        return Separation(angle_random_walk={})
    first, middle, last = settings.gyros
    step = max(1, round(left.rate / fine.rate))
    # The hat uses differences only, so the first gyro may stand at zero.
    separation = three_cornered_hat(
        {
            middle: -PAIR_SIZE * every(second.removal.residual, step),
            first: np.zeros(fine.angle.size),
            last: -PAIR_SIZE * every(left.removal.residual, step),
        },
        kind="angle",
        sample_rate=fine.rate,
        confidence=settings.confidence,
        masked=left.removal.masked + second.removal.masked,
        band=(0.0, 0.0 if likelihood.band is None else likelihood.band.high),
    )
    own = separation.angle_random_walk
    return replace(separation, angle_random_walk={name: own[name] for name in settings.gyros})
