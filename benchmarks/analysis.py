"""`sagnac analyze` on two hours at 500 Hz, in units of one Fourier transform of one channel.

The unit is the processor time of ``numpy.fft.rfft`` of as many samples, measured just before and
after each command, so that the figures hold on any machine, busy or not. Beside it: where the time
goes, three gyros, longer recordings, and the first run of a fresh installation, which compiles.

    python -m benchmarks.analysis [--beside CHECKOUT] [--runs N] [--long] [--write]
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

PAGE: Final = Path(__file__).parents[1] / "docs" / "benchmarks_analysis.md"
SAMPLES: Final = 3_600_000
TRANSFORMS: Final = 5
RUNS: Final = 5
# What is analyzed beside the pair of two hours: name -> duration, gyros, only if asked.
OTHERS: Final = {
    "three gyros, 2 h": ("2h", "x,y,z", False),
    "two gyros, 6 h": ("6h", "x,z", False),
    "two gyros, 24 h": ("24h", "x,z", True),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Cost:
    """Processor seconds, these in transforms, wall seconds and MiB at most of one command."""

    processor: float
    transforms: float
    wall: float
    memory: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Program:
    """A sagnac to measure: this one, or that of another checkout."""

    checkout: Path | None = None

    def command(self, *words: str) -> list[str]:
        return [sys.executable, "-m", "sagnac", *words]

    @property
    def environment(self) -> dict[str, str]:
        """In which it runs. Modules are compiled once, as an installation has them."""
        environment = {**os.environ, "PYTHONDONTWRITEBYTECODE": "", "OPENBLAS_NUM_THREADS": "1"}
        if self.checkout is not None:
            environment["PYTHONPATH"] = str(self.checkout / "src")
        return environment

    @property
    def commit(self) -> str:
        place = self.checkout or PAGE.parents[1]
        asked = ["git", "-C", str(place), "log", "-1", "--format=%h"]
        return subprocess.run(asked, check=True, capture_output=True, text=True).stdout.strip()


def transform_seconds() -> float:
    """Median processor time of one transform, s."""
    values = np.random.default_rng(1).standard_normal(SAMPLES)
    np.fft.rfft(values)
    times = []
    for _ in range(TRANSFORMS):
        began = time.process_time()
        np.fft.rfft(values)
        times.append(time.process_time() - began)
    return float(np.median(times))


def cost_of(program: Program, *words: str, **environment: str) -> Cost:
    """What a command costs, itself and what it starts.

    Raises
    ------
    subprocess.CalledProcessError
        If it fails.
    """
    # A process of its own, so that the largest child is this command.
    measured = (
        "import resource, subprocess, sys, time\n"
        "began = time.perf_counter()\n"
        "subprocess.run(sys.argv[1:], check=True, stdout=subprocess.DEVNULL,"
        " stderr=subprocess.DEVNULL)\n"
        "wall = time.perf_counter() - began\n"
        "used = resource.getrusage(resource.RUSAGE_CHILDREN)\n"
        "print(used.ru_utime + used.ru_stime, wall, used.ru_maxrss / 1024.0)\n"
    )
    before = transform_seconds()
    done = subprocess.run(
        [sys.executable, "-c", measured, *program.command(*words)],
        check=True,
        capture_output=True,
        text=True,
        env={**program.environment, **environment},
    )
    unit = 0.5 * (before + transform_seconds())
    processor, wall, memory = map(float, done.stdout.split())
    return Cost(processor=processor, transforms=processor / unit, wall=wall, memory=memory)


def median_of(costs: list[Cost]) -> Cost:
    """Median times, and the most memory."""
    return Cost(
        processor=float(np.median([cost.processor for cost in costs])),
        transforms=float(np.median([cost.transforms for cost in costs])),
        wall=float(np.median([cost.wall for cost in costs])),
        memory=max(cost.memory for cost in costs),
    )


def simulated(program: Program, folder: Path, duration: str, *more: str) -> Path:
    """A recording of the preset `paper`, turning unless `more` options say otherwise.

    Raises
    ------
    subprocess.CalledProcessError
        If it cannot be made.
    """
    path = folder / f"{duration}.parquet"
    words = ["simulate", "--preset", "paper", "--duration", duration, "-o", str(path), *more]
    subprocess.run(
        program.command(*words, "--force"),
        check=True,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        env=program.environment,
    )
    return path


# A stage says how far it is: 0 as it begins, 1 as it ends, some twice.
_STAGES: Final = """
import json, sys, tempfile, time
import sagnac

def staged(path, gyros):
    begun, spent = {}, {}
    def progress(stage, fraction):
        now = time.process_time()
        if fraction == 0.0:
            begun[stage] = now - spent.get(stage, 0.0)
        spent[stage] = now - begun[stage]
    progress("read", 0.0)
    recording = sagnac.read(path)
    progress("read", 1.0)
    analysis = sagnac.analyze(recording, gyros=gyros, progress=progress)
    progress("report", 0.0)
    with tempfile.TemporaryDirectory() as folder:
        sagnac.write_report(analysis, folder)
    progress("report", 1.0)
    return spent

