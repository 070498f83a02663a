"""Folders, the files that go into them, and what is printed of both."""

import importlib
import os
import textwrap
import time
from collections.abc import Mapping, Sequence
from contextlib import chdir
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Final
from urllib.parse import quote

from sagnac.cli.errors import DONE, FAILED, UNDECIDED
from sagnac.errors import one_line

if TYPE_CHECKING:
    from sagnac.analysis.result import Analysis
    from sagnac.report.title_block import TitleBlock
    from sagnac.specification.verdict import Decision

# Characters that a file system takes in a name, with room for what is put before it.
_LONGEST_NAME: Final = 180


@dataclass(frozen=True, slots=True, kw_only=True)
class Written:
    """An analysis with the time that its report took, and the files of the report."""

    analysis: "Analysis"
    paths: tuple[Path, ...]


def folders_of(files: Sequence[Path], output: Path | None, *, as_json: bool) -> list[Path | None]:
    """The folder for the results of each file; None for nowhere."""
    if output is None and as_json:
        return [None] * len(files)
    if len(files) == 1 and output is not None:
        return [output]
    taken: set[Path] = set()
    folders: list[Path | None] = []
    for file in files:
        folder = output / file.stem if output else Path(f"{file.stem}-report")
        if folder in taken:
            folder = folder.with_name(f"{folder.name}-{len(taken) + 1}")
        taken.add(folder)
        folders.append(folder)
    return folders


def require_writable(folder: Path | None) -> None:
    """Refuse a folder that cannot be written to before the work, and make nothing yet.

    Raises
    ------
    RecordingError
        If it, or the first folder above it that exists, is no folder or may not be written to.
    """
    from sagnac.errors import RecordingError

    if folder is None:
        return
    there = next(place for place in (folder, *folder.absolute().parents) if place.exists())
    if not there.is_dir() or not os.access(there, os.W_OK | os.X_OK):
        why = "is no folder" if not there.is_dir() else "may not be written to"
        raise RecordingError(
            f"{there} {why}", path=str(folder), remedy="choose another folder (-o)"
        )


def made(folder: Path) -> Path:
    """The folder, made if it was not there.

    Raises
    ------
    RecordingError
        If it cannot be made.
    """
    from sagnac.errors import RecordingError

    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise RecordingError(
            f"cannot be made ({error.strerror})",
            path=str(folder),
            remedy="choose another folder (-o)",
        ) from None
    return folder


def folder_name(name: str) -> str:
    """A file name for a channel, whatever its name is: it comes out of a file.

    Examples
    --------
    >>> folder_name("x"), folder_name("../../x"), folder_name("..")
    ('x', '..%2F..%2Fx', '%2E%2E')
    """
    safe = quote(name, safe=" ")[:_LONGEST_NAME]
    return safe if safe.strip(". ") else "".join(f"%{ord(mark):02X}" for mark in safe)


def ready_to_draw() -> None:
    """Load what draws, from where no stray ``matplotlibrc`` lies, which would be believed."""
    with chdir(Path(__file__).parent):
        importlib.import_module("matplotlib")


def write_report(
    analysis: "Analysis",
    folder: Path,
    *,
    block: "TitleBlock | None" = None,
    settings: str = "",
    pdf: bool = False,
    with_forces: bool = True,
) -> Written:
    """Page, document, tables and figures of one analysis, into a folder that is made for them.

    With `settings`, which repeat the run, these too; with `pdf` also the page as a PDF. Without
    `with_forces` the accelerometers are in the document, but not on the page. Gyros that were taken
    alone have one page together, and a folder each in it.
    """
    ready_to_draw()
    from sagnac.formats.files import replacing_folder

    sheet = _Sheet(block=block, settings=settings, pdf=pdf, with_forces=with_forces)
    # All of it or nothing: new figures beside an old document would be believed.
    with replacing_folder(folder) as new:
        written = (
            _write_unit(analysis, new, sheet)
            if analysis.gyros
            else _write_gyro(analysis, new, sheet)
        )
    return replace(written, paths=tuple(folder / path for path in written.paths))


