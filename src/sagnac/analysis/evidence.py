"""All that an answer is read from: the angles at the interval, their curves, and their fits."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from sagnac.analysis.measurement import Measurement, Remainder, TurningTable
from sagnac.analysis.settings import PUBLISHED, Settings
from sagnac.core.arrays import FloatArray, every
from sagnac.core.errors import Note, RecordingError
from sagnac.lines.model import Line
from sagnac.lines.naming import taken_allan_variance, with_noise_restored
from sagnac.noise.cosine_spectrum import cosine_spectrum
from sagnac.noise.curve_fit import paper_fit, weighted_fit
from sagnac.noise.estimates import Estimate, Fit, FitName, unobserved
from sagnac.noise.fit import spectrum_fit
from sagnac.noise.laws import COEFFICIENT_NAMES
from sagnac.noise.three_cornered_hat import Separation, three_cornered_hat
from sagnac.quality.readout import JointReadout, joint_readout
from sagnac.recording.channel import PAIR_SIZE
from sagnac.recording.model import Kind, Recording
from sagnac.stability import Gaps
from sagnac.stability.curve import StabilityCurve, stability_curve

# A curve of fewer points than this has no cluster time whose deviation means anything.
LEAST_POINTS = 32
# The likelihood fit takes the angle this many times as often as the curve: ten times the bins,
# and still far below the frequencies where readout and bearing noise rule.
_FINER = 10

Bands = tuple[tuple[float, float], ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Points:
    """Angles taken evenly.

    Attributes
    ----------
    angle
        (points,) rad, with the noise of one gyro.
    rate
        Hz.
    """

    angle: FloatArray
    rate: float


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


@dataclass(frozen=True, slots=True, kw_only=True)
class Evidence:
    """All that an answer is read from and judged by.

    Attributes
    ----------
    recording, corrected
        As read, and without dither and without the drift that follows the temperature.
    settings
        With the gyros by name, and the interval.
    measured, table
        The measurement, as `without_encoder_errors` gives it, and the table.
    findings
        The judgement of the data.
    left, second
        What removal left of it; of a triad, of the first gyro less the second, too.
    points
        The angles at the interval after removal.
    curve, curve_before
        With the periodic parts removed, and with all of them in.
    family
        After removal, one for each estimator asked for.
    taken
        (points of `curve`,) Allan variance of the noise that went with the lines, (rad/s)^2.
    coefficients
        The fits.
    """

    recording: Recording
    corrected: Recording
    settings: Settings
    measured: Measurement
    table: TurningTable
    findings: tuple[Note, ...]
    left: Remainder
    second: Remainder | None
    points: Points
    curve: StabilityCurve
    curve_before: StabilityCurve
    family: tuple[StabilityCurve, ...]
    taken: FloatArray
    coefficients: Coefficients

    @property
    def lines(self) -> tuple[Line, ...]:
        """Lines of the measurement and of the second pair."""
        return tuple(line for one in self.remainders for line in one.removal.lines)

    @property
    def remainders(self) -> tuple[Remainder, ...]:
        """The remainder of the measurement, and of the second pair of a triad."""
        return (self.left,) if self.second is None else (self.left, self.second)

    @property
    def masked(self) -> Bands:
        """(low, high) bands whose noise went with the lines, Hz."""
        return self.left.removal.masked


# ---- angles and curves -------------------------------------------------------------------


def points_at(angle: FloatArray, sample_rate: float, interval: float | None) -> Points:
    """Every angle at an interval (Step 4), the nearest whole number of samples; None for all."""
    step = 1 if interval is None else max(1, round(interval * sample_rate))
    return Points(angle=angle if step == 1 else every(angle, step), rate=sample_rate / step)


def require_length(points: Points, recording: Recording) -> None:
    """Refuse a recording too short for a curve.

    Raises
    ------
    RecordingError
        If it gives fewer than `LEAST_POINTS` angles; with the interval that would do, if any.
    """
    size, duration = points.angle.size, recording.duration
    if size >= LEAST_POINTS:
        return
    interval = max(duration / (2 * LEAST_POINTS), 1.0 / recording.sample_rate)
    is_enough = interval * LEAST_POINTS < duration
    raise RecordingError(
        f"{duration:.4g} s give {size} angles at {1.0 / points.rate:.4g} s, and a curve needs "
        f"{LEAST_POINTS}",
        remedy="record longer"
        + (f" or ask for a shorter interval ({{interval {interval:.2g}s}})" if is_enough else ""),
    )


def allan_curve(points: Points, confidence: float) -> StabilityCurve:
    """Overlapping Allan deviation of angles."""
    return stability_curve(
        points.angle, kind="angle", sample_rate=points.rate, confidence=confidence
    )


def curve_after(
    points: Points, left: Remainder, sample_rate: float, settings: Settings
) -> tuple[StabilityCurve, FloatArray]:
    """The curve after removal with the noise that went with the lines given back.

    A reading of Step 4 that puts none back leaves it out of the paper's methods.

    Parameters
    ----------
    points, left
        The angles at the interval of the curve, and the remainder that they are of.
    sample_rate
        Of the recording, Hz.
    settings
        Method, reading of Step 4 and confidence.

    Returns
    -------
    curve, taken
        And the Allan variance of that noise, (points,), (rad/s)^2.
    """
    curve, removal = allan_curve(points, settings.confidence), left.removal
    if not removal.taken.size:
        return curve, np.zeros(curve.tau.size)
    taken = taken_allan_variance(curve.tau, *removal.taken, interval=1.0 / sample_rate)
    restored = settings.method not in PUBLISHED or settings.step_4.noise_restored
    return with_noise_restored(curve, taken, len(removal.lines), restored=restored), taken


def family_of(
    values: FloatArray, kind: Kind, sample_rate: float, settings: Settings, gaps: Gaps = "reject"
) -> tuple[StabilityCurve, ...]:
    """The curve of each estimator that the settings ask for.

    Raises
    ------
    RecordingError
        If the record is too short for one of them, or has gaps that it cannot leave out.
    """
    curves = []
    for estimator in settings.estimators:
        try:
            curve = stability_curve(
                values,
                kind=kind,
                sample_rate=sample_rate,
                estimator=estimator,
                confidence=settings.confidence,
                gaps=gaps,
            )
        except ValueError as error:
            raise RecordingError(f"{estimator}: {error}") from None
        curves.append(curve)
    return tuple(curves)


def curve_notes(curve: StabilityCurve, family: tuple[StabilityCurve, ...]) -> tuple[Note, ...]:
    """Notes of a curve, and of a family what the curve does not have."""
    return curve.notes + tuple(
        Note(text=f"{one.estimator}: {note.text}", level=note.level, channel=note.channel)
        for one in family
        for note in one.notes
        if note not in curve.notes
    )


def upper_bound(estimate: Estimate, high: float) -> Estimate:
    """A bound in the place of an estimate."""
    return replace(estimate, value=high, low=0.0, high=high, status="upper bound")


# ---- fits --------------------------------------------------------------------------------


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
    fine, readout, confidence = points, JointReadout(), settings.confidence
    # An angle between samples, one a turn, has no step.
    if not left.once_a_turn:
        if settings.interval is not None:
            finer = settings.interval / _FINER
            fine = points_at(left.removal.residual, recording.sample_rate, finer)
        readout = joint_readout(recording, settings.gyros, fine.rate)
    hat = Separation(angle_random_walk={})
    if readout.every is None:
        likelihood = _nothing_observed("likelihood", confidence)
    else:
        if readout.every > 1:
            fine = Points(angle=every(fine.angle, readout.every), rate=fine.rate / readout.every)
        likelihood = _fit_likelihood(fine, confidence, left.removal.masked)
        if second is not None:
            hat = _hat(settings, left, second, fine, likelihood)
    of_gyro = _from_cluster(curve, readout.time)
    fits: dict[FitName, Fit] = {
        "paper": _fit_curve("paper", of_gyro, settings),
        "weighted": _fit_curve("weighted", of_gyro, settings),
        "likelihood": likelihood,
    }
    return Coefficients(
        fits=fits,
        per_gyro=hat.angle_random_walk,
        readout=readout,
        points=fine,
        notes=(*readout.notes, *hat.notes, *(note for fit in fits.values() for note in fit.notes)),
    )


def with_likelihood_of(evidence: Evidence, points: Points) -> Coefficients | None:
    """The fits with the likelihood fit of other angles, None if five terms do not describe them.

    Parameters
    ----------
    evidence
        With a likelihood fit, whose place it takes.
    points
        All of whose band is to be described.
    """
    coefficients, confidence = evidence.coefficients, evidence.settings.confidence
    try:
        cosine = cosine_spectrum(points.angle, kind="angle", sample_rate=points.rate)
        fit = spectrum_fit(cosine, confidence=confidence, masked=evidence.masked)
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


def _nothing_observed(method: FitName, confidence: float, *notes: Note) -> Fit:
    return Fit(
        method=method,
        coefficients={name: unobserved(name, confidence) for name in COEFFICIENT_NAMES},
        notes=notes,
    )


def _fit_likelihood(points: Points, confidence: float, masked: Bands) -> Fit:
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
        return _nothing_observed("likelihood", confidence, note)
    return best


def _fit_curve(
    method: Literal["paper", "weighted"], curve: StabilityCurve, settings: Settings
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
        return _nothing_observed(method, confidence, Note(text=f"no {method} fit: {error}"))


def _from_cluster(curve: StabilityCurve, shortest: float) -> StabilityCurve:
    """The part of a curve at cluster times of `shortest` (s) and more."""
    kept = curve.tau >= shortest * (1.0 - 1e-9)
    names = ("tau", "deviation", "terms", "edf", "low", "high", "noise_type")
    return replace(curve, **{name: getattr(curve, name)[kept] for name in names})


def _hat(
    settings: Settings, left: Remainder, second: Remainder, fine: Points, likelihood: Fit
) -> Separation:
    """Each gyro's own N, where both searches came to an end and angles are of samples."""
    if left.once_a_turn or not (left.is_finished and second.is_finished):
        return Separation(angle_random_walk={})
    first, middle, last = settings.gyros
    step = max(1, round(left.rate / fine.rate))
    # The hat uses differences only, so the first gyro may stand at zero.
    try:
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
    except RecordingError as error:
        # Vibration in either difference may leave no band to both.
        note = Note(text=f"no angle random walk of each gyro alone: {error}", level="warning")
        return Separation(angle_random_walk={}, notes=(note,))
    own = separation.angle_random_walk
    return replace(separation, angle_random_walk={name: own[name] for name in settings.gyros})
