"""The paper's figures and tables beside ours: one page, pictures and tables of numbers."""

import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np
from markupsafe import Markup
from matplotlib.figure import Figure

from sagnac import __version__
from sagnac.paper.least_squares import FORM, FORMS, Form
from sagnac.paper.prediction import adequate_rate
from sagnac.paper.published import FIGURE_2, FIGURE_3, TABLE_1, TABLE_2
from sagnac.paper.reproduce import Outcome, Reproduction, outcomes_of_table
from sagnac.paper.trials import NEAREST_TRIAL, Trial
from sagnac.report.document import _cell, _csv, write_text
from sagnac.report.figures import (
    BLUE,
    GREEN,
    INK,
    ORANGE,
    QUIET,
    _legend,
    _logarithmic,
    _styled,
    svg,
    write_png,
)
from sagnac.report.page import _render
from sagnac.report.wording import number
from sagnac.units import DEGREE, DEGREE_PER_ROOT_HOUR

_TABLES: Final = (("table1", 1e-4), ("table2", 1e-5))
# N of a white rate at tau = 1 s in deg/h is 60 of its figure in deg/sqrt(h).
_ROOT_SECONDS_IN_HOUR: Final = 60.0


def write(reproduction: Reproduction, folder: Path) -> list[Path]:
    """Page, pictures and tables into `folder`; each whole or not at all.

    Returns
    -------
    list of Path
        The page first.

    Raises
    ------
    RecordingError
        If the folder cannot be written to.
    """
    written = [folder / "reproduction.html"]
    figures = _figures(reproduction)
    for name, figure in figures.items():
        written.append(folder / f"{name}.png")
        write_png(figure, written[-1])
    for name, text in tables(reproduction).items():
        written.append(folder / f"{name}.csv")
        write_text(written[-1], text)
    write_text(written[0], page(reproduction, figures))
    return written


