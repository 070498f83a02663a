"""Every reader, with 20,000 damaged files between them: read or refused, and nothing else."""

import os
import resource
import subprocess
import sys
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from sagnac.formats import write
from sagnac.recording.model import Recording
from tests.fuzz.worker import STATEMENTS, outcome

SEED = 20_130_227
# Damaged files of each format; SAGNAC_FUZZ takes a part of them. HDF5 has fewer, since another
# process tries each first.
FILES = {"csv": 3500, "npz": 4500, "mat": 5500, "h5": 400, "parquet": 4500, "imu": 1600}
SECONDS = 60.0
MOST_MEMORY = 2 * 2**30
IMU = "% PSINS log\n1 2 3 0 0 0\n34 108 400 0 5.0 0\n0.1 0.2 0.4 1 1 1\n"

pytestmark = pytest.mark.fuzz


def sound(folder: Path, suffix: str) -> None:
    random = np.random.default_rng(1)
    if suffix == "imu":
        rows = random.integers(-20, 20, (400, 6))
        text = IMU + "\n".join(" ".join(map(str, row)) for row in rows.tolist()) + "\n"
        (folder / "sound.imu").write_text(text)
        return
    seconds = np.arange(400) / 100.0
    recording = Recording.from_arrays(
        x=10.0 + random.normal(size=400),
        z=11.0 + random.normal(size=400),
        kind="rate",
        unit="deg/s",
        times=seconds + 1e-4 * random.uniform(-1.0, 1.0, 400),
        table=40.0 * seconds,
    )
    write(recording, folder / f"sound.{suffix}")


@pytest.mark.parametrize("suffix", FILES)
def test_damaged_files_are_read_or_refused(tmp_path, suffix):
    sound(tmp_path, suffix)
    for statement in STATEMENTS[:: 2 if suffix == "imu" else 1]:
        assert outcome(tmp_path / f"sound.{suffix}", statement) == "read"
    count = round(FILES[suffix] * float(os.environ.get("SAGNAC_FUZZ", "1")))
    found: Counter[str] = Counter()
    wrong: list[str] = []
    first = 0
    while first < count:
        lines = _run(tmp_path, suffix, first, min(250, count - first))
        for line in lines:
            number, _, said = line.partition(" ")
            found[said.strip() or "DIED"] += 1
            if said.strip() not in ("read", "refused"):
                wrong.append(f"{suffix} {number}: {said.strip() or 'the process died here'}")
        assert lines, "the worker did not start"
        first = int(lines[-1].partition(" ")[0]) + 1
    print(f"\n{suffix}: {dict(found)}")
    assert wrong == []
    assert found["refused"]
    assert {entry.name for entry in tmp_path.iterdir()} <= {
        f"sound.{suffix}",
        f"damaged.{suffix}",
        f"sound.{suffix}.toml",
        "stderr",
    }
    assert resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss * 1024 < MOST_MEMORY


def _run(folder: Path, suffix: str, first: int, count: int) -> list[str]:
    """What a worker said of some files, to the one that ended it."""
    root = Path(__file__).parents[2]
    command = [sys.executable, "-m", "tests.fuzz.worker", str(folder), suffix]
    with (folder / "stderr").open("wb") as errors:
        worker = subprocess.Popen(
            [*command, str(SEED), str(first), str(count)],
            cwd=root,
            stdout=subprocess.PIPE,
            stderr=errors,
            text=True,
        )
        try:
            said = worker.communicate(timeout=SECONDS + 2.0 * count)[0]
        except subprocess.TimeoutExpired:
            worker.kill()
            said = worker.communicate()[0] + " HANGS"
    return said.splitlines()
