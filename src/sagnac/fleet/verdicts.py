"""How many gyros of a campaign keep the limits that were stated."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from scipy.special import betaincinv

from sagnac.fleet.runner import Campaign
from sagnac.fleet.spans import span_of
from sagnac.specification.limits import Specification
from sagnac.specification.verdict import Decision, overall

_CONFIDENCE: Final = 0.95


@dataclass(frozen=True, slots=True, kw_only=True)
class Yield:
    """Decisions on the gyros of whole recordings.

    Attributes
    ----------
    passed, failed, undecided
        How many.
    """

    passed: int
    failed: int
    undecided: int

    @property
    def gyros(self) -> int:
        """How many there are."""
        return self.passed + self.failed + self.undecided

    @property
    def decision(self) -> Decision:
        """``fail`` if one fails, else ``undecided`` if one is, else ``pass``."""
        names: Sequence[tuple[Decision, int]] = (
            ("fail", self.failed),
            ("undecided", self.undecided),
            ("pass", self.passed),
        )
        return overall([name for name, count in names if count])

    @property
    def share(self) -> tuple[float, float]:
        """Interval of the share that passes at 95 % (Clopper and Pearson, 1934)."""
        tail = 0.5 * (1.0 - _CONFIDENCE)
        bad = self.gyros - self.passed
        low = float(betaincinv(self.passed, bad + 1.0, tail)) if self.passed else 0.0
        high = float(betaincinv(self.passed + 1.0, bad, 1.0 - tail)) if bad else 1.0
        return low, high

    def in_words(self) -> str:
        """``3 pass, 1 fail, 0 undecided``."""
        return f"{self.passed} pass, {self.failed} fail, {self.undecided} undecided"

    def share_in_words(self) -> str:
        """The yield with its interval: ``yield 75 % (19 to 99 %)``."""
        low, high = self.share
        return (
            f"yield {100.0 * self.passed / self.gyros:.0f} % "
            f"({100.0 * low:.0f} to {100.0 * high:.0f} %)"
        )


def yield_of(campaign: Campaign) -> Yield | None:
    """The decisions of a campaign; None if nothing was stated that gyros have to keep."""
    found: Counter[str] = Counter()
    for row in campaign.rows:
        verdict = row.result.analysis.get("verdict")
        if verdict and span_of(row.task) is None:
            found.update(verdict["gyros"].values())
    if not found:
        return None
    return Yield(passed=found["pass"], failed=found["fail"], undecided=found["undecided"])


def specifications_of(campaign: Campaign) -> tuple[Specification, ...]:
    """Statements, each once."""
    stated = [row.task.settings.specification for row in campaign.rows]
    return tuple(dict.fromkeys(one for one in stated if one is not None))


def limit_texts(specification: Specification) -> list[str]:
    """Each limit as it was stated: ``N ≤ 0.0003 °/√h``."""
    return [
        f"{limit.letter} ≤ {limit.in_unit:.6g} {limit.unit.symbol}"
        for limit in specification.limits
    ]
