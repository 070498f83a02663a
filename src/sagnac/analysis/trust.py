"""Findings: what is noticed beside the noise, and whether the data bear the answer."""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from sagnac.analysis.averaged import AnswerSpectrum, Headline, Parts
from sagnac.analysis.evidence import Evidence
from sagnac.analysis.settings import Settings
from sagnac.core.arrays import differences
from sagnac.core.errors import Level, Note, RecordingError, counted, rounded
from sagnac.core.units import SENSED, UNITS, Sensor, field_unit
from sagnac.noise.bounds import longest_shelf, slow_noise
from sagnac.noise.estimates import Estimate, unobserved
from sagnac.noise.slow_model import MarkovEstimate, untold
from sagnac.quality.check import ACCEPTED, accept, judged, judged_remainder
from sagnac.quality.effects import DIVIDED, SPANNED, doubt_of
from sagnac.recording.channel import PAIR_SIZE
from sagnac.recording.model import Recording, second_of


def _spectrum_notes(evidence: Evidence, headline: Headline) -> tuple[Note, ...]:
    """Notes of the spectrum, and the judgement of what is left of a turning table."""
    spectrum, channel, left = headline.spectrum, evidence.measured.channel, evidence.left
    if spectrum is None or headline.by_encoder:
        # What is left is the encoder's.
        return ()
    sensor = evidence.recording.gyros[0].sensor
    notes = [*_off_notes(spectrum, evidence), *_shape_notes(spectrum, sensor)]
    notes += _parts_notes(spectrum.parts, sensor)
    if evidence.table.angle is None:
        notes += _shelf_notes(headline.estimate, spectrum, sensor)
    noticed = tuple(replace(note, channel=channel) for note in notes)
    if evidence.table.angle is None or left.once_a_turn:
        return noticed
    # The answer may be of fewer angles; every sample tells more.
    increments = spectrum.increments
    if spectrum.points.rate != left.rate:
        increments = differences(left.removal.residual)
    of_remainder = judged_remainder(evidence.corrected, channel, increments, left.rate)
    # Of noise that changes the spectrum says so itself.
    agree = spectrum.parts.agree
    return noticed + tuple(note for note in of_remainder if agree or note.name != "unsteady")


def _title(sensor: Sensor) -> str:
    """Name of N."""
    return SENSED[sensor].titles["angle_random_walk"]


def _walk(sensor: Sensor, *values: float) -> str:
    """N, or several, in the unit of the field."""
    unit = field_unit("angle_random_walk", sensor)
    return f"{' to '.join(f'{value / unit.size:.3g}' for value in values)} {unit.symbol}"


def _off_notes(spectrum: AnswerSpectrum, evidence: Evidence) -> Iterator[Note]:
    """On bumps and spikes that were replaced, and a warm-up that was taken off."""
    recording, sensor = evidence.recording, evidence.recording.gyros[0].sensor
    walk, spikes, warm_up = spectrum.average.angle_random_walk, spectrum.spikes, spectrum.warm_up
    if spectrum.bumps is not None:
        yield spectrum.bumps.note(recording, spectrum.points.rate)
    if spikes is not None:
        added, seen = spikes.added_walk, walk.status == "estimated"
        effect = math.hypot(1.0, added / walk.value) if seen else None
        level: Level = "warning" if seen and added > 0.05 * walk.value else "remark"
        count = counted(int(spikes.index.size), "sample")
        replaced = f"spikes were replaced by the samples beside them for the answer ({count})"
        text = f"{replaced}; left in, they would add {_walk(sensor, added)} to it in square"
        yield Note(name="spikes", effect=effect, level=level, text=text)
    if warm_up is not None:
        # At least half of the record should be left.
        is_short = 2.0 * warm_up.until_s > spectrum.increments.size / spectrum.points.rate
        # A slice counts from the start of the file, and so does the second of a sample.
        until = second_of(recording, 0) + warm_up.until_s
        left_out = "a recording begun later" if is_short else f"{{slice {until:.0f}:}}"
        unit = UNITS[SENSED[sensor].rate_unit]
        # Noise of a pair is given per gyro, but the drift of one against the other in full.
        settles = warm_up.rate * (PAIR_SIZE if evidence.measured.is_pair else 1.0)
        constant = f"with a time constant of {warm_up.time:.3g} s (warm-up)"
        fits = "{covariates temperature} fits it if there is a column of temperature"
        text = f"the rate settles by {settles / unit.size:.3g} {unit} {constant}: it was taken off "
        text += f"for the answer, and stays in the curve; {left_out} leaves it out, {fits}"
        yield Note(name="warm-up", text=text)


