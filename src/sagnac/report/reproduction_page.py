"""The paper's figures and tables beside ours: one page, pictures and tables of numbers."""

import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from markupsafe import Markup
from matplotlib.figure import Figure

from sagnac.coefficients.readings import READINGS, ReadingName
from sagnac.formats.files import replacing_folder, write_text
from sagnac.lines.published import SLOWEST_CYCLES
from sagnac.paper.prediction import DRIVEN, FIGURE_2, FIGURE_3, TABLE_1, TABLE_2, adequate_rate
from sagnac.paper.reproduce import Cell, Order, Outcome, Reproduction, outcomes_of_table
from sagnac.paper.trials import FORM, FORMS, NEAREST_TRIAL, Trial
from sagnac.report.figures import svg, write_png
from sagnac.report.files import rendered
from sagnac.report.quantities import number
from sagnac.report.reproduction_tables import (
    ORDERS,
    TABLES,
    PaperTable,
    cell_texts,
    error_of,
    errors_of_reading,
    estimate_of,
    excess,
    figures_of,
    growth,
    intervals_of,
    mean,
    percent,
    reading_error,
    readings,
    rms,
    spread,
    tables,
    turning_over_rest,
)
from sagnac.units import DEGREE
from sagnac.version import __version__

# ---- reproduction page -------------------------------------------------------------


def page(reproduction: Reproduction, figures: Mapping[str, Figure]) -> str:
    """The page as HTML; nothing in it is fetched.

    Parameters
    ----------
    reproduction
        What was made.
    figures
        By name, those of `reproduction_figures.figures_of`.
    """
    outcomes = reproduction.outcomes
    fris = [outcomes[f"figure2-day{day}"] for day in range(1, reproduction.scope.days + 1)]
    table_1, table_2 = (outcomes_of_table(reproduction, name) for name in TABLES)
    stationary = [estimate_of(one.outcome) for one in table_1 if one.rate == 0.0]
    slowest = adequate_rate(reproduction.prediction) / DEGREE
    return rendered(
        "reproduction.html",
        title="The experiment of Yu et al. (2013), regenerated on a simulated rig",
        scope=reproduction.scope,
        figures={
            name: Markup(svg(figure, name, f"{name}: see caption"))
            for name, figure in figures.items()
        },
        figure2=[_figure2_row(outcome) for outcome in fris],
        figure2_paper=number(FIGURE_2),
        figure2_ratio=number(FIGURE_2 / mean(TABLE_2[40.0])),
        figure2_local=number(max(excess(outcome) for outcome in fris)),
        forms=FORMS,
        trials=[_trial_rows(reproduction, trial) for trial in reproduction.trials],
        white=readings(reproduction, "white", FORM),
        nearest=readings(reproduction, NEAREST_TRIAL, FORM),
        rate_growth=growth(reproduction, "rate"),
        driven=f"{DRIVEN:g}",
        at_rest=number(excess(outcomes["table1-0-day1-paper"])),
        orders=ORDERS,
        validity=_validity(table_1),
        figures_456=[
            (label, cell_texts(published, outcomes[name], size, outcomes[f"{name}-paper"]))
            for label, name, published, size in (
                ("Figure 4", "table1-0-day1", TABLE_1[0.0][0], 1e-4),
                ("Figure 5", "table1-40-day1", TABLE_1[40.0][0], 1e-4),
                ("Figure 6", "table2-40-day1", TABLE_2[40.0][0], 1e-5),
            )
        ],
        tables=[_table(reproduction, table, size) for table, size in TABLES.items()],
        stationary=spread([value for value in stationary if math.isfinite(value)]),
        ratio=number(
            mean(estimate_of(one.outcome) for one in table_1)
            / mean(estimate_of(one.outcome) for one in table_2 if one.rate > 20.0)
        ),
        paper_ratio=number(
            mean(value for days in TABLE_1.values() for value in days)
            / mean(value for rate, days in TABLE_2.items() if rate > 20 for value in days)
        ),
        slowest=number(slowest),
        slowest_cycles=f"{SLOWEST_CYCLES:.1f}",
        version=__version__,
    )


