"""The one door: what it names, what it costs, and what it can do without."""

import inspect
import pickle
import re
from dataclasses import fields, replace
from functools import cache, partial
from pathlib import Path
from typing import get_args

import numpy as np
import pytest
from matplotlib.figure import Figure

import sagnac
from sagnac.noise.laws import COEFFICIENT_NAMES
from sagnac.verdict.limits import specification_of
from tests.processes import PYTHON, ran


def test_the_door_shows_what_it_exports_and_nothing_else():
    """Which names these are stands on the page of the library, as tests/test_site.py compares."""
    assert set(dir(sagnac)) == set(sagnac.__all__) > {"plot", "__version__"}
    for name in sagnac.__all__:
        assert getattr(sagnac, name) is not None
        assert name == "__version__" or getattr(sagnac, name).__doc__


def test_a_name_that_is_not_there_is_an_attribute_error():
    with pytest.raises(AttributeError, match="no attribute 'likelihood'"):
        _ = sagnac.likelihood


HEAVY = {"numpy", "scipy", "numba", "matplotlib", "pyarrow", "h5py", "pandas", "finufft"}
# Each takes as long to load as several transforms of two hours.
SLOW = {"scipy.signal", "scipy.stats", "matplotlib", "pandas"}


def test_nothing_is_loaded_before_it_is_needed():
    """The door nothing heavy, an analysis nothing slow, a screen of text nothing that draws."""
    asked = {
        "sagnac": HEAVY,
        "sagnac.analysis.pipeline": SLOW,
        "sagnac.report.text, sagnac.fleet.table": {"matplotlib"},
    }
    code = "".join(
        f"import {one}; print({left} & set(sys.modules)); " for one, left in asked.items()
    )
    done = ran(PYTHON, "-c", f"import sys; {code}")
    assert done.stdout.split("\n") == [*3 * ["set()"], ""], done.stderr


def bench(samples: int = 20_000) -> sagnac.Recording:
    """Two gyros of 1e-6 rad/sqrt(s) at rest, 10 Hz, and an accelerometer."""
    random = np.random.default_rng(4)
    rates = {name: 1e-6 * np.sqrt(10.0) * random.standard_normal(samples) for name in "xy"}
    return sagnac.Recording.from_arrays(
        **rates,
        az=9.81 + 1e-3 * random.standard_normal(samples),
        kind="rate",
        unit={"x": "rad/s", "y": "rad/s", "az": "m/s^2"},
        sample_rate=10.0,
    )


@pytest.fixture(scope="module")
def analyzed() -> sagnac.Analysis:
    return sagnac.analyze(bench(), confidence=0.9, estimators=("mdev", "tdev"))


def test_choices_of_an_analysis_are_keywords(analyzed):
    settings = sagnac.Settings(confidence=0.9)
    alone = replace(bench(), gyros=bench().gyros[:1], accelerometers=())
    assert sagnac.analyze(alone, settings).angle_random_walk == analyzed.angle_random_walk
    for wrong, said in (
        ("metod", "analyze has no keyword 'metod'; did you mean method?"),
        ("progres", "analyze has no keyword 'progres'; did you mean progress?"),
        ("zzz", "analyze has no keyword 'zzz'; use one of gyros, method, interval, "),
    ):
        with pytest.raises(TypeError, match=re.escape(said)):
            sagnac.analyze(bench(100), **{wrong: "fos"})


@pytest.mark.parametrize(
    ("function", "group", "of"),
    [
        ("read", "stated", "Statement"),
        ("missing", "stated", "Statement"),
        ("analyze", "choices", "Settings"),
    ],
)
def test_editors_are_told_every_keyword(function, group, of):
    (keywords,) = get_args(
        inspect.signature(getattr(sagnac, function)).parameters[group].annotation
    )
    assert set(keywords.__annotations__) == {one.name for one in fields(getattr(sagnac, of))}
    named = re.findall(r"``(\w+)``", getattr(sagnac, function).__doc__)
    assert function == "missing" or set(keywords.__annotations__) <= set(named)