def _shape_notes(spectrum: AnswerSpectrum, sensor: Sensor) -> Iterator[Note]:
    """On a low-pass, a hump above the answer, and models of another N, which its interval spans."""
    fall, hump = spectrum.roll_off, spectrum.hump
    elsewhere = spectrum.average.rests_on.elsewhere
    if math.isfinite(fall.frequency):
        is_halved = math.isfinite(fall.half)
        falls = f"to half at {fall.half:.3g}" if is_halved else f"beyond {fall.frequency:.3g}"
        short = f"cluster times below {fall.cluster_time():.3g} s bound nothing"
        text = f"the spectrum falls {falls} Hz, as behind a low-pass, a hump or slow noise: {short}"
        yield Note(text=text)
    if hump is not None:
        top = _walk(sensor, hump.walk).split()[0]
        behind = f"the spectrum falls to {_walk(sensor, hump.least)} at {hump.behind:.3g} Hz"
        read = f"the answer is read below a hump of {top} at {hump.frequency:.3g} Hz"
        why = "either the sensor has a low-pass there, or the motion that makes the hump"
        text = f"{read}, behind which {behind}: {why} (sway of the bench) is in the answer"
        yield Note(level="warning", text=f"{text}; a quieter stretch tells")
    if elsewhere is not None and spectrum.average.angle_random_walk.status == "estimated":
        share = f"{rounded(100.0 * elsewhere.share)} % of the weight reads another {_title(sensor)}"
        band = f"{elsewhere.low:.3g} to {elsewhere.high:.3g} Hz"
        most = f"most of it {_walk(sensor, elsewhere.walk)} at {band}; the interval spans both"
        text = f"the spectrum is level in more than one band: {share}, {most}"
        yield Note(level="warning", text=text)


def _shelf_notes(read: Estimate, spectrum: AnswerSpectrum, sensor: Sensor) -> Iterator[Note]:
    """On a level above N that the spectrum keeps over a decade, and falls from below it.

    An output that takes off its own bias at rest has no N at the lowest frequencies, and has it
    again when it turns. Noise of an angle behind a low-pass looks alike.
    """
    shelf = None if read.status == "not observable" else longest_shelf(spectrum.levels)
    if shelf is None or shelf[2] < 1.1 * read.high:
        return
    low, high, walk = shelf
    level = f"the spectrum is level from {low:.3g} to {high:.3g} Hz, at {_walk(sensor, walk)}"
    if_so = f"if the output takes off its own bias at rest, its {_title(sensor)} is that one"
    remedy = "the interval reaches there; record the output without that correction"
    text = f"{level}, and lower below, as behind a high-pass: {if_so}; {remedy}"
    yield Note(name="high-pass", effect=read.value / walk, level="warning", text=text)


def _parts_notes(parts: Parts, sensor: Sensor) -> Iterator[Note]:
    """On whether N stands still over the parts that show it, two or more."""
    if len(parts.values) < 2:
        return
    walk, lowest, highest = _title(sensor), min(parts.values), max(parts.values)
    reach = f"{len(parts.values)} parts of the recording read {_walk(sensor, lowest, highest)}"
    if parts.agree:
        yield Note(text=f"the {walk} is steady: {reach}, as far apart as by chance")
        return
    if parts.walks_agree:
        effect, changed = parts.spread, f"noise in the band of the {walk}"
        times = f"{rounded(effect, 3)} times as large in one as in another"
        apart = f"which chance could do, but their spectra differ as if it were {times}"
    else:
        effect, changed = highest / lowest, walk
        apart = f"{rounded(100.0 * (effect - 1.0))} % apart, more than by chance"
    text = f"the {changed} changes: {reach}, {apart}; the interval covers them"
    yield Note(name="unsteady", effect=effect, level="warning", text=text)


