"""Whether the data bear the answer: findings that are refused, accepted, or withhold it."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from sagnac.analysis.headline import Headline
from sagnac.analysis.result import Covariance
from sagnac.analysis.settings import Settings
from sagnac.coefficients.estimates import Estimate, Fit, FitName
from sagnac.coefficients.laws import CoefficientName
from sagnac.errors import Note, RecordingError
from sagnac.recording.effects import DIVIDED, doubt_of
from sagnac.recording.model import Recording
from sagnac.recording.quality import accept, judged


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
