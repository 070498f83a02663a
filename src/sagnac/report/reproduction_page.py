"""The paper's figures and tables beside ours: one page that stands alone."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from markupsafe import Markup
from matplotlib.figure import Figure

from sagnac import __version__
from sagnac.paper.least_squares import FORM, FORMS
from sagnac.paper.prediction import adequate_rate
from sagnac.paper.published import FIGURE_2, FIGURE_3, TABLE_1, TABLE_2
from sagnac.paper.reproduce import Outcome, Reproduction
from sagnac.paper.trials import NEAREST_TRIAL, Trial
from sagnac.report.figures import svg
from sagnac.report.html import rendered
from sagnac.report.reproduction_values import (
    TABLES,
    PaperTable,
    cell_texts,
    cells_of,
    estimated,
    excess,
    growth,
    intervals_of,
    mean,
    readings,
    spread,
)
from sagnac.report.wording import number
from sagnac.units import DEGREE


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
    stationary = [
        outcome.value
        for rate, _, _, outcome in cells_of(reproduction, "table1")
        if rate == 0.0 and outcome.status == "estimated"
    ]
    slowest = adequate_rate(reproduction.prediction) / DEGREE
    return rendered(
        "reproduction.html",
        title="The experiment of Yu et al. (2013), regenerated on a simulated rig",
        scope=reproduction.scope,
        figures={
            name: Markup(svg(figure, name, f"{name}: Allan deviation or N, see caption"))
            for name, figure in figures.items()
        },
        figure2=[_figure2_row(outcome) for outcome in fris],
        figure2_paper=number(FIGURE_2),
        figure2_local=number(max(excess(outcome) for outcome in fris)),
        forms=FORMS,
        trials=[_trial_rows(reproduction, trial) for trial in reproduction.trials],
        white=readings(reproduction, "white", FORM),
        nearest=readings(reproduction, NEAREST_TRIAL, FORM),
        rate_growth=growth(reproduction, "rate"),
        removed=", ".join(
            f"{outcome.value * 1e4:.2f}" for outcome in intervals_of(reproduction, "removed")
        ),
        figures_456=[
            (label, cell_texts(published, outcomes[name], size))
            for label, name, published, size in (
                ("Figure 4", "table1-0-day1", TABLE_1[0.0][0], 1e-4),
                ("Figure 5", "table1-40-day1", TABLE_1[40.0][0], 1e-4),
                ("Figure 6", "table2-40-day1", TABLE_2[40.0][0], 1e-5),
            )
        ],
        tables=[_table(reproduction, table, size) for table, size in TABLES.items()],
        stationary=spread(stationary),
        ratio=number(
            mean(estimated(reproduction, "table1", above=-1.0))
            / mean(estimated(reproduction, "table2", above=20.0))
        ),
        paper_ratio=number(
            mean(value for days in TABLE_1.values() for value in days)
            / mean(value for rate, days in TABLE_2.items() if rate > 20 for value in days)
        ),
        slowest=number(slowest),
        version=__version__,
    )


def _table(reproduction: Reproduction, table: PaperTable, size: float) -> dict[str, Any]:
    cells = cells_of(reproduction, table)
    errors = [
        abs(outcome.value / outcome.truth_deg_per_sqrt_h - 1.0)
        for _, _, _, outcome in cells
        if outcome.status == "estimated"
    ]
    held = sum(
        outcome.low <= outcome.truth_deg_per_sqrt_h <= outcome.high for _, _, _, outcome in cells
    )
    by_rate = {
        rate: [(published, outcome) for at, _, published, outcome in cells if at == rate]
        for rate in dict.fromkeys(rate for rate, _, _, _ in cells)
    }
    return {
        "name": table,
        "unit": f"10{'⁻⁴' if size == 1e-4 else '⁻⁵'} °/√h",
        "rows": [
            {
                "rate": f"{rate:g}",
                "cells": [cell_texts(published, outcome, size) for published, outcome in days],
            }
            for rate, days in by_rate.items()
        ],
        "days": range(1, reproduction.scope.days + 1),
        "worst": f"{100.0 * max(errors):.1f} %" if errors else "–",
        "held": held,
        "without": len(cells) - len(errors),
        "count": len(cells),
        "spread": f"{100.0 * _day_spread(list(by_rate.values()), ours=True):.1f} %",
        "paper_spread": f"{100.0 * _day_spread(list(by_rate.values()), ours=False):.0f} %",
    }


def _day_spread(days: Sequence[Sequence[tuple[float, Outcome]]], *, ours: bool) -> float:
    """Root mean square over the rates of the days' standard deviation over their mean."""
    spreads = []
    for cells in days:
        values = np.array(
            [
                outcome.value if ours else published
                for published, outcome in cells
                if not ours or outcome.status == "estimated"
            ]
        )
        if values.size > 1:
            spreads.append(float(values.std(ddof=1) / values.mean()))
    return math.sqrt(float(np.mean(np.square(spreads)))) if spreads else math.nan


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
        "answer": "not observable"
        if outcome.status == "not observable"
        else f"{'< ' if outcome.status == 'upper bound' else ''}{number(outcome.value)}",
    }


def _trial_rows(reproduction: Reproduction, trial: Trial) -> dict[str, Any]:
    rows = []
    for interval, published in FIGURE_3.items():
        outcome = reproduction.outcomes[f"figure3-{trial.name}-{interval:g}s"]
        bound = "< " if outcome.status == "upper bound" else ""
        interval_text = (
            f"{outcome.low * 1e4:.2f} … {outcome.high * 1e4:.2f}"
            if outcome.status == "estimated"
            else outcome.status
        )
        rows.append(
            {
                "interval": f"{interval:g}",
                "paper": f"{published * 1e4:.1f}",
                "readings": [
                    f"{outcome.least_squares[form] * 1e4:.2f}"
                    if form in outcome.least_squares
                    else "–"
                    for form in FORMS
                ],
                "value": f"{bound}{outcome.value * 1e4:.2f}"
                if math.isfinite(outcome.value)
                else "–",
                "range": interval_text,
                "truth": f"{outcome.truth_deg_per_sqrt_h * 1e4:.2f}",
            }
        )
    return {"name": trial.name, "meaning": trial.meaning, "rows": rows}
