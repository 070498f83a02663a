"""An analysis as others see it: pictures, JSON, tables and a page a person can read.

Notes and errors name an input of the package as an option of the command line.
"""

import textwrap
from collections.abc import Iterable
from dataclasses import asdict

from sagnac.core.errors import Note, RecordingError, worded


def as_option(name: str, value: str) -> str:
    """An input as it is typed.

    Examples
    --------
    >>> as_option("slice", "30:90")
    '--slice 30:90'
    >>> as_option("table", "")
    '--table'
    """
    return f"--{name} {value}" if value else f"--{name}"


def as_typed(text: str) -> str:
    """A text with the inputs that it names in braces as they are typed.

    Examples
    --------
    >>> as_typed("take the sound stretch ({slice 30:90})")
    'take the sound stretch (--slice 30:90)'
    """
    return worded(text, as_option)


def note_text(note: Note) -> str:
    """One line: the channel, if the note names one, and what was noticed."""
    return as_typed(f"{note.channel}: {note.text}" if note.channel else note.text)


def findings_data(findings: Iterable[Note]) -> list[dict[str, str | float | None]]:
    """Findings as plain data: name, channel, level, text, and effect as a factor on N or None."""
    return [{**asdict(note), "text": as_typed(note.text)} for note in findings]


def wrapped(text: str) -> str:
    """A paragraph of 80 columns, its further lines indented."""
    return textwrap.fill(
        text, 80, subsequent_indent="  ", break_long_words=False, break_on_hyphens=False
    )


def error_text(error: RecordingError) -> str:
    """One line: the file, the channel, what is wrong and the remedy."""
    return error.line(as_option)
