"""Errors and notes as data, and how they are worded."""

import pickle
import re

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from matplotlib.figure import Figure

import sagnac
from sagnac import Recording, align, analyze, plan
from sagnac.analysis.settings import Settings
from sagnac.core.errors import (
    ArgumentError,
    MissingExtra,
    Note,
    RecordingError,
    counted,
    per_cent,
    quoted,
    ranked,
    worded,
)
from sagnac.formats import Statement
from sagnac.navigation.noise import GyroNoise
from sagnac.report.text import answer

LONG = np.arange(100_000.0)
NOISE = GyroNoise(angle_random_walk=1e-6, bias_instability=0.0, rate_random_walk=0.0)


def still(x=tuple(range(100)), sample_rate=10.0):
    return Recording.from_arrays(x=x, kind="rate", unit="deg/h", sample_rate=sample_rate)


NOISY = still(np.random.default_rng(1).standard_normal(6000))


def option(name, value):
    return f"--{name} {value}".strip()


def test_inputs_are_written_as_the_reader_gives_them():
    text = "take {slice 30:90} or {table}; leave {time none} out ({null-pulse})"
    assert worded(text) == "take span=(30, 90) or table; leave time=none out (null_pulse)"
    assert worded(text, option) == (
        "take --slice 30:90 or --table; leave --time none out (--null-pulse)"
    )
    assert worded("columns={'x': NAME}, {X}") == "columns={'x': NAME}, {X}"


def test_a_note_has_one_of_three_levels():
    with pytest.raises(ValueError, match="level is 'note'; use one of error, warning, remark"):
        Note(text="noticed", level="note")
    assert str(Note(text="has {slice 3:} left", channel="x")) == "x: has span=(3, None) left"


def test_errors_come_first_and_nothing_twice():
    remark, warning, error = (Note(text="a", level=one) for one in ("remark", "warning", "error"))
    assert ranked([remark, warning, remark, error, warning]) == (error, warning, remark)


def test_an_error_names_file_channel_and_remedy():
    error = RecordingError("is stuck", channel="x", remedy="take {slice 3:}")
    assert str(error) == "x: is stuck; take span=(3, None)"
    assert error.at("run.csv").line(option) == "run.csv: x: is stuck; take --slice 3:"
    assert error.at("run.csv").at("other.csv").path == "run.csv"
    of_note = RecordingError.of(Note(text="is stuck", level="error", channel="x"), "run.csv")
    assert str(of_note) == "run.csv: x: is stuck"


def test_a_missing_extra_names_what_to_install():
    error = MissingExtra("a turning table", "finufft", "table")
    assert str(error) == (
        "a turning table needs finufft, which is not installed; "
        "install it with pip install '.[table]' in the folder of sagnac's source"
    )
    assert isinstance(error, ImportError)
    assert (error.purpose, error.package, error.extra) == ("a turning table", "finufft", "table")
    assert str(error.at("run.csv")).startswith("run.csv: a turning table needs finufft, ")


def test_errors_cross_to_another_process():
    for error in (
        MissingExtra("a turning table", "finufft", "table"),
        RecordingError("is stuck", path="run.csv", channel="x", remedy="take another"),
        ArgumentError("confidence", "is 2; give a number between 0 and 1"),
    ):
        back = pickle.loads(pickle.dumps(error))
        assert (type(back), str(back), vars(back)) == (type(error), str(error), vars(error))


@pytest.mark.parametrize(
    ("argument", "call"),
    [
        ("confidence", lambda: Settings(confidence=2.0)),
        ("sample_rate", lambda: sagnac.stability_curve(LONG, kind="rate", sample_rate=-1.0)),
        ("span", lambda: sagnac.campaign("a.csv", "b", span=-1.0)),
        ("specification", lambda: sagnac.plan(NOISY, specification="B=1deg/h")),
        ("specification", lambda: sagnac.judge(analyze(NOISY), "5 apples")),
        ("path", lambda: sagnac.read("")),
    ],
)
def test_an_error_carries_the_argument_that_it_is_of(argument, call):
    with pytest.raises(sagnac.ArgumentError, match=rf"^{argument} ") as caught:
        call()
    assert caught.value.argument == argument
    assert isinstance(caught.value, ValueError)


