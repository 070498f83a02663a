"""``sagnac analyze``: a recording in, a report out."""

import json
from pathlib import Path

import pytest

from sagnac.cli import main
from tests.cli.examples import STATED, one_line, one_line_among, strict


def test_no_folder_is_made_for_data_that_fail(bare, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["analyze", str(bare), "-o", str(tmp_path / "out")]) == 1
    one_line(capsys)
    assert list(tmp_path.iterdir()) == []


def test_analyze_writes_all_and_says_the_answer_first(recording, capsys, tmp_path):
    folder = tmp_path / "deep" / "out"
    assert main(["analyze", str(recording), "--gyros", "x,z", "-o", str(folder)]) == 0
    shown = capsys.readouterr().out
    assert shown.startswith("ARW of gyros x − z, per gyro (N̄)  ")
    for part in (
        "°/√h",
        "Rests on: likelihood fit of the spectrum",
        "rad/√s",
        "quantization",
        "seconds: read",
        "report.html",
    ):
        assert part in shown
    rows = shown.replace("\u0304", "").splitlines()
    assert len(rows) <= 40
    assert max(map(len, rows)) <= 80 + len(str(folder))
    assert sorted(item.name for item in folder.iterdir()) == [
        "analysis.json", "lines.csv", "parts.png", "report.html", "settings.toml",
        "spectrum.png", "stability.csv", "stability.png",
    ]  # fmt: skip
    made = strict((folder / "analysis.json").read_text())
    assert made["input"]["path"] == str(recording)
    assert made["input"]["sha256"] in (folder / "report.html").read_text()
    assert made["seconds"]["report"] > 0.0


def test_json_alone_is_on_standard_output_and_nothing_is_written(
    recording, capsys, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    assert main(["analyze", str(recording), "--gyros", "x,z", "--json"]) == 0
    made = strict(capsys.readouterr().out)
    assert made["schema"] == "sagnac.analysis/1"
    assert made["input"]["gyros"] == ["x", "z"]
    assert made["input"]["samples"] == 30_000
    assert made["input"]["sample_rate_hz"] == 100.0
    assert made["input"]["duration_s"] == 300.0
    assert made["input"]["table_rate_deg_per_s"] == pytest.approx(40.0, rel=1e-3)
    assert made["settings"] == {"method": "fos", "interval_s": 1.0, "confidence": 0.95}
    assert list(tmp_path.iterdir()) == []
    truth = json.loads(Path(f"{recording}.truth.json").read_text())
    put_in = truth["pairs"]["x-z"]["arw_deg_per_sqrt_h"]
    answer = made["angle_random_walk"]
    # 1.7 times the half width of a 95 % interval is that of a 99.9 % interval.
    assert abs(answer["value"] - put_in) < 1.7 * (answer["high"] - answer["low"]) / 2.0


def test_an_interval_between_two_samples_is_said_to_be_rounded(bare, capsys):
    assert main(["analyze", str(bare), *STATED, "--interval", "14ms", "--json"]) == 0
    made = strict(capsys.readouterr().out)
    assert made["curve"]["tau_s"][0] == 0.01
    assert any("0.014 s is no whole number" in note for note in made["notes"])


def test_options_reach_the_analysis(recording, capsys):
    arguments = [
        "analyze", str(recording), "--gyros", "z", "--method", "none", "--interval", "500ms",
        "--confidence", "0.9", "--slice", "10:250", "--table", "none", "--json",
    ]  # fmt: skip
    assert main(arguments) == 0
    made = strict(capsys.readouterr().out)
    assert made["settings"] == {"method": "none", "interval_s": 0.5, "confidence": 0.9}
    assert made["input"]["slice_s"] == [10.0, 250.0]
    assert made["input"]["duration_s"] == pytest.approx(240.0, abs=0.02)
    assert made["input"]["gyros"] == ["z"]
    assert made["input"]["table_rate_deg_per_s"] is None
    assert made["angle_random_walk"]["confidence"] == 0.9
    assert made["lines"] == []


@pytest.mark.usefixtures("blank_figures")
def test_several_files_get_a_folder_each_and_one_failure_spares_the_rest(
    recording, bare, capsys, tmp_path
):
    arguments = ["analyze", str(recording), str(bare), "--gyros", "x", "--method", "none"]
    assert main([*arguments, "-o", str(tmp_path)]) == 1
    assert str(bare) in one_line_among(capsys.readouterr().err)
    assert [item.name for item in tmp_path.iterdir()] == ["run"]
    assert (tmp_path / "run" / "report.html").exists()


@pytest.mark.usefixtures("blank_figures")
def test_the_settings_of_a_report_repeat_the_run(bare, capsys, tmp_path):
    typed = ["--method", "none", "--slice", "4:39", "--confidence", "0.9", "--gyros", "x"]
    first, again = tmp_path / "first", tmp_path / "again"
    assert main(["analyze", str(bare), *STATED, *typed, "-o", str(first)]) == 0
    settings = str(first / "settings.toml")
    assert main(["analyze", str(bare), "--settings", settings, "-o", str(again)]) == 0
    one, other = (
        strict((folder / "analysis.json").read_text(encoding="utf-8")) for folder in (first, again)
    )
    for key in ("input", "settings", "angle_random_walk", "curve"):
        assert one[key] == other[key]
    page = (first / "report.html").read_text(encoding="utf-8")
    assert "slice = &#34;4:39&#34;" in page
    capsys.readouterr()


@pytest.mark.parametrize(
    ("option", "content"),
    [
        ("--settings", "speed = 3  # 'speed' is not known"),
        ("--settings", "= 3  # is no TOML"),
        ("--heading", "colour = 3  # 'colour' is not known"),
    ],
)
def test_a_file_of_options_that_is_none_is_wrong_usage(option, content, bare, capsys, tmp_path):
    path = tmp_path / "other.toml"
    path.write_text(content)
    assert main(["analyze", str(bare), *STATED, option, str(path)]) == 2
    assert content.partition("# ")[2] in one_line(capsys)
