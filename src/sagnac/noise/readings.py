"""Readings of the paper's Step 4, "estimate by AVAR", "in the least mean squares sense" (Eq. 3).

The paper says neither in which metric its squares are least nor over which cluster times beside its
cut at 10 %, and knows nothing of noise that goes with the lines.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, Literal

from sagnac.core.errors import require_choice

Squares = Literal["plain", "relative", "two terms"]
SHORT: Final = 20.0
"""Longest cluster time, s, at which Q and N are fitted without the slow terms."""

_WORDS: Final[Mapping[Squares, str]] = {
    "plain": "plain squares of five terms",
    "relative": "squares of five terms relative to the fitted variance",
    "two terms": f"plain squares of Q and N to {SHORT:g} s",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Reading:
    """One reading of Step 4.

    Attributes
    ----------
    squares
        ``plain``: of the residuals of the Allan variance, Eq. 3 as it stands. ``relative``: of
        residuals relative to the fitted variance. ``two terms``: plain, Q and N alone, to
        `SHORT`. No squared coefficient falls below zero in any of them.
    noise_restored
        Whether the noise that went with the lines is put back into the curve, of which the
        paper says nothing.

    Raises
    ------
    ValueError
        If `squares` is none of these.

    Examples
    --------
    >>> Reading(squares="relative", noise_restored=True).in_words
    'squares of five terms relative to the fitted variance, the noise of the lines put back'
    """

    squares: Squares = "plain"
    noise_restored: bool = False

    def __post_init__(self) -> None:
        require_choice("squares", self.squares, Squares)

    @property
    def in_words(self) -> str:
        """For the line that says what an answer rests on."""
        back = "put back" if self.noise_restored else "not put back"
        return f"{_WORDS[self.squares]}, the noise of the lines {back}"


PLAIN: Final = Reading()
ReadingName = Literal[
    "plain", "plain-restored", "relative", "relative-restored", "two-terms", "two-terms-restored"
]
READINGS: Final[Mapping[ReadingName, Reading]] = {
    "plain": PLAIN,
    "plain-restored": Reading(noise_restored=True),
    "relative": Reading(squares="relative"),
    "relative-restored": Reading(squares="relative", noise_restored=True),
    "two-terms": Reading(squares="two terms"),
    "two-terms-restored": Reading(squares="two terms", noise_restored=True),
}
"""By name; the first is the default.

Plain squares on Eq. 3 rest on the shortest cluster times, where the noise of the curve is least and
the lines took next to nothing: with all five terms they are off least (`sagnac reproduce`). Q and N
alone come as near where nothing slow is in the noise, but are not Eq. 3.
"""
