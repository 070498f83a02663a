"""The paper's figures and tables beside ours: one page, pictures and tables of numbers."""

import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from markupsafe import Markup
from matplotlib.figure import Figure

from sagnac.core.units import DEGREE
from sagnac.core.whole_files import replacing_folder, write_text
from sagnac.lines.published import SLOWEST_CYCLES
from sagnac.noise.readings import READINGS, ReadingName
from sagnac.paper import tables as values
from sagnac.paper.prediction import DRIVEN, FIGURE_2, TABLE_1, TABLE_2, adequate_rate
from sagnac.paper.reproduce import Cell, Order, Reproduction, outcomes_of_table
from sagnac.paper.trials import FORM, NEAREST_TRIAL
from sagnac.report.figures import svg, write_png
from sagnac.report.quantities import number
from sagnac.report.sections import rendered

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
    table_1, table_2 = (outcomes_of_table(reproduction, name) for name in values.TABLES)
    stationary = [values.estimate_of(one.outcome) for one in table_1 if one.rate == 0.0]
    return rendered(
        "reproduction.html",
        values=values,
        driven=f"{DRIVEN:g}",
        figure2_paper=number(FIGURE_2),
        title="The experiment of Yu et al. (2013), regenerated on a simulated rig",
        reproduction=reproduction,
        scope=reproduction.scope,
        figures={
            name: Markup(svg(figure, name, f"{name}: see caption"))
            for name, figure in figures.items()
        },
        fris=fris,
        highest=max(map(values.excess, fris)),
        figure2_ratio=number(FIGURE_2 / values.mean(TABLE_2[40.0])),
        white=values.readings(reproduction, "white", FORM),
        nearest=values.readings(reproduction, NEAREST_TRIAL, FORM),
        rate_growth=values.growth(reproduction, "rate"),
        at_rest=number(values.excess(outcomes["table1-0-day1-paper"])),
        figures_456=[
            (label, values.cell_texts(published, outcomes[name], size, outcomes[f"{name}-paper"]))
            for label, name, published, size in (
                ("Figure 4", "table1-0-day1", TABLE_1[0.0][0], 1e-4),
                ("Figure 5", "table1-40-day1", TABLE_1[40.0][0], 1e-4),
                ("Figure 6", "table2-40-day1", TABLE_2[40.0][0], 1e-5),
            )
        ],
        tables=[_table(reproduction, table, size) for table, size in values.TABLES.items()],
        stationary=values.spread([value for value in stationary if math.isfinite(value)]),
        ratio=number(
            values.mean(map(values.QUANTITIES["ours"], table_1))
            / values.mean(values.QUANTITIES["ours"](one) for one in table_2 if one.rate > 20.0)
        ),
        paper_ratio=number(
            values.mean(value for days in TABLE_1.values() for value in days)
            / values.mean(value for rate, days in TABLE_2.items() if rate > 20 for value in days)
        ),
        slowest=number(adequate_rate(reproduction.prediction) / DEGREE),
        slowest_cycles=f"{SLOWEST_CYCLES:.1f}",
    )


def _table(reproduction: Reproduction, table: values.PaperTable, size: float) -> dict[str, Any]:
    cells = outcomes_of_table(reproduction, table)
    estimated = [one.outcome for one in cells if one.outcome.status == "estimated"]
    errors = [abs(values.error_of(outcome.value, outcome)) for outcome in estimated]
    errors_of_all = [values.error_of(one.outcome.value, one.outcome) for one in cells]
    return {
        "name": table,
        "size": size,
        "unit": f"10{'⁻⁴' if size == 1e-4 else '⁻⁵'} °/√h",
        "cells": cells,
        "worst": f"{100.0 * max(errors):.1f} %" if errors else "–",
        "held": sum(
            one.outcome.low <= one.outcome.truth_deg_per_sqrt_h <= one.outcome.high for one in cells
        ),
        "without": len(cells) - len(errors),
        "spread": {name: _day_spread(cells, value) for name, value in values.QUANTITIES.items()},
        "rms": values.plain_percent(values.rms(errors_of_all)),
        "validity": [(what, number(ratio)) for what, ratio in _validity(cells).items()],
    }


def _validity(cells: Sequence[Cell]) -> dict[str, float]:
    """The paper's check of validity: mean N turning over mean N at rest."""
    without = [one for one in cells if one.published != max(TABLE_1[40.0])]
    over_rest, quantities = values.turning_over_rest, values.QUANTITIES
    found = {name: over_rest(cells, value) for name, value in quantities.items()}
    ratios = {
        "the paper’s numbers": found["paper"],
        "the same without its highest cell": over_rest(without, quantities["paper"]),
        "the truth that was simulated": found["truth"],
        "ours": found["ours"],
    }
    for order, in_words in values.ORDERS.items():
        for name in READINGS:
            ratios[f"the paper’s method, {in_words}, {name}"] = over_rest(
                cells, partial(_reading_of, order=order, name=name)
            )
    return ratios


def _reading_of(one: Cell, order: Order, name: ReadingName) -> float:
    return one.by(order).readings[name]


def _day_spread(cells: Sequence[Cell], value: Callable[[Cell], float]) -> str:
    """Root mean square over the rates of the days' standard deviation over their mean."""
    spreads = []
    for rate in dict.fromkeys(one.rate for one in cells):
        found = np.array([value(one) for one in cells if one.rate == rate])
        found = found[np.isfinite(found)]
        if found.size > 1:
            spreads.append(float(found.std(ddof=1) / found.mean()))
    return values.plain_percent(values.rms(spreads))


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
    figures = values.figures_of(reproduction)
    with replacing_folder(folder) as new:
        for name, figure in figures.items():
            names.append(f"{name}.png")
            write_png(figure, new / names[-1])
        for name, text in values.tables(reproduction).items():
            names.append(f"{name}.csv")
            write_text(new / names[-1], text)
        write_text(new / names[0], page(reproduction, figures))
    return [folder / name for name in names]
