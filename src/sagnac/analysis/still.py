"""The still bench: one gyro as it is, every estimator asked for, gaps or none."""

import math
from dataclasses import replace
from typing import Final

import numpy as np

from sagnac import series
from sagnac.analysis.pipeline import analyze, stability_family
from sagnac.analysis.result import Analysis
from sagnac.analysis.settings import Progress, Settings
from sagnac.analysis.spectra import Spectrum, multitaper_density
from sagnac.arrays import FloatArray
from sagnac.coefficients.estimates import Estimate
from sagnac.errors import RecordingError
from sagnac.recording.gaps import longest_whole_stretch
from sagnac.recording.kinds import angle_of
from sagnac.recording.model import Channel, Recording
from sagnac.stability.curve import StabilityCurve, stability_curve


def has_gaps(recording: Recording, gyro: str) -> bool:
    """Whether a sample of the gyro is missing."""
    values = recording.gyro(gyro).values
    return any(np.isnan(values[span]).any() for span in series.through(values.size, values))


def at_rest(
    recording: Recording, settings: Settings, *, progress: Progress | None = None
) -> tuple[Analysis, Analysis]:
    """Curve and coefficients of one gyro, and what they would be without its lines.

    With missing samples (NaN) the curves are of the whole recording, less the terms that touch
    a gap; coefficients, lines and spectra are of its longest stretch without a gap, and where
    that is too short for them they are not there.

    Parameters
    ----------
    recording
        Its table is not looked at.
    settings
        Of one gyro. With the method ``none`` the lines are searched for all the same.
    progress
        Called with the stage and the fraction of it done.

    Returns
    -------
    analysis
        By the method chosen, its lines listed.
    without_lines
        The same with the lines removed.

    Raises
    ------
    RecordingError
        If the recording cannot give what `settings` ask for.
    """
    recording = replace(recording, table=None, null_pulse=None)
    (name,) = settings.gyros
    if has_gaps(recording, name):
        return _with_gaps(recording, name, settings, progress)
    return _whole(recording, settings, progress)


def _whole(
    recording: Recording, settings: Settings, progress: Progress | None
) -> tuple[Analysis, Analysis]:
    analysis = analyze(recording, settings, progress=progress)
    if settings.method != "none":
        return analysis, analysis
    searched = analyze(recording, replace(settings, method="fos", estimators=()), progress=progress)
    return replace(analysis, lines=searched.lines), searched


def _with_gaps(
    recording: Recording, name: str, settings: Settings, progress: Progress | None
) -> tuple[Analysis, Analysis]:
    where = recording.provenance.path if recording.provenance else "recording"
    gyro = recording.gyro(name)
    if settings.method != "none":
        raise RecordingError(
            f"{where}: {name}: lines cannot be removed across gaps (--method {settings.method}); "
            "leave --method out, or take a whole stretch with --slice START:STOP"
        )
    values, rate = _averaged(gyro, recording.sample_rate, settings.interval)
    curve = stability_curve(
        values, kind=gyro.kind, sample_rate=rate, confidence=settings.confidence, gaps="omit"
    )
    family = stability_family(values, gyro.kind, rate, settings, gaps="omit")
    stretch, start = longest_whole_stretch(recording, name)
    span = f"{start:.6g} to {start + stretch.samples / stretch.sample_rate:.6g} s"
    try:
        analysis, without_lines = _whole(
            stretch, replace(settings, estimators=()), progress=progress
        )
        density = multitaper_density(
            series.differences(angle_of(stretch.gyro(name), stretch.sample_rate)),
            stretch.sample_rate,
        )
        note = (
            f"{name}: coefficients, lines and spectra are of the longest stretch without a gap, "
            f"{span}; the curves are of the whole recording, without the terms that touch a gap"
        )
    except RecordingError as error:
        why = str(error).removeprefix(f"{where}: ")
        analysis = without_lines = _nothing_but(curve, recording, settings)
        density = _NO_SPECTRUM
        note = (
            f"{name}: no coefficients, lines or spectra: the longest stretch without a gap, "
            f"{span}, does not give them ({why})"
        )
    # What the curve of the stretch alone noticed is of no curve that is shown.
    of_curve = [str(note) for note in analysis.curve.notes]
    of_stretch = [note for note in analysis.notes if note not in of_curve]
    noticed = [*recording.notes, note, *of_stretch, *curve.notes]
    for one in family:
        noticed += [f"{one.estimator}: {noted}" for noted in one.notes if noted not in curve.notes]
    analysis = replace(
        analysis,
        recording=recording,
        settings=settings,
        source=f"{analysis.source} (of {span})" if analysis.fits else analysis.source,
        curve=curve,
        curve_before=curve,
        family=family,
        density=density,
        notes=tuple(dict.fromkeys(noticed)),
    )
    return analysis, without_lines


def _averaged(
    gyro: Channel, sample_rate: float, interval: float | None
) -> tuple[FloatArray, float]:
    """Samples at the interval of the curve, missing where one that they take is; their rate."""
    step = 1 if interval is None else max(1, round(interval * sample_rate))
    if step == 1 or gyro.kind == "angle":
        return gyro.values[::step], sample_rate / step
    whole = gyro.values[: gyro.values.size // step * step].reshape(-1, step)
    return (whole.mean(axis=1) if gyro.kind == "rate" else whole.sum(axis=1)), sample_rate / step


def _nothing_but(curve: StabilityCurve, recording: Recording, settings: Settings) -> Analysis:
    return Analysis(
        recording=recording,
        settings=settings,
        channel=settings.gyros[0],
        gyros_differenced=1,
        table_rate=None,
        angle_random_walk=Estimate(
            value=math.nan,
            low=math.nan,
            high=math.nan,
            confidence=settings.confidence,
            status="not observable",
        ),
        source="no stretch without a gap is long enough",
        fits={},
        lines=(),
        curve=curve,
        curve_before=curve,
        spectrum=_NO_SPECTRUM,
        spectrum_before=_NO_SPECTRUM,
        per_gyro={},
        notes=(),
        seconds={},
    )


_NO_SPECTRUM: Final = Spectrum(frequency=np.empty(0), density=np.empty(0))
