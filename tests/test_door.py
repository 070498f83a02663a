"""The one door: what it names, what it costs, and what it can do without."""

import pickle
import re
import subprocess
import sys
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

import sagnac
from sagnac.noise.laws import COEFFICIENT_NAMES
from sagnac.verdict.limits import specification_of

NAMES = {
    "Analysis",
    "CampaignReport",
    "Channel",
    "Estimate",
    "Exported",
    "Fit",
    "Foresight",
    "Line",
    "MissingExtra",
    "Note",
    "OrthogonalSearch",
    "Plans",
    "Recording",
    "RecordingError",
    "Removal",
    "Report",
    "RigConfig",
    "SelfNoise",
    "Settings",
    "Specification",
    "StabilityCurve",
    "Statement",
    "Trial",
    "Verdict",
    "__version__",
    "align",
    "analyze",
    "campaign",
    "check",
    "columns",
    "deviation_at_every_tau",
    "export",
    "fast_orthogonal_search",
    "fit_coefficients",
    "judge",
    "keywords",
    "missing",
    "plan",
    "plot",
    "read",
    "remove_lines",
    "self_noise",
    "simulate",
    "stability_curve",
    "trial",
    "write",
    "write_report",
}


def run(code, *arguments):
    return subprocess.run(
        [sys.executable, "-c", code, *arguments],
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )


def test_the_door_shows_what_it_exports_and_nothing_else():
    assert set(dir(sagnac)) == set(sagnac.__all__) == NAMES
    for name in NAMES:
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
    done = run(f"import sys; {code}")
    assert done.stdout.split("\n") == [*3 * ["set()"], ""], done.stderr


def test_field_units_are_converted_on_the_way_in():
    rates = np.random.default_rng(3).standard_normal(4000)
    one = sagnac.Recording.from_arrays(x=list(rates), kind="rate", unit="deg/s", sample_rate=10.0)
    other = sagnac.Recording.from_arrays(
        x=np.deg2rad(rates), kind="rate", unit="rad/s", sample_rate=10.0
    )
    np.testing.assert_allclose(one.gyro("x").values, other.gyro("x").values, rtol=1e-12)
    found = sagnac.analyze(one, sagnac.Settings(method="none", interval=None))
    truth = np.deg2rad(1.0) / np.sqrt(10.0)
    assert found.angle_random_walk.low < truth < found.angle_random_walk.high
    degrees = float(found.angle_random_walk.to("deg/sqrt(h)"))
    assert degrees == pytest.approx(np.rad2deg(found.angle_random_walk.value) * 60.0)


BLOCKED = "import sys; sys.modules['finufft'] = None; "


def test_the_still_bench_runs_without_finufft(tmp_path):
    path = tmp_path / "still.csv"
    values = np.random.default_rng(5).standard_normal(3000)
    np.savetxt(path, values, header="x", comments="")
    done = run(
        BLOCKED + "from sagnac.cli import main; sys.exit(main())",
        "avar",
        str(path),
        "--kind",
        "rate",
        "--unit",
        "deg/h",
        "--rate",
        "10",
    )
    assert done.returncode == 0, done.stderr
    assert "ARW of gyro x" in done.stdout


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
    assert sagnac.analyze(bench(), settings).angle_random_walk == analyzed.angle_random_walk
    for wrong, said in (
        ("metod", "analyze has no keyword 'metod'; did you mean method?"),
        ("progres", "analyze has no keyword 'progres'; did you mean progress?"),
        ("zzz", "analyze has no keyword 'zzz'; use one of gyros, method, interval, "),
    ):
        with pytest.raises(TypeError, match=re.escape(said)):
            sagnac.analyze(bench(100), **{wrong: "fos"})


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


def test_a_document_that_is_none_is_one_line(tmp_path):
    for text in ("[]", "{}", '{"schema": "sagnac.analysis/1"}'):
        (tmp_path / "a.json").write_text(text)
        with pytest.raises(sagnac.RecordingError, match=r"a\.json") as error:
            sagnac.Analysis.from_json(tmp_path / "a.json")
        assert len(str(error.value).splitlines()) == 1


