"""What a fault of the data does to the angle random walk, as the level and the words of a note."""

import math
from typing import Final

from sagnac.errors import Level, Note

# Change of N beyond which an answer is not given as an estimate.
MOVES: Final = 0.05

# What is found in recordings that are sound enough to be read, by name.
FINDINGS: Final = (
    "clipping",
    "copy",
    "dropouts",
    "encoder",
    "repeats",
    "resolution",
    "shared",
    "spikes",
    "steps",
    "units",
    "unsteady",
    "warm-up",
    "wraps",
)


def level_of(effect: float | None) -> Level:
    """``error`` if N moves by more than 5 %, or nobody knows by how much; else ``warning``."""
    return "warning" if effect is not None and abs(effect - 1.0) <= MOVES else "error"


def effect_words(effect: float | None) -> str:
    """``the angle random walk comes out about 0.72 times its value``."""
    if effect is None or not math.isfinite(effect):
        return "what that does to the angle random walk is not known"
    if abs(effect - 1.0) < 0.005:
        return "the angle random walk moves by less than 1 %"
    return f"the angle random walk comes out about {effect:.3g} times its value"


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
    return Note(
        name=name,
        channel=channel,
        level=level or level_of(known),
        text=f"{text}; {effect_words(known)}",
        effect=known,
    )
