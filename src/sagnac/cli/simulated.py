"""``sagnac simulate``, ``demo`` and ``reproduce``: recordings of the simulated rig."""

import json
import time
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Final, Literal

from cyclopts import Parameter

import sagnac
from sagnac.cli import output as results
from sagnac.cli.options import OUTPUT, Debug, Duration, Folder, Force, Workers
from sagnac.cli.output import DONE, UsageError, as_usage, complain, print_paths, standings
from sagnac.core import overwriting
from sagnac.core.errors import one_line

# ---- simulate ----------------------------------------------------------------------


def simulate(
    config: Annotated[Path | None, Parameter(name="CONFIG.toml")] = None,
    /,
    *,
    output: Annotated[Path, Parameter(name=["-o", "--output"], group=OUTPUT, metavar="FILE")],
    preset: Annotated[Literal["quiet", "paper", "dithered", "harsh"] | None, Parameter()] = None,
    like: Annotated[Path | None, Parameter(metavar="ANALYSIS.json|DIR")] = None,
    kind: Annotated[Literal["angle", "increment", "rate"] | None, Parameter()] = None,
    seed: Annotated[int | None, Parameter(metavar="N")] = None,
    table_rate: Annotated[float | None, Parameter(metavar="DEG/S")] = None,
    duration: Duration = None,
    force: Force = False,
    debug: Debug = False,
) -> int:
    """Simulate a rig recording into FILE, its truth beside it as FILE.truth.json.

    Parameters
    ----------
    config
        What differs.
    output
        The recording; its suffix says the format: .csv, .parquet, .bag, .mcap, .euroc and others.
    preset
        What to start from without a CONFIG.toml: paper unless stated.
    like
        A unit with the noise, low-pass and readout that were measured; CONFIG.toml goes over it.
    kind
        Of the samples: that of CONFIG.toml, angle unless stated.
    seed
        Of every random stream.
    table_rate
        Rate of the table; 0 is at rest.
    """
    del debug
    if config is not None and preset is not None:
        raise UsageError("--preset and CONFIG.toml exclude each other; write preset in the TOML")
    if like is not None and preset is not None:
        raise UsageError("--preset and --like exclude each other; write what differs in a TOML")
    left_out: tuple[str, ...] = ()
    if like is None:
        chosen = _config(config, preset or "paper")
    else:
        chosen, left_out = _like(like, config)
    if table_rate is not None and chosen.table.profile:
        raise UsageError("--table-rate has no effect on a table.profile; remove one of them")
    from sagnac.formats.statement import of_simulation

    reads = [path for path in (config, like) if path is not None]
    overwriting.require_free(of_simulation(output), reads, force=force)
    chosen = changed(chosen, seed=seed, duration=duration, table_rate=table_rate)
    if kind is not None:
        chosen = replace(chosen, kind=kind)
    from sagnac.rig.simulate import write

    with results.progress_shown() as progress:
        path, truth_path = write(chosen, output, lambda part: progress("simulate", part))
    # Last: a refusal is not lost below a list.
    for line in left_out:
        print(one_line(line))
    print(f"{chosen.samples} samples at {chosen.sample_rate_hz:g} Hz, seed {chosen.seed}")
    print_paths([path, truth_path])
    return DONE


def changed(
    config: "sagnac.RigConfig",
    *,
    seed: int | None = None,
    duration: float | None = None,
    table_rate: float | None = None,
) -> "sagnac.RigConfig":
    """A configuration with what the options state instead.

    Raises
    ------
    UsageError
        If a value cannot be.
    """
    from sagnac.rig.sections import ConfigurationError

    option = ""
    try:
        if seed is not None:
            option = "--seed"
            config = replace(config, seed=seed)
        if duration is not None:
            option = "--duration"
            config = replace(config, duration_s=duration)
        if table_rate is not None:
            option = "--table-rate"
            config = replace(config, table=replace(config.table, rate_deg_per_s=table_rate))
    except ConfigurationError as error:
        raise UsageError(f"{option}: {error}") from None
    return config


def _config(path: Path | None, preset: str) -> "sagnac.RigConfig":
    from sagnac.rig.config import preset as preset_of

    if path is None:
        return preset_of(preset)
    try:
        return sagnac.RigConfig.from_toml(path)
    except ValueError as error:
        raise sagnac.RecordingError(str(error)) from None


