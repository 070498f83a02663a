"""Pass, fail or undecided: an interval beside a limit."""

from dataclasses import dataclass
from typing import Final, Literal

from sagnac.coefficients.estimates import Estimate
from sagnac.errors import rounded
from sagnac.specification.limits import Limit, Specification

Decision = Literal["pass", "fail", "undecided"]

# By this much rounding may move a sum of confidence and risk off one.
_ROUNDING: Final = 1e-9


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

    def __post_init__(self) -> None:
        if not self.judgements:
            raise ValueError("judgements is empty; give one or more")

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
        gyros = dict.fromkeys(one.gyro for one in self.judgements)
        return {
            gyro: overall([one.decision for one in self.judgements if one.gyro == gyro])
            for gyro in gyros
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

    Raises
    ------
    ValueError
        If the estimate is of another coefficient.

    Notes
    -----
    An interval of confidence c leaves (1 - c)/2 on each side, an upper bound 1 - c. So a gyro that
    lies at its limit or above passes with that probability at most.
    """
    if estimate.name is not None and estimate.name != limit.coefficient:
        raise ValueError(f"estimate is of {estimate.name}, the limit of {limit.coefficient}")
    lacking = 1.0 - estimate.confidence
    risk = 0.5 * lacking if estimate.status == "estimated" else lacking
    decision, reason = _decided(limit, estimate, risk, specification.risk)
    return Judgement(
        gyro=gyro, limit=limit, estimate=estimate, decision=decision, risk=risk, reason=reason
    )


def _decided(
    limit: Limit, estimate: Estimate, risk: float, allowed: float | None
) -> tuple[Decision, str]:
    if estimate.status == "not observable":
        return "undecided", "not observable in this recording"
    if allowed is not None and risk > allowed + _ROUNDING:
        return (
            "undecided",
            f"the interval leaves a risk of {rounded(100.0 * risk, 3)} %, more than the "
            f"{rounded(100.0 * allowed, 3)} % allowed",
        )
    if estimate.high <= limit.value:
        what = "the interval" if estimate.status == "estimated" else "the upper bound"
        return "pass", f"{what} lies below the limit"
    if estimate.status == "upper bound":
        return "undecided", "only an upper bound is known, and it lies above the limit"
    if estimate.low > limit.value:
        return "fail", "the interval lies above the limit"
    return "undecided", "the limit lies within the interval"
