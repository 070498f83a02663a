"""Compiled loops run without a cache, and with a damaged one."""

from pathlib import Path

from tests.processes import PYTHON, environment, ran

RUN = (
    "import loops; from sagnac.core.kernels import cache_notes; "
    "print(loops.double(21), *(note.text for note in cache_notes()))"
)
LOOPS = """from sagnac.core.kernels import compiled

@compiled()
def double(number):
    return 2 * number
"""


def outcome(folder: Path, run: str = RUN, **variables: str) -> str:
    done = ran(PYTHON, "-c", run, cwd=folder, env=environment(folder, **variables))
    assert done.stderr == ""
    return done.stdout.strip()


def test_a_loop_runs_without_anywhere_to_cache_it(tmp_path):
    # In an archive there is no folder beside the code, and no home to write to.
    (tmp_path / "loops.py").write_text(LOOPS)
    nowhere = tmp_path / "file"
    nowhere.write_text("")
    (tmp_path / "__pycache__").write_text("not a folder")
    said = outcome(tmp_path, HOME=str(nowhere), XDG_CACHE_HOME=str(nowhere))
    assert said.startswith("42 compiled loops are not kept")
    assert "NUMBA_CACHE_DIR" in said


def test_a_cache_that_cannot_be_written_is_said(tmp_path):
    (tmp_path / "loops.py").write_text(LOOPS)
    full = f"import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (0, 0)); {RUN}"
    said = outcome(tmp_path, full, NUMBA_CACHE_DIR=str(tmp_path / "cache"))
    assert said.startswith("42 compiled loops are not kept")


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
        files = [*tmp_path.rglob("*.nbi"), *tmp_path.rglob("*.nbc")]
        assert min(file.stat().st_size for file in files) > 20
    assert outcome(tmp_path, **cache) == "42"


def test_a_loop_that_is_not_compiled_runs_all_the_same(tmp_path):
    (tmp_path / "loops.py").write_text(LOOPS)
    assert outcome(tmp_path, NUMBA_DISABLE_JIT="1") == "42"
