"""Statements in the preamble of a LabVIEW measurement file (``.lvm``) about its columns.

Reference: "Specification for the LabVIEW Measurement File (.lvm)", National Instruments: lines of
a key and a value for each channel; two headers, each ended by ``***End_of_Header***``.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from sagnac.formats.text_numbers import style_of

_BEGINNING: Final = "LabVIEW Measurement"
X_COLUMN: Final = "X_Value"


@dataclass(frozen=True, slots=True, kw_only=True)
class Preamble:
    """Statements of a preamble.

    Attributes
    ----------
    units
        Units of the channels, in their order; one that is not stated is empty.
    sample_rate
        Hz, where no column holds the times; None if one does.
    """

    units: tuple[str, ...] = ()
    sample_rate: float | None = None


def preamble_of(lines: Sequence[str], delimiter: str) -> Preamble | None:
    """The preamble among the lines before a table, None if LabVIEW did not write them.

    Parameters
    ----------
    lines
        From the first of the file.
    delimiter
        Between two fields.

    Examples
    --------
    >>> lines = ["LabVIEW Measurement", "X_Columns;No", "Delta_X;0,01", "Y_Unit_Label;deg/s"]
    >>> preamble_of(lines, ";")
    Preamble(units=('deg/s',), sample_rate=100.0)
    """
    if not lines or not lines[0].startswith(_BEGINNING):
        return None
    values: dict[str, list[str]] = {}
    for line in lines:
        key, *rest = line.split(delimiter)
        values[key.strip()] = [value.strip() for value in rest]
    units = values.get("Y_Unit_Label", [])
    steps = [text for text in values.get("Delta_X", []) if text]
    rate = None
    if steps and values.get("X_Columns", [""])[0].lower() == "no":
        style = style_of(steps)
        step = style.value(steps[0]) if style.holds(steps[0]) else 0.0
        # The step is written in decimals: 0.01 s stands for 100 Hz.
        rate = round(1.0 / step, 9) if step > 0.0 else None
    return Preamble(units=tuple(units), sample_rate=rate)
