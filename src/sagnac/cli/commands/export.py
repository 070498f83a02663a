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
    from collections.abc import Mapping

    from sagnac.filters.exports import Wanted
    from sagnac.filters.settings import FilterSetting

FormatName = Literal[
    "kalibr", "allan-variance-ros", "openvins", "gtsam", "robot-localization", "ros-imu",
    "imu-tools", "px4", "kf-gins", "psins", "toml", "json",
]  # fmt: skip
# Format by how the name of the file ends.
_SUFFIXES: "Final[dict[str, FormatName]]" = {
    ".yaml": "kalibr",
    ".yml": "kalibr",
    ".py": "gtsam",
    ".m": "psins",
    ".params": "px4",
    ".toml": "toml",
    ".json": "json",
}


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
        FormatName | None,
        Parameter(
            name="--format",
            help="Tool; by the file's name unless stated: .yaml kalibr, .py gtsam, .m psins, "
            ".params px4, .toml, .json.",
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
    chosen = format_name or _format_of(output)
    _require_used(
        chosen, {"rate": rate, "markov": markov, "topic": topic, "accelerometer": accelerometer}
    )
    stated = [] if accelerometer is None else [_accelerometer(accelerometer)]
    stated += [_of_datasheet(text) for text in datasheet or ()]
    if not analyses and not stated:
        raise UsageError("give an analysis.json, or what a data sheet states with --datasheet")
    require_writable(output.parent)
    outputs.require_free(outputs.of_export(output, chosen), analyses or (), force=force)
    from sagnac.filters.definitions import definition_of
    from sagnac.filters.exports import Wanted

    settings = _settings(analyses or [], stated, confidence, 2 if markov is None else markov)
    if not any(one.kind == "gyro" for one in settings):
        raise UsageError("no gyro; give an analysis of one, or its data sheet with --datasheet")
    wanted = Wanted(
        settings=tuple(one for one in settings if one.kind == "gyro"),
        accelerometers=tuple(one for one in settings if one.kind == "accelerometer"),
        each=(
            definition_of(chosen).axes != "one" and chosen != "openvins"
            if axes is None
            else axes == "each"
        ),
        rate=rate,
        topic=topic or "/imu0",
        version=__version__,
    )
    _write(output, chosen, wanted)


def _require_used(chosen: FormatName, given: "Mapping[str, object]") -> None:
    """Refuse an option that the format cannot use, with the reason."""
    from sagnac.filters.definitions import definition_of

    definition = definition_of(chosen)
    for option, value in given.items():
        if value is not None and option in definition.unused:
            raise UsageError(
                f"--{option} has no effect on {definition.tool}: {definition.unused[option]}; "
                "leave it out"
            )


def _format_of(output: Path) -> FormatName:
    """The format that the name of a file tells."""
    chosen = _SUFFIXES.get(output.suffix.lower())
    if chosen is None:
        raise UsageError(f"{output}: its name tells no format; give --format")
    return chosen


def _settings(
    analyses: list[Path], stated: "list[FilterSetting]", confidence: float, markov: int
) -> "list[FilterSetting]":
    """The models of all sensors of some analyses, and those that were stated."""
    from sagnac.filters.sensors import sensors_in
    from sagnac.filters.settings import setting_of

    sensors = [sensor for path in analyses for sensor in sensors_in(path)]
    kinds = [*(sensor.kind for sensor in sensors), *(one.kind for one in stated)]
    for one in stated:
        if kinds.count(one.kind) > 1:
            raise UsageError(
                f"{one.source}: another noise of the {one.kind}s is there; leave one of them out"
            )
    return [
        *(setting_of(sensor, confidence=confidence, most_markov=markov) for sensor in sensors),
        *stated,
    ]


def _write(output: Path, chosen: FormatName, wanted: "Wanted") -> None:
    """The settings into a file, and what they say in words onto the terminal."""
    from sagnac.filters.definitions import definition_of
    from sagnac.filters.exports import exported
    from sagnac.report.files import write_text

    write_text(output, exported(chosen, wanted))
    holds = "accelerometer" not in definition_of(chosen).unused
    for setting in (*wanted.chosen, *(wanted.forces if holds else ())):
        print(one_line(setting.in_words()))
    print_paths([output])


def _accelerometer(text: str) -> "FilterSetting":
    from sagnac.filters.settings import FilterSetting
    from sagnac.filters.state_space import FilterModel

    try:
        density, walk = (float(part) for part in names(text))
        model = FilterModel(white=density, walk=walk)
    except ValueError:
        raise UsageError(
            f"--accelerometer {text}: give noise density and random walk, such as 2e-3,3e-3"
        ) from None
    return FilterSetting(
        name="accelerometer",
        kind="accelerometer",
        simple=model,
        full=model,
        source=f"--accelerometer {text} (stated, not measured)",
    )


def _of_datasheet(text: str) -> "FilterSetting":
    from sagnac.filters.datasheet import datasheet_setting

    return datasheet_setting(text)
