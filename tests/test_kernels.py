"""Compiled loops run without a cache, and with a damaged one."""

import os
import subprocess
import sys
from pathlib import Path

import sagnac

RUN = "import loops; print(loops.double(21))"
LOOPS = """from sagnac.kernels import compiled

@compiled()
def double(number):
    return 2 * number
"""


def outcome(folder: Path, **environment: str) -> str:
    root = str(Path(sagnac.__file__).parent.parent)
    done = subprocess.run(
        [sys.executable, "-c", RUN],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": f"{root}{os.pathsep}{folder}", **environment},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.stderr == ""
    return done.stdout.strip()


def test_a_loop_runs_without_anywhere_to_cache_it(tmp_path):
    # In an archive there is no folder beside the code, and no home to write to.
    (tmp_path / "loops.py").write_text(LOOPS)
    nowhere = tmp_path / "file"
    nowhere.write_text("")
    (tmp_path / "__pycache__").write_text("not a folder")
    assert outcome(tmp_path, HOME=str(nowhere), XDG_CACHE_HOME=str(nowhere)) == "42"


def test_a_damaged_cache_is_written_anew(tmp_path):
    (tmp_path / "loops.py").write_text(LOOPS)
    cache = {"NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    assert outcome(tmp_path, **cache) == "42"
    files = [*tmp_path.rglob("*.nbi"), *tmp_path.rglob("*.nbc")]
    assert len(files) == 2
    for keep in (0, 20):
        for file in files:
            file.write_bytes(file.read_bytes()[:keep])
        assert outcome(tmp_path, **cache) == "42"
        assert outcome(tmp_path, **cache) == "42"
        files = [*tmp_path.rglob("*.nbi"), *tmp_path.rglob("*.nbc")]
        assert min(file.stat().st_size for file in files) > 20