@dataclass(frozen=True, slots=True, kw_only=True)
class _Sheet:
    """What a report holds beside the analysis; see `write_report`."""

    block: "TitleBlock | None"
    settings: str
    pdf: bool
    with_forces: bool


def _write_unit(analysis: "Analysis", folder: Path, sheet: _Sheet) -> Written:
    """The page of several gyros that were taken alone, and each one's own report."""
    from sagnac.report import figures, page
    from sagnac.report.files import write_text

    began = time.perf_counter()
    places = {name: folder_name(name) for name in analysis.gyros}
    links = {name: f"{quote(place)}/report.html" for name, place in places.items()}
    shown = analysis if sheet.with_forces else replace(analysis, accelerometers={})
    text = page.unit_page(shown, block=sheet.block, settings=sheet.settings, links=links)
    write_text(folder / "report.html", text)
    figures.write_png(figures.unit_figure(analysis), folder / "stability.png")
    names = ["report.html", *_printed(text, folder, sheet), "analysis.json", "stability.png"]
    if sheet.settings:
        write_text(folder / "settings.toml", sheet.settings)
        names.append("settings.toml")
    paths = [Path(name) for name in names]
    each = {}
    for name, one in analysis.gyros.items():
        place = folder / places[name]
        place.mkdir()
        own = _write_gyro(one, place, sheet)
        each[name] = own.analysis
        paths += [Path(places[name]) / path for path in own.paths]
    spent = time.perf_counter() - began
    analysis = replace(analysis, gyros=each, seconds={**analysis.seconds, "report": spent})
    _write_document(analysis, folder)
    return Written(analysis=analysis, paths=tuple(paths))


def _write_gyro(analysis: "Analysis", folder: Path, sheet: _Sheet) -> Written:
    """The report of one analysis; its paths are relative to the folder."""
    from sagnac.report import figures, page, tables
    from sagnac.report.files import write_text

    began = time.perf_counter()
    shown = analysis if sheet.with_forces else replace(analysis, accelerometers={})
    drawn = figures.report_figures(analysis)
    pictures = {"stability.png": drawn.stability, "spectrum.png": drawn.spectrum}
    if drawn.parts is not None:
        pictures["parts.png"] = drawn.parts
    texts = {
        "report.html": page.page(shown, drawn, block=sheet.block, settings=sheet.settings),
        "stability.csv": tables.stability_table(analysis),
        "lines.csv": tables.line_table(analysis),
    }
    if analysis.family:
        texts["family.csv"] = tables.family_table(analysis)
        texts["psd.csv"] = tables.density_table(analysis)
    if sheet.settings:
        texts["settings.toml"] = sheet.settings
    for name, figure in pictures.items():
        figures.write_png(figure, folder / name)
    for name, text in texts.items():
        write_text(folder / name, text)
    spent = time.perf_counter() - began
    analysis = replace(analysis, seconds={**analysis.seconds, "report": spent})
    _write_document(analysis, folder)
    first, *others = texts
    printed = _printed(texts[first], folder, sheet)
    names = (first, *printed, "analysis.json", *others, *pictures)
    return Written(analysis=analysis, paths=tuple(map(Path, names)))


def _write_document(analysis: "Analysis", folder: Path) -> None:
    from sagnac.report import document
    from sagnac.report.files import write_text

    text = document.to_json(document.analysis_document(analysis))
    write_text(folder / "analysis.json", text + "\n")


def _printed(page: str, folder: Path, sheet: _Sheet) -> list[str]:
    """The page as a PDF, if that is wanted."""
    if not sheet.pdf:
        return []
    from sagnac.report.pdf import write_pdf

    write_pdf(page, folder / "report.pdf")
    return ["report.pdf"]


