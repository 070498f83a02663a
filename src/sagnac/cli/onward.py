"""``sagnac export``, ``align`` and ``campaign``: figures used, and many recordings at once."""

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any, Final, Literal

from cyclopts import Group, Parameter

import sagnac
from sagnac.cli import options as typed
from sagnac.cli import output as results
from sagnac.core import errors, overwriting, texts, whole_files
from sagnac.navigation.definitions import ToolName

# ---- export ------------------------------------------------------------------------

_densities = typed.one_argument(typed.two_numbers, "DENSITY,WALK")


@Parameter(name="*")
@dataclass(frozen=True, slots=True, kw_only=True)
class FilterOptions:
    """Choices of the settings of a filter.

    Attributes
    ----------
    tool
        Tool; by the file's name unless stated: .yaml kalibr, .py gtsam, .m psins, .params px4,
        .sdf gazebo, .toml, .json.
    axes
        One noise that covers all axes or each its own; each unless the tool has one noise for all.
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
    datasheet
        What a data sheet states, once for gyros and once for accelerometers:
        N=0.004deg/s/sqrt(Hz),B=2deg/h@100s,bandwidth=40Hz,range=450deg/s
    """

    tool: Annotated[ToolName | None, Parameter(name="--format")] = None
    axes: Literal["worst", "each"] | None = None
    rate: Annotated[float | None, Parameter(metavar="HZ")] = None
    confidence: Annotated[float, Parameter(metavar="0.95")] = 0.95
    markov: Literal[0, 1, 2] | None = None
    topic: Annotated[str | None, Parameter(metavar="/imu0")] = None
    accelerometer: Annotated[tuple[float, float] | None, _densities] = None
    datasheet: Annotated[tuple[str, ...], Parameter(metavar="N=…,B=…@TIME")] = ()


NO_CHOICE: Final = FilterOptions()


