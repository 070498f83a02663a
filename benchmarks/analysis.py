"""`sagnac analyze` on two hours at 500 Hz, in units of one Fourier transform of one channel.

The unit is the processor time of ``numpy.fft.rfft`` of as many samples, measured in the same run
before and after the commands, so that the figures hold on any machine. Beside it: where the time
goes, three gyros, longer recordings, and the first run of a fresh installation, which compiles.

    python -m benchmarks.analysis [--program PATH] [--long] [--write]
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
    """Processor seconds, wall seconds and MiB at most of one run of a command."""

    processor: float
    wall: float
    memory: float


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


def cost_of(command: list[str], **environment: str) -> Cost:
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
    done = subprocess.run(
        [sys.executable, "-c", measured, *command],
        check=True,
        capture_output=True,
        text=True,
        env={**os.environ, **environment},
    )
    processor, wall, memory = map(float, done.stdout.split())
    return Cost(processor=processor, wall=wall, memory=memory)


def median_of(costs: list[Cost]) -> Cost:
    """Median times, and the most memory."""
    return Cost(
        processor=float(np.median([cost.processor for cost in costs])),
        wall=float(np.median([cost.wall for cost in costs])),
        memory=max(cost.memory for cost in costs),
    )


def simulated(program: str, folder: Path, duration: str, *more: str) -> Path:
    """A recording of the preset `paper`, turning unless `more` options say otherwise.

    Raises
    ------
    subprocess.CalledProcessError
        If it cannot be made.
    """
    path = folder / f"{duration}.parquet"
    command = [program, "simulate", "--preset", "paper", "--duration", duration, "-o", str(path)]
    subprocess.run(
        [*command, *more, "--force"],
        check=True,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    return path


def stages_of(report: Path) -> dict[str, float]:
    """Wall seconds of each stage of an analysis, start-up and writing left out."""
    document = json.loads((report / "analysis.json").read_text(encoding="utf-8"))
    return {str(name): float(seconds) for name, seconds in document["seconds"].items()}


def first_runs(program: str, folder: Path) -> dict[str, tuple[Cost, Cost]]:
    """Each command with nothing compiled before, and again: name -> both costs."""
    found = {}
    for name, rate in (("avar", ("--table-rate", "0")), ("analyze", ())):
        recording = simulated(program, folder, "2h", *rate)
        command = [program, name, str(recording), "--gyros", "x,z", "-o", str(folder / name)]
        place = str(folder / f"compiled-{name}")
        found[name] = (
            cost_of(command, NUMBA_CACHE_DIR=place),
            cost_of(command, NUMBA_CACHE_DIR=place),
        )
    return found


def main(arguments: list[str] | None = None) -> int:
    """Print the figures, and write the page if asked."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--program", default=str(Path(sys.executable).with_name("sagnac")))
    parser.add_argument("--long", action="store_true", help="24 hours as well")
    parser.add_argument("--write", action="store_true", help="write the page")
    chosen = parser.parse_args(arguments)
    rows: dict[str, Cost] = {}
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        report = folder / "report"

        def command(recording: Path, gyros: str) -> list[str]:
            words = [chosen.program, "analyze", str(recording), "--gyros", gyros]
            return [*words, "-o", str(report), "--force"]

        recording = simulated(chosen.program, folder, "2h")
        cost_of(command(recording, "x,z"))  # compiles what is not compiled yet
        before = transform_seconds()
        costs, stages = [], []
        for _ in range(RUNS):
            costs.append(cost_of(command(recording, "x,z")))
            stages.append(stages_of(report))
        unit = 0.5 * (before + transform_seconds())
        rows["two gyros, 2 h"] = median_of(costs)
        first = first_runs(chosen.program, folder)
        for name, (duration, gyros, is_long) in OTHERS.items():
            if is_long and not chosen.long:
                continue
            recording = simulated(chosen.program, folder, duration)
            rows[name] = cost_of(command(recording, gyros))
            recording.unlink()
    text = page(unit, rows, stages, first)
    print(text)
    if chosen.write:
        PAGE.write_text(text, encoding="utf-8")
    return 0


def page(
    unit: float,
    rows: dict[str, Cost],
    stages: list[dict[str, float]],
    first: dict[str, tuple[Cost, Cost]],
) -> str:
    """Text of the page: costs of whole commands, of their stages and of compiling.

    Parameters
    ----------
    unit
        Processor seconds of one transform.
    rows
        Costs by what was analyzed.
    stages
        Seconds by stage, of each run of the first row.
    first
        Costs of a first and of a second run by command.
    """
    lines = [
        "# The whole command",
        "",
        "`sagnac analyze` with its report, on recordings of the `paper` preset at 500 Hz, Parquet,",
        "gyros and encoder. A transform is `numpy.fft.rfft` of one channel of two hours, measured",
        f"in the same run: {1e3 * unit:.1f} ms. First row: median of {RUNS} runs; the others: one",
        "run (`python -m benchmarks.analysis --long --write`).",
        "",
        "| recording | processor, s | in transforms | wall, s | memory, MiB |",
        "|---|---|---|---|---|",
    ]
    lines += [
        f"| {name} | {cost.processor:.2f} | {cost.processor / unit:.0f} | {cost.wall:.2f} "
        f"| {cost.memory:.0f} |"
        for name, cost in rows.items()
    ]
    lines += [
        "",
        "## Where the time goes",
        "",
        "Two gyros, two hours; wall seconds, medians. The rest is start-up.",
        "",
        "| stage | s | in transforms |",
        "|---|---|---|",
    ]
    for name in stages[0]:
        seconds = float(np.median([one[name] for one in stages]))
        lines.append(f"| {name} | {seconds:.2f} | {seconds / unit:.0f} |")
    lines += [
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
