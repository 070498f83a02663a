"""The command line: exit status, one line for each error, JSON, files written."""

import dataclasses
import json
import os
import re
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import sagnac
from sagnac import formats
from sagnac.analysis.settings import Method
from sagnac.cli import app as cli
from sagnac.rig.config import PRESETS

READING = ("analyze", "avar", "lines", "compare", "check")
SHARED = (
    "--gyros", "--kind", "--unit", "--scale", "--rate", "--time", "--table", "--columns",
    "--slice", "--method", "--interval", "--confidence", "--json", "--counter-bits",
    "--null-pulse", "--debug",
)  # fmt: skip
COMMANDS = ("demo", "analyze", "avar", "lines", "compare", "check", "simulate", "convert")


@pytest.fixture(scope="module")
def recording(tmp_path_factory) -> Path:
    """Five minutes of the quiet rig at 100 Hz: states everything itself."""
    folder = tmp_path_factory.mktemp("recording")
    config = folder / "config.toml"
    config.write_text('preset = "quiet"\nsample_rate_hz = 100.0\n')
    path = folder / "run.parquet"
    assert cli.main(["simulate", str(config), "-o", str(path), "--duration", "5min"]) == 0
    return path


@pytest.fixture(scope="module")
def still(recording) -> Path:
    """A minute of the same rig at rest."""
    path = recording.with_name("still.parquet")
    arguments = ["simulate", str(recording.with_name("config.toml")), "-o", str(path)]
    assert cli.main([*arguments, "--duration", "60", "--table-rate", "0"]) == 0
    return path


@pytest.fixture(scope="module")
def bare(tmp_path_factory) -> Path:
    """White rate noise of one gyro, in a CSV that says nothing about it."""
    path = tmp_path_factory.mktemp("bare") / "bare.csv"
    rate = np.random.default_rng(5).normal(size=4000)
    path.write_text("x\n" + "\n".join(f"{value:.6f}" for value in rate) + "\n")
    return path


STATED = ("--kind", "rate", "--unit", "deg/h", "--rate", "100")


def strict(text: str):
    def refuse(name):
        raise AssertionError(f"{name} is no JSON")

    return json.loads(text, parse_constant=refuse)


def one_line(capsys) -> str:
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("\n") == 1
    assert captured.err.startswith("sagnac: ")
    assert "Traceback" not in captured.err
    return captured.err


# ---- usage ---------------------------------------------------------------------------


@pytest.mark.parametrize("command", READING)
def test_every_shared_option_is_in_the_help_of_every_reading_command(command, capsys):
    assert cli.main([command, "--help"]) == 0
    shown = capsys.readouterr().out
    assert [option for option in SHARED if not re.search(rf"{option}\b", shown)] == []


def test_convert_takes_what_states_a_file(capsys):
    assert cli.main(["convert", "--help"]) == 0
    shown = capsys.readouterr().out
    assert [option for option in SHARED[:9] if not re.search(rf"{option}\b", shown)] == []


def test_help_names_every_command(capsys):
    assert cli.main(["--help"]) == 0
    shown = capsys.readouterr().out
    assert [name for name in COMMANDS if name not in shown] == []


def test_the_methods_offered_are_those_there_are():
    assert set(cli._METHODS) == set(Method.__args__)


def test_version(capsys):
    assert cli.main(["--version"]) == 0
    assert capsys.readouterr().out.strip() == sagnac.__version__


