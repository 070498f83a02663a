"""Interval of N that a tenth of a recording foretells, beside that of the whole.

Run as ``python -m benchmarks.planning``; ``--scene`` chooses what is recorded. ``found`` is the
half width of the answer of the whole recording, and ``by`` what that answer rests on.
"""

import argparse
import statistics
import sys
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from sagnac.analysis.pipeline import analyze
from sagnac.analysis.planning import short_recording
from sagnac.analysis.result import Analysis
from sagnac.analysis.settings import Settings
from sagnac.formats import read
from sagnac.rig.config import RigConfig, preset
from sagnac.rig.simulate import write

PAIR: Final = Settings(gyros=("x", "z"))
STILL: Final = Settings(gyros=("x",), method="none")


@dataclass(frozen=True, slots=True, kw_only=True)
class Scene:
    """What is recorded, and how it is analyzed."""

    config: Callable[[], RigConfig]
    settings: Settings


def _rate_biased() -> RigConfig:
    """Ring lasers with lock-in, which the table keeps them out of."""
    base = preset("paper")
    return replace(base, gyro=replace(base.gyro, mode="rate-biased"))


def _still() -> RigConfig:
    """White rate and a rate random walk that takes over below 0.01 Hz, at rest, read out finely."""
    base = preset("quiet")
    return replace(
        base,
        table=replace(base.table, rate_deg_per_s=0.0),
        gyro=replace(
            base.gyro,
            quantization_step_arcsec=(0.0, 0.0, 0.0),
            rate_random_walk_deg_per_h_per_sqrt_h=(5e-3, 5e-3, 5e-3),
        ),
    )


SCENES: Final[Mapping[str, Scene]] = {
    "table": Scene(config=lambda: preset("paper"), settings=PAIR),
    "rate-biased": Scene(config=_rate_biased, settings=PAIR),
    "still": Scene(config=_still, settings=STILL),
}


def beginning(path: Path, seconds: float, settings: Settings) -> Analysis:
    """The analysis of the beginning of a recording."""
    return analyze(read(path, span=(0.0, seconds)), settings)


def row(path: Path, seconds: float, settings: Settings) -> tuple[str, float]:
    """One line of the table, and the width foretold over that found."""
    early = short_recording(beginning(path, 0.1 * seconds, settings))
    analysis = beginning(path, seconds, settings)
    whole = short_recording(analysis)
    foretold = early.expected(whole.duration)
    choice = "" if analysis.average is None else analysis.average.member
    supposed = "whole band" if early.efficient else "average"
    ratio = foretold / whole.half_width
    text = (
        f"{100.0 * early.half_width:10.2f} %  {100.0 * foretold:9.2f} %  {supposed:<10}  "
        f"{100.0 * whole.half_width:7.2f} %  {choice:<10}  {ratio:14.3f}"
    )
    return text, ratio


def main(arguments: list[str]) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scene", choices=sorted(SCENES), default="table")
    parser.add_argument("--first", type=int, default=0, help="seed of the first recording")
    parser.add_argument("--count", type=int, default=2, help="recordings")
    parser.add_argument("--seconds", type=float, default=3000.0, help="length of each")
    stated, _ = parser.parse_known_args(arguments)
    scene = SCENES[stated.scene]
    print(f"{stated.scene}, {stated.seconds:g} s")
    print("seed  tenth: ± now   foretold  supposing        found  by          foretold/found")
    ratios = []
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(stated.first, stated.first + stated.count):
            path = Path(folder) / f"run{seed}.parquet"
            write(replace(scene.config(), seed=seed, duration_s=stated.seconds), path, None)
            text, ratio = row(path, stated.seconds, scene.settings)
            ratios.append(ratio)
            print(f"{seed:4d}  {text}", flush=True)
            path.unlink()
    near = sum(0.9 <= ratio <= 1.1 for ratio in ratios)
    print(f"median {statistics.median(ratios):.3f}; within 10 %: {near} of {len(ratios)}")


if __name__ == "__main__":
    main(sys.argv[1:])
