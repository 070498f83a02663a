"""The paper's figures and tables beside ours: one page, pictures and tables of numbers."""

import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from sagnac.core import units, whole_files
from sagnac.lines.published import SLOWEST_CYCLES
from sagnac.noise.readings import READINGS
from sagnac.paper import prediction, reproduce, trials
from sagnac.paper import tables as values
from sagnac.report.figures import svg, write_png
from sagnac.report.sections import rendered

# ---- reproduction page -------------------------------------------------------------


def page(reproduction: reproduce.Reproduction, figures: Mapping[str, Figure]) -> str:
    """The page as HTML; nothing in it is fetched.

    Parameters
    ----------
    reproduction
        What was made.
    figures
        By name, those of `tables.figures_of`.
    """
    cells = {name: reproduce.outcomes_of_table(reproduction, name) for name in prediction.TABLES}
    ours = values.QUANTITIES["ours"]
    fast = [one for one in cells["table2"] if one.rate > 20.0]
    dithered = [value for days in prediction.TABLE_1.values() for value in days]
    days = range(1, reproduction.scope.days + 1)
    fris = [reproduction.outcomes[f"figure2-day{day}"] for day in days]
    drawn = {name: svg(figure, name, f"{name}: see caption") for name, figure in figures.items()}
    biased = [value for rate, days in prediction.TABLE_2.items() if rate > 20.0 for value in days]
    return rendered(
        "reproduction.html",
        values=values,
        published=prediction,
        title="The experiment of Yu et al. (2013), regenerated on a simulated rig",
        reproduction=reproduction,
        figures=drawn,
        fris=fris,
        highest=max(map(values.excess, fris)),
        white=values.readings(reproduction, "white", trials.FORM),
        nearest=values.readings(reproduction, trials.NEAREST_TRIAL, trials.FORM),
        tables={name: _table(found, prediction.TABLES[name].size) for name, found in cells.items()},
        stationary=values.spread([ours(one) for one in cells["table1"] if one.rate == 0.0]),
        ratio=values.mean(map(ours, cells["table1"])) / values.mean(map(ours, fast)),
        paper_ratio=values.mean(dithered) / values.mean(biased),
        slowest=prediction.adequate_rate(reproduction.prediction) / units.DEGREE,
        slowest_cycles=SLOWEST_CYCLES,
    )


def _table(cells: Sequence[reproduce.Cell], size: float) -> dict[str, Any]:
    """A table on the page: its cells, and what they say together."""
    outcomes = [one.outcome for one in cells]
    errors = [abs(values.error_of(values.estimate_of(one), one)) for one in outcomes]
    known = [error for error in errors if math.isfinite(error)]
    return {
        "size": size,
        "unit": f"10{'⁻⁴' if size == 1e-4 else '⁻⁵'} °/√h",
        "cells": cells,
        "worst": f"{100.0 * max(known):.1f} %" if known else "–",
        "held": sum(one.low <= one.truth_deg_per_sqrt_h <= one.high for one in outcomes),
        "without": len(cells) - len(known),
        "spread": {name: _day_spread(cells, value) for name, value in values.QUANTITIES.items()},
        "rms": values.rms(values.error_of(one.value, one) for one in outcomes),
        "validity": _validity(cells),
    }


def _validity(cells: Sequence[reproduce.Cell]) -> dict[str, float]:
    """The paper's check of validity: mean N turning over mean N at rest."""
    without = [one for one in cells if one.published != max(prediction.TABLE_1[40.0])]
    over_rest, quantities = values.turning_over_rest, values.QUANTITIES
    return {
        "the paper’s numbers": over_rest(cells, quantities["paper"]),
        "the same without its highest cell": over_rest(without, quantities["paper"]),
        "the truth that was simulated": over_rest(cells, quantities["truth"]),
        "ours": over_rest(cells, quantities["ours"]),
        **{
            f"the paper’s method, {in_words}, {name}": over_rest(
                cells, partial(values.reading_of, order=order, reading=name)
            )
            for order, in_words in values.ORDERS.items()
            for name in READINGS
        },
    }


def _day_spread(cells: Sequence[reproduce.Cell], value: Callable[[reproduce.Cell], float]) -> float:
    """Root mean square over the rates of the days' standard deviation over their mean."""
    by_rate: dict[float, list[float]] = {}
    for one in cells:
        if math.isfinite(value(one)):
            by_rate.setdefault(one.rate, []).append(value(one))
    several = [days for days in by_rate.values() if len(days) > 1]
    return values.rms(float(np.std(days, ddof=1) / np.mean(days)) for days in several)


# ---- reproduction ------------------------------------------------------------------


def write(reproduction: reproduce.Reproduction, folder: Path) -> list[Path]:
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
    figures = values.figures_of(reproduction)
    pictures = {f"{name}.png": figure for name, figure in figures.items()}
    tables = {f"{name}.csv": text for name, text in values.tables(reproduction).items()}
    with whole_files.replacing_folder(folder) as new:
        for name, figure in pictures.items():
            write_png(figure, new / name)
        for name, text in tables.items():
            whole_files.write_text(new / name, text)
        whole_files.write_text(new / "reproduction.html", page(reproduction, figures))
    return [folder / name for name in ("reproduction.html", *pictures, *tables)]
