"""The report: one page that stands alone, answer first, to be read, printed and sent."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from markupsafe import Markup

from sagnac.alignment.noise import GyroNoise
from sagnac.analysis.judgement import verdict_of
from sagnac.analysis.result import (
    Analysis,
    answer_coefficients,
    headline_coefficients,
    headline_estimates,
    headline_fit,
)
from sagnac.coefficients.estimates import Estimate, Fit
from sagnac.coefficients.laws import COEFFICIENT_NAMES, SYMBOLS, CoefficientName
from sagnac.errors import ranked
from sagnac.formats.files import write_text
from sagnac.report import error_text, note_text
from sagnac.report.alignment import compass_figure
from sagnac.report.document import analysis_document
from sagnac.report.figures import (
    ReportFigures,
    comparison_figure,
    force_figure,
    report_figures,
    svg,
    unit_figure,
)
from sagnac.report.files import TitleBlock, placed_notes, rendered
from sagnac.report.quantities import (
    FIT_TITLES,
    TITLES,
    kalman_figures,
    line_amplitude,
    line_position,
    number,
    reading_cells,
    residual_peaks,
    subject,
    typeset,
    unit_cells,
    worst_gyro,
)
from sagnac.report.sections import (
    DECISIONS,
    HEADER,
    cited,
    force_notes,
    force_rows,
    gyro_text,
    risk_text,
    sentences,
    share_remarks,
    share_rows,
)
from sagnac.report.text import methods_by_gyro
from sagnac.units import DEGREE, field_unit
from sagnac.version import __version__

_METHODS: Final[Mapping[str, str]] = {
    "fos": "fos: difference first, lines judged against the noise floor and refined",
    "fos-paper": "fos-paper: fast orthogonal search and Allan fit as published, grid of 1/(4T)",
    "fos-korenberg": "fos-korenberg: the same on the grid of 1/T with Korenberg's stop",
    "fris": "fris: the angle at each full turn of the table",
    "none": "none: nothing removed",
}

# Latitude of the figure on heading.
_LATITUDE: Final = 45.0 * DEGREE
# Title of the coefficients if the answer is of likelihood and average.
# By the member of the average that the answer is of. A fit whose interval is the answer's as well
# stands as itself.
_ANSWERS: Final = {
    "average": "Average over bands and terms",
    "both": "Likelihood (N), average (the others)",
    "whole band": "Likelihood, its interval widened",
}


def _cells(name: CoefficientName, estimate: Estimate) -> tuple[str, str, str]:
    return reading_cells(name, estimate, plain=False)


# Functions and words that templates write facts with.
_WORDS: Final[Mapping[str, Any]] = {
    "amplitude": line_amplitude,
    "cells": _cells,
    "decisions": DECISIONS,
    "gyro_text": gyro_text,
    "methods_in_words": _METHODS,
    "number": number,
    "peaks": residual_peaks,
    "position": line_position,
    "risk_text": risk_text,
    "symbol": lambda name: field_unit(name).symbol,
    "symbols": SYMBOLS,
    "typeset": typeset,
    "unit_cells": unit_cells,
    "version": __version__,
}


def _rendered(template: str, **facts: Any) -> str:
    return rendered(template, **_WORDS, **facts)


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
    figures: ReportFigures | None = None,
    *,
    block: TitleBlock | None = None,
    settings: str = "",
) -> str:
    """The report of one analysis as HTML.

    Parameters
    ----------
    analysis
        What it is of.
    figures
        Those of the analysis, drawn here if they are not given.
    block
        What stands on top.
    settings
        TOML that repeats the run.
    """
    placed = placed_notes(analysis)
    return _rendered(
        "report.html",
        **_heading(analysis, block or TitleBlock()),
        **_headline(analysis),
        **_pictures(figures or report_figures(analysis)),
        **_tables(analysis),
        settings=settings,
        notes=[(note.level, note_text(note)) for note in placed.answer],
        curve_notes=[note_text(note) for note in placed.curve],
        fit_notes=[note_text(note) for note in placed.fits],
        differenced=analysis.is_pair,
        removed=analysis.settings.method != "none",
        turning=analysis.residual is not None and analysis.residual.by_angle is not None,
        shares=_shares(analysis),
        forces=_forces(analysis),
        azimuth=_azimuth(analysis),
        facts=[
            *_file_facts(analysis),
            *_gyro_facts(analysis),
            ("Method", _METHODS[analysis.settings.method]),
            *_curve_facts(analysis),
            *(("Read", note_text(note)) for note in placed.reading),
        ],
        seconds=analysis.seconds,
    )


def _heading(analysis: Analysis, block: TitleBlock) -> dict[str, Any]:
    """Heading of the page, and its citations."""
    methods, references = cited(sentences(analysis))
    read = analysis.recording.provenance
    return {
        "title": block.title or f"Angle random walk, {subject(analysis)}",
        "heading": block.title,
        "block": [*block.facts, *_file_facts(analysis)[: 2 * bool(read)]] if block.facts else [],
        "methods": methods,
        "references": references,
    }


def _headline(analysis: Analysis) -> dict[str, Any]:
    """The answer, what it rests on, and what it is for a filter."""
    return {
        "worst": worst_gyro(analysis),
        "answer": _answer(analysis),
        "verdict": verdict_of(analysis),
        "kalman": kalman_figures(analysis.angle_random_walk),
        "per_gyro": analysis.per_gyro,
        "fit": _fit_title(analysis),
        "band": analysis.average is not None
        and analysis.average.law is not None
        and analysis.angle_random_walk.status == "estimated",
    }


def _pictures(drawn: ReportFigures) -> dict[str, Markup | None]:
    """The figures, each with what it shows for readers who do not see it."""
    shown = (
        ("stability", drawn.stability, "Allan deviation against cluster time, with the fit"),
        ("spectrum", drawn.spectrum, "Rate spectrum, with the periodic components marked"),
        ("parts", drawn.parts, "Angle random walk over parts of the recording, against time"),
        ("residual", drawn.residual, "What removal leaves, against time and table angle"),
    )
    return {
        name: None if figure is None else Markup(svg(figure, name, description))
        for name, figure, description in shown
    }


def _tables(analysis: Analysis) -> dict[str, Any]:
    """Coefficients by fit and by unit, and the lines."""
    average, fits = _answer_column(analysis), _fits(analysis)
    columns = [headline_coefficients(analysis) for _ in average]
    return {
        "fits": [
            *average,
            *((FIT_TITLES[one.method], one is headline_fit(analysis)) for one in fits),
        ],
        "coefficients": _coefficient_rows([*columns, *(fit.coefficients for fit in fits)]),
        "units": headline_estimates(analysis),
        "lines": analysis.lines,
    }


def unit_page(
    analysis: Analysis,
    *,
    block: TitleBlock | None = None,
    settings: str = "",
    links: Mapping[str, str] | None = None,
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
    """
    heading = _heading(analysis, block or TitleBlock())
    title = f"Gyros {', '.join(analysis.settings.gyros)}"
    return _rendered(
        "unit.html",
        **{**heading, "title": heading["heading"] or title},
        worst=worst_gyro(analysis),
        unit=field_unit("angle_random_walk").symbol,
        confidence=f"{100.0 * analysis.settings.confidence:g} %",
        per_gyro=analysis.per_gyro,
        links=links or {},
        refused=_refused(analysis),
        verdict=verdict_of(analysis),
        notes=[(note.level, note_text(note)) for note in ranked(analysis.notes)],
        figure=Markup(
            svg(unit_figure(analysis), "unit", "Allan deviation of the gyros against cluster time")
        ),
        names=list(analysis.gyros),
        coefficients=_coefficient_rows(list(map(answer_coefficients, analysis.gyros.values()))),
        forces=_forces(analysis),
        facts=[*_file_facts(analysis), *_gyro_facts(analysis), *_curve_facts(analysis)],
        settings=settings,
    )


