"""One screen: coefficients of the answer, strongest lines, ranked notes, a closing table.

No line is wider than 80 columns.
"""

import textwrap
from collections.abc import Sequence
from typing import Final

from sagnac.analysis.headline_coefficients import headline_coefficients
from sagnac.analysis.judgement import verdict_of
from sagnac.analysis.result import Analysis
from sagnac.coefficients.laws import COEFFICIENT_NAMES, SYMBOLS
from sagnac.errors import Note, counted, ranked
from sagnac.report.command_line import note_text
from sagnac.report.placed_notes import placed_notes
from sagnac.report.quantities import TITLES, line_amplitude, line_position, reading_cells
from sagnac.report.text import table
from sagnac.units import field_unit

COLUMNS: Final = 80
_MOST_LINES: Final = 5
_MOST_REMARKS: Final = 4


def wrapped(text: str, indent: str = "  ") -> str:
    """A paragraph of 80 columns, its further lines indented."""
    return textwrap.fill(
        text, COLUMNS, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False
    )


def coefficients(analysis: Analysis) -> str:
    """Q, N, B, K and R beside the answer, in the field's units; empty if there are none."""
    found = headline_coefficients(analysis)
    rows = [
        (
            f"{SYMBOLS[name]} {TITLES[name].lower()}",
            *reading_cells(name, found[name])[:2],
            field_unit(name).symbol,
            found[name].status,
        )
        for name in COEFFICIENT_NAMES
        if name in found
    ]
    return table(("coefficient", "value", "interval", "unit", "status"), rows) if rows else ""


def lines(analysis: Analysis) -> str:
    """How many periodic components there are, and the strongest five."""
    if not analysis.fits:
        return ""
    if not analysis.lines:
        return wrapped(f"No periodic component was found in {analysis.channel}.")
    shown = analysis.lines[:_MOST_LINES]
    rows = [
        (line_position(line), *line_amplitude(line), line.channel, _short(line.name))
        for line in shown
    ]
    listed = table(("periodic", "amplitude ″", "± ″", "channel", "known as"), rows, right=(1, 2))
    more = len(analysis.lines) - len(shown)
    if not more:
        return listed
    return f"{listed}\n… and {counted(more, 'weaker line')}: sagnac lines shows all"


def _short(name: str) -> str:
    return name if len(name) <= 32 else f"{name[:31]}…"


def notes(analysis: Analysis, others: Sequence[Analysis] = ()) -> str:
    """Every warning on the answer, and four remarks on it at most.

    Notes on the curve and on fits that a screen does not show are only counted.

    Parameters
    ----------
    analysis
        Whose notes.
    others
        Analyses whose curves and fits it has notes on, besides its own.
    """
    placed = placed_notes(analysis, others)
    ordered = (*placed.answer, *placed.reading)
    urgent = [note for note in ordered if note.level != "remark"]
    shown = (*urgent, *ordered[len(urgent) :][:_MOST_REMARKS])
    said = [_levelled(note) for note in shown]
    more = len(set(analysis.notes)) - len(shown)
    if more:
        said.append(f"… and {counted(more, 'further note')}: --curve or the report shows all")
    return "\n".join(said)


def every_note(noticed: Sequence[Note]) -> str:
    """Errors, warnings and remarks, in that order."""
    return "\n".join(_levelled(note) for note in ranked(noticed))


def _levelled(note: Note) -> str:
    return wrapped(f"{note.level}: {note_text(note)}")


def closing(named: Sequence[tuple[str, Analysis]]) -> str:
    """One row for each gyro of several analyses, or of several gyros; empty for one alone.

    Parameters
    ----------
    named
        Name of the file, empty if all are of one, and its analysis.
    """
    if len(named) < 2 and not any(analysis.gyros for _, analysis in named):
        return ""
    rows = [row for file, analysis in named for row in _closing_rows(file, analysis)]
    unit = field_unit("angle_random_walk").symbol
    return table(("file", "gyro", f"N {unit}", "interval", "status", "verdict"), rows)


def _closing_rows(file: str, analysis: Analysis) -> list[tuple[str, ...]]:
    verdict = verdict_of(analysis)
    decisions = {} if verdict is None else dict(verdict.by_gyro)
    estimates = dict(analysis.per_gyro) or {analysis.channel: analysis.angle_random_walk}
    named = file if len(file) <= 24 else f"…{file[-23:]}"
    rows: list[tuple[str, ...]] = [
        (
            named,
            name,
            *reading_cells("angle_random_walk", estimate),
            decisions.get(name, verdict.decision if verdict else ""),
        )
        for name, estimate in estimates.items()
    ]
    return rows + [
        (named, name, "–", "", "not analyzed", decisions.get(name, ""))
        for name in analysis.settings.gyros
        if name in analysis.refused
    ]
