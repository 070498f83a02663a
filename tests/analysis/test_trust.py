"""Whether the data bear the answer."""

from functools import cache

import numpy as np
import pytest

from sagnac.analysis.pipeline import analyze
from sagnac.analysis.settings import Settings
from sagnac.core.errors import RecordingError
from tests.quality.pathologies import PATHOLOGIES, SIGMA, of_rate, still, stuck_once

WALK = 0.003  # deg/sqrt(h)


@cache
def answer(case: str, **settings: object):
    return analyze(PATHOLOGIES[case][1](), Settings(method="none", **settings))


@pytest.mark.parametrize(
    ("case", "status"),
    [
        ("upper half clipped", "not observable"),
        ("stuck again and again", "not observable"),
        ("five per cent zeros", "upper bound"),
        ("unsigned, 16 bits", "upper bound"),
    ],
)
def test_what_is_spoilt_is_no_estimate(case, status):
    analysis = answer(case)
    assert analysis.angle_random_walk.status == status
    assert analysis.findings[0].level == "error"
    assert analysis.findings[0].name in analysis.source
    assert analysis.covariance is None
    every = [analysis.coefficients, *(fit.coefficients for fit in analysis.fits.values())]
    assert not [one for some in every for one in some.values() if one.status == "estimated"]
    if status == "upper bound":
        assert analysis.angle_random_walk.to("deg/sqrt(h)").high > WALK


@pytest.mark.parametrize("case", ["one spike", "half ten times as loud"])
def test_what_the_answer_survives_is_a_warning(case):
    analysis = answer(case)
    walk = analysis.angle_random_walk.to("deg/sqrt(h)")
    assert analysis.angle_random_walk.status == "estimated"
    # This noise, as it was drawn, is 0.9 % low.
    own = WALK * np.std(still()) / SIGMA
    assert walk.low < own < walk.high
    assert {note.level for note in analysis.findings} <= {"warning", "remark"}


@cache
def sound():
    return analyze(of_rate(still()), Settings(method="none", strict=True))


def test_one_short_dropout_does_not_cost_the_answer():
    analysis = analyze(stuck_once(15), Settings(method="none"))
    assert sound().findings == ()
    (found,) = analysis.findings
    assert (found.name, found.level) == ("repeats", "warning")
    assert "sticks once, for 15 samples: 14 samples repeat" in found.text
    assert "the first at 70.010 s" in found.text
    walk, own = analysis.angle_random_walk, sound().angle_random_walk
    assert walk.status == "estimated"
    assert walk.value == pytest.approx(own.value, rel=0.005)
    assert walk.low < own.value < walk.high
    # For long, or far off the noise, it may move the answer.
    for spoilt in (stuck_once(90), stuck_once(15, off=20.0)):
        spoilt_analysis = analyze(spoilt, Settings(method="none"))
        assert spoilt_analysis.angle_random_walk.status == "not observable"
        assert "sticks once" in spoilt_analysis.findings[0].text
    (often,) = answer("stuck again and again").findings
    assert "sticks 50 times, for up to 99 samples" in often.text


def test_one_finding_may_be_taken_knowingly():
    analysis = answer("upper half clipped", accepted=("clipping",))
    walk = analysis.angle_random_walk.to("deg/sqrt(h)")
    assert analysis.angle_random_walk.status == "estimated"
    # Upper half clipped: the root of 1/2 - 1/(2 pi).
    assert walk.value == pytest.approx(WALK * np.sqrt(0.5 - 0.5 / np.pi), rel=0.06)
    assert any(note.text.startswith("accepted") for note in analysis.notes)


def test_strict_refuses_in_one_line_and_accepts_by_name():
    with pytest.raises(RecordingError, match="clipping: is saturated") as caught:
        answer("upper half clipped", strict=True)
    assert "\n" not in str(caught.value)
    assert "accepted=clipping" in str(caught.value)
    for case, name in (("one spike", "spikes"), ("one sample late", "copy")):
        with pytest.raises(RecordingError, match=name):
            answer(case, strict=True)
    answer("one spike", strict=True, accepted=("spikes",))
    assert sound().settings.strict
    with pytest.raises(ValueError, match="accepted is 'clip'"):
        Settings(accepted=("clip",))


@pytest.mark.parametrize(
    ("case", "name"), [("one sample late", "copy"), ("degrees beside arcseconds", "units")]
)
def test_what_gyros_at_rest_say_of_each_other_is_a_warning_and_each_is_answered(case, name):
    recording = PATHOLOGIES[case][1]()
    analysis = answer(case)
    assert [(note.name, note.level) for note in analysis.findings] == [(name, "warning")]
    assert {walk.status for walk in analysis.per_gyro.values()} == {"estimated"}
    alone = analyze(recording, Settings(gyros=("z",), method="none"))
    assert analysis.per_gyro["z"] == alone.angle_random_walk
    assert not alone.findings