def tables(reproduction: Reproduction) -> dict[str, str]:
    """CSV by name; units stand in the header."""
    made: dict[str, str] = {}
    for table, _ in _TABLES:
        made[table] = _csv(
            (
                "table_rate[deg/s]",
                "day",
                "paper[deg/sqrt(h)]",
                "estimate[deg/sqrt(h)]",
                "low[deg/sqrt(h)]",
                "high[deg/sqrt(h)]",
                "confidence",
                "status",
                "truth[deg/sqrt(h)]",
                "error",
                "lines",
                "seed",
            ),
            [
                [
                    _cell(rate),
                    str(day),
                    _cell(published),
                    *_estimate_cells(outcome),
                    _cell(outcome.truth_deg_per_sqrt_h),
                    _cell(outcome.value / outcome.truth_deg_per_sqrt_h - 1.0),
                    str(outcome.lines),
                    str(outcome.seed),
                ]
                for rate, day, published, outcome in outcomes_of_table(
                    reproduction, _literal(table)
                )
            ],
        )
    made["figure3_trials"] = _csv(
        (
            "trial",
            "interval[s]",
            "paper[deg/sqrt(h)]",
            *(f"{form.replace(', ', ' ')}[deg/sqrt(h)]" for form in FORMS),
            "estimate[deg/sqrt(h)]",
            "low[deg/sqrt(h)]",
            "high[deg/sqrt(h)]",
            "confidence",
            "status",
            "truth[deg/sqrt(h)]",
        ),
        [
            [
                trial.name,
                _cell(interval),
                _cell(published),
                *(_cell(outcome.least_squares.get(form, math.nan)) for form in FORMS),
                *_estimate_cells(outcome),
                _cell(outcome.truth_deg_per_sqrt_h),
            ]
            for trial in reproduction.trials
            for interval, published in FIGURE_3.items()
            for outcome in (reproduction.outcomes[f"figure3-{trial.name}-{interval:g}s"],)
        ],
    )
    for figure, outcomes in _curves_of(reproduction).items():
        made[figure] = _csv(
            ("run", "tau[s]", "deviation[deg/h]", "low[deg/h]", "high[deg/h]", "truth[deg/h]"),
            [
                [
                    outcome.name,
                    *(_cell(value) for value in point),
                    _cell(_white(outcome.truth_deg_per_sqrt_h, point[0])),
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
    prediction = reproduction.prediction
    parts = (
        prediction.total,
        prediction.quantum,
        prediction.lock_in,
        prediction.encoder,
        prediction.jitter,
    )
    made["table_rate"] = _csv(
        (
            "table_rate[deg/s]",
            *(
                f"{part}[deg/sqrt(h)]"
                for part in ("total", "quantum", "lock_in", "encoder", "jitter")
            ),
        ),
        [
            [_cell(rate / DEGREE), *(_cell(part[index] / DEGREE_PER_ROOT_HOUR) for part in parts)]
            for index, rate in enumerate(prediction.rates)
        ],
    )
    return made


def summary(reproduction: Reproduction) -> str:
    """Both tables for a terminal: estimates, interval, truth and the paper's number."""
    blocks = []
    for table, size in _TABLES:
        unit = f"{size:g} deg/sqrt(h)"
        rows = [
            f"{'deg/s':>6} {'day':>3} {'estimate':>9}  {'95 % interval':<17} {'truth':>7} "
            f"{'error':>8} {'paper':>6}"
        ]
        for rate, day, published, outcome in _cells(reproduction, _literal(table)):
            cell = _cell_row(published, outcome, size)
            rows.append(
                f"{rate:>6g} {day:>3} {cell['value']:>9}  {cell['range']:<17} "
                f"{cell['truth']:>7} {cell['error']:>8} {cell['paper']:>6}"
            )
        blocks.append("\n".join([f"Table {table[-1]}, N per gyro, {unit}", *rows]))
    return "\n\n".join(blocks)


def page(reproduction: Reproduction, figures: dict[str, Figure] | None = None) -> str:
    """The page as HTML; nothing in it is fetched."""
    drawn = _figures(reproduction) if figures is None else figures
    outcomes = reproduction.outcomes
    fris = [outcomes[f"figure2-day{day}"] for day in range(1, reproduction.scope.days + 1)]
    stationary = [
        outcome.value
        for rate, _, _, outcome in _cells(reproduction, "table1")
        if rate == 0.0 and outcome.status == "estimated"
    ]
    slowest = adequate_rate(reproduction.prediction) / DEGREE
    return _render(
        "reproduction.html",
        title="The experiment of Yu et al. (2013), regenerated on a simulated rig",
        scope=reproduction.scope,
        figures={
            name: Markup(svg(figure, name, f"{name}: Allan deviation or N, see caption"))
            for name, figure in drawn.items()
        },
        figure2=[_figure2_row(outcome) for outcome in fris],
        figure2_paper=number(FIGURE_2),
        figure2_local=number(max(_excess(outcome) for outcome in fris)),
        forms=FORMS,
        trials=[_trial_rows(reproduction, trial) for trial in reproduction.trials],
        white=_readings(reproduction, "white", FORM),
        nearest=_readings(reproduction, NEAREST_TRIAL, FORM),
        rate_growth=_growth(reproduction, "rate"),
        removed=", ".join(
            f"{outcome.value * 1e4:.2f}" for outcome in _intervals(reproduction, "removed")
        ),
        figures_456=[
            (label, _cell_row(published, outcomes[name], size))
            for label, name, published, size in (
                ("Figure 4", "table1-0-day1", TABLE_1[0.0][0], 1e-4),
                ("Figure 5", "table1-40-day1", TABLE_1[40.0][0], 1e-4),
                ("Figure 6", "table2-40-day1", TABLE_2[40.0][0], 1e-5),
            )
        ],
        tables=[_table(reproduction, table, size) for table, size in _TABLES],
        stationary=_spread(stationary),
        ratio=number(
            _mean(_estimated(reproduction, "table1", above=-1.0))
            / _mean(_estimated(reproduction, "table2", above=20.0))
        ),
        paper_ratio=number(
            _mean(value for days in TABLE_1.values() for value in days)
            / _mean(value for rate, days in TABLE_2.items() if rate > 20 for value in days)
        ),
        slowest=number(slowest),
        version=__version__,
    )


def _figures(reproduction: Reproduction) -> dict[str, Figure]:
    curves = _curves_of(reproduction)
    fitted = {name: _curve_figure(curves[name]) for name in ("figure4", "figure5", "figure6")}
    return {
        "figure2": _fris_figure(*curves["figure2"]),
        "figure3": _intervals_figure(curves["figure3"]),
        **fitted,
        "table_rate": _rate_figure(reproduction),
    }


def _curves_of(reproduction: Reproduction) -> dict[str, list[Outcome]]:
    outcomes = reproduction.outcomes
    return {
        "figure2": [outcomes["figure2-day1"], outcomes["table2-40-day1"]],
        "figure3": [outcomes[f"figure3-as-simulated-{interval:g}s"] for interval in FIGURE_3],
        "figure4": [outcomes["table1-0-day1"]],
        "figure5": [outcomes["table1-40-day1"]],
        "figure6": [outcomes["table2-40-day1"]],
    }


def _fris_figure(fris: Outcome, fos: Outcome) -> Figure:
    with _styled(legend_rows=1) as (figure, axes):
        axes.plot(
            fris.tau_s, fris.deviation, color=ORANGE, marker="^", linewidth=1.0, label="fris, 9 s"
        )
        axes.plot(
            fos.tau_s, fos.deviation, color=BLUE, marker="o", linestyle="none", label="fos, 1 s"
        )
        _truth_line(axes, fos)
        _logarithmic(axes, "cluster time τ (s)", "Allan deviation, x − z per gyro (°/h)")
        _legend(axes, columns=3)
    return figure


def _intervals_figure(outcomes: Sequence[Outcome]) -> Figure:
    with _styled(legend_rows=1) as (figure, axes):
        for outcome, color, marker in zip(
            outcomes, (BLUE, GREEN, ORANGE), ("o", "D", "^"), strict=True
        ):
            axes.plot(
                outcome.tau_s,
                outcome.deviation,
                color=color,
                marker=marker,
                linewidth=0.9,
                label=f"every {outcome.interval_s:g} s",
            )
        _truth_line(axes, outcomes[0])
        _logarithmic(axes, "cluster time τ (s)", "Allan deviation, z (°/h)")
        _legend(axes, columns=4)
    return figure


def _curve_figure(outcomes: Sequence[Outcome]) -> Figure:
    (outcome,) = outcomes
    with _styled(legend_rows=1) as (figure, axes):
        axes.fill_between(
            outcome.tau_s,
            outcome.low_curve,
            outcome.high_curve,
            color=BLUE,
            alpha=0.2,
            linewidth=0,
            label=f"{100 * outcome.confidence:g} % interval",
        )
        axes.plot(
            outcome.tau_s,
            outcome.deviation,
            color=BLUE,
            marker="o",
            linestyle="none",
            label="x − z per gyro",
        )
        _truth_line(axes, outcome)
        _logarithmic(axes, "cluster time τ (s)", "Allan deviation, x − z per gyro (°/h)")
        _legend(axes, columns=3)
    return figure


def _truth_line(axes: Any, outcome: Outcome) -> None:
    tau = np.array([min(outcome.tau_s), max(outcome.tau_s)])
    axes.plot(
        tau,
        _white(outcome.truth_deg_per_sqrt_h, tau),
        color=INK,
        linewidth=0.9,
        linestyle=(0, (5, 3)),
        label="N as simulated",
    )


def _rate_figure(reproduction: Reproduction) -> Figure:
    prediction = reproduction.prediction
    rates = prediction.rates / DEGREE
    with _styled(legend_rows=3) as (figure, axes):
        for values, label, color, style in (
            (prediction.total, "predicted", INK, "-"),
            (prediction.lock_in, "lock-in", BLUE, "--"),
            (prediction.quantum, "quantum limit", GREEN, "--"),
            (prediction.encoder, "encoder", ORANGE, ":"),
            (prediction.jitter, "jitter, table not followed", QUIET, ":"),
        ):
            axes.plot(
                rates, values / DEGREE_PER_ROOT_HOUR, color=color, linestyle=style, label=label
            )
        cells = _cells(reproduction, "table2")
        for label, color, marker, points in (
            (
                "ours, Table 2",
                BLUE,
                "o",
                [(rate, one.value) for rate, _, _, one in cells if one.status == "estimated"],
            ),
            ("paper, Table 2", ORANGE, "x", [(rate, value) for rate, _, value, _ in cells]),
        ):
            axes.plot(
                [rate for rate, _ in points],
                [value for _, value in points],
                linestyle="none",
                marker=marker,
                color=color,
                label=label,
            )
        _logarithmic(axes, "table rate (°/s)", "N̄ (°/√h)")
        _legend(axes, columns=3)
    return figure


def _white(deg_per_sqrt_h: float, tau: Any) -> Any:
    """Allan deviation of a white rate in deg/h."""
    return deg_per_sqrt_h * _ROOT_SECONDS_IN_HOUR / np.sqrt(tau)


def _excess(outcome: Outcome) -> float:
    """How many times the curve stands above the white rate that was simulated, at most."""
    return float(
        np.max(
            np.array(outcome.deviation)
            / _white(outcome.truth_deg_per_sqrt_h, np.array(outcome.tau_s))
        )
    )


def _literal(table: str) -> Literal["table1", "table2"]:
    return "table1" if table == "table1" else "table2"


def _cells(
    reproduction: Reproduction, table: Literal["table1", "table2"]
) -> list[tuple[float, int, float, Outcome]]:
    return list(outcomes_of_table(reproduction, table))


def _estimated(
    reproduction: Reproduction, table: Literal["table1", "table2"], above: float
) -> list[float]:
    """Estimates of a table above a table rate, without bounds."""
    return [
        outcome.value
        for rate, _, _, outcome in _cells(reproduction, table)
        if rate > above and outcome.status == "estimated"
    ]


def _mean(values: Iterable[float]) -> float:
    found = list(values)
    return sum(found) / len(found) if found else math.nan


def _spread(values: Sequence[float]) -> str:
    if not values:
        return "–"
    return " … ".join(number(value) for value in sorted({min(values), max(values)}))


def _estimate_cells(outcome: Outcome) -> list[str]:
    return [
        _cell(outcome.value),
        _cell(outcome.low),
        _cell(outcome.high),
        _cell(outcome.confidence),
        outcome.status,
    ]


def _intervals(reproduction: Reproduction, trial: str) -> list[Outcome]:
    return [reproduction.outcomes[f"figure3-{trial}-{interval:g}s"] for interval in FIGURE_3]


def _readings(reproduction: Reproduction, trial: str, form: Form) -> list[str]:
    """N by least squares at each interval, 1e-4 deg/sqrt(h)."""
    return [
        f"{outcome.least_squares[form] * 1e4:.1f}" if form in outcome.least_squares else "–"
        for outcome in _intervals(reproduction, trial)
    ]


def _growth(reproduction: Reproduction, trial: str) -> list[str]:
    """N at the longer intervals over N at the first, where no square may be below zero."""
    first, *rest = (
        outcome.least_squares.get("variance, plain, none below zero", math.nan)
        for outcome in _intervals(reproduction, trial)
    )
    return [f"{value / first:.1f}" if first else "–" for value in rest]


def _cell_row(published: float, outcome: Outcome, size: float) -> dict[str, str]:
    """One cell in units of `size` deg/sqrt(h)."""
    truth = outcome.truth_deg_per_sqrt_h
    row = {
        "paper": f"{published / size:.2f}",
        "truth": f"{truth / size:.3f}",
        "value": "–",
        "range": outcome.status,
        "error": "–",
    }
    if outcome.status == "estimated":
        row["value"] = f"{outcome.value / size:.3f}"
        row["range"] = f"{outcome.low / size:.3f} … {outcome.high / size:.3f}"
        row["error"] = f"{100.0 * (outcome.value / truth - 1.0):+.1f} %"
    elif outcome.status == "upper bound":
        row["value"] = f"< {outcome.high / size:.3f}"
    return row


def _table(reproduction: Reproduction, table: str, size: float) -> dict[str, Any]:
    cells = _cells(reproduction, _literal(table))
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
                "cells": [_cell_row(published, outcome, size) for published, outcome in days],
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
