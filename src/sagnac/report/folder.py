"""The folder of a report: page, document, tables and figures of one analysis, all of it or none."""

import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from urllib.parse import quote

from matplotlib.figure import Figure

from sagnac.analysis.result import Analysis
from sagnac.core.overwriting import outputs_in, require_free
from sagnac.formats.files import replacing_folder, write_text
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
    if analysis.stored is not None:
        raise ValueError(
            "analysis was read from a file, which holds no spectra and no residual; analyze the "
            "recording again, and write the report of that"
        )
    folder = Path(folder)
    for place in (folder, *(folder / folder_name(name) for name in analysis.gyros)):
        require_free(outputs_in(place, "report"), force=force)
    sheet = _Sheet(block=block, settings=settings, pdf=pdf, with_forces=with_forces)
    # All of it or nothing: new figures beside an old document would be believed.
    with replacing_folder(folder) as new:
        written = (
            _write_unit(analysis, new, sheet)
            if analysis.gyros
            else _write_gyro(analysis, new, sheet)
        )
    return replace(written, paths=tuple(folder / path for path in written.paths))


def write_accelerometers(analysis: Analysis, folder: Path, *, pdf: bool = False) -> list[Path]:
    """Page and figure of the accelerometers of a recording, into a folder that is made for them.

    With `pdf` also the page as a PDF.
    """
    with replacing_folder(folder) as new:
        drawn = figures.force_figure(list(analysis.accelerometers.values()))
        figures.write_png(drawn, new / "stability.png")
        text = page.accelerometers_page(analysis)
        write_text(new / "report.html", text)
        printed = _printed(text, new, pdf=pdf)
    return [folder / name for name in ("report.html", *printed, "stability.png")]


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


@dataclass(frozen=True, slots=True, kw_only=True)
class _Sheet:
    """Contents of a report beside the analysis; see `write_report`."""

    block: TitleBlock | None
    settings: str
    pdf: bool
    with_forces: bool

    def shown(self, analysis: Analysis) -> Analysis:
        """The analysis as its page shows it."""
        return analysis if self.with_forces else replace(analysis, accelerometers={})


def _write_unit(analysis: Analysis, folder: Path, sheet: _Sheet) -> Report:
    """The page of several gyros that were taken alone, and each one's own report."""
    began = time.perf_counter()
    places = {name: folder_name(name) for name in analysis.gyros}
    links = {name: f"{quote(place)}/report.html" for name, place in places.items()}
    text = page.unit_page(
        sheet.shown(analysis), block=sheet.block, settings=sheet.settings, links=links
    )
    drawn = {"stability": figures.unit_figure(analysis)}
    paths = _write_files(folder, {"report.html": text}, drawn, sheet)
    each = {}
    for name, one in analysis.gyros.items():
        place = folder / places[name]
        place.mkdir()
        own = _write_gyro(one, place, sheet)
        each[name] = own.analysis
        paths += [Path(places[name]) / path for path in own.paths]
    return _with_document(replace(analysis, gyros=each), folder, began, paths)


def _write_gyro(analysis: Analysis, folder: Path, sheet: _Sheet) -> Report:
    """The report of one analysis; its paths are relative to the folder."""
    began = time.perf_counter()
    drawn = figures.report_figures(analysis)
    text = page.page(sheet.shown(analysis), drawn, block=sheet.block, settings=sheet.settings)
    texts = {
        "report.html": text,
        "stability.csv": sections.stability_table(analysis),
        "lines.csv": sections.line_table(analysis),
    }
    if analysis.family:
        texts["family.csv"] = sections.family_table(analysis)
        texts["psd.csv"] = sections.density_table(analysis)
    # The residual stands on the page alone.
    drawn.pop("residual", None)
    return _with_document(analysis, folder, began, _write_files(folder, texts, drawn, sheet))


def _write_files(
    folder: Path, texts: Mapping[str, str], drawn: Mapping[str, Figure], sheet: _Sheet
) -> list[Path]:
    """Write texts, the first of which is the page, and figures; all names of the report."""
    if sheet.settings:
        texts = {**texts, "settings.toml": sheet.settings}
    for name, figure in drawn.items():
        figures.write_png(figure, folder / f"{name}.png")
    for name, text in texts.items():
        write_text(folder / name, text)
    first, *others = texts
    printed = _printed(texts[first], folder, pdf=sheet.pdf)
    names = (first, *printed, "analysis.json", *others, *(f"{name}.png" for name in drawn))
    return [Path(name) for name in names]


def _with_document(analysis: Analysis, folder: Path, began: float, paths: list[Path]) -> Report:
    """Write the document, which holds the time since `began`."""
    spent = time.perf_counter() - began
    analysis = replace(analysis, seconds={**analysis.seconds, "report": spent})
    text = document.to_json(document.analysis_document(analysis))
    write_text(folder / "analysis.json", text + "\n")
    return Report(analysis=analysis, paths=tuple(paths))


def _printed(text: str, folder: Path, *, pdf: bool) -> list[str]:
    """The page as a PDF, if that is wanted."""
    if not pdf:
        return []
    write_pdf(text, folder / "report.pdf")
    return ["report.pdf"]