def write_accelerometers(analysis: "Analysis", folder: Path, *, pdf: bool = False) -> list[Path]:
    """Page and figure of the accelerometers of a recording, into a folder that is made for them.

    With `pdf` also the page as a PDF.
    """
    ready_to_draw()
    from sagnac.formats.files import replacing_folder
    from sagnac.report import figures, forces, page
    from sagnac.report.files import write_text

    with replacing_folder(folder) as new:
        drawn = forces.force_figure(list(analysis.accelerometers.values()))
        figures.write_png(drawn, new / "stability.png")
        text = page.accelerometers_page(analysis)
        write_text(new / "report.html", text)
        if pdf:
            from sagnac.report.pdf import write_pdf

            write_pdf(text, new / "report.pdf")
    names = ("report.html", *(["report.pdf"] if pdf else []), "stability.png")
    return [folder / name for name in names]


def write_comparison(
    analyses: "Mapping[str, Analysis]", refused: Mapping[str, str], folder: Path
) -> list[Path]:
    """Page, document and figure of several methods, into a folder that is made for them."""
    ready_to_draw()
    from sagnac.formats.files import replacing_folder
    from sagnac.report import document, figures, page
    from sagnac.report.files import write_text

    with replacing_folder(folder) as new:
        figures.write_png(figures.comparison_figure(analyses), new / "comparison.png")
        write_text(new / "comparison.html", page.comparison_page(analyses, refused))
        text = document.to_json(document.comparison_document(analyses, refused))
        write_text(new / "comparison.json", text + "\n")
    return [folder / f"comparison.{suffix}" for suffix in ("html", "json", "png")]


def verdict_status(analyses: "Sequence[Analysis]") -> int:
    """Exit status that the verdicts on some analyses mean; 0 without a specification."""
    from sagnac.report.verdicts import overall_decision

    return status_of(overall_decision(list(analyses)))


def status_of(decision: "Decision | None") -> int:
    """Exit status that a decision means."""
    return {None: DONE, "pass": DONE, "fail": FAILED, "undecided": UNDECIDED}[decision]


def print_documents(
    analyses: "Sequence[Analysis]", *, single: bool, unit: "Analysis | None" = None
) -> None:
    """JSON on standard output: one document, or one of several, the gyros of a unit if it is one.

    See `sagnac.report.document.many_document`.
    """
    from sagnac.report.document import analysis_document, many_document, to_json

    print(to_json(analysis_document(analyses[0]) if single else many_document(analyses, unit)))


def in_brief(analysis: "Analysis", others: "Sequence[Analysis]" = ()) -> tuple[str, ...]:
    """What a screen shows below the answer and the verdict."""
    from sagnac.report import brief

    return brief.coefficients(analysis), brief.lines(analysis), brief.notes(analysis, others)


def in_full(analysis: "Analysis") -> tuple[str, ...]:
    """The same with curves, spectrum, every fit, every unit and every note."""
    from sagnac.report import brief, text

    return (
        *(text.curve(one) for one in analysis.family or (analysis.curve,)),
        text.density(analysis),
        text.coefficients(analysis),
        text.units(analysis),
        text.shares(analysis),
        text.lines(analysis),
        brief.every_note(analysis.notes),
    )


def print_beside(analysis: "Analysis") -> None:
    """The accelerometers of an analysis, and the channels that were not analyzed."""
    from sagnac.report import text

    for shown in (text.accelerometers(analysis), text.refused(analysis)):
        if shown:
            print(shown, end="\n\n")


def print_closing(named: "Sequence[tuple[str, Analysis]]", end: str = "\n") -> None:
    """A row for each gyro of several, by the names of their files."""
    from sagnac.report import brief

    shown = brief.closing(named)
    if shown:
        print(shown, end=end)


def print_paths(paths: Sequence[Path]) -> None:
    """A line for each file written."""
    if len(paths) == 1:
        print(f"wrote {one_line(str(paths[0]))}")
        return
    folders = dict.fromkeys(path.parent for path in paths)
    for folder in folders:
        names = [path.name for path in paths if path.parent == folder]
        line = textwrap.fill(
            f"wrote {one_line(str(folder))}/: {', '.join(names)}",
            80,
            subsequent_indent="  ",
            break_long_words=False,
            break_on_hyphens=False,
        )
        print(line)
