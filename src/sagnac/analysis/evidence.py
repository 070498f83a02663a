"""All that an answer is read from: the angles at the interval, their curves, and their fits."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from sagnac.analysis.measurement import Measurement, Remainder, TurningTable
from sagnac.analysis.settings import PUBLISHED, Settings
from sagnac.core.arrays import FloatArray, every
from sagnac.core.errors import Level, Note, RecordingError
from sagnac.lines.model import Line
from sagnac.lines.naming import taken_allan_variance, with_noise_restored
from sagnac.noise.cosine_spectrum import cosine_spectrum
from sagnac.noise.curve_fit import paper_fit, weighted_fit
from sagnac.noise.estimates import Fit, FitName, unobserved
from sagnac.noise.fit import spectrum_fit
from sagnac.noise.laws import COEFFICIENT_NAMES
from sagnac.quality.readout import Readout, joint_readout
from sagnac.recording.model import Recording
from sagnac.stability import Estimator
from sagnac.stability.curve import StabilityCurve, stability_curve

# A curve of fewer points than this has no cluster time whose deviation means anything.
LEAST_POINTS = 32

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
    remainders
        What removal left of it; of a triad, of the first gyro less the second, too.
    curve, curve_before
        With the periodic parts removed, and with all of them in.
    family
        After removal, one for each estimator asked for.
    taken
        (points of `curve`,) Allan variance of the noise that went with the lines, (rad/s)^2.
    fine, readout
        The angles that the likelihood fit is of, and what the readout steps of the gyros allow.
    fits
        By method.
    bare
        Whether it has no more than the answer rests on: no fits of the curve beside it.
    """

    recording: Recording
    corrected: Recording
    settings: Settings
    measured: Measurement
    table: TurningTable
    findings: tuple[Note, ...]
    remainders: tuple[Remainder, ...]
    curve: StabilityCurve
    curve_before: StabilityCurve
    family: tuple[StabilityCurve, ...]
    taken: FloatArray
    fine: Points
    readout: Readout
    fits: Mapping[FitName, Fit]
    bare: bool

    @property
    def lines(self) -> tuple[Line, ...]:
        """Lines of the measurement and of the second pair."""
        return tuple(line for one in self.remainders for line in one.removal.lines)

    @property
    def left(self) -> Remainder:
        """What removal left of the measurement."""
        return self.remainders[0]

    @property
    def masked(self) -> Bands:
        """(low, high) bands whose noise went with the lines, Hz."""
        return self.left.removal.masked

    @property
    def how(self) -> dict[str, Any]:
        """Masked bands and confidence, as each reading of a spectrum takes them."""
        return {"masked": self.masked, "confidence": self.settings.confidence}


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
    given = f"{duration:.4g} s give {size} angles at {1.0 / points.rate:.4g} s"
    shorter = f" or ask for a shorter interval ({{interval {interval:.2g}s}})" if is_enough else ""
    remedy = f"record longer{shorter}"
    raise RecordingError(f"{given}, and a curve needs {LEAST_POINTS}", remedy=remedy)


def curve_of(
    values: FloatArray, rate: float, settings: Settings, estimator: Estimator = "oadev", **how: Any
) -> StabilityCurve:
    """The curve of angles, or of other samples of a `kind` and with `gaps`, at the confidence.

    Raises
    ------
    RecordingError
        If the record is too short for the estimator, or has gaps that it cannot leave out.
    """
    how = {"kind": "angle", "confidence": settings.confidence, **how}
    try:
        return stability_curve(values, sample_rate=rate, estimator=estimator, **how)
    except ValueError as error:
        raise RecordingError(f"{estimator}: {error}") from None


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
    curve, removal = curve_of(points.angle, points.rate, settings), left.removal
    if not removal.taken.size:
        return curve, np.zeros(curve.tau.size)
    taken = taken_allan_variance(curve.tau, removal.taken, interval=1.0 / sample_rate)
    restored = settings.method not in PUBLISHED or settings.step_4.noise_restored
    return with_noise_restored(curve, taken, len(removal.lines), restored=restored), taken


