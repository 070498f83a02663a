"""``sagnac align``: what the noise of a gyro means for heading."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from sagnac.cli import output as results
from sagnac.cli import outputs
from sagnac.cli.errors import DONE
from sagnac.cli.options import OUTPUT, Debug, Folder, Force, one_argument, seconds

if TYPE_CHECKING:
    from sagnac.alignment.initial import Start
    from sagnac.alignment.noise import GyroNoise
    from sagnac.report.alignment import Prospect


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
    latitude: Annotated[float, Parameter(metavar="DEG", help="-89 to 89.")],
    time: Annotated[
        float, one_argument(seconds, metavar="10min", help="Length of the alignment.")
    ] = 600.0,
    bias: Annotated[
        float,
        Parameter(
            metavar="DEG/H", help="What is not known of a gyro's bias, 1 sigma: 0 unless stated."
        ),
    ] = 0.0,
    table_rate: Annotated[
        float | None,
        Parameter(
            metavar="DEG/S", help="Of a table that turns all the time, for a triad that turns."
        ),
    ] = None,
    after: Annotated[
        float, one_argument(seconds, metavar="1h", help="Position error this long afterwards.")
    ] = 3600.0,
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
    """Azimuth error of gyrocompass and filter from N, B and K; what a filter starts from.

    With -o, alignment.json and alignment.png go into DIR.
    """
    del debug
    results.require_writable(output)
    if output is not None:
        outputs.require_free(outputs.of_alignment(output), [source], force=force)
    from sagnac.alignment.initial import Start
    from sagnac.units import DEGREE, DEGREE_PER_HOUR

    noise, words = _noise(source, confidence)
    prospect = _prospect(
        noise,
        Start(drift=bias * DEGREE_PER_HOUR),
        latitude * DEGREE,
        time=time,
        after=after,
        table_rate=None if table_rate is None else table_rate * DEGREE,
        foretold=words,
        confidence=confidence,
    )
    _show(prospect, output, as_json=as_json)
    return DONE


def _noise(source: Path, confidence: float) -> "tuple[GyroNoise, str]":
    """N, B and K of an analysis; or N that a campaign foretells, and in words from what."""
    if source.is_dir() or source.suffix.lower() == ".csv":
        from sagnac.campaign.prior import prior_of

        prior = prior_of(source, confidence=confidence)
        return prior.noise, prior.words
    from sagnac.alignment.noise import GyroNoise

    return GyroNoise.from_json(source), ""


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
    from sagnac.cli.errors import UsageError
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


def _show(prospect: "Prospect", output: Path | None, *, as_json: bool) -> None:
    """What was found on the terminal, and in a folder if one is named."""
    from sagnac.report import alignment as shown
    from sagnac.report.document import to_json
    from sagnac.report.figures import write_png
    from sagnac.report.files import write_text

    text = to_json(shown.prospect_document(prospect))
    print(text if as_json else shown.prospect_text(prospect))
    if output is not None:
        folder = results.made(output)
        write_text(folder / "alignment.json", text + "\n")
        write_png(shown.azimuth_figure(prospect), folder / "alignment.png")
        if not as_json:
            results.print_paths([folder / "alignment.json", folder / "alignment.png"])
