"""The report: one page that stands alone, answer first, to be read, printed and sent.

Page, document, tables and figures of one analysis go into a folder, all of them or none.
"""

import json
import time
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final
from urllib.parse import quote

from markupsafe import Markup
from matplotlib.figure import Figure

from sagnac.analysis import result, verdict
from sagnac.analysis.result import Analysis
from sagnac.core.errors import path_of, ranked, require_choice, require_type
from sagnac.core.overwriting import earlier_files, outputs_in, require_free
from sagnac.core.units import DEGREE
from sagnac.core.whole_files import replacing_folder, write_text
from sagnac.navigation.noise import GyroNoise
from sagnac.noise.estimates import Estimate
from sagnac.noise.laws import CoefficientName
from sagnac.report import deviation, figures, frame, sections, tables
from sagnac.report import document as documents
from sagnac.report.alignment import compass_figure
from sagnac.report.quantities import FIT_TITLES, subject, typeset
from sagnac.report.sections import TitleBlock, rendered, write_pdf
from sagnac.report.text import methods_by_gyro, notes_by_method

# Figures of a report in words.
_PICTURES: Final = {
    "stability": "Allan deviation against cluster time, with the fit",
    "spectrum": "Rate spectrum, with the periodic components marked",
    "parts": "Angle random walk over parts of the recording, against time",
    "residual": "What removal leaves, against time and table angle",
}
# Title of the coefficients by the member of the average that the answer is of. A fit whose
# interval is the answer's as well stands as itself.
_ANSWERS: Final = {
    "average": "Average over bands and terms",
    "both": "Likelihood (N), average (the others)",
    "whole band": "Likelihood, its interval widened",
}


def _rendered(template: str, analysis: Analysis, block: TitleBlock, **facts: Any) -> str:
    """A page on an analysis."""
    facts |= sections.cited(rendered("methods.txt", analysis=analysis))
    facts |= {"verdict": verdict.verdict_of(analysis), "forces": _forces(analysis)}
    return rendered(template, analysis=analysis, block=block, **facts)


def write_page(analysis: Analysis, path: Path) -> None:
    """Write ``report.html``: whole or not at all, and nothing in it is fetched.

    Raises
    ------
    RecordingError
        If the folder cannot be written to.
    """
    write_text(path, page(analysis))


