"""From a recording to its angle random walk: the one place that composes."""

from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

from sagnac.analysis.alone import Run, each_alone, gyros_alone
from sagnac.analysis.averaged import Averaged
from sagnac.analysis.common_noise import sharing_of
from sagnac.analysis.corrections import Undithered, without_dither, without_temperature
from sagnac.analysis.curves import (
    Coefficients,
    Curves,
    Points,
    coefficients_of,
    curves_of,
    points_at,
    points_of,
    require_length,
    rounding_note,
)
from sagnac.analysis.encoder import answer_of_one, of_both_alike, with_latch_note
from sagnac.analysis.headline import Decision, Evidence, Headline, decide
from sagnac.analysis.measurement import Measurement, measure, require_noise, require_sound
from sagnac.analysis.removal import Remainder, remainder_of
from sagnac.analysis.result import Alone, Analysis, Answer, Covariance
from sagnac.analysis.settings import MOST_GYROS, Progress, Settings, Stages
from sagnac.analysis.spectra import figure_spectrum, multitaper_density, residual_of
from sagnac.analysis.table_angle import TurningTable, followed, settled, turning_table
from sagnac.analysis.table_shares import TableShares, table_shares
from sagnac.analysis.trust import Trust, findings_of, markov_text, merged, noticed, require_strict
from sagnac.core.arrays import differences
from sagnac.core.errors import Note, RecordingError, rounded
from sagnac.core.kernels import cache_notes, one_thread
from sagnac.lines.model import Line
from sagnac.noise.bounds import highest_terms, slow_noise, within_curve
from sagnac.noise.estimates import Estimate, unobserved
from sagnac.noise.slow_model import untold
from sagnac.quality.check import accept, judged_remainder
from sagnac.recording.model import Recording, require_recording
from sagnac.table.turns import mean_rate, turns