def test_an_error_of_a_type_carries_its_argument_too():
    with pytest.raises(TypeError, match=r"^path is 5") as caught:
        sagnac.read(5)
    assert caught.value.argument == "path"


def test_one_sample_and_two_samples():
    assert (counted(1, "sample"), counted(2, "sample")) == ("1 sample", "2 samples")


@pytest.mark.parametrize(
    "value",
    [pd.Series(LONG), xr.DataArray(LONG), LONG.tolist(), "x" * 100_000, {n: n for n in range(999)}],
    ids=["series", "xarray", "list", "text", "mapping"],
)
def test_a_value_is_shown_in_one_short_line(value):
    assert len(quoted(value)) <= 120
    assert "\n" not in quoted(value)
    with pytest.raises(ValueError, match="scale is") as caught:
        Statement(scale=value)
    assert len(str(caught.value)) < 300
    with pytest.raises((ValueError, TypeError)) as caught:
        Settings(gyros=value)
    assert len(str(caught.value)) < 300


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: plan(still(), within="1%"), "within is '1%'; give a half width"),
        (lambda: plan(still(), within=["0.01"]), "within is '0.01'; give a half width"),
        (lambda: align((NOISE,) * 3, after=["60s"]), "after is '60s'; give seconds"),
        (lambda: align((NOISE,) * 3, after="60s"), "after is '60s'; give seconds"),
        (lambda: align((NOISE,) * 3, after=[]), "after is (); give seconds, above zero"),
        (lambda: align((NOISE,) * 3, latitude=0.5, rest=1e9), "rest is 1000000000.0; give 1 to"),
        (lambda: align((NOISE,) * 3, bias="1deg/h"), "bias is '1deg/h'; give zero"),
        (lambda: align((NOISE,) * 3, confidence="95%"), "confidence is '95%'; give a number"),
        (lambda: align((NOISE,) * 3, after=[1e300]), "after is 1e+300; give seconds, above zero, "),
        (lambda: analyze(still(), confidence=1.0 - 1e-16), "at most that far from 1"),
        (lambda: analyze(still(), confidence=1e-300), "confidence is 1e-300; give 1e-09 or more"),
        (lambda: still(sample_rate=True), "sample_rate is True; give samples per second"),
        (lambda: align((1.0, 1.0, 1.0)), "give one analysis of all gyros"),
        (lambda: align((NOISE,) * 3, latitude=45.0), "is 2578.31 deg, 45 rad; give -89 to 89 deg"),
        (lambda: align((NOISE,) * 3, azimuth=10.0), "is 572.958 deg, 10 rad; give 180 deg at most"),
        (lambda: align((NOISE,) * 3, tilt=2.0), "tilt is 114.592 deg, 2 rad; give 90 deg at most"),
        (lambda: still(sample_rate="200"), "sample_rate is '200'; give samples per second"),
        (lambda: analyze(still(), confidence="0.9"), "confidence is '0.9'; give a number"),
    ],
)
def test_what_is_no_number_is_named(call, said):
    with pytest.raises(ValueError, match=re.escape(said)):
        call()


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: sagnac.keywords(None), "texts is None; give option -> text"),
        (lambda: sagnac.write_report(analyze(NOISY), "new", block="unit 7"), "block is 'unit 7'"),
        (lambda: sagnac.read("a.csv", {"kind": "rate"}), "statement is {'kind': 'rate'}; give a"),
        (lambda: sagnac.campaign("a.csv", "new", settings=3), "settings is 3; give Settings(...)"),
        (lambda: sagnac.RigConfig.from_analysis(None), "analysis is None; give what analyze"),
        (lambda: sagnac.plan("a.csv"), "source is 'a.csv'; give a recording"),
    ],
)
def test_what_is_of_another_type_is_named(call, said):
    with pytest.raises(TypeError, match=re.escape(said)):
        call()


def test_a_rate_may_be_an_array_of_one_number():
    assert still(sample_rate=np.array(10.0)).sample_rate == 10.0


def test_an_empty_gyro_is_short_and_not_stuck():
    with pytest.raises(RecordingError, match="x: has too few samples"):
        analyze(still(x=[]))


