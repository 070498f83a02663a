"""Whether the data bear the answer: findings that are refused, accepted, or withhold it."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

from sagnac.analysis.headline import Headline
from sagnac.analysis.settings import Settings
from sagnac.coefficients.estimates import Estimate, Fit, FitName
from sagnac.coefficients.laws import CoefficientName
from sagnac.errors import Note, RecordingError
from sagnac.recording.model import Recording
from sagnac.recording.quality import accepted, judged


def findings_of(recording: Recording, settings: Settings) -> tuple[Note, ...]:
    """The judgement of the gyros that are used.

    Raises
    ------
    RecordingError
        If the settings are strict and something is found that they do not accept.
    """
    found = accepted(judged(recording, settings.gyros), settings.accepted)
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
    """What findings leave of the estimates.

    Attributes
    ----------
    reasons
        Findings for which no estimate is given; none if all may stand.
    """

    reasons: tuple[Note, ...]

    @classmethod
    def of(cls, findings: Iterable[Note]) -> "Trust":
        """What those of level ``error`` leave."""
        return cls(reasons=tuple(note for note in findings if note.level == "error"))

    @property
    def only_raised(self) -> bool:
        """Whether all of them raise N: what is read is then an upper bound."""
        return all(note.effect is not None and note.effect > 1.0 for note in self.reasons)

    def estimate(self, read: Estimate) -> Estimate:
        """An estimate, or what is left of it: a bound, or nothing."""
        if not self.reasons or read.status == "not observable":
            return read
        if self.only_raised:
            return replace(read, value=read.high, low=0.0, status="upper bound")
        nothing = float("nan")
        return replace(read, value=nothing, low=nothing, high=nothing, status="not observable")

    def headline(self, read: Headline) -> Headline:
        """The answer; if it does not stand, its source says why."""
        if not self.reasons:
            return read
        why = ", ".join(
            dict.fromkeys(
                f"{note.name} of {note.channel}" if note.channel else note.name
                for note in self.reasons
            )
        )
        given = "no more than a bound" if self.only_raised else "not given"
        return replace(
            read, estimate=self.estimate(read.estimate), source=f"{given}, for {why} spoils it"
        )

    def coefficients(
        self, read: Mapping[CoefficientName, Estimate]
    ) -> dict[CoefficientName, Estimate]:
        """Every coefficient so."""
        return {name: self.estimate(one) for name, one in read.items()}

    def fits(self, read: Mapping[FitName, Fit]) -> dict[FitName, Fit]:
        """The coefficients of every fit so."""
        return {
            name: replace(fit, coefficients=self.coefficients(fit.coefficients))
            for name, fit in read.items()
        }