def test_the_answer_as_frames_has_its_units(tmp_path, analyzed):
    frame = analyzed.to_frame().set_index(["channel", "coefficient"])
    degrees = np.rad2deg(1e-6) * 60.0
    for name in "xy":
        row = frame.loc[(name, "angle_random_walk")]
        assert row.low < degrees < row.high
        assert row.unit == "deg/sqrt(h)"
    assert frame.loc[("az", "angle_random_walk")].unit == "m/s/sqrt(h)"
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
    assert type(error.value) is ValueError
    wide, narrow = sagnac.plan(analyzed, within=[0.02, 0.01]).to_frame().hours[:2]
    assert 3.0 < narrow / wide < 6.0
    ahead = sagnac.align(analyzed, after=[100.0], latitude=0.8)
    assert 1e-5 < ahead.unaided.drift.heading.deviation(misaligned=False)[0] < 1e-2
    assert ahead.prospect.filtered.covariance.shape[0] >= 3
    (tmp_path / "runs").mkdir()
    for number in (1, 2):
        sagnac.write(bench(4000 + number), tmp_path / "runs" / f"run{number}.npz")
    done = sagnac.campaign(tmp_path / "runs", tmp_path / "campaign", workers=1, method="none")
    assert [line.state for line in done.lines] == ["done"] * len(done.lines)
    assert len(done.to_frame()) == len(done.lines) >= 4
    for wrong, meant in (("methods", "method"), ("patern", "pattern"), ("worker", "workers")):
        with pytest.raises(
            TypeError, match=rf"campaign has no keyword '{wrong}'; did you mean {meant}\?"
        ):
            sagnac.campaign(tmp_path, tmp_path / "campaign", **{wrong: "none"})


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
        ({"latitude": 52}, "latitude is 2979.38 deg; give -89 to 89"),
        ({"latitude": "a"}, "latitude is 'a'; give -89 to 89"),
        ({"latitude": 0.8, "table_rate": "a"}, "table_rate is 'a'; give the rate"),
    ):
        with pytest.raises(ValueError, match=said):
            sagnac.align(analyzed, **wrong)
    assert len(sagnac.plan(analyzed, within=0.02).plans[0].rows) == 1
    status = analyzed.to_xarray()["bias_instability_status"].sel(channel="x").item()
    assert status == analyzed.coefficients["bias_instability"].status


NOISE = np.random.default_rng(4).standard_normal(500)
AT_10_HZ = {"kind": "rate", "sample_rate": 10.0}
STILL = sagnac.Recording.from_arrays(x=NOISE, unit="deg/h", **AT_10_HZ)
BY_FIGURES = {"tool": "kalibr", "datasheet": "N=0.15deg/sqrt(h),B=3deg/h@100s", "rate": 100.0}
LIMITS = specification_of("N=1deg/sqrt(h)").limits
HIDDEN = np.ma.masked_array(NOISE, np.arange(500) == 6)


