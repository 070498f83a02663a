"""Both tables of a reproduction as the section "An outcome" of its page in the docs.

``sagnac reproduce -o DIR`` makes the tables, ``python -m benchmarks.reproduction DIR --write`` puts
them into the page.
"""

import argparse
import csv
import math
import os
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Final

import numpy as np

from benchmarks._made import made_page, with_stamp
from benchmarks.stability import PAGE as STABILITY_PAGE
from sagnac import __version__
from sagnac.noise.readings import READINGS, ReadingName
from sagnac.paper.prediction import TABLES
from sagnac.paper.reproduce import Order
from sagnac.paper.tables import ORDERS

PAGE: Final = STABILITY_PAGE.with_name("reproduce.md")
FOLDER: Final = Path("reproduction")
BEGIN: Final = "<!-- Made by python -m benchmarks.reproduction DIR --write -->"
END: Final = "<!-- End of what is made -->"
UNIT: Final = "[deg/sqrt(h)]"

Row = Mapping[str, str]


def rows_of(folder: Path, table: str) -> list[Row]:
    """The cells of a table, as ``sagnac reproduce`` wrote them."""
    with (folder / f"{table}.csv").open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))


def value(row: Row, name: str) -> float:
    """A number of a cell; NaN if there is none."""
    text = row[name]
    return float(text) if text else math.nan


def truth(row: Row) -> float:
    return value(row, f"truth{UNIT}")


def ours(row: Row) -> float:
    return value(row, f"estimate{UNIT}") if row["status"] == "estimated" else math.nan


def by_paper(row: Row) -> float:
    shown = row["by_paper_method_status"] == "estimated"
    return value(row, f"by_paper_method{UNIT}") if shown else math.nan


def by_reading(row: Row, order: Order, reading: ReadingName) -> float:
    return value(row, f"{order}_{reading}{UNIT}")


def is_turning(row: Row) -> bool:
    return value(row, "table_rate[deg/s]") > 0.0


def off(found: float, row: Row) -> str:
    """Relative error of a value, in %."""
    return f"{100.0 * (found / truth(row) - 1.0):+.1f} %" if math.isfinite(found) else "–"


def holds(row: Row) -> bool:
    return value(row, f"low{UNIT}") <= truth(row) <= value(row, f"high{UNIT}")


