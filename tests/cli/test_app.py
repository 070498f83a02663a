"""The command as a whole: help, usage, exit status, one line for each error, the process."""

import io
import re
import subprocess
import sys

import pytest

import sagnac
from sagnac.cli import main
from sagnac.cli.app import app, options_of
from tests.cli.examples import STATED, one_line
from tests.processes import PYTHON, SAGNAC, environment, ran, started

READING = ("analyze", "avar", "lines", "compare", "check")
SHARED = (
    "--gyros", "--kind", "--unit", "--scale", "--rate", "--time", "--table", "--columns",
    "--slice", "--method", "--interval", "--confidence", "--json", "--counter-bits",
    "--null-pulse", "--debug",
)  # fmt: skip
COMMANDS = (
    "demo", "analyze", "avar", "lines", "compare", "check", "simulate", "convert", "reproduce",
)  # fmt: skip


@pytest.mark.parametrize("command", [name for name in app if not name.startswith("-")])
def test_every_option_is_in_the_help_of_its_command(command, capsys):
    assert main([command, "--help"]) == 0
    shown = capsys.readouterr().out
    assert [option for option in options_of(command) if f"{option} " not in shown] == []
    # Whatever reads a file takes what states it.
    shared = SHARED if command in READING else SHARED[:9] if command == "convert" else ()
    assert [option for option in shared if not re.search(rf"{option}\b", shown)] == []


def test_help_names_every_command(capsys):
    assert main(["--help"]) == 0
    shown = capsys.readouterr().out
    assert [name for name in COMMANDS if name not in shown] == []


def test_version(capsys):
    assert main(["--version"]) == 0
    assert capsys.readouterr().out.strip() == sagnac.__version__


@pytest.mark.parametrize(
    "arguments",
    [
        ["nonsense"],
        ["analyze"],
        ["analyze", "a.csv", "--nonsense"],
        ["analyze", "a.csv", "--kind", "x=speed"],
        ["analyze", "a.csv", "--unit", "furlong"],
        ["analyze", "a.csv", "--scale", "big"],
        ["analyze", "a.csv", "--rate", "fast"],
        ["analyze", "a.csv", "--rate", "-1"],
        ["analyze", "a.csv", "--method", "best"],
        ["analyze", "a.csv", "--gyros", "x,"],
        ["analyze", "a.csv", "--columns", "x"],
        ["analyze", "a.csv", "--counter-bits", "7"],
        ["avar", "a.csv", "--estimator", "oadev,"],
        ["avar", "a.csv", "--gaps", "fill"],
        ["lines", "a.csv", "--slice", "30:10"],
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
    assert main(arguments) == 2
    line = one_line(capsys)
    assert len(line) < 400
    assert list(tmp_path.iterdir()) == []


def test_several_files_where_one_is_read_name_the_command_for_many(capsys, tmp_path):
    paths = [tmp_path / f"U{number}.csv" for number in range(3)]
    for path in paths:
        path.write_text("x\n1\n2\n")
    for command in ("check", "avar", "plan"):
        assert main([command, *map(str, paths)]) == 2
        line = one_line(capsys)
        assert "one recording is read at a time" in line
        assert "sagnac campaign" in line


def test_a_further_name_that_is_too_long_for_a_file_is_one_line(capsys):
    # Whether there is such a file is asked, and the system refuses the question.
    assert main(["check", "run.csv", "x" * 5000]) == 2
    assert "Unused Tokens" in one_line(capsys)


def test_missing_file(capsys, tmp_path):
    path = tmp_path / "none.csv"
    for command in READING:
        assert main([command, str(path)]) == 1
        assert str(path) in one_line(capsys)


def test_what_is_not_stated_is_asked_for(bare, capsys):
    assert main(["analyze", str(bare), "--unit", "deg/h", "--rate", "100"]) == 1
    line = one_line(capsys)
    assert str(bare) in line
    assert "--kind" in line


def test_a_file_where_the_folder_should_be(recording, capsys, tmp_path):
    target = tmp_path / "out"
    target.write_text("mine")
    for command in ("analyze", "avar", "compare"):
        assert main([command, str(recording), "-o", str(target)]) == 1
        assert str(target) in one_line(capsys)
    assert target.read_text() == "mine"


def test_an_internal_error_is_one_line_unless_debugging(bare, capsys, monkeypatch):
    def broken(*_arguments, **_options):
        raise KeyError("surprise")

    monkeypatch.setattr("sagnac.formats.read", broken)
    assert main(["check", str(bare), *STATED]) == 1
    assert "--debug" in one_line(capsys)
    with pytest.raises(KeyError):
        main(["check", str(bare), *STATED, "--debug"])


def test_help_needs_none_of_the_heavy_libraries():
    code = (
        "import sys; from sagnac.cli import main; main(['--help']); main(['nonsense']); "
        "sys.exit(any(name in sys.modules for name in "
        "('numpy', 'scipy', 'numba', 'matplotlib', 'pyarrow', 'finufft')))"
    )
    assert ran(PYTHON, "-c", code).returncode == 0


def test_garbage_is_not_looked_for_as_the_process_ends():
    # What is asked to be called first is called last.
    code = (
        "import atexit, gc; atexit.register(lambda: print(gc.get_freeze_count() > 10_000)); "
        "from sagnac.cli import main; main(['--version'])"
    )
    assert ran(PYTHON, "-c", code).stdout.split()[-1] == "True"


def test_exit_status_of_the_process(tmp_path):
    assert ran(*SAGNAC, "--version").returncode == 0
    assert ran(*SAGNAC, "nonsense").returncode == 2
    missing = ran(*SAGNAC, "check", str(tmp_path / "none.csv"))
    assert missing.returncode == 1
    assert missing.stderr.count("\n") == 1


@pytest.mark.parametrize("left", ["stdout", "stderr"])
def test_a_reader_that_leaves_takes_neither_verdict_nor_report_with_it(bare, tmp_path, left):
    words = ["avar", str(bare), *STATED, "--method", "none", "--spec", "1e-9deg/sqrt(h)"]
    buffered = environment(PYTHONUNBUFFERED="")
    process = started(*SAGNAC, *words, "-o", str(tmp_path / "out"), env=buffered)
    getattr(process, left).close()
    setattr(process, left, None)
    process.communicate(timeout=240)
    assert process.returncode == 3
    assert list(tmp_path.glob("out/**/report.html"))


def test_help_whose_reader_leaves_is_no_error():
    with started(*SAGNAC, "--help", stderr=subprocess.DEVNULL) as process:
        process.stdout.close()
        assert process.wait(timeout=120) == 0


def test_a_terminal_without_the_signs_gets_substitutes(bare, monkeypatch):
    shown = io.BytesIO()
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(shown, encoding="ascii"))
    assert main(["avar", str(bare), *STATED]) == 0
    assert b"ARW of gyro x" in shown.getvalue()


def test_a_recording_in_several_files_is_told_how_they_are_put_together(capsys):
    assert main(["avar", "x.mseed", "y.mseed", "z.mseed"]) == 2
    assert "cat x.mseed y.mseed z.mseed > xyz.mseed" in one_line(capsys)
    assert main(["avar", "x.csv", "y.csv"]) == 2
    assert "cat " not in one_line(capsys)
