"""The folder of a report: page, document, tables and figures of one analysis, all of it or none."""

import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any
from urllib.parse import quote

from sagnac.analysis.result import Analysis, require_analysis
from sagnac.core.errors import require_type
from sagnac.core.overwriting import outputs_in, require_free
from sagnac.core.whole_files import replacing_folder, write_text
from sagnac.report import document, figures, page, sections
from sagnac.report.sections import TitleBlock, folder_name, write_pdf


@dataclass(frozen=True, slots=True, kw_only=True)
class Report:
    """An analysis with the time that its report took, and the files of the report.

    Examples
    --------
    >>> import numpy as np
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
    >>> from tempfile import TemporaryDirectory
    >>> from sagnac import Recording, analyze
    >>> rate = 1e-6 * np.sqrt(10.0) * np.random.default_rng(1).standard_normal(6000)
    >>> still = Recording.from_arrays(x=rate, kind="rate", unit="rad/s", sample_rate=10.0)
    >>> with TemporaryDirectory() as place:
    ...     report = write_report(analyze(still), Path(place) / "unit 7")
    >>> report.paths[0].name
    'report.html'
    """
    require_analysis(analysis, recorded=True)
    if block is not None:
        require_type("block", block, TitleBlock, "give a sagnac.report.sections.TitleBlock")
    folder = Path(folder)
    for place in (folder, *(folder / folder_name(name) for name in analysis.gyros)):
        require_free(outputs_in(place, "report"), force=force)
    stated = document.analysis_document(analysis)
    # All of it or nothing: new figures beside an old document would be believed.
    how = {"block": block, "settings": settings, "pdf": pdf, "with_forces": with_forces}
    with replacing_folder(folder) as new:
        written = _write(analysis, new, stated, **how)
    return replace(written, paths=tuple(folder / path for path in written.paths))


def write_accelerometers(analysis: Analysis, folder: Path, *, pdf: bool = False) -> list[Path]:
    """Page and figure of the accelerometers of a recording, into a folder that is made for them.

    With `pdf` also the page as a PDF.
    """
    with replacing_folder(folder) as new:
        printed = _write_page(new, page.accelerometers_page(analysis, new), pdf=pdf)
    return [folder / name for name in (*printed, "stability.png")]


def write_comparison(
    analyses: Mapping[str, Analysis], refused: Mapping[str, str], folder: Path
) -> list[Path]:
    """Page, document and figure of several methods, into a folder that is made for them."""
    with replacing_folder(folder) as new:
        figures.write_png(figures.comparison_figure(analyses), new / "comparison.png")
        write_text(new / "comparison.html", page.comparison_page(analyses, refused))
        text = document.to_json(document.comparison_document(analyses, refused))
        write_text(new / "comparison.json", text + "\n")
    return [folder / f"comparison.{suffix}" for suffix in ("html", "json", "png")]


def _write(analysis: Analysis, folder: Path, stated: dict[str, Any], **how: Any) -> Report:
    """The report of one analysis, or of several gyros with each one's own in a folder beside.

    Its paths are relative to the folder; its document, as it is `stated`, gets the time it took.
    `how` holds block, settings, pdf and with_forces: see `write_report`.
    """
    began = time.perf_counter()
    shown = analysis if how["with_forces"] else replace(analysis, accelerometers={})
    top = {"block": how["block"], "settings": how["settings"], "folder": folder}
    places = {name: folder_name(name) for name in analysis.gyros}
    texts: dict[str, str] = {}
    if places:
        links = {name: f"{quote(place)}/report.html" for name, place in places.items()}
        html, pictures = page.unit_page(shown, links=links, **top), ["stability"]
    else:
        drawn = figures.report_figures(analysis)
        html = page.page(shown, drawn=drawn, document=stated, **top)
        pictures = [name for name in page.FILES if name in drawn]
        texts = sections.tables(analysis)
    if how["settings"]:
        texts["settings.toml"] = how["settings"]
    for name, text in texts.items():
        write_text(folder / name, text)
    printed = _write_page(folder, html, pdf=how["pdf"])
    pngs = (f"{name}.png" for name in pictures)
    paths = list(map(Path, (*printed, "analysis.json", *texts, *pngs)))
    each = {}
    for name, one in analysis.gyros.items():
        place = folder / places[name]
        place.mkdir()
        own = _write(one, place, stated["gyros"][name], **how)
        each[name] = own.analysis
        paths += [Path(places[name]) / path for path in own.paths]
    stated["seconds"]["report"] = time.perf_counter() - began
    write_text(folder / "analysis.json", document.to_json(stated) + "\n")
    return Report(
        analysis=replace(analysis, gyros=each, seconds=stated["seconds"]), paths=tuple(paths)
    )


def _write_page(folder: Path, text: str, *, pdf: bool) -> list[str]:
    """Write the page, and as a PDF if that is wanted; the names of the files."""
    write_text(folder / "report.html", text)
    if pdf:
        write_pdf(text, folder / "report.pdf")
    return ["report.html", "report.pdf"] if pdf else ["report.html"]