def export(
    analyses: Annotated[list[Path] | None, Parameter(name="ANALYSIS|DIR")] = None,
    /,
    *,
    output: Annotated[Path, typed.one_argument(typed.path, "FILE", name=["-o", "--output"])],
    options: FilterOptions = NO_CHOICE,
    force: typed.Force = False,
    debug: typed.Debug = False,
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
    """
    if not (analyses or options.accelerometer or options.datasheet):
        problem = "give an analysis.json, or what a data sheet states with --datasheet"
        raise results.UsageError(problem)
    made = sagnac.export(analyses or (), output, **asdict(options), force=force)
    for setting in made.settings:
        print(errors.one_line(setting.in_words()))
    for note in made.notes:
        print(errors.one_line(f"{note.level}: {note}"))
    results.print_paths([output])


# ---- align -------------------------------------------------------------------------

_duration = typed.one_argument(texts.seconds, "10min", name="--time", show_default=False)
_times = typed.one_argument(typed.several(texts.seconds), "60s,10min", show_default=False)


@Parameter(name="*")
@dataclass(frozen=True, slots=True, kw_only=True)
class StartOptions:
    """The alignment, and what follows without aiding.

    Attributes
    ----------
    latitude
        -89 to 89; without it no azimuth is found, and drift is that at 45 degrees.
    rest
        Length of the alignment, at rest: 10min unless stated; the biases are taken from it.
    azimuth
        Uncertainty of the azimuth at the start, 1 sigma: 2deg unless stated.
    tilt
        Uncertainty of each tilt at the start, 1 sigma: 0.5deg unless stated.
    bias
        What is not known of a gyro's bias, 1 sigma: unless stated what the rest leaves, and 0 for
        gyrocompass and filter.
    table_rate
        Of a table that turns all the time, for a triad that turns.
    after
        Heading, attitude and position these times without aiding: 1min,10min,1h unless stated.
    confidence
        Of the interval.
    """

    latitude: Annotated[float | None, typed.one_argument(typed.degrees, "DEG")] = None
    rest: Annotated[float, _duration] = 600.0
    azimuth: Annotated[float | None, typed.one_argument(typed.angle, "2deg")] = None
    tilt: Annotated[float | None, typed.one_argument(typed.angle, "0.5deg")] = None
    bias: Annotated[float | None, typed.one_argument(typed.turn_rate, "3deg/h")] = None
    table_rate: Annotated[float | None, typed.one_argument(typed.degrees, "DEG/S")] = None
    after: Annotated[tuple[float, ...], _times] = (60.0, 600.0, 3600.0)
    confidence: Annotated[float, Parameter(metavar="0.95")] = 0.95


NO_START: Final = StartOptions()


def align(
    source: Annotated[Path, Parameter(name="ANALYSIS.json|DIR")],
    /,
    *,
    start: StartOptions = NO_START,
    output: typed.Folder = None,
    as_json: typed.Json = False,
    force: typed.Force = False,
    debug: typed.Debug = False,
) -> None:
    """Heading, attitude and position without aiding, and azimuth found, from N, B and K.

    With -o, alignment.json, drift.png and, with --latitude, alignment.png go into DIR.

    Parameters
    ----------
    source
        An analysis.json or the folder of its report; or a campaign (its folder or campaign.csv),
        which foretells N.
    as_json
        JSON, nothing else.
    """
    if start.table_rate is not None and start.latitude is None:
        problem = "--table-rate needs --latitude, since azimuth is found from Earth rate"
        raise results.UsageError(problem)
    results.require_place(output, "alignment", [source], force=force)
    results.ready_to_draw()
    from sagnac.report import alignment as shown
    from sagnac.report.document import to_json
    from sagnac.report.figures import write_png

    noises: Any = source
    words = ""
    if (source / "campaign.csv").exists() or source.suffix.lower() == ".csv":
        from sagnac.fleet.table import prior_of

        noise, words = prior_of(source, confidence=start.confidence)
        noises = (noise, noise, noise)
    ahead = sagnac.align(noises, **asdict(start), foretold=words)
    unaided, prospect = ahead.unaided, ahead.prospect
    found = {} if prospect is None else shown.prospect_document(prospect)
    notes = [*found.pop("notes", [words] if words else []), *shown.drift_notes(unaided)]
    document = {"schema": shown.SCHEMA, **found, **shown.drift_document(unaided)}
    document["notes"] = list(dict.fromkeys(notes))
    if as_json:
        print(to_json(document))
    else:
        found_text = words if prospect is None else shown.prospect_text(prospect)
        results.show(found_text, shown.drift_text(unaided), end="\n")
    if output is not None:
        names = ["alignment.json", "drift.png"]
        own = overwriting.outputs_in(output, "alignment")
        with whole_files.replacing_folder(output, lambda: overwriting.earlier_files(own)) as folder:
            whole_files.write_text(folder / names[0], to_json(document) + "\n")
            write_png(shown.drift_figure(unaided), folder / names[1])
            if prospect is not None:
                names.append("alignment.png")
                write_png(shown.azimuth_figure(prospect), folder / names[-1])
        if not as_json:
            results.print_paths([output / name for name in names])


# ---- campaign ----------------------------------------------------------------------


@Parameter(name="*", group=Group("Work", sort_key=2))
@dataclass(frozen=True, slots=True, kw_only=True)
class WorkOptions:
    """How the work of a campaign is divided.

    Attributes
    ----------
    pattern
        Finds `(?P<unit>…)`, `(?P<day>…)` and `(?P<rate>…)` in the path of a recording.
    span
        Also cut each recording into spans of this length: N against time.
    scheduler
        Of a Dask cluster, tcp://host:8786, to work on.
    """

    pattern: Annotated[str, Parameter(metavar="REGEX")] = ""
    span: Annotated[float | None, typed.one_argument(texts.seconds, "2h")] = None
    workers: typed.Workers = None
    scheduler: Annotated[str | None, Parameter(metavar="ADDRESS")] = None


HERE: Final = WorkOptions()


def campaign(
    sources: Annotated[list[Path], Parameter(name="SOURCE")],
    /,
    *,
    options: typed.Options = typed.NO_OPTIONS,
    output: typed.NeededFolder,
    work: WorkOptions = HERE,
    force: typed.Force = False,
) -> int:
    """Many recordings in; one table and one page out, a report for each.

    campaign.csv, campaign.parquet, index.html and campaign.png go into DIR. Started again with the
    same DIR it does only what is not there yet. --json prints the rows of the table, and how N
    scatters. The exit status is 1 if a recording could not be analyzed; else, with --spec, 3 if a
    gyro fails and 4 if one is undecided.

    Parameters
    ----------
    sources
        A CONFIG.toml, or recordings and folders of them.
    output
        Folder.
    """
    of_files = {name: one for name, one in asdict(typed.statement_of(options)).items() if one}
    stated = typed.settings_typed(options) | of_files | asdict(work) | {"memory": options.memory}
    results.require_place(output, "campaign", force=True)
    from sagnac.core.documents import finite
    from sagnac.fleet.page import reason_text, terminal_text
    from sagnac.fleet.table import yield_of
    from sagnac.report.document import to_json

    with results.resumable(output.absolute()):
        made = sagnac.campaign(sources, output, told=results.standings(), force=force, **stated)
    if options.as_json:
        rows = [asdict(line) for line in made.lines]
        scatter = [
            {"method": method, "gyros": gyros, "files": [line.file for line in one.lines]}
            | (asdict(one.answer) if one.answer else {"why": one.why})
            for (method, gyros), one in made.scatter.items()
        ]
        print(to_json(finite({"schema": "sagnac.campaign/1", "rows": rows, "scatter": scatter})))
    else:
        print(terminal_text(made.campaign, made.lines, made.replaced))
        results.print_paths([output / path.name for path in made.paths])
    failed = made.campaign.failed
    for row in failed:
        results.complain(reason_text(row.task.path, row.reason))
    yields = yield_of(made.campaign)
    if failed or yields is None:
        return results.DATA_ERROR if failed else results.DONE
    return results.STATUS[yields.decision]


COMMANDS: Final = (export, align, campaign)
