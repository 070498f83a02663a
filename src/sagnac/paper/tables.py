"""The paper's figures, tables and curves from the reproduction; units stand in the headers."""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any, Final, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from sagnac.core.arrays import FloatArray, extent
from sagnac.core.errors import per_cent
from sagnac.core.units import ARCSECOND, DEGREE, DEGREE_PER_ROOT_HOUR
from sagnac.noise.readings import READINGS, ReadingName
from sagnac.paper.prediction import FIGURE_3, TABLES, Table
from sagnac.paper.reproduce import Cell, Order, Outcome, Reproduction, outcomes_of_table
from sagnac.paper.trials import FORMS, Form
from sagnac.report.figures import frames_figure, styled
from sagnac.report.frame import BLUE, DASHED, GREEN, INK, ORANGE, band, logarithmic
from sagnac.report.quantities import number
from sagnac.report.tables import cell, columns_text, csv_text
from sagnac.report.text import table

# ---- reproduction values -----------------------------------------------------------


def curves_of(reproduction: Reproduction) -> dict[str, list[Outcome]]:
    """The runs whose curves each figure shows."""
    outcomes = reproduction.outcomes
    return {
        "figure2": [outcomes["figure2-day1"], outcomes["table2-40-day1"]],
        "figure3": intervals_of(reproduction, "as-simulated"),
        "figure4": [outcomes["table1-0-day1-paper"]],
        "figure5": [outcomes["table1-40-day1-paper"]],
        "figure6": [outcomes["table2-40-day1-paper"]],
    }


def white_deviation(deg_per_sqrt_h: float, tau: ArrayLike) -> FloatArray:
    """Allan deviation of a white rate in deg/h."""
    # N of a white rate at tau = 1 s in deg/h is 60 of its figure in deg/sqrt(h).
    return np.asarray(deg_per_sqrt_h * 60.0 / np.sqrt(tau))


def excess(outcome: Outcome) -> float:
    """How many times the curve stands above the white rate that was simulated, at most."""
    white = white_deviation(outcome.truth_deg_per_sqrt_h, outcome.curve["tau"])
    return float(np.max(np.array(outcome.curve["deviation"]) / white))


def estimate_of(outcome: Outcome) -> float:
    """N, deg/sqrt(h); NaN if it was not estimated, or only bounded."""
    return outcome.value if outcome.status == "estimated" else math.nan


def error_of(value: float, outcome: Outcome) -> float:
    """Relative error of a value of N beside the truth of a run."""
    return value / outcome.truth_deg_per_sqrt_h - 1.0


ORDERS: Final[Mapping[Order, str]] = {
    "by_paper": "difference first",
    "as_printed": "the paper's order",
}


# What the cells of a table are compared by: N that is published, simulated, ours, and its method's.
QUANTITIES: Final[Mapping[str, Callable[[Cell], float]]] = {
    "paper": lambda one: one.published,
    "truth": lambda one: one.outcome.truth_deg_per_sqrt_h,
    "ours": lambda one: estimate_of(one.outcome),
    "its method": lambda one: one.by_paper.value,
}


class ReadingErrors(NamedTuple):
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
    errors = [reading_error(one, order, reading) for one in cells if one.rate > 0.0]
    return ReadingErrors(mean(errors), rms(errors), sum(map(math.isfinite, errors)), len(errors))


def reading_error(one: Cell, order: Order, reading: ReadingName) -> float:
    """Relative error of N by a reading; NaN of a curve too short for it."""
    return error_of(reading_of(one, order, reading), one.outcome)


def reading_of(one: Cell, order: Order, reading: ReadingName) -> float:
    """N by a reading of the paper's method in that order of its steps, deg/sqrt(h)."""
    outcome: Outcome = getattr(one, order)
    return outcome.readings[reading]


def turning_over_rest(cells: Sequence[Cell], value: Callable[[Cell], float]) -> float:
    """The paper's check of validity: mean N on the turning table over mean N at rest (Table 1)."""
    turning = mean(value(one) for one in cells if one.rate > 0.0)
    return turning / mean(value(one) for one in cells if one.rate == 0.0)


def mean(values: Iterable[float]) -> float:
    """Mean of those that are finite, NaN of nothing."""
    finite = [value for value in values if math.isfinite(value)]
    return sum(finite) / len(finite) if finite else math.nan


