"""Tables of a report as CSV, and the names of files for channels."""

import csv
import io
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from itertools import zip_longest
from typing import Any, Final
from urllib.parse import quote

from sagnac.analysis.result import Analysis
from sagnac.core.errors import one_line
from sagnac.core.units import ARCSECOND, DEGREE, UNITS
from sagnac.lines.model import Line
from sagnac.report import quantities


def cell(value: float) -> str:
    """A number with nine significant digits; empty if there is none."""
    return f"{value:.9g}" if math.isfinite(value) else ""


def csv_text(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Header and rows as CSV, in which no text is a formula to a spreadsheet."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerows([as_text(one) for one in row] for row in (header, *rows))
    return text.getvalue()


def columns_text(columns: Mapping[str, Iterable[float]]) -> str:
    """Columns of numbers by their header as CSV; one that is shorter ends in empty cells."""
    rows = zip_longest(*columns.values(), fillvalue=math.nan)
    return csv_text(list(columns), ([cell(value) for value in row] for row in rows))


def as_text(content: str) -> str:
    """A cell that is a number or text: what would be a formula gets a quote before it.

    Examples
    --------
    >>> as_text("-1.5e-3"), as_text("=1+1"), as_text("x")
    ('-1.5e-3', "'=1+1", 'x')
    """
    plain = one_line(content)
    # A spreadsheet computes a cell that begins so.
    if not plain.startswith(("=", "+", "-", "@")):
        return plain
    try:
        float(plain)
    except ValueError:
        return f"'{plain}"
    return plain


def csv_files(analysis: Analysis) -> dict[str, str]:
    """The tables of a report as CSV by the names of their files."""
    named = {"stability.csv": stability_table(analysis), "lines.csv": line_table(analysis)}
    if analysis.family:
        named |= {"family.csv": family_table(analysis), "psd.csv": density_table(analysis)}
    return named


def stability_table(analysis: Analysis) -> str:
    """CSV of the curve, per gyro, after and before removal; units stand in the header."""
    units = {"tau": "[s]", **dict.fromkeys(("deviation", "low", "high"), "[deg/h]")}
    columns = {}
    for prefix, curve in {"": analysis.curve, "before_": analysis.curve_before}.items():
        for name, values in quantities.curve_columns(curve, UNITS["deg/h"]).items():
            columns[f"{prefix}{name}{units.get(name, '')}"] = values
    return columns_text(columns)


def family_table(analysis: Analysis) -> str:
    """CSV of every curve asked for, per gyro, one below the other."""
    rows = []
    for curve in analysis.family:
        unit = quantities.curve_unit(curve.estimator)
        for row in zip(*quantities.curve_columns(curve).values(), strict=True):
            rows.append([curve.estimator, unit.name, *map(cell, row)])
    header = ("estimator", "unit", "tau[s]", "deviation", "low", "high", "edf", "terms")
    return csv_text((*header, "noise_type"), rows)


def density_table(analysis: Analysis) -> str:
    """CSV of the multitaper rate spectrum, per gyro, one-sided."""
    shown = quantities.shown_density(analysis)
    return columns_text({"frequency[Hz]": shown.frequency, "density[(deg/h)^2/Hz]": shown.density})


def line_data(line: Line) -> dict[str, Any]:
    """A line as plain data, in the field's units."""
    kind, unit = LINE_PLACES[line.scale]
    return {
        "scale": line.scale,
        f"{kind}{unit}": line.frequency,
        f"{kind}_error{unit}": line.frequency_error,
        **{key: getattr(line, field) / size for key, (field, size) in LINE_FIGURES.items()},
        "channel": line.channel,
        "significance": line.significance,
        "name": line.name,
    }


# Key of a document for the place of a line by its scale, and the unit behind it; key -> field of a
# line and the size of its unit, for all else.
LINE_PLACES: Final = {"angle": ("order", ""), "time": ("frequency", "_hz")}
LINE_FIGURES: Final = {
    "amplitude_arcsec": ("amplitude", ARCSECOND),
    "amplitude_error_arcsec": ("amplitude_error", ARCSECOND),
    "phase_deg": ("phase", DEGREE),
    "phase_error_deg": ("phase_error", DEGREE),
}


def line_table(analysis: Analysis) -> str:
    """CSV of the lines, strongest first; units stand in the header."""
    places = ("order", "order_error", "frequency_hz", "frequency_error_hz")
    keys = ("scale", *places, *LINE_FIGURES, "significance", "channel", "name")
    rows = [
        [value if isinstance(value := found.get(key, ""), str) else cell(value) for key in keys]
        for found in map(line_data, analysis.lines)
    ]
    header = [re.sub(r"_(hz|arcsec|deg)$", r"[\1]", key).replace("[hz]", "[Hz]") for key in keys]
    return csv_text(header, rows)


# ---- files -------------------------------------------------------------------------


def folder_name(name: str) -> str:
    """A file name for a channel, whatever its name is: it comes out of a file.

    Examples
    --------
    >>> folder_name("x"), folder_name("../../x"), folder_name("..")
    ('x', '..%2F..%2Fx', '%2E%2E')
    """
    # Characters that a file system takes in a name, with room for what is put before it.
    safe = quote(name, safe=" ")[:180]
    return safe if safe.strip(". ") else "".join(f"%{ord(mark):02X}" for mark in safe)
