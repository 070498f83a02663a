"""What is around a run: closed streams, narrow terminals, signals, odd names, stray files."""

import os
import signal
import subprocess
import time
from pathlib import Path

import numpy as np
import pytest

import sagnac
from sagnac.cli import main
from sagnac.report.page import write_report
from sagnac.report.tables import folder_name
from tests.cli.examples import STATED, one_line_among
from tests.handmade import analysis as handmade
from tests.processes import SAGNAC, environment, ran, started


def test_help_ends_in_a_column_of_one_letter():
    done = ran(*SAGNAC, "--help", env=environment(COLUMNS="1"))
    assert done.returncode == 0
    assert "Usage" in done.stdout


def test_closed_streams_are_nothing_to_stumble_over(bare):
    closed = ("sh", "-c", 'exec "$@" 1>&- 2>&-', "sh")
    assert ran(*closed, *SAGNAC, "check", str(bare), *STATED).returncode == 0


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no full device here")
@pytest.mark.parametrize(("asked", "unbuffered"), [("--help", ""), ("--version", "1")])
def test_output_that_has_no_room_is_one_line(asked, unbuffered):
    where = {"env": environment(PYTHONUNBUFFERED=unbuffered), "capture_output": False}
    with Path("/dev/full").open("w") as full:
        done = ran(*SAGNAC, asked, stdout=full, stderr=subprocess.PIPE, **where)
    assert done.returncode == 1
    assert "standard output: No space left" in one_line_among(done.stderr)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no full device here")
def test_errors_that_have_no_room_leave_the_status():
    with Path("/dev/full").open("w") as full:
        done = ran(*SAGNAC, "nope", stdout=subprocess.PIPE, stderr=full, capture_output=False)
    assert (done.returncode, done.stdout) == (2, "")


@pytest.mark.usefixtures("blank_figures")
def test_a_channel_named_like_a_path_stays_in_its_folder(tmp_path):
    name = "../../pwn"
    assert "/" not in folder_name(name)
    inside = tmp_path / "a" / "b"
    inside.mkdir(parents=True)
    write_report(handmade(), inside / folder_name(name))
    assert [entry.name for entry in tmp_path.iterdir()] == ["a"]
    assert [entry.name for entry in (tmp_path / "a").iterdir()] == ["b"]
    for odd in ("..", ".", "/etc", "a\0b", "x" * 5000):
        safe = folder_name(odd)
        assert safe not in ("", ".", "..")
        assert len(os.fsencode(safe)) < 256
        assert not set(safe) & {"/", "\0"}


@pytest.mark.usefixtures("blank_figures")
def test_a_report_is_replaced_whole_or_stays(tmp_path, monkeypatch):
    write_report(handmade(), tmp_path / "report")
    before = {entry.name: entry.read_bytes() for entry in (tmp_path / "report").iterdir()}

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("sagnac.report.document.to_json", full)
    with pytest.raises(sagnac.RecordingError, match="report: cannot be written"):
        write_report(handmade(), tmp_path / "report")
    after = {entry.name: entry.read_bytes() for entry in (tmp_path / "report").iterdir()}
    assert after == before
    assert [entry.name for entry in tmp_path.iterdir()] == ["report"]


def test_a_file_that_cannot_be_written_is_named_as_it_would_be_called(tmp_path, bare):
    # Half a kilobyte is a full disk.
    limited = ("sh", "-c", 'ulimit -f 1; exec "$@"', "sh")
    words = ("convert", str(bare), "out.csv", *STATED)
    done = ran(*limited, *SAGNAC, *words, cwd=tmp_path, env=environment(NUMBA_DISABLE_JIT="1"))
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1].startswith("sagnac: out.csv: cannot be written")
    assert [entry.name for entry in tmp_path.iterdir()] == []


def test_a_stray_matplotlibrc_and_a_backend_that_is_none_are_not_read(tmp_path, bare):
    words = ["analyze", str(bare), *STATED, "--method", "none", "-o"]
    (tmp_path / "matplotlibrc").write_bytes(b"backend: nonsense : x\n\xff\xfe")
    odd = environment(MPLBACKEND="no such : window")
    done = ran(*SAGNAC, *words, "out", cwd=tmp_path, env=odd)
    assert done.returncode == 0, done.stderr
    assert "backend" not in done.stderr
    assert main([*words, str(tmp_path / "sound")]) == 0
    made, sound = (
        {entry.name: entry.read_bytes() for entry in (tmp_path / name).iterdir()}
        for name in ("out", "sound")
    )
    assert made.keys() == sound.keys()
    assert made["stability.png"] == sound["stability.png"]


def writing(target: Path, *before: str) -> subprocess.Popen:
    """A run that has begun to write a text, which takes it a second or two."""
    words = ("simulate", "-o", str(target), "--duration", "2min")
    running = started(*before, *SAGNAC, *words)
    while not list(target.parent.glob(".*.part")) and running.poll() is None:
        time.sleep(0.01)
    return running


def test_a_signal_leaves_nothing_half_written(tmp_path):
    # Tests that run under nohup ignore SIGHUP, and so would what they start.
    ours = signal.signal(signal.SIGHUP, signal.SIG_DFL)
    with writing(tmp_path / "run.csv") as running:
        signal.signal(signal.SIGHUP, ours)
        running.send_signal(signal.SIGHUP)
        _, said = running.communicate(timeout=60.0)
    assert running.returncode == 128 + signal.SIGHUP
    assert "Traceback" not in said
    assert list(tmp_path.iterdir()) == []


def test_a_signal_that_is_ignored_from_the_start_ends_nothing(tmp_path):
    target = tmp_path / "run.csv"
    with writing(target, "sh", "-c", 'trap "" HUP; exec "$@"', "sh") as running:
        assert running.poll() is None
        running.send_signal(signal.SIGHUP)
        assert running.wait(timeout=240.0) == 0
    assert target.exists()


def test_memory_is_a_limit_on_what_a_file_declares(tmp_path, capsys):
    np.savez(tmp_path / "run.npz", x=np.random.default_rng(1).normal(size=4000))
    stated = ["--kind", "rate", "--unit", "deg/h", "--rate", "100"]
    assert main(["check", str(tmp_path / "run.npz"), *stated, "--memory", "1KiB"]) == 1
    line = one_line_among(capsys.readouterr().err)
    assert "--memory" in line
    assert "run.npz" in line
    assert main(["check", str(tmp_path / "run.npz"), *stated, "--memory", "1GiB"]) == 0
    assert main(["check", str(tmp_path / "run.npz"), *stated, "--memory", "much"]) == 2