def curve_notes(curve: StabilityCurve, family: tuple[StabilityCurve, ...]) -> tuple[Note, ...]:
    """Notes of a curve, and of a family what the curve does not have."""
    return curve.notes + tuple(
        replace(note, text=f"{one.estimator}: {note.text}")
        for one in family
        for note in one.notes
        if note not in curve.notes
    )


# ---- fits --------------------------------------------------------------------------------


def fine_points(
    recording: Recording, settings: Settings, left: Remainder, points: Points
) -> tuple[Points, Readout]:
    """The angles that the likelihood fit is of, and what the readout of the gyros allows of them.

    Parameters
    ----------
    recording, settings
        For the readout of the gyros, which the settings name, and the interval.
    left, points
        What removal left, and the angles of it that the curve is made of.
    """
    if left.once_a_turn:
        # An angle between samples has no step.
        return points, Readout()
    if settings.interval is not None:
        # Ten times the bins of the curve, and still far below the frequencies where readout and
        # bearing noise rule.
        points = points_at(left.removal.residual, recording.sample_rate, settings.interval / 10)
    readout = joint_readout(recording, settings.gyros, points.rate)
    dithered = None if readout.every is None else readout.time
    return points_at(points.angle, points.rate, dithered), readout


def fits_of(
    curve: StabilityCurve,
    fine: Points,
    readout: Readout,
    masked: Bands,
    settings: Settings,
    *,
    bare: bool,
) -> dict[FitName, Fit]:
    """The three fits; one that is not possible observes nothing, and says so.

    Parameters
    ----------
    curve
        After removal.
    fine, readout
        Of `fine_points`.
    masked
        Bands that the spectrum lacks, Hz.
    settings
        Method, reading of Step 4 and confidence.
    bare
        Whether to leave out the fits of the curve that the answer does not rest on.
    """
    confidence, by_paper = settings.confidence, settings.method in PUBLISHED
    resolved = curve.tau >= readout.time * (1.0 - 1e-9)
    names = ("tau", "deviation", "terms", "edf", "low", "high", "noise_type")
    of_gyro = replace(curve, **{name: getattr(curve, name)[resolved] for name in names})
    # Beside another method's answer, relative squares tell of all five terms.
    squares = settings.step_4.squares if by_paper else "relative"
    nothing = {name: unobserved(name, confidence) for name in COEFFICIENT_NAMES}

    wanted: dict[FitName, Callable[[], Fit]] = {}
    if by_paper or not bare:
        wanted["paper"] = partial(paper_fit, of_gyro, squares=squares, confidence=confidence)
    if not bare:
        wanted["weighted"] = partial(weighted_fit, of_gyro, confidence=confidence)
    wanted["likelihood"] = partial(Fit, method="likelihood", coefficients=nothing)
    if readout.every is not None:
        wanted["likelihood"] = partial(_widest_fit, fine, confidence, masked)
    fits: dict[FitName, Fit] = {}
    for method, fit in wanted.items():
        try:
            fits[method] = fit()
        except RecordingError as error:
            level: Level = "warning" if method == "likelihood" else "remark"
            note = Note(text=f"no {method} fit: {error}", level=level)
            fits[method] = Fit(method=method, coefficients=nothing, notes=(note,))
    return fits


def _widest_fit(points: Points, confidence: float, masked: Bands) -> Fit:
    """Likelihood fit over the widest band that the five terms describe.

    Vibration and resonances at high frequency are no gyro noise. The band is halved until chance
    explains what the terms do not; if it never does, the band with the least left over is taken.
    """
    cosine = cosine_spectrum(points.angle, kind="angle", sample_rate=points.rate)
    bands: list[tuple[float, float] | None] = [None]
    highest = 0.25 * points.rate
    while highest * points.angle.size / points.rate > 2 * LEAST_POINTS:
        bands.append((0.0, highest))
        highest *= 0.5
    return spectrum_fit(cosine, confidence=confidence, masked=masked, bands=bands)
