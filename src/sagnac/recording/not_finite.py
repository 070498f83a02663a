"""Samples that are NaN or infinite, or as good as that."""

from typing import Final

from sagnac.arrays import BooleanArray, FloatArray
from sagnac.errors import Note, counted
from sagnac.recording.encoder_readings import LARGEST_SHARE_MISSING, MOST_MISSING_IN_A_ROW
from sagnac.recording.model import Recording, second_of
from sagnac.recording.soundness import remedy_of
from sagnac.recording.stretches import Places, is_not_finite

# rad, rad/s or s: nothing is so large, and squares of what is larger end beyond all numbers.
_LARGEST: Final = 1e30


def not_finite_notes(recording: Recording, name: str, values: FloatArray) -> tuple[Note, ...]:
    """Samples of one channel, or of the time, that are NaN, infinite or beyond 1e30: an error.

    Parameters
    ----------
    recording
        It tells when a sample was taken.
    name
        Gyro name, ``table`` or ``time``.
    values
        (samples,) of that channel.
    """
    places = Places(values=values, test=_is_no_number)
    bad = places.tally()
    if bad.count == 0:
        return ()
    not_finite = Places(values=values, test=is_not_finite).tally().count
    what = "NaN or infinite" if not_finite == bad.count else f"NaN, infinite or beyond {_LARGEST:g}"
    # Reading has interpolated what it could of a table.
    beyond = (
        f", more than can be interpolated ({MOST_MISSING_IN_A_ROW} in a row, or as long as a gyro "
        f"tells the turn; {100.0 * LARGEST_SHARE_MISSING:g} % of all)"
        if name == "table"
        else ""
    )
    text = (
        f"{counted(bad.count, 'sample')} {what}{beyond}, the first at "
        f"{second_of(recording, bad.first):.3f} s; "
        f"{remedy_of(recording, places.longest_between(recording.samples))}"
    )
    return (Note(name="missing", level="error", channel=name, text=text),)


def _is_no_number(values: FloatArray) -> BooleanArray:
    """Whether values are NaN, infinite, or beyond what anything turns."""
    return ~((values < _LARGEST) & (values > -_LARGEST))
