"""Which estimate is set beside which limit."""

from dataclasses import replace

import numpy as np
import pytest

import sagnac
from sagnac.analysis.settings import Settings
from sagnac.analysis.verdict import EITHER, verdict_of
from sagnac.core.errors import Note
from sagnac.report.document import analysis_document
from sagnac.verdict.limits import specification_of
from tests.handmade import N, analysis, estimate


def judged(made, text):
    settings = replace(made.settings, specification=specification_of(text))
    return verdict_of(replace(made, settings=settings))


def test_without_a_specification_there_is_no_verdict():
    assert verdict_of(analysis()) is None
    limits = specification_of("1")
    assert Settings(specification=limits).specification == limits


def test_settings_parse_and_check_what_they_are_given_at_once():
    made = Settings(specification="N=1", step_4="relative")
    assert made.specification == specification_of("N=1")
    assert made.step_4.squares == "relative"
    for choice, said in (
        ({"specification": "abc"}, "specification 'abc' has no number"),
        ({"published": "x"}, "published is 'x'; give a PublishedSearch"),
        ({"step_4": 3}, "step_4 is 3; use one of plain, "),
        ({"step_4": "fast"}, "step_4 is 'fast'; use one of plain, "),
    ):
        with pytest.raises(ValueError, match=said):
            Settings(**choice)
    with pytest.raises(TypeError, match=r"specification is 0\.3"):
        Settings(specification=0.3)


def test_a_single_gyro_and_a_pair_are_judged_by_the_answer():
    for gyros, name in ((("x",), "x"), (("x", "z"), "x-z")):
        verdict = judged(analysis(gyros=gyros), "3e-5deg/sqrt(h)")
        assert verdict.by_gyro == {name: "pass"}


@pytest.mark.parametrize(("limit", "may"), [("3e-5deg/sqrt(h)", True), ("9e-5deg/sqrt(h)", False)])
def test_a_pair_that_passes_says_if_one_of_its_gyros_may_not(limit, may):
    verdict = judged(analysis(gyros=("x", "z")), limit)
    assert (verdict.decision, EITHER in verdict.judgements[0].reason) == ("pass", may)
    assert EITHER not in judged(analysis(gyros=("x",)), limit).judgements[0].reason


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


@pytest.mark.parametrize(
    ("header", "stated", "said"),
    [
        ("x[deg/s]", {"kind": "rate", "unit": "deg/h"}, "the file says deg/s"),
        ("x", {"kind": "angle", "unit": "deg"}, "as a rate does"),
    ],
)
def test_what_reading_doubts_decides_nothing_unless_it_is_accepted(tmp_path, header, stated, said):
    path = tmp_path / "run.csv"
    noise = 0.01 * np.random.default_rng(3).standard_normal(9000)
    path.write_text(f"{header}\n" + "".join(f"{value:.6f}\n" for value in noise))
    recording = sagnac.read(path, sample_rate=100.0, **stated)
    limit = "90deg/sqrt(h)"
    found = sagnac.analyze(recording, specification=limit)
    assert verdict_of(found).decision == "undecided"
    assert any(note.name == "units" and said in note.text for note in found.findings)
    with pytest.raises(sagnac.RecordingError, match=said):
        sagnac.analyze(recording, specification=limit, strict=True)
    accepted = sagnac.analyze(recording, specification=limit, strict=True, accepted=("units",))
    assert verdict_of(accepted).decision == "pass"
    assert [note.level for note in accepted.notes if said in note.text] == ["remark"]


@pytest.mark.parametrize(
    ("factor", "decision"),
    [(np.degrees(1.0), "undecided"), (1e4, "undecided"), (1.0, "pass")],
    ids=["between the two", "of the other alone", "sound"],
)
def test_a_unit_in_doubt_decides_nothing_of_either_gyro_alone(factor, decision):
    """Whoever reads the verdict of one gyro reads what the verdict of all says of it."""
    x, y = 0.02 * np.random.default_rng(4).standard_normal((2, 9000))
    still = sagnac.Recording.from_arrays(
        x=x, y=factor * y, kind="rate", unit="deg/s", sample_rate=100.0
    )
    found = sagnac.analyze(
        still, specification="1000deg/sqrt(h)" if factor > 1.0 else "1deg/sqrt(h)"
    )
    assert verdict_of(found).by_gyro == {"x": decision, "y": decision}
    assert {verdict_of(gyro).decision for gyro in found.gyros.values()} == {decision}
    document = analysis_document(found)
    assert {one["verdict"]["overall"] for one in document["gyros"].values()} == {decision}


@pytest.mark.parametrize(("late", "decision"), [(0, "undecided"), (3, "pass")])
def test_a_gyro_that_is_a_copy_of_another_was_not_measured(late, decision):
    """A logger that wrote x into the column of y passed both; what fails by another still fails."""
    noise = 0.02 * np.random.default_rng(5).standard_normal((3, 9000))
    columns = {"x": noise[0], "y": noise[1] + np.roll(noise[0], late) if late else 1.0 * noise[0]}
    still = sagnac.Recording.from_arrays(**columns, kind="rate", unit="deg/s", sample_rate=100.0)
    found = sagnac.analyze(still, specification="1deg/sqrt(h)")
    assert [note.name for note in found.findings] == ["copy"]
    assert verdict_of(found).by_gyro == {"x": "pass", "y": decision}
    assert verdict_of(found).decision == decision
    assert judged(found, "0.01deg/sqrt(h)").by_gyro == {"x": "fail", "y": "fail"}
    kept = sagnac.analyze(still, specification="1deg/sqrt(h)", accepted=("copy",))
    assert verdict_of(kept).decision == "pass"