def page(
    analysis: Analysis,
    *,
    drawn: Mapping[str, Figure] | None = None,
    document: Mapping[str, Any] | None = None,
    block: TitleBlock | None = None,
    settings: str = "",
    links: Mapping[str, str] | None = None,
) -> str:
    """The report of one analysis as HTML; of several gyros at rest one page together.

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
    links
        Gyro -> its own report.
    """
    heading, drawn = block or TitleBlock(), drawn or figures.report_figures(analysis)
    if analysis.gyros:
        label = "Allan deviation of the gyros against cluster time"
        each = analysis.gyros.items()
        return _rendered(
            "unit.html",
            analysis,
            heading,
            title=heading.title or f"Gyros {', '.join(analysis.settings.gyros)}",
            links=links or {},
            notes=sections.together(ranked(analysis.notes)),
            figure=figures.svg(drawn["stability"], "unit", label),
            columns=[(name, result.answer_coefficients(one), False) for name, one in each],
            settings=settings,
        )
    pictures = {name: figures.svg(one, name, _PICTURES[name]) for name, one in drawn.items()}
    return _rendered(
        "report.html",
        analysis,
        heading,
        **{name: pictures.get(name) for name in _PICTURES},
        title=heading.title or f"Angle random walk, {subject(analysis)}",
        fit=_fit_title(analysis) if deviation.fit_of(analysis) else "",
        two_curves=frame.removed(analysis) or bool(getattr(analysis, "curve_of_answer", None)),
        columns=_fits(analysis),
        units=result.headline_estimates(analysis),
        settings=settings,
        noted=sections.placed_notes(analysis),
        of_method=True,
        shares=_shares(analysis),
        azimuth=_azimuth(analysis, document),
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
        label = f"Allan deviation of {name} that each method leaves"
        figure += figures.svg(figures.comparison_figure(each), f"comparison-{name}", label)
    what = ", ".join(by_gyro) if len(by_gyro) > 1 else subject(one)
    facts: dict[str, Any] = {"by_gyro": by_gyro, "refused": refused, "figure": figure}
    facts["noticed"] = [typeset(note) for note in notes_by_method(analyses)]
    title = f"Methods compared, {what}"
    return _rendered("comparison.html", one, TitleBlock(), title=title, **facts)


def accelerometers_page(analysis: Analysis) -> str:
    """The accelerometers of a recording as HTML."""
    forces, shown = list(analysis.accelerometers.values()), _forces(analysis)
    named = (f"{one.channel} ({one.recording.gyro(one.channel).shown_in})" for one in forces)
    title, sensors = f"Accelerometers {', '.join(analysis.accelerometers)}", ", ".join(named)
    return rendered(
        "accelerometers.html", analysis=forces[0], title=title, forces=shown, sensors=sensors
    )


def _fit_title(analysis: Analysis) -> str:
    """Basis of the answer: a fit, the average, or nothing."""
    fit = result.headline_fit(analysis)
    if fit is not None:
        return FIT_TITLES[fit.method]
    choice = analysis.average
    return "" if choice is None or not choice.terms else _ANSWERS[choice.member]


def _shares(analysis: Analysis) -> list[tuple[str, ...]]:
    """Header and rows on the table's rate, without columns that are empty; none at rest."""
    columns = zip(sections.HEADER, *sections.share_rows(analysis), strict=True)
    return list(zip(*(column for column in columns if any(column[1:])), strict=True))


def _forces(analysis: Analysis) -> dict[str, Any] | None:
    """The accelerometers; None if there are none."""
    forces = list(analysis.accelerometers.values())
    gyros = {gyro.name for gyro in analysis.recording.gyros}
    refused = {name: why for name, why in analysis.refused.items() if name not in gyros}
    if not forces and not refused:
        return None
    label, figure = "Allan deviation of the accelerometers against cluster time", Markup("")
    if forces:
        figure = figures.svg(figures.curves_figure(forces), "forces", label)
    return {"analyses": forces, "refused": refused, "figure": figure}


def _azimuth(analysis: Analysis, document: Mapping[str, Any] | None) -> Markup | None:
    """Heading with these N, B and K; None if N was not seen."""
    if analysis.angle_random_walk.status == "not observable":
        return None
    noise = GyroNoise.from_document(document or documents.analysis_document(analysis))
    figure = compass_figure(noise, latitude=45.0 * DEGREE, confidence=analysis.settings.confidence)
    return figures.svg(figure, "azimuth", "Azimuth error of a gyrocompass against time")


def _fits(analysis: Analysis) -> list[tuple[str, Mapping[CoefficientName, Estimate], bool]]:
    """Columns of coefficients: title, estimates, and whether the answer rests on it."""
    resting, columns = result.headline_fit(analysis), []
    if analysis.coefficients and resting is None:
        member = "average" if analysis.average is None else analysis.average.member
        columns = [(_ANSWERS[member], result.headline_coefficients(analysis), True)]
    fits = (analysis.fits[name] for name in FIT_TITLES if name in analysis.fits)
    return columns + [(FIT_TITLES[one.method], one.coefficients, one is resting) for one in fits]


# ---- folder ------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class Report:
    """An analysis with the time that its report took, and the files of the report.

    Examples
    --------
    >>> import numpy as np
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> from sagnac import Recording, analyze
    >>> rate = 1e-6 * np.sqrt(10.0) * np.random.default_rng(1).standard_normal(6000)
    >>> still = Recording.from_arrays(x=rate, kind="rate", unit="rad/s", sample_rate=10.0)
    >>> with TemporaryDirectory() as place:
    ...     report = write_report(analyze(still), Path(place) / "unit 7")
    >>> [path.name for path in report.paths][:2]
    ['report.html', 'analysis.json']
    """

    analysis: Analysis
    paths: tuple[Path, ...]


def write_report(
    analysis: Analysis,
    folder: str | Path,
    *,
    block: TitleBlock | None = None,
    settings: str = "",
    pdf: bool = False,
    with_forces: bool = True,
    force: bool = False,
) -> Report:
    """Page, document, tables and figures of one analysis, into a folder that is made for them.

    Gyros that were taken alone have one page together, and a folder each in it.

    Parameters
    ----------
    analysis
        What it is of.
    folder
        ``report.html``, ``analysis.json`` and the others go into it; what an earlier report left
        there is replaced.
    block
        What stands on top of the page.
    settings
        TOML that repeats the run, written beside the page if there is one.
    pdf
        Also write the page as a PDF.
    with_forces
        Whether the page shows the accelerometers; the document holds them either way.
    force
        Replace what no report of this package left there, too.

    Raises
    ------
    RecordingError
        If the folder cannot be written to; nothing of it is changed then.
    WouldOverwrite
        If a file is there that no report left, and `force` is not set.
    MissingExtra
        If a PDF is asked for and nothing that makes one is installed.
    ValueError
        If the analysis was read from a file, which holds no spectra and no residual.

    Examples
    --------
    >>> import numpy as np
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> from sagnac import Recording, analyze
    >>> rate = 1e-6 * np.sqrt(10.0) * np.random.default_rng(1).standard_normal(6000)
    >>> still = Recording.from_arrays(x=rate, kind="rate", unit="rad/s", sample_rate=10.0)
    >>> with TemporaryDirectory() as place:
    ...     report = write_report(analyze(still), Path(place) / "unit 7")
    >>> report.paths[0].name
    'report.html'
    """
    result.require_analysis(analysis, recorded=True)
    if block is not None:
        require_type("block", block, TitleBlock, "give a sagnac.report.sections.TitleBlock")
    for name, flag in (("pdf", pdf), ("with_forces", with_forces)):
        require_choice(name, flag, (False, True))
    require_type("settings", settings, str, "give a text, TOML")
    folder = path_of("folder", folder)
    for place in (folder, *(folder / tables.folder_name(name) for name in analysis.gyros)):
        require_free(outputs_in(place, "report"), force=force)
    stated = documents.analysis_document(analysis)
    # All of it or nothing: new figures beside an old document would be believed.
    how = {"block": block, "settings": settings, "pdf": pdf, "with_forces": with_forces}
    with replacing_folder(folder, lambda: _earlier_report(folder)) as new:
        written = _write(analysis, new, stated, **how)
    return replace(written, paths=tuple(folder / path for path in written.paths))


def _earlier_report(folder: Path) -> list[Path]:
    """Files of an earlier report in a folder, those on each of its gyros in folders there, too."""
    outputs = outputs_in(folder, "report")
    files = earlier_files(outputs)
    if not files:
        return []
    for name, stated in (_read(outputs.mark).get("gyros") or {}).items():
        own = outputs_in(folder / tables.folder_name(name), "report")
        # Another run may have written there since.
        if _read(own.mark) == stated:
            files += earlier_files(own)
    return files


def _read(document: Path) -> dict[str, Any]:
    """A document as it stands in a file; empty if it cannot be read."""
    with suppress(OSError, ValueError):
        return dict(json.loads(document.read_bytes()))
    return {}


def write_accelerometers(analysis: Analysis, folder: Path, *, pdf: bool = False) -> list[Path]:
    """Page and figure of the accelerometers of a recording, into a folder that is made for them.

    With `pdf` also the page as a PDF.
    """
    outputs = outputs_in(folder, "accelerometers")
    with replacing_folder(folder, lambda: earlier_files(outputs)) as new:
        printed = _write_page(new, accelerometers_page(analysis), pdf=pdf)
        forces = list(analysis.accelerometers.values())
        figures.write_png(figures.curves_figure(forces), new / "stability.png")
    return [folder / name for name in (*printed, "stability.png")]


def write_comparison(
    analyses: Mapping[str, Analysis], refused: Mapping[str, str], folder: Path
) -> list[Path]:
    """Page, document and figure of several methods, into a folder that is made for them."""
    with replacing_folder(folder) as new:
        figures.write_png(figures.comparison_figure(analyses), new / "comparison.png")
        write_text(new / "comparison.html", comparison_page(analyses, refused))
        text = documents.to_json(documents.comparison_document(analyses, refused))
        write_text(new / "comparison.json", text + "\n")
    return [folder / f"comparison.{suffix}" for suffix in ("html", "json", "png")]


def _write(analysis: Analysis, folder: Path, stated: dict[str, Any], **how: Any) -> Report:
    """The report of one analysis, or of several gyros with each one's own in a folder beside.

    Its paths are relative to the folder; its document, as it is `stated`, gets the time it took.
    `how` holds block, settings, pdf and with_forces: see `write_report`.
    """
    began = time.perf_counter()
    shown = analysis if how["with_forces"] else replace(analysis, accelerometers={})
    top = {"block": how["block"], "settings": how["settings"]}
    places = {name: tables.folder_name(name) for name in analysis.gyros}
    links = {name: f"{quote(place)}/report.html" for name, place in places.items()}
    drawn = figures.report_figures(analysis)
    html = page(shown, drawn=drawn, document=stated, links=links, **top)
    texts = {} if places else tables.csv_files(analysis)
    # The residual stands on the page alone.
    pngs = {f"{name}.png": figure for name, figure in drawn.items() if name != "residual"}
    for png, figure in pngs.items():
        figures.write_png(figure, folder / png)
    if how["settings"]:
        texts["settings.toml"] = how["settings"]
    for name, text in texts.items():
        write_text(folder / name, text)
    printed = _write_page(folder, html, pdf=how["pdf"])
    paths = list(map(Path, (*printed, "analysis.json", *texts, *pngs)))
    each = {}
    for name, one in analysis.gyros.items():
        place = folder / places[name]
        place.mkdir()
        own = _write(one, place, stated["gyros"][name], **how)
        each[name] = own.analysis
        paths += [Path(places[name]) / path for path in own.paths]
    stated["seconds"]["report"] = time.perf_counter() - began
    write_text(folder / "analysis.json", documents.to_json(stated) + "\n")
    reported = replace(analysis, gyros=each, seconds=stated["seconds"])
    return Report(analysis=reported, paths=tuple(paths))


def _write_page(folder: Path, text: str, *, pdf: bool) -> list[str]:
    """Write the page, and as a PDF if that is wanted; the names of the files."""
    write_text(folder / "report.html", text)
    if pdf:
        write_pdf(text, folder / "report.pdf")
    return ["report.html", "report.pdf"] if pdf else ["report.html"]