def rms(values: Iterable[float]) -> float:
    """Root mean square of those that are finite, NaN of nothing."""
    return math.sqrt(mean(value**2 for value in values))


def spread(values: Sequence[float]) -> str:
    """Smallest and largest of those that are finite, once if they are the same."""
    finite = [value for value in values if math.isfinite(value)]
    ends = sorted({min(finite), max(finite)}) if finite else []
    return " … ".join(map(number, ends)) or "–"


def intervals_of(reproduction: Reproduction, trial: str) -> list[Outcome]:
    """The runs of a trial, one for each interval of Figure 3."""
    return [reproduction.outcomes[f"figure3-{trial}-{interval:g}s"] for interval in FIGURE_3]


def trial_runs(
    reproduction: Reproduction, trial: str
) -> Iterator[tuple[tuple[float, float], Outcome]]:
    """Each interval of Figure 3 with the paper's N there, and the run of a trial."""
    return zip(FIGURE_3.items(), intervals_of(reproduction, trial), strict=True)


def readings(reproduction: Reproduction, trial: str, form: Form) -> list[str]:
    """N by least squares at each interval, 1e-4 deg/sqrt(h)."""
    fits = [outcome.least_squares for outcome in intervals_of(reproduction, trial)]
    return [f"{by_form[form] * 1e4:.1f}" if form in by_form else "–" for by_form in fits]


def growth(reproduction: Reproduction, trial: str) -> list[str]:
    """N at the longer intervals over N at the first.

    By the form in which no square may be below zero.
    """
    form: Form = "variance, plain, none below zero"
    values = (one.least_squares.get(form, math.nan) for one in intervals_of(reproduction, trial))
    first, *rest = values
    return [f"{value / first:.1f}" if first else "–" for value in rest]


def cell_texts(one: Cell, size: float) -> dict[str, str]:
    """One cell in units of `size` deg/sqrt(h); with it that of the paper's method."""
    outcome, by_paper = one.outcome, one.by_paper
    row = dict.fromkeys(("value", "error", "by_paper"), "–") | {"range": outcome.status}
    row["paper"] = f"{one.published / size:.2f}"
    row["truth"] = f"{outcome.truth_deg_per_sqrt_h / size:.3f}"
    if outcome.status == "estimated":
        row["value"] = f"{outcome.value / size:.3f}"
        row["range"] = f"{outcome.low / size:.3f} … {outcome.high / size:.3f}"
        row["error"] = percent(error_of(outcome.value, outcome))
    elif outcome.status == "upper bound":
        row["value"] = f"< {outcome.high / size:.3f}"
    if math.isfinite(by_paper.value):
        below = "< " if by_paper.status == "upper bound" else ""
        off = percent(error_of(by_paper.value, outcome))
        row["by_paper"] = f"{below}{by_paper.value / size:.3f} ({off})"
    return row


def percent(error: float) -> str:
    """A relative error with its sign."""
    return f"{100.0 * error:+.1f} %" if math.isfinite(error) else "no N"


def plain_percent(part: float) -> str:
    """A part of one, without a sign."""
    return f"{100.0 * part:.1f} %" if math.isfinite(part) else "–"


# ---- reproduction figures ----------------------------------------------------------


# Runs whose curves a figure shows, each with its style, by label.
Styled = Mapping[str, tuple[Outcome, Mapping[str, Any]]]


def figures_of(reproduction: Reproduction) -> dict[str, Figure]:
    """Figures 1 to 6, and N against table rate, by name."""
    curves = curves_of(reproduction)
    fris, fos = curves["figure2"]
    of_figure_2: Styled = {
        "fris, 9 s": (fris, {"color": ORANGE, "marker": "^", "linewidth": 1.0}),
        "fos, 1 s": (fos, {"color": BLUE, "marker": "o", "linestyle": "none"}),
    }
    styles = ((BLUE, "o"), (GREEN, "D"), (ORANGE, "^"))
    of_figure_3: Styled = {
        f"every {one.run.interval_s:g} s": (one, {"color": color, "marker": mark, "linewidth": 0.9})
        for one, (color, mark) in zip(curves["figure3"], styles, strict=True)
    }
    return {
        "figure1": frames_figure(),
        "figure2": _curves_figure(of_figure_2, "x − z per gyro", truth=fos),
        "figure3": _curves_figure(of_figure_3, "z", truth=curves["figure3"][0]),
        **{name: _curve_figure(*curves[name]) for name in ("figure4", "figure5", "figure6")},
        "table_rate": _rate_figure(reproduction),
    }


