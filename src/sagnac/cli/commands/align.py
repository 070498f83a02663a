"""``sagnac align``: what the noise of a gyro means for heading."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from sagnac import overwriting
from sagnac.cli import output as results
from sagnac.cli.errors import DONE, UsageError
from sagnac.cli.options import (
    OUTPUT,
    Debug,
    Folder,
    Force,
    angle,
    one_argument,
    seconds,
    several_seconds,
    turn_rate,
)

if TYPE_CHECKING:
    from sagnac.alignment.align import Prospect, Triad, Unaided


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
    latitude: Annotated[
        float | None, Parameter(metavar="DEG", help="-89 to 89; without it, no azimuth is found.")
    ] = None,
    time: Annotated[
        float,
        one_argument(
            seconds,
            metavar="10min",
            help="Length of the alignment, at rest; the biases are taken from it.",
        ),
    ] = 600.0,
    azimuth: Annotated[
        float | None,
        one_argument(
            angle, metavar="2deg", help="Not known of the azimuth at the start, 1 sigma: 2deg."
        ),
    ] = None,
    tilt: Annotated[
        float | None,
        one_argument(
            angle, metavar="0.5deg", help="Not known of each tilt at the start, 1 sigma: 0.5deg."
        ),
    ] = None,
    bias: Annotated[
        float | None,
        one_argument(
            turn_rate,
            metavar="3deg/h",
            help="What is not known of a gyro's bias, 1 sigma: unless stated what the rest leaves, "
            "and 0 for gyrocompass and filter.",
        ),
    ] = None,
    table_rate: Annotated[
        float | None,
        Parameter(
            metavar="DEG/S", help="Of a table that turns all the time, for a triad that turns."
        ),
    ] = None,
    after: Annotated[
        tuple[float, ...],
        one_argument(
            several_seconds,
            metavar="60s,10min",
            help="Heading, attitude and position these times without aiding: 1min,10min,1h.",
        ),
    ] = (60.0, 600.0, 3600.0),
    confidence: Annotated[float, Parameter(metavar="0.95", help="Of the interval.")] = 0.95,
    output: Folder = None,
    as_json: Annotated[
        bool,
        Parameter(
            name="--json", group=OUTPUT, negative="", show_default=False, help="JSON, nothing else."
        ),
    ] = False,
    force: Force = False,
    debug: Debug = False,
) -> int:
    """Heading, attitude and position without aiding, and azimuth found, from N, B and K.

    With -o, alignment.json, drift.png and, with --latitude, alignment.png go into DIR.
    """
    del debug
    if table_rate is not None and latitude is None:
        raise UsageError("--table-rate needs --latitude, since azimuth is found from Earth rate")
    results.require_writable(output)
    if output is not None:
        overwriting.require_free(overwriting.of_alignment(output), [source], force=force)
    results.ready_to_draw()
    from sagnac.alignment.align import align as foreseen
    from sagnac.units import DEGREE

    noises, words = _source(source, confidence)
    found = foreseen(
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
        from sagnac.fleet.prior import prior_of

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
    from sagnac.report import alignment as shown
    from sagnac.report import heading_drift
    from sagnac.report.document import to_json
    from sagnac.report.figures import write_png
    from sagnac.report.files import write_text

    found = {} if prospect is None else shown.prospect_document(prospect)
    notes = [*found.pop("notes", [words] if words else []), *heading_drift.drift_notes(unaided)]
    text = to_json(
        {
            "schema": shown.SCHEMA,
            **found,
            **heading_drift.drift_document(unaided),
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
        print(heading_drift.drift_text(unaided))
    if output is not None:
        folder = results.made(output)
        paths = [folder / "alignment.json", folder / "drift.png"]
        write_text(paths[0], text + "\n")
        write_png(heading_drift.drift_figure(unaided), paths[1])
        if prospect is not None:
            paths.append(folder / "alignment.png")
            write_png(shown.azimuth_figure(prospect), paths[-1])
        if not as_json:
            results.print_paths(paths)
