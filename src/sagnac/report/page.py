"""The report: one page that stands alone, answer first, to be read, printed and sent."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from markupsafe import Markup
from matplotlib.figure import Figure

from sagnac.analysis.result import (
    Analysis,
    answer_coefficients,
    headline_coefficients,
    headline_estimates,
    headline_fit,
)
from sagnac.analysis.verdict import verdict_of
from sagnac.core.errors import ranked
from sagnac.core.units import DEGREE
from sagnac.core.whole_files import write_text
from sagnac.navigation.noise import GyroNoise
from sagnac.noise.estimates import Estimate
from sagnac.noise.laws import CoefficientName
from sagnac.report import figures
from sagnac.report.alignment import compass_figure
from sagnac.report.document import analysis_document
from sagnac.report.quantities import FIT_TITLES, subject
from sagnac.report.sections import HEADER, TitleBlock, cited, placed_notes, rendered, share_rows
from sagnac.report.text import methods_by_gyro

# Figures of a report in words.
_PICTURES: Final = {
    "stability": "Allan deviation against cluster time, with the fit",
    "spectrum": "Rate spectrum, with the periodic components marked",
    "parts": "Angle random walk over parts of the recording, against time",
    "residual": "What removal leaves, against time and table angle",
}
# Those that are files beside the page, too.
FILES: Final = ("stability", "spectrum", "parts")
# Latitude of the figure on heading.
_LATITUDE: Final = 45.0 * DEGREE
# Title of the coefficients by the member of the average that the answer is of. A fit whose
# interval is the answer's as well stands as itself.
_ANSWERS: Final = {
    "average": "Average over bands and terms",
    "both": "Likelihood (N), average (the others)",
    "whole band": "Likelihood, its interval widened",
}


def _rendered(
    template: str, analysis: Analysis, block: TitleBlock | None = None, **facts: Any
) -> str:
    """A page on an analysis."""
    return rendered(
        template,
        **cited(rendered("methods.txt", analysis=analysis)),
        analysis=analysis,
        block=block or TitleBlock(),
        verdict=verdict_of(analysis),
        forces=_forces(analysis),
        **facts,
    )


def write_page(analysis: Analysis, path: Path) -> None:
    """Write ``report.html``: whole or not at all, and nothing in it is fetched.

    Raises
    ------
    RecordingError
        If the folder cannot be written to.
    """
    write_text(path, unit_page(analysis) if analysis.gyros else page(analysis))


def page(
    analysis: Analysis,
    *,
    drawn: Mapping[str, Figure] | None = None,
    document: Mapping[str, Any] | None = None,
    block: TitleBlock | None = None,
    settings: str = "",
    folder: Path | None = None,
) -> str:
    """The report of one analysis as HTML.

    Parameters
    ----------
    analysis
        What it is of.
    drawn, document
        Its figures by name, and its document; made here if they are not given.
    block
        What stands on top.
    settings
        TOML that repeats the run.
    folder
        Where the figures are written to, too.
    """
    heading, drawn = block or TitleBlock(), drawn or figures.report_figures(analysis)
    pictures = {}
    for name, said in _PICTURES.items():
        png = None if folder is None or name not in FILES else folder / f"{name}.png"
        shown = drawn.get(name)
        pictures[name] = None if shown is None else figures.svg(shown, name, said, png=png)
    return _rendered(
        "report.html",
        analysis,
        heading,
        **pictures,
        title=heading.title or f"Angle random walk, {subject(analysis)}",
        fit=_fit_title(analysis),
        columns=_fits(analysis),
        units=headline_estimates(analysis),
        settings=settings,
        noted=placed_notes(analysis),
        of_method=True,
        shares=_shares(analysis),
        azimuth=_azimuth(analysis, document),
    )


def unit_page(
    analysis: Analysis,
    *,
    block: TitleBlock | None = None,
    settings: str = "",
    links: Mapping[str, str] | None = None,
    folder: Path | None = None,
) -> str:
    """The gyros of one unit at rest on one page: N of each, verdict, curves and coefficients.

    Parameters
    ----------
    analysis
        Of several gyros at rest.
    block
        What stands on top.
    settings
        TOML that repeats the run.
    links
        Gyro -> its own report.
    folder
        Where the figure is written to, too.
    """
    heading, gyros = block or TitleBlock(), list(analysis.gyros.values())
    said = "Allan deviation of the gyros against cluster time"
    png = None if folder is None else folder / "stability.png"
    return _rendered(
        "unit.html",
        analysis,
        heading,
        title=heading.title or f"Gyros {', '.join(analysis.settings.gyros)}",
        links=links or {},
        notes=ranked(analysis.notes),
        figure=figures.svg(figures.curves_figure(gyros), "unit", said, png=png),
        columns=[(name, answer_coefficients(one), False) for name, one in analysis.gyros.items()],
        settings=settings,
    )


def comparison_page(analyses: Mapping[str, Analysis], refused: Mapping[str, str]) -> str:
    """The methods side by side as HTML.

    Parameters
    ----------
    analyses
        By method, all of one recording.
    refused
        Why, of each method that this recording does not allow.
    """
    one, by_gyro = next(iter(analyses.values())), methods_by_gyro(analyses)
    figure = Markup("")
    for name, each in by_gyro.items():
        said = f"Allan deviation of {name} that each method leaves"
        figure += figures.svg(figures.comparison_figure(each), f"comparison-{name}", said)
    what = ", ".join(by_gyro) if len(by_gyro) > 1 else subject(one)
    facts: dict[str, Any] = {"by_gyro": by_gyro, "refused": refused, "figure": figure}
    return _rendered("comparison.html", one, title=f"Methods compared, {what}", **facts)


def accelerometers_page(analysis: Analysis, folder: Path) -> str:
    """The accelerometers of a recording as HTML; their figure goes into a folder, too."""
    forces = list(analysis.accelerometers.values())
    shown = (f"{one.channel} ({one.recording.gyro(one.channel).shown_in})" for one in forces)
    return rendered(
        "accelerometers.html",
        analysis=forces[0],
        title=f"Accelerometers {', '.join(analysis.accelerometers)}",
        forces=_forces(analysis, folder / "stability.png"),
        sensors=", ".join(shown),
    )


def _fit_title(analysis: Analysis) -> str:
    """Basis of the answer: a fit, the average, or nothing."""
    fit = headline_fit(analysis)
    if fit is not None:
        return FIT_TITLES[fit.method]
    choice = analysis.average
    return "" if choice is None or not choice.terms else _ANSWERS[choice.member]


def _shares(analysis: Analysis) -> list[tuple[str, ...]]:
    """Header and rows on the table's rate, without columns that are empty; none at rest."""
    columns = zip(HEADER, *share_rows(analysis), strict=True)
    return list(zip(*(column for column in columns if any(column[1:])), strict=True))


