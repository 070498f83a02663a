"""Pages of the docs that a program makes, each stamped with a digest of what made it.

A test compares the stamps with what stands, so that a page that is older than what makes it shows.
Pages that take minutes have to be as made; of those that take hours the site says at their end
whether they are. ``python -m benchmarks._made`` lists them. ``--stamp PAGE`` stamps one whose
figures still hold, after a look: a change of words or of shape does not ask for a new run.
"""

import argparse
import hashlib
import json
import re
import subprocess
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, is_dataclass
from pathlib import Path
from typing import Any, Final

from sagnac.paper.prediction import FULL, plan

ROOT: Final = Path(__file__).parents[1]
_STAMP: Final = re.compile(
    r"<!-- Made from ([0-9a-f]{12})(?: at ([0-9a-f]{7,40}), (\d{4}-\d\d-\d\d))? -->"
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Made:
    """A page and what makes it.

    Attributes
    ----------
    page
        Below ``docs``.
    sources
        Files, or patterns of files, below the root.
    command
        That makes the page anew.
    settings
        What else its figures depend on, as JSON takes it.
    may_be_older
        Whether it takes so long that it may be older than its sources, which is then said.
    """

    page: str
    sources: tuple[str, ...]
    command: str
    settings: Callable[[], Any] = list
    may_be_older: bool = False

    @property
    def path(self) -> Path:
        return ROOT / "docs" / self.page

    @property
    def digest(self) -> str:
        """Digest of the sources, whatever their line ends, and of the settings."""
        found = hashlib.sha256(json.dumps(self.settings(), sort_keys=True).encode())
        for pattern in self.sources:
            for file in sorted(ROOT.glob(pattern)):
                found.update(file.relative_to(ROOT).as_posix().encode())
                found.update(file.read_text(encoding="utf-8").encode())
        return found.hexdigest()[:12]

    @property
    def stamped(self) -> str:
        """The digest that the page names; empty if it names none."""
        stamp = _STAMP.search(self.path.read_text(encoding="utf-8"))
        return stamp.group(1) if stamp else ""

    @property
    def closing(self) -> str:
        """The sentence at its end: when it was made, and whether what makes it has changed."""
        stamp = _STAMP.search(self.path.read_text(encoding="utf-8"))
        commit, date = (stamp.group(2), stamp.group(3)) if stamp else (None, None)
        by = f" by commit {commit}, {date}" if commit else ""
        if self.stamped == self.digest:
            return f"As made{by}; what makes it has not changed since."
        return f"Made{by}, and **older than what makes it**. To make it anew: `{self.command}`."


def stated(config: Any) -> Any:
    """What a configuration states beyond its defaults, so that a new key with a default is none."""
    if not is_dataclass(config):
        return config
    values = {field.name: (getattr(config, field.name), field.default) for field in fields(config)}
    return {name: stated(value) for name, (value, default) in values.items() if value != default}


def _experiment() -> Mapping[str, Any]:
    return {run.name: stated(run) for run in plan(FULL)}


MADE: Final = (
    Made(
        page="reproduce.md",
        sources=(
            "benchmarks/reproduction.py",
            "src/sagnac/noise/curve_fit.py",
            "src/sagnac/noise/readings.py",
            "src/sagnac/lines/grid_search.py",
            "src/sagnac/lines/published.py",
            "src/sagnac/paper/prediction.py",
            "src/sagnac/paper/reproduce.py",
        ),
        command="sagnac reproduce -o DIR, then python -m benchmarks.reproduction DIR --write",
        settings=_experiment,
    ),
    Made(
        page="benchmarks_figure_3.md",
        sources=(
            "benchmarks/figure_3.py",
            "src/sagnac/paper/trials.py",
        ),
        command="python -m benchmarks.figure_3 --write",
    ),
    Made(
        page="benchmarks_stability.md",
        sources=("benchmarks/stability.py", "src/sagnac/stability/*.py"),
        command="python -m benchmarks.stability --write",
        may_be_older=True,
    ),
    Made(
        page="benchmarks_lines.md",
        sources=("benchmarks/lines.py", "src/sagnac/lines/*.py", "src/sagnac/table/*.py"),
        command="python -m benchmarks.lines --write",
        may_be_older=True,
    ),
    Made(
        page="benchmarks_close_lines.md",
        sources=(
            "benchmarks/close_lines.py",
            "src/sagnac/lines/detection.py",
            "src/sagnac/lines/joint_fit.py",
            "src/sagnac/lines/orthogonal_search.py",
        ),
        command="python -m benchmarks.close_lines --write",
        may_be_older=True,
    ),
    *(
        Made(
            page=page,
            sources=(
                "benchmarks/recordings.py",
                "benchmarks/recording_sets.py",
                "src/sagnac/analysis/*.py",
                "src/sagnac/noise/*.py",
                "src/sagnac/lines/*.py",
                "src/sagnac/table/*.py",
            ),
            command=f"python -m benchmarks.recordings --set {drawn} --write",
            may_be_older=True,
        )
        for page, drawn in (
            ("benchmarks_recordings.md", "plain"),
            ("benchmarks_recordings_disturbed.md", "disturbed"),
        )
    ),
    Made(
        page="benchmarks_analysis.md",
        sources=("benchmarks/analysis.py", "src/sagnac/analysis/*.py", "src/sagnac/report/*.py"),
        command="python -m benchmarks.analysis --long --write",
        may_be_older=True,
    ),
    Made(
        page="benchmarks_gpu.md",
        sources=(
            "benchmarks/gpu.py",
            "src/sagnac/lines/*.py",
            "src/sagnac/spectrum/*.py",
            "src/sagnac/table/*.py",
        ),
        command="python -m benchmarks.gpu --write",
        may_be_older=True,
    ),
    Made(
        page="app_steps.md",
        sources=("benchmarks/app_steps.py", "src/sagnac/app/*.py", "src/sagnac/app/static/*"),
        command="python -m benchmarks.app_steps --write",
    ),
    Made(
        page="coverage.md",
        sources=(
            "src/sagnac/analysis/*.py",
            "src/sagnac/noise/*.py",
            "src/sagnac/stability/*.py",
            "tests/noise/test_statistics.py",
        ),
        command="make test-statistics",
        may_be_older=True,
    ),
    Made(
        page="pathologies.md",
        sources=(
            "benchmarks/_faults.py",
            "benchmarks/pathologies.py",
            "src/sagnac/recording/*.py",
            "src/sagnac/quality/*.py",
            "src/sagnac/analysis/*.py",
            "src/sagnac/noise/*.py",
        ),
        command="python -m benchmarks.pathologies 20",
        may_be_older=True,
    ),
    Made(
        page="real_recordings.md",
        sources=(
            "benchmarks/real_recordings.py",
            "src/sagnac/analysis/*.py",
            "src/sagnac/noise/*.py",
            "src/sagnac/lines/*.py",
            "src/sagnac/quality/*.py",
            "src/sagnac/spectrum/*.py",
        ),
        command="python -m benchmarks.real_recordings FOLDER",
        may_be_older=True,
    ),
)


def made_page(name: str) -> Made:
    """The page of a name."""
    return next(one for one in MADE if one.page == name)


def here() -> str:
    """`` at COMMIT, DATE`` of the checkout; empty if it is none."""
    done = subprocess.run(
        ["git", "log", "-1", "--format= at %h, %as"],
        cwd=ROOT, capture_output=True, text=True, check=False,
    )  # fmt: skip
    return done.stdout.rstrip("\n")


def with_stamp(text: str, digest: str, at: str = "") -> str:
    """A page stamped anew; one without a stamp gets it as its last line."""
    line = f"<!-- Made from {digest}{at} -->"
    if _STAMP.search(text):
        return _STAMP.sub(line, text, count=1)
    return f"{text.rstrip()}\n\n{line}\n"


def main(arguments: list[str]) -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks._made", description=__doc__)
    parser.add_argument("--stamp", metavar="PAGE", choices=[one.page for one in MADE])
    chosen = parser.parse_args(arguments).stamp
    for one in MADE:
        if one.page == chosen:
            text = with_stamp(one.path.read_text(encoding="utf-8"), one.digest, here())
            one.path.write_text(text, encoding="utf-8")
        state = "is as made" if one.stamped == one.digest else f"is older; {one.command}"
        print(f"docs/{one.page} {state}")


if __name__ == "__main__":
    main(sys.argv[1:])
