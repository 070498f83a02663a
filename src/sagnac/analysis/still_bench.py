"""The still bench: one gyro as it is, every estimator asked for, gaps or none."""

from dataclasses import dataclass, replace

import numpy as np

from sagnac.analysis.curves import family_notes, family_of
from sagnac.analysis.pipeline import analyze
from sagnac.analysis.result import Analysis
from sagnac.analysis.settings import Progress, Settings
from sagnac.analysis.spectra import Spectrum, multitaper_density
from sagnac.core.arrays import FloatArray, differences
from sagnac.core.errors import Note, RecordingError
from sagnac.noise.estimates import unobserved
from sagnac.quality.gaps import longest_whole_stretch, stuck_notes
from sagnac.recording.channel import angle_of
from sagnac.recording.model import Channel, Recording
from sagnac.recording.stamps import Places
from sagnac.stability.curve import StabilityCurve, stability_curve


@dataclass(frozen=True, slots=True, kw_only=True)
class AtRest:
    """One gyro on the still bench.

    Attributes
    ----------
    analysis
        Fits and curves by the method chosen; answer, coefficients and lines with the lines out.
    without_lines
        All of it with the lines out.
    as_it_is
        All of it by the method chosen, so that both answers may be shown.
    """

    analysis: Analysis
    without_lines: Analysis
    as_it_is: Analysis


def at_rest(
    recording: Recording,
    settings: Settings,
    *,
    progress: Progress | None = None,
    lines_in: bool = False,
) -> AtRest:
    """Curve and coefficients of one gyro, and what they would be without its lines.

    With missing samples (NaN) the curves are of the whole recording, less the terms that touch
    a gap; coefficients, lines and spectra are of its longest stretch without a gap. If that is too
    short for them they are not there.

    Parameters
    ----------
    recording
        Its table is not looked at.
    settings
        For one gyro. With the method ``none`` the lines are searched for all the same, and the
        answer is that of `analyze` with its own method.
    progress
        Called with the stage and the fraction of it done.
    lines_in
        Leave the lines in the answer as well, with the method ``none``.

    Raises
    ------
    RecordingError
        If the recording cannot give what `settings` ask for.
    """
    recording = replace(recording, table=None, null_pulse=None, accelerometers=())
    name = settings.gyros[0]
    for note in stuck_notes(recording, recording.gyro(name)):
        if note.level == "error":
            raise RecordingError.of(note, recording.path)
    if Places(values=recording.gyro(name).values, test=np.isnan).tally().count > 0:
        try:
            return _with_gaps(recording, settings, progress, lines_in=lines_in)
        except RecordingError as error:
            raise error.at(recording.path or "recording") from None
    return _whole(recording, settings, progress, lines_in=lines_in)


def _whole(
    recording: Recording, settings: Settings, progress: Progress | None, *, lines_in: bool
) -> AtRest:
    analysis = analyze(recording, settings, progress=progress)
    if settings.method != "none" or lines_in:
        return AtRest(analysis=analysis, without_lines=analysis, as_it_is=analysis)
    searched = analyze(recording, replace(settings, method="fos", estimators=()), progress=progress)
    # Vibration and lines are no angle random walk: the answer is the one without them.
    answer = replace(
        analysis,
        lines=searched.lines,
        angle_random_walk=searched.angle_random_walk,
        source=f"{searched.source}; lines removed" if searched.lines else searched.source,
        average=searched.average,
        coefficients=searched.coefficients,
        covariance=searched.covariance,
        parts=searched.parts,
        notes=_notes_of_both(analysis, searched),
    )
    return AtRest(analysis=answer, without_lines=searched, as_it_is=analysis)


def _notes_of_both(as_it_is: Analysis, searched: Analysis) -> tuple[Note, ...]:
    """Notes on the answer, which is of `searched`, and on the curves and fits as they are."""
    of_curves = (*as_it_is.curve.notes, *family_notes(as_it_is.family, as_it_is.curve))
    of_fits = tuple(note for fit in as_it_is.fits.values() for note in fit.notes)
    return tuple(dict.fromkeys((*searched.notes, *of_curves, *of_fits)))


def _with_gaps(
    recording: Recording, settings: Settings, progress: Progress | None, *, lines_in: bool
) -> AtRest:
    (name,) = settings.gyros
    gyro = recording.gyro(name)
    if settings.covariates:
        raise RecordingError(
            "temperature cannot be fitted across gaps ({covariates})",
            channel=name,
            remedy="leave {covariates} out, or take a whole stretch with {slice START:STOP}",
        )
    if settings.method != "none":
        raise RecordingError(
            f"lines cannot be removed across gaps ({{method {settings.method}}})",
            channel=name,
            remedy="leave {method} out, or take a whole stretch with {slice START:STOP}",
        )
    values, rate = _averaged(gyro, recording.sample_rate, settings.interval)
    curve = stability_curve(
        values, kind=gyro.kind, sample_rate=rate, confidence=settings.confidence, gaps="omit"
    )
    family = family_of(values, gyro.kind, rate, settings, gaps="omit")
    part, start = longest_whole_stretch(recording, name)
    span = f"{start:.6g} to {start + part.samples / part.sample_rate:.6g} s"
    try:
        found = _whole(part, replace(settings, estimators=()), progress, lines_in=lines_in)
        steps = differences(angle_of(part.gyro(name), part.sample_rate))
        density = multitaper_density(steps, part.sample_rate)
    except RecordingError as error:
        nothing = _nothing_but(curve, recording, settings)
        found = AtRest(analysis=nothing, without_lines=nothing, as_it_is=nothing)
        density = Spectrum.empty()
        why = RecordingError(error.problem, channel=error.channel, remedy=error.remedy)
        of_stretch = Note(
            channel=name,
            level="warning",
            text="no coefficients, lines or spectra: the longest stretch without a gap, "
            f"{span}, does not give them ({why})",
        )
    else:
        of_stretch = Note(
            channel=name,
            text="coefficients, lines and spectra are of the longest stretch without a gap, "
            f"{span}; the curves are of the whole recording, without the terms that touch a gap",
        )
    analysis = found.analysis
    notes = (
        *recording.notes,
        of_stretch,
        # What the curve of the stretch alone noticed is of no curve that is shown.
        *(note for note in analysis.notes if note not in analysis.curve.notes),
        *curve.notes,
        *family_notes(family, curve),
    )
    return replace(
        found,
        analysis=replace(
            analysis,
            recording=recording,
            settings=settings,
            source=f"{analysis.source} (of {span})" if analysis.fits else analysis.source,
            curve=curve,
            curve_before=curve,
            family=family,
            density=density,
            notes=tuple(dict.fromkeys(notes)),
        ),
    )


def _averaged(
    gyro: Channel, sample_rate: float, interval: float | None
) -> tuple[FloatArray, float]:
    """Samples at the interval of the curve, and their rate; missing if one they take is missing."""
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
        table_rate=None,
        angle_random_walk=unobserved("angle_random_walk", settings.confidence),
        source="no stretch without a gap is long enough",
        fits={},
        lines=(),
        curve=curve,
        curve_before=curve,
        spectrum=Spectrum.empty(),
        spectrum_before=Spectrum.empty(),
        per_gyro={},
        notes=(),
        seconds={},
    )
