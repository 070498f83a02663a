"""``sagnac simulate``, ``demo`` and ``reproduce``: recordings of the simulated rig."""

import json
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Final, Literal

from cyclopts import Parameter

import sagnac
from sagnac.cli import options as typed
from sagnac.cli import output as results
from sagnac.cli.options import Debug, Folder, Force, Workers, one_argument
from sagnac.core import errors, overwriting, texts, whole_files

# ---- simulate ----------------------------------------------------------------------


@Parameter(name="*")
@dataclass(frozen=True, slots=True, kw_only=True)
class RigOptions:
    """What of a rig differs.

    Attributes
    ----------
    kind
        Of the samples: that of CONFIG.toml, angle unless stated.
    seed
        Seed of all random streams.
    table_rate
        Rate of the table; 0 is at rest.
    duration
        Length of the recording; s unless stated.
    """

    kind: Literal["angle", "increment", "rate"] | None = None
    seed: Annotated[int | None, one_argument(texts.whole_number, "N")] = None
    table_rate: Annotated[float | None, Parameter(metavar="DEG/S")] = None
    duration: Annotated[float | None, one_argument(texts.seconds, "2h")] = None

    def applied_to(self, config: "sagnac.RigConfig") -> "sagnac.RigConfig":
        """A configuration with what the options state instead.

        Raises
        ------
        UsageError
            If a value cannot be.
        """
        from sagnac.rig.sections import ConfigurationError, overlaid

        if self.table_rate is not None and config.table.profile:
            problem = "--table-rate has no effect on a table.profile; remove one of them"
            raise results.UsageError(problem)
        keys = {"duration": "duration_s", "table_rate": "rate_deg_per_s"}
        for name in ("kind", "seed", "duration", "table_rate"):
            if getattr(self, name) is None:
                continue
            change = {keys.get(name, name): getattr(self, name)}
            try:
                config = overlaid(config, {"table": change} if name == "table_rate" else change)
            except ConfigurationError as error:
                raise results.UsageError(f"--{name.replace('_', '-')}: {error}") from None
        return config


AS_IT_IS: Final = RigOptions()


def simulate(
    config: Annotated[Path | None, Parameter(name="CONFIG.toml")] = None,
    /,
    *,
    output: typed.NeededFile,
    preset: Literal["quiet", "paper", "dithered", "harsh"] | None = None,
    like: Annotated[Path | None, Parameter(metavar="ANALYSIS.json|DIR")] = None,
    options: RigOptions = AS_IT_IS,
    force: Force = False,
    debug: Debug = False,
) -> None:
    """Simulate a rig recording into FILE, its truth beside it as FILE.truth.json.

    Parameters
    ----------
    config
        Keys that differ from the preset.
    output
        The recording; its suffix says the format: .csv, .parquet, .bag, .mcap, .euroc and others.
    preset
        What to start from without a CONFIG.toml: paper unless stated.
    like
        A unit with the noise, low-pass and readout that were measured; CONFIG.toml goes over it.
    """
    if preset is not None and (config is not None or like is not None):
        other, remedy = "CONFIG.toml", "write preset in the TOML"
        if like is not None:
            other, remedy = "--like", "write what differs in a TOML"
        raise results.UsageError(f"--preset and {other} exclude each other; {remedy}")
    from sagnac.formats.statement import of_simulation
    from sagnac.rig import config as rigs

    left_out: tuple[str, ...] = ()
    chosen = rigs.preset(preset or "paper")
    if like is not None:
        chosen, left_out = _like(like)
    if config is not None:
        chosen = sagnac.RigConfig.from_toml(config, None if like is None else chosen)
    reads = [path for path in (config, like) if path is not None]
    overwriting.require_free(of_simulation(output), reads, force=force)
    chosen = options.applied_to(chosen)
    path, truth_path = _written(chosen, output)
    # Last: a refusal is not lost below a list.
    for line in left_out:
        print(errors.one_line(line))
    print(f"{chosen.samples} samples at {chosen.sample_rate_hz:g} Hz, seed {chosen.seed}")
    results.print_paths([path, truth_path])


