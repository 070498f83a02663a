"""Every argument of every command, as the parser lists them, with values that make sense or none.

Every draw comes from its seed, so that one found runs again with its number. A run ends with a
status of its own, says one line if it is an error, leaves nothing outside its output, and replaces
no file.
"""

import hashlib
import os
import shutil
import warnings
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sagnac.cli import main
from sagnac.cli.app import app
from tests.cli.test_hostile_names import ESCAPES, TEX
from tests.fuzz.draws import SEED, called, part_of
from tests.fuzz.test_options import VALUES

# Draws of each command; SAGNAC_FUZZ takes a part of them.
DRAWS = {
    "analyze": 60, "avar": 60, "lines": 40, "compare": 20, "check": 80, "simulate": 60,
    "convert": 80, "export": 120, "plan": 20, "campaign": 12, "align": 120, "demo": 12,
    "reproduce": 12,
}  # fmt: skip
# What is run if nothing is drawn; a few seconds at most. The last two are refused for their output.
WORDS = {
    "analyze": ["analyze", "run.npz", "--method", "none", "-o", "out"],
    "avar": ["avar", "run.npz", "-o", "out"],
    "lines": ["lines", "run.npz"],
    "compare": ["compare", "run.npz", "--method", "none", "-o", "out"],
    "check": ["check", "run.npz"],
    "simulate": ["simulate", "-o", "out/made.npz", "--duration", "5", "--preset", "quiet"],
    "convert": ["convert", "run.npz", "out/made.csv"],
    "export": ["export", "analysis.json", "-o", "out/imu.toml"],
    "plan": ["plan", "run.npz", "--method", "none"],
    "campaign": ["campaign", "run.npz", "--method", "none", "-o", "out", "--workers", "1"],
    "align": ["align", "analysis.json", "--latitude", "32", "-o", "out"],
    "demo": ["demo", "-o", "run.npz"],
    "reproduce": ["reproduce", "-o", "run.npz"],
}
# An address that nobody has costs half a minute, and processes by the thousand the machine.
NOT_DRAWN = {"--debug", "--scheduler", "--workers", "--force", "-o", "--output", "*"}
MORE = (
    "x", "y", "z", "x,y", "1", "0", "2", "0.5", "-3", "nan", "inf", "1e999", "10s", "1min", "-1h",
    "100", "360", "90", "-90", "run.npz", "analysis.json", "out", "nowhere", "/", ".", "..",
    "run.npz/x", "é", ESCAPES, TEX, "=1+1", "x\x00y", "a\nb", "kalibr", "px4", "gtsam", "paper",
    "harsh", "(?P<unit>", "(?P<unit>.*)", "mdev,theo1", "haar",
)  # fmt: skip

pytestmark = pytest.mark.fuzz


@pytest.fixture(scope="module")
def prepared(tmp_path_factory) -> Path:
    """A short recording of three gyros, and its analysis."""
    folder = tmp_path_factory.mktemp("prepared")
    random = np.random.default_rng(1)
    gyros = {name: random.normal(10.0, 1.0, 4000) for name in "xyz"}
    np.savez(folder / "run.npz", **gyros, kind="rate", unit="deg/h", sample_rate=50.0)
    words = ["avar", str(folder / "run.npz"), "--gyros", "x", "-o", str(folder / "made")]
    assert main(words) == 0
    shutil.copy(folder / "made" / "x" / "analysis.json", folder / "analysis.json")
    shutil.rmtree(folder / "made")
    return folder


def arguments_of(command: str) -> list[tuple[str, Any]]:
    """Options of a command with the type of their value, as the parser knows them."""
    return [
        (name, one.hint)
        for one in app[command].assemble_argument_collection(
            default_parameter=app.default_parameter
        )
        for name in one.names
        if name.startswith("-") and name not in NOT_DRAWN
    ]


def drawn(command: str, random: np.random.Generator) -> list[str]:
    words = list(WORDS[command])
    options = arguments_of(command)
    for _ in range(int(random.integers(1, 4)) if options else 0):
        name, hint = options[int(random.integers(len(options)))]
        pool = MORE if random.random() < 0.6 else VALUES
        value = pool[int(random.integers(len(pool)))]
        words += [name] if hint is bool else [f"{name}={value}"]
    # An output that is none keeps these two short.
    if command not in ("demo", "reproduce") and random.random() < 0.15:
        words[int(random.integers(1, len(words)))] = MORE[int(random.integers(len(MORE)))]
    return words


def content(folder: Path) -> dict[str, str]:
    """Digest of each file outside ``out``."""
    return {
        str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in folder.rglob("*")
        if path.is_file() and path.relative_to(folder).parts[0] != "out"
    }


def output_of(words: list[str]) -> str:
    """First folder, or file, of the output that the words name."""
    place = words.index("-o") + 1 if "-o" in words else 2
    parts = Path(words[place]).parts if place < len(words) else ()
    return parts[0] if parts else "out"


def outcome(words: list[str]) -> str:
    """``done`` or ``refused``, or what must not be."""
    with warnings.catch_warnings(record=True) as warned:
        # What a library says of its own future is none of the user's business.
        warnings.simplefilter("always")
        status, printed, said = called(words)
    if isinstance(status, str):
        return status
    if any(issubclass(one.category, RuntimeWarning) for one in warned):
        return f"WARNED {warned[0].message} at {warned[0].filename}:{warned[0].lineno}"
    return judged(status, printed, said)


def judged(status: int, printed: str, said: str) -> str:
    """The same by status and words."""
    for odd in ("Traceback", "internal error", "the analysis fails"):
        if odd in said:
            return f"INTERNAL {said[-300:]!r}"
    if "\x1b" in said + printed:
        return "ESCAPES on the terminal"
    if status in (0, 3, 4):
        return "done"
    lines = [line for line in said.splitlines() if line.startswith("sagnac: ")]
    if status not in (1, 2) or (not lines and not printed):
        return f"STATUS {status} {said[-300:]!r}"
    return "refused" if all(len(line) <= 800 for line in lines) else f"LONG {len(said)}"


@pytest.mark.parametrize("command", DRAWS)
def test_every_argument_of_every_command(command, prepared, tmp_path, monkeypatch):
    count = part_of(DRAWS[command])
    first = int(os.environ.get("SAGNAC_FUZZ_FIRST", "0"))
    for one in ("run.npz", "analysis.json"):
        shutil.copy(prepared / one, tmp_path / one)
    # A name without a folder of its own: what goes beside it would be seen.
    (tmp_path / "mine.txt").write_text("mine")
    monkeypatch.chdir(tmp_path)
    before = content(tmp_path)
    found, wrong = Counter(), []
    for number in range(first, first + count):
        (tmp_path / "out").mkdir()
        words = drawn(
            command, np.random.default_rng([SEED, 3, sorted(DRAWS).index(command), number])
        )
        said = outcome(words)
        # A name that was drawn for the output, and was nobody's, is as good as any.
        own = output_of(words)
        after = {
            name: digest
            for name, digest in content(tmp_path).items()
            if name in before or Path(name).parts[0] != own
        }
        if after != before:
            said = f"FILES {sorted(set(after.items()) ^ set(before.items()))}"
        for name in set(content(tmp_path)) - set(before):
            (tmp_path / name).unlink()
        found[said if said in ("done", "refused") else "WRONG"] += 1
        if said not in ("done", "refused"):
            wrong.append(f"{number} {words}: {said}")
        shutil.rmtree(tmp_path / "out")
    print(f"\n{command}: {dict(found)}")
    assert wrong == []
