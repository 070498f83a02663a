"""Stability curves beside allantools, and their cost against the number of samples.

The same rates and the same clusters, in one process on one thread, the two libraries in
turn, medians of five. Ours includes the noise types, degrees of freedom and intervals.
"""

import argparse
import contextlib
import io
import os
import platform
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import allantools
import numba
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from sagnac import deviation_at_every_tau, stability_curve
from sagnac.core import arrays
from sagnac.stability import Estimator

PAGE = Path(__file__).parents[1] / "docs" / "benchmarks_stability.md"
FIGURE = PAGE.with_name("cost_stability.png")
COST_HEADING = "## Cost against the number of samples"
REPEATS = 5
LONG, SHORT = 3_600_000, 3_600
DAY = 43_200_000  # at 500 Hz: not held in memory
LARGEST = {"oadev": 2, "mdev": 3, "ohdev": 3, "totdev": 1, "mtotdev": 3, "theo1": 1}
FAST: tuple[Estimator, ...] = ("oadev", "mdev", "ohdev", "totdev")
SLOW: tuple[Estimator, ...] = ("mtotdev", "theo1")


def rates(samples: int) -> NDArray[np.float64]:
    return np.random.default_rng(1).standard_normal(samples)


def clusters(estimator: Estimator, samples: int, points: int) -> NDArray[np.float64]:
    first = 10 if estimator == "theo1" else 1
    grid = np.geomspace(first, (samples - 1) // LARGEST[estimator], points)
    if estimator == "theo1":
        return np.unique(2.0 * np.floor(grid / 2.0))
    return np.unique(np.floor(grid))


def ours(values: NDArray[np.float64], estimator: Estimator, taus: NDArray[np.float64]) -> None:
    stability_curve(values, kind="rate", sample_rate=1.0, estimator=estimator, taus=taus)


def theirs(values: NDArray[np.float64], estimator: Estimator, taus: NDArray[np.float64]) -> None:
    with contextlib.redirect_stdout(io.StringIO()):
        getattr(allantools, estimator)(values, rate=1.0, data_type="freq", taus=taus)


def seconds(call: Callable[..., object], *arguments: object) -> float:
    start = time.perf_counter()
    call(*arguments)
    return time.perf_counter() - start


def beside(estimator: Estimator, samples: int, points: int, bar: int) -> str:
    values, taus = rates(samples), clusters(estimator, samples, points)
    ours(values[:500], estimator, clusters(estimator, 500, 5))
    pairs = [
        (seconds(ours, values, estimator, taus), seconds(theirs, values, estimator, taus))
        for _ in range(REPEATS)
    ]
    our, their = (statistics.median(column) for column in zip(*pairs, strict=True))
    return (
        f"| {estimator} | {samples:.1e} | {taus.size} | {our:.4f} | {their:.3f} "
        f"| {their / our:.1f} | {bar} |"
    )


def every_cluster() -> list[str]:
    """All N/2 cluster times: seconds beside one transform, and the largest departure."""
    values = rates(LONG)
    every, transform = (
        statistics.median(seconds(call, values) for _ in range(3))
        for call in (
            lambda values: deviation_at_every_tau(values, kind="rate", sample_rate=1.0),
            np.fft.rfft,
        )
    )
    _, deviation = deviation_at_every_tau(values, kind="rate", sample_rate=1.0)
    angle = np.concatenate([[0.0], np.cumsum(values - values.mean())])
    departures = []
    for m in np.random.default_rng(2).integers(1, deviation.size + 1, 200):
        direct = angle[2 * m :] - 2.0 * angle[m:-m] + angle[: -2 * m]
        departures.append(abs(deviation[m - 1] / np.sqrt(np.mean(direct**2) / 2.0 / m**2) - 1.0))
    taus = clusters("oadev", LONG, 60)
    one = seconds(theirs, values, "oadev", taus) / taus.size
    return [
        "| samples | clusters | `deviation_at_every_tau` | one `numpy.fft.rfft` | ratio "
        "| `allantools.oadev`, extrapolated | largest departure from the direct sums |",
        "|---|---|---|---|---|---|---|",
        f"| {LONG:.1e} | {deviation.size} | {every:.2f} | {transform:.3f} "
        f"| {every / transform:.0f} | {one * deviation.size:.0f} | {max(departures):.1e} |",
    ]


def peak_above_data(estimator: Estimator, samples: int) -> float:
    """MB above the array of values, in a process of its own."""
    command = [sys.executable, "-m", "benchmarks.stability", "--memory", estimator, str(samples)]
    return float(subprocess.run(command, check=True, capture_output=True, text=True).stdout)


def print_memory(estimator: Estimator, samples: int) -> None:
    ours(rates(1000), estimator, clusters(estimator, 1000, 5))
    generator = np.random.default_rng(1)
    values = arrays.empty(samples)
    for block in arrays.blocks(samples):
        values[block] = generator.standard_normal(block.stop - block.start)
    taus = clusters(estimator, samples, 60)
    before = peak_memory()
    ours(values, estimator, taus)
    print(peak_memory() - before)


def peak_memory() -> float:
    """MB at most so far. Not getrusage, whose figure a process inherits from its parent."""
    status = Path("/proc/self/status").read_text(encoding="ascii")
    line = next(line for line in status.splitlines() if line.startswith("VmHWM:"))
    return int(line.split()[1]) * 1024 / 1e6


def cost(estimator: Estimator, samples: int) -> float:
    values, taus = rates(samples), clusters(estimator, samples, 60)
    ours(values[:500], estimator, clusters(estimator, 500, 5))
    repeats = REPEATS if samples <= 1e6 and estimator in FAST else 1
    return statistics.median(seconds(ours, values, estimator, taus) for _ in range(repeats))


def report(largest: int) -> str:
    lines = [
        "# Stability curves: speed and memory",
        "",
        f"`python -m benchmarks.stability --write`; {platform.machine()}, {os.cpu_count()} cores, "
        f"one thread, Python {platform.python_version()}, numpy {np.__version__}, "
        f"numba {numba.__version__}, allantools {allantools.__version__}; white rates, seed 1.",
        "",
        "## Beside allantools",
        "",
        f"Seconds, medians of {REPEATS}, the two in turn in one process. Ours includes noise "
        "types, degrees of freedom and intervals.",
        "",
        "| estimator | samples | clusters | ours | allantools | ratio | bar |",
        "|---|---|---|---|---|---|---|",
    ]
    lines += [beside(name, LONG, 60, 10 if name == "totdev" else 8) for name in FAST]
    lines += [beside(name, SHORT, 8, 100) for name in SLOW]
    lines += [
        "",
        "## Every cluster time",
        "",
        "Seconds for all N/2 clusters, medians of 3; allantools by its time for 57 clusters; the "
        "departure at 200 random ones.",
        "",
        *every_cluster(),
        "",
        "## Peak memory above the values",
        "",
        f"MB; beyond {arrays.IN_MEMORY:.1e} samples values and angles lie in scratch files, and "
        "`mtotdev`, `theo1` and `theoh`, whose longest windows are the whole record, are not in "
        "bounded memory.",
        "",
        f"| estimator | {LONG:.1e} samples | {DAY:.1e} samples |",
        "|---|---|---|",
    ]
    for name in FAST:
        peaks = [f"{peak_above_data(name, samples):.0f}" for samples in (LONG, DAY)]
        lines.append(f"| {name} | {' | '.join(peaks)} |")
    sizes = [10**k for k in range(4, 9) if 10**k <= largest]
    lines += [
        "",
        COST_HEADING,
        "",
        f"![Seconds against samples, by estimator]({FIGURE.name})",
        "",
        "Seconds for 60 log-spaced clusters up to the longest. Above some 10 000 samples "
        "`mtotdev` and `theo1` average every k-th window, as the notes of their curves state. "
        "Dotted in the figure: in proportion to the samples, through the last of `oadev`.",
        "",
        "| samples | " + " | ".join((*FAST, *SLOW)) + " |",
        "|---|" + "---|" * len((*FAST, *SLOW)),
    ]
    for size in sizes:
        names = (*FAST, *SLOW) if size <= 1e7 else FAST
        cells = [f"{cost(name, size):.4f}" if name in names else "–" for name in (*FAST, *SLOW)]
        lines.append(f"| {size:.0e} | " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def cost_table(text: str) -> tuple[list[str], NDArray[np.float64]]:
    """Names of the columns and (sizes, columns) seconds, NaN where not measured; sizes first."""
    rows = [
        [cell.strip() for cell in line.strip("|").split("|")]
        for line in text.partition(COST_HEADING)[2].splitlines()
        if line.startswith("|")
    ]
    cells = [[float("nan") if cell == "–" else float(cell) for cell in row] for row in rows[2:]]
    return rows[0], np.array(cells)


def draw_cost(text: str, target: Path) -> None:
    """Figure of the cost table in `text`; written whole or not at all."""
    names, table = cost_table(text)
    samples = table[:, 0]
    figure = Figure(figsize=(6.4, 4.2), layout="constrained")
    axes = figure.subplots()
    for name, seconds_taken, marker in zip(names[1:], table[:, 1:].T, "os^Dvx", strict=True):
        axes.loglog(samples, seconds_taken, marker=marker, linewidth=1.2, label=name)
    allan = table[:, names.index("oadev")]
    linear = allan[-1] * samples / samples[-1]
    axes.loglog(samples, linear, color="0.4", linestyle=":", label="∝ samples")
    axes.set_xlabel("samples")
    axes.set_ylabel("seconds for 60 clusters")
    axes.grid(which="major", color="0.9")
    axes.legend(frameon=False, ncols=2)
    draft = target.with_suffix(".part")
    figure.savefig(draft, format="png", dpi=150)
    os.replace(draft, target)


def main(arguments: list[str]) -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.stability", description=__doc__)
    parser.add_argument("--write", action="store_true", help=f"write {PAGE.name} and its figure")
    parser.add_argument("--figure", action="store_true", help=f"draw what {PAGE.name} says again")
    parser.add_argument("--largest", type=float, default=1e7, help="samples, up to 1e8")
    parser.add_argument("--memory", nargs=2, metavar=("ESTIMATOR", "SAMPLES"))
    options = parser.parse_args(arguments)
    if options.memory:
        print_memory(options.memory[0], int(options.memory[1]))
        return
    if options.figure:
        draw_cost(PAGE.read_text(encoding="utf-8"), FIGURE)
        return
    text = report(int(options.largest))
    print(text)
    if options.write:
        draw_cost(text, FIGURE)
        draft = PAGE.with_suffix(".part")
        draft.write_text(text, encoding="utf-8")
        os.replace(draft, PAGE)


if __name__ == "__main__":
    main(sys.argv[1:])
