"""What a graphics processor could take over from `sagnac analyze`, and what its start costs.

Two hours of two gyros are analyzed on the processor and profiled: the time in Fourier transforms
and in sums over unequally spaced angles is all that a library for graphics processors (cuFFT,
cuFINUFFT) could take. Beside it: what loading CuPy and opening the device cost, and a transform
there, with the copies to and fro.

    python -m benchmarks.gpu [--write]
"""

import argparse
import cProfile
import platform
import pstats
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from typing import Final

import numpy as np

import sagnac
from benchmarks._made import here, made_page, with_stamp

PAGE: Final = made_page("benchmarks_gpu.md")
SAMPLES: Final = 3_600_000
RUNS: Final = 7
# What is counted of a profile -> parts of the names of its files and functions.
TAKEN: Final = {
    "Fourier transforms": ("/fft/", "fft."),
    "sums over angles": ("/spectrum/sums.py", "table_gathered", "table_evaluated", "nufft"),
}
OPENED: Final = """
import time; began = time.perf_counter(), time.process_time()
import cupy
cupy.fft.rfft(cupy.zeros(1024)); cupy.cuda.Device().synchronize()
print(time.perf_counter() - began[0], time.process_time() - began[1])
print(cupy.cuda.runtime.getDeviceProperties(0)["name"].decode())
"""


def analyzed() -> tuple[float, dict[str, float]]:
    """Processor seconds of a second analysis, and of what is counted of it."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "pair.parquet"
        command = [sys.executable, "-m", "sagnac", "simulate", "-o", str(path), "--seed", "1"]
        subprocess.run(command, check=True, capture_output=True)
        recording = sagnac.read(path, gyros=["x", "z"])
    sagnac.analyze(recording)
    began = time.process_time()
    sagnac.analyze(recording)
    seconds = time.process_time() - began
    profile = cProfile.Profile()
    profile.runcall(sagnac.analyze, recording)
    rows = pstats.Stats(profile).stats.items()
    own = [(f"{file} {name}", row[2]) for (file, _, name), row in rows]
    parts = {
        what: sum(time for name, time in own if any(part in name for part in parts))
        for what, parts in TAKEN.items()
    }
    return seconds, parts


def median_seconds(action: Callable[[], object]) -> float:
    """Median wall time of several calls, s, after one that is not counted."""
    action()
    times = []
    for _ in range(RUNS):
        began = time.perf_counter()
        action()
        times.append(time.perf_counter() - began)
    return float(np.median(times))


def page() -> str:
    """The page, measured here."""
    import cupy  # noqa: PLC0415  (only where there is a device)

    answer = subprocess.run([sys.executable, "-c", OPENED], check=True, capture_output=True)
    times, device = answer.stdout.decode().splitlines()
    wall, processor = (float(value) for value in times.split())
    seconds, parts = analyzed()
    values = np.random.default_rng(1).standard_normal(SAMPLES)
    there = cupy.asarray(values)
    synchronize = cupy.cuda.Device().synchronize

    def resident() -> None:
        cupy.fft.rfft(there)
        synchronize()

    def copied() -> None:
        cupy.asnumpy(cupy.fft.rfft(cupy.asarray(values)))

    transforms = {
        "`numpy.fft.rfft`": median_seconds(lambda: np.fft.rfft(values)),
        "CuPy, values copied there, spectrum copied back": median_seconds(copied),
        "CuPy, all of it there": median_seconds(resident),
    }
    taken = sum(parts.values())
    lines = [
        "# A graphics processor",
        "",
        "All of sagnac runs on the processor. What a graphics processor could take over of "
        "`sagnac analyze`,",
        f"two hours of two gyros ({platform.processor() or platform.machine()}, {device}; "
        "`python -m benchmarks.gpu --write`):",
        "",
        "| of a second analysis in one process | processor, s |",
        "|---|---|",
        f"| all of it | {seconds:.2f} |",
        *(f"| {what} | {value:.2f} |" for what, value in parts.items()),
        "",
        "| what a graphics processor adds | wall, s | processor, s |",
        "|---|---|---|",
        f"| loading CuPy and opening the device | {wall:.2f} | {processor:.2f} |",
        "",
        "| a transform of one channel, 3.6 M samples | wall, ms |",
        "|---|---|",
        *(f"| {what} | {1e3 * value:.2f} |" for what, value in transforms.items()),
        "",
        f"If all that could be taken cost nothing there, {100.0 * taken / seconds:.0f} % of the "
        f"analysis ({taken:.2f} s) would be saved,",
        f"and {processor:.2f} s of processor spent on the start.",
        "",
    ]
    return "\n".join(lines)


def main(arguments: list[str]) -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--write", action="store_true", help="write the page")
    given = parser.parse_args(arguments)
    if find_spec("cupy") is None:
        print("gpu: CuPy is not installed, nothing is measured")
        return
    text = page()
    if given.write:
        PAGE.path.write_text(with_stamp(text, PAGE.digest, here()), encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main(sys.argv[1:])
