"""Commands that a signal ends at any instant leave the old result whole, or the new one."""

import contextlib
import ctypes
import os
import random
import signal
import subprocess
import threading
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from sagnac.cli import main
from sagnac.cli.app import stopped_by_signals
from sagnac.cli.output import prefixed
from tests.processes import PYTHON, SAGNAC, environment, ran, started

# Each command, the signal that ends it part of the way through a run, and the option by which the
# old result differs, so that a mixture of old and new shows. tests/fuzz draws many instants.
ENDED = {
    "analyze": (signal.SIGKILL, ["--confidence", "0.9"]),
    "simulate": (signal.SIGTERM, ["--seed", "2"]),
}
Ending = Callable[[list[str], float, int], tuple[int, subprocess.Popen]]
"""Words, the seconds of a whole run and the bytes of its largest file -> the signal and the run."""


def ended(words: list[str], folder: Path, number: int, seconds: float) -> subprocess.Popen:
    """A run that gets a signal after some time, unless it was over before."""
    with (folder / "said.txt").open("wb") as said:
        running = started(*words, stdout=said, stderr=said)
        try:
            running.wait(timeout=seconds)
        except subprocess.TimeoutExpired:
            running.send_signal(number)
            running.wait(timeout=120.0)
    return running


def commands(still: Path, folder: Path) -> dict[str, tuple[list[str], Path]]:
    """What is run, and what it makes."""
    report, made = folder / "report", folder / "made.npz"
    one = ("--gyros", "x", "--method", "none")
    return {
        "analyze": (["analyze", str(still), *one, "-o", str(report)], report),
        "simulate": (["simulate", "-o", str(made), "--duration", "60", "--table-rate", "0"], made),
    }


def files_of(result: Path) -> dict[str, bytes]:
    """A result as it stands: a folder with its files, or a file with those beside it."""
    folder = result if result.is_dir() else result.parent
    found = result.rglob("*") if result.is_dir() else result.parent.glob(f"{result.stem}*")
    return {
        entry.relative_to(folder).as_posix(): entry.read_bytes()
        for entry in sorted(found)
        if entry.is_file()
    }


def is_new(after: dict[str, bytes], whole: dict[str, bytes], before: dict[str, bytes]) -> bool:
    """Whether a result is the new one: of a report, whose documents hold times, every figure."""
    if after.keys() != whole.keys():
        return False
    if "analysis.json" in after:
        return all(
            after[name] != before[name] or whole[name] == before[name] for name in after
        ) and all(after[name] == whole[name] for name in after if name.endswith((".png", ".csv")))
    return after == whole


def old_or_new(words: list[str], other: list[str], result: Path, endings: list[Ending]) -> str:
    """Assert that a command that ends in some ways leaves the old result whole, or the new one.

    A kill between two names leaves a file without those beside it, never with those of another.
    """
    (folder := result.parent).mkdir()
    assert main([*words, *other]) == 0
    before, began = files_of(result), time.monotonic()
    assert ended([*SAGNAC, *words], folder.parent, signal.SIGKILL, 240.0).returncode == 0
    lasts, whole = time.monotonic() - began, files_of(result)
    assert whole.keys() == before.keys()
    assert whole != before
    left = {result.name: (before.get(result.name), whole.get(result.name))}
    old = 0
    for ending in endings:
        for name, content in before.items():
            ((result if result.is_dir() else folder) / name).write_bytes(content)
        number, run = ending([*SAGNAC, *words], lasts, max(map(len, whole.values())))
        after = files_of(result)
        is_alone = after and all(one in left.get(name, ()) for name, one in after.items())
        is_whole = after == before or is_new(after, whole, before)
        assert is_whole or (number == signal.SIGKILL and is_alone)
        if number != signal.SIGKILL:
            # A signal that comes before the command has begun ends the interpreter.
            assert run.returncode in (0, 128 + number, -number)
            assert not list(folder.glob(f".*.{run.pid}.*.part"))
        old += after == before
    # The next run removes what a killed one left.
    assert main(words) == 0
    assert not list(folder.glob(".*.part"))
    return f"{old} of {len(endings)} left the old one"


