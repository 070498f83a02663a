"""``sagnac check``: the quality of the data."""

import re
import shlex
import shutil
from pathlib import Path

import numpy as np
import pytest
import scipy.io

from sagnac.cli import main
from tests.cli.examples import STATED, one_line_among, strict
from tests.formats.examples import imu


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


@pytest.fixture
def own_folder(tmp_path, monkeypatch) -> Path:
    """A folder that the commands run in."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize(
    ("name", "printed"),
    [("-o.csv", "./-o.csv"), ("a-o.csv", "a-o.csv"), ("b/-o.csv", "b/-o.csv")],
)
def test_a_name_that_begins_with_a_dash_is_printed_as_it_can_be_typed(
    name, printed, bare, own_folder, capsys
):
    (own_folder / "b").mkdir()
    shutil.copy(bare, own_folder / name)
    assert main(["check", f"./{name}", *STATED]) == 0
    words = shlex.split(capsys.readouterr().out.rpartition("read with: ")[2])
    assert words[:3] == ["sagnac", "avar", printed]
    assert main(["check", *words[2:]]) == 0


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


def test_a_finding_of_the_reader_is_not_said_again_below(tmp_path, capsys):
    path, noise = tmp_path / "run.csv", np.random.default_rng(1).normal(size=4000)
    rows = "".join(f"{n / 100.0:.2f},{value:.6f}\n" for n, value in enumerate(noise))
    path.write_text("t,x\n" + rows)
    stated = [str(path), "--kind", "rate", "--unit", "deg/h", "--time", "t:ms"]
    assert main(["check", *stated]) == 0
    assert capsys.readouterr().out.count("the unit ms looks wrong") == 1
    assert main(["check", *stated, "--json"]) == 0
    made = strict(capsys.readouterr().out)
    for key in ("findings", "notes"):
        assert sum("the unit ms looks wrong" in str(one) for one in made[key]) == 1


def test_settings_of_an_earlier_run_count(bare, tmp_path, capsys):
    settings = tmp_path / "settings.toml"
    settings.write_text('kind = "rate"\nunit = "deg/h"\nrate = 100.0\n')
    for command in ("check", "lines", "compare"):
        words = [command, str(bare), "--settings", str(settings), "--json"]
        assert main([*words, "--method", "none"]) == 0, capsys.readouterr().err


@pytest.mark.parametrize(
    ("header", "options"),
    [
        ("gyro_x[deg/s],acc_x,acc_y", ["--columns", "x=gyro_x", "--unit", "deg/s"]),
        ("x,force_x[mg],ay", ["--unit", "deg/s"]),
        ("x[deg/s],ax[m/s^2],ay[g]", []),
    ],
)
def test_check_prints_how_accelerometers_are_read_as_well(tmp_path, capsys, header, options):
    path = tmp_path / "run.csv"
    noise = np.random.default_rng(1).normal(size=(400, 3))
    rows = "".join(",".join(f"{value:.6f}" for value in row) + "\n" for row in noise)
    path.write_text(f"{header}\n{rows}", encoding="utf-8")
    assert main(["check", str(path), "--kind", "rate", "--rate", "100", *options]) == 0
    (command,) = (
        line.partition(": ")[2]
        for line in capsys.readouterr().out.splitlines()
        if line.startswith("with its accelerometers: ")
    )
    words = shlex.split(command.replace("=UNIT", "=m/s^2"))
    assert words[:3] == ["sagnac", "avar", str(path)]
    assert main(["check", *words[2:]]) == 0
    shown = capsys.readouterr().out
    assert "accelerometer ax" in shown
    assert "accelerometer ay" in shown
    assert "with its accelerometers" not in shown


def test_a_log_of_psins_has_accelerometers_to_ask_for(tmp_path, capsys):
    path, _ = imu(tmp_path / "run.imu")
    assert main(["check", str(path)]) == 0
    said = capsys.readouterr().out.splitlines()[-1]
    assert said == f"with its accelerometers: sagnac avar {path} --accelerometers ax,ay,az"


def rows(header, cut=0):
    """A text of noise under a header, its end cut off by some characters."""
    noise = np.random.default_rng(1).normal(size=(400, header.count(",") + 1))
    lines = "".join(",".join(f"{value:.6f}" for value in row) + "\n" for row in noise)
    text = f"{header}\n{lines}"
    return text[: len(text) - cut]


def test_a_command_is_offered_only_if_it_says_more(tmp_path, capsys):
    """That of a file that is cut off or lacks nothing would fail as the one before it did."""
    path = tmp_path / "run.csv"
    words = ["check", str(path), "--rate", "100"]
    path.write_text(rows("x[deg/s],y[deg/s],z[deg/s]"))
    assert main(words) == 1
    shown = capsys.readouterr()
    assert "This reads it:\n\n    sagnac avar" in shown.out
    assert "--kind rate" in shown.out
    path.write_text(rows("x[deg/s],y[deg/s],z[deg/s]", cut=15))
    assert main(words) == 1
    shown = capsys.readouterr()
    assert "Even with what is missing stated it cannot be read" in shown.out
    assert "the last line, 401, is cut off" in shown.out
    assert main([*words, "--kind", "rate"]) == 1
    shown = capsys.readouterr()
    assert shown.out == ""
    assert "the last line, 401, is cut off" in one_line_among(shown.err)


@pytest.mark.parametrize(
    ("stated", "offered"),
    [
        (["--kind", "rate", "--time", "t"], "--kind rate --time t:s"),
        (["--rate", "100", "--kind", "x=rate"], "--kind x=rate,y=rate,z=rate --rate 100"),
        (["--rate", "100", "--kind", "rate", "--columns", "x=q"], "--columns 'x=x[deg/s],y="),
    ],
    ids=["replaced", "joined by name", "columns"],
)
def test_what_is_offered_counts_for_what_was_stated(tmp_path, capsys, stated, offered):
    path = tmp_path / "run.csv"
    head, *lines = rows("x[deg/s],y[deg/s],z[deg/s]").splitlines()
    timed = "".join(f"{one},{0.01 * number:.2f}\n" for number, one in enumerate(lines))
    path.write_text(f"{head},t\n{timed}")
    assert main(["check", str(path), *stated]) == 1
    shown = capsys.readouterr().out
    assert "This reads it:" in shown
    assert offered in shown


def test_a_file_without_a_column_of_numbers_is_told_of(tmp_path, capsys):
    path = tmp_path / "run.npz"
    np.savez(path, name=np.array(["a", "b"]))
    assert main(["check", str(path), "--rate", "100"]) == 1
    assert "the file has no numeric column" in one_line_among(capsys.readouterr().err)


def test_arrays_of_a_mat_file_are_offered_in_their_order(tmp_path, capsys):
    path = tmp_path / "run.mat"
    rng = np.random.default_rng(2)
    gyro, force = rng.normal(size=(400, 3)), rng.normal(size=(400, 3))
    scipy.io.savemat(path, {"gyro": gyro, "acc": force})
    stated = ["--kind", "rate", "--unit", "deg/s", "--rate", "100"]
    assert main(["check", str(path), *stated]) == 1
    (line,) = (one for one in capsys.readouterr().out.splitlines() if "sagnac avar" in one)
    words = ["check", *shlex.split(line)[2:]]
    assert main(words) == 0
    (line,) = (one for one in capsys.readouterr().out.splitlines() if "with its acc" in one)
    # Without the unit of the accelerometers a command is offered that asks for it.
    words = ["check", *shlex.split(line.partition(": ")[2])[2:]]
    place = words.index("--unit") + 1
    words[place] = "deg/s"
    assert main(words) == 1
    shown = capsys.readouterr()
    assert "--unit gyros=deg/s,accelerometers=g" in one_line_among(shown.err)
    (line,) = (one for one in shown.out.splitlines() if "sagnac avar" in one)
    words = ["check", *shlex.split(line.replace("=UNIT", "=m/s^2"))[2:]]
    assert main(words) == 0
    assert "accelerometer az" in capsys.readouterr().out
