"""Throughput of a campaign on two workers beside two single recordings side by side.

Run as ``python -m benchmarks.campaign``; it needs two cores that do nothing else.
"""

import argparse
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

from sagnac.rig.config import preset
from sagnac.rig.simulate import write


def recordings(folder: Path, count: int, seconds: float) -> list[Path]:
    """Rig recordings of the paper's kind."""
    paths = []
    for seed in range(count):
        path = folder / f"run{seed}.parquet"
        write(replace(preset("paper"), seed=seed, duration_s=seconds), path, None)
        paths.append(path)
    return paths


def campaign_seconds(paths: list[Path], output: Path) -> float:
    """Wall time of a campaign on two workers, with the start of its processes."""
    command = [sys.executable, "-m", "sagnac", "campaign", *map(str, paths)]
    began = time.perf_counter()
    subprocess.run(
        [*command, "-o", str(output), "--gyros", "x,z", "--workers", "2"],
        check=True,
        capture_output=True,
    )
    return time.perf_counter() - began


def side_by_side_seconds(paths: list[Path], output: Path) -> float:
    """Wall time of two single analyses at once, for each pair of recordings."""
    began = time.perf_counter()
    for first, second in zip(paths[::2], paths[1::2], strict=True):
        running = [
            subprocess.Popen(
                [sys.executable, "-m", "sagnac", "analyze", str(path), "--gyros", "x,z", "-o",
                 str(output / path.stem)],
                stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
            )
            for path in (first, second)
        ]  # fmt: skip
        for one in running:
            one.wait()
    return time.perf_counter() - began


def main(arguments: list[str]) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=8, help="recordings, an even number")
    parser.add_argument("--seconds", type=float, default=1800.0, help="length of each")
    stated, _ = parser.parse_known_args(arguments)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        paths = recordings(folder, stated.count, stated.seconds)
        single = side_by_side_seconds(paths, folder / "single")
        together = campaign_seconds(paths, folder / "campaign")
    print(f"{stated.count} recordings of {stated.seconds:g} s")
    print(f"two single analyses side by side   {single:7.1f} s")
    print(f"campaign on two workers            {together:7.1f} s")
    print(f"throughput                         {100.0 * single / together:7.0f} %")


if __name__ == "__main__":
    main(sys.argv[1:])
