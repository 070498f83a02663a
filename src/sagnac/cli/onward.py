"""``sagnac export`` and ``align``: what an analysis means for a filter and for heading."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

import sagnac
from sagnac import overwriting
from sagnac.cli import output as results
from sagnac.cli.options import (
    Debug,
    Folder,
    Force,
    Json,
    angle,
    one_argument,
    several_seconds,
    turn_rate,
)
from sagnac.cli.output import DONE, UsageError, print_paths, require_writable
from sagnac.errors import one_line
from sagnac.filters.definitions import ToolName
from sagnac.texts import names, seconds

if TYPE_CHECKING:
    from sagnac.alignment.align import Prospect, Triad, Unaided


# ---- export ------------------------------------------------------------------------


def export(
    analyses: Annotated[list[Path] | None, Parameter(name="ANALYSIS|DIR")] = None,
    /,
    *,
    output: Annotated[Path, Parameter(name=["-o", "--output"], metavar="FILE")],
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
    rate: Annotated[float | None, Parameter(metavar="HZ")] = None,
    confidence: Annotated[float, Parameter(metavar="0.95")] = 0.95,
    markov: Annotated[Literal[0, 1, 2] | None, Parameter()] = None,
    topic: Annotated[str | None, Parameter(metavar="/imu0")] = None,
    accelerometer: Annotated[str | None, Parameter(metavar="DENSITY,WALK")] = None,
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

    Parameters
    ----------
    analyses
        analysis.json, one or more; a folder that analyze, avar or campaign wrote.
    output
        File to write.
    rate
        Update rate of the discrete form: that of the recording unless stated; px4 100.
    confidence
        That the model lies above the sensor's Allan deviation.
    markov
        Markov rates of the full model (toml, json) at most: 2 unless stated.
    topic
        ROS topic of the IMU: /imu0 unless stated.
    accelerometer
        Of accelerometers that were not measured, m/s^2/sqrt(Hz) and m/s^3/sqrt(Hz).
    """
    del debug
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
    made = sagnac.export(
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


# ---- align -------------------------------------------------------------------------


def align(
    source: Annotated[
        Path,
        Parameter(
            name="ANALYSIS.json|DIR",
            help="An analysis.json or the folder of its report; or a campaign (its folder or "
            "campaign.csv), which foretells N.",
        ),
    ],
    /,
    *,
    latitude: Annotated[float | None, Parameter(metavar="DEG")] = None,
    time: Annotated[float, one_argument(seconds, metavar="10min")] = 600.0,
    azimuth: Annotated[float | None, one_argument(angle, metavar="2deg")] = None,
    tilt: Annotated[float | None, one_argument(angle, metavar="0.5deg")] = None,
    bias: Annotated[
        float | None,
        one_argument(
            turn_rate,
            metavar="3deg/h",
            help="What is not known of a gyro's bias, 1 sigma: unless stated what the rest leaves, "
            "and 0 for gyrocompass and filter.",
        ),
    ] = None,
    table_rate: Annotated[float | None, Parameter(metavar="DEG/S")] = None,
    after: Annotated[tuple[float, ...], one_argument(several_seconds, metavar="60s,10min")] = (
        60.0,
        600.0,
        3600.0,
    ),
    confidence: Annotated[float, Parameter(metavar="0.95")] = 0.95,
    output: Folder = None,
    as_json: Json = False,
    force: Force = False,
    debug: Debug = False,
) -> int:
    """Heading, attitude and position without aiding, and azimuth found, from N, B and K.

    With -o, alignment.json, drift.png and, with --latitude, alignment.png go into DIR.

    Parameters
    ----------
    latitude
        -89 to 89; without it, no azimuth is found.
    time
        Length of the alignment, at rest; the biases are taken from it.
    azimuth
        Not known of the azimuth at the start, 1 sigma: 2deg.
    tilt
        Not known of each tilt at the start, 1 sigma: 0.5deg.
    table_rate
        Of a table that turns all the time, for a triad that turns.
    after
        Heading, attitude and position these times without aiding: 1min,10min,1h.
    confidence
        Of the interval.
    as_json
        JSON, nothing else.
    """
    del debug
    if table_rate is not None and latitude is None:
        raise UsageError("--table-rate needs --latitude, since azimuth is found from Earth rate")
    results.require_writable(output)
    if output is not None:
        overwriting.require_free(overwriting.outputs_in(output, "alignment"), [source], force=force)
    results.ready_to_draw()
    from sagnac.units import DEGREE

    noises, words = _source(source, confidence)
    found = sagnac.align(
        noises,
        latitude=None if latitude is None else latitude * DEGREE,
        rest=time,
        azimuth=azimuth,
        tilt=tilt,
        bias=bias,
        table_rate=None if table_rate is None else table_rate * DEGREE,
        after=after,
        confidence=confidence,
        foretold=words,
    )
    _show(found.unaided, found.prospect, words, output, as_json=as_json)
    return DONE


def _source(source: Path, confidence: float) -> "tuple[Path | Triad, str]":
    """An analysis as it is; or N that a campaign foretells, and in words from what."""
    if (source / "campaign.csv").exists() or source.suffix.lower() == ".csv":
        from sagnac.fleet.table import prior_of

        prior = prior_of(source, confidence=confidence)
        return (prior.noise, prior.noise, prior.noise), prior.words
    return source, ""


def _show(
    unaided: "Unaided",
    prospect: "Prospect | None",
    words: str,
    output: Path | None,
    *,
    as_json: bool,
) -> None:
    """Prints the answer, and writes it into a folder if one is named."""
    from sagnac.formats.files import made, write_text
    from sagnac.report import alignment as shown
    from sagnac.report.document import to_json
    from sagnac.report.figures import write_png

    found = {} if prospect is None else shown.prospect_document(prospect)
    notes = [*found.pop("notes", [words] if words else []), *shown.drift_notes(unaided)]
    text = to_json(
        {
            "schema": shown.SCHEMA,
            **found,
            **shown.drift_document(unaided),
            "notes": list(dict.fromkeys(notes)),
        }
    )
    if as_json:
        print(text)
    else:
        if prospect is not None:
            print(shown.prospect_text(prospect))
        elif words:
            print(words)
        print(shown.drift_text(unaided))
    if output is not None:
        folder = made(output)
        paths = [folder / "alignment.json", folder / "drift.png"]
        write_text(paths[0], text + "\n")
        write_png(shown.drift_figure(unaided), paths[1])
        if prospect is not None:
            paths.append(folder / "alignment.png")
            write_png(shown.azimuth_figure(prospect), paths[-1])
        if not as_json:
            results.print_paths(paths)
