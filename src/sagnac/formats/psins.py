"""PSINS ``.imu`` text logs: increments in counts, after a header that sizes them.

Reference: the comment block of the files that the PSINS toolbox (G. Yan) writes. Three
lines of six numbers follow it: the second holds the sampling interval (ms, fifth) and g (m/s²,
sixth), the third the size of one gyro count (arcsec, first to third) and of one accelerometer
count (1e-6 g s, fourth to sixth).
"""

from pathlib import Path
from typing import Final

from sagnac.core.errors import RecordingError
from sagnac.formats import csv, source, statement, text_layout
from sagnac.formats.text import text_file
from sagnac.recording.columns import ACCELEROMETER_NAMES, GYRO_NAMES

_HEADER_ROWS: Final = 3
_ROW: Final = (*GYRO_NAMES, *ACCELEROMETER_NAMES)


def open_source(path: Path) -> source.Source:
    """Columns by the header of the log, kind ``increment``.

    Gyros are ``x``, ``y``, ``z``; accelerometers are ``ax``, ``ay``, ``az`` if the header sizes all
    of their counts.

    Raises
    ------
    RecordingError
        If the header is not there or states what cannot be.
    """
    text = text_file(path)
    plain = [number for number, line in enumerate(text.head) if text_layout.is_plain(line)]
    rows = [text.head[number].split() for number in plain[: _HEADER_ROWS + 1]]
    # Without the comments that open a log, the first rows of its data would pass for a header.
    is_commented = bool(plain) and any(map(str.strip, text.head[: plain[0]]))
    if not is_commented or [len(row) for row in rows[:_HEADER_ROWS]] != [len(_ROW)] * _HEADER_ROWS:
        fact = "has no PSINS header, three lines of six numbers after the comments"
        remedy = "correct it, or give a CSV with {rate}, {kind} and {unit}"
        raise RecordingError(fact, remedy=remedy)
    if rows[_HEADER_ROWS:] and len(rows[_HEADER_ROWS]) != len(_ROW):
        raise ValueError(f"rows of {len(rows[_HEADER_ROWS])} numbers, not {len(_ROW)}")
    header = [[float(number) for number in row] for row in rows[:_HEADER_ROWS]]
    interval_ms, gravity = header[1][4:]
    gyros, forces = header[2][:3], header[2][3:]
    if not (interval_ms > 0.0 and all(size > 0.0 for size in gyros)):
        fact = f"the header states a sampling interval of {interval_ms:g} ms and gyro factors of "
        fact += f"{', '.join(f'{size:g}' for size in gyros)} arcsec"
        raise RecordingError(fact, remedy="all must be positive")
    units = [f"{size!r}arcsec" for size in gyros]
    micro_g = 1e-6 * gravity
    if all(micro_g * size > 0.0 for size in forces):
        units += [f"{micro_g * size!r}m/s" for size in forces]
    columns = (
        source.Column(key=name, name=name, unit=unit, kind="increment", number=number)
        for number, (name, unit) in enumerate(zip(_ROW, units, strict=False), start=1)
    )
    laid_out = text_layout.Layout(
        text=text,
        columns=tuple(columns),
        forms=tuple("number" for _ in _ROW),
        delimiter=" ",
        stated=statement.Statement(sample_rate=round(1e3 / interval_ms, 9)),
        skip=plain[_HEADER_ROWS - 1] + 1,
        first_row=tuple(*rows[_HEADER_ROWS:]),
    )
    return csv.source_of(laid_out)