def test_an_analysis_is_read_back_from_its_document(tmp_path, analyzed):
    path = tmp_path / "analysis.json"
    text = analyzed.to_json(path)
    assert path.read_text() == text + "\n"
    back = sagnac.Analysis.from_json(path)
    assert back.to_json() == text
    for one, other in [(back, analyzed), *zip(back.each, analyzed.each, strict=True)]:
        assert one.angle_random_walk.value == pytest.approx(other.angle_random_walk.value, 1e-12)
        assert one.angle_random_walk.status == other.angle_random_walk.status
        assert {**one.coefficients}.keys() == {**other.coefficients}.keys()
        assert len(one.family) == len(other.family)
        for curve, made in zip((one.curve, *one.family), (other.curve, *other.family), strict=True):
            for name in ("tau", "deviation", "low", "high", "edf", "terms", "noise_type"):
                read = getattr(curve, name)
                np.testing.assert_allclose(read, getattr(made, name), rtol=1e-12)
            assert (curve.estimator, curve.confidence) == (made.estimator, made.confidence)
        assert one.settings.estimators == other.settings.estimators
        assert [note.name for note in one.findings] == [note.name for note in other.findings]
    force, measured = back.accelerometers["az"], analyzed.accelerometers["az"]
    assert force.sensor == "accelerometer"
    assert force.angle_random_walk.to("m/s/sqrt(h)").value == pytest.approx(
        measured.angle_random_walk.to("m/s/sqrt(h)").value
    )
    with pytest.raises(AttributeError, match=r"spectrum is not in analysis\.json; analyze"):
        _ = back.spectrum
    with pytest.raises(AttributeError, match="no attribute 'spectre'"):
        _ = back.spectre
    assert pickle.loads(pickle.dumps(back)).to_json() == text
    with pytest.raises(ValueError, match="was read from a file"):
        sagnac.write_report(back, tmp_path / "report")
    assert not (tmp_path / "report").exists()


def test_the_curve_of_an_analysis_that_was_read_again_is_drawn(tmp_path, analyzed):
    analyzed.to_json(tmp_path / "analysis.json")
    back = sagnac.Analysis.from_json(tmp_path / "analysis.json")
    drawn, read = (
        sagnac.plot.stability(one, ax=Figure().add_subplot()) for one in (analyzed, back)
    )
    points, again = (
        next(line for line in axes.lines if line.get_marker() == "o") for axes in (drawn, read)
    )
    np.testing.assert_allclose(again.get_ydata(), points.get_ydata(), rtol=1e-12)


def test_spectra_are_compared_by_their_values(analyzed):
    """Two spectra compared raised numpy's "truth value of an array", and so did a copy."""
    spectrum = analyzed.spectrum
    assert pickle.loads(pickle.dumps(spectrum)) == spectrum
    assert replace(spectrum, density=2.0 * spectrum.density) != spectrum
    assert spectrum != "spectrum"


def test_a_plan_as_a_frame_is_all_numbers(analyzed):
    """Without a limit, or without a width, a column of it was None, which is no number."""
    limit = "N=1deg/sqrt(h)"
    widths = sagnac.plan(analyzed, within=0.02).to_frame()
    limits = sagnac.plan(analyzed, within=(), specification=limit).to_frame()
    for frame, empty in ((widths, "limit_rad_per_sqrt_s"), (limits, "half_width")):
        assert frame[empty].isna().all()
        numbers = frame.drop(columns="channel")
        np.testing.assert_array_equal(2.0 * numbers, numbers + numbers)
        assert {one.kind for one in numbers.dtypes} == {"f"}
    assert set(widths.half_width) == {0.02}
    np.testing.assert_allclose(limits.limit_rad_per_sqrt_s, np.pi / 180.0 / 60.0)