@pytest.mark.parametrize(
    "arguments",
    [
        ["nonsense"],
        ["analyze"],
        ["analyze", "a.csv", "--nonsense"],
        ["analyze", "a.csv", "--kind", "speed"],
        ["analyze", "a.csv", "--kind", "x=speed"],
        ["analyze", "a.csv", "--unit", "furlong"],
        ["analyze", "a.csv", "--scale", "big"],
        ["analyze", "a.csv", "--rate", "fast"],
        ["analyze", "a.csv", "--rate", "-1"],
        ["analyze", "a.csv", "--method", "best"],
        ["analyze", "a.csv", "--gyros", "x,"],
        ["analyze", "a.csv", "--columns", "x"],
        ["analyze", "a.csv", "--counter-bits", "12"],
        ["avar", "a.csv", "--confidence", "95"],
        ["avar", "a.csv", "--estimator", "adv"],
        ["avar", "a.csv", "--estimator", "oadev,"],
        ["avar", "a.csv", "--gaps", "fill"],
        ["lines", "a.csv", "--slice", "630"],
        ["lines", "a.csv", "--slice", "30:10"],
        ["lines", "a.csv", "--slice", "a:b"],
        ["lines", "a.csv", "--interval", ""],
        ["lines", "a.csv", "--columns", ""],
        ["compare", "a.csv", "--interval", "soon"],
        ["compare", "a.csv", "--interval", "0s"],
        ["check"],
        ["convert", "a.csv"],
        ["simulate"],
        ["simulate", "-o", "a.parquet", "--preset", "loud"],
        ["simulate", "-o", "a.parquet", "--duration", "long"],
        ["simulate", "a.toml", "-o", "a.parquet", "--preset", "quiet"],
        ["demo", "--seed", "none"],
    ],
    ids=" ".join,
)
def test_wrong_usage_is_2_and_one_line(arguments, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert cli.main(arguments) == 2
    line = one_line(capsys)
    assert len(line) < 400
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("text", "seconds"),
    [("1", 1.0), ("1s", 1.0), ("0.5 s", 0.5), ("100ms", 0.1), ("2h", 7200.0), ("15min", 900.0)],
)
def test_times_may_carry_a_unit(text, seconds):
    assert cli._seconds("--interval", text) == pytest.approx(seconds)


# ---- errors in the data --------------------------------------------------------------


def test_missing_file(capsys, tmp_path):
    path = tmp_path / "none.csv"
    for command in READING:
        assert cli.main([command, str(path)]) == 1
        assert str(path) in one_line(capsys)


def test_what_is_not_stated_is_asked_for(bare, capsys):
    assert cli.main(["analyze", str(bare), "--unit", "deg/h", "--rate", "100"]) == 1
    line = one_line(capsys)
    assert str(bare) in line
    assert "--kind" in line