def table_text(rows: Sequence[Row], name: str, size: float) -> list[str]:
    """A row for each cell, in units of `size` deg/sqrt(h)."""
    power = round(-math.log10(size))
    sign = "⁻" + "".join("⁰¹²³⁴⁵⁶⁷⁸⁹"[int(digit)] for digit in str(power))

    def shown(number: float, digits: int) -> str:
        return f"{number / size:.{digits}f}" if math.isfinite(number) else "–"

    text = [
        f"| Table {name[-1]}, °/s | day | truth, 10{sign} °/√h | ours | 95 % | off "
        "| the paper's method | off | the paper's number |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for row in rows:
        ends = (shown(value(row, f"{end}{UNIT}"), 3) for end in ("low", "high"))
        text.append(
            f"| {value(row, 'table_rate[deg/s]'):g} | {row['day']} | {shown(truth(row), 3)} "
            f"| {shown(ours(row), 3)} | {' to '.join(ends)} | {off(ours(row), row)} "
            f"| {shown(by_paper(row), 3)} | {off(by_paper(row), row)} "
            f"| {shown(value(row, f'paper{UNIT}'), 2)} |"
        )
    return text


def errors_of(rows: Sequence[Row], found: Callable[[Row], float]) -> np.ndarray:
    """Relative errors of what is estimated, in %."""
    each = np.array([100.0 * (found(row) / truth(row) - 1.0) for row in rows])
    return each[np.isfinite(each)]


def spread_of(rows: Sequence[Row], found: Callable[[Row], float]) -> list[float]:
    """Standard deviation over mean of the days, in %, at each rate of three days."""
    rates: dict[str, list[float]] = {}
    for row in rows:
        rates.setdefault(row["table_rate[deg/s]"], []).append(found(row))
    return [
        100.0 * float(np.std(days, ddof=1) / np.mean(days))
        for days in rates.values()
        if len(days) > 1
    ]


def summary(rows: Sequence[Row], name: str) -> str:
    """What a table says, in one paragraph."""
    own, paper = errors_of(rows, ours), errors_of(rows, by_paper)
    held = sum(holds(row) for row in rows)
    text = (
        f"Table {name[-1]}: ours is off by {np.sqrt(np.mean(own**2)):.1f} % rms "
        f"({own.min():+.1f} to {own.max():+.1f} %), {own.size} estimates in {len(rows)} cells, and "
        f"{held} of {len(rows)} intervals hold the truth. "
    )
    if paper.size:
        text += (
            f"The paper's method is off by {np.sqrt(np.mean(paper**2)):.1f} % rms "
            f"({paper.min():+.1f} to {paper.max():+.1f} %), {paper.size} estimates. "
        )
    scatters = {
        "the truth": truth,
        "ours": ours,
        "the paper's method": by_paper,
        "the paper's numbers": lambda row: value(row, f"paper{UNIT}"),
    }
    if spread_of(rows, truth):
        parts = [
            f"{what} by {np.nanmin(each):.0f} to {np.nanmax(each):.0f} %"
            for what, found in scatters.items()
            if np.isfinite(each := spread_of(rows, found)).any()
        ]
        text += f"Scatter of the days at one rate: {', '.join(parts)}."
    return text.strip()


def readings_text(tables: Mapping[str, Sequence[Row]]) -> list[str]:
    """Mean and rms error of every reading on the turning table, in both orders of the steps."""
    places = [(order, name) for order in ORDERS for name in tables]
    text = [
        "| `--step-4` | "
        + " | ".join(f"Table {name[-1]}, {ORDERS[order]}" for order, name in places)
        + " |",
        "|---|" + "---|" * len(places),
    ]
    for reading in READINGS:
        cells = []
        for order, name in places:
            rows = [row for row in tables[name] if is_turning(row)]
            errors = errors_of(rows, partial(by_reading, order=order, reading=reading))
            lacking = f" ({len(rows) - errors.size} show no N)" if errors.size < len(rows) else ""
            cells.append(
                f"{errors.mean():+.1f} / {np.sqrt(np.mean(errors**2)):.1f}{lacking}"
                if errors.size
                else "no N"
            )
        text.append(f"| `{reading}` | " + " | ".join(cells) + " |")
    return [*text, "", "Error of N on the turning table in %, mean / rms."]


def validity_text(rows: Sequence[Row]) -> str:
    """The check of validity, turning over rest."""

    def ratio(found: Callable[[Row], float]) -> float:
        turning = np.nanmean([found(row) for row in rows if is_turning(row)])
        return float(turning / np.nanmean([found(row) for row in rows if not is_turning(row)]))

    def of_paper(row: Row) -> float:
        return value(row, f"paper{UNIT}")

    highest = max(of_paper(row) for row in rows)
    without = [row for row in rows if of_paper(row) != highest]
    turning = np.mean([of_paper(row) for row in without if is_turning(row)])
    still = np.mean([of_paper(row) for row in without if not is_turning(row)])
    literal = ratio(partial(by_reading, order="as_printed", reading="relative"))
    return (
        "*The check of validity*, mean N of Table 1 turning over mean N at rest: "
        f"{ratio(of_paper):.2f} in the paper ({turning / still:.2f} without its highest cell), "
        f"{ratio(truth):.3f} in truth, {ratio(ours):.3f} by ours, {ratio(by_paper):.3f} by its "
        f"method as it is run here, and {literal:.2f} by relative squares in the paper's order, "
        "where the search takes noise that is not put back."
    )


def section(folder: Path) -> str:
    """The section, without its heading."""
    tables = {name: rows_of(folder, name) for name in TABLES}
    (duration,) = {value(row, "duration[s]") for rows in tables.values() for row in rows}
    made = time.strftime("%Y-%m-%d", time.gmtime((folder / "table1.csv").stat().st_mtime))
    text = [
        f"`sagnac reproduce`, version {__version__}, {made}; {duration / 3600.0:g} h for a cell. "
        "*Off* is against the simulated truth. *The paper's method* is `fos-paper` as it is by "
        "default. At 0 °/s nothing is removed for it, as in the paper. The spread of lock-in, "
        "lines and temperature over the days is assumed.",
        "",
    ]
    for name, rows in tables.items():
        text += [*table_text(rows, name, TABLES[name].size), "", summary(rows, name), ""]
    text += [*readings_text(tables), "", validity_text(tables["table1"]), ""]
    return "\n".join(text)


def with_section(page: str, text: str) -> str:
    """The page with what is made put between its marks.

    Raises
    ------
    ValueError
        If the page has not one of each.
    """
    if page.count(BEGIN) != 1 or page.count(END) != 1:
        raise ValueError(f"{PAGE.name} has not one line {BEGIN!r} and one line {END!r}")
    before, rest = page.split(BEGIN)
    _, after = rest.split(END)
    return f"{before}{BEGIN}\n\n{text}\n{END}{after}"


def main(arguments: list[str]) -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.reproduction", description=__doc__)
    parser.add_argument("folder", type=Path, nargs="?", default=FOLDER, metavar="DIR")
    parser.add_argument("--write", action="store_true", help=f"put it into docs/{PAGE.name}")
    options = parser.parse_args(arguments)
    try:
        text = section(options.folder)
    except FileNotFoundError as error:
        print(
            f"{error.filename} is not there; make it with sagnac reproduce -o {options.folder}",
            file=sys.stderr,
        )
        return
    print(text)
    if options.write:
        page = with_section(PAGE.read_text(encoding="utf-8"), text)
        draft = PAGE.with_suffix(".part")
        draft.write_text(with_stamp(page, made_page(PAGE.name).digest), encoding="utf-8")
        os.replace(draft, PAGE)


if __name__ == "__main__":
    main(sys.argv[1:])