path, gyros = sys.argv[1], tuple(sys.argv[2].split(","))
staged(path, gyros)
print(json.dumps(staged(path, gyros)))
"""


def stages_of(program: Program, recording: Path, gyros: str) -> dict[str, float]:
    """Processor seconds of each stage of a second analysis in one process: nothing is loaded.

    Raises
    ------
    subprocess.CalledProcessError
        If it fails.
    """
    done = subprocess.run(
        [sys.executable, "-c", _STAGES, str(recording), gyros],
        check=True,
        capture_output=True,
        text=True,
        env=program.environment,
    )
    stages: dict[str, float] = json.loads(done.stdout)
    return stages


def first_runs(program: Program, folder: Path) -> dict[str, tuple[Cost, Cost]]:
    """Each command with nothing compiled before, and again: name -> both costs."""
    found = {}
    for name, rate in (("avar", ("--table-rate", "0")), ("analyze", ())):
        recording = simulated(program, folder, "2h", *rate)
        words = (name, str(recording), "--gyros", "x,z", "-o", str(folder / name), "--force")
        place = str(folder / f"compiled-{name}")
        found[name] = (
            cost_of(program, *words, NUMBA_CACHE_DIR=place),
            cost_of(program, *words, NUMBA_CACHE_DIR=place),
        )
    return found


def main(arguments: list[str] | None = None) -> int:
    """Print the figures, and write the page if asked."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--beside", type=Path, help="checkout to measure run by run beside this")
    parser.add_argument("--runs", type=int, default=RUNS, help="of two gyros, two hours")
    parser.add_argument("--long", action="store_true", help="24 hours as well")
    parser.add_argument("--write", action="store_true", help="write the page")
    chosen = parser.parse_args(arguments)
    own = Program()
    programs = [own] if chosen.beside is None else [own, Program(checkout=chosen.beside)]
    rows: dict[str, Cost] = {}
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)

        def cost(program: Program, recording: Path, gyros: str) -> Cost:
            words = ("analyze", str(recording), "--gyros", gyros, "-o", str(folder / "report"))
            return cost_of(program, *words, "--force")

        recording = simulated(own, folder, "2h")
        for program in programs:
            cost(program, recording, "x,z")  # compiles what is not compiled yet
        costs: list[list[Cost]] = [[] for _ in programs]
        stages: list[list[dict[str, float]]] = [[] for _ in programs]
        for _ in range(chosen.runs):
            for program, found, spent in zip(programs, costs, stages, strict=True):
                found.append(cost(program, recording, "x,z"))
                spent.append(stages_of(program, recording, "x,z"))
        for program, found in zip(programs, costs, strict=True):
            beside = "" if program is own else f", at {program.commit}"
            rows[f"two gyros, 2 h{beside}"] = median_of(found)
        first = first_runs(own, folder)
        for name, (duration, gyros, is_long) in OTHERS.items():
            if is_long and not chosen.long:
                continue
            recording = simulated(own, folder, duration)
            rows[name] = cost(own, recording, gyros)
            recording.unlink()
    medians = [
        {name: float(np.median([one[name] for one in spent])) for name in spent[0]}
        for spent in stages
    ]
    text = page(rows, medians, first, runs=chosen.runs)
    print(text)
    if chosen.write:
        PAGE.write_text(text, encoding="utf-8")
    return 0


def page(
    rows: dict[str, Cost],
    stages: list[dict[str, float]],
    first: dict[str, tuple[Cost, Cost]],
    *,
    runs: int,
) -> str:
    """Text of the page: costs of whole commands, of their stages and of compiling.

    Parameters
    ----------
    rows
        Costs by what was analyzed; of two hours first, here and, if asked, at another commit.
    stages
        Processor seconds by stage, here and there.
    first
        Costs of a first and of a second run by command.
    runs
        Of two gyros, two hours.
    """
    units = [1e3 * cost.processor / cost.transforms for cost in rows.values()]
    lines = [
        "# The whole command",
        "",
        "`sagnac analyze` with its report, on recordings of the `paper` preset at 500 Hz, Parquet,",
        "gyros and encoder. A transform is `numpy.fft.rfft` of one channel of two hours, measured",
        f"before and after each run: {min(units):.0f} to {max(units):.0f} ms. Two gyros, 2 h:",
        f"median of {runs} runs; the others: one run "
        "(`python -m benchmarks.analysis --long --write`).",
        "",
        "| recording | processor, s | in transforms | wall, s | memory, MiB |",
        "|---|---|---|---|---|",
    ]
    lines += [
        f"| {name} | {cost.processor:.2f} | {cost.transforms:.0f} | {cost.wall:.2f} "
        f"| {cost.memory:.0f} |"
        for name, cost in rows.items()
    ]
    whole = list(rows.items())[: len(stages)]
    heads = [f"{name.removeprefix('two gyros, 2 h') or 'here'}, s" for name, _ in whole]
    lines += [
        "",
        "## Where the time goes",
        "",
        "Two gyros, two hours; processor seconds, medians, of a second analysis in one process.",
        "The rest of the command is start-up: modules and compiled loops are loaded.",
        "",
        f"| stage | {' | '.join(head.removeprefix(', ') for head in heads)} |",
        f"|---|{'---|' * len(heads)}",
    ]
    for name in stages[0]:
        shown = " | ".join(f"{one[name]:.2f}" for one in stages)
        lines.append(f"| {name} | {shown} |")
    rest = " | ".join(
        f"{cost.processor - sum(one.values()):.2f}"
        for (_, cost), one in zip(whole, stages, strict=True)
    )
    lines += [
        f"| start-up | {rest} |",
        "",
        "## The first run",
        "",
        "Loops are compiled when they are first asked for, and kept. Processor seconds, two",
        "hours of two gyros, each command with a report: `avar` at rest, `analyze` turning.",
        "",
        "| command | first | second | compiling |",
        "|---|---|---|---|",
    ]
    lines += [
        f"| `sagnac {name}` | {one.processor:.1f} | {two.processor:.1f} "
        f"| {one.processor - two.processor:.1f} |"
        for name, (one, two) in first.items()
    ]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    sys.exit(main())
