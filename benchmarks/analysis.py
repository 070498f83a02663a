"""`sagnac analyze` on two hours at 500 Hz, in units of one Fourier transform of one channel.

The unit is the processor time of ``numpy.fft.rfft`` of as many samples, measured in the same run
before and after the command, so that the figure holds on any machine.

    python -m benchmarks.analysis [--program PATH] [--recording FILE] [--write]
"""

import argparse
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
RUNS: Final = 3


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


def cost_of(command: list[str]) -> Cost:
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
        [sys.executable, "-c", measured, *command], check=True, capture_output=True, text=True
    )
    processor, wall, memory = map(float, done.stdout.split())
    return Cost(processor=processor, wall=wall, memory=memory)


def main(arguments: list[str] | None = None) -> int:
    """Print the figures, and write the page if asked."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--program", default=str(Path(sys.executable).with_name("sagnac")))
    parser.add_argument("--recording", type=Path)
    parser.add_argument("--write", action="store_true")
    chosen = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as folder:
        recording = chosen.recording
        if recording is None:
            recording = Path(folder) / "two-hours.parquet"
            subprocess.run(
                [chosen.program, "simulate", "--preset", "paper", "-o", str(recording)],
                check=True,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
            )
        command = [chosen.program, "analyze", str(recording), "--gyros", "x,z"]
        command += ["-o", str(Path(folder) / "report")]
        cost_of(command)  # compiles what is not compiled yet
        before = transform_seconds()
        costs = [cost_of(command) for _ in range(RUNS)]
        unit = 0.5 * (before + transform_seconds())
    processor = float(np.median([cost.processor for cost in costs]))
    wall = float(np.median([cost.wall for cost in costs]))
    memory = max(cost.memory for cost in costs)
    lines = [
        f"processor time: {processor:.2f} s, {processor / unit:.0f} transforms of one channel",
        f"one transform: {1e3 * unit:.1f} ms",
        f"wall time: {wall:.2f} s",
        f"memory: {memory:.0f} MiB at most",
    ]
    print("\n".join(lines))
    if chosen.write:
        text = (
            "# The whole command\n\n"
            "`sagnac analyze` with its report, on two hours at 500 Hz: two gyros and the encoder\n"
            f"of the `paper` preset, Parquet. Median of {RUNS} runs, beside `numpy.fft.rfft` of\n"
            "one channel in the same run (`python -m benchmarks.analysis --write`).\n\n"
            + "".join(f"- {line}\n" for line in lines)
        )
        PAGE.write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