@pytest.mark.usefixtures("blank_figures")
@pytest.mark.parametrize("name", ENDED)
def test_a_result_is_old_or_new_whatever_ends_the_run(name, still, tmp_path):
    words, result = commands(still, tmp_path / "results")[name]
    number, other = ENDED[name]
    part = random.Random(name).uniform(0.3, 1.0)
    old_or_new(
        words,
        other,
        result,
        [lambda words, lasts, _: (number, ended(words, tmp_path, number, part * lasts))],
    )


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_signal_in_the_callback_of_a_library_ends_the_run_as_well(number, capsys):
    @ctypes.CFUNCTYPE(None)
    def called_back() -> None:
        signal.raise_signal(number)

    ends = pytest.raises(KeyboardInterrupt, match=str(int(number)))
    with ends, stopped_by_signals():
        called_back()
        time.sleep(10.0)
    assert capsys.readouterr().err == ""


def test_a_signal_that_comes_anew_before_its_time_ends_the_run_as_well(monkeypatch, capsys):
    starts = []

    class Early(threading.Timer):
        def start(self) -> None:
            starts.append(self)
            super().start()
            if len(starts) == 1:
                self.cancel()
                signal.raise_signal(signal.SIGTERM)

    @ctypes.CFUNCTYPE(None)
    def called_back() -> None:
        signal.raise_signal(signal.SIGTERM)

    monkeypatch.setattr(threading, "Timer", Early)
    ends = pytest.raises(KeyboardInterrupt, match=str(int(signal.SIGTERM)))
    with ends, stopped_by_signals():
        called_back()
        time.sleep(10.0)
    assert len(starts) == 2
    assert capsys.readouterr().err == ""


def test_a_stop_of_which_a_library_makes_another_error_is_one():
    def imported() -> None:
        raise ImportError("a part of a library failed to import")

    def imported_as_a_stop_comes() -> None:
        with contextlib.suppress(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
        imported()

    with pytest.raises(KeyboardInterrupt), stopped_by_signals():
        imported_as_a_stop_comes()
    with pytest.raises(ImportError), stopped_by_signals():
        imported()


def test_a_stop_that_a_library_swallows_ends_the_command_at_its_next_stage():
    told = []

    def swallowed(number):
        with contextlib.suppress(KeyboardInterrupt):
            os.kill(os.getpid(), number)

    def command(number, stages):
        with stopped_by_signals():
            show = prefixed(lambda stage, fraction: told.append(stage), "")
            show("read", 0.0)
            swallowed(number)
            for stage in stages:
                show(stage, 0.0)

    for number in (signal.SIGTERM, signal.SIGINT):
        for stages in (("lines", "spectrum"), ()):
            with pytest.raises(KeyboardInterrupt, match=str(int(number))):
                command(number, stages)
    assert told == ["read"] * 4
    # Nothing is left of it for the next one.
    with stopped_by_signals():
        prefixed(lambda stage, fraction: told.append(stage), "")("check", 0.0)
    assert told[-1] == "check"


PROBE = """
import signal
import sys

from sagnac.cli import app


def probe():
    exec("signal.raise_signal(signal.SIGTERM)")


app.app.command(probe)
sys.exit(app.main(["probe"]))
"""


def test_a_signal_inside_of_exec_gives_its_own_status_to_a_module_that_runs(tmp_path):
    (tmp_path / "probe.py").write_text(PROBE)
    done = ran(PYTHON, "-m", "probe", env=environment(tmp_path))
    assert (done.returncode, done.stderr) == (143, "sagnac: stopped by SIGTERM\n")


EARLY = """
import signal
import sys


class Interrupt:
    def find_spec(name, *_):
        if name == "cyclopts":
            exec("signal.raise_signal(signal.SIGINT)")


sys.meta_path.insert(0, Interrupt)
from sagnac.cli import main

sys.exit(main(["--version"]))
"""


def test_an_interrupt_among_the_imports_is_one_line(tmp_path):
    (tmp_path / "early.py").write_text(EARLY)
    done = ran(PYTHON, "-m", "early", env=environment(tmp_path))
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "sagnac: interrupted\n")
