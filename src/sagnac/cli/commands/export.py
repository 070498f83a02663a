"""``sagnac export``: an analysis as the settings of a filter."""

from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from sagnac.cli.errors import UsageError
from sagnac.cli.options import Debug, Force, names
from sagnac.cli.output import print_paths, require_writable
from sagnac.errors import one_line
from sagnac.filters.definitions import ToolName


def export(
    analyses: Annotated[
        list[Path] | None,
        Parameter(
            name="ANALYSIS|DIR",
            help="analysis.json, one or more; a folder that analyze, avar or campaign wrote.",
        ),
    ] = None,
    /,
    *,
    output: Annotated[
        Path, Parameter(name=["-o", "--output"], metavar="FILE", help="File to write.")
    ],
    format_name: Annotated[
        ToolName | None,
        Parameter(
            name="--format",
            help="Tool; by the file's name unless stated: .yaml kalibr, .py gtsam, .m psins, "
            ".params px4, .sdf gazebo, .toml, .json.",
        ),
    ] = None,
    axes: Annotated[
        Literal["worst", "each"] | None,
        Parameter(
            help="One noise that covers all axes or each its own; each unless the tool has one "
            "noise for all."
        ),
    ] = None,
    rate: Annotated[
        float | None,
        Parameter(
            metavar="HZ",
            help="Update rate of the discrete form: that of the recording unless stated; px4 100.",
        ),
    ] = None,
    confidence: Annotated[
        float,
        Parameter(metavar="0.95", help="That the model lies above the sensor's Allan deviation."),
    ] = 0.95,
    markov: Annotated[
        Literal[0, 1, 2] | None,
        Parameter(
            help="Markov rates of the full model (toml, json) at most: 2 unless stated.",
        ),
    ] = None,
    topic: Annotated[
        str | None, Parameter(metavar="/imu0", help="ROS topic of the IMU: /imu0 unless stated.")
    ] = None,
    accelerometer: Annotated[
        str | None,
        Parameter(
            metavar="DENSITY,WALK",
            help="Of accelerometers that were not measured, m/s^2/sqrt(Hz) and m/s^3/sqrt(Hz).",
        ),
    ] = None,
    datasheet: Annotated[
        list[str] | None,
        Parameter(
            metavar="N=…,B=…@TIME",
            help="What a data sheet states, once for gyros and once for accelerometers: "
            "N=0.004deg/s/sqrt(Hz),B=2deg/h@100s,bandwidth=40Hz,range=450deg/s",
        ),
    ] = None,
    force: Force = False,
    debug: Debug = False,
) -> None:
    """Filter settings of an analysis: Kalibr, OpenVINS, GTSAM, PX4 and others.

    Each is a model whose Allan deviation lies above the upper confidence limit of the curve, of
    gyros and of accelerometers. What a data sheet states is taken as it stands, and marked so.
    """
    del debug
    from sagnac.filters.export import export as made_of
    from sagnac.filters.export import require_used, tool_of

    given = {"rate": rate, "markov": markov, "topic": topic, "accelerometer": accelerometer}
    try:
        chosen = format_name or tool_of(output)
    except ValueError:
        raise UsageError(f"{output}: its name tells no format; give --format") from None
    try:
        require_used(chosen, given)
    except ValueError as error:
        raise UsageError(f"--{error}") from None
    stated = None if accelerometer is None else _accelerometer(accelerometer)
    if not analyses and stated is None and not datasheet:
        raise UsageError("give an analysis.json, or what a data sheet states with --datasheet")
    require_writable(output.parent)
    made = made_of(
        analyses or (), output, tool=chosen, axes=axes, rate=rate, confidence=confidence,
        markov=markov, topic=topic, accelerometer=stated, datasheet=datasheet or (), force=force,
    )  # fmt: skip
    for setting in made.settings:
        print(one_line(setting.in_words()))
    print_paths([output])


def _accelerometer(text: str) -> tuple[float, float]:
    try:
        density, walk = (float(part) for part in names(text))
    except ValueError:
        raise UsageError(
            f"--accelerometer {text}: give noise density and random walk, such as 2e-3,3e-3"
        ) from None
    return density, walk
