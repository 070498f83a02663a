"""Which estimate is set beside which limit."""

from dataclasses import replace

import pytest

from sagnac.analysis.settings import Settings
from sagnac.analysis.verdict import verdict_of
from sagnac.core.errors import Note
from sagnac.verdict.limits import specification_of
from tests.handmade import N, analysis, estimate


def judged(made, text):
    settings = replace(made.settings, specification=specification_of(text))
    return verdict_of(replace(made, settings=settings))


def test_without_a_specification_there_is_no_verdict():
    assert verdict_of(analysis()) is None
    assert Settings(specification=specification_of("1")).specification is not None


def test_a_single_gyro_and_a_pair_are_judged_by_the_answer():
    for gyros, name in ((("x",), "x"), (("x", "z"), "x-z")):
        verdict = judged(analysis(gyros=gyros), "3e-5deg/sqrt(h)")
        assert verdict.by_gyro == {name: "pass"}


def test_each_gyro_of_a_triad_is_judged_by_its_own():
    made = analysis(gyros=("x", "y", "z"))
    made = replace(made, per_gyro={**made.per_gyro, "y": estimate(2.0 * N)})
    verdict = judged(made, "3e-5deg/sqrt(h)")
    assert verdict.by_gyro == {"x": "pass", "y": "fail", "z": "pass"}
    assert verdict.decision == "fail"


def test_what_was_not_measured_of_a_gyro_is_undecided():
    # K of a triad is that of x - z; of y nothing is known.
    verdict = judged(analysis(gyros=("x", "y", "z")), "K=1deg/h/sqrt(h)")
    assert verdict.by_gyro == {"x-z": "pass", "y": "undecided"}


@pytest.mark.parametrize(
    ("text", "decision"),
    [("B=1e-5deg/h", "pass"), ("B=1e-9deg/h", "undecided"), ("R=1deg/h/h", "undecided")],
)
def test_bounds_and_what_is_not_observable(text, decision):
    assert judged(analysis(gyros=("x",)), text).decision == decision


def test_a_unit_in_doubt_decides_nothing():
    made = analysis(gyros=("x", "z"))
    for name, channel, decision in (
        ("units", "time", "undecided"),
        ("units", "x", "undecided"),
        ("motion", "x", "undecided"),
        ("units", "ax, ay", "pass"),
        ("spikes", "x", "pass"),
    ):
        doubt = Note(name=name, level="warning", channel=channel, text="looks wrong")
        verdict = judged(replace(made, notes=(*made.notes, doubt)), "3e-5deg/sqrt(h)")
        assert verdict.decision == decision
        accepted = replace(doubt, level="remark")
        assert judged(replace(made, notes=(accepted,)), "3e-5deg/sqrt(h)").decision == "pass"
