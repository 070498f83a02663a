"""``sagnac align --after``: what the unit will do."""

import json
import math
import re

import pytest

import sagnac
from sagnac.cli import main
from tests.cli.examples import one_line
from tests.navigation.examples import N, changed, document

DEGREE = math.pi / 180.0


def found(capsys, *words):
    assert main(["align", *map(str, words), "--json"]) == 0
    return json.loads(capsys.readouterr().out)


def test_heading_drift_of_an_analysis_by_the_law_of_its_terms(capsys, tmp_path):
    path = document(tmp_path, gyros=("x",))
    made = found(capsys, path, "--after", "60s,10min", "--time", "300s")
    assert [one["after_s"] for one in made["heading_drift"]] == [60.0, 600.0]
    for one in made["heading_drift"]:
        time, by = one["after_s"], one["by"]
        assert set(by) == {
            "angle_random_walk", "bias_instability", "rate_random_walk", "initial_bias",
        }  # fmt: skip
        assert by["angle_random_walk"] * DEGREE == pytest.approx(N * math.sqrt(time), rel=0.01)
        # K of the analysis put together by hand is 1e-11 rad/s/sqrt(s); B has a bound alone.
        rest = time * math.sqrt(N**2 / 300.0 + 1e-22 * 300.0 / 3.0)
        assert by["initial_bias"] * DEGREE == pytest.approx(rest, rel=0.01)
        walked = 1e-11 * math.sqrt(time**3 / 3.0)
        assert by["rate_random_walk"] * DEGREE == pytest.approx(walked, rel=0.01)
        assert by["bias_instability"] == 0.0
        assert one["sigma_deg"] == pytest.approx(math.hypot(*by.values()))
        assert one["low_deg"] <= one["sigma_deg"] <= one["high_deg"]
        assert one["highest_deg"] > one["sigma_deg"]


def test_priors_are_printed_and_taken(capsys, tmp_path):
    path = document(tmp_path, gyros=("x",))
    made = found(capsys, path, "--after", "60s")
    assert made["priors"]["azimuth_deg"] == pytest.approx(2.0)
    assert any("heading after 60 s is only the prior" in note for note in made["notes"])
    words = ["--azimuth", "0.36arcsec", "--tilt", "0.25deg"]
    made = found(capsys, path, "--after", "60s", *words)
    assert made["priors"]["azimuth_deg"] == pytest.approx(1e-4)
    assert made["priors"]["tilt_deg"] == pytest.approx(0.25)
    assert main(["align", str(path), "--after", "60s", *words]) == 0
    shown = capsys.readouterr().out
    # B's is far below what N makes in a minute.
    assert "with the worst upper bound" not in shown
    assert "upper bound only)" not in shown
    coefficients = json.loads(path.read_text(encoding="utf-8"))["coefficients"]
    coefficients["bias_instability"] |= {"value": 1e-2, "high": 1e-2}
    changed(path, coefficients=coefficients)
    assert main(["align", str(path), "--after", "60s", *words]) == 0
    shown = capsys.readouterr().out
    assert "priors, 1 σ: azimuth 1.00 × 10⁻⁴°, tilt 0.250°, bias from 600 s at rest" in shown
    assert "with the worst upper bound" in shown
    assert "95 % (B has an upper bound only), by N" in shown
    (drifting,) = found(capsys, path, "--after", "60s")["heading_drift"]
    assert drifting["highest_deg"] <= drifting["high_deg"] < 1.1 * drifting["highest_deg"]
    raised = found(capsys, path, "--after", "60s", "--tilt", "2deg")
    # Both with the misalignment, which rules here.
    for name, key in (("attitude", "deg"), ("position_unaided", "m")):
        (one,) = raised[name]
        assert one[f"highest_{key}"] >= one[f"sigma_{key}"]
    assert main(["align", str(path), "--after", "60s", "--tilt", "2deg"]) == 0
    shown = capsys.readouterr().out
    (highest,) = re.findall(r"worst upper bound: heading drift (\S+) × 10⁻⁴°", shown)
    assert float(highest) * 1e-4 == pytest.approx(
        raised["heading_drift"][0]["highest_deg"], rel=0.01
    )
    # g t^2/2 times the tilt, of north and east.
    position = made["position_unaided"][0]["by"]["misalignment"]
    assert position == pytest.approx(9.80665 * 1800.0 * 0.25 * DEGREE * math.sqrt(2.0), rel=0.01)


