"""The paper's tables and curves as CSV, and both tables for a terminal; units in the headers."""

import math

from sagnac.coefficients.readings import READINGS
from sagnac.paper.least_squares import FORMS
from sagnac.paper.published import FIGURE_3
from sagnac.paper.reproduce import Cell, Outcome, Reproduction
from sagnac.report.reproduction_values import (
    ORDERS,
    TABLES,
    PaperTable,
    ReadingErrors,
    cell_texts,
    cells_of,
    curves_of,
    errors_of_reading,
    turning_over_rest,
    white_deviation,
)
from sagnac.report.tables import cell, csv_text
from sagnac.report.text import table
from sagnac.units import ARCSECOND, DEGREE, DEGREE_PER_ROOT_HOUR

_UNIT = "[deg/sqrt(h)]"
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
        for one in cells_of(reproduction, name):
            rate, day = one.rate, one.day
            texts = cell_texts(one.published, one.outcome, size, one.by_paper)
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
    return "\n\n".join((*blocks, _readings_text(reproduction), _validity_text(reproduction)))


def _readings_text(reproduction: Reproduction) -> str:
    """Error of each reading of Step 4 on the turning table, for a terminal."""
    rows = []
    for reading in READINGS:
        errors = [
            errors_of_reading(cells_of(reproduction, name), order, reading)
            for order in ORDERS
            for name in TABLES
        ]
        rows.append((reading, *(_error_text(one) for one in errors)))
    head = (f"Table {name[-1]}, {order}" for order in ORDERS.values() for name in TABLES)
    text = table(("Step 4", *head), rows, right=(1, 2, 3, 4))
    return f"The paper's method on the turning table, error in % (mean / rms)\n{text}"


def _error_text(errors: ReadingErrors) -> str:
    if not errors.shown:
        return "no N"
    lacking = errors.cells - errors.shown
    text = f"{100.0 * errors.mean:+.1f} / {100.0 * errors.rms:.1f}"
    return f"{text}, {lacking} without" if lacking else text


def _validity_text(reproduction: Reproduction) -> str:
    """The check of validity, turning over rest."""
    cells = cells_of(reproduction, "table1")
    parts = {
        "the paper": turning_over_rest(cells, lambda one: one.published),
        "truth": turning_over_rest(cells, lambda one: one.outcome.truth_deg_per_sqrt_h),
        "ours": turning_over_rest(cells, lambda one: one.outcome.value),
        "its method": turning_over_rest(cells, lambda one: one.by_paper.value),
    }
    shown = ", ".join(f"{name} {ratio:.3f}" for name, ratio in parts.items())
    return f"Check of validity, turning over rest (Table 1): {shown}"


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
            *(f"{order}_{reading}{_UNIT}" for order in ORDERS for reading in READINGS),
        ),
        [_row(one) for one in cells_of(reproduction, name)],
    )


def _row(one: Cell) -> list[str]:
    outcome, by_paper = one.outcome, one.by_paper
    return [
        cell(one.rate),
        str(one.day),
        cell(one.published),
        *_estimate(outcome),
        cell(outcome.value / outcome.truth_deg_per_sqrt_h - 1.0),
        str(outcome.lines),
        str(outcome.seed),
        cell(by_paper.value),
        by_paper.status,
        cell(by_paper.value / outcome.truth_deg_per_sqrt_h - 1.0),
        cell(outcome.duration_s),
        *(
            cell(found.readings[reading])
            for found in (by_paper, one.as_printed)
            for reading in READINGS
        ),
    ]


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
