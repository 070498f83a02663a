"""The reproduction of the paper as files: one page, pictures and tables of numbers."""

from pathlib import Path

from sagnac.paper.reproduce import Reproduction
from sagnac.report.figures import write_png
from sagnac.report.files import write_text
from sagnac.report.reproduction_figures import figures_of
from sagnac.report.reproduction_page import page
from sagnac.report.reproduction_tables import tables


def write(reproduction: Reproduction, folder: Path) -> list[Path]:
    """Page, pictures and tables into `folder`; each whole or not at all.

    Returns
    -------
    list of Path
        The page first.

    Raises
    ------
    RecordingError
        If the folder cannot be written to.
    """
    written = [folder / "reproduction.html"]
    figures = figures_of(reproduction)
    for name, figure in figures.items():
        written.append(folder / f"{name}.png")
        write_png(figure, written[-1])
    for name, text in tables(reproduction).items():
        written.append(folder / f"{name}.csv")
        write_text(written[-1], text)
    write_text(written[0], page(reproduction, figures))
    return written