def test_a_markov_rate_of_the_analysis_counts_and_is_named(capsys, tmp_path):
    path = document(tmp_path, gyros=("x",))
    without = found(capsys, path, "--after", "10min")["heading_drift"][0]
    rate = {"deviation": {"value": 1.0, "unit": "deg/h"}, "correlation_time_s": {"value": 30.0}}
    flicker = {"value": 1e-6, "unit": "deg/h"}
    changed(path, slow_noise={"bias_instability": flicker, "markov": rate})
    made = found(capsys, path, "--after", "10min")
    notes = found(capsys, path, "--latitude", "32")["notes"]
    assert any("Markov rate counts for the gyrocompass; the filter leaves" in one for one in notes)
    (one,) = made["heading_drift"]
    # 2 D^2 T t of the run, twice for a rest as long.
    wanted = 1.0 / 3600.0 * math.sqrt(4.0 * 30.0 * 600.0)
    assert one["by"]["markov_rate"] == pytest.approx(wanted, rel=0.1)
    assert one["sigma_deg"] == pytest.approx(math.hypot(*one["by"].values()))
    assert one["highest_deg"] > one["sigma_deg"] > 10.0 * without["sigma_deg"]
    assert any(
        note.startswith("Bias instability of all axes is the most") for note in made["notes"]
    )


def test_a_filter_that_finds_no_azimuth_says_so_and_one_that_does_says_nothing(capsys, tmp_path):
    path = document(tmp_path, gyros=("x",))
    said = "the filter's azimuth is only the prior"
    good = found(capsys, path, "--latitude", "32")
    # The bound of B, 2e-11 rad/s, over the north rate: B sqrt(2 ln 2/pi) / sqrt(2).
    floor = 2e-11 * math.sqrt(math.log(2.0) / math.pi) / (7.292115e-5 * math.cos(32.0 * DEGREE))
    assert good["gyrocompass"]["floor_arcmin"] == 0.0
    assert good["gyrocompass"]["highest_floor_arcmin"] == pytest.approx(60.0 * floor / DEGREE)
    assert main(["align", str(path), "--latitude", "32"]) == 0
    assert "with the worst upper bound  " in capsys.readouterr().out
    assert not any(said in note for note in good["notes"])
    assert good["gyrocompass"]["azimuth_arcmin"][-1] > 0.0
    document_of = json.loads(path.read_text(encoding="utf-8"))
    loud = {**document_of["angle_random_walk"], "value": 60.0, "low": 54.0, "high": 66.0}
    changed(path, angle_random_walk=loud)
    made = found(capsys, path, "--latitude", "32")
    # Gyros of 60 deg/sqrt(h) see no Earth rate, and turn azimuth by N sqrt(t).
    drifted = 60.0 * math.hypot(2.0, 60.0 * math.sqrt(600.0 / 3600.0))
    assert made["filter"]["azimuth_arcmin"][-1] == pytest.approx(drifted, rel=0.01)
    assert any(f"{said} of 2.00° and the drift of the gyros" in note for note in made["notes"])
    changed(path, angle_random_walk={**loud, "value": 0.5, "low": 0.45, "high": 0.55})
    made = found(capsys, path, "--latitude", "32")
    assert 108.0 < made["filter"]["azimuth_arcmin"][-1] < 120.0
    assert any(f"{said} of 2.00°: these" in note for note in made["notes"])


def test_what_a_filter_leaves_out_does_not_look_measured(capsys, tmp_path):
    path = document(tmp_path, gyros=("x",))
    coefficients = json.loads(path.read_text(encoding="utf-8"))["coefficients"]
    for status, marked in (("estimated", False), ("upper bound", True)):
        walk = {**coefficients["rate_random_walk"], "status": status, "value": 1.0, "high": 1.0}
        changed(path, coefficients={**coefficients, "rate_random_walk": {**walk, "low": 0.0}})
        assert main(["align", str(path), "--latitude", "32"]) == 0
        shown = capsys.readouterr().out
        (line,) = re.findall(r"drift's process noise K².*", shown)
        assert line.endswith("rad²/s³ (not estimated, at most 6.53 × 10⁻¹⁵)") is marked
        assert re.search(r"a priori drift +0 °/h \(B is not estimated\)\n", shown)


