"""analyze(recording, settings) -> Analysis: the one place that composes the stages."""

import math
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Final, Literal

import numpy as np
from scipy.stats import chi2
from threadpoolctl import ThreadpoolController

from sagnac import rotation, series, spectrum
from sagnac.coefficients import paper_fit, weighted_fit
from sagnac.difference import per_gyro
from sagnac.estimates import Estimate, Fit, FitName
from sagnac.likelihood import cosine_spectrum, readout_of, spectrum_fit, three_cornered_hat
from sagnac.lines import Line, Removal, remove_lines, remove_lines_as_published
from sagnac.noise import COEFFICIENT_NAMES, taken_allan_variance
from sagnac.recording import (
    FloatArray,
    Kind,
    Recording,
    RecordingError,
    angle_of,
    require_encoder_follows,
)
from sagnac.stability import (
    Estimator,
    Gaps,
    StabilityCurve,
    equivalent_degrees_of_freedom,
    stability_curve,
    with_noise_restored,
)
from sagnac.units import ARCSECOND

Method = Literal["fos", "fos-paper", "fris", "none"]
Progress = Callable[[str, float], None]

# Many small products, a few large ones: threads would spend their time waiting for each other.
_BLAS: Final = ThreadpoolController()
# The likelihood fit takes the angle this many times as often as the curve: ten times the bins,
# and still far below the frequencies where readout and bearing noise rule.
_LIKELIHOOD_FINER: Final = 10
# Chance at which the curve, against a sound likelihood fit, calls it impossible.
_VETO: Final = 1e-4
# Samples over which a gyro's low-pass filter may still lower the curve.
_FILTERED: Final = 10.0
# Angles that a readout step has to leave for a fit. Of fewer, five terms are not told apart: even
# with white readout noise nine intervals in ten hold N, and what is estimated lies half an error
# high.
_LEAST_DITHERED: Final = 320
# A curve of fewer points than this has no cluster time whose deviation means anything.
_LEAST_POINTS: Final = 32


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """What the caller chose.

    Attributes
    ----------
    gyros
        Names: one gyro, a pair to difference, or a triad: the first less the last gives the
        curve and the answer, and with the second each gyro's own N is told apart.
    method
        How the periodic parts are removed.
    interval
        Seconds between the angles that the curve is made of (Step 4 of the paper: 1 s);
        None for every sample.
    confidence
        Of every interval.
    estimators
        Which of the Allan family to make of the same angles, with the power spectral density,
        beside the overlapping Allan deviation that the coefficients rest on.
    """

    gyros: tuple[str, ...]
    method: Method = "fos"
    interval: float | None = 1.0
    confidence: float = 0.95
    estimators: tuple[Estimator, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Spectrum:
    """Rate power spectral density, one-sided.

    Attributes
    ----------
    frequency
        (bins,), Hz.
    density
        (bins,), (rad/s)^2/Hz.
    """

    frequency: FloatArray
    density: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True)
