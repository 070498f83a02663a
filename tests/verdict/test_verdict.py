"""An interval beside a limit."""

import math

import pytest

from sagnac.noise.estimates import Estimate
from sagnac.verdict.judgement import Verdict, judged, overall
from sagnac.verdict.limits import specification_of

SPECIFICATION = specification_of("1rad/sqrt(s)")
(LIMIT,) = SPECIFICATION.limits


def estimate(value, low, high, status="estimated", confidence=0.95):
    return Estimate(
        name="angle_random_walk",
        value=value,
        low=low,
        high=high,
        confidence=confidence,
        status=status,
    )


@pytest.mark.parametrize(
    ("found", "decision", "risk"),
    [
        (estimate(0.8, 0.7, 0.9), "pass", 0.025),
        (estimate(0.9, 0.8, 1.0), "pass", 0.025),
        (estimate(0.9, 0.8, 1.1), "undecided", 0.025),
        (estimate(1.1, 1.0, 1.2), "undecided", 0.025),
        (estimate(1.2, 1.1, 1.3), "fail", 0.025),
        (estimate(0.9, 0.0, 0.9, "upper bound"), "pass", 0.05),
        (estimate(1.3, 0.0, 1.3, "upper bound"), "undecided", 0.05),
        (estimate(math.nan, math.nan, math.nan, "not observable"), "undecided", 0.05),
    ],
)
def test_the_interval_decides(found, decision, risk):
    one = judged("x", LIMIT, found, SPECIFICATION)
    assert one.decision == decision
    assert one.risk == risk
    assert one.reason


def test_an_interval_that_leaves_more_than_the_risk_decides_nothing():
    strict = specification_of("1rad/sqrt(s)", risk=0.01)
    wide, sharp = (estimate(0.8, 0.7, 0.9, confidence=level) for level in (0.95, 0.99))
    assert judged("x", LIMIT, wide, strict).decision == "undecided"
    assert "2.5 %" in judged("x", LIMIT, wide, strict).reason
    assert judged("x", LIMIT, sharp, strict).decision == "pass"
    # An upper bound leaves all that its confidence lacks, which is just what is allowed.
    bound = estimate(0.9, 0.0, 0.9, "upper bound", confidence=0.99)
    assert judged("x", LIMIT, bound, strict).decision == "pass"


def test_the_worst_decision_is_that_on_all():
    assert overall(["pass", "pass"]) == "pass"
    assert overall(["pass", "undecided"]) == "undecided"
    assert overall(["undecided", "fail", "pass"]) == "fail"
    good, bad = estimate(0.8, 0.7, 0.9), estimate(1.2, 1.1, 1.3)
    rows = tuple(judged(gyro, LIMIT, one, SPECIFICATION) for gyro, one in (("x", good), ("z", bad)))
    verdict = Verdict(specification=SPECIFICATION, judgements=rows)
    assert verdict.decision == "fail"
    assert verdict.by_gyro == {"x": "pass", "z": "fail"}
