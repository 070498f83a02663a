"""Lines as pictures mark them: where they stand, their colours and short names."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from sagnac.analysis.result import Analysis
from sagnac.lines.model import Line, Scale
from sagnac.plot.frame import GREEN, ORANGE

if TYPE_CHECKING:
    pass


@dataclass(frozen=True, slots=True, kw_only=True)
class ScaleStyle:
    """Colour of the lines on a scale, and what the legend calls them."""

    color: str
    label: str


LABELLED_LINES: Final = 8
SCALES: Final[Mapping[Scale, ScaleStyle]] = {
    "angle": ScaleStyle(color=ORANGE, label="line in table angle"),
    "time": ScaleStyle(color=GREEN, label="line in time"),
}


def placed_lines(analysis: Analysis) -> list[tuple[float, Line]]:
    """Each line that has a frequency, with it (Hz); strongest first."""
    turns_per_s = abs(analysis.table_rate or 0.0) / (2.0 * math.pi)
    placed = []
    for line in analysis.lines:
        if line.scale == "time":
            placed.append((line.frequency, line))
        elif turns_per_s:
            placed.append((line.frequency * turns_per_s, line))
    return placed


def short_position(line: Line) -> str:
    """Where a line stands, for a mark: its order or frequency."""
    return f"{line.frequency:.4g}×" if line.scale == "angle" else f"{line.frequency:.4g} Hz"