def _written(config: "sagnac.RigConfig", path: Path) -> tuple[Path, Path]:
    """The recording of a rig, and its truth."""
    from sagnac.rig.simulate import write

    with results.progress_shown() as progress:
        return write(config, path, lambda part: progress("simulate", part))


def _like(path: Path) -> "tuple[sagnac.RigConfig, tuple[str, ...]]":
    """The unit that an analysis measured; and what is left out of it, in words."""
    from sagnac.core.documents import read_one_analysis
    from sagnac.formats.files import about
    from sagnac.rig.measured import Measured

    document = read_one_analysis(path)
    with about(path):
        base = sagnac.RigConfig.from_analysis(document)
    return base, tuple(Measured.of_document(document).left_out())


# ---- demo --------------------------------------------------------------------------

QUICK_S: Final = 900.0
RECORDING: Final = "recording.parquet"


def demo(
    *,
    output: Folder = None,
    quick: bool = False,
    seed: Annotated[int, one_argument(texts.whole_number, "N")] = 1,
    force: Force = False,
    debug: Debug = False,
) -> None:
    """Simulate the paper's two-hour run, analyze it, print the ARW beside the truth.

    Parameters
    ----------
    output
        Folder: demo unless stated.
    quick
        A quarter of an hour only.
    seed
        Of the simulation.
    """
    from sagnac.formats.statement import of_simulation
    from sagnac.recording.columns import GYRO_NAMES
    from sagnac.report import text
    from sagnac.rig.config import preset

    config = RigOptions(seed=seed, duration=QUICK_S if quick else None).applied_to(preset("paper"))
    folder = output or Path("demo")
    results.require_place(folder, "report", force=force)
    overwriting.require_free(of_simulation(folder / RECORDING), force=force)
    whole_files.made(folder)
    began = time.perf_counter()
    path, truth_path = _written(config, folder / RECORDING)
    seconds = {"simulate": time.perf_counter() - began}
    with typed.reading(path, typed.NO_STATEMENT) as read:
        analysis = read.analyzed(sagnac.Settings(gyros=tuple(GYRO_NAMES))).with_seconds(seconds)
    analysis, paths = results.reported(analysis, folder, force=force)
    truth = json.loads(truth_path.read_text(encoding="utf-8"))
    put_in = float(truth["pairs"][analysis.channel]["arw_deg_per_sqrt_h"])
    print(text.answer(analysis))
    print(text.beside_truth(analysis, put_in), end="\n\n")
    results.print_paths([path, truth_path, *paths])
    print(text.seconds(analysis))


# ---- reproduce ---------------------------------------------------------------------


def reproduce(
    *,
    output: Folder = None,
    quick: bool = False,
    workers: Workers = None,
    force: Force = False,
    debug: Debug = False,
) -> None:
    """The paper's Figures 1 to 6 and Tables 1 and 2 on the simulated rig, truth beside.

    Page, pictures and tables go into DIR, by default reproduction. Started again in the
    same folder it goes on where it stopped. Several processes work side by side, a recording each.

    Parameters
    ----------
    quick
        Tables of half an hour, not 2 h.
    """
    folder = output or Path("reproduction")
    results.require_place(folder, "reproduction", force=force)
    from sagnac.core.processes import means_of
    from sagnac.paper import page as pages
    from sagnac.paper.prediction import QUICK, Scope
    from sagnac.paper.reproduce import reproduce as make
    from sagnac.paper.tables import summary

    scope, means = QUICK if quick else Scope(), means_of(workers)
    with results.resumable(folder):
        result = make(whole_files.made(folder), scope, means=means, told=results.standings())
    written = pages.write(result, folder)
    print(summary(result), end="\n\n")
    print(f"{result.computed} of {len(result.outcomes)} runs made, the others were there")
    results.print_paths(written)


COMMANDS: Final = (simulate, demo, reproduce)
