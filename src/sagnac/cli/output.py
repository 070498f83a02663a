"""Folders, the files that go into them, and what is printed of both."""

import importlib
import os
import textwrap
from collections.abc import Mapping, Sequence
from contextlib import chdir
from pathlib import Path
from typing import TYPE_CHECKING

from sagnac.cli.errors import DONE, FAILED, UNDECIDED
from sagnac.errors import one_line

if TYPE_CHECKING:
    from sagnac.analysis.result import Analysis
    from sagnac.specification.verdict import Decision


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


def ready_to_draw() -> None:
    """Load what draws, from where no stray ``matplotlibrc`` lies, which would be believed."""
    with chdir(Path(__file__).parent):
        importlib.import_module("matplotlib")


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
    analyses: "Sequence[Analysis]",
    *,
    single: bool,
    unit: "Analysis | None" = None,
    beside: Mapping[str, object] | None = None,
) -> None:
    """JSON on standard output: one document, or one of several, the gyros of a unit if it is one.

    See `sagnac.report.document.many_document`; `beside` stands under its keys.
    """
    from sagnac.report.document import analysis_document, many_document, to_json

    made = analysis_document(analyses[0]) if single else many_document(analyses, unit)
    print(to_json({**made, **(beside or {})}))


def in_brief(analysis: "Analysis", others: "Sequence[Analysis]" = ()) -> tuple[str, ...]:
    """Part of a screen below the answer and the verdict."""
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
