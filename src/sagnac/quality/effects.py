"""Effect of a fault of the data on the angle random walk: level and words of a note."""

import math
from typing import Final

from sagnac.core.errors import Level, Note, rounded

# Findings whose factor on N is known well enough to be divided by: half of the change is then in
# doubt, and the answer's interval is wider by it on either side.
DIVIDED: Final = ("clipping", "dropouts", "repeats", "resolution")
# Findings that may be sound noise as well: an interval reaches from N as it is read to N divided
# by the factor, which is in doubt as above.
SPANNED: Final = ("short-tails", "high-pass")


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
    if name in DIVIDED and level == "warning" and effect_words(known) != effect_words(1.0):
        text = f"{text}, and an answer is divided by that"
    return Note(name=name, channel=channel, level=level, text=text, effect=known)
