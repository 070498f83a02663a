"""Angles at the interval of the curve, and the curves made of them."""

from dataclasses import dataclass

import numpy as np

from sagnac.analysis.measurement import Measurement
from sagnac.analysis.removal import Remainder
from sagnac.analysis.settings import PUBLISHED, Settings
from sagnac.arrays import FloatArray, every
from sagnac.errors import Note, RecordingError
from sagnac.lines.naming import taken_allan_variance, with_noise_restored
from sagnac.recording.model import Kind
from sagnac.stability import Gaps
from sagnac.stability.curve import StabilityCurve, stability_curve

# A curve of fewer points than this has no cluster time whose deviation means anything.
LEAST_POINTS = 32
# An interval that is rounded to whole samples by less than this share of it is not worth a note.
_ROUNDED = 0.01


@dataclass(frozen=True, slots=True, kw_only=True)
class Points:
    """Angles taken evenly.

    Attributes
    ----------
    angle
        (points,) rad.
    rate
        Hz.
    """

    angle: FloatArray
    rate: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Curves:
    """Stability of what is measured.

    Attributes
    ----------
    after, before
        With the periodic parts removed, and with all of them in.
    family
        After removal, one for each estimator asked for.
    taken
        (points of `after`,) Allan variance of the noise that went with the lines, (rad/s)^2.
    """

    after: StabilityCurve
    before: StabilityCurve
    family: tuple[StabilityCurve, ...]
    taken: FloatArray

    @property
    def notes(self) -> tuple[Note, ...]:
        """Notes of the curves; one that all of the family have, once."""
        return (*self.after.notes, *family_notes(self.family, self.after))


def points_at(angle: FloatArray, sample_rate: float, interval: float | None) -> Points:
    """Every angle at an interval (Step 4), the nearest whole number of samples; None for all."""
    step = 1 if interval is None else max(1, round(interval * sample_rate))
    return Points(angle=angle if step == 1 else every(angle, step), rate=sample_rate / step)


def points_of(left: Remainder, interval: float | None) -> Points:
    """The angles that the curve is made of; those taken once a turn are what they are."""
    return points_at(left.removal.residual, left.rate, None if left.once_a_turn else interval)


def rounding_note(points: Points, interval: float | None) -> tuple[Note, ...]:
    """Said where an interval asked for is no whole number of samples."""
    if interval is None or abs(interval * points.rate - 1.0) <= _ROUNDED:
        return ()
    return (
        Note(
            text=f"interval {interval:g} s is no whole number of samples: "
            f"{1.0 / points.rate:.4g} s taken"
        ),
    )


def require_length(points: int, rate: float, duration: float) -> None:
    """Refuse a recording too short for a curve.

    Raises
    ------
    RecordingError
        If it gives fewer than `LEAST_POINTS` angles; with the interval that would do.
    """
    if points < LEAST_POINTS:
        raise RecordingError(
            f"{duration:.4g} s give {points} angles at {1.0 / rate:.4g} s, and a curve needs "
            f"{LEAST_POINTS}",
            remedy="record longer or ask for a shorter interval "
            f"({{interval {duration / (2 * LEAST_POINTS):.2g}s}})",
        )


def curves_of(
    measured: Measurement,
    left: Remainder,
    points: Points,
    before: Points,
    settings: Settings,
) -> Curves:
    """The curves after and before removal, the noise that went with the lines given back.

    A reading of Step 4 that puts none back leaves it out of the paper's methods.

    Parameters
    ----------
    measured, left
        The angle, and what removal left of it.
    points, before
        The angles at the interval of the curve after and before removal.
    settings
        Method, reading of Step 4, confidence and estimators.
    """
    after = allan_curve(points, settings.confidence)
    removal = left.removal
    taken = np.zeros(after.tau.size)
    if removal.taken.size:
        taken = taken_allan_variance(after.tau, *removal.taken, interval=1.0 / measured.sample_rate)
        restored = settings.method not in PUBLISHED or settings.step_4.noise_restored
        after = with_noise_restored(after, taken, len(removal.lines), restored=restored)
    same = before.angle is points.angle
    return Curves(
        after=after,
        taken=taken,
        before=after if same else allan_curve(before, settings.confidence),
        family=family_of(points.angle, "angle", points.rate, settings),
    )


def allan_curve(points: Points, confidence: float) -> StabilityCurve:
    """Overlapping Allan deviation of angles."""
    return stability_curve(
        points.angle, kind="angle", sample_rate=points.rate, confidence=confidence
    )


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


def family_notes(family: tuple[StabilityCurve, ...], beside: StabilityCurve) -> tuple[Note, ...]:
    """Notes of the curves of a family that `beside` does not have."""
    return tuple(
        Note(text=f"{curve.estimator}: {note.text}", level=note.level, channel=note.channel)
        for curve in family
        for note in curve.notes
        if note not in beside.notes
    )