def _refused(analysis: Analysis) -> list[tuple[str, str]]:
    return [(name, error_text(why)) for name, why in analysis.refused.items()]


def _coefficient_rows(
    columns: Sequence[Mapping[CoefficientName, Estimate]],
) -> list[dict[str, Any]]:
    """Each coefficient by every fit, or of every gyro."""
    missing = ("–", "", "not fitted")
    return [
        {
            "symbol": SYMBOLS[name],
            "title": TITLES[name],
            "unit": field_unit(name).symbol,
            "readings": [
                reading_cells(name, found[name], plain=False) if name in found else missing
                for found in columns
            ],
        }
        for name in COEFFICIENT_NAMES
    ]


def comparison_page(analyses: Mapping[str, Analysis], refused: Mapping[str, str]) -> str:
    """The methods side by side as HTML.

    Parameters
    ----------
    analyses
        By method, all of one recording.
    refused
        Why, of each method that this recording does not allow.
    """
    one = next(iter(analyses.values()))
    by_gyro = methods_by_gyro(analyses)
    return _rendered(
        "comparison.html",
        title="Methods compared, " + (", ".join(by_gyro) if len(by_gyro) > 1 else subject(one)),
        by_gyro=by_gyro,
        unit=field_unit("angle_random_walk").symbol,
        refused=[(_METHODS[method], why) for method, why in refused.items()],
        figure=Markup("").join(
            Markup(
                svg(
                    comparison_figure(each),
                    f"comparison-{name}",
                    f"Allan deviation of {name} that each method leaves",
                )
            )
            for name, each in by_gyro.items()
        ),
        facts=[*_file_facts(one), *_gyro_facts(one), *_curve_facts(one)],
    )


def accelerometers_page(analysis: Analysis) -> str:
    """The accelerometers of a recording as HTML.

    Parameters
    ----------
    analysis
        With accelerometers.
    """
    forces = list(analysis.accelerometers.values())
    channels = [(one.channel, one.recording.gyro(one.channel).shown_in) for one in forces]
    return _rendered(
        "accelerometers.html",
        title=f"Accelerometers {', '.join(analysis.accelerometers)}",
        forces=_forces(analysis),
        facts=[
            *_file_facts(forces[0]),
            ("Accelerometers", ", ".join(f"{name} ({unit})" for name, unit in channels)),
            *_curve_facts(forces[0]),
        ],
    )