def test_the_answer_as_frames_has_its_units(tmp_path, analyzed):
    frame = analyzed.to_frame().set_index(["channel", "coefficient"])
    degrees = np.rad2deg(1e-6) * 60.0
    for name in "xy":
        row = frame.loc[(name, "angle_random_walk")]
        assert row.low < degrees < row.high
        assert row.unit == "deg/sqrt(h)"
    assert frame.loc[("az", "angle_random_walk")].unit == "m/s/sqrt(h)"
    assert {"estimated", "upper bound"} <= set(frame.status)
    for row in frame.itertuples():
        low, value, high = (f"{figure:.4g}" for figure in (row.low, row.value, row.high))
        interval, bound = f"{value} ({low} to {high}) {row.unit}", f"below {high} {row.unit}"
        written = {"estimated": interval, "upper bound": bound}
        assert row.text == written.get(row.status, row.status)
    dataset = analyzed.to_xarray()
    walk = dataset["angle_random_walk"]
    assert walk.attrs["units"] == "deg/sqrt(h)"
    assert list(dataset.channel.values) == ["x", "y"]
    assert float(walk.sel(channel="y", figure="low")) == frame.loc[("y", "angle_random_walk")].low
    path = tmp_path / "analysis.json"
    analyzed.to_json(path)
    back = sagnac.Analysis.from_json(path).to_frame()
    np.testing.assert_allclose(back["value"], analyzed.to_frame()["value"], rtol=1e-12)
    assert back["coefficient"].tolist() == [*COEFFICIENT_NAMES] * 3


@pytest.mark.usefixtures("in_this_process", "blank_figures")
def test_a_day_in_a_script(tmp_path, analyzed):
    """Check, judge, report, settings of a filter, a campaign: what the commands do."""
    stuck = bench()
    stuck.gyro("x").values[5000:9000] = 0.0
    assert sagnac.check(bench()) == () or sagnac.check(bench())[0].level == "remark"
    assert [note.channel for note in sagnac.check(stuck) if note.level == "error"] == ["x"]
    assert sagnac.judge(analyzed, "1deg/sqrt(h)").decision == "pass"
    assert sagnac.judge(analyzed, "1e-4deg/sqrt(h)").decision == "fail"
    report = sagnac.write_report(analyzed, tmp_path / "unit")
    assert all(path.stat().st_size for path in report.paths)
    made = sagnac.export(analyzed, tmp_path / "imu.yaml")
    assert made.tool == "kalibr"
    assert (tmp_path / "imu.yaml").read_text() == made.text
    assert made.text == sagnac.export(tmp_path / "unit", tool="kalibr").text
    with pytest.raises(ValueError, match="markov has no effect on Kalibr") as error:
        sagnac.export(analyzed, tmp_path / "imu.yaml", markov=1)
    assert isinstance(error.value, sagnac.ArgumentError)
    assert error.value.argument == "markov"
    wide, narrow = sagnac.plan(analyzed, within=[0.02, 0.01]).to_frame().hours[:2]
    assert 3.0 < narrow / wide < 6.0
    ahead = sagnac.align(analyzed, after=[100.0], latitude=0.8)
    assert 1e-5 < ahead.unaided.drift.heading.deviation(misaligned=False)[0] < 1e-2
    assert ahead.prospect.filtered.covariance.shape[0] >= 3
    (tmp_path / "runs").mkdir()
    sagnac.write(bench(4000), tmp_path / "runs" / "run.npz")
    done = sagnac.campaign(tmp_path / "runs", tmp_path / "campaign", workers=1, method="none")
    assert [line.state for line in done.lines] == ["done"] * len(done.lines)
    assert len(done.to_frame()) == len(done.lines) >= 2
    assert "of 1 row, 0 without an answer" in repr(done)
    assert len(repr(done)) < 200
    for wrong, meant in (("methods", "method"), ("patern", "pattern"), ("worker", "workers")):
        with pytest.raises(
            TypeError, match=rf"campaign has no keyword '{wrong}'; did you mean {meant}\?"
        ):
            sagnac.campaign(tmp_path, tmp_path / "campaign", **{wrong: "none"})


def test_a_file_that_would_be_lost_is_an_error_of_the_door(tmp_path):
    """One that the package wrote is replaced without a word."""
    own, foreign = tmp_path / "own.csv", tmp_path / "foreign.csv"
    foreign.write_text("a,b\n1,2\n")
    with pytest.raises(sagnac.WouldOverwrite, match=r"foreign\.csv: is there"):
        sagnac.write(bench(100), foreign)
    assert foreign.read_text() == "a,b\n1,2\n"
    for samples in (100, 200):
        sagnac.write(bench(samples), own)
    assert sagnac.read(own).samples == 200


