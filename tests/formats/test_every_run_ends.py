"""Commands on text that is right, wrong or cut off: every one ends.

A library that reads text with threads of its own aborts a process at its exit or lets it hang, now
and then. So each command is run again and again: a few times here, 200 times and beside busy
processes by ``make test-fuzz``.
"""

import os
import time
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from itertools import islice
from pathlib import Path

import numpy as np
import pytest

from tests.processes import PYTHON, SAGNAC, ran, started

STATED = ("--kind", "rate", "--unit", "deg/h", "--rate", "100")
LONGEST = 120.0  # s, of a run that takes two on a machine with nothing else to do
ROWS = 60_000


@contextmanager
def busy_processes(count: int) -> Iterator[None]:
    """Processes that do nothing but take the processor, and end with this one however it ends."""
    code = "import os, sys\nwhile os.getppid() == int(sys.argv[1]): pass"
    running = [started(PYTHON, "-c", code, str(os.getpid())) for _ in range(count)]
    try:
        yield
    finally:
        for one in running:
            one.kill()
            one.communicate()


def texts(folder: Path) -> dict[str, Path]:
    """Two blocks of text each: sound, with a word in it, with a row too long, cut off."""
    random = np.random.default_rng(8)
    rows = [f"{a:.9f},{b:.9f},{c:.9f}" for a, b, c in random.normal(size=(ROWS, 3))]
    wrong, longer = list(rows), list(rows)
    wrong[ROWS // 2] = "stop,1.0,2.0"
    longer[ROWS - 9] = "1.0,2.0,3.0,4.0"
    blanks = [row.replace(",", "  ") for row in wrong]
    made = {"right": rows, "wrong": wrong, "longer": longer, "blanks": blanks}
    paths = {name: folder / f"{name}.csv" for name in (*made, "cut")}
    for name, lines in made.items():
        head = "x y z" if name == "blanks" else "x,y,z"
        paths[name].write_text("\n".join([head, *lines]) + "\n")
    whole = paths["right"].read_bytes()
    paths["cut"].write_bytes(whole[: whole.rindex(b",")])
    return paths


def commands(folder: Path) -> Iterator[tuple[tuple[str, ...], int]]:
    """Words and the status that they end with, again and again; no two write one file."""
    paths = texts(folder)
    number = 0
    while True:
        for name, path in paths.items():
            status = 0 if name == "right" else 1
            yield ("check", str(path), *STATED), status
            number += 1
            yield ("convert", str(path), str(folder / f"{number}.parquet"), *STATED), status
            yield ("avar", str(path), *STATED, "--gyros", "x", "--slice", "0:20"), status


def every_run_ends(folder: Path, runs: int, step: int = 1, busy: int = 2) -> None:
    asked = list(islice(commands(folder), 0, runs * step, step))
    with busy_processes(busy), ThreadPoolExecutor(max_workers=2) as pool:
        found = list(pool.map(lambda one: ran(*SAGNAC, *one[0], timeout=LONGEST), asked))
    odd = [
        (words, said.returncode, said.stderr[-300:])
        for (words, status), said in zip(asked, found, strict=True)
        if said.returncode != status
        or (status and said.stderr.count("sagnac: ") != 1)
        or "internal error" in said.stderr
    ]
    assert not odd
    print(f"\n{runs} runs: {dict(Counter(said.returncode for said in found))}")


def test_a_few_runs_end_with_their_own_status(tmp_path):
    # Each command, on a sound file and on three that are not.
    every_run_ends(tmp_path, 4, step=4, busy=0)


@pytest.mark.fuzz
def test_two_hundred_runs_end_with_their_own_status(tmp_path):
    every_run_ends(tmp_path, 200)


TRIAL = """
import sys
import time
from pathlib import Path
from sagnac.formats import hdf5
hdf5.PATIENCE = 2.0
hdf5.require_survivable(Path(sys.argv[1]))
"""


@pytest.mark.skipif(not Path("/proc/self/task").is_dir(), reason="asks Linux for its processes")
def test_a_library_that_hangs_ends_though_nobody_waits_for_it(tmp_path):
    """A pipe that nobody writes to hangs for ever; the run is killed while it tries it."""
    os.mkfifo(tmp_path / "run.h5")
    with started(PYTHON, "-c", TRIAL, str(tmp_path / "run.h5")) as run:
        children = Path(f"/proc/{run.pid}/task/{run.pid}/children")
        until = time.monotonic() + 60.0
        while not (found := children.read_text().split()):
            assert time.monotonic() < until
            time.sleep(0.02)
        run.kill()
    while Path(f"/proc/{found[0]}").is_dir():
        assert time.monotonic() < until
        time.sleep(0.1)
