"""Numbers of the reproduction that tables, figures and page share."""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from sagnac.arrays import BooleanArray, FloatArray
from sagnac.coefficients.readings import ReadingName
from sagnac.paper.least_squares import Form
from sagnac.paper.outcome import PAPER_POINT_ERROR
from sagnac.paper.published import FIGURE_3
from sagnac.paper.reproduce import Cell, Outcome, Reproduction, outcomes_of_table
from sagnac.report.quantities import number
from sagnac.stability.degrees_of_freedom import ieee_relative_error

PaperTable = Literal["table1", "table2"]

# The size in deg/sqrt(h) that the paper's tables are in units of.
TABLES: Final[Mapping[PaperTable, float]] = {"table1": 1e-4, "table2": 1e-5}
# N of a white rate at tau = 1 s in deg/h is 60 of its figure in deg/sqrt(h).
_ROOT_SECONDS_IN_HOUR: Final = 60.0


def curves_of(reproduction: Reproduction) -> dict[str, list[Outcome]]:
    """The runs whose curves each figure shows."""
    outcomes = reproduction.outcomes
    return {
        "figure2": [outcomes["figure2-day1"], outcomes["table2-40-day1"]],
        "figure3": [outcomes[f"figure3-as-simulated-{interval:g}s"] for interval in FIGURE_3],
        "figure4": [outcomes["table1-0-day1-paper"]],
        "figure5": [outcomes["table1-40-day1-paper"]],
        "figure6": [outcomes["table2-40-day1-paper"]],
    }


def white_deviation(deg_per_sqrt_h: float, tau: FloatArray | float) -> FloatArray:
    """Allan deviation of a white rate in deg/h."""
    return np.asarray(deg_per_sqrt_h * _ROOT_SECONDS_IN_HOUR / np.sqrt(tau))


def excess(outcome: Outcome) -> float:
    """How many times the curve stands above the white rate that was simulated, at most."""
    return float(
        np.max(
            np.array(outcome.deviation)
            / white_deviation(outcome.truth_deg_per_sqrt_h, np.array(outcome.tau_s))
        )
    )


def cells_of(reproduction: Reproduction, table: PaperTable) -> list[Cell]:
    """Cells of a table: rate in deg/s, day, the published N, and what came out of both methods."""
    return list(outcomes_of_table(reproduction, table))


def estimated(reproduction: Reproduction, table: PaperTable, above: float) -> list[float]:
    """Estimates of a table above a table rate, without bounds."""
    return [
        one.outcome.value
        for one in cells_of(reproduction, table)
        if one.rate > above and one.outcome.status == "estimated"
    ]


Order = Literal["by_paper", "as_printed"]
ORDERS: Final[Mapping[Order, str]] = {
    "by_paper": "difference first",
    "as_printed": "the paper's order",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class ReadingErrors:
    """How far N by one reading of Step 4 is off the truth, over the turning cells of a table.

    Attributes
    ----------
    mean, rms
        Relative error; NaN of no cell.
    shown, cells
        Cells whose curve is long enough for the reading, and all.
    """

    mean: float
    rms: float
    shown: int
    cells: int


def errors_of_reading(cells: Sequence[Cell], order: Order, reading: ReadingName) -> ReadingErrors:
    """Errors over the cells on a turning table."""
    turning = [one for one in cells if one.rate > 0.0]
    errors = [reading_error(one, order, reading) for one in turning]
    known = np.array([error for error in errors if math.isfinite(error)])
    return ReadingErrors(
        mean=float(known.mean()) if known.size else math.nan,
        rms=float(np.sqrt(np.mean(known**2))) if known.size else math.nan,
        shown=known.size,
        cells=len(turning),
    )


def reading_error(one: Cell, order: Order, reading: ReadingName) -> float:
    """Relative error of N by a reading; NaN of a curve too short for it."""
    outcome = one.by_paper if order == "by_paper" else one.as_printed
    return outcome.readings[reading] / outcome.truth_deg_per_sqrt_h - 1.0


def turning_over_rest(cells: Sequence[Cell], value: Callable[[Cell], float]) -> float:
    """The paper's check of validity: mean N on the turning table over mean N at rest (Table 1)."""
    turning, rest = (
        mean(found for one in group if math.isfinite(found := value(one)))
        for group in (
            [one for one in cells if one.rate > 0.0],
            [one for one in cells if one.rate == 0.0],
        )
    )
    return turning / rest


def mean(values: Iterable[float]) -> float:
    """Mean, NaN of nothing."""
    found = list(values)
    return sum(found) / len(found) if found else math.nan


def spread(values: Sequence[float]) -> str:
    """Smallest and largest, once if they are the same."""
    if not values:
        return "–"
    return " … ".join(number(value) for value in sorted({min(values), max(values)}))


def intervals_of(reproduction: Reproduction, trial: str) -> list[Outcome]:
    """The runs of a trial, one for each interval of Figure 3."""
    return [reproduction.outcomes[f"figure3-{trial}-{interval:g}s"] for interval in FIGURE_3]


def readings(reproduction: Reproduction, trial: str, form: Form) -> list[str]:
    """N by least squares at each interval, 1e-4 deg/sqrt(h)."""
    return [
        f"{outcome.least_squares[form] * 1e4:.1f}" if form in outcome.least_squares else "–"
        for outcome in intervals_of(reproduction, trial)
    ]


def growth(reproduction: Reproduction, trial: str) -> list[str]:
    """N at the longer intervals over N at the first.

    By the form in which no square may be below zero.
    """
    first, *rest = (
        outcome.least_squares.get("variance, plain, none below zero", math.nan)
        for outcome in intervals_of(reproduction, trial)
    )
    return [f"{value / first:.1f}" if first else "–" for value in rest]


def within_cut(outcome: Outcome) -> BooleanArray:
    """(points,) of the curve that the paper shows: those with an error of 10 % or less."""
    points = round(outcome.duration_s / outcome.interval_s)
    clusters = np.round(np.array(outcome.tau_s) / outcome.interval_s).astype(int)
    errors = [ieee_relative_error(points - 1, int(cluster)) for cluster in clusters]
    return np.array(errors) <= PAPER_POINT_ERROR


def cell_texts(
    published: float, outcome: Outcome, size: float, by_paper: Outcome | None = None
) -> dict[str, str]:
    """One cell in units of `size` deg/sqrt(h); with it that of the paper's method."""
    truth = outcome.truth_deg_per_sqrt_h
    row = {
        "paper": f"{published / size:.2f}",
        "truth": f"{truth / size:.3f}",
        "value": "–",
        "range": outcome.status,
        "error": "–",
        "by_paper": "–",
    }
    if outcome.status == "estimated":
        row["value"] = f"{outcome.value / size:.3f}"
        row["range"] = f"{outcome.low / size:.3f} … {outcome.high / size:.3f}"
        row["error"] = f"{100.0 * (outcome.value / truth - 1.0):+.1f} %"
    elif outcome.status == "upper bound":
        row["value"] = f"< {outcome.high / size:.3f}"
    if by_paper is not None and math.isfinite(by_paper.value):
        below = "< " if by_paper.status == "upper bound" else ""
        off = f"{100.0 * (by_paper.value / truth - 1.0):+.1f} %"
        row["by_paper"] = f"{below}{by_paper.value / size:.3f} ({off})"
    return row
