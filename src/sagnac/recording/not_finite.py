"""Samples that are NaN or infinite."""

from sagnac.arrays import FloatArray
from sagnac.errors import Note, counted
from sagnac.recording.encoder import LARGEST_SHARE_MISSING, MOST_MISSING_IN_A_ROW
from sagnac.recording.model import Recording, second_of
from sagnac.recording.soundness import remedy_of
from sagnac.recording.stretches import Places, is_not_finite


def not_finite_notes(recording: Recording, name: str, values: FloatArray) -> tuple[Note, ...]:
    """Samples of one channel, or of the time, that are NaN or infinite: an error.

    Parameters
    ----------
    recording
        It tells when a sample was taken.
    name
        Gyro name, ``table`` or ``time``.
    values
        (samples,) of that channel.
    """
    places = Places(values=values, test=is_not_finite)
    bad = places.tally()
    if bad.count == 0:
        return ()
    # Reading has interpolated what it could of a table.
    beyond = (
        f", more than can be interpolated ({MOST_MISSING_IN_A_ROW} in a row, "
        f"{100.0 * LARGEST_SHARE_MISSING:g} % of all)"
        if name == "table"
        else ""
    )
    text = (
        f"{counted(bad.count, 'sample')} NaN or infinite{beyond}, the first at "
        f"{second_of(recording, bad.first):.3f} s; "
        f"{remedy_of(recording, places.longest_between(recording.samples))}"
    )
    return (Note(name="missing", level="error", channel=name, text=text),)
