"""The stability curve: its signature, intervals and refusals."""

import inspect
import math

import numpy as np
import pytest

import sagnac
from sagnac.stability.curve import stability_curve, with_noise_restored
from tests.stability.examples import THOUSAND_POINTS

WHOLE_ONLY = ("totdev", "mtotdev", "theo1", "theoh")


def test_published_intervals_of_the_thousand_points():
    curve = stability_curve(
        THOUSAND_POINTS, kind="rate", sample_rate=1.0, taus=[1, 8, 32, 128], noise_type=0
    )
    assert curve.low == pytest.approx([0.28515, 0.10038, 0.043654, 0.023045], rel=1e-3)
    assert curve.high == pytest.approx([0.29987, 0.11198, 0.054202, 0.037027], rel=1e-3)
    identified = stability_curve(
        THOUSAND_POINTS, kind="rate", sample_rate=1.0, taus=[1, 8, 32, 128]
    )
    assert identified.noise_type.tolist() == [0, 0, 0, 0]
    assert identified.low == pytest.approx(curve.low)


def test_signature_is_the_contract():
    parameters = inspect.signature(sagnac.stability_curve).parameters
    assert list(parameters)[:7] == [
        "values",
        "kind",
        "sample_rate",
        "estimator",
        "taus",
        "confidence",
        "gaps",
    ]
    assert parameters["kind"].default is inspect.Parameter.empty
    with pytest.raises(TypeError, match="kind"):
        stability_curve(THOUSAND_POINTS, sample_rate=1.0)


GAPPED = np.where(np.arange(100) == 42, np.nan, np.arange(100) % 7)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"kind": "phase"}, "kind 'phase' is not known; use one of angle, increment, rate"),
        ({"estimator": "allan"}, "estimator 'allan' is not known"),
        ({"gaps": "fill"}, "gaps 'fill' is not known; use one of reject, omit"),
        ({"sample_rate": 0.0}, "sample_rate 0.0 is not a positive"),
        ({"sample_rate": math.nan}, "sample_rate nan is not a positive"),
        ({"confidence": 95.0}, "give 0.95 for 95 %"),
        ({"noise_type": -3}, "noise_type -3 is out of range for oadev; use -2 to 2"),
        ({"taus": [1e4]}, "10000 s is out of range for oadev; use 0.5 s to 25 s"),
        ({"taus": [0.0]}, "0 s is out of range"),
        ({"taus": []}, "give one or more"),
        ({"taus": [math.nan]}, "not finite"),
        ({"values": np.ones((3, 3))}, "give one channel"),
        ({"values": [1.0]}, "has 1 samples; an Allan variance takes 2 or more"),
        ({"values": np.arange(5.0), "estimator": "theo1"}, "too few for theo1"),
        ({"values": np.arange(50.0), "estimator": "theoh"}, "too few for theoh"),
        ({"values": GAPPED}, r"sample 42 \(21 s\) is missing, 1 in all; use gaps='omit'"),
        ({"values": [1.0, math.inf, 2.0], "gaps": "omit"}, r"sample 1 \(0.5 s\) is infinite"),
        ({"values": [1.0, math.inf, -math.inf]}, r"sample 1 \(0.5 s\) is infinite, 2 in all"),
        ({"values": [1.0, math.nan, math.nan], "gaps": "omit"}, "1 of 3 samples are present"),
        *(
            ({"values": GAPPED, "gaps": "omit", "estimator": name}, f"{name} needs a whole record")
            for name in WHOLE_ONLY
        ),
    ],
)
def test_every_refusal_is_one_line(change, words):
    arguments = {"values": np.arange(100.0) % 7, "kind": "rate", "sample_rate": 2.0} | change
    with pytest.raises(ValueError, match=words) as refusal:
        stability_curve(arguments.pop("values"), **arguments)
    assert "\n" not in str(refusal.value)


def test_variance_that_lines_took_is_added_and_said():
    curve = stability_curve(THOUSAND_POINTS, kind="rate", sample_rate=1.0, taus=[1, 10, 100])
    taken = np.array([0.0, 0.25, 1.0]) * curve.deviation**2
    restored = with_noise_restored(curve, taken, 12)
    assert restored.deviation**2 == pytest.approx(curve.deviation**2 + taken)
    factor = np.sqrt([1.0, 1.25, 2.0])
    assert restored.low == pytest.approx(curve.low * factor)
    assert restored.high == pytest.approx(curve.high * factor)
    assert restored.edf == pytest.approx(curve.edf)
    assert restored.notes[-1].text == (
        "removal of 12 lines took up to 50 % of the noise variance (at tau = 100 s); "
        "it is added back"
    )
    assert with_noise_restored(curve, 1e-5 * taken, 1).notes == curve.notes


def test_variance_that_lines_took_belongs_to_an_allan_deviation():
    curve = stability_curve(THOUSAND_POINTS, kind="rate", sample_rate=1.0, estimator="hdev")
    with pytest.raises(ValueError, match="give adev or oadev"):
        with_noise_restored(curve, np.zeros(curve.tau.size), 1)
    curve = stability_curve(THOUSAND_POINTS, kind="rate", sample_rate=1.0)
    for wrong in (np.zeros(1), np.full(curve.tau.size, np.nan)):
        with pytest.raises(ValueError, match="give one variance, zero or more"):
            with_noise_restored(curve, wrong, 1)
