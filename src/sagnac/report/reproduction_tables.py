"""The paper's tables and curves as CSV, and both tables for a terminal; units in the headers."""

import math

from sagnac.paper.least_squares import FORMS
from sagnac.paper.published import FIGURE_3
from sagnac.paper.reproduce import Outcome, Reproduction
from sagnac.report.reproduction_values import (
    TABLES,
    PaperTable,
    cell_texts,
    cells_of,
    curves_of,
    white_deviation,
)
from sagnac.report.tables import cell, csv_text
from sagnac.report.text import table
from sagnac.units import ARCSECOND, DEGREE, DEGREE_PER_ROOT_HOUR

_ESTIMATE = (
    "estimate[deg/sqrt(h)]",
    "low[deg/sqrt(h)]",
    "high[deg/sqrt(h)]",
    "confidence",
    "status",
    "truth[deg/sqrt(h)]",
)


def tables(reproduction: Reproduction) -> dict[str, str]:
    """CSV by name; units stand in the header."""
    return {
        **{name: _table(reproduction, name) for name in TABLES},
        "figure3_trials": _trials(reproduction),
        **{figure: _curves(outcomes) for figure, outcomes in curves_of(reproduction).items()},
        "table_rate": _table_rate(reproduction),
    }


def summary(reproduction: Reproduction) -> str:
    """Both tables for a terminal: estimates, interval, truth and the paper's number."""
    blocks = []
    for name, size in TABLES.items():
        rows = []
        for rate, day, published, outcome, by_paper in cells_of(reproduction, name):
            texts = cell_texts(published, outcome, size, by_paper)
            shown = ("value", "range", "truth", "error", "by_paper", "paper")
            rows.append((f"{rate:g}", str(day), *(texts[key] for key in shown)))
        text = table(
            (
                "deg/s",
                "day",
                "estimate",
                "95 % interval",
                "truth",
                "error",
                "paper's method",
                "paper",
            ),
            rows,
            right=(0, 1, 2, 4, 5, 6, 7),
        )
        blocks.append(f"Table {name[-1]}, N per gyro, {size:g} deg/sqrt(h)\n{text}")
    return "\n\n".join(blocks)


def _table(reproduction: Reproduction, name: PaperTable) -> str:
    return csv_text(
        (
            "table_rate[deg/s]",
            "day",
            "paper[deg/sqrt(h)]",
            *_ESTIMATE,
            "error",
            "lines",
            "seed",
            "by_paper_method[deg/sqrt(h)]",
            "by_paper_method_status",
            "by_paper_method_error",
            "duration[s]",
        ),
        [
            [
                cell(rate),
                str(day),
                cell(published),
                *_estimate(outcome),
                cell(outcome.value / outcome.truth_deg_per_sqrt_h - 1.0),
                str(outcome.lines),
                str(outcome.seed),
                cell(by_paper.value),
                by_paper.status,
                cell(by_paper.value / outcome.truth_deg_per_sqrt_h - 1.0),
                cell(outcome.duration_s),
            ]
            for rate, day, published, outcome, by_paper in cells_of(reproduction, name)
        ],
    )


def _trials(reproduction: Reproduction) -> str:
    return csv_text(
        (
            "trial",
            "interval[s]",
            "paper[deg/sqrt(h)]",
            *(f"{form.replace(', ', ' ')}[deg/sqrt(h)]" for form in FORMS),
            *_ESTIMATE,
        ),
        [
            [
                trial.name,
                cell(interval),
                cell(published),
                *(cell(outcome.least_squares.get(form, math.nan)) for form in FORMS),
                *_estimate(outcome),
            ]
            for trial in reproduction.trials
            for interval, published in FIGURE_3.items()
            for outcome in (reproduction.outcomes[f"figure3-{trial.name}-{interval:g}s"],)
        ],
    )


def _curves(outcomes: list[Outcome]) -> str:
    return csv_text(
        ("run", "tau[s]", "deviation[deg/h]", "low[deg/h]", "high[deg/h]", "truth[deg/h]"),
        [
            [
                outcome.name,
                *(cell(value) for value in point),
                cell(float(white_deviation(outcome.truth_deg_per_sqrt_h, point[0]))),
            ]
            for outcome in outcomes
            for point in zip(
                outcome.tau_s,
                outcome.deviation,
                outcome.low_curve,
                outcome.high_curve,
                strict=True,
            )
        ],
    )


def _table_rate(reproduction: Reproduction) -> str:
    prediction = reproduction.prediction
    parts = {
        "total[deg/sqrt(h)]": prediction.total / DEGREE_PER_ROOT_HOUR,
        "quantum[deg/sqrt(h)]": prediction.quantum / DEGREE_PER_ROOT_HOUR,
        "lock_in[deg/sqrt(h)]": prediction.lock_in / DEGREE_PER_ROOT_HOUR,
        "quantization[arcsec]": prediction.quantization / ARCSECOND,
        "encoder[arcsec]": prediction.encoder / ARCSECOND,
        "jitter[arcsec]": prediction.jitter / ARCSECOND,
    }
    return csv_text(
        ("table_rate[deg/s]", *parts),
        [
            [cell(rate / DEGREE), *(cell(part[index]) for part in parts.values())]
            for index, rate in enumerate(prediction.rates)
        ],
    )


def _estimate(outcome: Outcome) -> list[str]:
    return [
        cell(outcome.value),
        cell(outcome.low),
        cell(outcome.high),
        cell(outcome.confidence),
        outcome.status,
        cell(outcome.truth_deg_per_sqrt_h),
    ]
