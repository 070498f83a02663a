"""Options and TOML files that make no sense: each is taken or refused in one line.

Every draw comes from its seed, so that one found runs again with its number.
"""

from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from tests.fuzz.draws import SEED, called, part_of
from tests.fuzz.mutations import MUTATIONS

# Draws of each; SAGNAC_FUZZ takes a part of them.
OPTIONS, STATEMENTS, RIGS, SETTINGS, CAMPAIGNS = 700, 500, 300, 300, 200
WORDS = """
x,z x x,x , nan inf -1 0 1e-300 1e308 1e999 0x10 true rate angle rate=x x=rate deg/h arcsec deg
deg/s °/√h counts 0.1arcsec 1s 1h -1s 10:20 20:10 : 1e9: a:b none table table:deg time:ms x=x
x=nothing fos fris none 64 65 0.95 1 1.5 clipping all 4GiB 1B 1e30GiB N=3e-4 3e-4deg/sqrt(h)
N=x,B=0.01deg/h imu7-deg ../../x /dev/null {} [1]
"""
VALUES = (*WORDS.split(), "", " ", "\n", "ж" * 300, "x" * 5000)
OPTION_NAMES = """
--gyros --kind --unit --scale --rate --time --table --columns --slice --counter-bits --null-pulse
--accelerometers --layout --memory --method --interval --confidence --accept --spec --risk
--settings --strict --json --nothing -x --
"""
NAMES = tuple(OPTION_NAMES.split())
STATED = {"--kind": "rate", "--unit": "deg/h", "--rate": "100"}
WORDS_STATED = [word for pair in STATED.items() for word in pair]
STATEMENT = """gyros = ["x", "z"]
kind = "rate"
unit = { x = "deg/h", z = "deg/h" }
sample_rate = 100.0
time = "none"
[columns]
x = "x"
"""
RIG = """preset = "paper"
duration_s = 2.0
seed = 3
[table]
rate_deg_per_s = 20.0
profile = []
[gyro]
arw_deg_per_sqrt_h = [1e-3, 1e-3, 1e-3]
[encoder]
lines = 36000
"""
RUN = 'kind = "rate"\nunit = "deg/h"\nrate = 100.0\nslice = "0:5"\nmethod = "none"\n'
CAMPAIGN = """files = ["run.csv"]
methods = ["none"]
gyros = ["x", "z"]
interval_s = 1.0
pattern = "(?P<unit>run)"
[statement]
kind = "rate"
unit = "deg/h"
[[recording]]
file = "run.csv"
day = 1
"""
pytestmark = pytest.mark.fuzz


@pytest.fixture
def folder(tmp_path, monkeypatch):
    random = np.random.default_rng(1)
    rows = "\n".join(f"{x:.6f},{z:.6f}" for x, z in random.normal(10.0, 1.0, (2000, 2)))
    (tmp_path / "run.csv").write_text(f"x,z\n{rows}\n")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def outcome(words: list[str]) -> str:
    """``read``, ``refused``, or what must not be."""
    status, printed, said = called(words)
    if isinstance(status, str):
        return status
    if "Traceback" in said or "internal error" in said:
        return f"INTERNAL {said[-300:]!r}"
    if status in (0, 3, 4):
        return "read"
    lines = [line for line in said.splitlines() if line.startswith("sagnac: ")]
    last = said.splitlines()[-1:] == lines
    # `check` lists what is wrong with the data on standard output.
    listed = status == 1 and not said and printed
    return "refused" if listed or (status in (1, 2) and last) else f"STATUS {status} {said!r}"


def options(random: np.random.Generator) -> list[str]:
    """A call of ``check`` with some options that are wrong, and some that are not."""
    stated = {name: value for name, value in STATED.items() if random.random() < 0.8}
    for _ in range(int(random.integers(1, 4))):
        name = NAMES[int(random.integers(len(NAMES)))]
        stated[name] = VALUES[int(random.integers(len(VALUES)))]
    words = ["check", "run.csv"]
    for name, value in stated.items():
        words += [name] if random.random() < 0.1 else [name, value]
    return words


def damaged(text: str, random: np.random.Generator) -> bytes:
    """A TOML with a value, a line or some bytes that are others."""
    lines = text.splitlines()
    for _ in range(int(random.integers(0, 3))):
        at = int(random.integers(len(lines)))
        key, equals, _ = lines[at].partition(" = ")
        value = VALUES[int(random.integers(len(VALUES)))]
        new = value if random.random() < 0.5 else f'"{value}"'
        lines[at] = f"{key}{equals}{new}" if equals else f"[{value}]"
    content = ("\n".join(lines) + "\n").encode()
    for _ in range(int(random.integers(0, 2))):
        content = MUTATIONS[int(random.integers(len(MUTATIONS)))](content, random) or b"\n"
    return content


def judge(words: list[str], number: int, found: Counter[str], wrong: list[str]) -> None:
    said = outcome(words)
    found[said if said in ("read", "refused") else "WRONG"] += 1
    if said not in ("read", "refused"):
        wrong.append(f"{number} {words}: {said}")


def test_options_are_taken_or_refused(folder):
    before = {entry.name for entry in folder.iterdir()}
    assert outcome(["check", "run.csv", *WORDS_STATED]) == "read"
    found, wrong = Counter(), []
    for number in range(part_of(OPTIONS)):
        judge(options(np.random.default_rng([SEED, 1, number])), number, found, wrong)
    print(f"\noptions: {dict(found)}")
    assert wrong == []
    assert found["refused"]
    assert {entry.name for entry in folder.iterdir()} == before


TOMLS = {
    "statement": (STATEMENTS, STATEMENT, "run.csv.toml", ["check", "run.csv"]),
    "rig": (RIGS, RIG, "rig.toml", ["simulate", "rig.toml", "-o", "nothing/made.npz"]),
    "settings": (SETTINGS, RUN, "run.toml", ["check", "run.csv", "--settings", "run.toml"]),
    "specification": (
        SETTINGS,
        'N = "3e-4deg/sqrt(h)"\n',
        "limits.toml",
        ["check", "run.csv", *WORDS_STATED, "--spec", "limits.toml"],
    ),
    "campaign": (CAMPAIGNS, CAMPAIGN, "many.toml", ["campaign", "many.toml", "-o", "run.csv"]),
}


@pytest.mark.parametrize("name", TOMLS)
def test_tomls_are_taken_or_refused(name, folder):
    most, text, file, words = TOMLS[name]
    if name in ("statement", "settings", "specification"):
        Path(file).write_text(text)
        assert outcome(words) == "read"
    found, wrong = Counter(), []
    for number in range(part_of(most)):
        content = damaged(text, np.random.default_rng([SEED, 2, number]))
        Path(file).write_bytes(content)
        judge(words, number, found, wrong)
    print(f"\n{name}: {dict(found)}")
    assert wrong == []
    assert found["refused"]
    assert {entry.name for entry in folder.iterdir()} == {"run.csv", file}
