"""How N of a campaign scatters: each comparable group of lines through `repeatability`."""

from collections.abc import Sequence
from dataclasses import dataclass

from sagnac.errors import RecordingError
from sagnac.fleet.table import Line
from sagnac.repeatability.study import Repeatability, Run, repeatability


@dataclass(frozen=True, slots=True, kw_only=True)
class Scatter:
    """Scatter of one group.

    Attributes
    ----------
    lines
        Those that show N, in the order of the runs.
    left_out
        How many of the group do not.
    found
        The answer, deg/sqrt(h); None if the lines are too few.
    why
        Why there is none.
    """

    lines: tuple[Line, ...]
    left_out: int
    found: Repeatability | None
    why: str = ""


def scatter_of(lines: Sequence[Line], confidence: float) -> Scatter:
    """How N scatters over the units, days and rates of some lines.

    Parameters
    ----------
    lines
        Of one method and one choice of gyros.
    confidence
        Of the intervals.
    """
    shown = tuple(line for line in lines if line.status == "estimated")
    runs = [
        Run(
            value=line.n_deg_per_sqrt_h,
            low=line.low,
            high=line.high,
            confidence=line.confidence,
            labels=_labels(line),
        )
        for line in shown
    ]
    left_out = len(lines) - len(shown)
    try:
        found = repeatability(runs, confidence=confidence)
    except RecordingError as error:
        return Scatter(lines=shown, left_out=left_out, found=None, why=str(error))
    return Scatter(lines=shown, left_out=left_out, found=found)


def _labels(line: Line) -> dict[str, str]:
    stated = {"unit": line.unit, "day": line.day, "rate": f"{line.rate_deg_per_s:g}"}
    return {name: label for name, label in stated.items() if label}