class Analysis:
    """Everything one recording gave; what the report, the JSON and the tables are made of.

    Attributes
    ----------
    recording
        The input, as read (values included; the report takes only facts from it).
    channel
        ``x`` or ``x-z``: what the curve and the lines are of.
    gyros_differenced
        1 for a single gyro, 2 for a difference. Coefficients are per gyro already.
    table_rate
        Mean table rate, rad/s, or None at rest.
    angle_random_walk
        The answer, SI (rad/sqrt(s)), with the fit it rests on in `source`.
    fits
        By method.
    lines
        Every periodic component found, strongest first.
    curve, curve_before
        Stability of `channel` after and before removal (before: same interval).
    spectrum, spectrum_before
        Rate spectrum of `channel` after and before removal, smoothed for a figure.
    per_gyro
        With a triad: each gyro's own N by three-cornered hat; else empty.
    notes
        Every repair, refusal and doubt, in words.
    seconds
        Time by stage.
    family
        One curve for each estimator that the settings ask for.
    density
        Multitaper rate spectrum of what the curves are of, where estimators are asked for.
    """

    recording: Recording
    settings: Settings
    channel: str
    gyros_differenced: int
    table_rate: float | None
    angle_random_walk: Estimate
    source: str
    fits: Mapping[FitName, Fit]
    lines: tuple[Line, ...]
    curve: StabilityCurve
    curve_before: StabilityCurve
    spectrum: Spectrum
    spectrum_before: Spectrum
    per_gyro: Mapping[str, Estimate]
    notes: tuple[str, ...]
    seconds: Mapping[str, float]
    family: tuple[StabilityCurve, ...] = ()
    density: Spectrum | None = None


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
        channel, angle, differenced = _measured(recording, settings, where)
        if settings.method != "fris":
            # Known before the search, which takes what time there is.
            step = _interval_samples(settings.interval, recording.sample_rate)
            _require_length(-(-angle.size // step), recording.sample_rate / step, recording, where)
        table = _table(recording, settings, notes)
    with stage("spectrum"):
        spectrum_before = _spectrum(angle, recording.sample_rate)
    with stage("lines") as fraction:
        removal = _removal(
            angle, table, recording, settings, channel=channel, where=where, progress=fraction
        )
        notes += removal.notes
        second = None
        if len(settings.gyros) == 3:
            pair = replace(settings, gyros=settings.gyros[:2])
            name, other, _ = _measured(recording, pair, where)
            second = _removal(
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
        before, before_rate = _at_interval(angle, recording.sample_rate, settings.interval)
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
            fine, fine_rate = _at_interval(
                removal.residual, recording.sample_rate, settings.interval / _LIKELIHOOD_FINER
            )
        # Angles between samples, one a turn, have no step.
        readout = _Readout()
        if removal.residual is not None:
            readout = _readout(recording, settings, fine_rate)
        notes += readout.notes
        if readout.every is None:
            highest = 0.0
            likelihood = _nothing("likelihood", settings.confidence)
        else:
            if readout.every > 1:
                fine, fine_rate = series.every(fine, readout.every), fine_rate / readout.every
            likelihood, highest = _likelihood(
                fine, fine_rate, differenced, settings.confidence, removal.masked
            )
        of_gyro = _from_cluster(curve, readout.time)
        fits: dict[FitName, Fit] = {
            "paper": _curve_fit("paper", of_gyro, differenced, settings.confidence),
            "weighted": _curve_fit("weighted", of_gyro, differenced, settings.confidence),
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
    notes += curve.notes
    for one in family:
        notes += [f"{one.estimator}: {note}" for note in one.notes if note not in curve.notes]
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
            whole, whole_rate = _at_interval(
                removal.unfinished, recording.sample_rate, settings.interval
            )
            bounding = stability_curve(
                whole, kind="angle", sample_rate=whole_rate, confidence=settings.confidence
            )
        of = f"{channel} with its lines in"
    allowed = partial(_highest_allowed, bounding, differenced, recording.sample_rate, readout)
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
            _spectrum(removal.residual, recording.sample_rate)
            if removal.residual is not None
            else _spectrum(points, point_rate)
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
        table_rate=None if table is None else rotation.mean_rate(table, recording.sample_rate),
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


def multitaper_density(increments: FloatArray, sample_rate: float) -> Spectrum:
    """Multitaper rate density of angle increments (rad), in log-spaced bins."""
    return _density(spectrum.multitaper, increments, sample_rate)


def _density(
    power_of: Callable[[FloatArray], FloatArray], increments: FloatArray, sample_rate: float
) -> Spectrum:
    """One-sided rate density of angle increments (rad), averaged into log-spaced bins."""
    steps = series.less(increments, series.mean(increments))
    frequency, power = spectrum.smoothed(power_of(steps))
    return Spectrum(frequency=frequency * sample_rate, density=spectrum.density(power, sample_rate))


def _measured(recording: Recording, settings: Settings, where: str) -> tuple[str, FloatArray, int]:
    """Name, angle (rad) and number of gyros of what is measured: a gyro, or a difference."""
    names = settings.gyros
    if not 1 <= len(names) <= 3 or len(set(names)) != len(names):
        raise RecordingError(
            f"{where}: gyros {','.join(names) or '(none)'}: name one gyro, a pair or a triad, "
            "each once (--gyros x,z)"
        )
    first = angle_of(recording.gyro(names[0]), recording.sample_rate)
    if len(names) == 1:
        return names[0], first, 1
    second = angle_of(recording.gyro(names[-1]), recording.sample_rate)
    return f"{names[0]}-{names[-1]}", series.less(first, second), 2


def _table(recording: Recording, settings: Settings, notes: list[str]) -> FloatArray | None:
    """Unwrapped table angle, or None where nothing turns."""
    if recording.table is None:
        return None
    table = recording.table.values
    if not rotation.is_turning(table):
        notes.append("the table does not turn: its angle is not used")
        return None
    if settings.method == "fos" and recording.duration < rotation.SHORTEST:
        raise RecordingError(
            f"{recording.duration:.4g} s of a turning table do not tell its motion from the gyro's "
            f"noise; take {rotation.SHORTEST:g} s or more, or the standing part (--slice)"
        )
    for name in settings.gyros:
        require_encoder_follows(recording, recording.gyro(name))
    return table


@dataclass(frozen=True, slots=True, kw_only=True)
class _Removed:
    """What a method leaves: points for the curve, and the full-rate residual if it has one."""

    points: FloatArray
    point_rate: float
    residual: FloatArray | None
    lines: tuple[Line, ...] = ()
    masked: tuple[tuple[float, float], ...] = ()
    taken: FloatArray = field(default_factory=lambda: np.empty((3, 0)))
    notes: tuple[str, ...] = ()
    unfinished: FloatArray | None = None


def _removal(
    angle: FloatArray,
    table: FloatArray | None,
    recording: Recording,
    settings: Settings,
    *,
    channel: str,
    where: str,
    progress: Callable[[float], None],
) -> _Removed:
    rate = recording.sample_rate
    if settings.method == "fris":
        if table is None and recording.null_pulse is None:
            raise RecordingError(
                f"{where}: full rotation interval sampling (--method fris) needs a turning table; "
                "name its encoder (--table COLUMN:UNIT) or its null pulse (--null-pulse COLUMN), "
                "or use --method fos"
            )
        try:
            times, values = rotation.full_rotation_samples(angle, table, recording.null_pulse)
        except RecordingError as error:
            raise RecordingError(f"{where}: table: {error}") from None
        turn_rate = (times.size - 1) / (times[-1] - times[0]) * rate
        note = (
            f"full rotation interval sampling: {times.size} angles, one a turn, every "
            f"{1.0 / turn_rate:.4g} s; the interval asked for plays no part. Lines in time are "
            "still in, folded at that interval: value and bounds may be wrong either way (use "
            "--method fos)"
        )
        return _Removed(points=values, point_rate=turn_rate, residual=None, notes=(note,))
    if settings.method == "fos-paper":
        # Each gyro first, then the difference: Eq. 21.
        parts = [
            remove_lines_as_published(
                angle_of(recording.gyro(name), rate), table, rate, channel=name, progress=progress
            )
            for name in dict.fromkeys((settings.gyros[0], settings.gyros[-1]))
        ]
        rest = parts[0].residual
        if len(parts) > 1:
            rest = series.less(rest, parts[1].residual)
        removal = Removal(
            residual=rest,
            lines=tuple(line for part in parts for line in part.lines),
            masked=tuple(band for part in parts for band in part.masked),
            taken=np.empty((3, 0)),
            notes=(
                "fos-paper lowers the mean square of an angle, and so takes the random walk's slow "
                "wander with the lines: value and bounds may lie below the truth (use --method "
                "fos)",
                *(note for part in parts for note in part.notes),
            ),
        )
    elif settings.method == "none":
        left_in = (
            "no line was removed: on a turning table the value and its bounds are of table motion "
            "and lines, not of the gyro (use --method fos)"
        )
        removal = Removal(
            residual=angle,
            lines=(),
            masked=(),
            taken=np.empty((3, 0)),
            notes=() if table is None else (left_in,),
        )
    else:
        removal = remove_lines(angle, table, rate, channel=channel, progress=progress)
    points, point_rate = _at_interval(removal.residual, rate, settings.interval)
    return _Removed(
        points=points,
        point_rate=point_rate,
        residual=removal.residual,
        lines=removal.lines,
        masked=removal.masked,
        taken=removal.taken,
        notes=removal.notes,
        unfinished=removal.unfinished,
    )


def _at_interval(
    angle: FloatArray, sample_rate: float, interval: float | None
) -> tuple[FloatArray, float]:
    """Every so-many-th angle (Step 4), and their rate."""
    step = _interval_samples(interval, sample_rate)
    return (angle if step == 1 else series.every(angle, step)), sample_rate / step


def _interval_samples(interval: float | None, sample_rate: float) -> int:
    """The nearest whole number of samples in an interval; 1 where none is asked for."""
    return 1 if interval is None else max(1, round(interval * sample_rate))


def _curve_fit(
    method: Literal["paper", "weighted"], curve: StabilityCurve, differenced: int, confidence: float
) -> Fit:
    """One of the two fits to the curve; a curve too short for it observes nothing, and says so."""
    fit = paper_fit if method == "paper" else weighted_fit
    try:
        return fit(curve, gyros_differenced=differenced, confidence=confidence)
    except RecordingError as error:
        return _nothing(method, confidence, f"no {method} fit: {error}")


def _nothing(method: FitName, confidence: float, *notes: str) -> Fit:
    """A fit that observes nothing."""
    nothing = Estimate(
        value=np.nan, low=np.nan, high=np.nan, confidence=confidence, status="not observable"
    )
    return Fit(method=method, coefficients=dict.fromkeys(COEFFICIENT_NAMES, nothing), notes=notes)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Readout:
    """What the readouts of all gyros together allow.

    `step` is the sum of their steps, rad. Of angles taken `every` so many, `time` seconds apart,
    they are dithered. `every` is None where too few are left for a fit, and `time` is infinite
    where they are dithered at no time.
    """

    step: float = 0.0
    every: int | None = 1
    time: float = 0.0
    notes: tuple[str, ...] = ()


def _readout(recording: Recording, settings: Settings, angle_rate: float) -> _Readout:
    """What the gyros' readouts allow of angles taken at `angle_rate`, Hz."""
    taken = round(recording.sample_rate / angle_rate)
    readouts = {}
    for name in settings.gyros:
        angle = angle_of(recording.gyro(name), recording.sample_rate)
        readouts[name] = readout_of(angle if taken == 1 else series.every(angle, taken))
    step = sum(readout.step for readout in readouts.values())
    undithered = {name: readout for name, readout in readouts.items() if readout.every != 1}
    if not undithered:
        return _Readout(step=step)
    largest = max(readout.step for readout in undithered.values()) / ARCSECOND
    what = f"the readout step of {', '.join(undithered)} ({largest:.3g} arcsec)"
    counts = [readout.every for readout in undithered.values() if readout.every is not None]
    apart = max(counts) / angle_rate if len(counts) == len(undithered) else math.inf
    if not recording.duration / apart >= _LEAST_DITHERED:
        note = (
            f"{recording.duration:.4g} s dither {what} too few times for a fit to tell angle "
            "random walk from it, and only an upper bound is given; record longer, or read out "
            "finer"
        )
        return _Readout(step=step, every=None, time=apart, notes=(note,))
    note = (
        f"nothing dithers {what} in less than {apart:.4g} s: coefficients are of angles that far "
        "apart, and the curve at shorter cluster times shows the readout"
    )
    return _Readout(step=step, every=max(counts), time=apart, notes=(note,))


def _from_cluster(curve: StabilityCurve, shortest: float) -> StabilityCurve:
    """The part of a curve at cluster times of `shortest` (s) and more."""
    kept = curve.tau >= shortest * (1.0 - 1e-9)
    return replace(
        curve,
        tau=curve.tau[kept],
        deviation=curve.deviation[kept],
        terms=curve.terms[kept],
        edf=curve.edf[kept],
        low=curve.low[kept],
        high=curve.high[kept],
        noise_type=curve.noise_type[kept],
    )


def _likelihood(
    angle: FloatArray,
    sample_rate: float,
    differenced: int,
    confidence: float,
    masked: tuple[tuple[float, float], ...],
) -> tuple[Fit, float]:
    """Likelihood fit over the widest band that the five terms describe, and its upper edge, Hz.

    Vibration and resonances at high frequency are no gyro noise; the band is halved until
    chance explains what is left, and where it never does, the band with the least is taken.
    """
    best: tuple[Fit, float] | None = None
    highest = 0.5 * sample_rate
    cosine = cosine_spectrum(angle, kind="angle", sample_rate=sample_rate)
    while best is None or highest * angle.size / sample_rate > 2 * _LEAST_POINTS:
        fit = spectrum_fit(
            cosine,
            gyros_differenced=differenced,
            confidence=confidence,
            masked=masked,
            band=None if best is None else (0.0, highest),
        )
        if best is None or fit.departure < best[0].departure:
            best = fit, highest
        if fit.departure == 0.0:
            break
        highest *= 0.5
    return best


def _highest_allowed(
    curve: StabilityCurve,
    differenced: int,
    sample_rate: float,
    readout: _Readout,
    chance: float,
) -> tuple[float, float]:
    """Largest N that the curve allows but by `chance`, per gyro, and the cluster time of it.

    Every other term only adds to N^2 / tau, so N lies below the curve at every point. A gyro's own
    low-pass filter takes away at the shortest cluster times, which are left out. Readout steps hide
    up to two of themselves of each second difference where nothing dithers them within a cluster:
    the root of their mean square is raised by that. Where it does, a mean of few may still come out
    as zero, and is raised by the square of half a step.
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
    high = raised * np.sqrt(edf / chi2.ppf(share, edf))
    highest = np.where(curve.tau * sample_rate < _FILTERED, np.inf, high * np.sqrt(curve.tau))
    index = int(np.nanargmin(highest))
    return per_gyro(float(highest[index]) ** 2, differenced), float(curve.tau[index])


def _require_length(points: int, point_rate: float, recording: Recording, where: str) -> None:
    if points < _LEAST_POINTS:
        raise RecordingError(
            f"{where}: {recording.duration:.4g} s give {points} angles at "
            f"{1.0 / point_rate:.4g} s, and a curve needs {_LEAST_POINTS}; record longer or ask "
            f"for a shorter interval (--interval {recording.duration / (2 * _LEAST_POINTS):.2g}s)"
        )


def _spectrum(angle: FloatArray, sample_rate: float) -> Spectrum:
    """One-sided rate spectrum of an angle, averaged into log-spaced bins for a figure."""
    return _density(spectrum.periodogram, series.differences(angle), sample_rate)