def _table(reproduction: Reproduction, table: PaperTable, size: float) -> dict[str, Any]:
    cells = outcomes_of_table(reproduction, table)
    errors = [
        abs(error_of(one.outcome.value, one.outcome))
        for one in cells
        if one.outcome.status == "estimated"
    ]
    held = sum(
        one.outcome.low <= one.outcome.truth_deg_per_sqrt_h <= one.outcome.high for one in cells
    )
    by_rate = {
        rate: [one for one in cells if one.rate == rate]
        for rate in dict.fromkeys(one.rate for one in cells)
    }
    return {
        "name": table,
        "unit": f"10{'⁻⁴' if size == 1e-4 else '⁻⁵'} °/√h",
        "rows": [
            {
                "rate": f"{rate:g}",
                "cells": [
                    cell_texts(one.published, one.outcome, size, one.by_paper) for one in days
                ],
            }
            for rate, days in by_rate.items()
        ],
        "days": range(1, reproduction.scope.days + 1),
        "worst": f"{100.0 * max(errors):.1f} %" if errors else "–",
        "held": held,
        "without": len(cells) - len(errors),
        "count": len(cells),
        "spread": _day_spread(by_rate, lambda one: estimate_of(one.outcome)),
        "by_paper_spread": _day_spread(by_rate, lambda one: one.by_paper.value),
        "true_spread": _day_spread(by_rate, lambda one: one.outcome.truth_deg_per_sqrt_h),
        "paper_spread": _day_spread(by_rate, lambda one: one.published),
        "rms": _plain_percent(rms(error_of(one.outcome.value, one.outcome) for one in cells)),
        "readings": _readings(cells),
        "in_cells": [
            {
                "place": f"{one.rate:g} °/s, day {one.day}",
                "errors": [
                    {order: percent(reading_error(one, order, reading)) for order in ORDERS}
                    for reading in READINGS
                ],
            }
            for one in cells
            if one.rate > 0.0
        ],
    }


def _readings(cells: Sequence[Cell]) -> list[dict[str, Any]]:
    """A row for each reading of Step 4: errors on the turning table in either order."""
    return [
        {
            "name": name,
            "words": reading.in_words,
            "errors": [
                {"mean": percent(one.mean), "rms": _plain_percent(one.rms)}
                for one in (errors_of_reading(cells, order, name) for order in ORDERS)
            ],
        }
        for name, reading in READINGS.items()
    ]


def _plain_percent(part: float) -> str:
    return f"{100.0 * part:.1f} %" if math.isfinite(part) else "–"


def _validity(cells: Sequence[Cell]) -> dict[str, Any]:
    """The paper's check of validity: mean N turning over mean N at rest."""
    without = [one for one in cells if one.published != max(TABLE_1[40.0])]
    ratios = {
        "the paper’s numbers": turning_over_rest(cells, lambda one: one.published),
        "the same without its highest cell": turning_over_rest(without, lambda one: one.published),
        "the truth that was simulated": turning_over_rest(
            cells, lambda one: one.outcome.truth_deg_per_sqrt_h
        ),
        "ours": turning_over_rest(cells, lambda one: estimate_of(one.outcome)),
    }
    for order, in_words in ORDERS.items():
        for name in READINGS:
            ratios[f"the paper’s method, {in_words}, {name}"] = turning_over_rest(
                cells, partial(_reading_of, order=order, name=name)
            )
    return {"rows": [(what, number(ratio)) for what, ratio in ratios.items()]}


def _reading_of(one: Cell, order: Order, name: ReadingName) -> float:
    return one.by(order).readings[name]


def _day_spread(by_rate: Mapping[float, Sequence[Cell]], value: Callable[[Cell], float]) -> str:
    """Root mean square over the rates of the days' standard deviation over their mean."""
    spreads = []
    for cells in by_rate.values():
        values = np.array([value(one) for one in cells])
        values = values[np.isfinite(values)]
        if values.size > 1:
            spreads.append(float(values.std(ddof=1) / values.mean()))
    return _plain_percent(rms(spreads))


def _figure2_row(outcome: Outcome) -> dict[str, Any]:
    truth = outcome.truth_deg_per_sqrt_h
    return {
        "name": outcome.name.removeprefix("figure2-").replace("day", "day "),
        "truth": number(truth),
        "readings": [
            (
                number(outcome.least_squares[form]),
                f"{abs(outcome.least_squares[form]) / truth:.3g} ×",
            )
            if form in outcome.least_squares
            else ("–", "too few points")
            for form in FORMS
        ],
    }


def _trial_rows(reproduction: Reproduction, trial: Trial) -> dict[str, Any]:
    rows = [
        {
            "interval": f"{interval:g}",
            "paper": f"{published * 1e4:.1f}",
            "readings": [
                f"{outcome.least_squares[form] * 1e4:.2f}" if form in outcome.least_squares else "–"
                for form in FORMS
            ],
            "truth": f"{outcome.truth_deg_per_sqrt_h * 1e4:.2f}",
        }
        for (interval, published), outcome in zip(
            FIGURE_3.items(), intervals_of(reproduction, trial.name), strict=True
        )
    ]
    return {"name": trial.name, "meaning": trial.meaning, "rows": rows}


# ---- reproduction ------------------------------------------------------------------


def write(reproduction: Reproduction, folder: Path) -> list[Path]:
    """Page, pictures and tables into `folder`, all of them or none; what else it has stays.

    Returns
    -------
    list of Path
        The page first.

    Raises
    ------
    RecordingError
        If the folder cannot be written to.
    """
    names = ["reproduction.html"]
    figures = figures_of(reproduction)
    with replacing_folder(folder) as new:
        for name, figure in figures.items():
            names.append(f"{name}.png")
            write_png(figure, new / names[-1])
        for name, text in tables(reproduction).items():
            names.append(f"{name}.csv")
            write_text(new / names[-1], text)
        write_text(new / names[0], page(reproduction, figures))
    return [folder / name for name in names]
