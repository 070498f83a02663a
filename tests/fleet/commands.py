"""The command line in a process of its own."""

import os
import subprocess
import sys
from pathlib import Path

PATTERN = "(?P<unit>[A-Z])_day(?P<day>[0-9])"


def campaign(*arguments: str, **more) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        command(*arguments), capture_output=True, text=True, check=False, env=environment(), **more
    )


def command(*arguments: str) -> list[str]:
    shared = ("--method", "none", "--pattern", PATTERN)
    return [sys.executable, "-m", "sagnac", "campaign", *shared, *arguments]


def environment() -> dict[str, str]:
    source = str(Path(__file__).parents[2] / "src")
    found = os.environ.get("PYTHONPATH")
    return {**os.environ, "PYTHONPATH": f"{source}{os.pathsep}{found}" if found else source}
