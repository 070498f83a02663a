"""Gyros behind a low-pass of their own: is N still estimated, and does its interval hold it?

    python -m benchmarks.low_pass [--count N] [--seconds SECONDS]

The paper's rig on the table with every gyro behind a Butterworth low-pass, and a unit at rest whose
file has lost a hundred messages: three gyros at 200 Hz for three hours behind a low-pass of 40 Hz.
"""

import argparse
import csv
import math
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path
from typing import Final

import numpy as np
from scipy.signal import butter, sosfilt

from benchmarks.recording_lines import PAIR, true_value
from sagnac.analysis.pipeline import analyze, still_bench
from sagnac.analysis.settings import Settings
from sagnac.core.units import DEGREE_PER_ROOT_HOUR
from sagnac.formats import read
from sagnac.noise.estimates import Estimate
from sagnac.rig.config import preset
from sagnac.rig.simulate import simulate

# Corner, Hz, and order of the low-pass of the gyros on the table.
FILTERS: Final = ((50.0, 1), (10.0, 1), (2.0, 1), (2.0, 2))
# The unit at rest: samples a second, corner, Hz, messages lost, and N of each gyro, deg/s/sqrt(Hz).
RATE: Final = 200.0
CORNER: Final = 40.0
LOST: Final = 100
WALKS: Final = {"x": 0.005, "y": 0.004, "z": 0.007}


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """An answer beside the truth, rad/sqrt(s)."""

    name: str
    answer: Estimate
    truth: float

    @property
    def is_held(self) -> bool:
        return self.answer.low <= self.truth <= self.answer.high

    def __str__(self) -> str:
        ratios = [each / self.truth for each in (self.answer.low, self.answer.high)]
        return (
            f"{self.name:34s}  {self.answer.status:12s}  {self.answer.value / self.truth:.4f} "
            f"[{ratios[0]:.4f}, {ratios[1]:.4f}] of the truth  "
            f"{'holds' if self.is_held else 'DOES NOT HOLD'}"
        )


def on_the_table(seed: int, seconds: float) -> Iterator[Row]:
    """The pair x, z of the paper's rig behind each filter."""
    base = preset("paper")
    for corner, order in FILTERS:
        gyro = replace(base.gyro, low_pass_hz=(corner,) * 3, low_pass_order=order)
        config = replace(base, seed=seed, duration_s=seconds, gyro=gyro)
        simulation = simulate(config)
        found = analyze(simulation.recording, Settings(gyros=PAIR))
        yield Row(
            name=f"table, {corner:g} Hz, order {order}, seed {seed}",
            answer=found.angle_random_walk,
            truth=true_value(simulation.truth) * DEGREE_PER_ROOT_HOUR,
        )


def write_unit(path: Path, seed: int, seconds: float) -> None:
    """Stamps and rates of three gyros, with messages lost at random."""
    generator = np.random.default_rng([seed, 40])
    samples = round(seconds * RATE)
    sections = butter(2, CORNER, fs=RATE, output="sos")
    rates = [
        sosfilt(sections, walk * math.sqrt(0.5 * RATE) * generator.standard_normal(samples))
        for walk in WALKS.values()
    ]
    kept = np.ones(samples, dtype=bool)
    kept[generator.choice(np.arange(1, samples - 1), LOST, replace=False)] = False
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["t[s]", *(f"{name}[deg/s]" for name in WALKS)])
        for number in np.flatnonzero(kept):
            stamp = f"{number / RATE:.3f}"
            writer.writerow([stamp, *(f"{rate[number]:.9g}" for rate in rates)])


def at_rest_with_losses(seed: int, seconds: float) -> Iterator[Row]:
    """Each gyro of the unit at rest, read from its file."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "unit.csv"
        write_unit(path, seed, seconds)
        recording = read(path, kind="rate")
    for name, walk in WALKS.items():
        analysis, _ = still_bench(recording, Settings(gyros=(name,), interval=None))
        yield Row(
            name=f"at rest, {CORNER:g} Hz, {LOST} lost, {name}, seed {seed}",
            answer=analysis.angle_random_walk,
            # The density is one-sided: N is what is left of it on either side of zero.
            truth=math.radians(walk) / math.sqrt(2.0),
        )


def main(arguments: list[str]) -> None:
    """Every answer, a line each."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=1, help="seeds")
    parser.add_argument("--seconds", type=float, default=7200.0, help="on the table")
    parser.add_argument("--rest", type=float, default=10_800.0, help="s at rest")
    given, _ = parser.parse_known_args(arguments)
    rows: list[Row] = []
    for seed in range(given.count):
        for row in chain(on_the_table(seed, given.seconds), at_rest_with_losses(seed, given.rest)):
            rows.append(row)
            print(row, flush=True)
    print(f"{sum(row.is_held for row in rows)} of {len(rows)} intervals and bounds hold the truth")


if __name__ == "__main__":
    import sys

    main(sys.argv[1:])
