"""Findings: what is noticed beside the noise, and whether the data bear the answer.

A finding is refused, accepted, divided by, or withholds the answer.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from sagnac.analysis.averaged import Averaged, Cleaned
from sagnac.analysis.headline import Headline
from sagnac.analysis.parts import Parts
from sagnac.analysis.result import Covariance
from sagnac.analysis.settings import Settings
from sagnac.core.errors import Level, Note, RecordingError, counted, rounded
from sagnac.core.units import SENSED, UNITS, Sensor, field_unit
from sagnac.noise.bounds import Hump, RollOff
from sagnac.noise.estimates import Estimate, Fit, FitName
from sagnac.noise.laws import CoefficientName
from sagnac.noise.model_average import Elsewhere
from sagnac.noise.slow_model import MarkovEstimate
from sagnac.quality.check import accept, judged
from sagnac.quality.effects import DIVIDED, doubt_of
from sagnac.quality.spikes import Spikes
from sagnac.recording.model import Recording

# Share of N from which on what spikes would add is worth a warning.
_ADDS: float = 0.05


def noticed(channel: str, found: Averaged, sensor: Sensor = "gyro") -> tuple[Note, ...]:
    """Notes of an average on its record.

    Parameters
    ----------
    channel
        ``x`` or ``x-z``.
    found
        The average.
    sensor
        What the channel is of, which says the units.
    """
    walk = found.average.angle_random_walk
    notes = (
        _spikes_note(found.cleaned.spikes, walk, sensor),
        _warm_up_note(found.cleaned, sensor),
        _roll_off_note(found.roll_off),
        _hump_note(found.hump, sensor),
        _elsewhere_note(found.average.rests_on.elsewhere, walk, sensor),
        _parts_note(found.parts, sensor),
    )
    return tuple(replace(note, channel=channel) for note in notes if note)


def _shown(value: float, sensor: Sensor) -> str:
    """N in the unit of the field."""
    unit = field_unit("angle_random_walk", sensor)
    return f"{value / unit.size:.3g}"


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
        f"{_shown(added, sensor)} {field_unit('angle_random_walk', sensor).symbol} to it in square",
    )


def _warm_up_note(cleaned: Cleaned, sensor: Sensor) -> Note | None:
    warm_up = cleaned.warm_up
    if warm_up is None:
        return None
    # At least half of the record should be left.
    is_short = 2.0 * warm_up.until_s > cleaned.increments.size / cleaned.rate
    left_out = "a recording begun later" if is_short else f"{{slice {warm_up.until_s:.0f}:}}"
    unit = UNITS[SENSED[sensor].rate_unit]
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
        f"{found.cluster_time():.3g} s bound nothing",
    )


def _hump_note(found: Hump | None, sensor: Sensor) -> Note | None:
    """The answer is read below a hump, behind which there is less."""
    if found is None:
        return None
    top, behind = _shown(found.walk, sensor), _shown(found.least, sensor)
    return Note(
        level="warning",
        text=f"the answer is read below a hump of {top} at {found.frequency:.3g} Hz, behind which "
        f"the spectrum falls to {behind} {field_unit('angle_random_walk', sensor).symbol} at "
        f"{found.behind:.3g} Hz: either the sensor has a low-pass there, or the motion that makes "
        "the hump (sway of the bench) is in the answer; a quieter stretch tells",
    )


def _elsewhere_note(found: Elsewhere | None, walk: Estimate, sensor: Sensor) -> Note | None:
    """Models of another N, which the interval spans."""
    if found is None or walk.status != "estimated":
        return None
    symbol = field_unit("angle_random_walk", sensor).symbol
    return Note(
        level="warning",
        text=f"the spectrum is level in more than one band: {rounded(100.0 * found.share)} % "
        f"of the weight reads another {SENSED[sensor].titles['angle_random_walk']}, most of it "
        f"{_shown(found.walk, sensor)} {symbol} at {found.low:.3g} to {found.high:.3g} Hz; the "
        "interval spans both",
    )


def _parts_note(parts: Parts | None, sensor: Sensor) -> Note | None:
    if parts is None or len(parts.seen) < 2:
        return None
    reach = (
        f"{len(parts.seen)} parts of the recording read {_shown(parts.smallest, sensor)} "
        f"to {_shown(parts.largest, sensor)} {field_unit('angle_random_walk', sensor).symbol}"
    )
    walk = SENSED[sensor].titles["angle_random_walk"]
    if parts.agree:
        return Note(text=f"the {walk} is steady: {reach}, as far apart as by chance")
    if parts.walks_agree:
        return Note(
            name="unsteady",
            effect=parts.spread,
            level="warning",
            text=f"the noise in the band of the {walk} changes: {reach}, which chance could do, "
            "but their spectra differ as if it were "
            f"{rounded(parts.spread, 3)} times as large in one as in another; the interval covers "
            "them",
        )
    apart = 100.0 * (parts.largest / parts.smallest - 1.0)
    return Note(
        name="unsteady",
        effect=parts.largest / parts.smallest,
        level="warning",
        text=f"the {walk} changes: {reach}, {rounded(apart)} % apart, more than by chance; "
        "the interval covers them",
    )


def markov_text(found: Sequence[MarkovEstimate], sensor: Sensor) -> str:
    """The Markov rates that describe slow noise where B and K are bounds at most."""
    unit = UNITS[SENSED[sensor].rate_unit]
    rate = "rate" if sensor == "gyro" else "acceleration"
    each = []
    for one in found:
        size, time = one.deviation, one.correlation_time
        each.append(
            f"a Markov {rate} of {size.value / unit.size:.3g} {unit.name} "
            f"({size.low / unit.size:.3g} to {size.high / unit.size:.3g}) with a correlation time "
            f"of {time.value:.3g} s ({time.low:.3g} to {time.high:.3g})"
        )
    describes = "describes it" if len(each) == 1 else "describe it together"
    return f"slow noise: {' and '.join(each)} {describes}; B and K are bounds"


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


def merged(found: Iterable[Note], noticed: Iterable[Note]) -> tuple[Note, ...]:
    """Findings of the recording and of what removal left; the latter see more and stand alone.

    Parameters
    ----------
    found
        Of the recording.
    noticed
        Of what removal left, and other notes.
    """
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
    factors: Mapping[str, float] = field(default_factory=dict)
    spread: float = 1.0

    @classmethod
    def of(cls, findings: Iterable[Note], *, over_parts: bool = False) -> "Trust":
        """The estimate after findings of level ``error``, and the known effects of warnings.

        Parameters
        ----------
        findings
            With their effects on N.
        over_parts
            Whether the interval covers N over parts of the record already.
        """
        findings = tuple(findings)
        factors: dict[str, float] = {}
        for note in findings:
            if note.name in DIVIDED and note.level == "warning" and note.effect is not None:
                factors[note.channel] = factors.get(note.channel, 1.0) * note.effect
        spreads = [
            note.effect
            for note in findings
            if note.name == "unsteady" and note.level == "warning" and note.effect is not None
        ]
        return cls(
            reasons=tuple(note for note in findings if note.level == "error"),
            factors=factors,
            spread=1.0 if over_parts else max([1.0, *spreads]),
        )

    @property
    def only_raised(self) -> bool:
        """Whether all of them raise N: what is read is then an upper bound."""
        return all(note.effect is not None and note.effect > 1.0 for note in self.reasons)

    def factor(self, channel: str) -> float:
        """Factor on the N that is read of one gyro, or of each of two (``x-z``)."""
        own = self.factors.get(channel, 1.0)
        if channel not in self.factors and "-" in channel:
            squares = [self.factors.get(name, 1.0) ** 2 for name in channel.split("-")]
            own = math.sqrt(sum(squares) / len(squares))
        return own

    def estimate(self, read: Estimate, channel: str) -> Estimate:
        """An estimate, or what is left of it: a bound, or nothing."""
        if read.status == "not observable":
            return read
        if not self.reasons:
            return self._divided(read, channel)
        if self.only_raised:
            return replace(read, value=read.high, low=0.0, status="upper bound")
        nothing = float("nan")
        return replace(read, value=nothing, low=nothing, high=nothing, status="not observable")

    def _divided(self, read: Estimate, channel: str) -> Estimate:
        """N divided by what is known to move it, in an interval wider by half of that.

        It reaches as far as noise that changes in the course of the record.
        """
        if read.name != "angle_random_walk":
            return read
        factor = self.factor(channel)
        doubt = doubt_of(factor)
        value, high = read.value / factor, read.high / factor * (1.0 + doubt)
        if read.status == "upper bound":
            return replace(read, value=high, high=high)
        low = read.low / factor * (1.0 - doubt)
        return replace(
            read,
            value=value,
            low=min(low, value / self.spread),
            high=max(high, value * self.spread),
        )

    def headline(self, read: Headline, channel: str) -> Headline:
        """The answer; if it does not stand, its source says why."""
        estimate = self.estimate(read.estimate, channel)
        if not self.reasons:
            factor = self.factor(channel)
            divided = "" if estimate == read.estimate else f", divided by {factor:.4g} for findings"
            return replace(read, estimate=estimate, source=read.source + divided)
        why = ", ".join(
            dict.fromkeys(
                f"{note.name} of {note.channel}" if note.channel else note.name
                for note in self.reasons
            )
        )
        given = "no more than a bound" if self.only_raised else "not given"
        return replace(read, estimate=estimate, source=f"{given}, for {why} spoils it")

    def coefficients(
        self, read: Mapping[CoefficientName, Estimate], channel: str
    ) -> dict[CoefficientName, Estimate]:
        """Every coefficient so."""
        return {name: self.estimate(one, channel) for name, one in read.items()}

    def fits(self, read: Mapping[FitName, Fit], channel: str) -> dict[FitName, Fit]:
        """The coefficients of every fit so."""
        return {
            name: replace(fit, coefficients=self.coefficients(fit.coefficients, channel))
            for name, fit in read.items()
        }

    def covariance(self, read: Covariance, channel: str) -> Covariance:
        """The covariance of coefficients of which N was divided."""
        scale = np.ones(len(read.names))
        if "angle_random_walk" in read.names:
            scale[read.names.index("angle_random_walk")] = 1.0 / self.factor(channel)
        return replace(read, matrix=read.matrix * np.outer(scale, scale))
