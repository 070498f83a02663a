"""From a recording to its angle random walk: the one place that composes."""

import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from typing import Final

import numpy as np
from threadpoolctl import ThreadpoolController

from sagnac import series
from sagnac.analysis.answer import (
    LEAST_POINTS,
    JointReadout,
    fit_curve,
    fit_likelihood,
    from_cluster,
    highest_allowed,
    joint_readout,
    nothing_observed,
)
from sagnac.analysis.removal import (
    at_interval,
    interval_samples,
    measured_angle,
    remove_by_method,
    table_angle,
)
from sagnac.analysis.result import Analysis
from sagnac.analysis.settings import Progress, Settings
from sagnac.analysis.spectra import figure_spectrum, multitaper_density
from sagnac.arrays import FloatArray
from sagnac.coefficients.estimates import Estimate, Fit, FitName
from sagnac.coefficients.three_cornered_hat import three_cornered_hat
from sagnac.errors import RecordingError
from sagnac.lines.taken_noise import taken_allan_variance, with_noise_restored
from sagnac.recording.model import Kind, Recording
from sagnac.stability.curve import StabilityCurve, stability_curve
from sagnac.stability.estimators import Gaps
from sagnac.table.turns import mean_rate

# Many small products, a few large ones: threads would spend their time waiting for each other.
_BLAS: Final = ThreadpoolController()
# The likelihood fit takes the angle this many times as often as the curve: ten times the bins,
# and still far below the frequencies where readout and bearing noise rule.
_LIKELIHOOD_FINER: Final = 10
# Chance at which the curve, against a sound likelihood fit, calls it impossible.
_VETO: Final = 1e-4


def analyze(
    recording: Recording, settings: Settings, *, progress: Progress | None = None
) -> Analysis:
    """The angle random walk of a recording, with everything it rests on.

    Gyro difference, removal of the periodic parts by the chosen method, the stability curve
    of the angle at the chosen interval, the coefficients three ways.

    Parameters
    ----------
    recording
        With a table angle where the table turns.
    settings
        What to do.
    progress
        Called with the stage and the fraction of it done.

    Raises
    ------
    RecordingError
        If the recording cannot give what `settings` ask for; one line, with the remedy.
    """
    with _BLAS.limit(limits=1, user_api="blas"):
        return _analyze(recording, settings, progress)


