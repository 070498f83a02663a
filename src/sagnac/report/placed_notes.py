"""Which notes stand beside the answer, and which beside what they are of."""

from collections.abc import Sequence
from dataclasses import dataclass

from sagnac.analysis.headline_coefficients import headline_fit
from sagnac.analysis.result import Analysis
from sagnac.errors import Note, ranked


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
