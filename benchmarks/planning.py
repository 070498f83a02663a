"""Interval of N that a tenth of a rig recording foretells, beside that of the whole.

Run as ``python -m benchmarks.planning``.
"""

import argparse
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

from sagnac.analysis.forecast import shown_by
from sagnac.analysis.pipeline import analyze
from sagnac.analysis.settings import Settings
from sagnac.formats import read
from sagnac.rig.config import preset
from sagnac.rig.simulate import write
from sagnac.specification.planning import Shown


def shown(path: Path, seconds: float) -> Shown:
    """What the beginning of a recording shows of N of a pair."""
    return shown_by(analyze(read(path, span=(0.0, seconds)), Settings(gyros=("x", "z"))))


def main(arguments: list[str]) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=2, help="recordings")
    parser.add_argument("--seconds", type=float, default=3000.0, help="length of each")
    stated, _ = parser.parse_known_args(arguments)
    print("seed  tenth: ± now  ± foretold  whole: ± found  foretold/found")
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(stated.count):
            path = Path(folder) / f"run{seed}.parquet"
            config = replace(preset("paper"), seed=seed, duration_s=stated.seconds)
            write(config, path, None)
            early, whole = shown(path, 0.1 * stated.seconds), shown(path, stated.seconds)
            foretold = early.expected(whole.duration)
            print(
                f"{seed:4d}  {100.0 * early.half_width:10.2f} %  {100.0 * foretold:9.2f} %  "
                f"{100.0 * whole.half_width:12.2f} %  {foretold / whole.half_width:14.3f}",
                flush=True,
            )


if __name__ == "__main__":
    main(sys.argv[1:])