def test_no_folder_is_made_for_data_that_fail(bare, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert cli.main(["analyze", str(bare), "-o", str(tmp_path / "out")]) == 1
    one_line(capsys)
    assert list(tmp_path.iterdir()) == []


def test_a_file_where_the_folder_should_be(recording, capsys, tmp_path):
    target = tmp_path / "out"
    target.write_text("mine")
    for command in ("analyze", "avar", "compare"):
        assert cli.main([command, str(recording), "-o", str(target)]) == 1
        assert str(target) in one_line(capsys)
    assert target.read_text() == "mine"


def test_a_toml_that_is_not_of_the_rig_is_an_error_in_the_data(capsys, tmp_path):
    config = tmp_path / "rig.toml"
    config.write_text("duration_hours = 2\n")
    assert cli.main(["simulate", str(config), "-o", str(tmp_path / "a.parquet")]) == 1
    line = one_line(capsys)
    assert str(config) in line
    assert "duration_hours" in line
    assert [item.name for item in tmp_path.iterdir()] == ["rig.toml"]


def test_fris_needs_a_table_and_names_the_file(bare, capsys):
    assert cli.main(["analyze", str(bare), *STATED, "--method", "fris", "--json"]) == 1
    line = one_line(capsys)
    assert str(bare) in line
    assert "--table" in line


def test_an_internal_error_is_one_line_unless_debugging(bare, capsys, monkeypatch):
    def broken(*_arguments, **_options):
        raise KeyError("surprise")

    monkeypatch.setattr("sagnac.formats.read", broken)
    assert cli.main(["check", str(bare), *STATED]) == 1
    assert "--debug" in one_line(capsys)
    with pytest.raises(KeyError):
        cli.main(["check", str(bare), *STATED, "--debug"])


@pytest.mark.parametrize(
    ("error", "status"),
    [
        (KeyboardInterrupt(), 130),
        (MemoryError(), 1),
        (PermissionError(13, "Permission denied", "a.csv"), 1),
        (ValueError("confidence is 3;\ngive less"), 2),
        (np.linalg.LinAlgError("singular"), 1),
    ],
)
def test_what_else_may_happen_is_one_line_too(error, status, bare, capsys, monkeypatch):
    def broken(*_arguments, **_options):
        raise error

    monkeypatch.setattr("sagnac.formats.read", broken)
    assert cli.main(["check", str(bare), *STATED]) == status
    one_line(capsys)


# ---- what the commands give ----------------------------------------------------------


def test_analyze_writes_all_and_says_the_answer_first(recording, capsys, tmp_path):
    folder = tmp_path / "deep" / "out"
    assert cli.main(["analyze", str(recording), "--gyros", "x,z", "-o", str(folder)]) == 0
    shown = capsys.readouterr().out
    assert shown.startswith("ARW of gyros x − z, per gyro (N̄)  ")
    for part in ("°/√h", "likelihood", "rad/√s", "quantization", "seconds: read", "report.html"):
        assert part in shown
    assert sorted(item.name for item in folder.iterdir()) == [
        "analysis.json", "lines.csv", "report.html", "spectrum.png", "stability.csv",
        "stability.png",
    ]  # fmt: skip
    made = strict((folder / "analysis.json").read_text())
    assert made["input"]["path"] == str(recording)
    assert made["input"]["sha256"] in (folder / "report.html").read_text()
    assert made["seconds"]["report"] > 0.0


def test_json_alone_is_on_standard_output_and_nothing_is_written(
    recording, capsys, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    assert cli.main(["analyze", str(recording), "--gyros", "x,z", "--json"]) == 0
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
    assert cli.main(["analyze", str(bare), *STATED, "--interval", "14ms", "--json"]) == 0
    made = strict(capsys.readouterr().out)
    assert made["curve"]["tau_s"][0] == 0.01
    assert any("0.014 s is no whole number" in note for note in made["notes"])


def test_options_reach_the_analysis(recording, capsys):
    arguments = [
        "analyze", str(recording), "--gyros", "z", "--method", "none", "--interval", "500ms",
        "--confidence", "0.9", "--slice", "10:250", "--table", "none", "--json",
    ]  # fmt: skip
    assert cli.main(arguments) == 0
    made = strict(capsys.readouterr().out)
    assert made["settings"] == {"method": "none", "interval_s": 0.5, "confidence": 0.9}
    assert made["input"]["slice_s"] == [10.0, 250.0]
    assert made["input"]["duration_s"] == pytest.approx(240.0, abs=0.02)
    assert made["input"]["gyros"] == ["z"]
    assert made["input"]["table_rate_deg_per_s"] is None
    assert made["angle_random_walk"]["confidence"] == 0.9
    assert made["lines"] == []


def test_several_files_get_a_folder_each_and_one_failure_spares_the_rest(
    recording, bare, capsys, tmp_path
):
    arguments = ["analyze", str(recording), str(bare), "--gyros", "x", "--method", "none"]
    assert cli.main([*arguments, "-o", str(tmp_path)]) == 1
    assert str(bare) in one_line_among(capsys.readouterr().err)
    assert [item.name for item in tmp_path.iterdir()] == ["run"]
    assert (tmp_path / "run" / "report.html").exists()


def one_line_among(text: str) -> str:
    """The one line of `text` that is an error; the others are progress."""
    lines = [line for line in text.splitlines() if line.startswith("sagnac: ")]
    assert len(lines) == 1
    return lines[0]


def test_files_of_one_name_do_not_share_a_folder():
    folders = cli._folders([Path("a/run.csv"), Path("b/run.csv")], Path("out"), cli.Options())
    assert len(set(folders)) == 2
    assert cli._folders([Path("a/run.csv")], None, cli.Options()) == [Path("run-report")]
    assert cli._folders([Path("a.csv")], None, cli.Options(as_json=True)) == [None]


def test_avar_of_white_noise(bare, capsys):
    assert cli.main(["avar", str(bare), *STATED, "--json"]) == 0
    made = strict(capsys.readouterr().out)
    # One deg/h at 100 Hz is N = 1/sqrt(100) deg/h/sqrt(Hz), a sixtieth of that in deg/sqrt(h).
    answer = made["angle_random_walk"]
    assert answer["value"] == pytest.approx(0.1 / 60.0, rel=0.05)
    assert answer["low"] < 0.1 / 60.0 < answer["high"]
    assert made["curve"]["tau_s"][0] == pytest.approx(0.01)
    assert made["curve"]["deviation_deg_per_h"][0] == pytest.approx(1.0, rel=0.05)
    assert made["settings"]["method"] == "none"


def test_avar_speaks_of_each_gyro(still, capsys, tmp_path):
    arguments = ["avar", str(still), "--gyros", "x,y"]
    assert cli.main([*arguments, "-o", str(tmp_path)]) == 0
    shown = capsys.readouterr().out
    assert "ARW of gyro x  " in shown
    assert "ARW of gyro y  " in shown
    assert "oadev °/h" in shown
    assert sorted(item.name for item in tmp_path.iterdir()) == ["x", "y"]
    assert cli.main([*arguments, "--json"]) == 0
    made = strict(capsys.readouterr().out)
    assert [item["channel"] for item in made["analyses"]] == ["x", "y"]


def test_avar_offers_the_family_and_the_spectrum(bare, capsys, tmp_path):
    arguments = ["avar", str(bare), *STATED, "--estimator", "mdev,tdev", "--estimator", "haar"]
    assert cli.main([*arguments, "--json"]) == 0
    made = strict(capsys.readouterr().out)
    assert [curve["estimator"] for curve in made["curves"]] == ["mdev", "tdev", "haar"]
    assert made["curve"]["estimator"] == "oadev"  # what the coefficients rest on
    mdev, tdev, haar = made["curves"]
    tau = np.array(mdev["tau_s"])
    # tdev is tau mdev / sqrt(3), and an hour has as many seconds as a degree.
    assert np.array(tdev["deviation"]) == pytest.approx(
        np.array(mdev["deviation"]) * tau / np.sqrt(3.0)
    )
    oadev = dict(zip(made["curve"]["tau_s"], made["curve"]["deviation_deg_per_h"], strict=True))
    for at, deviation in list(zip(haar["tau_s"], haar["deviation"], strict=True))[:3]:
        assert deviation == pytest.approx(oadev[at] / np.sqrt(2.0))
    # White noise of 1 deg/h at 100 Hz: 2/100 (deg/h)^2/Hz, one-sided.
    density, frequency = (np.array(made["spectrum"][key]) for key in ("density", "frequency_hz"))
    assert np.average(density, weights=np.gradient(frequency)) == pytest.approx(0.02, rel=0.05)
    assert cli.main([*arguments, "-o", str(tmp_path)]) == 0
    shown = capsys.readouterr().out
    assert all(heading in shown for heading in ("mdev °/h", "tdev ″", "haar °/h", "PSD"))
    assert "oadev °/h" not in shown
    assert {"family.csv", "psd.csv"} <= {item.name for item in (tmp_path / "x").iterdir()}


@pytest.fixture(scope="module")
def gapped(bare) -> Path:
    """The white noise with time stamps, 500 samples not there and three NaN."""
    rate = np.loadtxt(bare, skiprows=1)
    rate[[100, 101, 3500]] = np.nan
    rows = [f"{place / 100.0:.2f},{rate[place]:.6f}" for place in range(rate.size)]
    path = bare.with_name("gapped.csv")
    path.write_text("t,x\n" + "\n".join(rows[:600] + rows[1100:]) + "\n")
    return path


GAPPED = ("--kind", "rate", "--unit", "deg/h", "--time", "t:s")


def test_avar_refuses_gaps_unless_told_to_omit_them(gapped, capsys):
    assert cli.main(["avar", str(gapped), *GAPPED]) == 1
    assert "1.000 s" in one_line(capsys)
    assert cli.main(["avar", str(gapped), *GAPPED, "--gaps", "omit", "--json"]) == 0
    made = strict(capsys.readouterr().out)
    assert made["input"]["samples"] == 4000
    notes = " ".join(made["notes"])
    assert "1 gap, 500 samples missing" in notes
    assert "503 of 4000 samples are missing" in notes
    assert "longest stretch without a gap, 11 to 35 s" in notes
    assert made["angle_random_walk"]["low"] < 0.1 / 60.0 < made["angle_random_walk"]["high"]
    assert "of 11 to 35 s" in made["angle_random_walk"]["source"]


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (("--estimator", "totdev"), "needs a whole record"),
        (("--method", "fos"), "lines cannot be removed across gaps"),
    ],
)
def test_what_gaps_do_not_allow_is_one_line(more, words, gapped, capsys):
    assert cli.main(["avar", str(gapped), *GAPPED, "--gaps", "omit", *more]) == 1
    said = one_line(capsys)
    assert words in said
    assert str(gapped) in said


