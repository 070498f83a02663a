"""The page as a PDF."""

from pathlib import Path

from sagnac.errors import MissingExtra, RecordingError
from sagnac.report.files import write_bytes


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
