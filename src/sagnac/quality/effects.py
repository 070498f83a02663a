"""Effect of a fault of the data on the angle random walk: level and words of a note."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from sagnac.core.errors import Level, Note, rounded

# Change of N beyond which an answer is not given as an estimate.
MOVES: Final = 0.05
# Findings whose factor on N is known well enough to be divided by: half of the change is then in
# doubt, and the answer's interval is wider by it on either side.
DIVIDED: Final = ("clipping", "dropouts", "repeats", "resolution")


@dataclass(frozen=True, slots=True, kw_only=True)
class Fault:
    """A fault of recordings that detectors find.

    Attributes
    ----------
    sees
        What is seen in the data.
    effect
        What it does to N.
    remedy
        What to do; inputs of the package in braces (see `sagnac.core.errors.worded`).
    is_accepted
        Whether a caller may take it knowingly; else nothing can be read.
    """

    sees: str
    effect: str
    remedy: str
    is_accepted: bool = True


_STRETCH: Final = "take a stretch without ({slice})"
# By name: what is seen, what it does to N, and what to do.
_TABLE: Final = (
    ("clipping", "samples at a limit of the range, or fewer large ones than noise has",
     "lowers N", f"take a wider range, or {_STRETCH[5:]}"),
    ("copy", "a gyro that repeats another, at once or later",
     "the difference of the two hides the noise that they share", "name another gyro ({gyros})"),
    ("dropouts", "samples of exactly zero far from the mean", "raises N",
     "mark lost samples as NaN"),
    ("encoder", "a table encoder that the gyros do not follow, or that jumps where they do not",
     "N of a single gyro holds the encoder's error", "state its column and unit ({table})"),
    ("interleaved", "samples of several sensors by turns in one column", "N is of none of them",
     "write each into a column of its own"),
    ("lost", "rows that are missing from the file, seen by the table's angle",
     "lines in time break there", _STRETCH),
    ("motion", "turns on what is read as a still bench", "the motion counts as noise",
     "state the encoder ({table}), or take a stretch at rest ({slice})"),
    ("repeats", "samples, or long stretches, that repeat earlier ones",
     "held samples lower the noise between samples; a copied stretch counts twice", _STRETCH),
    ("resolution", "steps of the readout beside the scatter from sample to sample",
     "N is in part the steps", "read out finer, and store in double precision"),
    ("shared", "noise that two gyros have in common", "their difference hides it",
     "see each alone ({gyros})"),
    ("spikes", "samples far off their neighbours, or noise that is no even noise",
     "left in, they raise N; an answer goes without them if they are few", _STRETCH),
    ("steps", "a rate or an angle that jumps once or a few times", "raises N at long times",
     _STRETCH),
    ("units", "rates, means, noises or a table that another unit, kind or rate would explain",
     "N is wrong by the same factor", "state {unit}, {kind} and {rate}"),
    ("unsteady", "noise that changes or grows in the course of the record",
     "N is a mean of several", "take an even stretch ({slice})"),
    ("warm-up", "a rate that settles in the course of the record",
     "none: it is taken off for the answer, and stays in the curve",
     "leave it out ({slice}), or fit it beside a column of temperature ({covariates})"),
    ("wraps", "a counter that starts over, or signed counts that are read as unsigned",
     "N is of the leaps", "state the width of the counter ({counter-bits})"),
)  # fmt: skip
_REFUSED: Final = (
    ("gaps", "time stamps that jump, stand still or run back", "nothing is read", _STRETCH),
    ("missing", "samples that are no finite numbers", "nothing is read of that gyro", _STRETCH),
    ("stuck", "a gyro that gives one value for a while", "nothing is read of that gyro", _STRETCH),
)
FAULTS: Final[Mapping[str, Fault]] = {
    name: Fault(sees=sees, effect=effect, remedy=remedy, is_accepted=rows is _TABLE)
    for rows in (_TABLE, _REFUSED)
    for name, sees, effect, remedy in rows
}
"""What detectors find, by name."""
# What is found in recordings that are sound enough to be read, by name.
FINDINGS: Final = tuple(name for name, fault in FAULTS.items() if fault.is_accepted)


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
    return "warning" if left <= MOVES else "error"


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
    is_divided = name in DIVIDED and level == "warning" and effect_words(known) != effect_words(1.0)
    taken_off = ", and an answer is divided by that" if is_divided else ""
    return Note(
        name=name,
        channel=channel,
        level=level,
        text=f"{text}; {effect_words(known)}{taken_off}",
        effect=known,
    )