def _slow_noise_notes(evidence: Evidence, spectrum: AnswerSpectrum) -> Iterator[Note]:
    """On a rise of the curve that no estimated term has."""
    if spectrum.warm_up is not None:
        return
    terms, sensor = spectrum.average.coefficients, evidence.recording.gyros[0].sensor
    rise, model = slow_noise(evidence.curve, terms), None
    if evidence.table.angle is None:
        model = untold(spectrum.levels, spectrum.average.rests_on, terms)
    if rise is None and model is None:
        return
    what = "the lowest frequencies of the spectrum lie"
    if rise is not None:
        tau, ratio = rise
        what = f"at {tau:.3g} s the curve lies {rounded(ratio)} times"
    which = "the recording does not show which of the three it is; record longer"
    text = f"slow noise, K or R or B: {what} above the terms that are estimated, and {which}"
    if model is not None and model.rates:
        text = f"slow noise: {_markov_text(model.rates, sensor)}; B and K are bounds"
    yield Note(channel=evidence.measured.channel, text=text)


def _markov_text(markov: Sequence[MarkovEstimate], sensor: Sensor) -> str:
    """The Markov rates that describe slow noise where B and K are bounds at most."""
    unit = UNITS[SENSED[sensor].rate_unit]
    rate = "rate" if sensor == "gyro" else "acceleration"
    each = [
        f"a Markov {rate} of {one.deviation.value / unit.size:.3g} {unit.name} "
        f"({one.deviation.low / unit.size:.3g} to {one.deviation.high / unit.size:.3g}) with a "
        f"correlation time of {one.correlation_time.value:.3g} s "
        f"({one.correlation_time.low:.3g} to {one.correlation_time.high:.3g})"
        for one in markov
    ]
    return f"{' and '.join(each)} {'describes it' if len(each) == 1 else 'describe it together'}"


# ---- what findings leave of the answer ---------------------------------------------------


def apply_findings(headline: Headline, evidence: Evidence, *, brief: bool = False) -> Headline:
    """The answer and the fits beside it, as far as the findings let them stand.

    A finding is refused, accepted, divided by, widens the interval, or withholds the answer.

    Parameters
    ----------
    headline, evidence
        The answer with what was noticed of it, and what it is read from.
    brief
        Whether to leave out notes that touch neither.

    Raises
    ------
    RecordingError
        If the settings are strict and something is found that they do not accept.
    """
    settings, channel, spectrum = evidence.settings, evidence.measured.channel, headline.spectrum
    before = Trust.of(evidence.findings, over_parts=False)
    if before.reasons and not before.only_raised:
        # A finding has left no answer: the spectrum shows what was found, not the gyro's noise.
        seen = headline.findings
    else:
        slow = () if brief or spectrum is None else _slow_noise_notes(evidence, spectrum)
        seen = (*_spectrum_notes(evidence, headline), *slow, *headline.findings)
    noticed = accept(seen, settings.accepted)
    # What removal left shows more than the recording, and stands alone.
    known = {note.name for note in noticed if note.name}
    if spectrum is not None and spectrum.bumps is None:
        # Moments that the answer takes for noise are in it, so that it does not go without them.
        known.add("moved")
    findings = (*(note for note in evidence.findings if note.name not in known), *noticed)
    require_strict(findings, settings)
    trust = Trust.of(findings, over_parts=spectrum is not None and not spectrum.parts.agree)
    headline = headline.with_each(lambda one: trust.estimate(one, channel))
    if headline.spectrum is not None:
        average, own = headline.spectrum.average, _of_channel(trust.factors, channel)
        scale = [1.0 / own if name == "angle_random_walk" else 1.0 for name in average.names]
        average = replace(average, covariance=average.covariance * np.outer(scale, scale))
        headline = replace(headline, spectrum=replace(headline.spectrum, average=average))
    estimate, source = trust.estimate(headline.estimate, channel), headline.source
    alone = headline.hat.angle_random_walk.items()
    if trust.reasons:
        given = "no more than a bound" if trust.only_raised else "not given"
        names = (f"{note.name} of {note.channel}".removesuffix(" of ") for note in trust.reasons)
        source = f"{given}, for {', '.join(dict.fromkeys(names))} spoils it"
    else:
        divided, spanned = (_of_channel(one, channel) for one in (trust.factors, trust.possible))
        if divided != 1.0:
            source += f", divided by {divided:.4g} for findings"
        if spanned != 1.0:
            source += f"; the interval holds N divided by {spanned:.4g}, too, for findings"
    headline = replace(headline, estimate=estimate, source=source, findings=findings)
    return replace(headline, per_gyro={name: trust.estimate(own, name) for name, own in alone})