def analyze(
    recording: Recording,
    settings: Settings | None = None,
    *,
    progress: Progress | None = None,
    **choices: Any,
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
        Fields of `Settings`, which go before those of `settings`: ``method="none"``.

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
    settings = replace(settings or Settings(), **choices)
    with one_thread():
        found = _of_gyros(recording, settings, progress)
    forces = accelerometers_of(recording, settings, progress=progress)
    return found.with_accelerometers(forces)


def answer_of(recording: Recording, settings: Settings | None = None) -> Answer:
    """The figures of `analyze` alone: no spectra, no shares, nothing on noise in common.

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
    stages = _stages(recording, None)
    with one_thread():
        prepared = _prepared(recording, settings or Settings(), stages)
        removed = _removed(prepared, stages)
        answered = _answered(prepared, removed, stages)
        seen = _seen(prepared, _noticed(prepared, removed.left, answered))
    require_strict(seen, prepared.settings)
    trust, channel = _trust(seen, answered), prepared.followed.channel
    return Answer(
        angle_random_walk=trust.headline(answered.headline, channel).estimate,
        fits=trust.fits(answered.coefficients.fits, channel),
        lines=_lines(removed),
        curve=answered.curves.after,
        taken=answered.curves.taken,
    )


def accelerometers_of(
    recording: Recording,
    settings: Settings,
    *,
    run: Run | None = None,
    progress: Progress | None = None,
) -> Alone:
    """An analysis of each accelerometer, its lines out, and why there is none of some.

    A specific force is to its integral, a velocity, what a rate is to an angle: sums, curves and
    fits are the same, and only the units differ (`sagnac.core.units.SENSED`).

    Parameters
    ----------
    recording
        With accelerometers, or without: then there is nothing to do.
    settings
        Interval, confidence and estimators; the gyros that they name do not count, and lines in
        table angle are not sought.
    run
        What analyzes one; `analyze` unless given.
    progress
        Called with the stage and the fraction of it done.
    """
    alone = replace(settings, method="fos", specification=None)
    each = {one.name: recording.of_accelerometer(one.name) for one in recording.accelerometers}
    return each_alone(each, alone, run or analyze, progress)


def _of_gyros(recording: Recording, settings: Settings, progress: Progress | None) -> Analysis:
    """Gyros on one turning table together, at rest each alone."""
    stages = _stages(recording, progress)
    with stages.stage("difference"):
        names = settings.gyros_of(recording)
    if len(names) == 1 or turns(recording):
        return _analysis(recording, settings, stages)

    def run(each: Recording, chosen: Settings, *, progress: Progress | None = None) -> Analysis:
        return _analysis(each, chosen, _stages(each, progress))

    return gyros_alone(recording, replace(settings, gyros=names), run, progress)


def _stages(recording: Recording, progress: Progress | None) -> Stages:
    return Stages(progress, recording.path or "recording")


def _analysis(recording: Recording, settings: Settings, stages: Stages) -> Analysis:
    """The stages in their order, and what each of them gives the next."""
    prepared = _prepared(recording, settings, stages)
    removed = _removed(prepared, stages)
    answered = _answered(prepared, removed, stages)
    with stages.stage("check"):
        sharing = sharing_of(
            prepared.undithered.recording,
            prepared.followed,
            removed.left,
            answered.found,
            table=prepared.table,
            confidence=prepared.settings.confidence,
        )
        noticed = _noticed(prepared, removed.left, answered)
        slow = _slow_noise(prepared, answered.curves, answered.found)
        seen = _seen(prepared, (*noticed, *slow, *sharing.notes))
        require_strict(seen, prepared.settings)
    widened = sharing.widened(answered.headline.estimate)
    answered = replace(answered, headline=replace(answered.headline, estimate=widened))
    with stages.stage("spectrum"):
        found = _composed(prepared, removed, answered, seen)
    return replace(found, seconds=stages.seconds).with_units_of_sensor()


@dataclass(frozen=True, slots=True, kw_only=True)
class _Prepared:
    """The measurement, per gyro and as its lines are sought in, and the quality of its data."""

    recording: Recording
    settings: Settings
    undithered: Undithered
    followed: Measurement
    points: Points
    table: TurningTable
    findings: tuple[Note, ...]

    @property
    def measured(self) -> Measurement:
        """Per gyro, made anew each time: lines are sought with an array less in memory."""
        return measure(self.undithered.recording, self.settings.gyros).per_gyro()


@dataclass(frozen=True, slots=True, kw_only=True)
class _Removed:
    """The measurement after removal, and a second pair of three gyros."""

    left: Remainder
    second: Remainder | None
    points: Points

    @property
    def each(self) -> tuple[Remainder, ...]:
        return (self.left,) if self.second is None else (self.left, self.second)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Answered:
    """Curves, coefficients and the headline."""

    curves: Curves
    coefficients: Coefficients
    found: Averaged | None
    headline: Headline


def _prepared(recording: Recording, settings: Settings, stages: Stages) -> _Prepared:
    rate = recording.sample_rate
    with stages.stage("difference"):
        gyros = settings.gyros_of(recording)
        interval = settings.interval_on(turning=turns(recording))
        settings = replace(settings, gyros=gyros, interval=interval)
        require_sound(recording, gyros)
        taken = Undithered(recording=recording)
        if settings.covariates:
            taken = without_temperature(recording, gyros)
        undithered = without_dither(taken.recording, gyros, settings.method)
        undithered = replace(undithered, notes=(*taken.notes, *undithered.notes))
        difference = measure(undithered.recording, gyros)
        measured = difference.per_gyro()
        points = points_at(measured.angle, rate, interval)
        if settings.method != "fris":
            # Known before the search, which takes what time there is.
            require_length(points, recording)
        table = turning_table(undithered.recording, gyros, settings.method)
        following = followed(difference, undithered.recording, table)
        table = settled(table, following)
    with stages.stage("check"):
        findings = findings_of(recording, settings)
        require_noise(measured)
    return _Prepared(
        recording=recording,
        settings=settings,
        undithered=undithered,
        followed=following,
        points=points,
        table=table,
        findings=findings,
    )


def _removed(prepared: _Prepared, stages: Stages) -> _Removed:
    settings, recording = prepared.settings, prepared.undithered.recording
    with stages.stage("lines") as fraction:
        table = prepared.table
        left = remainder_of(prepared.followed, table.known, recording, settings, fraction)
        second = None
        if len(settings.gyros) == MOST_GYROS:
            pair = followed(measure(recording, settings.gyros[:2]), recording, table)
            second = remainder_of(pair, table.known, recording, settings, fraction)
        points = points_of(left, settings.interval)
        require_length(points, recording)
    return _Removed(left=left, second=second, points=points)


def _answered(prepared: _Prepared, removed: _Removed, stages: Stages) -> _Answered:
    settings, followed, left = prepared.settings, prepared.followed, removed.left
    with stages.stage("stability"):
        curves = curves_of(followed, left, removed.points, prepared.points, settings)
    with stages.stage("coefficients"):
        coefficients = coefficients_of(
            prepared.recording,
            settings,
            left=left,
            second=removed.second,
            points=removed.points,
            curve=curves.after,
        )
        decision = decide(
            Evidence(
                recording=prepared.recording,
                settings=settings,
                measured=followed,
                left=left,
                curve=curves.after,
                coefficients=coefficients,
            )
        )
        coefficients, found = _within_curve(prepared, curves, decision)
        headline = decision.headline
        if prepared.table.estimate is not None and not followed.is_pair:
            headline = answer_of_one(
                headline,
                followed,
                prepared.undithered.recording,
                prepared.table,
                masked=left.removal.masked,
                levels=None if found is None else found.average.angle_random_walk,
                residual=None
                if left.once_a_turn or left.removal.unfinished is not None
                else left.removal.residual,
                pair=lambda other: _of_pair(prepared, other),
                doubted=any(
                    (one.name, one.channel, one.level) == ("encoder", "table", "warning")
                    for one in prepared.findings
                ),
            )
        headline = with_latch_note(
            of_both_alike(followed, headline),
            headline.estimate,
            found,
            measured=prepared.measured,
            followed=followed,
            table=prepared.table,
        )
    return _Answered(
        curves=curves,
        coefficients=coefficients,
        found=found,
        headline=headline,
    )


def _of_pair(prepared: _Prepared, other: str) -> Estimate:
    """The angle random walk per gyro of the one that is analyzed and another, if it is sound."""
    gyros = (*prepared.settings.gyros, other)
    settings = replace(prepared.settings, gyros=gyros, estimators=(), strict=False)
    try:
        return answer_of(prepared.recording, settings).angle_random_walk
    except RecordingError:
        return unobserved("angle_random_walk", settings.confidence)


def _within_curve(
    prepared: _Prepared, curves: Curves, decision: Decision
) -> tuple[Coefficients, Averaged | None]:
    """The fit of the spectrum and the average without what contradicts the curve."""
    coefficients, found = decision.coefficients, decision.found
    lowered = 0.0 if found is None else found.roll_off.cluster_time()
    highest = highest_terms(
        curves.after,
        confidence=prepared.settings.confidence,
        shortest=max(lowered, coefficients.readout.time),
    )
    likelihood = coefficients.likelihood
    kept = replace(likelihood, coefficients=within_curve(likelihood.coefficients, highest))
    coefficients = replace(coefficients, fits={**coefficients.fits, "likelihood": kept})
    if found is not None:
        average = found.average
        limited = average.with_coefficients(within_curve(average.coefficients, highest))
        found = replace(found, average=limited)
    return coefficients, found


def _slow_noise(prepared: _Prepared, curves: Curves, found: Averaged | None) -> tuple[Note, ...]:
    """A note on a rise of the curve that no estimated term has."""
    if found is None or found.cleaned.warm_up is not None:
        return ()
    channel, terms = prepared.followed.channel, found.average.coefficients
    model = None
    if prepared.table.angle is None:
        model = untold(found.levels, found.average.rests_on, terms)
    if model is not None and model.rates:
        sensor = prepared.recording.gyros[0].sensor
        return (Note(channel=channel, text=markov_text(model.rates, sensor)),)
    rise = slow_noise(curves.after, terms)
    if rise is not None:
        shown = (
            f"at {rise.tau:.3g} s the curve lies {rounded(rise.ratio)} times above the terms that "
            "are estimated"
        )
    elif model is not None:
        shown = "the lowest frequencies of the spectrum lie above the terms that are estimated"
    else:
        return ()
    text = (
        f"slow noise, K or R or B: {shown}, and the recording does not show which of the three "
        "it is; record longer"
    )
    return (Note(channel=channel, text=text),)


def _seen(prepared: _Prepared, noticed: tuple[Note, ...]) -> tuple[Note, ...]:
    """Findings of the data, and what was noticed of what is left."""
    return merged(prepared.findings, accept(noticed, prepared.settings.accepted))


def _noticed(prepared: _Prepared, left: Remainder, answered: _Answered) -> tuple[Note, ...]:
    """Notes of the average, and the judgement of what is left of a turning table."""
    found = answered.found
    if found is None or answered.headline.by_encoder:
        # What is left is the encoder's.
        return ()
    recording, channel = prepared.undithered.recording, prepared.followed.channel
    sensor = recording.gyros[0].sensor
    notes = noticed(channel, found, sensor)
    if prepared.table.angle is None:
        return notes
    return (*notes, *_of_remainder(recording, channel, left, found))


def _of_remainder(
    recording: Recording, channel: str, left: Remainder, found: Averaged
) -> tuple[Note, ...]:
    """The judgement of what is left of a turning table, less what the average says itself."""
    if left.once_a_turn:
        return ()
    cleaned = found.cleaned
    # The answer may be of fewer angles; every sample tells more.
    increments = (
        cleaned.increments if cleaned.rate == left.rate else differences(left.removal.residual)
    )
    notes = judged_remainder(recording, channel, increments, left.rate)
    return tuple(note for note in notes if not (found.changes and note.name == "unsteady"))


def _composed(
    prepared: _Prepared,
    removed: _Removed,
    answered: _Answered,
    seen: tuple[Note, ...],
) -> Analysis:
    """The answer, and the spectra and the residual that are drawn beside it."""
    recording, settings, channel = prepared.recording, prepared.settings, prepared.followed.channel
    table, left = prepared.table.angle, removed.left
    residual, density = left.removal.residual, None
    if settings.estimators:
        density = multitaper_density(differences(residual), left.rate)
    trust = _trust(seen, answered)
    headline = trust.headline(answered.headline, channel)
    table_rates = TableShares()
    if table is not None:
        # Shares that cannot be told cost nothing else.
        with suppress(RecordingError):
            table_rates = table_shares(recording, settings.gyros, confidence=settings.confidence)
    each, found = answered.coefficients.per_gyro, answered.found
    analysis = Analysis(
        recording=recording,
        settings=settings,
        channel=channel,
        table_rate=None if table is None else mean_rate(table, recording.sample_rate),
        angle_random_walk=headline.estimate,
        source=headline.source,
        fits=trust.fits(answered.coefficients.fits, channel),
        lines=_lines(removed),
        curve=answered.curves.after,
        curve_before=answered.curves.before,
        spectrum=figure_spectrum(differences(residual), left.rate),
        spectrum_before=figure_spectrum(
            differences(prepared.measured.angle), recording.sample_rate
        ),
        per_gyro={name: trust.estimate(own, name) for name, own in each.items()},
        notes=_notes(prepared, removed, answered, headline, seen),
        seconds={},
        family=answered.curves.family,
        density=density,
        residual=residual_of(prepared.measured, left, table),
        shares=table_rates.shares,
        triad=table_rates.triad,
        masked=left.removal.masked,
    )
    if found is None:
        return analysis
    average = found.average
    return replace(
        analysis,
        levels=found.levels,
        average=average.rests_on,
        coefficients={
            **trust.coefficients(average.coefficients, channel),
            "angle_random_walk": headline.estimate,
        },
        # There is none of what is no estimate.
        covariance=None
        if trust.reasons
        else trust.covariance(Covariance(names=average.names, matrix=average.covariance), channel),
        parts=() if found.parts is None else found.parts.parts,
    )


def _trust(seen: tuple[Note, ...], answered: _Answered) -> Trust:
    return Trust.of(seen, over_parts=answered.found is not None and answered.found.changes)


def _lines(removed: _Removed) -> tuple[Line, ...]:
    return tuple(line for one in removed.each for line in one.removal.lines)


def _notes(
    prepared: _Prepared,
    removed: _Removed,
    answered: _Answered,
    headline: Headline,
    seen: tuple[Note, ...],
) -> tuple[Note, ...]:
    """All notes, in the order of the stages, each once; errors in the data come first."""
    rounding = rounding_note(removed.points, prepared.settings.interval)
    said = {note.text for note in seen}
    notes = (
        *(note for note in prepared.recording.notes if note.text not in said),
        *prepared.undithered.notes,
        *(note for note in seen if note.level == "error"),
        *prepared.table.notes,
        *(note for one in removed.each for note in one.removal.notes),
        *(() if removed.left.once_a_turn else rounding),
        *answered.coefficients.notes,
        *answered.curves.notes,
        *headline.notes,
        *seen,
        *cache_notes(),
    )
    return tuple(dict.fromkeys(notes))
