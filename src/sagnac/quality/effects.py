"""Words of a finding: what was seen, what it does to the angle random walk, and the remedy."""

import math
from typing import Final

import numpy as np

from sagnac.core.arrays import BooleanArray, IntegerArray
from sagnac.core.errors import Level, Note, counted, rounded
from sagnac.core.marks import longest_unmarked
from sagnac.recording.model import MINIMUM_SAMPLES, Recording, second_of

# Findings whose factor on N is known well enough to be divided by: half of the change is then in
# doubt, and the answer's interval is wider by it on either side.
DIVIDED: Final = ("clipping", "dropouts", "repeats", "resolution")
# Findings that may be sound noise as well: an interval reaches from N as it is read to N divided
# by the factor, which is in doubt as above.
SPANNED: Final = ("short-tails", "high-pass")
# Remedy where a part of the record is sound.
STRETCH: Final = "take a sound stretch ({slice})"


def doubt_of(effect: float) -> float:
    """Relative error that is left if an answer is divided by a factor on it."""
    return 0.5 * abs(effect - 1.0)


def level_of(effect: float | None, name: str = "") -> Level:
    """``error`` if N may be off by more than 5 %, or nobody knows by how much; else ``warning``.

    Parameters
    ----------
    effect
        Factor on N, or None.
    name
        Of the finding: some are divided by, and half of their change is left.
    """
    if effect is None:
        return "error"
    left = doubt_of(effect) if name in DIVIDED else abs(effect - 1.0)
    # Beyond 5 % an answer is not given as an estimate.
    return "warning" if left <= 0.05 else "error"


def effect_words(effect: float | None) -> str:
    """``the angle random walk comes out about 0.72 times its value``."""
    if effect is None or not math.isfinite(effect):
        return "what that does to the angle random walk is not known"
    if abs(effect - 1.0) < 0.005:
        return "the angle random walk moves by less than 1 %"
    return f"the angle random walk comes out about {rounded(effect, 3)} times its value"


def finding(
    name: str, channel: str, text: str, *, effect: float | None, level: Level | None = None
) -> Note:
    """A note on a fault, with its effect in words.

    Parameters
    ----------
    name
        One word for the fault.
    channel
        Gyro name or ``table``.
    text
        What was seen, and the remedy if there is one.
    effect
        Factor on N, about; None if it is not known.
    level
        By the effect unless given.
    """
    # Four digits are more than any of them is worth.
    known = float(f"{effect:.4g}") if effect is not None and math.isfinite(effect) else None
    level = level or level_of(known, name)
    text = f"{text}; {effect_words(known)}"
    stated = known is not None and effect_words(known) != effect_words(1.0)
    if name in DIVIDED and level != "error" and stated:
        text = f"{text}, and an answer is divided by that"
    return Note(name=name, channel=channel, level=level, text=text, effect=known)


# ---- places and remedies ------------------------------------------------------------


def seen(recording: Recording, marks: BooleanArray | IntegerArray, noun: str, rest: str) -> str:
    """``12 samples of exactly zero, the first at 3.500 s``.

    Parameters
    ----------
    recording
        It tells when a sample was taken.
    marks
        Samples, as booleans (samples,) or by their numbers.
    noun, rest
        Of one of them, and what is said of them.
    """
    places = np.flatnonzero(marks) if marks.dtype == np.bool_ else marks
    when = second_of(recording, int(places[0]))
    return f"{counted(places.size, noun)} {rest}, the first at {when:.3f} s"


def remedy_of(recording: Recording, stretch: slice) -> str:
    """Remedy if only this stretch is sound: ``take the sound stretch with {slice 30:90}``.

    Rounded inwards to ms, so that the slice named holds no sample outside the stretch.
    """
    first, last = stretch.start, stretch.stop - 1
    begin = 0.0 if first == 0 else second_of(recording, first) * 1e3
    # Stamps of a damaged file may be any number.
    if stretch.stop - first < MINIMUM_SAMPLES or not math.isfinite(begin):
        return "get the file again from its source"
    stop = "" if last == recording.samples - 1 else f"{second_of(recording, last):.3f}"
    return f"take the sound stretch with {{slice {math.ceil(begin) / 1e3:g}:{stop}}}"


def remedy_without(recording: Recording, bad: BooleanArray | IntegerArray) -> str:
    """Remedy if some samples are bad, given as booleans (samples,) or by their numbers."""
    marks = np.zeros(recording.samples, dtype=np.bool_)
    marks[bad] = True
    return remedy_of(recording, longest_unmarked(marks))