@cache
def answer() -> sagnac.Analysis:
    return sagnac.analyze(STILL)


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda still: sagnac.stability_curve(NOISE, **AT_10_HZ, taus="all"), "taus is 'all'"),
        (
            lambda still: sagnac.deviation_at_every_tau(NOISE, kind="Rate", sample_rate=1.0),
            "kind is",
        ),
        (
            lambda still: sagnac.deviation_at_every_tau(NOISE, kind="rate", sample_rate=-1.0),
            "_rate is",
        ),
        (lambda still: sagnac.fit_coefficients(HIDDEN, **AT_10_HZ), "sample 6 is not finite"),
        (lambda still: sagnac.fit_coefficients(NOISE + 0j, **AT_10_HZ), "holds complex128 values"),
        (
            lambda still: sagnac.fast_orthogonal_search(NOISE, HIDDEN, candidates=9, spacing=1.0),
            "signal",
        ),
        (
            lambda still: sagnac.fast_orthogonal_search(NOISE, NOISE, candidates=2.7, spacing=1.0),
            "candidates is 2.7",
        ),
        (
            lambda still: sagnac.Recording.from_arrays(x=NOISE, unit=None, **AT_10_HZ),
            "unit is None",
        ),
        (
            lambda still: sagnac.Channel.from_values(
                "x", NOISE, kind="rate", unit="deg/h", sensor="gyros"
            ),
            "sensor is 'gyros'",
        ),
        (lambda still: sagnac.analyze(still, {"method": "none"}), "settings is"),
        (lambda still: sagnac.analyze(still, interval="1s"), "interval is '1s'"),
        (lambda still: sagnac.analyze(still, accepted=None), "accepted is None"),
        (lambda still: sagnac.analyze(still, gyros=None), "gyros is None"),
        (lambda still: still[5], "5 is no name and no slice"),
        (
            lambda still: sagnac.stability_curve(still, kind="rate", sample_rate=10.0),
            "give 'x', whose values are an array",
        ),
        (
            lambda still: sagnac.Recording.from_arrays(
                x=NOISE, unit="deg", kind="angle", sample_rate=1.0, period="360"
            ),
            "period is '360'",
        ),
        (
            lambda still: sagnac.Recording.from_arrays(
                x=NOISE, unit="deg/h", **AT_10_HZ, pickoffs=["x"]
            ),
            "pickoffs is",
        ),
        *(
            (
                lambda still, wrong=wrong: sagnac.Recording.from_frame(wrong, kind="rate"),
                "^frame is .{1,200}; give a frame of pandas or xarray, or a dictionary of columns$",
            )
            for wrong in (None, [{"x": one} for one in NOISE], NOISE.astype([("x", float)]))
        ),
        (lambda still: sagnac.plan(still, within=None), "within is None"),
        (lambda still: sagnac.plan(still, within=[]), "within is empty, and there is no limit"),
        *(
            (lambda still, draw=draw: getattr(sagnac.plot, draw)(None), " is None; give an object")
            for draw in sagnac.plot.__all__
        ),
        (lambda still: sagnac.plot.stability(answer(), 3), "ax is 3; give axes"),
        *(
            (call, "(path|folder) is 3; give a path")
            for call in (
                lambda still: sagnac.read(3),
                lambda still: sagnac.columns(3),
                lambda still: sagnac.missing(3),
                lambda still: sagnac.write(still, 3),
                lambda still: sagnac.write_report(answer(), 3),
                lambda still: answer().to_json(3),
                lambda still: sagnac.Analysis.from_json(3),
                lambda still: sagnac.campaign("rack", 3),
            )
        ),
        *(
            (call, "(path|folder) is empty; give a path")
            for call in (
                lambda still: sagnac.read(""),
                lambda still: sagnac.write(still, ""),
                lambda still: sagnac.write_report(answer(), ""),
                lambda still: sagnac.campaign("rack", ""),
            )
        ),
        (lambda still: sagnac.analyze(still, progress=3), "progress is 3; give a function"),
        (
            lambda still: sagnac.remove_lines(NOISE, None, 10.0, channel="x", progress=3),
            "progress is 3; give a function",
        ),
        (
            lambda still: sagnac.simulate(sagnac.RigConfig(duration_s=1.0), progress=3),
            "progress is 3; give a function",
        ),
        (lambda still: sagnac.fit_coefficients(1e200 * NOISE, **AT_10_HZ), "values reach 3.* unit"),
        (
            lambda still: sagnac.fast_orthogonal_search(
                NOISE, NOISE, candidates=10**12, spacing=1.0
            ),
            "candidates is 1000000000000, for which .* GiB of memory are needed, and .* or fewer",
        ),
        (lambda still: sagnac.Settings(strict="no"), "strict is 'no'; use one of False, True"),
        *(
            (
                lambda still, stated=stated: sagnac.Recording.from_arrays(
                    **{"x": NOISE, "unit": "deg/h", **AT_10_HZ, **stated}
                ),
                said,
            )
            for stated, said in (
                ({"unit": {"x": "deg/h", "q": "deg/s"}}, "unit: name is 'q'; use one of x"),
                ({"kind": {"x": "rate", "q": "rate"}}, "kind: name is 'q'; use one of x"),
                ({"table_unit": "rad"}, "table_unit is 'rad', and there is no table"),
            )
        ),
        (lambda still: sagnac.campaign(3, "made"), "sources is 3"),
        (lambda still: sagnac.campaign([], "made"), r"sources is \[\]"),
        (
            lambda still: sagnac.analyze(
                sagnac.Recording.from_arrays(
                    x=NOISE, unit="deg/h", **AT_10_HZ, times=np.zeros(NOISE.size)
                )
            ),
            "time: most stamps repeat",
        ),
        (
            lambda still: sagnac.Recording.from_arrays(
                x=NOISE, unit="deg/h", **AT_10_HZ, times=np.arange(NOISE.size)[::-1]
            ),
            "time: runs backwards 499 times, first at 0.000 s; correct the stamps",
        ),
        (
            lambda still: sagnac.Recording.from_arrays(
                x=[1, 2, 3, 4], unit="deg/h", kind="rate", times=[0.0, 1.0, np.nan, 3.0]
            ),
            "time: 1 sample NaN or infinite, the first at 2.000 s; correct the stamps",
        ),
        (
            lambda still: sagnac.Recording.from_arrays(
                x=NOISE, unit="deg/h", kind="rate", sample_rate=1e300
            ),
            r"sample_rate is 1e\+300; give samples per second",
        ),
        (lambda still: sagnac.export(**{**BY_FIGURES, "rate": 1e300}), "rate is"),
        (lambda still: sagnac.keywords({"columns": "x=y,x=z"}), "names x twice"),
        (lambda still: sagnac.campaign("rack", "made", span="1min"), "span is '1min'"),
        (lambda still: sagnac.analyze(still, specification=("N=1",)), "specification is"),
        (lambda still: sagnac.Specification(limits=LIMITS, risk="1%"), "risk is '1%'"),
        *(
            (
                lambda still, wrong=wrong: sagnac.trial(answer(), **wrong),
                f"{next(iter(wrong))} (is|has)",
            )
            for wrong in ({"masked": [3.0]}, {"masked": None}, {"left_in": 3}, {"before": 3})
        ),
        *(
            (
                lambda still, wrong=wrong: sagnac.export(**{**BY_FIGURES, **wrong}),
                f"{next(iter(wrong))} is",
            )
            for wrong in ({"rate": "100"}, {"topic": 3}, {"accelerometer": 3}, {"datasheet": 3})
        ),
    ],
)
def test_what_makes_no_sense_is_named(call, said):
    with pytest.raises((ValueError, TypeError, sagnac.RecordingError), match=said):
        call(STILL)


def test_azimuth_is_foretold_with_the_loudest_gyro(analyzed):
    quiet = sagnac.align(analyzed, latitude=0.8).prospect.noise
    loud = replace(quiet, angle_random_walk=9.0 * quiet.angle_random_walk)
    for triad in ((quiet, loud, quiet), (quiet, quiet, loud)):
        assert sagnac.align(triad, latitude=0.8).prospect.noise is loud
