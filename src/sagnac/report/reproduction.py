"""The reproduction of the paper as files: one page, pictures and tables of numbers."""

from pathlib import Path

from sagnac.formats.files import replacing_folder
from sagnac.paper.reproduce import Reproduction
from sagnac.report.figures import write_png
from sagnac.report.files import write_text
from sagnac.report.reproduction_figures import figures_of
from sagnac.report.reproduction_page import page
from sagnac.report.reproduction_tables import tables


def write(reproduction: Reproduction, folder: Path) -> list[Path]:
    """Page, pictures and tables into `folder`, all of them or none; what else it has stays.

    Returns
    -------
    list of Path
        The page first.

    Raises
    ------
    RecordingError
        If the folder cannot be written to.
    """
    names = ["reproduction.html"]
    figures = figures_of(reproduction)
    with replacing_folder(folder) as new:
        for name, figure in figures.items():
            names.append(f"{name}.png")
            write_png(figure, new / names[-1])
        for name, text in tables(reproduction).items():
            names.append(f"{name}.csv")
            write_text(new / names[-1], text)
        write_text(new / names[0], page(reproduction, figures))
    return [folder / name for name in names]