def test_avar_of_gaps_too_close_for_any_fit_still_has_a_curve(bare, capsys, tmp_path):
    rate = np.loadtxt(bare, skiprows=1)
    rate[::13] = np.nan
    path = tmp_path / "sieve.csv"
    path.write_text("x\n" + "\n".join(f"{value:.6f}" for value in rate) + "\n")
    folder = tmp_path / "out"
    assert cli.main(["avar", str(path), *STATED, "--gaps", "omit", "-o", str(folder)]) == 0
    shown = capsys.readouterr().out
    assert "not observable" in shown
    assert "oadev °/h" in shown
    assert "No periodic component" not in shown
    made = strict((folder / "x" / "analysis.json").read_text(encoding="utf-8"))
    assert made["curve"]["deviation_deg_per_h"][0] == pytest.approx(1.0, rel=0.05)
    assert made["estimates"] == {}


def test_avar_lists_lines_that_it_does_not_remove(capsys, tmp_path):
    path = tmp_path / "tone.csv"
    time_s = np.arange(6000) / 100.0
    noise = np.random.default_rng(8).normal(size=time_s.size)
    rate = noise + 0.5 * np.cos(2 * np.pi * 23.4 * time_s)
    path.write_text("x\n" + "\n".join(f"{value:.6f}" for value in rate) + "\n")
    assert cli.main(["avar", str(path), *STATED, "--json"]) == 0
    made = strict(capsys.readouterr().out)
    assert [line["frequency_hz"] for line in made["lines"]] == [pytest.approx(23.4, abs=2e-3)]
    assert cli.main(["avar", str(path), *STATED]) == 0
    shown = capsys.readouterr().out
    assert "With the lines below removed" in shown
    assert re.search(r"time +23\.(4|39)", shown)


