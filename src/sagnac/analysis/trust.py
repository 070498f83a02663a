"""Findings: what is noticed beside the noise, and whether the data bear the answer."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from sagnac.analysis.averaged import AnswerSpectrum, Headline, Parts
from sagnac.analysis.evidence import Evidence, upper_bound
from sagnac.analysis.settings import Settings
from sagnac.core.arrays import differences
from sagnac.core.errors import Level, Note, RecordingError, counted, rounded
from sagnac.core.units import SENSED, UNITS, Sensor, field_unit
from sagnac.noise.bounds import Hump, RollOff, slow_noise
from sagnac.noise.estimates import Estimate
from sagnac.noise.laws import CoefficientName
from sagnac.noise.model_average import Elsewhere
from sagnac.noise.slow_model import MarkovEstimate, untold
from sagnac.quality.check import accept, judged, judged_remainder
from sagnac.quality.distribution import Spikes
from sagnac.quality.effects import DIVIDED, doubt_of
from sagnac.recording.model import Recording, second_of

# Share of N from which on what spikes would add is worth a warning.
_ADDS: Final = 0.05


def _spectrum_notes(evidence: Evidence, headline: Headline) -> tuple[Note, ...]:
    """Notes of the spectrum, and the judgement of what is left of a turning table."""
    spectrum, channel = headline.spectrum, evidence.measured.channel
    if spectrum is None or headline.by_encoder:
        # What is left is the encoder's.
        return ()
    sensor = evidence.recording.gyros[0].sensor
    walk = spectrum.average.angle_random_walk
    notes = (
        _spikes_note(spectrum.spikes, walk, sensor),
        _warm_up_note(spectrum, evidence.recording),
        _roll_off_note(spectrum.roll_off),
        _hump_note(spectrum.hump, sensor),
        _elsewhere_note(spectrum.average.rests_on.elsewhere, walk, sensor),
        _parts_note(spectrum.parts, sensor),
    )
    noticed = tuple(replace(note, channel=channel) for note in notes if note)
    if evidence.table.angle is None or evidence.left.once_a_turn:
        return noticed
    # The answer may be of fewer angles; every sample tells more.
    left, increments = evidence.left, spectrum.increments
    if spectrum.points.rate != left.rate:
        increments = differences(left.removal.residual)
    of_remainder = judged_remainder(evidence.corrected, channel, increments, left.rate)
    # Of noise that changes the spectrum says so itself.
    return noticed + tuple(
        note for note in of_remainder if not (spectrum.changes and note.name == "unsteady")
    )


def _walk(sensor: Sensor, *values: float) -> str:
    """N, or several, in the unit of the field."""
    unit = field_unit("angle_random_walk", sensor)
    return f"{' to '.join(f'{value / unit.size:.3g}' for value in values)} {unit.symbol}"


def _spikes_note(spikes: Spikes | None, walk: Estimate, sensor: Sensor) -> Note | None:
    if spikes is None or spikes.index.size == 0:
        return None
    added = spikes.added_walk
    seen = walk.status == "estimated" and added > _ADDS * walk.value
    level: Level = "warning" if seen else "remark"
    return Note(
        name="spikes",
        effect=math.hypot(1.0, added / walk.value) if walk.status == "estimated" else None,
        level=level,
        text=f"{counted(int(spikes.index.size), 'sample')} far off their neighbours (spikes) "
        "were replaced by them for the answer; left in, they would add "
        f"{_walk(sensor, added)} to it in square",
    )


def _warm_up_note(spectrum: AnswerSpectrum, recording: Recording) -> Note | None:
    warm_up = spectrum.warm_up
    if warm_up is None:
        return None
    # At least half of the record should be left.
    is_short = 2.0 * warm_up.until_s > spectrum.increments.size / spectrum.points.rate
    # A slice counts from the start of the file, and so does the second of a sample.
    until = second_of(recording, 0) + warm_up.until_s
    left_out = "a recording begun later" if is_short else f"{{slice {until:.0f}:}}"
    unit = UNITS[SENSED[recording.gyros[0].sensor].rate_unit]
    return Note(
        name="warm-up",
        text=f"the rate settles by {warm_up.rate / unit.size:.3g} {unit} with a time "
        f"constant of {warm_up.time:.3g} s (warm-up): it was taken off for the answer, and stays "
        f"in the curve; {left_out} leaves it out, {{covariates temperature}} "
        "fits it if there is a column of temperature",
    )


def _roll_off_note(found: RollOff) -> Note | None:
    if not found.is_there:
        return None
    falls = (
        f"falls to half at {found.half:.3g} Hz"
        if math.isfinite(found.half)
        else f"falls beyond {found.frequency:.3g} Hz"
    )
    return Note(
        text=f"the spectrum {falls}, as behind a low-pass or a hump: cluster times below "
        f"{found.cluster_time():.3g} s bound nothing"
    )


def _hump_note(found: Hump | None, sensor: Sensor) -> Note | None:
    """The answer is read below a hump, behind which there is less."""
    if found is None:
        return None
    top = _walk(sensor, found.walk).split()[0]
    return Note(
        level="warning",
        text=f"the answer is read below a hump of {top} at {found.frequency:.3g} Hz, behind which "
        f"the spectrum falls to {_walk(sensor, found.least)} at {found.behind:.3g} Hz: either the "
        "sensor has a low-pass there, or the motion that makes the hump (sway of the bench) is in "
        "the answer; a quieter stretch tells",
    )


def _elsewhere_note(found: Elsewhere | None, walk: Estimate, sensor: Sensor) -> Note | None:
    """Models of another N, which the interval spans."""
    if found is None or walk.status != "estimated":
        return None
    return Note(
        level="warning",
        text=f"the spectrum is level in more than one band: {rounded(100.0 * found.share)} % "
        f"of the weight reads another {SENSED[sensor].titles['angle_random_walk']}, most of it "
        f"{_walk(sensor, found.walk)} at {found.low:.3g} to {found.high:.3g} Hz; the "
        "interval spans both",
    )


def _parts_note(parts: Parts | None, sensor: Sensor) -> Note | None:
    if parts is None or len(parts.seen) < 2:
        return None
    values = _walk(sensor, parts.smallest, parts.largest)
    reach = f"{len(parts.seen)} parts of the recording read {values}"
    walk = SENSED[sensor].titles["angle_random_walk"]
    if parts.agree:
        return Note(text=f"the {walk} is steady: {reach}, as far apart as by chance")
    if parts.walks_agree:
        effect = parts.spread
        text = (
            f"the noise in the band of the {walk} changes: {reach}, which chance could do, but "
            f"their spectra differ as if it were {rounded(effect, 3)} times as large in one as in "
            "another; the interval covers them"
        )
    else:
        effect = parts.largest / parts.smallest
        text = (
            f"the {walk} changes: {reach}, {rounded(100.0 * (effect - 1.0))} % apart, more than by "
            "chance; the interval covers them"
        )
    return Note(name="unsteady", effect=effect, level="warning", text=text)


def _slow_noise_notes(evidence: Evidence, spectrum: AnswerSpectrum) -> tuple[Note, ...]:
    """A note on a rise of the curve that no estimated term has."""
    if spectrum.warm_up is not None:
        return ()
    terms, sensor = spectrum.average.coefficients, evidence.recording.gyros[0].sensor
    model = None
    if evidence.table.angle is None:
        model = untold(spectrum.levels, spectrum.average.rests_on, terms)
    rise = slow_noise(evidence.curve, terms)
    if model is not None and model.rates:
        text = f"slow noise: {_markov_text(model.rates, sensor)}; B and K are bounds"
    elif rise is not None or model is not None:
        shown = "the lowest frequencies of the spectrum lie above the terms that are estimated"
        if rise is not None:
            shown = (
                f"at {rise.tau:.3g} s the curve lies {rounded(rise.ratio)} times above the terms "
                "that are estimated"
            )
        text = (
            f"slow noise, K or R or B: {shown}, and the recording does not show which of the three "
            "it is; record longer"
        )
    else:
        return ()
    return (Note(channel=evidence.measured.channel, text=text),)


def _markov_text(found: Sequence[MarkovEstimate], sensor: Sensor) -> str:
    """The Markov rates that describe slow noise where B and K are bounds at most."""
    unit = UNITS[SENSED[sensor].rate_unit]
    rate = "rate" if sensor == "gyro" else "acceleration"
    each = [
        f"a Markov {rate} of {one.deviation.value / unit.size:.3g} {unit.name} "
        f"({one.deviation.low / unit.size:.3g} to {one.deviation.high / unit.size:.3g}) with a "
        f"correlation time of {one.correlation_time.value:.3g} s "
        f"({one.correlation_time.low:.3g} to {one.correlation_time.high:.3g})"
        for one in found
    ]
    return f"{' and '.join(each)} {'describes it' if len(each) == 1 else 'describe it together'}"


# ---- what findings leave of the answer ---------------------------------------------------


def apply_findings(
    evidence: Evidence, headline: Headline, *, brief: bool = False
) -> tuple[Evidence, Headline]:
    """The answer and the fits beside it, as far as the findings let them stand.

    A finding is refused, accepted, divided by, or withholds the answer.

    Parameters
    ----------
    evidence, headline
        The fits, and the answer with what was noticed of it.
    brief
        Whether to leave out notes that touch neither.

    Raises
    ------
    RecordingError
        If the settings are strict and something is found that they do not accept.
    """
    settings, channel, spectrum = evidence.settings, evidence.measured.channel, headline.spectrum
    slow = () if brief or spectrum is None else _slow_noise_notes(evidence, spectrum)
    noticed = (*_spectrum_notes(evidence, headline), *slow, *headline.findings)
    findings = all_findings(evidence.findings, accept(noticed, settings.accepted))
    require_strict(findings, settings)
    trust = Trust.of(findings, over_parts=spectrum is not None and spectrum.changes)
    if spectrum is not None:
        own = trust.factor(channel)
        scale = np.array(
            [1.0 / own if name == "angle_random_walk" else 1.0 for name in spectrum.average.names]
        )
        average = replace(
            spectrum.average, covariance=spectrum.average.covariance * np.outer(scale, scale)
        )
        average = average.with_coefficients(trust.each(average.coefficients, channel))
        spectrum = replace(spectrum, average=average)
    coefficients = replace(
        evidence.coefficients,
        fits={
            name: replace(fit, coefficients=trust.each(fit.coefficients, channel))
            for name, fit in evidence.coefficients.fits.items()
        },
        per_gyro={
            name: trust.estimate(own, name) for name, own in evidence.coefficients.per_gyro.items()
        },
    )
    estimate = trust.estimate(headline.estimate, channel)
    source = headline.source
    if trust.reasons:
        given = "no more than a bound" if trust.only_raised else "not given"
        source = f"{given}, for {trust.why} spoils it"
    elif estimate != headline.estimate:
        source += f", divided by {trust.factor(channel):.4g} for findings"
    return replace(evidence, coefficients=coefficients), replace(
        headline, estimate=estimate, source=source, spectrum=spectrum, findings=findings
    )


def findings_of(recording: Recording, settings: Settings) -> tuple[Note, ...]:
    """The judgement of the gyros that are used.

    Raises
    ------
    RecordingError
        If the settings are strict and something is found that they do not accept.
    """
    found = accept(judged(recording, settings.gyros), settings.accepted)
    require_strict(found, settings)
    return found


def require_strict(notes: Iterable[Note], settings: Settings) -> None:
    """Refuse a finding that is not accepted, if the settings are strict.

    Raises
    ------
    RecordingError
        For the first of them.
    """
    if not settings.strict:
        return
    for note in notes:
        if note.name and note.level != "remark":
            raise RecordingError(
                f"{note.name}: {note.text}",
                channel=note.channel,
                remedy=f"correct the data, or take it knowingly ({{accept {note.name}}})",
            )


def all_findings(found: Iterable[Note], noticed: Iterable[Note]) -> tuple[Note, ...]:
    """Findings of the recording and of what removal left; the latter see more and stand alone."""
    noticed = tuple(noticed)
    known = {note.name for note in noticed if note.name}
    return (*(note for note in found if note.name not in known), *noticed)


@dataclass(frozen=True, slots=True, kw_only=True)
class Trust:
    """Trust that findings leave in the estimates.

    Attributes
    ----------
    reasons
        Findings for which no estimate is given; none if all may stand.
    factors
        Channel -> factor on the N that is read of it, which an estimate is divided by.
    spread
        How many times as large N is as in the quietest part of the record, which the interval of
        an estimate has to reach.
    """

    reasons: tuple[Note, ...]
    factors: Mapping[str, float]
    spread: float

    @classmethod
    def of(cls, findings: Iterable[Note], *, over_parts: bool) -> "Trust":
        """The trust after findings of level ``error``, and the known effects of warnings.

        Parameters
        ----------
        findings
            With their effects on N.
        over_parts
            Whether the interval covers N over parts of the record already.
        """
        findings = tuple(findings)
        factors: dict[str, float] = {}
        spread = 1.0
        for note in findings:
            if note.level != "warning" or note.effect is None:
                continue
            if note.name in DIVIDED:
                factors[note.channel] = factors.get(note.channel, 1.0) * note.effect
            if note.name == "unsteady" and not over_parts:
                spread = max(spread, note.effect)
        reasons = tuple(note for note in findings if note.level == "error")
        return cls(reasons=reasons, factors=factors, spread=spread)

    @property
    def only_raised(self) -> bool:
        """Whether all of them raise N: what is read is then an upper bound."""
        return all(note.effect is not None and note.effect > 1.0 for note in self.reasons)

    @property
    def why(self) -> str:
        """The reasons by name and channel."""
        names = (
            f"{note.name} of {note.channel}" if note.channel else note.name for note in self.reasons
        )
        return ", ".join(dict.fromkeys(names))

    def factor(self, channel: str) -> float:
        """Factor on the N that is read of one gyro, or of each of two (``x-z``)."""
        if channel in self.factors:
            return self.factors[channel]
        squares = [self.factors.get(name, 1.0) ** 2 for name in channel.split("-")]
        return math.sqrt(sum(squares) / len(squares))

    def each(
        self, read: Mapping[CoefficientName, Estimate], channel: str
    ) -> dict[CoefficientName, Estimate]:
        """Each coefficient, as far as it stands."""
        return {name: self.estimate(one, channel) for name, one in read.items()}

    def estimate(self, read: Estimate, channel: str) -> Estimate:
        """An estimate, or what is left of it: a bound, or nothing.

        N is divided by what is known to move it, in an interval wider by half of that, which
        reaches as far as noise that changes in the course of the record.
        """
        if read.status == "not observable":
            return read
        if self.reasons and self.only_raised:
            return upper_bound(read, read.high)
        if self.reasons:
            nan = math.nan
            return replace(read, value=nan, low=nan, high=nan, status="not observable")
        if read.name != "angle_random_walk":
            return read
        factor = self.factor(channel)
        doubt = doubt_of(factor)
        value, high = read.value / factor, read.high / factor * (1.0 + doubt)
        if read.status == "upper bound":
            return replace(read, value=high, high=high)
        low = min(read.low / factor * (1.0 - doubt), value / self.spread)
        return replace(read, value=value, low=low, high=max(high, value * self.spread))
