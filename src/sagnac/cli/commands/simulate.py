"""``sagnac simulate``: a recording of the simulated rig."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from sagnac import overwriting
from sagnac.cli import progress as progresses
from sagnac.cli.errors import DONE, UsageError
from sagnac.cli.options import OUTPUT, Debug, Duration, Force
from sagnac.cli.output import print_paths

if TYPE_CHECKING:
    from sagnac.rig.config import RigConfig


def simulate(
    config: Annotated[Path | None, Parameter(name="CONFIG.toml", help="What differs.")] = None,
    /,
    *,
    output: Annotated[
        Path,
        Parameter(name=["-o", "--output"], group=OUTPUT, metavar="FILE", help="The recording."),
    ],
    preset: Annotated[
        Literal["quiet", "paper", "dithered", "harsh"] | None,
        Parameter(help="What to start from without a CONFIG.toml: paper unless stated."),
    ] = None,
    like: Annotated[
        Path | None,
        Parameter(
            metavar="ANALYSIS.json|DIR",
            help="A unit with the Q, N, B, K and R that were measured; CONFIG.toml goes over it.",
        ),
    ] = None,
    kind: Annotated[
        Literal["angle", "increment", "rate"] | None,
        Parameter(help="Of the samples: that of CONFIG.toml, angle unless stated."),
    ] = None,
    seed: Annotated[int | None, Parameter(metavar="N", help="Of every random stream.")] = None,
    table_rate: Annotated[
        float | None, Parameter(metavar="DEG/S", help="Rate of the table; 0 is at rest.")
    ] = None,
    duration: Duration = None,
    force: Force = False,
    debug: Debug = False,
) -> int:
    """Simulate a rig recording into FILE, its truth beside it as FILE.truth.json."""
    del debug
    if config is not None and preset is not None:
        raise UsageError("--preset and CONFIG.toml exclude each other; write preset in the TOML")
    if like is not None and preset is not None:
        raise UsageError("--preset and --like exclude each other; write what differs in a TOML")
    chosen = _config(config, preset or "paper") if like is None else _like(like, config)
    if table_rate is not None and chosen.table.profile:
        raise UsageError("--table-rate has no effect on a table.profile; remove one of them")
    from sagnac.formats.metadata import of_simulation

    reads = [path for path in (config, like) if path is not None]
    overwriting.require_free(of_simulation(output), reads, force=force)
    chosen = changed(chosen, seed=seed, duration=duration, table_rate=table_rate)
    if kind is not None:
        chosen = replace(chosen, kind=kind)
    from sagnac.rig.simulate import write

    with progresses.shown() as progress:
        path, truth_path = write(chosen, output, lambda part: progress("simulate", part))
    print(f"{chosen.samples} samples at {chosen.sample_rate_hz:g} Hz, seed {chosen.seed}")
    print_paths([path, truth_path])
    return DONE


def changed(
    config: "RigConfig",
    *,
    seed: int | None = None,
    duration: float | None = None,
    table_rate: float | None = None,
) -> "RigConfig":
    """A configuration with what the options state instead.

    Raises
    ------
    UsageError
        If a value cannot be.
    """
    from sagnac.rig.validation import ConfigurationError

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


def _config(path: Path | None, preset: str) -> "RigConfig":
    from sagnac.errors import RecordingError
    from sagnac.rig.config import RigConfig
    from sagnac.rig.config import preset as preset_of

    if path is None:
        return preset_of(preset)
    try:
        return RigConfig.from_toml(path)
    except ValueError as error:
        raise RecordingError(str(error)) from None


def _like(path: Path, config: Path | None) -> "RigConfig":
    """The unit that an analysis measured, a TOML over it; says what is left out."""
    from sagnac.documents import read_analyses
    from sagnac.errors import RecordingError, one_line
    from sagnac.rig.config import RigConfig
    from sagnac.rig.measured import Measured
    from sagnac.rig.validation import ConfigurationError

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
    for line in Measured.of_document(documents[0]).left_out():
        print(one_line(line))
    return chosen