def _curves_figure(curves: Styled, channel: str, *, truth: Outcome) -> Figure:
    """Curves of runs with their styles by label, and the white rate that was simulated."""
    with styled(len(curves) + 1) as (figure, axes):
        for label, (outcome, style) in curves.items():
            axes.plot(outcome.curve["tau"], outcome.curve["deviation"], label=label, **style)
        _truth_line(axes, truth)
        logarithmic(axes, "cluster time τ (s)", f"Allan deviation, {channel} (°/h)")
    return figure


def _curve_figure(outcome: Outcome) -> Figure:
    """The curve as published: of the difference, points with an error of 10 % or less."""
    root, curve = math.sqrt(2.0), outcome.curve
    kept = np.array(curve["shown"])
    tau = np.array(curve["tau"])[kept]
    ends = [curve[name] for name in ("low", "deviation", "high")]
    low, middle, high = root * np.array(ends)[:, kept]
    with styled(3) as (figure, axes):
        band(axes, tau, low, high, BLUE, label=f"{per_cent(outcome.confidence)} interval")
        axes.plot(tau, middle, color=BLUE, marker="o", linestyle="none", label="x − z")
        _truth_line(axes, outcome, root)
        logarithmic(axes, "cluster time τ (s)", "Allan deviation, x − z (°/h)")
    return figure


def _truth_line(axes: Axes, outcome: Outcome, times: float = 1.0) -> None:
    tau = extent(np.array(outcome.curve["tau"]))
    white = times * white_deviation(outcome.truth_deg_per_sqrt_h, tau)
    axes.plot(tau, white, color=INK, linewidth=0.9, linestyle=DASHED, label="N as simulated")


def _rate_figure(reproduction: Reproduction) -> Figure:
    prediction, cells = reproduction.prediction, outcomes_of_table(reproduction, "table2")
    with styled(3) as (figure, axes):
        total = (prediction.total, "predicted", INK, "-")
        lock_in = (prediction.lock_in, "lock-in", BLUE, "--")
        quantum = (prediction.quantum, "quantum limit", GREEN, "--")
        for values, label, color, style in (total, lock_in, quantum):
            rates, sizes = prediction.rates / DEGREE, values / DEGREE_PER_ROOT_HOUR
            axes.plot(rates, sizes, color=color, linestyle=style, label=label)
        for name, marker, color in (("ours", "o", BLUE), ("paper", "x", ORANGE)):
            axes.plot(
                [one.rate for one in cells], list(map(QUANTITIES[name], cells)),
                linestyle="none", marker=marker, color=color, label=f"{name}, Table 2",
            )  # fmt: skip
        logarithmic(axes, "table rate (°/s)", "N̄ (°/√h)")
    return figure


# ---- reproduction tables -----------------------------------------------------------

_UNIT: Final = "[deg/sqrt(h)]"


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
    shown = {
        "estimate": "value", "95 % interval": "range", "truth": "truth", "error": "error",
        "paper's method": "by_paper", "paper": "paper",
    }  # fmt: skip
    blocks = []
    tables = {name: outcomes_of_table(reproduction, name) for name in TABLES}
    for name, cells in tables.items():
        rows = []
        for one in cells:
            texts = cell_texts(one, TABLES[name].size)
            rows.append((f"{one.rate:g}", str(one.day), *(texts[key] for key in shown.values())))
        text = table(("deg/s", "day", *shown), rows, right=(0, 1, 2, 4, 5, 6, 7))
        blocks.append(f"Table {name[-1]}, N per gyro, {TABLES[name].size:g} deg/sqrt(h)\n{text}")
    ratios = ", ".join(
        f"{name.replace('paper', 'the paper')} {turning_over_rest(tables['table1'], value):.3f}"
        for name, value in QUANTITIES.items()
    )
    validity = f"Check of validity, turning over rest (Table 1): {ratios}"
    return "\n\n".join((*blocks, _readings_text(tables), validity))


