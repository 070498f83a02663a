"""The stability curve: its signature, intervals and refusals."""

import inspect
import math
import sys
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import sagnac
from sagnac.core.errors import MissingExtra
from sagnac.stability.curve import stability_curve
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
    names = "values kind sample_rate estimator taus confidence gaps"
    assert list(parameters)[:7] == names.split()
    assert parameters["kind"].default is inspect.Parameter.empty
    with pytest.raises(TypeError, match="kind"):
        stability_curve(THOUSAND_POINTS, sample_rate=1.0)


GAPPED = np.where(np.arange(100) == 42, np.nan, np.arange(100) % 7)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"kind": "phase"}, "kind is 'phase'; use one of angle, increment, rate"),
        ({"estimator": "allan"}, "estimator is 'allan'"),
        ({"gaps": "fill"}, "gaps is 'fill'; use one of reject, omit"),
        ({"sample_rate": 0.0}, "sample_rate is 0.0; give samples"),
        ({"sample_rate": math.nan}, "sample_rate is nan; give samples"),
        ({"confidence": 95.0}, "confidence is 95.0; give a number between 0 and 1"),
        ({"noise_type": -3}, "noise_type -3 is out of range for oadev; use -2 to 2"),
        ({"taus": [1e4]}, "10000 s is out of range for oadev; use 0.5 s to 25 s"),
        ({"taus": [0.0]}, "0 s is out of range"),
        ({"taus": []}, "give one or more"),
        ({"taus": [math.nan]}, "not finite"),
        ({"taus": {1: 2}}, r"taus is \{1: 2\}; give cluster times in s"),
        ({"taus": b"12"}, "taus is b'12'; give cluster times in s"),
        ({"taus": [1j]}, r"taus is \[1j\]; give cluster times in s"),
        ({"taus": np.array(["2024-05-01"], dtype="datetime64[s]")}, "give cluster times in s"),
        ({"values": np.ones((3, 3))}, "give one column"),
        ({"values": np.ma.masked_equal([1.0, 1e3, 2.0], 1e3)}, r"sample 1 \(0.5 s\) is missing"),
        ({"values": np.arange(9.0) * 1e300}, r"values reach 8e\+300; give them in the unit"),
        ({"values": np.arange(9.0) * 1e-200}, "values reach 8e-200; give them in the unit"),
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


def test_what_a_mask_hides_is_missing():
    rate = np.random.default_rng(5).standard_normal(2000)
    spoilt, missing = rate.copy(), rate.copy()
    spoilt[300:310], missing[300:310] = 1e3, np.nan
    masked = np.ma.masked_greater(spoilt, 100.0)
    told, hidden = (
        stability_curve(values, kind="rate", sample_rate=10.0, gaps="omit")
        for values in (missing, masked)
    )
    np.testing.assert_array_equal(hidden.deviation, told.deviation)
    assert hidden.notes == told.notes


# --- the result ----------------------------------------------------------------------------


def small_curve(**change):
    rates = np.random.default_rng(60).standard_normal(200)
    curve = stability_curve(rates, kind="rate", sample_rate=2.0, taus=[0.5, 1.0, 10.0])
    return replace(curve, **change)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"low": np.ones(2)}, r"low has shape \(2,\); give \(3,\)"),
        ({"tau": np.array([0.0, 1.0, 2.0])}, "tau holds a value that is not above zero"),
        ({"estimator": "allan"}, "estimator is 'allan'; use one of adev"),
        ({"kind": "phase"}, "kind is 'phase'"),
        ({"sample_rate": -1.0}, "give samples per second, above zero"),
        ({"confidence": 68.3}, "give a number between 0 and 1"),
    ],
)
def test_a_curve_checks_what_it_is_given(change, words):
    with pytest.raises(ValueError, match=words):
        small_curve(**change)


def test_a_curve_is_read_only_and_compares():
    curve = small_curve()
    with pytest.raises(ValueError, match="read-only"):
        curve.deviation[0] = 1.0
    assert curve == small_curve()
    assert curve != small_curve(confidence=0.9)
    assert curve != "a curve"
    given = np.array([0.5, 1.0, 10.0])
    small_curve(tau=given)
    given[0] = 0.25  # what was given stays the caller's


def test_a_curve_prints_short():
    curve = small_curve()
    assert repr(curve) == (
        "<StabilityCurve oadev, 3 points, tau 0.5 s to 10 s, 200 samples of rate at 2 Hz>"
    )
    assert curve._repr_html_().count("<tr>") == 4
    empty = replace(curve, **{name: np.empty(0) for name in ARRAYS})
    assert "0 points" in repr(empty)
    assert empty._repr_html_().count("<tr>") == 1


ARRAYS = ("tau", "deviation", "terms", "edf", "low", "high", "noise_type")


def test_a_curve_is_a_frame_where_pandas_is(monkeypatch):
    made = SimpleNamespace(DataFrame=lambda columns: SimpleNamespace(columns=columns, attrs={}))
    monkeypatch.setitem(sys.modules, "pandas", made)
    frame = small_curve().to_frame()
    assert set(frame.columns) == set(ARRAYS)
    assert frame.attrs["estimator"] == "oadev"
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(MissingExtra, match=r"needs pandas.*\.\[frames\]"):
        small_curve().to_frame()
