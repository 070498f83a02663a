"""Names of columns and files that a terminal, a spreadsheet or TeX would obey."""

import csv
import json
from pathlib import Path

import numpy as np
import pytest

from sagnac.cli import main
from sagnac.core.errors import one_line
from sagnac.formats import write
from sagnac.recording.model import Recording
from sagnac.report.tables import csv_text

ESCAPES = "x\x1b[2J\x1b]0;owned\x07\x9b31m\u202e"
NAME = one_line(ESCAPES)
TEX = r"$\input{x}$ $ \frac"


@pytest.fixture
def npz(tmp_path, monkeypatch):
    """A file with a column of a name."""
    monkeypatch.chdir(tmp_path)
    rate = np.random.default_rng(4).normal(size=6000)

    def make(column: str, file: str = "run.npz") -> Path:
        np.savez("made.npz", **{column: rate, "kind": "rate", "unit": "deg/h", "sample_rate": 50.0})
        return Path("made.npz").rename(file)

    return make


@pytest.mark.usefixtures("in_this_process", "blank_figures")
@pytest.mark.parametrize("file", ["run.npz", "run\x1b[2J\n\x9b.npz"])
def test_no_command_moves_the_cursor(npz, file, capsys):
    path = npz(ESCAPES, file)
    for words in (
        ["check", str(path)],
        ["check", str(path), "--gyros", ESCAPES],
        ["avar", str(path), "--columns", f"x={ESCAPES}", "-o", "out\x1b[2J"],
        ["convert", str(path), "copy\x1b.csv", "--gyros", NAME],
        ["analyze", str(path), "--gyros", NAME, "--method", "none", "--json"],
        ["lines", f"{path}x"],
        ["compare", str(path), "--method", "none"],
        ["campaign", str(path), "--method", "none", "-o", "many"],
    ):
        main(words)
        said = capsys.readouterr()
        odd = set("\x1b\x07\x9b\u202e") & set(said.out + said.err)
        assert not odd, words
        if "--json" in words:
            assert json.loads(said.out)["channel"] == NAME


@pytest.mark.usefixtures("in_this_process", "blank_figures")
@pytest.mark.parametrize("file", ["[7] run.npz", '["run"].npz', "{7}.npz", "run [7].npz"])
def test_a_name_is_no_list_in_json(npz, file, capsys):
    made = npz("x").read_bytes()
    for path in (file, "other.npz"):
        Path(path).write_bytes(made)
    # Alone and beside another.
    for files, folders in (([file], "."), ([file, "other.npz"], "*")):
        assert main(["analyze", *files, "--method", "none", "-o", f"out{len(files)}"]) == 0
        assert len([*Path(f"out{len(files)}").glob(f"{folders}/analysis.json")]) == len(files)
    assert main(["campaign", file, "--method", "none", "-o", "many", "--workers", "1"]) == 0
    report = Path("out1/analysis.json").rename(f"{Path(file).stem}.json")
    assert main(["export", str(report), "-o", "imu.yaml"]) == 0
    assert main(["analyze", "[no] run.npz"]) == 1
    assert "[no] run.npz: no such file" in capsys.readouterr().err


@pytest.mark.usefixtures("in_this_process")
def test_a_name_is_drawn_as_it_is(npz, tmp_path):
    path = npz(TEX)
    stated = ["--gyros", TEX, "--method", "none"]
    assert main(["analyze", str(path), *stated, "-o", "out"]) == 0
    assert main(["campaign", str(path), *stated, "-o", "many"]) == 0
    assert TEX.split("{", maxsplit=1)[0] in (tmp_path / "many" / "campaign.csv").read_text()


@pytest.mark.usefixtures("in_this_process")
def test_a_label_is_drawn_as_it_is(npz, tmp_path):
    """All the work was done, and then the page could not be drawn."""
    npz("x", r"$\input{x}$_day1.npz")
    words = ["--pattern", r"(?P<unit>.*)_day(?P<day>\d)", "--method", "none", "-o", "many"]
    assert main(["campaign", r"$\input{x}$_day1.npz", *words]) == 0
    assert (tmp_path / "many" / "index.html").exists()


def test_no_cell_is_a_formula(tmp_path):
    hostile = ["=1+1", "+cmd|' /C calc'!A0", "-2+3", "@SUM(1)", '=HYPERLINK("a")\n=2', "a\t=1"]
    numbers = ["-1.5e-3", "+2", "-inf", "7"]
    (tmp_path / "cells.csv").write_text(csv_text(["=x"], [[one] for one in (*hostile, *numbers)]))
    with (tmp_path / "cells.csv").open(newline="") as stream:
        cells = [row[0] for row in csv.reader(stream)]
    assert [one[0] for one in cells[: 1 + len(hostile)]] == ["'"] * len(hostile) + ["a"]
    assert cells[-len(numbers) :] == numbers


@pytest.mark.parametrize("name", ["+x", "-x", "@x", "=x"])
def test_a_header_is_no_formula(name, tmp_path):
    recording = Recording.from_arrays(
        **{name: np.arange(9.0)}, kind="rate", unit="deg/h", sample_rate=10.0
    )
    with pytest.raises(ValueError, match="cannot stand in a file"):
        write(recording, tmp_path / "run.csv")
