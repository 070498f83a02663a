"""``sagnac simulate``: a recording of the rig."""

import json

import pytest

import sagnac
from sagnac.cli import main
from tests.cli.examples import one_line
from tests.navigation.examples import document


def test_simulate_takes_what_was_typed(capsys, tmp_path):
    path = tmp_path / "run.npz"
    arguments = ["simulate", "-o", str(path), "--preset", "quiet", "--seed", "7"]
    assert main([*arguments, "--table-rate", "-20", "--duration", "12s"]) == 0
    assert "wrote" in capsys.readouterr().out
    truth = json.loads((tmp_path / "run.npz.truth.json").read_text())
    assert truth["seed"] == 7
    assert truth["samples"] == 6000
    assert truth["table_rate_deg_per_s"] == -20.0


def test_a_toml_that_is_not_of_the_rig_is_an_error_in_the_data(capsys, tmp_path):
    config = tmp_path / "rig.toml"
    config.write_text("duration_hours = 2\n")
    assert main(["simulate", str(config), "-o", str(tmp_path / "a.parquet")]) == 1
    line = one_line(capsys)
    assert str(config) in line
    assert "duration_hours" in line
    assert [item.name for item in tmp_path.iterdir()] == ["rig.toml"]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--seed=-1"], "--seed: seed is -1"),
        (["--seed", "99999999999"], "--seed: seed is 99999999999"),
        (["--duration", "1e12s"], "--duration: duration_s is 1000000000000.0"),
        (["--duration", "1e-9s"], "--duration: duration_s is 1e-09"),
        (["--table-rate", "nan"], "--table-rate: table.rate_deg_per_s is nan"),
        (["--table-rate=-1e9"], "--table-rate: table.rate_deg_per_s is -1000000000.0"),
    ],
)
def test_what_the_rig_cannot_do_is_wrong_usage(words, said, capsys, tmp_path):
    assert main(["simulate", "-o", str(tmp_path / "run.npz"), *words]) == 2
    line = one_line(capsys)
    assert said in line
    assert "it must lie from" in line
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("words", [["simulate", "-o", "run.npz"], ["demo"]])
def test_a_seed_that_is_no_whole_number_is_not_rounded(words, capsys):
    assert main([*words, "--seed", "1.5"]) == 2
    assert "--seed: '1.5'; give a whole number" in one_line(capsys)


def test_a_demo_with_a_wrong_seed_makes_nothing(capsys, tmp_path):
    assert main(["demo", "--seed=-1", "-o", str(tmp_path / "demo")]) == 2
    assert "--seed: seed is -1; it must lie from 0" in one_line(capsys)
    assert not list(tmp_path.iterdir())


def test_a_unit_like_its_analysis(capsys, tmp_path):
    path = document(tmp_path, gyros=("x",), table_rate=None)
    made = tmp_path / "again.parquet"
    # The folder of a report stands for its analysis.
    words = ["simulate", "--like", str(path.parent), "-o", str(made)]
    words += ["--duration", "600", "--kind", "rate"]
    assert main(words) == 0
    shown = capsys.readouterr().out
    assert "x: without bias instability, rate ramp, not estimated" in shown
    truth = json.loads((tmp_path / "again.parquet.truth.json").read_text(encoding="utf-8"))
    assert truth["gyros"]["y"]["arw_deg_per_sqrt_h"] == pytest.approx(2.5e-5)
    assert (truth["samples"], truth["sample_rate_hz"]) == (300, 0.5)
    assert sagnac.read(made).gyro("x").kind == "rate"
    # A TOML goes over it.
    toml = tmp_path / "rig.toml"
    toml.write_text("[gyro]\nlow_pass_hz = 0.1\n", encoding="utf-8")
    assert main(["simulate", str(toml), *words[1:], "--force"]) == 0
    truth = json.loads((tmp_path / "again.parquet.truth.json").read_text(encoding="utf-8"))
    assert truth["low_pass_hz"]["x"] == 0.1
    assert truth["gyros"]["y"]["arw_deg_per_sqrt_h"] == pytest.approx(2.5e-5)


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (["--duration", "600", "-o", "again.xyz"], "no format to write has this suffix"),
        (["--seed", "-1", "-o", "again.npz"], "--seed: seed is -1"),
        (["-o", "kept.npz"], "no such run made it"),
    ],
)
def test_a_refusal_stands_before_what_a_unit_like_its_analysis_leaves_out(
    more, said, capsys, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    path = document(tmp_path, gyros=("x",), table_rate=None)
    (tmp_path / "kept.npz").write_bytes(b"mine")
    assert main(["simulate", "--like", str(path), *more]) in (1, 2)
    shown = capsys.readouterr()
    assert said in shown.err
    assert not shown.out


@pytest.mark.parametrize(
    ("given", "status", "said"),
    [("--preset", 2, "--preset and --like exclude each other"), ("rig.toml", 1, "remove preset")],
)
def test_a_unit_like_its_analysis_starts_from_nothing_else(given, status, said, capsys, tmp_path):
    path = document(tmp_path, gyros=("x",), table_rate=None)
    words = ["--preset", "quiet"]
    if given == "rig.toml":
        (tmp_path / given).write_text('preset = "quiet"', encoding="utf-8")
        words = [str(tmp_path / given)]
    out = tmp_path / "again.npz"
    assert main(["simulate", *words, "--like", str(path), "-o", str(out)]) == status
    assert said in one_line(capsys)
    assert not out.exists()