def _like(path: Path, config: Path | None) -> "tuple[sagnac.RigConfig, tuple[str, ...]]":
    """The unit that an analysis measured, a TOML over it; and what is left out, in words."""
    from sagnac.core.documents import read_analyses
    from sagnac.core.errors import RecordingError
    from sagnac.rig.config import RigConfig
    from sagnac.rig.measured import Measured
    from sagnac.rig.sections import ConfigurationError

    documents = read_analyses(path)
    if len(documents) > 1:
        raise RecordingError(
            "holds several analyses", path=str(path), remedy="give that of one recording"
        )
    try:
        base = RigConfig.from_analysis(documents[0])
    except ConfigurationError as error:
        raise RecordingError(error.problem, path=str(path), remedy=error.remedy) from None
    chosen = base if config is None else RigConfig.from_toml(config, base)
    return chosen, tuple(Measured.of_document(documents[0]).left_out())


# ---- demo --------------------------------------------------------------------------

QUICK_S: Final = 900.0
RECORDING: Final = "recording.parquet"


def demo(
    *,
    output: Folder = None,
    quick: Annotated[bool, Parameter(negative="", show_default=False)] = False,
    seed: Annotated[int, Parameter(metavar="N")] = 1,
    force: Force = False,
    debug: Debug = False,
) -> int:
    """Simulate the paper's two-hour run, analyze it, print the ARW beside the truth.

    Parameters
    ----------
    quick
        A quarter of an hour only.
    seed
        Of the simulation.
    """
    del debug
    from sagnac.core.whole_files import made
    from sagnac.formats.statement import of_simulation
    from sagnac.recording.columns import GYRO_NAMES
    from sagnac.report import text
    from sagnac.rig.config import preset
    from sagnac.rig.simulate import write

    config = changed(preset("paper"), seed=seed)
    if quick:
        config = replace(config, duration_s=QUICK_S)
    folder = output or Path("demo")
    results.require_writable(folder)
    for one in (of_simulation(folder / RECORDING), overwriting.outputs_in(folder, "report")):
        overwriting.require_free(one, force=force)
    made(folder)
    began = time.perf_counter()
    with results.progress_shown() as progress:
        path, truth_path = write(
            config, folder / RECORDING, lambda part: progress("simulate", part)
        )
        simulated = time.perf_counter()
        progress("read", 0.0)
        recording = sagnac.read(path)
        read_s = time.perf_counter() - simulated
        analysis = sagnac.analyze(recording, gyros=tuple(GYRO_NAMES), progress=progress)
        analysis = analysis.with_seconds({"simulate": simulated - began, "read": read_s})
        progress("report", 0.0)
        results.ready_to_draw()
        written = sagnac.write_report(analysis, folder, force=force)
    truth = json.loads(truth_path.read_text(encoding="utf-8"))
    put_in = float(truth["pairs"][analysis.channel]["arw_deg_per_sqrt_h"])
    print(text.answer(analysis))
    print(text.beside_truth(analysis, put_in), end="\n\n")
    results.print_paths([path, truth_path, *written.paths])
    print(text.seconds(written.analysis))
    return DONE


# ---- reproduce ---------------------------------------------------------------------


def reproduce(
    *,
    output: Folder = None,
    quick: Annotated[bool, Parameter(negative="", show_default=False)] = False,
    workers: Workers = None,
    force: Force = False,
    debug: Debug = False,
) -> int:
    """The paper's Figures 1 to 6 and Tables 1 and 2 on the simulated rig, truth beside.

    Page, pictures and tables go into DIR, by default reproduction. Started again in the
    same folder it goes on where it stopped. Several processes work side by side, a recording each.

    Parameters
    ----------
    quick
        Tables of half an hour, not 2 h.
    """
    del debug
    folder = output or Path("reproduction")
    results.require_writable(folder)
    overwriting.require_free(overwriting.outputs_in(folder, "reproduction"), force=force)
    results.ready_to_draw()
    from sagnac.core.processes import means_of
    from sagnac.core.whole_files import made
    from sagnac.paper import page as pages
    from sagnac.paper.prediction import QUICK, Scope
    from sagnac.paper.reproduce import reproduce as make
    from sagnac.paper.tables import summary

    with as_usage():
        means = means_of(workers)
    try:
        found = make(made(folder), QUICK if quick else Scope(), means=means, told=standings())
    except KeyboardInterrupt:
        complain(f"stopped; start it again with the same folder, and it goes on ({folder})")
        raise
    written = pages.write(found, folder)
    print(summary(found), end="\n\n")
    print(f"{found.computed} of {len(found.outcomes)} runs made, the others were there")
    results.print_paths(written)
    return DONE