def test_a_stretch_and_a_channel_of_a_recording():
    whole = bench(100)
    part = whole[10:40]
    assert (len(whole), len(part)) == (100, 30)
    np.testing.assert_array_equal(part["y"].values, whole.gyro("y").values[10:40])
    assert part["az"].sensor == "accelerometer"
    for wrong in (slice(5, 5), slice(0, 10, 2)):
        with pytest.raises(ValueError, match="no stretch"):
            _ = whole[wrong]
    with pytest.raises(KeyError, match="there are x, y, az"):
        _ = whole["z"]


@pytest.mark.usefixtures("in_this_process", "blank_figures")
def test_the_page_of_the_library_runs_as_it_is_printed(tmp_path, monkeypatch, capsys):
    page = Path(__file__).parents[1] / "docs" / "library.md"
    blocks = re.findall(r"```python\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL)
    assert len(blocks) >= 9
    monkeypatch.chdir(tmp_path)
    exec("\n".join(blocks), {})
    assert capsys.readouterr().err == ""
    assert (tmp_path / "rack report" / "index.html").is_file()


def test_what_is_no_recording_and_no_specification_is_named(analyzed):
    for call in (sagnac.analyze, sagnac.check):
        for wrong in (np.ones(100), "run.csv"):
            with pytest.raises(TypeError, match=r"read one with read\(path\)"):
                call(wrong)
    still = analyzed.recording
    for call in (sagnac.self_noise, lambda wrong: sagnac.write(wrong, "run.csv")):
        with pytest.raises(TypeError, match="recording is <Analysis"):
            call(analyzed)
    judge, write = lambda it: sagnac.judge(it, "1"), lambda it: sagnac.write_report(it, "report")
    for call in (judge, write, sagnac.trial):
        with pytest.raises(TypeError, match=r"analysis is Recording.* give what analyze\("):
            call(still)
    for call in (sagnac.align, lambda wrong: sagnac.export(wrong, tool="kalibr")):
        with pytest.raises(TypeError, match=r"source is Recording.* or the path of its analysis"):
            call(still)
    stored = sagnac.Analysis.from_json(analyzed.to_json())
    for call in (sagnac.plan, sagnac.trial, write):
        with pytest.raises(ValueError, match="analysis was read from a file"):
            call(stored)
    with pytest.raises(TypeError, match=r"specification is 0\.3"):
        sagnac.judge(analyzed, 0.3)
    for wrong, said in (
        ({"confidence": 95.0}, "confidence is 95"),
        ({"latitude": 52}, "latitude is 2979.38 deg, 52 rad; give -89 to 89 deg"),
        ({"latitude": "a"}, "latitude is 'a'; give -89 to 89"),
        ({"latitude": 0.8, "table_rate": "a"}, "table_rate is 'a'; give the rate"),
    ):
        with pytest.raises(ValueError, match=said):
            sagnac.align(analyzed, **wrong)
    assert len(sagnac.plan(analyzed, within=0.02).plans[0].rows) == 1
    status = analyzed.to_xarray()["bias_instability_status"].sel(channel="x").item()
    assert status == analyzed.coefficients["bias_instability"].status


NOISE = np.random.default_rng(4).standard_normal(500)
RATE = {"kind": "rate", "sample_rate": 10.0}
STATED = {"unit": "deg/h", **RATE}
STILL = sagnac.Recording.from_arrays(x=NOISE, **STATED)
SHEET = {"tool": "kalibr", "datasheet": "N=0.15deg/sqrt(h),B=3deg/h@100s", "rate": 100.0}
LIMITS = specification_of("N=1deg/sqrt(h)").limits
HIDDEN = np.ma.masked_array(NOISE, np.arange(500) == 6)
ROWS = [{"x": one} for one in NOISE]


@cache
def answer() -> sagnac.Analysis:
    return sagnac.analyze(STILL)


def wrong(said, function, *given, **named):
    """A call that is refused, and the words; a function among what is given is called first."""
    return pytest.param(function, given, named, said)


def arrays(said, **stated):
    """The same of a recording that is made of arrays."""
    return wrong(said, sagnac.Recording.from_arrays, **{"x": NOISE, **STATED, **stated})


SEARCH = partial(sagnac.fast_orthogonal_search, spacing=1.0)
FRAME = "^frame is .{1,200}; give a frame of pandas or xarray, or a dictionary of columns$"
NO_PATH, EMPTY = "(path|folder) is 3; give a path", "(path|folder) is empty; give a path"
NO_PROGRESS = "progress is 3; give a function"


@pytest.mark.parametrize(
    ("function", "given", "named", "said"),
    [
        wrong("taus is 'all'", sagnac.stability_curve, NOISE, **RATE, taus="all"),
        wrong("kind is", sagnac.deviation_at_every_tau, NOISE, kind="Rate", sample_rate=1.0),
        wrong("_rate is", sagnac.deviation_at_every_tau, NOISE, kind="rate", sample_rate=-1.0),
        wrong("sample 6 .* is missing, 1 in all; use gaps='omit' of stability_curve, or fill",
              sagnac.deviation_at_every_tau, HIDDEN, **RATE),
        wrong("sample 6 is not finite", sagnac.fit_coefficients, HIDDEN, **RATE),
        wrong("holds complex128 values", sagnac.fit_coefficients, NOISE + 0j, **RATE),
        wrong("values reach 3.* unit", sagnac.fit_coefficients, 1e200 * NOISE, **RATE),
        wrong("signal", SEARCH, NOISE, HIDDEN, candidates=9),
        wrong("candidates is 2.7", SEARCH, NOISE, NOISE, candidates=2.7),
        wrong("00, for which .* GiB of memory are needed, and .* or fewer", SEARCH, NOISE, NOISE,
              candidates=10**12),
        wrong("settings is", sagnac.analyze, STILL, {"method": "none"}),
        wrong("interval is '1s'", sagnac.analyze, STILL, interval="1s"),
        wrong("accepted is None", sagnac.analyze, STILL, accepted=None),
        wrong("gyros is None", sagnac.analyze, STILL, gyros=None),
        wrong("specification is", sagnac.analyze, STILL, specification=("N=1",)),
        wrong("5 is no name and no slice", STILL.__getitem__, 5),
        wrong("give 'x', whose values are an array", sagnac.stability_curve, STILL, **RATE),
        wrong("sensor is 'gyros'", sagnac.Channel.from_values, "x", NOISE, kind="rate",
              unit="deg/h", sensor="gyros"),
        arrays("unit is None", unit=None),
        arrays("period is '360'", unit="deg", kind="angle", period="360"),
        arrays("pickoffs is", pickoffs=["x"]),
        arrays("unit: name is 'q'; use one of x", unit={"x": "deg/h", "q": "deg/s"}),
        arrays("kind: name is 'q'; use one of x", kind={"x": "rate", "q": "rate"}),
        arrays("table_unit is 'rad', and there is no table", table_unit="rad"),
        arrays(r"sample_rate is 1e\+300; give samples per second", sample_rate=1e300),
        arrays("time: runs backwards 499 times, first at 0.000 s; correct the stamps",
               times=np.arange(NOISE.size)[::-1]),
        arrays("time: 1 sample NaN or infinite, the first at 2.000 s; correct the stamps",
               x=[1, 2, 3, 4], sample_rate=None, times=[0.0, 1.0, np.nan, 3.0]),
        wrong("time: most stamps repeat", sagnac.analyze,
              lambda: sagnac.Recording.from_arrays(x=NOISE, **STATED, times=np.zeros(NOISE.size))),
        *(wrong(FRAME, sagnac.Recording.from_frame, one, kind="rate")
          for one in (None, ROWS, NOISE.astype([("x", float)]))),
        wrong("within is None", sagnac.plan, STILL, within=None),
        wrong("within is empty, and there is no limit", sagnac.plan, STILL, within=[]),
        *(wrong(" is None; give an object", getattr(sagnac.plot, draw), None)
          for draw in sagnac.plot.__all__),
        wrong("ax is 3; give axes", sagnac.plot.stability, answer, 3),
        *(wrong(NO_PATH, function, 3) for function in (
            sagnac.read, sagnac.columns, sagnac.missing, sagnac.Analysis.from_json)),
        *(wrong(NO_PATH, function, first, 3) for function, first in (
            (sagnac.write, STILL), (sagnac.write_report, answer), (sagnac.campaign, "rack"),
            (sagnac.Analysis.to_json, answer))),
        wrong(EMPTY, sagnac.read, ""),
        *(wrong(EMPTY, function, first, "") for function, first in (
            (sagnac.write, STILL), (sagnac.write_report, answer), (sagnac.campaign, "rack"))),
        wrong(NO_PROGRESS, sagnac.analyze, STILL, progress=3),
        wrong(NO_PROGRESS, sagnac.remove_lines, NOISE, None, 10.0, channel="x", progress=3),
        wrong(NO_PROGRESS, sagnac.simulate, sagnac.RigConfig(duration_s=1.0), progress=3),
        wrong("strict is 'no'; use one of False, True", sagnac.Settings, strict="no"),
        wrong("verify is 'no'; use one of False, True", sagnac.read, "run.csv", verify="no"),
        *(wrong(f"{name} is 'no'; use one of False, True", sagnac.write_report, answer, "made",
                **{name: "no"}) for name in ("pdf", "with_forces", "force")),
        wrong("sources is 3", sagnac.campaign, 3, "made"),
        wrong(r"sources is \[\]", sagnac.campaign, [], "made"),
        wrong("told is 3; give a function, or None", sagnac.campaign, "rack", "made", told=3),
        wrong("span is '1min'", sagnac.campaign, "rack", "made", span="1min"),
        wrong("names x twice", sagnac.keywords, {"columns": "x=y,x=z"}),
        wrong("risk is '1%'", sagnac.Specification, limits=LIMITS, risk="1%"),
        *(wrong(f"{name} (is|has)", sagnac.trial, answer, **{name: value}) for name, value in (
            ("masked", [3.0]), ("masked", None), ("left_in", 3), ("before", 3))),
        *(wrong(f"{name} is", sagnac.export, **{**SHEET, name: value}) for name, value in (
            ("rate", 1e300), ("rate", "100"), ("topic", 3), ("accelerometer", 3),
            ("datasheet", 3))),
    ],
)  # fmt: skip
def test_what_makes_no_sense_is_named(function, given, named, said):
    made = [one() if callable(one) else one for one in given]
    with pytest.raises((ValueError, TypeError, sagnac.RecordingError), match=said):
        function(*made, **named)


@pytest.mark.parametrize(
    ("name", "call"),
    [
        ("own.csv", lambda path, **how: sagnac.write(STILL, path, **how)),
        ("own.json", lambda path, **how: answer().to_json(path, **how)),
        ("own.yaml", lambda path, **how: sagnac.export(answer(), path, **how)),
        ("report.html", lambda path, **how: sagnac.write_report(answer(), path.parent, **how)),
    ],
)
def test_only_a_true_force_writes_over_a_file(tmp_path, name, call):
    """``force="no"`` is true to Python, and took what stood there."""
    path = tmp_path / name
    path.write_text("mine\n")
    for wrong_one in ("no", "False", None, 2):
        with pytest.raises(ValueError, match=f"force is {wrong_one!r}; use one of False, True"):
            call(path, force=wrong_one)
    with pytest.raises(sagnac.RecordingError, match="is there, and no such run made it"):
        call(path, force=np.bool_(False))
    assert path.read_text() == "mine\n"
    call(path, force=np.bool_(True))
    assert path.read_text() != "mine\n"


def test_azimuth_is_foretold_with_the_loudest_gyro(analyzed):
    quiet = sagnac.align(analyzed, latitude=0.8).prospect.noise
    loud = replace(quiet, angle_random_walk=9.0 * quiet.angle_random_walk)
    for triad in ((quiet, loud, quiet), (quiet, quiet, loud)):
        assert sagnac.align(triad, latitude=0.8).prospect.noise is loud


@pytest.mark.parametrize("of", [np.float32, np.int64, np.array])
def test_numbers_of_numpy_are_numbers_in_the_document(of):
    rate = np.random.default_rng(3).standard_normal(4000)
    recording = sagnac.Recording.from_arrays(x=rate, kind="rate", unit="deg/s", sample_rate=of(100))
    written = sagnac.analyze(recording, interval=of(1), confidence=np.float32(0.9)).to_json()
    assert sagnac.Analysis.from_json(written).settings.interval == 1.0