def _analyze(recording: Recording, settings: Settings, progress: Progress | None) -> Analysis:
    report = progress or (lambda _stage, _fraction: None)
    seconds: dict[str, float] = {}

    @contextmanager
    def stage(name: str) -> Iterator[Callable[[float], None]]:
        began = time.perf_counter()
        report(name, 0.0)
        try:
            yield lambda fraction: report(name, fraction)
        except RecordingError as error:
            # The stages know the data, not the file they are from.
            if str(error).startswith(where):
                raise
            raise RecordingError(f"{where}: {error}") from None
        report(name, 1.0)
        seconds[name] = seconds.get(name, 0.0) + time.perf_counter() - began

    where = recording.provenance.path if recording.provenance else "recording"
    notes = list(recording.notes)
    with stage("difference"):
        channel, angle, differenced = measured_angle(recording, settings, where)
        if settings.method != "fris":
            # Known before the search, which takes what time there is.
            step = interval_samples(settings.interval, recording.sample_rate)
            _require_length(-(-angle.size // step), recording.sample_rate / step, recording, where)
        table = table_angle(recording, settings, notes)
    with stage("spectrum"):
        spectrum_before = figure_spectrum(angle, recording.sample_rate)
    with stage("lines") as fraction:
        removal = remove_by_method(
            angle, table, recording, settings, channel=channel, where=where, progress=fraction
        )
        notes += removal.notes
        second = None
        if len(settings.gyros) == 3:
            pair = replace(settings, gyros=settings.gyros[:2])
            name, other, _ = measured_angle(recording, pair, where)
            second = remove_by_method(
                other, table, recording, pair, channel=name, where=where, progress=fraction
            )
            notes += second.notes
    points, point_rate = removal.points, removal.point_rate
    asked = settings.interval
    if asked is not None and settings.method != "fris" and abs(asked * point_rate - 1.0) > 0.01:
        notes.append(
            f"interval {asked:g} s is no whole number of samples: {1.0 / point_rate:.4g} s taken"
        )
    _require_length(points.size, point_rate, recording, where)
    with stage("stability"):
        curve = stability_curve(
            points, kind="angle", sample_rate=point_rate, confidence=settings.confidence
        )
        if removal.taken.size:
            taken = taken_allan_variance(
                curve.tau, *removal.taken, interval=1.0 / recording.sample_rate
            )
            curve = with_noise_restored(curve, taken, len(removal.lines))
        before, before_rate = at_interval(angle, recording.sample_rate, settings.interval)
        curve_before = (
            curve
            if before is points
            else stability_curve(
                before, kind="angle", sample_rate=before_rate, confidence=settings.confidence
            )
        )
        family = stability_family(points, "angle", point_rate, settings)
    with stage("coefficients"):
        fine, fine_rate = points, point_rate
        if removal.residual is not None and settings.interval is not None:
            fine, fine_rate = at_interval(
                removal.residual, recording.sample_rate, settings.interval / _LIKELIHOOD_FINER
            )
        # Angles between samples, one a turn, have no step.
        readout = JointReadout()
        if removal.residual is not None:
            readout = joint_readout(recording, settings, fine_rate)
        notes += readout.notes
        if readout.every is None:
            highest = 0.0
            likelihood = nothing_observed("likelihood", settings.confidence)
        else:
            if readout.every > 1:
                fine, fine_rate = series.every(fine, readout.every), fine_rate / readout.every
            likelihood, highest = fit_likelihood(
                fine, fine_rate, differenced, settings.confidence, removal.masked
            )
        of_gyro = from_cluster(curve, readout.time)
        fits: dict[FitName, Fit] = {
            "paper": fit_curve("paper", of_gyro, differenced, settings.confidence),
            "weighted": fit_curve("weighted", of_gyro, differenced, settings.confidence),
            "likelihood": likelihood,
        }
        per_gyro_estimates: Mapping[str, Estimate] = {}
        if (
            second is not None
            and second.residual is not None
            and removal.residual is not None
            and readout.every is not None
            and removal.unfinished is None
            and second.unfinished is None
        ):
            # The hat uses differences only, so the first gyro may stand at zero.
            first_name, middle, last = settings.gyros
            step = max(1, round(recording.sample_rate / fine_rate))
            separation = three_cornered_hat(
                {
                    middle: -series.every(second.residual, step),
                    first_name: np.zeros(fine.size),
                    last: -series.every(removal.residual, step),
                },
                kind="angle",
                sample_rate=fine_rate,
                confidence=settings.confidence,
                masked=removal.masked + second.masked,
                band=(0.0, highest),
            )
            per_gyro_estimates = {
                name: separation.angle_random_walk[name] for name in settings.gyros
            }
            notes += separation.notes
        for fit in fits.values():
            notes += [note for note in fit.notes if note not in notes]
    of_curve = [str(note) for note in curve.notes]
    notes += of_curve
    for one in family:
        notes += [f"{one.estimator}: {note}" for note in one.notes if note not in of_curve]
    source = (
        f"likelihood fit of the spectrum of {fine.size} angles of {channel} at "
        f"{1.0 / fine_rate:.4g} s, to {highest:.4g} Hz"
    )
    answer = likelihood.coefficients["angle_random_walk"]
    # A fit that is known not to describe its spectrum yields to the curve much sooner.
    doubt = _VETO if likelihood.departure == 0.0 else 1.0 - settings.confidence
    bounding, of = curve, channel
    if removal.unfinished is not None:
        # Lines only raise a curve; half of a search can lower it.
        with stage("stability"):
            whole, whole_rate = at_interval(
                removal.unfinished, recording.sample_rate, settings.interval
            )
            bounding = stability_curve(
                whole, kind="angle", sample_rate=whole_rate, confidence=settings.confidence
            )
        of = f"{channel} with its lines in"
    allowed = partial(highest_allowed, bounding, differenced, recording.sample_rate, readout)
    veto, cluster = allowed(doubt)
    if removal.unfinished is not None or answer.status == "not observable" or answer.low > veto:
        bound, _ = allowed(1.0 - settings.confidence)
        if removal.unfinished is not None:
            notes.append(
                f"the search for the lines of {channel} did not come to an end, and the noise that "
                "it leaves is not to be trusted: only an upper bound is given, with all lines in; "
                "take a stretch on which the table turns evenly (--slice)"
            )
        elif answer.status != "not observable":
            notes.append(
                f"the likelihood fit of {channel} asks for more angle random walk than the curve "
                f"shows at {cluster:.4g} s: the five terms do not describe this spectrum, and "
                "only an upper bound is given"
            )
        source = f"lowest point of the curve of {of} against the slope of the ARW"
        answer = Estimate(
            value=bound,
            low=0.0,
            high=bound,
            confidence=settings.confidence,
            status="upper bound",
        )
    with stage("spectrum"):
        spectrum_after = (
            figure_spectrum(removal.residual, recording.sample_rate)
            if removal.residual is not None
            else figure_spectrum(points, point_rate)
        )
        density = None
        if settings.estimators:
            density = multitaper_density(
                series.differences(points if removal.residual is None else removal.residual),
                point_rate if removal.residual is None else recording.sample_rate,
            )
    return Analysis(
        recording=recording,
        settings=settings,
        channel=channel,
        gyros_differenced=differenced,
        table_rate=None if table is None else mean_rate(table, recording.sample_rate),
        angle_random_walk=answer,
        source=source,
        fits=fits,
        lines=removal.lines + (second.lines if second is not None else ()),
        curve=curve,
        curve_before=curve_before,
        spectrum=spectrum_after,
        spectrum_before=spectrum_before,
        per_gyro=per_gyro_estimates,
        notes=tuple(dict.fromkeys(notes)),
        seconds=seconds,
        family=family,
        density=density,
    )


def stability_family(
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


def _require_length(points: int, point_rate: float, recording: Recording, where: str) -> None:
    if points < LEAST_POINTS:
        raise RecordingError(
            f"{where}: {recording.duration:.4g} s give {points} angles at "
            f"{1.0 / point_rate:.4g} s, and a curve needs {LEAST_POINTS}; record longer or ask "
            f"for a shorter interval (--interval {recording.duration / (2 * LEAST_POINTS):.2g}s)"
        )
