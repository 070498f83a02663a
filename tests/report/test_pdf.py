"""The page as a PDF."""

import builtins
import sys
from ctypes.util import find_library

import pytest
from pypdf import PdfReader

from sagnac.core.errors import MissingExtra, RecordingError
from sagnac.report.page import page
from sagnac.report.sections import TitleBlock, write_pdf
from tests.handmade import analysis

A4 = (595.3, 841.9)  # points of 1/72 inch


def test_a_pdf_without_its_library_names_the_extra(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "weasyprint", None)
    with pytest.raises(MissingExtra, match=r"'\.\[pdf\]'"):
        write_pdf("<p>nothing</p>", tmp_path / "report.pdf")
    assert list(tmp_path.iterdir()) == []


def test_a_pdf_without_pango_says_what_to_install(monkeypatch, tmp_path):
    ordinary = builtins.__import__

    def without_pango(name, *more, **named):
        if name == "weasyprint":
            raise OSError("cannot load library 'libpango-1.0-0'")
        return ordinary(name, *more, **named)

    monkeypatch.setattr(builtins, "__import__", without_pango)
    with pytest.raises(RecordingError, match=r"without the Pango library.*libpango-1\.0-0"):
        write_pdf("<p>nothing</p>", tmp_path / "report.pdf")
    assert list(tmp_path.iterdir()) == []


# An older system library than weasyprint would like; it takes fonts whole then.
@pytest.mark.filterwarnings("ignore:HarfBuzz-Subset:DeprecationWarning")
def test_a_pdf_is_the_page_on_a4(tmp_path):
    path = tmp_path / "report.pdf"
    html = page(analysis(), block=TitleBlock(title="Acceptance of RLG 7", serial="42"))
    if find_library("pango-1.0") is None:
        # No Python package brings Pango: such a machine refuses.
        with pytest.raises(RecordingError, match="Pango"):
            write_pdf(html, path)
        assert not path.exists()
        return
    write_pdf(html, path)
    printed = PdfReader(path)
    text = "\n".join(one.extract_text() for one in printed.pages)
    for said in ("Acceptance of RLG 7", "Coefficients per gyro", "Input and settings", "Yu, Wang"):
        assert said in text
    for one in printed.pages:
        size = (float(one.mediabox.width), float(one.mediabox.height))
        assert size == pytest.approx(A4, abs=0.5)
