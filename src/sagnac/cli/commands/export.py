"""``sagnac export``: an analysis as the settings of a filter."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final, Literal

from cyclopts import Parameter

from sagnac import __version__
from sagnac.cli import outputs
from sagnac.cli.errors import UsageError
from sagnac.cli.options import Debug, Force, names
from sagnac.cli.output import print_paths, require_writable
from sagnac.errors import one_line

if TYPE_CHECKING:
    from sagnac.filters.exports import Wanted
    from sagnac.filters.settings import FilterSetting

FormatName = Literal[
    "kalibr", "allan-variance-ros", "openvins", "gtsam", "robot-localization", "px4", "toml", "json"
]
# Format by how the name of the file ends.
_SUFFIXES: "Final[dict[str, FormatName]]" = {
    ".yaml": "kalibr",
    ".yml": "kalibr",
    ".py": "gtsam",
    ".params": "px4",
    ".toml": "toml",
    ".json": "json",
}
# Formats that hold a noise for each axis.
_EACH: "Final[tuple[FormatName, ...]]" = ("gtsam", "robot-localization", "toml", "json")


def export(
    analyses: Annotated[list[Path], Parameter(name="ANALYSIS", help="analysis.json, one or more.")],
    /,
    *,
    output: Annotated[
        Path, Parameter(name=["-o", "--output"], metavar="FILE", help="File to write.")
    ],
    format_name: Annotated[
        FormatName | None,
        Parameter(
            name="--format",
            help="Tool; by the file's name unless stated: .yaml kalibr, .py gtsam, .params px4, "
            ".toml, .json.",
        ),
    ] = None,
    axes: Annotated[
        Literal["worst", "each"] | None,
        Parameter(help="The worst gyro alone or each; each unless the tool has one noise for all."),
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
        Parameter(metavar="0.95", help="That the model lies above the gyro's Allan deviation."),
    ] = 0.95,
    markov: Annotated[
        Literal[0, 1, 2], Parameter(help="Markov rates of the full model (toml, json) at most.")
    ] = 2,
    topic: Annotated[str, Parameter(metavar="/imu0", help="ROS topic of the IMU.")] = "/imu0",
    accelerometer: Annotated[
        str | None,
        Parameter(
            metavar="DENSITY,WALK",
            help="Of the accelerometers, m/s^2/sqrt(Hz) and m/s^3/sqrt(Hz), which are not measured "
            "here.",
        ),
    ] = None,
    force: Force = False,
    debug: Debug = False,
) -> None:
    """Filter settings of an analysis: Kalibr, OpenVINS, GTSAM, PX4 and others.

    Each is a model whose Allan deviation lies above the upper confidence limit of the curve.
    """
    del debug
    chosen = format_name or _format_of(output)
    stated = None if accelerometer is None else _accelerometer(accelerometer)
    require_writable(output.parent)
    outputs.require_free(outputs.of_export(output, chosen), analyses, force=force)
    from sagnac.filters.exports import Wanted

    wanted = Wanted(
        settings=_settings(analyses, confidence, markov),
        each=chosen in _EACH if axes is None else axes == "each",
        rate=rate,
        topic=topic,
        accelerometer=stated,
        version=__version__,
    )
    _write(output, chosen, wanted)


def _format_of(output: Path) -> FormatName:
    """The format that the name of a file tells."""
    chosen = _SUFFIXES.get(output.suffix.lower())
    if chosen is None:
        raise UsageError(f"{output}: its name tells no format; give --format")
    return chosen


def _settings(analyses: list[Path], confidence: float, markov: int) -> "tuple[FilterSetting, ...]":
    """The models of all gyros of some analyses."""
    from sagnac.filters.sensors import sensors_in
    from sagnac.filters.settings import setting_of

    sensors = [sensor for path in analyses for sensor in sensors_in(path)]
    return tuple(
        setting_of(sensor, confidence=confidence, most_markov=markov) for sensor in sensors
    )


def _write(output: Path, chosen: FormatName, wanted: "Wanted") -> None:
    """The settings into a file, and what they say in words onto the terminal."""
    from sagnac.filters.exports import exported
    from sagnac.report.files import write_text

    write_text(output, exported(chosen, wanted))
    for setting in wanted.chosen:
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
