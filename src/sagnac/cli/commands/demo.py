"""``sagnac demo``: the paper's two-hour run, simulated and analyzed."""

import json
import time
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Final

from cyclopts import Parameter

from sagnac import overwriting
from sagnac.cli import output as results
from sagnac.cli import progress as progresses
from sagnac.cli.commands.simulate import changed
from sagnac.cli.errors import DONE
from sagnac.cli.options import Debug, Folder, Force

QUICK_S: Final = 900.0
RECORDING: Final = "recording.parquet"


def demo(
    *,
    output: Folder = None,
    quick: Annotated[
        bool, Parameter(negative="", show_default=False, help="A quarter of an hour only.")
    ] = False,
    seed: Annotated[int, Parameter(metavar="N", help="Of the simulation.")] = 1,
    force: Force = False,
    debug: Debug = False,
) -> int:
    """Simulate the paper's two-hour run, analyze it, print the ARW beside the truth."""
    del debug
    from sagnac.analysis.pipeline import analyze
    from sagnac.analysis.settings import Settings
    from sagnac.formats import read
    from sagnac.formats.metadata import of_simulation
    from sagnac.report import text
    from sagnac.rig.config import preset
    from sagnac.rig.sections import GYRO_NAMES
    from sagnac.rig.simulate import write

    config = changed(preset("paper"), seed=seed)
    if quick:
        config = replace(config, duration_s=QUICK_S)
    folder = output or Path("demo")
    results.require_writable(folder)
    for made in (of_simulation(folder / RECORDING), overwriting.of_report(folder)):
        overwriting.require_free(made, force=force)
    results.made(folder)
    began = time.perf_counter()
    with progresses.shown() as progress:
        path, truth_path = write(
            config, folder / RECORDING, lambda part: progress("simulate", part)
        )
        simulated = time.perf_counter()
        progress("read", 0.0)
        recording = read(path)
        read_s = time.perf_counter() - simulated
        analysis = analyze(recording, Settings(gyros=tuple(GYRO_NAMES)), progress=progress)
        analysis = analysis.with_seconds({"simulate": simulated - began, "read": read_s})
        progress("report", 0.0)
        results.ready_to_draw()
        from sagnac.report.folder import write_report

        written = write_report(analysis, folder, force=force)
    truth = json.loads(truth_path.read_text(encoding="utf-8"))
    put_in = float(truth["pairs"][analysis.channel]["arw_deg_per_sqrt_h"])
    print(text.answer(analysis))
    print(text.beside_truth(analysis, put_in), end="\n\n")
    results.print_paths([path, truth_path, *written.paths])
    print(text.seconds(written.analysis))
    return DONE