def _forces(analysis: Analysis, png: Path | None = None) -> dict[str, Any] | None:
    """The accelerometers; None if there are none."""
    forces = list(analysis.accelerometers.values())
    gyros = {gyro.name for gyro in analysis.recording.gyros}
    refused = {name: why for name, why in analysis.refused.items() if name not in gyros}
    if not forces and not refused:
        return None
    said, figure = "Allan deviation of the accelerometers against cluster time", Markup("")
    if forces:
        figure = figures.svg(figures.curves_figure(forces), "forces", said, png=png)
    return {"analyses": forces, "refused": refused, "figure": figure}


def _azimuth(analysis: Analysis, document: Mapping[str, Any] | None) -> Markup | None:
    """Heading with these N, B and K; None if N was not seen."""
    if analysis.angle_random_walk.status == "not observable":
        return None
    flicker = headline_coefficients(analysis).get("bias_instability")
    bound = flicker.high if flicker is not None and flicker.status == "upper bound" else 0.0
    figure = compass_figure(
        GyroNoise.from_document(document or analysis_document(analysis)),
        latitude=_LATITUDE,
        confidence=analysis.settings.confidence,
        highest_bias_instability=bound,
    )
    return figures.svg(figure, "azimuth", "Azimuth error of a gyrocompass against time")


def _fits(analysis: Analysis) -> list[tuple[str, Mapping[CoefficientName, Estimate], bool]]:
    """Columns of coefficients: title, estimates, and whether the answer rests on it."""
    resting, columns = headline_fit(analysis), []
    if analysis.coefficients and resting is None:
        member = "average" if analysis.average is None else analysis.average.member
        columns = [(_ANSWERS[member], headline_coefficients(analysis), True)]
    fits = (analysis.fits[name] for name in FIT_TITLES if name in analysis.fits)
    return columns + [(FIT_TITLES[one.method], one.coefficients, one is resting) for one in fits]
