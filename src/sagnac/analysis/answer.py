"""What the headline rests on: the likelihood fit, or a bound from the curve."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.special import gammaincinv

from sagnac.analysis.curves import allan_curve, points_at
from sagnac.analysis.fits import Coefficients
from sagnac.analysis.measurement import Measurement
from sagnac.analysis.removal import Remainder
from sagnac.analysis.settings import Settings
from sagnac.coefficients.estimates import Estimate
from sagnac.errors import Note
from sagnac.recording.difference import per_gyro
from sagnac.recording.readout import JointReadout
from sagnac.stability.curve import StabilityCurve
from sagnac.stability.degrees_of_freedom import equivalent_degrees_of_freedom

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
    """

    estimate: Estimate
    source: str
    notes: tuple[Note, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class CurveBound:
    """Largest N of one gyro that a curve allows, rad/sqrt(s), and the cluster time of it, s."""

    value: float
    tau: float


def headline_of(
    measured: Measurement,
    left: Remainder,
    curve: StabilityCurve,
    coefficients: Coefficients,
    settings: Settings,
) -> Headline:
    """The likelihood fit where the curve allows what it says, else a bound from the curve.

    Parameters
    ----------
    measured, left
        The angle, and what removal left of it.
    curve
        After removal.
    coefficients
        The fits.
    settings
        Confidence and interval.
    """
    fit = coefficients.fits["likelihood"]
    answer = fit.coefficients["angle_random_walk"]
    bounding, channel = curve, measured.channel
    if left.removal.unfinished is not None:
        # Lines only raise a curve; half of a search can lower it.
        whole = points_at(left.removal.unfinished, measured.sample_rate, settings.interval)
        bounding = allan_curve(whole, settings.confidence, measured.gyros_differenced)
        channel = f"{channel} with its lines in"

    def allowed(chance: float) -> CurveBound:
        return highest_allowed(
            bounding,
            coefficients.readout,
            chance,
            gyros_differenced=measured.gyros_differenced,
            sample_rate=measured.sample_rate,
        )

    # A fit that is known not to describe its spectrum yields to the curve much sooner.
    veto = allowed(_VETO if fit.departure == 0.0 else 1.0 - settings.confidence)
    if left.removal.unfinished is not None:
        notes: tuple[Note, ...] = (_search_without_end(measured.channel),)
    elif answer.status == "not observable":
        notes = ()
    elif answer.low > veto.value:
        notes = (_asks_for_too_much(measured.channel, veto.tau),)
    else:
        points = coefficients.points
        return Headline(
            estimate=answer,
            source=f"likelihood fit of the spectrum of {points.angle.size} angles of {channel} "
            f"at {1.0 / points.rate:.4g} s, to {coefficients.highest:.4g} Hz",
        )
    bound = allowed(1.0 - settings.confidence).value
    return Headline(
        estimate=Estimate(
            value=bound,
            low=0.0,
            high=bound,
            confidence=settings.confidence,
            status="upper bound",
            name="angle_random_walk",
        ),
        source=f"lowest point of the curve of {channel} against the slope of the ARW",
        notes=notes,
    )


def _search_without_end(channel: str) -> Note:
    return Note(
        level="warning",
        text=f"the search for the lines of {channel} did not come to an end, and the noise that "
        "it leaves is not to be trusted: only an upper bound is given, with all lines in; "
        "take a stretch on which the table turns evenly ({slice})",
    )


def _asks_for_too_much(channel: str, tau: float) -> Note:
    return Note(
        level="warning",
        text=f"the likelihood fit of {channel} asks for more angle random walk than the curve "
        f"shows at {tau:.4g} s: the five terms do not describe this spectrum, and only an upper "
        "bound is given",
    )


def highest_allowed(
    curve: StabilityCurve,
    readout: JointReadout,
    chance: float,
    *,
    gyros_differenced: int,
    sample_rate: float,
) -> CurveBound:
    """Largest N that the curve allows except with probability `chance`.

    Every other term only adds to N^2 / tau, so N lies below the curve at every point. A gyro's own
    low-pass filter lowers the shortest cluster times, which are left out. If nothing dithers the
    readout within a cluster, its steps hide up to two steps of each second difference: the
    deviation is raised by the root of their mean square. If something does, a mean of few may
    still come out as zero: the deviation is raised by half a step in square.
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
    # Lower limit of chi-squared; importing scipy.stats for it would take a second.
    lower = 2.0 * gammaincinv(0.5 * edf, share)
    high = raised * np.sqrt(edf / lower)
    highest = np.where(curve.tau * sample_rate < _FILTERED, np.inf, high * np.sqrt(curve.tau))
    index = int(np.nanargmin(highest))
    return CurveBound(
        value=per_gyro(float(highest[index]) ** 2, gyros_differenced), tau=float(curve.tau[index])
    )
