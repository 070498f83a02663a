"""Commands that end at fifty random instants: the old result is whole, or the new one.

A signal comes at a random part of a run, or the disk is full after a random number of bytes. What
a killed process leaves half written goes with the next run.
"""

import random
import signal
import subprocess
from pathlib import Path

import numpy as np
import pytest

import sagnac
from tests.cli.test_interrupted import ended, old_or_new
from tests.fuzz.draws import SEED, part_of
from tests.paper.scope import SMALL
from tests.processes import PYTHON

SIGNALS = (signal.SIGKILL, signal.SIGTERM, signal.SIGINT)
# Instants of each command; SAGNAC_FUZZ takes a part of them. A full disk is one in four.
INSTANTS = {"analyze": 14, "simulate": 14, "simulate csv": 6, "convert": 10, "reproduce": 6}
LONGEST = 240.0

pytestmark = pytest.mark.fuzz


def with_a_full_disk(words: list[str], folder: Path, blocks: int) -> subprocess.Popen:
    """A run that can write no more than some blocks of 512 bytes into a file."""
    limited = ["sh", "-c", f'ulimit -f {blocks}; exec "$@"', "sh", *words]
    return ended(limited, folder, 0, LONGEST)


@pytest.fixture
def still(tmp_path):
    rate = 10.0 + 1.8 * np.random.default_rng(1).standard_normal(6000)
    recording = sagnac.Recording.from_arrays(x=rate, kind="rate", unit="deg/h", sample_rate=100.0)
    return sagnac.write(recording, tmp_path / "still.npz")


def commands(still: Path, folder: Path) -> dict[str, tuple[list[str], list[str], Path]]:
    """What is run, by what an old result differs, and what is made."""
    report, made, copy = folder / "report", folder / "made.npz", folder / "copy.csv"
    text = folder / "made.csv"
    at_rest = ["--duration", "20", "--table-rate", "0"]
    return {
        "analyze": (
            ["analyze", str(still), "--method", "none", "-o", str(report)],
            ["--confidence", "0.9"],
            report,
        ),
        "simulate": (["simulate", "-o", str(made), *at_rest], ["--seed", "2"], made),
        "simulate csv": (["simulate", "-o", str(text), *at_rest], ["--seed", "2"], text),
        "convert": (["convert", str(still), str(copy)], ["--slice", "0:30"], copy),
    }


@pytest.mark.usefixtures("blank_figures")
@pytest.mark.parametrize("name", ["analyze", "simulate", "simulate csv", "convert"])
def test_a_result_is_old_or_new_at_any_instant(name, still, tmp_path):
    words, other, result = commands(still, tmp_path / "results")[name]
    drawn = random.Random(f"{SEED} {name}")

    def signalled(number):
        return lambda words, lasts, _: (
            number,
            ended(words, tmp_path, number, drawn.uniform(0.0, 1.1) * lasts),
        )

    def full(words, _, largest):
        run = with_a_full_disk(words, tmp_path, int(drawn.uniform(0.0, 1.0) * largest) // 512)
        said = (tmp_path / "said.txt").read_text().splitlines()
        assert run.returncode == 1, said
        assert "cannot be written" in said[-1]
        # What stood for it meanwhile is no business of the reader.
        assert ".part" not in said[-1]
        return signal.SIGKILL, run  # as a kill, it may leave a file alone

    endings = [*map(signalled, SIGNALS), full]
    times = part_of(INSTANTS[name])
    said = old_or_new(words, other, result, [endings[n % len(endings)] for n in range(times)])
    print(f"\n{name}: {said}")


REPRODUCE = """
import sys
from pathlib import Path
from sagnac.paper import reproduce as paper
from tests.paper.scope import SMALL
paper.reproduce(Path(sys.argv[1]), SMALL)
"""


def test_a_reproduction_that_was_ended_goes_on_to_the_same_bytes(tmp_path):
    from sagnac.paper.reproduce import reproduce  # noqa: PLC0415  (the other tests need no rig)

    folder = tmp_path / "reproduction"
    folder.mkdir()
    reproduce(folder, SMALL)
    runs = folder / "runs"
    whole = {entry.name: entry.read_bytes() for entry in runs.iterdir()}
    drawn = random.Random(f"{SEED} reproduce")
    words = [PYTHON, "-c", REPRODUCE, str(folder)]
    for number in range(part_of(INSTANTS["reproduce"])):
        for name in drawn.sample(sorted(whole), 6):
            (runs / name).unlink(missing_ok=True)
        kind = number % (len(SIGNALS) + 1)
        if kind < len(SIGNALS):
            ended(words, tmp_path, SIGNALS[kind], drawn.uniform(1.0, 12.0))
        else:
            assert with_a_full_disk(words, tmp_path, drawn.randrange(2)).returncode != 0
        there = {
            entry.name: entry.read_bytes()
            for entry in runs.iterdir()
            if not entry.name.endswith(".part")
        }
        assert there.items() <= whole.items()
    reproduce(folder, SMALL)
    assert {entry.name: entry.read_bytes() for entry in runs.iterdir()} == whole
