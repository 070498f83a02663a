"""Every reader, with 20,000 damaged files between them: read or refused, and nothing else."""

import resource
import subprocess
from collections import Counter
from pathlib import Path

import pytest

from tests.fuzz.draws import SEED, part_of
from tests.fuzz.sound import sound
from tests.fuzz.worker import PROVEN, STATEMENTS, STATEMENTS_OF, outcome
from tests.processes import PYTHON, started

# Damaged files of each format; SAGNAC_FUZZ takes a part of them. Those of HDF5 are fewer, since
# another process tries each first.
FILES = {
    **{"csv": 1700, "npz": 3100, "mat": 3200, "h5": 120, "parquet": 3000, "imu": 1200},
    **{"feather": 1000, "bag": 700, "mcap": 700, "db3": 500, "tdms": 800, "ulg": 700},
    **{"mseed": 500, "v2.mseed": 700, "nc": 80, "classic.nc": 600, "v73.mat": 80, "bin": 400},
    **{"ins": 280, "lvm": 300, "euroc.csv": 170, "kalibr.csv": 170, "npy": 250},
}
GOOD = ("read", "refused", "noted")
SECONDS = 60.0
MOST_MEMORY = 2 * 2**30

pytestmark = pytest.mark.fuzz


@pytest.mark.parametrize("ending", FILES)
def test_damaged_files_are_read_or_refused(tmp_path, ending):
    sound(tmp_path, ending)
    for statement in STATEMENTS_OF.get(ending, STATEMENTS):
        assert outcome(tmp_path / f"sound.{ending}", statement) == "read"
    count = part_of(FILES[ending])
    found: Counter[str] = Counter()
    wrong: list[str] = []
    first = 0
    while first < count:
        lines = _run(tmp_path, ending, first, min(250, count - first))
        for line in lines:
            number, _, said = line.partition(" ")
            found[said.strip() or "DIED"] += 1
            # Without a checksum no reader can tell that a number is another.
            if said.strip() not in (GOOD if ending in PROVEN else (*GOOD, "changed")):
                wrong.append(f"{ending} {number}: {said.strip() or 'the process died here'}")
        assert lines, "the worker did not start"
        first = int(lines[-1].partition(" ")[0]) + 1
    print(f"\n{ending}: {dict(found)}")
    assert wrong == []
    assert found["refused"] or found["noted"]
    assert {entry.name for entry in tmp_path.iterdir()} <= {
        f"sound.{ending}",
        f"damaged.{ending}",
        f"sound.{ending}.toml",
        f"damaged.{ending}.toml",
        "stderr",
    }
    assert resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss * 1024 < MOST_MEMORY


def _run(folder: Path, ending: str, first: int, count: int) -> list[str]:
    """What a worker said of some files, to the one that ended it."""
    command = [PYTHON, "-m", "tests.fuzz.worker", str(folder), ending]
    with (folder / "stderr").open("wb") as errors:
        worker = started(*command, str(SEED), str(first), str(count), stderr=errors)
        try:
            said = worker.communicate(timeout=SECONDS + 2.0 * count)[0]
        except subprocess.TimeoutExpired:
            worker.kill()
            said = worker.communicate()[0] + " HANGS"
    return said.splitlines()
