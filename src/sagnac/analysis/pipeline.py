"""From a recording to its angle random walk: the one path for a bench and for a table.

Read from top to bottom: what is asked for (`analyze`, `answer_of`), the path of one measurement
(`_path`: evidence, answer, composition), channels one by one, and the still bench.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, fields, replace
from functools import partial
from typing import Any, Unpack

from sagnac.analysis import evidence as basis
from sagnac.analysis import measurement
from sagnac.analysis.averaged import Headline
from sagnac.analysis.corrections import (
    with_temperature_warnings,
    without_dither,
    without_lags,
    without_temperature,
)
from sagnac.analysis.evidence import Evidence, Points, curve_notes, curve_of, points_at
from sagnac.analysis.headline import answer
from sagnac.analysis.result import Analysis, Covariance
from sagnac.analysis.settings import MOST_GYROS, Progress, Settings, SettingsFields, Stages
from sagnac.analysis.spectra import Spectrum, multitaper_density, residual_of
from sagnac.analysis.table_shares import Share, table_shares
from sagnac.analysis.trust import findings_of, is_doubt, require_strict
from sagnac.core.arrays import differences, empty, extent
from sagnac.core.errors import Note, RecordingError, require_keywords, require_type
from sagnac.core.kernels import cache_notes, one_thread
from sagnac.lines.model import Removal
from sagnac.noise.estimates import Estimate, unobserved
from sagnac.quality.check import ACCEPTED, accept, profiles_of
from sagnac.quality.effects import effect_words
from sagnac.quality.physics import copy_notes, unequal_notes
from sagnac.quality.profile import Profile
from sagnac.quality.samples import longest_whole_stretch, stuck_notes
from sagnac.recording.channel import angle_of, same_values
from sagnac.recording.model import Channel, Recording, require_recording
from sagnac.stability import Gaps
from sagnac.stability.curve import StabilityCurve
from sagnac.table.kinematics import averages_of
from sagnac.table.turns import mean_rate, turns

Run = Callable[..., Analysis]
"""A function that analyzes a recording by settings, with a keyword `progress`."""


def analyze(
    recording: Recording,
    settings: Settings | None = None,
    *,
    progress: Progress | None = None,
    **choices: Unpack[SettingsFields],
) -> Analysis:
    """The angle random walk of a recording, with everything it rests on.

    On a turning table the gyro difference, at rest each gyro alone; removal of the periodic parts
    by the chosen method, the stability curve of the angle at the chosen interval, the coefficients
    three ways. Accelerometers are analyzed one by one.

    Parameters
    ----------
    recording
        With a table angle if the table turns.
    settings
        What to do; ``Settings()`` unless given.
    progress
        Called with the stage and the fraction of it done.
    **choices
        Fields of `Settings`, which go before those of `settings`: ``gyros``, ``method``,
        ``interval``, ``confidence``, ``estimators``, ``strict``, ``accepted``, ``specification``,
        ``published``, ``step_4``, ``covariates``.

    Returns
    -------
    Analysis
        Of several gyros at rest that of the first, and all of them in `Analysis.gyros`. A gyro
        or an accelerometer that cannot be analyzed beside others that can is in
        `Analysis.refused`.

    Raises
    ------
    RecordingError
        If the recording cannot give what `settings` ask for; one line, with the remedy.
    TypeError
        If a choice is no field of `Settings`.

    Examples
    --------
    A still gyro of 1e-6 rad/sqrt(s), sampled at 10 Hz for ten minutes:

    >>> import numpy as np
    >>> rate = 1e-6 * np.sqrt(10.0) * np.random.default_rng(1).standard_normal(6000)
    >>> recording = Recording.from_arrays(x=rate, kind="rate", unit="rad/s", sample_rate=10.0)
    >>> analysis = analyze(recording)
    >>> analysis.angle_random_walk.low < 1e-6 < analysis.angle_random_walk.high
    True
    >>> analyze(recording, confidence=0.9).settings.confidence
    0.9
    """
    require_recording(recording)
    require_keywords("analyze", choices, (*(one.name for one in fields(Settings)), "progress"))
    remedy = "give Settings(...), or its fields by name"
    require_type("settings", settings, (Settings, type(None)), remedy)
    # Settings take more types than their fields have.
    given: dict[str, Any] = {**choices}
    settings = replace(settings or Settings(), **given)

    def run(one: Recording, chosen: Settings, *, progress: Progress | None = None) -> Analysis:
        return _path(one, chosen, progress)[0]

    with one_thread():
        return _each_channel(recording, settings, run, progress)


def answer_of(recording: Recording, settings: Settings | None = None) -> tuple[Headline, Evidence]:
    """The answer of `analyze` and what it is read from: no spectra, nothing on noise in common.

    For many recordings of which nobody reads a report. A pair is differenced at rest, too, as
    the paper does.

    Parameters
    ----------
    recording, settings
        As for `analyze`.

    Raises
    ------
    RecordingError
        If the recording cannot give what `settings` ask for; one line, with the remedy.
    """
    stages = Stages(None, recording.path or "recording")
    with one_thread():
        evidence = _evidence(recording, settings or Settings(), stages, bare=True)
        with stages.stage("coefficients"):
            return answer(evidence, _of_pair, brief=True), evidence


# ---- one measurement ---------------------------------------------------------------------


def _path(
    recording: Recording,
    settings: Settings,
    progress: Progress | None,
    findings: tuple[Note, ...] | None = None,
    *,
    bare_if_taken: bool = False,
) -> tuple[Analysis, tuple[Note, ...]]:
    """The analysis, and the judgement of the data, which is made unless it is given.

    With `bare_if_taken` it has neither fits of the curve nor spectra if lines are taken out.
    """
    stages = Stages(progress, recording.path or "recording")
    evidence = _evidence(recording, settings, stages, findings, bare_if_taken=bare_if_taken)
    with stages.stage("coefficients"):
        headline = answer(evidence, _of_pair)
        if headline.spectrum is not None:
            # Nothing is read from the increments any more: an array less in memory.
            headline = replace(headline, spectrum=replace(headline.spectrum, increments=empty(0)))
    with stages.stage("spectrum"):
        analysis = _composed(evidence, headline)
    return replace(analysis, seconds=stages.seconds).with_units_of_sensor(), evidence.findings


def _evidence(
    recording: Recording,
    settings: Settings,
    stages: Stages,
    findings: tuple[Note, ...] | None = None,
    *,
    bare: bool = False,
    bare_if_taken: bool = False,
) -> Evidence:
    """The stages from a recording to what its answer is read from.

    If it is bare, it has no more than the answer rests on.
    """
    rate = recording.sample_rate
    with stages.stage("difference"):
        gyros = settings.gyros_of(recording)
        # On a turning table every second, as in Step 4 of the paper.
        interval = settings.interval or (1.0 if turns(recording) else None)
        settings = replace(settings, gyros=gyros, interval=interval)
        measurement.require_sound(recording, gyros)
        of_temperature = without_temperature if settings.covariates else with_temperature_warnings
        corrected = of_temperature(recording, gyros)
        corrected = without_dither(corrected, gyros, settings.method)
        corrected = without_lags(corrected, gyros, settings.method)
        as_it_is = measurement.measure(corrected, gyros)
        before = points_at(as_it_is.angle, rate, interval)
        before = replace(before, angle=as_it_is.noise(before.angle))
        if settings.method != "fris":
            # Known before the search, which takes what time there is.
            basis.require_length(before, recording)
        table = measurement.turning_table(corrected, gyros, settings.method)
    with stages.stage("check"):
        if findings is None:
            findings = findings_of(recording, settings)
        measurement.require_noise(as_it_is)
    with stages.stage("lines") as fraction:
        # The check before and the search after this have an array less in memory.
        measured = measurement.without_encoder_errors(as_it_is, corrected, table)
        del as_it_is
        table = measurement.with_order_phases(table, measured)
        beside = (table, corrected, settings, fraction)
        left, *_ = remainders = [measurement.remainder_of(measured, *beside)]
        if len(gyros) == MOST_GYROS:
            second = measurement.measure(corrected, gyros[:2])
            measurement.require_noise(second)
            second = measurement.without_encoder_errors(second, corrected, table)
            remainders.append(measurement.remainder_of(second, *beside))
            del second
        # Only what is left of these angles is read from here on.
        measured = replace(measured, angle=empty(0))
        points = points_at(left.removal.residual, left.rate, None if left.once_a_turn else interval)
        basis.require_length(points, recording)
        bare |= bare_if_taken and _is_taken(recording, left.removal)
    with stages.stage("stability"):
        curve, taken = basis.curve_after(points, left, rate, settings)
        nothing_taken = not left.removal.lines and same_values(before.angle, points.angle)
        curve_before = curve if nothing_taken else curve_of(before.angle, before.rate, settings)
        family = _family(points, curve if nothing_taken else None, settings)
    with stages.stage("coefficients"):
        fine, readout = basis.fine_points(recording, settings, left, points)
        fits = basis.fits_of(curve, fine, readout, left.removal.masked, settings, bare=bare)
    return Evidence(
        recording=recording,
        corrected=corrected,
        settings=settings,
        measured=measured,
        table=table,
        findings=findings,
        remainders=tuple(remainders),
        curve=curve,
        curve_before=curve_before,
        family=family,
        taken=taken,
        fine=fine,
        readout=readout,
        fits=fits,
        bare=bare,
    )


def _is_taken(recording: Recording, removal: Removal | Analysis) -> bool:
    """Whether anything was taken out of a recording at rest."""
    return bool(removal.lines or removal.masked or recording.pickoffs)


def _family(
    points: Points, curve: StabilityCurve | None, settings: Settings
) -> tuple[StabilityCurve, ...]:
    """A curve for each estimator asked for; `curve` is the overlapping one if that is known."""
    known = {} if curve is None else {curve.estimator: curve}
    of_points = partial(curve_of, points.angle, points.rate, settings)
    return tuple(known.get(one) or of_points(one) for one in settings.estimators)


def _of_pair(evidence: Evidence, other: str) -> Estimate:
    """The angle random walk per gyro of the one that is analyzed and another, if it is sound."""
    gyros = (*evidence.settings.gyros, other)
    settings = replace(evidence.settings, gyros=gyros, estimators=(), strict=False)
    try:
        return answer_of(evidence.recording, settings)[0].estimate
    except RecordingError:
        return unobserved("angle_random_walk", settings.confidence)


def _composed(evidence: Evidence, headline: Headline) -> Analysis:
    """The answer, and the spectra and the residual that are drawn beside it."""
    recording, settings, left = evidence.recording, evidence.settings, evidence.left
    table, residual, density = evidence.table.angle, left.removal.residual, None
    if settings.estimators:
        density = multitaper_density(differences(residual), left.rate)
    shares: dict[str, Share] = {}
    triad = None
    if table is not None:
        # Shares that cannot be read cost nothing else.
        with suppress(RecordingError):
            shares, triad = table_shares(recording, settings.gyros, settings.confidence)
    spectrum, spectrum_before, rest = Spectrum.empty(), Spectrum.empty(), None
    # By one sine taper: without it the floor before removal leaks from strong orders.
    drawn = partial(multitaper_density, tapers=1)
    if not evidence.bare:
        spectrum = spectrum_before = drawn(differences(residual), left.rate)
        as_it_is = measurement.measure(evidence.corrected, settings.gyros)
        before = as_it_is.noise(as_it_is.angle)
        # Here and below, an array less in memory.
        del as_it_is
        rest = residual_of(before, left, table)
        if evidence.curve_before is not evidence.curve:
            increments = differences(before)
            del before
            spectrum_before = drawn(increments, recording.sample_rate)
    analysis = Analysis(
        recording=recording,
        settings=settings,
        channel=evidence.measured.channel,
        table_rate=None if table is None else mean_rate(table, recording.sample_rate),
        angle_random_walk=headline.estimate,
        source=headline.source,
        fits=headline.fits,
        lines=evidence.lines,
        curve=evidence.curve,
        curve_before=evidence.curve_before,
        spectrum=spectrum,
        spectrum_before=spectrum_before,
        per_gyro=headline.per_gyro,
        notes=_notes(evidence, headline),
        family=evidence.family,
        density=density,
        residual=rest,
        shares=shares,
        triad=triad,
        masked=evidence.masked,
    )
    read = headline.spectrum
    if read is None:
        return analysis
    if not any(note.level == "error" for note in headline.findings):
        # There is no covariance of what is no estimate.
        covariance = Covariance(names=read.average.names, matrix=read.average.covariance)
        analysis = replace(analysis, covariance=covariance)
    coefficients = {**read.average.coefficients, "angle_random_walk": headline.estimate}
    analysis = replace(analysis, average=read.average.rests_on, coefficients=coefficients)
    return replace(analysis, levels=read.levels, parts=read.parts.parts)


def _notes(evidence: Evidence, headline: Headline) -> tuple[Note, ...]:
    """All notes, in the order of the stages, each once; errors in the data come first."""
    of_findings = {note.text.removeprefix(ACCEPTED) for note in headline.findings}
    rounding = []
    interval, rate = evidence.settings.interval, evidence.curve.sample_rate
    # Rounding by a hundredth is not worth a note.
    if not (interval is None or evidence.left.once_a_turn or abs(interval * rate - 1.0) <= 0.01):
        text = f"interval {interval:g} s is no whole number of samples: {1.0 / rate:.4g} s taken"
        rounding.append(Note(text=text))
    notes = (
        *(note for note in evidence.corrected.notes if note.text not in of_findings),
        *(note for note in headline.findings if note.level == "error"),
        *evidence.table.notes,
        *(note for one in evidence.remainders for note in one.removal.notes),
        *rounding,
        *evidence.readout.notes,
        *headline.hat.notes,
        *(note for fit in headline.fits.values() for note in fit.notes),
        *curve_notes(evidence.curve, evidence.family),
        *headline.notes,
        *headline.findings,
        *cache_notes(),
    )
    return tuple(dict.fromkeys(notes))


# ---- channels one by one -----------------------------------------------------------------


def _each_channel(
    recording: Recording, settings: Settings, run: Run, progress: Progress | None
) -> Analysis:
    """Gyros on one turning table together, at rest each alone; accelerometers one by one.

    A specific force is to its integral, a velocity, what a rate is to an angle: sums, curves and
    fits are the same, and only the units differ (`sagnac.core.units.SENSED`). Interval, confidence
    and estimators hold for accelerometers, too; their lines are taken out.

    Parameters
    ----------
    recording
        With one gyro or several.
    settings
        Of each; if they are strict, every refusal is an error.
    run
        Analyzes one channel, or the gyros of a turning table.
    progress
        Called with the stage, the channel before it if there are several, and the fraction done.

    Raises
    ------
    RecordingError
        The first refusal, if no gyro gives anything or the settings are strict.
    """
    with Stages(progress, recording.path or "recording").stage("difference"):
        settings = replace(settings, gyros=settings.gyros_of(recording))
    if len(settings.gyros) == 1 or turns(recording):
        analysis = run(recording, settings, progress=progress)
    else:
        analysis = _gyros_alone(recording, settings, run, progress)
    alone = replace(settings, method="fos", specification=None)
    forces = {one.name: recording.of_accelerometer(one.name) for one in recording.accelerometers}
    analyses, refused = _each_alone(forces, alone, run, progress)
    return replace(analysis, accelerometers=analyses, refused={**analysis.refused, **refused})


def _gyros_alone(
    recording: Recording, settings: Settings, run: Run, progress: Progress | None
) -> Analysis:
    """Several gyros at rest, each by itself; all else is of the first that is not refused."""
    recordings = dict.fromkeys(settings.gyros, recording)
    analyses, refused = _each_alone(recordings, settings, run, progress)
    if not analyses:
        raise next(iter(refused.values()))
    beside = accept(_beside_each_other(recording, analyses), settings.accepted)
    require_strict(beside, settings)
    first, *_ = each = tuple(analyses.values())
    read = first.recording.notes
    own = [(name, note) for name, one in analyses.items() for note in one.notes if note not in read]
    notes = [note if note.channel else replace(note, channel=name) for name, note in own]
    walks = {name: one.angle_random_walk for name, one in analyses.items()}
    # What is found between gyros is of each: it decides what each is told of a limit. So does what
    # puts the unit of one in doubt, since it is stated of all.
    of_each = (*beside, *filter(is_doubt, notes))
    gyros = {
        name: replace(one, notes=tuple(dict.fromkeys((*one.notes, *of_each))))
        for name, one in analyses.items()
    }
    seconds, notes_of_all = _added_seconds(each), tuple(dict.fromkeys((*read, *notes, *beside)))
    first = replace(first, settings=replace(first.settings, gyros=settings.gyros), refused=refused)
    return replace(first, per_gyro=walks, gyros=gyros, notes=notes_of_all, seconds=seconds)


def _added_seconds(analyses: Sequence[Analysis]) -> dict[str, float]:
    """Wall time by stage of several analyses together."""
    stages = dict.fromkeys(stage for one in analyses for stage in one.seconds)
    return {stage: sum(one.seconds.get(stage, 0.0) for one in analyses) for stage in stages}


def _beside_each_other(recording: Recording, analyses: Mapping[str, Analysis]) -> Iterator[Note]:
    """Findings of gyros on each other; at rest they spoil no answer, since each is taken alone.

    Gyros that were turned by hand are left out: what they share is that motion.
    """
    names = [
        name
        for name, one in analyses.items()
        if all(note.name != "motion" or note.level == "remark" for note in one.notes)
    ]
    if not names:
        return
    first, *_ = profiles_of(recording, names)
    for note in (*copy_notes(recording, first), *unequal_notes(recording, first)):
        text = note.text.removesuffix(f"; {effect_words(note.effect)}")
        # No effect on N of one alone; 0 still tells a whole copy from what comes later or in part.
        yield replace(note, level="warning", text=text, effect=0.0 if note.effect == 0.0 else None)


def _each_alone(
    recordings: Mapping[str, Recording], settings: Settings, run: Run, progress: Progress | None
) -> tuple[dict[str, Analysis], dict[str, RecordingError]]:
    """Channels one by one, and why there is none of some, which does not cost the others."""
    analyses: dict[str, Analysis] = {}
    refused: dict[str, RecordingError] = {}
    for name, recording in recordings.items():

        def report(stage: str, fraction: float, name: str = name) -> None:
            if progress is not None:
                progress(f"{name}: {stage}", fraction)

        try:
            analysis = run(recording, replace(settings, gyros=(name,)), progress=report)
        except RecordingError as error:
            if settings.strict:
                raise
            refused[name] = error
            continue
        # What reading noticed of the others is left out.
        present = analysis.recording
        others = {one.name for one in (*present.gyros, *present.accelerometers)} - {name}
        notes = tuple(note for note in analysis.notes if note.channel not in others)
        analyses[name] = replace(analysis, notes=notes)
    return analyses, refused


# ---- the still bench ---------------------------------------------------------------------


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


def still_bench(
    recording: Recording,
    settings: Settings,
    *,
    progress: Progress | None = None,
    lines_in: bool = False,
    gaps: Gaps = "omit",
) -> tuple[Analysis, dict[str, AtRest]]:
    """All gyros with the accelerometers, and each gyro with its lines in and out.

    With missing samples (NaN) the curves are of the whole recording, less the terms that touch
    a gap; coefficients, lines and spectra are of its longest stretch without a gap. If that is too
    short for them they are not there.

    Parameters
    ----------
    recording
        Its table is not looked at.
    settings
        With the method ``none`` the lines are searched for all the same, and the answer is that of
        `analyze` with its own method.
    progress
        Called with the stage and the fraction of it done.
    lines_in
        Leave the lines in the answer as well, with the method ``none``.
    gaps
        ``reject``: a channel with missing samples is refused, as `analyze` refuses it.

    Raises
    ------
    RecordingError
        If the recording cannot give what `settings` ask for.
    """
    benches: dict[str, AtRest] = {}

    def run(one: Recording, chosen: Settings, *, progress: Progress | None = None) -> Analysis:
        gyro = one.gyro(chosen.gyros[0])
        whole = partial(_with_lines_out, progress=progress, lines_in=lines_in)
        if gaps == "reject" or not math.isnan(extent(gyro.values)[0]):
            bench = whole(one, chosen)
        else:
            try:
                bench = _with_gaps(one, gyro, chosen, whole)
            except RecordingError as error:
                raise error.at(one.path or "recording") from None
        benches[gyro.name] = bench
        return bench.analysis

    recording = replace(recording, table=None, null_pulse=None)
    return _each_channel(recording, settings, run, progress), benches


def _with_lines_out(
    recording: Recording, settings: Settings, progress: Progress | None, *, lines_in: bool
) -> AtRest:
    """A gyro without gaps; an answer with its lines out beside curves with them in."""
    with one_thread():
        if settings.method != "none" or lines_in:
            analysis, _ = _path(recording, settings, progress)
            return AtRest(analysis=analysis, without_lines=analysis, as_it_is=analysis)
        search = replace(settings, method="fos", estimators=())
        searched, findings = _path(recording, search, progress, bare_if_taken=True)
        if not _is_taken(recording, searched):
            # Nothing was taken: it is the recording as it is.
            analysis = _with_family(searched, recording, settings, progress)
            return AtRest(analysis=analysis, without_lines=searched, as_it_is=analysis)
        analysis, _ = _path(recording, settings, progress, findings)
    of_fits = tuple(note for fit in analysis.fits.values() for note in fit.notes)
    notes = (*searched.notes, *curve_notes(analysis.curve, analysis.family), *of_fits)
    # Vibration and lines are no angle random walk: the answer is the one without them.
    of_answer = ("lines", "angle_random_walk", "average", "coefficients", "covariance", "parts")
    figures = {name: getattr(searched, name) for name in of_answer}
    source = f"{searched.source}; lines removed" if searched.lines else searched.source
    seconds, notes = _added_seconds((searched, analysis)), tuple(dict.fromkeys(notes))
    with_answer = replace(analysis, source=source, curve_of_answer=searched.curve, **figures)
    with_answer = replace(with_answer, notes=notes, seconds=seconds)
    return AtRest(analysis=with_answer, without_lines=searched, as_it_is=analysis)


def _with_family(
    analysis: Analysis, recording: Recording, settings: Settings, progress: Progress | None
) -> Analysis:
    """The analysis of a gyro of which nothing was taken, with the other curves and the density."""
    stages = Stages(progress, recording.path or "recording")
    with stages.stage("curves"):
        rate, angle = recording.sample_rate, measurement.measure(recording, settings.gyros).angle
        family = _family(points_at(angle, rate, settings.interval), analysis.curve, settings)
        density = multitaper_density(differences(angle), rate) if family else None
    notes = tuple(dict.fromkeys((*analysis.notes, *curve_notes(analysis.curve, family))))
    seconds = {**analysis.seconds, **stages.seconds}
    analysis = replace(analysis, settings=settings, notes=notes, seconds=seconds)
    return replace(analysis, family=family, density=density)


def _with_gaps(
    recording: Recording, gyro: Channel, settings: Settings, whole: Callable[..., AtRest]
) -> AtRest:
    """Curves of all of a gyro with missing samples, the rest of its longest whole stretch.

    `whole` makes what is made of a recording without gaps.
    """
    for note in stuck_notes(recording, Profile.of(recording, gyro)):
        raise RecordingError.of(note)
    _require_no_fit_across_gaps(gyro, settings)
    step = max(1, round((settings.interval or 0.0) * recording.sample_rate))
    values, rate = gyro.values[::step], recording.sample_rate / step
    if step > 1 and gyro.kind != "angle":
        # The mean of rates, the sum of increments; missing if one of them is.
        values = averages_of(gyro.values, step) * (step if gyro.kind == "increment" else 1.0)
    of_whole = partial(curve_of, values, rate, settings, kind=gyro.kind, gaps="omit")
    curve, family = of_whole(), tuple(map(of_whole, settings.estimators))
    part, start = longest_whole_stretch(recording, gyro.name)
    span = f"{start:.6g} to {start + part.samples / part.sample_rate:.6g} s"
    try:
        bench = whole(part, replace(settings, estimators=()))
        steps = differences(angle_of(part.gyro(gyro.name), part.sample_rate))
        density = multitaper_density(steps, part.sample_rate)
        analysis = replace(bench.analysis, source=f"{bench.analysis.source} (of {span})")
        figures = "coefficients, lines and spectra are of the longest stretch without a gap"
        curves = "the curves are of the whole recording, without the terms that touch a gap"
        of_stretch = Note(channel=gyro.name, text=f"{figures}, {span}; {curves}")
    except RecordingError as error:
        density = Spectrum.empty()
        analysis = Analysis(
            recording=recording,
            settings=settings,
            channel=gyro.name,
            table_rate=None,
            angle_random_walk=unobserved("angle_random_walk", settings.confidence),
            source="no stretch without a gap is long enough",
            curve=curve,
            curve_before=curve,
            spectrum=density,
            spectrum_before=density,
        )
        bench = AtRest(analysis=analysis, without_lines=analysis, as_it_is=analysis)
        why = RecordingError(error.problem, channel=error.channel, remedy=error.remedy)
        longest = f"the longest stretch without a gap, {span}"
        text = f"no coefficients, lines or spectra: {longest}, does not give them ({why})"
        of_stretch = Note(channel=gyro.name, level="warning", text=text)
    notes = (
        *recording.notes,
        of_stretch,
        # What the curve of the stretch alone noticed is of no curve that is shown.
        *(note for note in analysis.notes if note not in analysis.curve.notes),
        *curve_notes(curve, family),
    )
    notes = tuple(dict.fromkeys(notes))
    analysis = replace(analysis, recording=recording, settings=settings, notes=notes)
    analysis = replace(analysis, curve=curve, curve_before=curve, family=family, density=density)
    return replace(bench, analysis=analysis)


def _require_no_fit_across_gaps(gyro: Channel, settings: Settings) -> None:
    """Refuse what is fitted to a whole record.

    Raises
    ------
    RecordingError
        If lines or temperature are to be removed.
    """
    method = settings.method
    if method == "none" and not settings.covariates:
        return
    choice, cannot = "method", f"lines cannot be removed across gaps ({{method {method}}})"
    if settings.covariates:
        choice, cannot = "covariates", "temperature cannot be fitted across gaps ({covariates})"
    remedy = f"leave {{{choice}}} out, or take a whole stretch with {{slice START:STOP}}"
    raise RecordingError(cannot, channel=gyro.name, remedy=remedy)