def test_lines_is_a_table_of_what_is_in_the_analysis(recording, capsys):
    arguments = ["lines", str(recording), "--gyros", "x,z"]
    assert cli.main(arguments) == 0
    shown = capsys.readouterr().out
    assert cli.main([*arguments, "--json"]) == 0
    made = strict(capsys.readouterr().out)
    assert made["channel"] == "x-z"
    rows = [row for row in shown.splitlines() if row.startswith(("time ", "table angle "))]
    assert len(rows) == len(made["lines"])


def test_compare_shows_methods_and_why_one_is_not_possible(bare, capsys, tmp_path):
    arguments = ["compare", str(bare), *STATED, "--interval", "0.1"]
    assert cli.main([*arguments, "-o", str(tmp_path)]) == 0
    shown = capsys.readouterr().out
    rows = {line.split()[0] for line in shown.splitlines() if line}
    assert {"none", "fos-paper", "fos", "fris:"} <= rows
    assert {item.name for item in tmp_path.iterdir()} == {
        "comparison.html", "comparison.json", "comparison.png",
    }  # fmt: skip
    assert cli.main([*arguments, "--json", "--method", "none"]) == 0
    made = strict(capsys.readouterr().out)
    assert list(made["methods"]) == ["none"]
    assert cli.main([*arguments, "--method", "fris"]) == 1
    assert str(bare) in one_line(capsys)


def test_check_is_0_on_sound_data_and_1_on_an_error(recording, bare, capsys, tmp_path):
    assert cli.main(["check", str(recording)]) == 0
    assert "senses" in capsys.readouterr().out
    spoilt = tmp_path / "spoilt.csv"
    lines = bare.read_text().splitlines()
    lines[1000] = "nan"
    spoilt.write_text("\n".join(lines) + "\n")
    assert cli.main(["check", str(spoilt), *STATED]) == 1
    captured = capsys.readouterr()
    assert re.search(r"error +x +1 sample", captured.out)
    line = one_line_among(captured.err)
    assert str(spoilt) in line
    assert "--slice" in line
    assert cli.main(["check", str(spoilt), *STATED, "--json"]) == 1
    made = strict(capsys.readouterr().out)
    assert made["schema"] == "sagnac.check/1"
    assert made["findings"][0]["level"] == "error"