@pytest.mark.parametrize(("walk", "observable"), [(1.0, True), (30.0, False)])
def test_an_error_of_more_than_half_a_turn_is_no_heading(walk, observable, capsys, tmp_path):
    path = document(tmp_path, gyros=("x",))
    stated = json.loads(path.read_text(encoding="utf-8"))["angle_random_walk"]
    changed(path, angle_random_walk={**stated, "value": walk, "low": walk, "high": walk})
    made = found(capsys, path, "--latitude", "32")
    # N over the root of ten minutes and the north rate.
    north = 7.292115e-5 * math.cos(32.0 * DEGREE)
    azimuth = walk * DEGREE / 60.0 / math.sqrt(600.0) / north / DEGREE
    assert made["gyrocompass"]["azimuth_arcmin"][-1] == pytest.approx(60.0 * azimuth, rel=0.01)
    assert (azimuth > 180.0) != observable
    notes = [note for note in made["notes"] if "heading is not observable" in note]
    assert len(notes) == (not observable)
    assert main(["align", str(path), "--latitude", "32"]) == 0
    assert ("by a gyrocompass in that time: its error of" in capsys.readouterr().out) != observable
    said = str(sagnac.align(path, latitude=0.5))
    assert ("not observable by a gyrocompass" in said) != observable


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--after", "60s,zero"], "'zero'; give a time above zero"),
        (["--latitude", "50", "--time", "1e9s"], "give 1 to 604800, a week"),
        (["--azimuth", "2"], "2deg"),
        (["--tilt", "0deg"], "2deg"),
        (["--bias", "-1"], "zero or more"),
        (["--bias", "3deg"], "such as 3deg/h"),
        (["--bias", "deg/h"], "such as 3deg/h"),
        (["--table-rate", "40"], "--table-rate needs --latitude"),
    ],
)
def test_wrong_usage_is_one_line(words, said, capsys, tmp_path):
    assert main(["align", str(document(tmp_path)), *words]) == 2
    assert said in one_line(capsys)


@pytest.mark.parametrize("typed", ["3", "3deg/h", "3 °/h", "1.4544410433e-5rad/s"])
def test_a_bias_is_in_its_unit_or_in_degrees_an_hour(typed, capsys, tmp_path):
    made = found(capsys, document(tmp_path), "--bias", typed)
    assert made["priors"]["bias_deg_per_h"] == pytest.approx(3.0)


def test_the_folder_of_a_report_stands_for_its_analysis(capsys, tmp_path):
    path = document(tmp_path, gyros=("x",))
    assert found(capsys, tmp_path) == found(capsys, path)
    (tmp_path / "none").mkdir()
    assert main(["align", str(tmp_path / "none")]) == 1
    assert "none: holds no analysis.json; give the folder" in one_line(capsys)


def test_what_is_foreseen_is_said_in_a_few_words(tmp_path):
    said = str(sagnac.align(document(tmp_path, gyros=("x",)), after=[60.0, 600.0], latitude=0.5))
    assert re.fullmatch(
        r"<Foresight, 1 sigma: after 60 s heading drift \S+ deg, attitude \S+ deg, position \S+ m; "
        r"after 600 s heading drift .*; azimuth found to \S+ deg by a gyrocompass>",
        said,
    )


def test_a_picture_goes_beside_the_document(capsys, tmp_path):
    path = document(tmp_path, gyros=("x",))
    words = ["align", str(path), "--after", "60s,10min", "-o", str(tmp_path / "out")]
    assert main(words) == 0
    assert (tmp_path / "out" / "drift.png").stat().st_size > 10_000
    assert "heading_drift" in (tmp_path / "out" / "alignment.json").read_text(encoding="utf-8")
    assert main(words) == 0  # the same run may write over it
    capsys.readouterr()
