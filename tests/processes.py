"""Python, and the command, as processes of their own."""

import os
import subprocess
import sys
from pathlib import Path

import sagnac

PYTHON = sys.executable
SAGNAC = (PYTHON, "-m", "sagnac")
_SOURCE = Path(sagnac.__file__).parent.parent


def environment(*folders: Path, **more: str) -> dict[str, str]:
    """That of the tests, in which the package, its tests and what lies in `folders` are found."""
    places = (_SOURCE, _SOURCE.parent, *folders)
    return {**os.environ, "PYTHONPATH": os.pathsep.join(map(str, places)), **more}


def started(*words: str, **how: object) -> subprocess.Popen:
    """A process whose streams are pipes of text, unless they are stated."""
    streams = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    return subprocess.Popen(words, **{"env": environment(), **streams, **how})


def ran(*words: str, check: bool = False, **how: object) -> subprocess.CompletedProcess:
    """A process that has ended, with what it said."""
    usual = {"env": environment(), "capture_output": True, "text": True, "timeout": 300.0}
    return subprocess.run(words, check=check, **{**usual, **how})