def _answer(analysis: Analysis) -> dict[str, str]:
    estimate = analysis.angle_random_walk
    value, interval, status = reading_cells("angle_random_walk", estimate, plain=False)
    return {
        "subject": subject(analysis),
        "value": value,
        "interval": interval,
        "status": status,
        "unit": field_unit("angle_random_walk").symbol,
        "confidence": f"{100.0 * estimate.confidence:g} %",
        "source": analysis.source,
    }


def _fit_title(analysis: Analysis) -> str:
    """Basis of the answer: a fit, the average, or nothing."""
    fit = headline_fit(analysis)
    if fit is not None:
        return FIT_TITLES[fit.method]
    choice = analysis.average
    if choice is None or not choice.terms:
        return ""
    return _ANSWERS[choice.member]


def _shares(analysis: Analysis) -> dict[str, Any] | None:
    """Shares of the table's rate, without columns that are empty; None at rest."""
    if not analysis.shares:
        return None
    rows = share_rows(analysis)
    filled = [place for place in range(len(HEADER)) if any(row[place] for row in rows)]
    return {
        "header": [HEADER[place] for place in filled],
        "rows": [[row[place] for place in filled] for row in rows],
        "remarks": share_remarks(analysis),
    }


def _forces(analysis: Analysis) -> dict[str, Any] | None:
    """The accelerometers; None if there are none."""
    forces = list(analysis.accelerometers.values())
    gyros = {gyro.name for gyro in analysis.recording.gyros}
    refused = [one for one in _refused(analysis) if one[0] not in gyros]
    if not forces and not refused:
        return None
    description = "Allan deviation of the accelerometers against cluster time"
    return {
        "names": list(analysis.accelerometers),
        "confidence": f"{100.0 * analysis.settings.confidence:g} %",
        "rows": force_rows(forces),
        "notes": force_notes(forces),
        "refused": refused,
        "figure": Markup(svg(force_figure(forces), "forces", description)) if forces else "",
    }


def _azimuth(analysis: Analysis) -> Markup | None:
    """Heading with these N, B and K; None if N was not seen."""
    if analysis.angle_random_walk.status == "not observable":
        return None
    flicker = headline_coefficients(analysis).get("bias_instability")
    bound = flicker.high if flicker is not None and flicker.status == "upper bound" else 0.0
    figure = compass_figure(
        GyroNoise.from_document(analysis_document(analysis)),
        latitude=_LATITUDE,
        confidence=analysis.settings.confidence,
        highest_bias_instability=bound,
    )
    return Markup(svg(figure, "azimuth", "Azimuth error of a gyrocompass against time"))


def _fits(analysis: Analysis) -> list[Fit]:
    return [analysis.fits[name] for name in FIT_TITLES if name in analysis.fits]


def _answer_column(analysis: Analysis) -> list[tuple[str, bool]]:
    """A column for the average if the answer is of that and of no fit."""
    if not analysis.coefficients or headline_fit(analysis) is not None:
        return []
    member = "average" if analysis.average is None else analysis.average.member
    return [(_ANSWERS[member], True)]


def _file_facts(analysis: Analysis) -> list[tuple[str, str]]:
    """Columns that were read, and from where."""
    recording = analysis.recording
    provenance = recording.provenance
    facts = [
        ("File", provenance.path if provenance else "none: made in memory"),
        ("SHA-256", provenance.sha256 if provenance else "none"),
        ("Format", provenance.format if provenance else "none"),
        ("Samples", f"{recording.samples:,} at {recording.sample_rate:.9g} Hz".replace(",", " ")),
        ("Duration", f"{recording.duration:.6g} s"),
    ]
    if provenance and provenance.span_s:
        start, stop = provenance.span_s
        facts.append(("Slice", f"{start:g} to {stop:g} s of the file"))
    return facts


def _gyro_facts(analysis: Analysis) -> list[tuple[str, str]]:
    """Which gyros, and what they stood on."""
    table = (
        "at rest"
        if analysis.table_rate is None
        else f"{analysis.table_rate / DEGREE:.6g} °/s (mean)"
    )
    return [
        ("Gyros", ", ".join(_channel(analysis, name) for name in analysis.settings.gyros)),
        ("Table", table),
    ]


def _curve_facts(analysis: Analysis) -> list[tuple[str, str]]:
    """How the curve and the intervals were made."""
    settings = analysis.settings
    return [
        (
            "Interval",
            "every sample"
            if settings.interval is None
            else f"{settings.interval:g} s between the angles of the curve",
        ),
        ("Confidence", f"{100.0 * settings.confidence:g} %"),
        ("Deviation", analysis.curve.estimator.upper()),
        ("Software", f"sagnac {__version__}"),
    ]


def _channel(analysis: Analysis, name: str) -> str:
    channel = analysis.recording.gyro(name)
    return f"{name} ({channel.kind}, {channel.shown_in})"
