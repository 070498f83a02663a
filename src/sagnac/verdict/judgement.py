"""Pass, fail or undecided: a coefficient beside its limit."""

from dataclasses import dataclass
from typing import Literal

from sagnac.core.errors import rounded
from sagnac.noise.estimates import Estimate
from sagnac.verdict.limits import Limit, Specification

Decision = Literal["pass", "fail", "undecided"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Judgement:
    """One coefficient of one gyro beside its limit.

    Attributes
    ----------
    gyro
        ``x``, or ``x-z`` for what two gyros make per gyro.
    limit, estimate
        What it has to keep, and what was measured.
    decision
        ``pass``: the whole interval, or the upper bound, is at the limit or below.
        ``fail``: the whole interval is above. ``undecided``: neither.
    risk
        Probability that a gyro at its limit passes (and as much that it fails), at most.
    reason
        One phrase.
    """

    gyro: str
    limit: Limit
    estimate: Estimate
    decision: Decision
    risk: float
    reason: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Verdict:
    """Every limit of a specification for every gyro.

    Attributes
    ----------
    specification
        What was asked.
    judgements
        One or more.

    Examples
    --------
    >>> import numpy as np
    >>> from sagnac import Recording, analyze, judge
    >>> rate = np.random.default_rng(1).standard_normal(6000)
    >>> still = Recording.from_arrays(x=rate, kind="rate", unit="deg/h", sample_rate=10.0)
    >>> verdict = judge(analyze(still), "1deg/sqrt(h)")
    >>> verdict.decision, verdict.by_gyro
    ('pass', {'x': 'pass'})
    """

    specification: Specification
    judgements: tuple[Judgement, ...]

    @property
    def decision(self) -> Decision:
        """``fail`` if one fails, else ``undecided`` if one is, else ``pass``."""
        return overall([one.decision for one in self.judgements])

    @property
    def risk(self) -> float:
        """The largest of the risks."""
        return max(one.risk for one in self.judgements)

    @property
    def by_gyro(self) -> dict[str, Decision]:
        """The decision on each gyro."""
        return {
            gyro: overall([one.decision for one in self.judgements if one.gyro == gyro])
            for gyro in dict.fromkeys(one.gyro for one in self.judgements)
        }


def overall(decisions: "list[Decision]") -> Decision:
    """``fail`` if one is, else ``undecided`` if one is, else ``pass``."""
    if "fail" in decisions:
        return "fail"
    return "undecided" if "undecided" in decisions else "pass"


def judged(gyro: str, limit: Limit, estimate: Estimate, specification: Specification) -> Judgement:
    """One estimate beside its limit.

    Parameters
    ----------
    gyro
        Its name.
    limit, estimate
        Of the same coefficient.
    specification
        For the risk. If the interval leaves more than that, nothing is passed or failed by it.

    Notes
    -----
    An interval of confidence c leaves (1 - c)/2 on each side, an upper bound 1 - c. So a gyro that
    lies at its limit or above passes with that probability at most.
    """
    # In decimals, as a confidence is stated: 0.05, not 0.050000000000000044.
    lacking = round(1.0 - estimate.confidence, 12)
    estimated, allowed = estimate.status == "estimated", specification.risk
    risk = 0.5 * lacking if estimated else lacking
    decision: Decision = "undecided"
    if estimate.status == "not observable":
        reason = "not observable in this recording"
    elif allowed is not None and risk > allowed + 1e-9:  # rounding of a sum of confidence and risk
        more = f"more than the {rounded(100.0 * allowed, 3)} % allowed"
        reason = f"the interval leaves a risk of {rounded(100.0 * risk, 3)} %, {more}"
    elif estimate.high <= limit.value:
        decision = "pass"
        reason = f"{'the interval' if estimated else 'the upper bound'} lies below the limit"
    elif not estimated:
        reason = "only an upper bound is known, and it lies above the limit"
    elif estimate.low > limit.value:
        decision, reason = "fail", "the interval lies above the limit"
    else:
        reason = "the limit lies within the interval"
    return Judgement(
        gyro=gyro, limit=limit, estimate=estimate, decision=decision, risk=risk, reason=reason
    )