def test_a_remedy_is_one_that_a_program_has():
    assert str(Note(text="look again ({accept motion})")) == "look again (accepted=motion)"
    rates = NOISY["x"].values.copy()
    rates[7] = np.nan
    with pytest.raises(RecordingError, match=r"in place of span take recording\[FIRST:STOP\]"):
        analyze(still(x=rates))


SHEET = ["N=0.004deg/s/sqrt(Hz),B=2deg/h@100s"]


def of_arrays(**more):
    return Recording.from_arrays(x=range(100), kind="rate", unit="deg/h", **more)


@pytest.mark.parametrize(
    ("call", "argument"),
    [
        (lambda: of_arrays(times=range(100), time_unit="m"), "time_unit"),
        (lambda: of_arrays(sample_rate=1.0, table=range(100), table_unit="deg/s"), "table_unit"),
        (lambda: align((NOISE,) * 3, latitude=0.5, rest=1e-3), "rest"),
        (lambda: align((NOISE,) * 3, foretold=3), "foretold"),
        (lambda: sagnac.campaign("a.csv", "new", pattern=3), "pattern"),
        (lambda: sagnac.write_report(analyze(NOISY), "new", settings=3), "settings"),
        (lambda: sagnac.export(path=3, tool="gtsam", datasheet=SHEET), "path"),
        (lambda: sagnac.export(path="", tool="gtsam", datasheet=SHEET), "path"),
        (lambda: sagnac.export(NOISY, tool="toml", markov=1.0), "markov"),
        (lambda: sagnac.export(NOISY, tool="toml", markov=True), "markov"),
        (
            lambda: sagnac.stability_curve(LONG, kind="rate", sample_rate=1.0, noise_type=True),
            "noise_type",
        ),
    ],
)
def test_an_error_names_the_argument_that_was_given(call, argument):
    with pytest.raises((ArgumentError, TypeError), match=rf"^{argument} ") as caught:
        call()
    assert caught.value.argument == argument


def test_arguments_that_are_right_are_taken(tmp_path):
    made = of_arrays(times=range(100), time_unit="ms", table=range(100), table_unit="arcmin")
    assert made.sample_rate == 1000.0
    assert align((NOISE,) * 3, latitude=0.5, rest=1.0, foretold="its N").prospect is not None
    made = sagnac.export(path=tmp_path / "a.py", datasheet=SHEET)
    assert (tmp_path / "a.py").read_text() == made.text
    assert sagnac.export(analyze(NOISY), tool="toml", markov=np.int64(1)).tool == "toml"
    curve = sagnac.stability_curve(LONG, kind="rate", sample_rate=1.0, taus=[1], noise_type=-2)
    assert curve.noise_type.tolist() == [-2]


@pytest.mark.parametrize(
    ("times", "rate"), [([0, 2, 1] * 33 + [200], None), ([0] * 100, None), (range(100), 3.0)]
)
def test_a_remedy_of_stamps_is_one_that_arrays_have(times, rate):
    with pytest.raises(RecordingError, match=r"no times") as caught:
        of_arrays(times=times, sample_rate=rate)
    assert "time=none" not in str(caught.value)
    assert of_arrays(sample_rate=3.0).sample_rate == 3.0


@pytest.mark.parametrize("confidence", [0.5, 0.683, 0.9, 0.95, 0.99, 0.9973])
def test_usual_confidences_are_printed_as_people_write_them(confidence):
    assert per_cent(confidence) == f"{round(100.0 * confidence, 2):g} %"


def test_a_confidence_near_one_is_nowhere_printed_as_100_percent(tmp_path):
    """0.9999999 was printed as 100 %, which no interval has."""
    found = analyze(NOISY, confidence=0.9999999)
    report = sagnac.write_report(found, tmp_path / "report")
    axes = sagnac.plot.stability(found, Figure().add_subplot())
    legend = [text.get_text() for text in axes.get_legend().get_texts()]
    page = report.paths[0].read_text(encoding="utf-8")
    for shown in (str(found.angle_random_walk), " ".join(legend), page, answer(found)):
        assert "99.99999 %" in shown
        assert re.search(r"(?<![\d.])100 %", shown) is None
