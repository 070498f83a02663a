"""``sagnac check``: the quality of the data."""

import re
import shlex

import numpy as np

from sagnac.cli import main
from tests.cli.examples import STATED, one_line_among, strict


def test_check_is_0_on_sound_data_and_1_on_an_error(recording, bare, capsys, tmp_path):
    assert main(["check", str(recording)]) == 0
    assert "senses" in capsys.readouterr().out
    spoilt = tmp_path / "spoilt.csv"
    lines = bare.read_text().splitlines()
    lines[1000] = "nan"
    spoilt.write_text("\n".join(lines) + "\n")
    assert main(["check", str(spoilt), *STATED]) == 1
    captured = capsys.readouterr()
    assert re.search(r"error +x +1 sample", captured.out)
    line = one_line_among(captured.err)
    assert str(spoilt) in line
    assert "--slice" in line
    assert main(["check", str(spoilt), *STATED, "--json"]) == 1
    made = strict(capsys.readouterr().out)
    assert made["schema"] == "sagnac.check/1"
    assert made["findings"][0]["level"] == "error"


def test_check_prints_the_command_that_reads_the_file(tmp_path, capsys):
    path = tmp_path / "my run.csv"
    noise = np.random.default_rng(1).normal(size=400)
    rows = "".join(f"{n * 10_000};{value:.6f}\n" for n, value in enumerate(noise))
    path.write_text("stamp;gyro x [°/s]\n" + rows.replace(".", ","), encoding="utf-8")
    assert main(["check", str(path)]) == 1
    captured = capsys.readouterr()
    one_line_among(captured.err)
    (command,) = (line for line in captured.out.splitlines() if "sagnac avar" in line)
    words = shlex.split(command)
    assert words[:3] == ["sagnac", "avar", str(path)]
    assert main(["check", *words[2:]]) == 0
    shown = capsys.readouterr().out
    assert "400 samples at 100 Hz" in shown
    assert shlex.split(shown.rpartition("read with: ")[2]) == words