def test_convert_states_what_was_stated(bare, capsys, tmp_path):
    target = tmp_path / "same.parquet"
    assert cli.main(["convert", str(bare), str(target), *STATED]) == 0
    assert "wrote" in capsys.readouterr().out
    again = formats.read(target)
    assert again.sample_rate == 100.0
    assert again.gyros[0].kind == "rate"
    once = np.loadtxt(bare, skiprows=1) * np.pi / 180.0 / 3600.0
    np.testing.assert_allclose(again.gyros[0].values, once, rtol=1e-12)


def test_convert_does_not_write_over_what_it_reads(bare, capsys):
    before = bare.read_bytes()
    assert cli.main(["convert", str(bare), str(bare.parent / "." / bare.name), *STATED]) == 2
    assert "IN itself" in one_line(capsys)
    assert bare.read_bytes() == before


def test_simulate_takes_what_was_typed(capsys, tmp_path):
    path = tmp_path / "run.npz"
    arguments = ["simulate", "-o", str(path), "--preset", "quiet", "--seed", "7"]
    assert cli.main([*arguments, "--table-rate", "-20", "--duration", "12s"]) == 0
    assert "wrote" in capsys.readouterr().out
    truth = json.loads((tmp_path / "run.npz.truth.json").read_text())
    assert truth["seed"] == 7
    assert truth["samples"] == 6000
    assert truth["table_rate_deg_per_s"] == -20.0


def test_demo_prints_the_answer_and_the_truth(capsys, tmp_path, monkeypatch):
    asked = []

    def light(name):
        asked.append(name)
        return dataclasses.replace(PRESETS["quiet"], sample_rate_hz=100.0)

    monkeypatch.setattr("sagnac.rig.config.preset", light)
    monkeypatch.setattr(cli, "_QUICK_S", 300.0)
    folder = tmp_path / "demo"
    assert cli.main(["demo", "--quick", "--seed", "3", "-o", str(folder)]) == 0
    assert asked == ["paper"]
    shown = capsys.readouterr().out
    assert shown.startswith("ARW of gyros x − z")
    assert "The truth put in: 2.5e-05 °/√h" in shown
    assert re.search(r"(holds|does not hold|does not show) it", shown)
    truth = json.loads((folder / "recording.parquet.truth.json").read_text())
    assert truth["seed"] == 3
    assert truth["samples"] == 30_000
    assert {"recording.parquet", "report.html", "analysis.json"} <= {
        item.name for item in folder.iterdir()
    }


# ---- as a process --------------------------------------------------------------------

PROCESS = (sys.executable, "-c", "import sys; from sagnac.cli import main; sys.exit(main())")


def run(*arguments: str, **options) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "PYTHONIOENCODING": "utf-8"}
    return subprocess.run(
        [*PROCESS, *arguments],
        capture_output=True,
        text=True,
        check=False,
        encoding="utf-8",
        env={**environment, **options.pop("env", {})},
        **options,
    )


def test_help_needs_none_of_the_heavy_libraries():
    code = (
        "import sys; from sagnac.cli import main; main(['--help']); main(['nonsense']); "
        "sys.exit(any(name in sys.modules for name in "
        "('numpy', 'scipy', 'numba', 'matplotlib', 'pyarrow', 'finufft')))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, check=False)
    assert done.returncode == 0


def test_exit_status_of_the_process(tmp_path):
    assert run("--version").returncode == 0
    assert run("nonsense").returncode == 2
    missing = run("check", str(tmp_path / "none.csv"))
    assert missing.returncode == 1
    assert missing.stderr.count("\n") == 1


def test_a_reader_that_leaves_is_no_error(bare):
    process = subprocess.Popen(
        [*PROCESS, "avar", str(bare), *STATED], stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    assert process.stdout is not None
    process.stdout.close()
    _, errors = process.communicate(timeout=120)
    assert process.returncode == 0
    assert b"Traceback" not in errors


def test_a_terminal_without_the_signs_gets_substitutes(bare):
    done = run("avar", str(bare), *STATED, env={"PYTHONIOENCODING": "ascii"})
    assert done.returncode == 0
    assert "ARW of gyro x" in done.stdout


def test_slow_stages_are_told_on_standard_error(capsys):
    tell = cli._stage_lines(sys.stderr)
    tell("read", 0.0)
    assert capsys.readouterr().err == ""
    time.sleep(cli._PATIENCE_S)
    tell("lines", 0.0)
    tell("lines", 0.5)
    tell("stability", 1.0)
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("\n") == 1
    assert captured.err.rstrip().endswith("lines")