def _readings_text(tables: Mapping[Table, Sequence[Cell]]) -> str:
    """Error of each reading of Step 4 on the turning table, for a terminal."""
    places = [(order, name) for order in ORDERS for name in tables]
    rows = []
    for reading in READINGS:
        errors = (errors_of_reading(tables[name], order, reading) for order, name in places)
        rows.append((reading, *map(_error_text, errors)))
    head = (f"Table {name[-1]}, {ORDERS[order]}" for order, name in places)
    text = table(("Step 4", *head), rows, right=(1, 2, 3, 4))
    return f"The paper's method on the turning table, error in % (mean / rms)\n{text}"


def _error_text(errors: ReadingErrors) -> str:
    if not errors.shown:
        return "no N"
    lacking = errors.cells - errors.shown
    text = f"{100.0 * errors.mean:+.1f} / {100.0 * errors.rms:.1f}"
    return f"{text}, {lacking} without" if lacking else text


def _csv(rows: Iterable[Mapping[str, str]]) -> str:
    """Rows as CSV, a text by the header of its column each."""
    listed = list(rows)
    return csv_text(list(listed[0]), (list(row.values()) for row in listed))


def _table(reproduction: Reproduction, name: Table) -> str:
    return _csv(
        {
            "table_rate[deg/s]": cell(one.rate),
            "day": str(one.day),
            f"paper{_UNIT}": cell(one.published),
            **_estimate(one.outcome),
            "error": cell(error_of(one.outcome.value, one.outcome)),
            "lines": str(one.outcome.lines),
            "seed": str(one.outcome.run.config.seed),
            f"by_paper_method{_UNIT}": cell(one.by_paper.value),
            "by_paper_method_status": one.by_paper.status,
            "by_paper_method_error": cell(error_of(one.by_paper.value, one.outcome)),
            "duration[s]": cell(one.outcome.run.config.duration_s),
            **{
                f"{order}_{reading}{_UNIT}": cell(reading_of(one, order, reading))
                for order in ORDERS
                for reading in READINGS
            },
        }
        for one in outcomes_of_table(reproduction, name)
    )


def _trials(reproduction: Reproduction) -> str:
    return _csv(
        {
            "trial": trial.name,
            "interval[s]": cell(interval),
            f"paper{_UNIT}": cell(published),
            **{
                f"{form.replace(', ', ' ')}{_UNIT}": cell(outcome.least_squares.get(form, math.nan))
                for form in FORMS
            },
            **_estimate(outcome),
        }
        for trial in reproduction.trials
        for (interval, published), outcome in trial_runs(reproduction, trial.name)
    )


def _curves(outcomes: list[Outcome]) -> str:
    rows: list[list[str]] = []
    names = ("deviation", "low", "high")
    for outcome in outcomes:
        tau, *ends = (outcome.curve[name] for name in ("tau", *names))
        truth = white_deviation(outcome.truth_deg_per_sqrt_h, tau).tolist()
        points = zip(tau, *ends, truth, strict=True)
        rows += [[outcome.run.name, *map(cell, point)] for point in points]
    return csv_text(("run", "tau[s]", *(f"{name}[deg/h]" for name in (*names, "truth"))), rows)


def _table_rate(reproduction: Reproduction) -> str:
    prediction = reproduction.prediction
    columns = {"table_rate[deg/s]": prediction.rates / DEGREE}
    for name in ("total", "quantum", "lock_in"):
        columns[f"{name}{_UNIT}"] = getattr(prediction, name) / DEGREE_PER_ROOT_HOUR
    for name in ("quantization", "encoder", "jitter"):
        columns[f"{name}[arcsec]"] = getattr(prediction, name) / ARCSECOND
    return columns_text(columns)


def _estimate(outcome: Outcome) -> dict[str, str]:
    return {
        f"estimate{_UNIT}": cell(outcome.value),
        f"low{_UNIT}": cell(outcome.low),
        f"high{_UNIT}": cell(outcome.high),
        "confidence": cell(outcome.confidence),
        "status": outcome.status,
        f"truth{_UNIT}": cell(outcome.truth_deg_per_sqrt_h),
    }