def is_doubt(note: Note) -> bool:
    """Whether a note puts a unit in doubt, so that no figure decides."""
    return note.name in ("units", "motion") and note.level == "warning"


def findings_of(recording: Recording, settings: Settings) -> tuple[Note, ...]:
    """The judgement of the gyros that are used, and what reading doubted of their units.

    Raises
    ------
    RecordingError
        If the settings are strict and something is found that they do not accept.
    """
    used = (*settings.gyros, "time")
    doubts = (one for one in recording.notes if one.name == "units" and one.channel in used)
    findings = accept((*doubts, *judged(recording, settings.gyros)), settings.accepted)
    require_strict(findings, settings)
    return findings


def require_strict(notes: Iterable[Note], settings: Settings) -> None:
    """Refuse a finding that is not accepted, if the settings are strict.

    Raises
    ------
    RecordingError
        For the first of them.
    """
    for note in notes if settings.strict else ():
        if note.name and note.level != "remark":
            problem = f"{note.name}: {note.text}"
            remedy = f"correct the data, or take it knowingly ({{accept {note.name}}})"
            raise RecordingError(problem, channel=note.channel, remedy=remedy)


@dataclass(frozen=True, slots=True, kw_only=True)
class Trust:
    """Trust that findings leave in the estimates.

    Attributes
    ----------
    reasons
        Findings for which no estimate is given; none if all may stand.
    factors
        Channel -> factor on the N that is read of it, which an estimate is divided by.
    possible
        Channel -> factor that N may have besides, or not: an interval reaches to N divided by it.
    spread
        How many times as large N is as in the quietest part of the record, which the interval of
        an estimate has to reach.
    """

    reasons: tuple[Note, ...]
    factors: Mapping[str, float]
    possible: Mapping[str, float]
    spread: float

    @classmethod
    def of(cls, findings: Iterable[Note], *, over_parts: bool) -> "Trust":
        """The trust after findings of level ``error``, and the known effects of the others.

        What is accepted has no effect.

        Parameters
        ----------
        findings
            With their effects on N.
        over_parts
            Whether the interval covers N over parts of the record already.
        """
        findings = tuple(findings)
        factors: dict[str, float] = {}
        possible: dict[str, float] = {}
        spread = 1.0
        for note in findings:
            if note.level == "error" or note.effect is None or note.text.startswith(ACCEPTED):
                continue
            if note.name in DIVIDED:
                factors[note.channel] = factors.get(note.channel, 1.0) * note.effect
            if note.name in SPANNED:
                # The one that reaches farther.
                possible[note.channel] = min(note.effect, possible.get(note.channel, math.inf))
            if note.name == "unsteady" and not over_parts:
                spread = max(spread, note.effect)
        reasons = tuple(note for note in findings if note.level == "error")
        return cls(reasons=reasons, factors=factors, possible=possible, spread=spread)

    @property
    def only_raised(self) -> bool:
        """Whether all of them raise N: what is read is then an upper bound."""
        return all(note.effect is not None and note.effect > 1.0 for note in self.reasons)

    def estimate(self, read: Estimate, channel: str) -> Estimate:
        """An estimate, or what is left of it: a bound, or nothing.

        N is divided by what is known to move it, in an interval wider by half of that, which
        reaches as far as noise that changes in the course of the record, and holds N divided by
        what may move it.
        """
        if read.status == "not observable":
            return read
        if self.reasons and self.only_raised:
            return read.bounded(read.high)
        if self.reasons:
            return unobserved(read.name, read.confidence)
        if read.name != "angle_random_walk":
            return read
        factor = _of_channel(self.factors, channel)
        doubt = doubt_of(factor)
        value, high = read.value / factor, read.high / factor * (1.0 + doubt)
        spanned = _of_channel(self.possible, channel)
        high = high / spanned * (1.0 + doubt_of(spanned))
        if read.status == "upper bound":
            return read.bounded(high)
        low = min(read.low / factor * (1.0 - doubt), value / self.spread)
        return replace(read, value=value, low=low, high=max(high, value * self.spread))


def _of_channel(factors: Mapping[str, float], channel: str) -> float:
    """Factor on N of one gyro, or of the difference of two (``x-z``), of those of single gyros."""
    if channel in factors:
        return factors[channel]
    squares = [factors.get(name, 1.0) ** 2 for name in channel.split("-")]
    return math.sqrt(sum(squares) / len(squares))
