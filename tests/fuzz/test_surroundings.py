"""Surroundings that are not as a run would like them, drawn at random and together.

No home, no folder for temporary files, folders that cannot be made or written to, closed streams,
narrow terminals, odd locales, and two runs at once into one folder.
"""

import json
import random
import subprocess
from collections import Counter

import numpy as np
import pytest

from tests.cli.test_interrupted import files_of
from tests.fuzz.draws import SEED, part_of
from tests.processes import SAGNAC, environment, ran, started

# SAGNAC_FUZZ takes a part of them.
DRAWS, PAIRS = 24, 3
STATED = ["--kind", "rate", "--unit", "deg/h", "--rate", "100"]
NOWHERE = "/proc/nowhere"
ODD = {
    "HOME": ("", NOWHERE, None),
    "XDG_CACHE_HOME": ("", NOWHERE, None),
    "TMPDIR": ("", NOWHERE, None),
    "COLUMNS": ("1", "-5", "many", None),
    "LC_ALL": ("C", "xx_XX.nothing", None),
    "TERM": ("dumb", "", None),
    "MPLCONFIGDIR": (NOWHERE, None),
    "PYTHONIOENCODING": ("ascii", None),
    "USER": (None,),
    "PATH": ("", None),
}
# Folders that nobody can write to, root neither, and one in a file.
OUTPUTS = ("out", "deep/er/out", NOWHERE, "run.csv/out")
CLOSED = ("", "0<&-", "1>&-", "2>&-", "1>&- 2>&-", "0<&- 1>&- 2>&-")

pytestmark = pytest.mark.fuzz


@pytest.fixture
def folder(tmp_path):
    rows = "\n".join(f"{x:.6f}" for x in np.random.default_rng(1).normal(10.0, 1.0, 6000))
    (tmp_path / "run.csv").write_text(f"x\n{rows}\n")
    return tmp_path


def odd_environment(drawn: random.Random) -> dict[str, str]:
    """That of the tests with some variables odd or missing."""
    found = environment()
    for name in drawn.sample(sorted(ODD), drawn.randrange(1, 5)):
        value = drawn.choice(ODD[name])
        found.pop(name, None)
        if value is not None:
            found[name] = value
    return found


def words_of(output: str, drawn: random.Random) -> list[str]:
    """A command that writes something, or not."""
    return drawn.choice(
        [
            ["analyze", "run.csv", *STATED, "--method", "none", "-o", output],
            ["avar", "run.csv", *STATED, "-o", output],
            ["convert", "run.csv", f"{output}/copy.csv", *STATED],
            ["simulate", "-o", f"{output}/made.npz", "--duration", "5", "--table-rate", "0"],
            ["check", "run.csv", *STATED],
        ]
    )


def test_odd_surroundings_are_borne_or_refused(folder):
    found: Counter[str] = Counter()
    for number in range(part_of(DRAWS)):
        drawn = random.Random(f"{SEED} {number}")
        around, output = odd_environment(drawn), drawn.choice(OUTPUTS)
        words, closed = words_of(output, drawn), drawn.choice(CLOSED)
        shell = ("/bin/sh", "-c", f'exec "$@" {closed}', "sh")
        done = ran(*shell, *SAGNAC, *words, env=around, cwd=folder, text=False)
        said = (done.stdout + done.stderr).decode(errors="replace")
        case = f"{number} {words} {closed} {said[-600:]}"
        assert done.returncode in (0, 1), case
        assert "Traceback" not in said, case
        assert "internal error" not in said, case
        if done.returncode == 1 and "2>&-" not in closed:
            lines = said.splitlines()
            assert lines[-1].startswith("sagnac: "), case
        assert not list(folder.rglob("*.part")), case
        found["written" if done.returncode == 0 else "refused"] += 1
    print(f"\nsurroundings: {dict(found)}")


def test_two_at_once_leave_one_whole_result(folder):
    words = ["analyze", "run.csv", *STATED, "--method", "none", "-o", "out"]
    values = ("0.9", "0.95")
    for _ in range(part_of(PAIRS)):
        both = [
            started(*SAGNAC, *words, "--confidence", value, cwd=folder, stdout=subprocess.DEVNULL)
            for value in values
        ]
        said = [one.communicate(timeout=300.0)[1] for one in both]
        assert [one.returncode for one in both] == [0, 0], said
        assert not list(folder.glob(".*.part"))
        made = files_of(folder / "out")
        document, page = json.loads(made["analysis.json"]), made["report.html"].decode()
        told = document["settings"]["confidence"]
        assert document["angle_random_walk"]["confidence"] == told
        assert told in [float(value) for value in values]
        assert f"{100.0 * told:g} %" in page
