"""Inputs of the package as options of the command line."""

import pytest

from sagnac.core.errors import Note, RecordingError
from sagnac.report import as_typed, error_text, note_text


@pytest.mark.parametrize(
    ("text", "typed"),
    [
        ("name its encoder ({table})", "name its encoder (--table)"),
        ("{slice 30:90} or {time none}", "--slice 30:90 or --time none"),
        ("nothing to name", "nothing to name"),
    ],
)
def test_inputs_are_options(text, typed):
    assert as_typed(text) == typed
    assert note_text(Note(text=text)) == typed


def test_notes_and_errors_begin_with_what_they_are_about():
    assert note_text(Note(text="is stuck", channel="x", level="error")) == "x: is stuck"
    error = RecordingError("is stuck", path="a.csv", channel="x", remedy="give {gyros y,z}")
    assert error_text(error) == "a.csv: x: is stuck; give --gyros y,z"
