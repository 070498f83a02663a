"""Files of a report: pages from templates, the page as a PDF, its title block and its notes."""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Final, Self
from urllib.parse import quote

from jinja2 import Environment, PackageLoader, StrictUndefined, select_autoescape

from sagnac.analysis.result import Analysis, headline_fit
from sagnac.documents import ANY, read_toml, table
from sagnac.errors import MissingExtra, Note, RecordingError, ranked
from sagnac.formats.files import write_bytes

# ---- files -------------------------------------------------------------------------

# Characters that a file system takes in a name, with room for what is put before it.
_LONGEST_NAME: Final = 180


def folder_name(name: str) -> str:
    """A file name for a channel, whatever its name is: it comes out of a file.

    Examples
    --------
    >>> folder_name("x"), folder_name("../../x"), folder_name("..")
    ('x', '..%2F..%2Fx', '%2E%2E')
    """
    safe = quote(name, safe=" ")[:_LONGEST_NAME]
    return safe if safe.strip(". ") else "".join(f"%{ord(mark):02X}" for mark in safe)


# ---- html --------------------------------------------------------------------------


def rendered(template: str, **values: Any) -> str:
    """A template of the report filled in; what is not marked as safe is escaped."""
    environment = Environment(
        loader=PackageLoader("sagnac.report"),
        autoescape=select_autoescape(),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template(template).render(**values)


# ---- pdf ---------------------------------------------------------------------------


def require_pdf() -> None:
    """Refuse before the work if there is nothing to write a PDF with.

    Raises
    ------
    MissingExtra
        If weasyprint is not installed.
    RecordingError
        If the Pango library that it draws text with is not, which no Python package brings.
    """
    try:
        import weasyprint  # noqa: F401, PLC0415
    except ImportError as error:
        raise MissingExtra("report.pdf", "weasyprint", "pdf") from error
    except OSError as error:
        raise RecordingError(
            "report.pdf cannot be written without the Pango library",
            remedy="install Pango (Debian and Ubuntu: libpango-1.0-0 and libpangoft2-1.0-0; "
            "elsewhere: pango), or leave {pdf} out",
        ) from error


def write_pdf(page: str, path: Path) -> None:
    """Write a page as it prints on A4, whole or not at all; nothing is fetched for it.

    Parameters
    ----------
    page
        HTML.
    path
        Of the PDF.

    Raises
    ------
    MissingExtra
        If weasyprint is not installed.
    RecordingError
        If Pango is not installed, or the folder cannot be written to.
    """
    require_pdf()
    from weasyprint import HTML  # noqa: PLC0415

    write_bytes(path, HTML(string=page).write_pdf())


# ---- title block -------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class TitleBlock:
    """Texts on top of a report; those that are empty are left out.

    Attributes
    ----------
    title
        Of the report.
    device, serial
        The unit under test.
    customer, operator, date
        For whom, by whom and when it was measured.
    """

    title: str = ""
    device: str = ""
    serial: str = ""
    customer: str = ""
    operator: str = ""
    date: str = ""

    @classmethod
    def from_toml(cls, path: Path) -> Self:
        """As a file states it.

        Raises
        ------
        ValueError
            If it is no TOML, or has a key that is none of these.
        OSError
            If it cannot be read.
        """
        try:
            stated = read_toml(path, table({field.name: ANY for field in fields(cls)}))
        except ValueError as error:
            raise ValueError(f"heading {path}: {error}") from None
        return cls(**{key: str(value) for key, value in stated.items()})

    @property
    def facts(self) -> list[tuple[str, str]]:
        """Statements besides the title, each with its name."""
        named = (
            ("Unit", self.device),
            ("Serial number", self.serial),
            ("Customer", self.customer),
            ("Operator", self.operator),
            ("Date", self.date),
        )
        return [(name, value) for name, value in named if value]


# ---- placed notes ------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class PlacedNotes:
    """The notes of an analysis, each once.

    Attributes
    ----------
    answer
        What touches the answer: errors and warnings first.
    reading
        Remarks on how the file was read.
    curve
        On the curve.
    fits
        On fits that the answer does not rest on.
    """

    answer: tuple[Note, ...]
    reading: tuple[Note, ...]
    curve: tuple[Note, ...]
    fits: tuple[Note, ...]


def placed_notes(analysis: Analysis, others: Sequence[Analysis] = ()) -> PlacedNotes:
    """Tell the notes of an analysis apart by what they are of.

    Parameters
    ----------
    analysis
        Whose notes.
    others
        Analyses whose curves and fits it has notes on, besides its own.
    """
    everyone = (analysis, *others)
    of_curves = {note for one in everyone for note in one.curve.notes}
    of_fits = {note for one in everyone for note in _on_other_fits(one)} - of_curves
    of_reading = {note for note in analysis.recording.notes if note.level == "remark"}
    of_reading -= of_curves | of_fits
    ordered = ranked(analysis.notes)
    return PlacedNotes(
        answer=tuple(note for note in ordered if note not in of_curves | of_fits | of_reading),
        reading=tuple(note for note in ordered if note in of_reading),
        curve=tuple(note for note in ordered if note in of_curves),
        fits=tuple(note for note in ordered if note in of_fits),
    )


def _on_other_fits(analysis: Analysis) -> list[Note]:
    """Notes on fits to the curve that the answer does not rest on."""
    resting = headline_fit(analysis)
    fits = [fit for name, fit in analysis.fits.items() if name != "likelihood"]
    return [note for fit in fits if fit is not resting for note in fit.notes]
