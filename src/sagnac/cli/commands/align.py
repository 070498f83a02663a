"""``sagnac align``: what the noise of a gyro means for heading."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

from cyclopts import Parameter

from sagnac.cli import output as results
from sagnac.cli import outputs
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
)

if TYPE_CHECKING:
    from sagnac.alignment.initial import Start
    from sagnac.alignment.noise import GyroNoise
    from sagnac.report.alignment import Prospect
    from sagnac.report.heading_drift import Unaided

# Where no latitude is stated: it counts little without aiding over minutes.
_LATITUDE: Final = 45.0
_POINTS: Final = 41  # of a picture
_SHORTEST: Final = 0.01  # of the longest time in it


def align(
    source: Annotated[
        Path,
        Parameter(
            name="ANALYSIS.json|CAMPAIGN",
            help="Of an analysis; or a campaign (its folder or campaign.csv), which foretells N.",
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
        Parameter(
            metavar="DEG/H",
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
    if bias is not None and not bias >= 0.0:
        raise UsageError(f"--bias {bias:g}: give zero or more")
    results.require_writable(output)
    if output is not None:
        outputs.require_free(outputs.of_alignment(output), [source], force=force)
    from sagnac.alignment.initial import Start
    from sagnac.units import DEGREE, DEGREE_PER_HOUR

    noises, words = _noises(source, confidence)
    begun = Start()
    start = Start(
        azimuth=begun.azimuth if azimuth is None else azimuth,
        tilt=begun.tilt if tilt is None else tilt,
        drift=(bias or 0.0) * DEGREE_PER_HOUR,
    )
    unaided = _unaided(
        noises, start, latitude, bias=bias, rest=time, after=after, confidence=confidence
    )
    prospect = None
    if latitude is not None:
        prospect = _prospect(
            noises[0],
            start,
            latitude * DEGREE,
            time=time,
            after=max(after),
            table_rate=None if table_rate is None else table_rate * DEGREE,
            foretold=words,
            confidence=confidence,
        )
    _show(unaided, prospect, words, output, as_json=as_json)
    return DONE


def _noises(
    source: Path, confidence: float
) -> "tuple[tuple[GyroNoise, GyroNoise, GyroNoise], str]":
    """N, B and K of an analysis; or N that a campaign foretells, and in words from what."""
    if source.is_dir() or source.suffix.lower() == ".csv":
        from sagnac.fleet.prior import prior_of

        prior = prior_of(source, confidence=confidence)
        return (prior.noise, prior.noise, prior.noise), prior.words
    from sagnac.alignment.noise import GyroNoise

    return GyroNoise.triad_from_json(source), ""


def _unaided(
    noises: "tuple[GyroNoise, GyroNoise, GyroNoise]",
    start: "Start",
    latitude: float | None,
    *,
    bias: float | None,
    rest: float,
    after: tuple[float, ...],
    confidence: float,
) -> "Unaided":
    """What goes off without aiding."""
    import numpy as np

    from sagnac.alignment.drift import Priors, drift
    from sagnac.report.heading_drift import Unaided
    from sagnac.units import DEGREE

    place = (_LATITUDE if latitude is None else latitude) * DEGREE
    priors = Priors(
        tilt=start.tilt,
        azimuth=start.azimuth,
        rest=rest,
        bias=None if bias is None else start.drift,
    )
    found, along = (
        drift(noises, latitude=place, times=times, priors=priors, confidence=confidence)
        for times in (
            np.array(after),
            np.geomspace(_SHORTEST * max(after), max(after), _POINTS),
        )
    )
    return Unaided(
        drift=found,
        along=along,
        noises=noises,
        latitude=place,
        latitude_stated=latitude is not None,
        confidence=confidence,
    )


def _prospect(
    noise: "GyroNoise",
    start: "Start",
    place: float,
    *,
    time: float,
    after: float,
    table_rate: float | None,
    foretold: str,
    confidence: float,
) -> "Prospect":
    """What the noise means at a latitude, rad."""
    import numpy as np

    from sagnac.alignment.azimuth import azimuth_error
    from sagnac.alignment.initial import aligned
    from sagnac.alignment.position import position_error
    from sagnac.alignment.rotating import rotating_azimuth_error
    from sagnac.report.alignment import Prospect

    rotating = None
    if table_rate is not None:
        try:
            rotating = rotating_azimuth_error(
                noise, latitude=place, times=np.array([time]), table_rate=table_rate,
                bias=start.drift, confidence=confidence,
            )  # fmt: skip
        except ValueError as error:
            raise UsageError(f"--table-rate: {error}") from None
    filtered = aligned(noise, latitude=place, seconds=time, start=start)
    return Prospect(
        noise=noise,
        start=start,
        latitude=place,
        compass=azimuth_error(
            noise, latitude=place, times=np.geomspace(time / 100.0, time, 101),
            confidence=confidence,
        ),
        filtered=filtered,
        rotating=rotating,
        foretold=foretold,
        position=position_error(
            noise, latitude=place, covariance=filtered.covariance, seconds=after
        ),
    )  # fmt: skip


def _show(
    unaided: "Unaided",
    prospect: "Prospect | None",
    words: str,
    output: Path | None,
    *,
    as_json: bool,
) -> None:
    """What was found on the terminal, and in a folder if one is named."""
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
