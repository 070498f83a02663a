"""A verdict as a terminal, a page and a program read it."""

from typing import Any, Final

from sagnac.analysis.judgement import verdict_of
from sagnac.analysis.result import Analysis
from sagnac.errors import rounded
from sagnac.report.quantities import in_field_unit, reading
from sagnac.specification.verdict import Decision, Judgement, Verdict, overall
from sagnac.units import field_unit

DECISIONS: Final[dict[Decision, str]] = {"pass": "PASS", "fail": "FAIL", "undecided": "UNDECIDED"}


def verdict_data(verdict: Verdict) -> dict[str, Any]:
    """The verdict as plain data, figures in the units of the field."""
    return {
        "overall": verdict.decision,
        "risk": verdict.risk,
        "product": verdict.specification.product or None,
        "gyros": dict(verdict.by_gyro),
        "limits": [_judgement(one) for one in verdict.judgements],
    }


def overall_decision(analyses: "list[Analysis]") -> Decision | None:
    """The decision on several analyses together; None if none has a specification."""
    found = [verdict.decision for each in analyses if (verdict := verdict_of(each)) is not None]
    return overall(found) if found else None


def limit_text(judgement: Judgement) -> str:
    """The limit as it was stated: ``N ≤ 0.0003 °/√h``."""
    limit = judgement.limit
    return f"{limit.letter} ≤ {limit.in_unit:.6g} {limit.unit.symbol}"


def found_text(judgement: Judgement) -> str:
    """Measured value in the field's unit: with its interval, a bound, or neither."""
    name = judgement.limit.coefficient
    said = reading(name, judgement.estimate)
    if judgement.estimate.status == "not observable":
        return said
    return f"{said} {field_unit(name).symbol}"


def risk_text(verdict: Verdict) -> str:
    """The risk in words."""
    percent = f"{rounded(100.0 * verdict.risk, 3)} %"
    return f"a gyro at its limit passes with a probability of {percent} at most"


def gyro_text(judgement: Judgement) -> str:
    """The gyro, or the pair whose root mean square N̄ is judged."""
    first, dash, second = judgement.gyro.partition("-")
    return f"{first} − {second}, per gyro" if dash else first


def _judgement(one: Judgement) -> dict[str, Any]:
    name = one.limit.coefficient
    shown = in_field_unit(name, one.estimate)
    unit = field_unit(name)
    return {
        "gyro": one.gyro,
        "coefficient": name,
        "limit": one.limit.value / unit.size,
        "value": shown.value,
        "low": shown.low,
        "high": shown.high,
        "unit": unit.name,
        "status": shown.status,
        "confidence": shown.confidence,
        "verdict": one.decision,
        "risk": one.risk,
        "reason": one.reason,
        "stated": f"{one.limit.in_unit:.9g} {one.limit.unit.name}",
    }
