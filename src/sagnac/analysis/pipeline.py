"""From a recording to its angle random walk: the one place that composes."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Final, TypedDict

from threadpoolctl import ThreadpoolController

from sagnac import series
from sagnac.analysis.averaged import Averaged, averaged
from sagnac.analysis.curves import curves_of, points_at, points_of, require_length, rounding_note
from sagnac.analysis.dither import without_dither
from sagnac.analysis.fits import coefficients_of
from sagnac.analysis.headline import Headline, headline_of
from sagnac.analysis.measurement import Measurement, measure, require_noise, turning_table
from sagnac.analysis.noticed import noticed
from sagnac.analysis.parts import Part
from sagnac.analysis.removal import Remainder, remainder_of
from sagnac.analysis.residuals import residual_of
from sagnac.analysis.result import Analysis, Covariance
from sagnac.analysis.settings import MOST_GYROS, PUBLISHED, Progress, Settings
from sagnac.analysis.shares import TableTold, told_by_table
from sagnac.analysis.sharing import sharing_notes
from sagnac.analysis.spectra import Spectrum, figure_spectrum, multitaper_density
from sagnac.analysis.stages import Stages
from sagnac.analysis.trust import Trust, findings_of, merged, require_strict
from sagnac.coefficients.estimates import Estimate
from sagnac.coefficients.laws import CoefficientName
from sagnac.coefficients.model_average import Resting
from sagnac.errors import Note
from sagnac.recording.model import Recording
from sagnac.recording.quality import accepted
from sagnac.table.turns import mean_rate

# Many small products, a few large ones: threads would spend their time waiting for each other.
_BLAS: Final = ThreadpoolController()


def analyze(
    recording: Recording, settings: Settings | None = None, *, progress: Progress | None = None
) -> Analysis:
    """The angle random walk of a recording, with everything it rests on.

    Gyro difference, removal of the periodic parts by the chosen method, the stability curve
    of the angle at the chosen interval, the coefficients three ways.

    Parameters
    ----------
    recording
        With a table angle if the table turns.
    settings
        What to do; ``Settings()`` unless given.
    progress
        Called with the stage and the fraction of it done.

    Returns
    -------
    Analysis

    Raises
    ------
    RecordingError
        If the recording cannot give what `settings` ask for; one line, with the remedy.

    Examples
    --------
    A still gyro of 1e-6 rad/sqrt(s), sampled at 10 Hz for ten minutes:

    >>> import numpy as np
    >>> rate = 1e-6 * np.sqrt(10.0) * np.random.default_rng(1).standard_normal(6000)
    >>> recording = Recording.from_arrays(x=rate, kind="rate", unit="rad/s", sample_rate=10.0)
    >>> analysis = analyze(recording)
    >>> analysis.angle_random_walk.low < 1e-6 < analysis.angle_random_walk.high
    True
    """
    stages = Stages(progress, recording.provenance.path if recording.provenance else "recording")
    with _BLAS.limit(limits=1, user_api="blas"):
        return _analysis(recording, settings or Settings(), stages)


def _analysis(recording: Recording, settings: Settings, stages: Stages) -> Analysis:
    rate, interval = recording.sample_rate, settings.interval
    with stages.stage("difference"):
        gyros = settings.gyros_of(recording)
        settings = replace(settings, gyros=gyros)
        undithered = without_dither(recording, gyros, settings.method)
        measured = measure(undithered.recording, gyros)
        before = points_at(measured.angle, rate, interval)
        if settings.method != "fris":
            # Known before the search, which takes what time there is.
            require_length(before.angle.size, before.rate, recording.duration)
        table = turning_table(recording, gyros, settings.method)
    with stages.stage("check"):
        findings = findings_of(recording, settings)
        require_noise(measured)
    with stages.stage("spectrum"):
        spectrum_before = figure_spectrum(measured.angle, rate)
    with stages.stage("lines") as fraction:
        left = remainder_of(measured, table.angle, undithered.recording, settings, fraction)
        second = None
        if len(gyros) == MOST_GYROS:
            pair = measure(undithered.recording, gyros[:2])
            second = remainder_of(pair, table.angle, undithered.recording, settings, fraction)
        points = points_of(left, interval)
        require_length(points.angle.size, points.rate, recording.duration)
    with stages.stage("stability"):
        curves = curves_of(measured, left, points, before, settings)
    with stages.stage("coefficients"):
        coefficients = coefficients_of(
            recording,
            settings,
            gyros=gyros,
            left=left,
            second=second,
            points=points,
            curve=curves.after,
        )
        found = None
        if settings.method not in PUBLISHED:
            found = averaged(
                recording,
                settings,
                measured=measured,
                gyros=gyros,
                left=left,
                coefficients=coefficients,
            )
        headline = headline_of(
            measured,
            left,
            curve=curves.after,
            coefficients=coefficients,
            found=found,
            settings=settings,
        )
    with stages.stage("check"):
        seen = _noticed(undithered.recording, measured, left, found, standing=table.angle is None)
        seen = merged(findings, accepted(seen, settings.accepted))
        require_strict(seen, settings)
        trust = Trust.of(seen)
        headline = trust.headline(headline)
    with stages.stage("spectrum"):
        spectrum = figure_spectrum(left.removal.residual, left.rate)
        density = _density(left) if settings.estimators else None
        residual = residual_of(measured, left, table.angle)
    told = TableTold()
    if table.angle is not None:
        told = told_by_table(recording, gyros, settings.confidence)
    removals = [left] if second is None else [left, second]
    notes = (
        *recording.notes,
        *undithered.notes,
        *(note for note in seen if note.level == "error"),
        *table.notes,
        *(note for one in removals for note in one.removal.notes),
        *(() if left.once_a_turn else rounding_note(points, interval)),
        *coefficients.notes,
        *curves.notes,
        *headline.notes,
        *seen,
    )
    return Analysis(
        recording=recording,
        settings=settings,
        channel=measured.channel,
        gyros_differenced=measured.gyros_differenced,
        table_rate=None if table.angle is None else mean_rate(table.angle, rate),
        angle_random_walk=headline.estimate,
        source=headline.source,
        fits=trust.fits(coefficients.fits),
        lines=tuple(line for one in removals for line in one.removal.lines),
        curve=curves.after,
        curve_before=curves.before,
        spectrum=spectrum,
        spectrum_before=spectrum_before,
        per_gyro={name: trust.estimate(own) for name, own in coefficients.per_gyro.items()},
        notes=tuple(dict.fromkeys(notes)),
        seconds=stages.seconds,
        family=curves.family,
        density=density,
        residual=residual,
        shares=told.shares,
        triad=told.triad,
        **_of_average(found, headline, trust),
    )


def _noticed(
    recording: Recording,
    measured: Measurement,
    left: Remainder,
    found: Averaged | None,
    *,
    standing: bool,
) -> tuple[Note, ...]:
    """What the average noticed; at rest also what a pair shares."""
    if found is None:
        return ()
    shared = sharing_notes(recording, measured, left, found) if standing else ()
    sensor = recording.gyros[0].sensor
    return (*noticed(measured.channel, found, measured.gyros_differenced, sensor), *shared)


class _OfAverage(TypedDict, total=False):
    """What an analysis holds of an average."""

    average: Resting
    coefficients: Mapping[CoefficientName, Estimate]
    covariance: Covariance
    parts: tuple[Part, ...]


def _of_average(found: Averaged | None, headline: Headline, trust: Trust) -> _OfAverage:
    """The coefficients with the answer among them; no covariance of what is no estimate."""
    if found is None:
        return {}
    coefficients = {
        **trust.coefficients(found.average.coefficients),
        "angle_random_walk": headline.estimate,
    }
    parts = () if found.parts is None else found.parts.parts
    if trust.reasons:
        return {
            "average": found.average.rests_on,
            "coefficients": coefficients,
            "parts": parts,
        }
    return {
        "average": found.average.rests_on,
        "coefficients": coefficients,
        "covariance": Covariance(names=found.average.names, matrix=found.average.covariance),
        "parts": parts,
    }


def _density(left: Remainder) -> Spectrum:
    return multitaper_density(series.differences(left.removal.residual), left.rate)
