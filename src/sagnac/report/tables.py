"""Tables as CSV; units stand in the headers."""

import csv
import io
import math
from collections.abc import Iterable, Sequence
from typing import Final

from sagnac.analysis.result import Analysis
from sagnac.errors import one_line
from sagnac.report.quantities import curve_unit
from sagnac.report.spectra import per_gyro_density
from sagnac.units import ARCSECOND, DEGREE, DEGREE_PER_HOUR

# A spreadsheet computes a cell that begins so.
_FORMULA: Final = ("=", "+", "-", "@")


def cell(value: float) -> str:
    """A number with nine significant digits; empty if there is none."""
    return f"{value:.9g}" if math.isfinite(value) else ""


def csv_text(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Header and rows as CSV, in which no text is a formula to a spreadsheet."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerows([as_text(one) for one in row] for row in (header, *rows))
    return text.getvalue()


def as_text(content: str) -> str:
    """A cell that is a number or text: what would be a formula gets a quote before it.

    Examples
    --------
    >>> as_text("-1.5e-3"), as_text("=1+1"), as_text("x")
    ('-1.5e-3', "'=1+1", 'x')
    """
    plain = one_line(content)
    if not plain.startswith(_FORMULA):
        return plain
    try:
        float(plain)
    except ValueError:
        return f"'{plain}"
    return plain


def stability_table(analysis: Analysis) -> str:
    """CSV of the curve, per gyro, after and before removal; units stand in the header."""
    columns = {
        f"{prefix}{name}": values
        for prefix, measured in (("", analysis.curve), ("before_", analysis.curve_before))
        for curve in (measured.per_gyro(),)
        for name, values in (
            ("tau[s]", curve.tau),
            ("deviation[deg/h]", curve.deviation / DEGREE_PER_HOUR),
            ("low[deg/h]", curve.low / DEGREE_PER_HOUR),
            ("high[deg/h]", curve.high / DEGREE_PER_HOUR),
            ("edf", curve.edf),
            ("terms", curve.terms),
            ("noise_type", curve.noise_type),
        )
    }
    longest = max(len(values) for values in columns.values())
    rows = [
        [
            cell(values[index]) if index < len(values) else ""
            for values in (column.tolist() for column in columns.values())
        ]
        for index in range(longest)
    ]
    return csv_text(list(columns), rows)


def family_table(analysis: Analysis) -> str:
    """CSV of every curve asked for, per gyro, one below the other."""
    rows = []
    for measured in analysis.family:
        curve = measured.per_gyro()
        unit = curve_unit(curve.estimator)
        columns = (
            curve.tau,
            curve.deviation / unit.size,
            curve.low / unit.size,
            curve.high / unit.size,
            curve.edf,
            curve.terms,
            curve.noise_type,
        )
        rows += [
            [curve.estimator, unit.name, *(cell(value) for value in row)]
            for row in zip(*(column.tolist() for column in columns), strict=True)
        ]
    header = ("estimator", "unit", "tau[s]", "deviation", "low", "high", "edf", "terms")
    return csv_text((*header, "noise_type"), rows)


def density_table(analysis: Analysis) -> str:
    """CSV of the multitaper rate spectrum, per gyro, one-sided."""
    shown = per_gyro_density(analysis)
    rows = zip(shown.frequency.tolist(), shown.density.tolist(), strict=True)
    return csv_text(
        ("frequency[Hz]", "density[(deg/h)^2/Hz]"), ([cell(value) for value in row] for row in rows)
    )


def line_table(analysis: Analysis) -> str:
    """CSV of the lines, strongest first; units stand in the header."""
    header = (
        "scale",
        "order",
        "order_error",
        "frequency[Hz]",
        "frequency_error[Hz]",
        "amplitude[arcsec]",
        "amplitude_error[arcsec]",
        "phase[deg]",
        "phase_error[deg]",
        "significance",
        "channel",
        "name",
    )
    rows = []
    for line in analysis.lines:
        position = [cell(line.frequency), cell(line.frequency_error)]
        rows.append(
            [
                line.scale,
                *(position if line.scale == "angle" else ["", ""]),
                *(position if line.scale == "time" else ["", ""]),
                cell(line.amplitude / ARCSECOND),
                cell(line.amplitude_error / ARCSECOND),
                cell(line.phase / DEGREE),
                cell(line.phase_error / DEGREE),
                cell(line.significance),
                line.channel,
                line.name,
            ]
        )
    return csv_text(header, rows)
